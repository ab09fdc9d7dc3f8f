"""Check a stability certificate (docs/certificate.md) with Python alone: python3 verify.py CERTIFICATE [--spec SPEC].

Nothing that the certificate's author computed is believed: every inequality is decided anew in exact rational
arithmetic, and what is not rational (sin, exp, sqrt) is enclosed. That the matrix is that of the C beside it, the
kernel (kernel.py) proves by the proof.json there. Exit status: 0 verified, and proved to be of the C; 4 the same where
the conditions hold that are printed; 5 the inequalities hold, and were not bound to code; 3 refused; 2 a file that
cannot be read, is too large or no JSON. In place of the certificate its folder may be given, or a proof.json.
"""

import argparse
import errno
import hashlib
import json
import os
import re
import runpy
import signal
import sys
from collections import namedtuple
from contextlib import suppress
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from reprlib import repr as brief
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any
from unicodedata import east_asian_width


def load_part(name: str, **given: SimpleNamespace) -> SimpleNamespace:
    """The names that NAME.py in this file's folder defines: compiled from that text, not read from cached bytecode."""
    return SimpleNamespace(**runpy.run_path(str(Path(__file__).with_name(f"{name}.py")), given))


if TYPE_CHECKING or __package__:
    from codegen.checker import agreement, decay, enclosure, files, forms, frame, kernel, statements, theorem
else:
    parts: dict[str, SimpleNamespace] = {}  # each is given those before it
    for part in ("files", "frame", "decimals", "enclosure", "kernel", "forms", "decay", "rounding", "errors", "held",
                 "reversal", "ellipsoid", "theorem", "statements", "agreement"):  # fmt: skip
        parts[part] = load_part(part, **parts)
    globals().update(parts)
Refused, demand, show = enclosure.Refused, enclosure.demand, enclosure.show
parse, widen, MAX_STRING = enclosure.parse, enclosure.widen, enclosure.MAX_STRING
PROOF, SETS, by_kernel, of_its_proof = theorem.PROOF, theorem.SETS, agreement.bound, agreement.of_its_proof
by_kernel_alone = theorem.proved
integers, require = kernel.integers, forms.require
CERTIFICATE = "certificate.json"
MAX_TEXT, MAX_SIZE, MAX_FILES, MAX_PARTS = 5_000_000, 32, 1000, 50_000
FORMS = json.loads(r"""{"FORMAT": "stiction-certificate/1", "TEXT": ".*",
    "NAME": "[A-Za-z][A-Za-z0-9_]*", "WORD": "[A-Za-z0-9_]{1,200}",
    "FILE": "[A-Za-z0-9_][A-Za-z0-9_.+-]{0,127}", "WHOLE": "0|[1-9][0-9]{0,8}",
    "LINE": ".*\\S.*", "HASH": "[0-9a-f]{64}", "STEP": "euler|semi_implicit|exponential|implicit"}""")
# unbound: files named, but not there. proved: what the kernel shows of the C, in words; unproved: why nothing; whole:
# whether without conditions.
Report = namedtuple("Report", "name claim facts unbound open assumptions proved unproved whole")
TEXTS = ("makefile", "license", "readme", "copying", "dockerfile")  # without a suffix, and no header of any library
HEADERS = r"\.(h|tcc|inl|modulemap)(\.|$)|^module\.map$"  # names, in small letters
# Exit statuses: proved of the C where stated conditions hold; the inequalities hold, and were not bound to code.
DOMAIN, NO_CODE = 4, 5
CLAUSE = r"[:;] (?![^(]*\))"  # the end of a reason's first clause, outside brackets
MAKES, COMMAND, MAX_REASON = "stiction generate SPEC", "stiction generate [A-Za-z0-9_./ =+-]{1,200}", 500
FEW = 4  # bounds that are printed before the rest
ALWAYS = (  # not checked, whatever is given
    "what __init__.py, the Python version, computes (`stiction generate --check` compares it with the tool's output)",
    "what options and macros of a command line (CMakeLists.txt, NAME.mk) make of the C, such as -ffast-math, with which"
    " a compiler may leave out the test for invalid samples",
    "any other C beside it, such as a main program or NAME_lanes.c",
    "that the model (M, g, input gain) describes the real machine, and that the envelope is that of the specification",
    "that the units of forces, levels and inputs in NAME.h fit the machine's (that of a velocity fits its position's)",
)
# A certificate, as files.conform reads it: {"FORM": ...} is an object with any keys of that form.
SCHEMA = json.loads("""{"format": "FORMAT", "tool": {"name": "TEXT", "version": "TEXT", "command": "TEXT"},
    "subject": {"name": "WORD", "spec_sha256": "HASH", "files": {"FILE": "HASH"}},
    "observer": {"kind": "TEXT", "velocity": "TEXT", "integration": "STEP"}, "claim": "LINE", "assumptions": ["LINE"],
    "sample_time": "RATIONAL", "decay_rate": "RATIONAL", "error": [{"name": "WORD", "meaning": "TEXT", "unit": "TEXT"}],
    "variables": {"NAME": ["RATIONAL"]}, "splits": {"NAME": ["RATIONAL"]}, "along": ["RATIONAL"],
    "parameters": [{"name": "NAME", "expression": "ANY"}], "matrix": [["ANY"]], "lyapunov_matrix": [["RATIONAL"]],
    "cover": ["ANY"],
    "reversals": [{"contact": "WORD", "flips": ["WHOLE"], "growth": "RATIONAL", "dwell_samples": "WHOLE"}]}""")


def leaf(raw: Any, form: str, where: str) -> Any:
    """A text or number of a certificate as a Python value, if it is of its form; or Refused, with the place."""
    if form == "ANY":
        return raw
    if form == "RATIONAL":
        return enclosure.rational(raw, where)
    good = isinstance(raw, bytes if form == "WHOLE" else str) and len(raw) <= MAX_STRING
    text = raw.decode() if good and form == "WHOLE" else raw
    good = good and text.isprintable() and re.fullmatch(FORMS[form], text) is not None  # the unprintable could forge
    demand(good, f"{where}: {brief(raw)} is no {brief(form)}, printable and of at most {MAX_STRING} characters")
    return int(text) if form == "WHOLE" else text


def reversal(entry: dict[str, Any], P: tuple[tuple[int, ...], ...], fall: Fraction) -> str:
    """Verifies growth and dwell time of one reversal (theorem 4), and returns the statement in words; or Refused.

    Args:
        P: times a number that makes it whole.
    """
    where, flips, growth, left = (entry[key] for key in ("contact", "flips", "growth", "dwell_samples"))
    where, size = f"reversal of {where}", range(len(P))
    demand(growth >= 1, f"{where}: growth {show(growth)} is below 1")
    demand(sorted({*flips} & {*size}) == sorted(flips), f"{where}: flips {brief(flips)} twice or not below {len(size)}")
    why = forms.turns(P, tuple(sorted(flips)), growth)
    demand(not why, f"{where}: V may grow by more than {show(growth)}: {why}")
    after = enclosure.decayed(growth, fall, left)
    fact = f"{where}: V grows at most {enclosure.most(growth)}-fold, and {left} samples later"
    demand(after <= 1, f"{fact} may still be {show(after)} times its value before")
    return f"{fact} is not above its value before"


def verify(top: dict[str, Any]) -> list[str]:
    """Verifies all inequalities of a certificate; returns the proved statements in words, or raises Refused.

    Nothing is said here about which code the matrices belong to.
    """
    n, h, alpha = len(top["error"]), top["sample_time"], top["decay_rate"]
    demand(1 <= n <= MAX_SIZE, f"{n} error components, not 1 to {MAX_SIZE}")
    for part, key in (("error", "name"), ("parameters", "name"), ("reversals", "contact")):
        demand(len({entry[key] for entry in top[part]}) == len(top[part]), f"{part}: a {key} appears twice")
    P = top["lyapunov_matrix"]
    for part, rows in (("matrix", top["matrix"]), ("lyapunov_matrix", P)):
        demand([len(row) for row in rows] == [n] * n, f"{part} is not {n} by {n}")
    implicit, along = top["observer"]["integration"] == "implicit", top["along"]
    law = "1/(1 + alpha*h)^2" if implicit else "1 - 2*alpha*h"
    fall = (alpha > 0) / (1 + abs(alpha * h)) ** 2 if implicit else 1 - 2 * alpha * h
    demand(min(h, fall) > 0, f"h {show(h)}, alpha {show(alpha)}, the fall of V {show(fall)}: not all positive")
    demand(top["splits"].keys() <= top["variables"].keys(), "splits: a name is no variable")
    demand(all(e["name"] not in top["variables"] for e in top["parameters"]), "parameters: a name is a variable's")
    plain = len(top["cover"]) < 2 and not (top["cover"] and (implicit or along or top["splits"]))
    demand(plain, "cover: two of them, or beside an implicit step, a refutation or splits")
    axes = {}
    for name, ends in top["variables"].items():
        at = top["splits"].get(name, ends)
        rise = all(a < b for a, b in pairwise(at)) or (at is ends and ends[:1] <= ends[1:])
        demand(rise and len(at) > 1 and at[:1] + at[-1:] == ends, f"{name}: no [low, high], or splits not so ordered")
        axes[name] = list(pairwise(at))
    demand(all(P[i][j] == P[j][i] for i in range(n) for j in range(i)), "lyapunov_matrix is not symmetric")
    whole = tuple(map(tuple, integers(P)[0]))
    if not along:
        require(whole, "P is not positive definite", definite=True)
    if along:  # P would be the sum of Phi'^k gap Phi^k/fall^(k+1) > 0 if the error fell so fast
        demand(len(along) == n and any(along) and not top["reversals"], "along is no direction, or there are reversals")
        (x,), _ = integers([along])  # times what is above 0
        value = sum(a * b * whole[i][j] for i, a in enumerate(x) for j, b in enumerate(x))
        demand(value <= 0, "P is positive along it")
    seen = decay.require_fall(top, axes, fall)
    who = "no V with P > 0" if along else "V"
    facts = ["P is not positive definite" if along else f"P is positive definite: {n} positive pivots"]
    factor = enclosure.least(fall) if along else enclosure.most(fall)  # that no V falls to less is the weaker claim
    facts += [f"{seen}: {who} is multiplied by at most {law} = {factor} in every sample"]
    facts += [reversal(entry, whole, fall) for entry in top["reversals"]]
    own = all([top["error"][i]["name"] for i in e["flips"]] == [f"e_a_{e['contact']}"] for e in top["reversals"])
    demand(own, "reversals: flips are not the error e_a_CONTACT of their contact")
    return facts


def in_time(top: dict[str, Any]) -> list[str]:
    """What ``verify`` says, or refused where that takes too long."""
    try:
        with frame.limited(frame.OF_ALGEBRA):
            return verify(top)
    except ValueError as why:
        raise Refused(str(why)) from None


def unchanged(top: dict[str, Any], sources: dict[str, bytes], spec: Path | None) -> list[str]:
    """Compares the SHA-256 of files with those that the certificate states; Refused where one differs."""
    stated = {name: (sources[name], digest) for name, digest in top["subject"]["files"].items() if name in sources}
    given = {} if spec is None else {spec.name: (files.read(spec), top["subject"]["spec_sha256"])}
    for name, (content, expected) in (stated | given).items():
        found = hashlib.sha256(content).hexdigest()
        proved = PROOF in sources and name in (f"{top['subject']['name']}{ending}" for ending in (".c", ".h"))
        way = f"; `verify {PROOF}` checks the text as it is now" if proved else ""
        said = f"{name} differs from the one that the certificate names (edited since it was generated?){way}"
        demand(found == expected, f"{said}: its SHA-256 is {found}, not {expected}")
    return [f"{name} has the SHA-256 stated" for name in (*stated, *given)]


def unsaid(top: dict[str, Any], spec: Path | None) -> list[str]:
    """What a certificate of this form leaves open."""
    turned = {f"e_a_{entry['contact']}" for entry in top["reversals"]}
    silent = [e["name"] for e in top["error"] if e["name"].startswith("e_a_") and e["name"] not in turned]
    left = [f"reversals: nothing is claimed about one of {', '.join(silent)}"] if silent and not top["along"] else []
    left += [] if spec is not None else ["the SHA-256 of the specification, which was not given (--spec)"]
    return left + ([] if top["assumptions"] else ["the assumptions: none is stated"])


def parsed(text: str) -> dict[str, Any]:
    """The certificate, if it is written as its format demands."""
    demand(len(text) <= MAX_TEXT, f"{len(text)} characters, more than {MAX_TEXT}")
    raw = files.parsed(text)
    expected = f'expected is a certificate: an object with "format": "{FORMS["FORMAT"]}", or a {PROOF}'
    known = isinstance(raw, dict) and raw.get("format") == FORMS["FORMAT"]
    demand(known, f"found {theorem.found_instead(raw)}; {expected}")
    top: dict[str, Any] = files.conform(raw, SCHEMA, "certificate", leaf)
    found = parts_of([*top["matrix"], *(e["expression"] for e in top["parameters"])])
    demand(found <= MAX_PARTS, f"{found} operators, names and numbers, more than {MAX_PARTS}")
    return top


def parts_of(expressions: list[Any]) -> int:
    """How many lists, names and numbers there are in expressions: each takes some 700 bytes once it is parsed."""
    found, left = 0, [*expressions]
    while left:
        found, part = found + 1, left.pop()
        left += part if isinstance(part, list) else ()
    return found


def check(
    text: str, folder: Path | None = None, spec: Path | None = None, sources: dict[str, bytes] | None = None
) -> Report:
    """Verify a certificate, with the files of its folder or with ``sources`` in their place.

    Raises Refused; json.JSONDecodeError; OSError if a file to be compared cannot be read.
    """
    if '"stiction-' not in text and (proof := theorem.read(text)) is not None:
        return of_proof(proof, folder, sources)
    try:
        named = (top := parsed(text))["subject"]["files"]
        if sources is None:
            sources = read(folder, {*named, PROOF, SETS})
            if sources.keys() & named.keys():  # without a file of the code nothing is said of it
                alone(folder, top["subject"]["name"])
        more, facts = unchanged(top, sources, spec), in_time(top)
        proved, unproved, whole = by_kernel(top, {k: v for k, v in sources.items() if k in {*named, PROOF, SETS}})
    except RecursionError:
        raise Refused("nested too deeply") from None
    unbound = tuple(name for name in named if name not in sources)
    left = (*statements.uncompared(proved, sources), *unsaid(top, spec), *ALWAYS)
    if folder and PROOF not in sources:
        unproved = "; ".join(absent(folder, PROOF))
    if folder and SETS not in sources and (folder / "manifest.json").exists():
        left = ("a bound on the friction error: " + "; ".join(absent(folder, SETS)), *left)
    words = (top["claim"], (*facts, *more), unbound, left, top["assumptions"])
    return Report(top["subject"]["name"], *words, tuple(proved), unproved, whole)


def read(folder: Path | None, names: set[str]) -> dict[str, bytes]:
    """File name → content, of these files that exist in a folder. OSError if one is unreadable, or a claim no JSON."""
    here = [path for name in names if folder and (path := folder / name).exists()]
    found = {path.name: files.read(path, MAX_TEXT) for path in here}
    for path in (path for path in here if path.name in (PROOF, SETS)):
        try:
            with suppress(RecursionError, Refused):  # JSON of a form that no claim has is refused later
                files.parsed(found[path.name])
        except ValueError as why:
            expected = "expected the file as it was generated, or none"
            raise OSError(errno.EINVAL, f"no JSON: {why}; {expected}", str(path)) from None
    return found


def alone(folder: Path | None, name: str) -> None:
    """Refuses a folder with headers other than NAME.h and NAME_lanes.h, which a compiler could take for <math.h>.

    A compiler that is given this folder by -I may read it in place of one that the system's <math.h> includes, or that
    it always reads first. GCC reads NAME.h.gch, a precompiled header, in place of NAME.h; Clang reads with math.h what
    a module.modulemap says; C++ has headers without a suffix, as <cmath>, which its <math.h> includes, and that of g++
    includes <tr1/gamma.tcc> and others. The code's own header is the one beside it: below, its name may be a system's
    too, as <bits/floatn.h>. What lies behind a link to a folder is not seen here.
    """
    below = within(folder) if folder and folder.is_dir() else []
    own = [Path(folder or "", f"{name}{end}.h") for end in ("", "_lanes")]  # the latter of `generate --target simd`
    headers = [x for x in below if re.search(HEADERS, x.name.lower()) and x not in own]
    headers += [x for x in below if x.parent == folder and "." not in x.name and not (x.is_dir() or program(x))]
    headers += [x for x in below if x.is_symlink() and x.is_dir()]
    names = ", ".join(one_line(str(x.relative_to(folder or ""))) for x in headers[:3])
    wanted = "no other header and no link to a folder, which a compiler may take for the system's; move it elsewhere"
    demand(not headers, f"beside the code: {names}; expected {wanted}")


def within(folder: Path) -> list[Path]:
    """What lies in a folder and below it, or Refused: a compiler opens a file in a folder that nobody may list too."""
    found: list[Path] = []

    def unlisted(why: OSError) -> None:
        raise Refused(f"{why.filename} beside the code cannot be listed: {why.strerror}")

    for where, folders, names in os.walk(folder, onerror=unlisted):
        found += [Path(where, name) for name in (*folders, *names)]
        demand(len(found) < MAX_FILES, f"{MAX_FILES} files or more beside the code")
    return found


def program(path: Path) -> bool:
    """Whether a file begins as a program of Linux or macOS does, and no C++ can; or is called as such a text is."""
    if path.name.lower() in TEXTS:
        return True
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(4) in (b"\x7fELF", b"\xcf\xfa\xed\xfe")


def of_proof(proof: dict[str, Any], folder: Path | None, sources: dict[str, bytes] | None) -> Report:
    """What the kernel proves of the C beside its proof alone."""
    demand(isinstance(name := proof["name"], str) and bool(re.fullmatch(FORMS["NAME"], name)), "the proof has no name")
    if sources is None:
        sources = read(folder, {f"{name}.c", f"{name}.h", SETS})
        alone(folder, name)
    proven = theorem.proved(proof, sources)
    lines = statements.proved_statements(proof, proven, sources)
    open_ = ("a certificate: this is the kernel's proof alone", *statements.uncompared(lines, sources), *ALWAYS)
    return Report(name, "", (), (), open_, (), tuple(lines), "", proven["whole"])


def one_line(text: str) -> str:
    """The text with unprintable characters escaped: a file name may contain terminal control sequences.

    And those two columns wide, with which a line is longer on a screen than its number of characters says.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if c.isprintable() and east_asian_width(c) not in "FW" else ascii(c)[1:-1] for c in text)


def status(report: Report) -> int:
    """The exit status of a report: 0, DOMAIN or NO_CODE."""
    return 0 if report.whole else DOMAIN if report.proved else NO_CODE


def in_short(report: Report) -> list[str]:
    """The rate and the bounds among what is proved of the C; where the bounds are many, how many."""
    rates = [line for line in report.proved if line.startswith(statements.STEP)]
    bounds = [line.strip() for line in report.proved if statements.LONG_RUN in line]
    many = [f"{len(bounds)} error bounds, listed below"] if len(bounds) > FEW else bounds
    return [*rates, *many]


def is_detail(line: str) -> bool:
    """Whether a proved statement is left out of the short report: it is no bound, and no condition of one.

    Those are the outputs besides the estimates, the parameters, samples that are invalid, and what follows a reversal.
    """
    of_bounds = line.startswith(("  so ", "  a reversal of ")) or (line.startswith("  |") and " from sample " in line)
    others = ("in each sample F_hat", "with the values of ", "initialisation sets ", "a sample is used, ")
    return of_bounds or line.startswith(others)


def in_words(report: Report, details: bool) -> list[str]:
    """What is proved, under which conditions, and what is not checked, as lines.

    Args:
        details: whether the rate and the bounds are repeated first, and what all rests on stands there too, and so
            does the tool's claim with its assumptions where something is proved of the C.
    """
    where = "" if report.whole else ", where the conditions below hold"
    proved = [line for line in report.proved if details or not is_detail(line)]
    head = f"proved of {report.name}.c itself by the kernel, with the values of {report.name}.h{where}:"
    bound = [head, *(f"  {line}" for line in proved)]
    missing = [*(f"{name}, which is not here" for name in report.unbound), *report.open]
    open_ = ["not checked:", *(f"  {gap}" for gap in missing)]
    claim = ["claim as written by the tool, not checked:", f"  {report.claim}"] if report.claim else []
    assumed = ["assumptions of this claim, not checked:", *(f"  {x}" for x in report.assumptions)] if claim else []
    if not details and proved:
        return [*bound, *open_]
    loose = ["it was not bound to code:", f"  {report.unproved}"]
    facts = [f"  {fact}" for fact in report.facts if details or not fact.endswith("has the SHA-256 stated")]
    facts = ["the algebra holds:", *facts] if report.claim else []
    if not details:
        return [*facts, *loose, *open_, *claim, *assumed]
    short = [*(f"  {line}" for line in in_short(report)), "in full, with what it rests on:"]
    return [*short, *facts, *(bound if proved else loose), *open_, *claim, *assumed]


def say(*lines: str) -> None:
    """Print each as one line, so that none can forge another; on a screen a longer one goes on below, indented.

    A word that is longer than the screen is broken too: a screen would break it itself, and go on at its left edge.
    """
    if not sys.stdout.isatty():
        print(*map(one_line, lines), sep="\n")
        return
    from shutil import get_terminal_size  # these two take a hundredth of the time of a check
    from textwrap import fill

    width = get_terminal_size().columns
    for line in map(one_line, lines):
        indented = " " * (len(line) - len(line.lstrip()) + 2)
        print(line if len(line) <= width else fill(line, width, subsequent_indent=indented, break_on_hyphens=False))


def absent(folder: Path, name: str) -> tuple[str, str]:
    """Why a folder of generated code lacks a file, and what makes it, in words.

    The reason is what the folder's manifest.json says, which nobody has checked; without one, no reason is given. Its
    command is repeated only if it is one of `stiction generate`, since a reader may run it, and its reason as one line:
    another one could pass for a statement of this checker. For a certificate, also which other claims are there.
    """
    try:
        manifest = json.loads(files.read(folder / "manifest.json", MAX_TEXT))
        listed, reason = name in manifest["files"], str(manifest.get("not_made", {}).get(name, ""))
        command = str(manifest["tool"]["command"])
        command = command if re.fullmatch(COMMAND, command) else MAKES
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        listed, reason, command = False, "", MAKES
    found = f"no {name}"
    if reason:
        found += f": stiction made none: {re.split(CLAUSE, reason)[0][:MAX_REASON]}"
        expected = f"`{command.replace('generate', 'certify')}` shows the reason in full"
    elif listed:
        found += ", which manifest.json lists: it was removed or moved since it was generated"
        expected = f"`{command}` writes it again"
    else:
        expected = f"`{command}` writes it, where it can be made"
    others = sorted(path.name for path in folder.glob("*.json") if path.name not in ("manifest.json", name))
    if others and name == CERTIFICATE:
        expected = f"{expected}; or one of the claims in this folder: {', '.join(others)}"
    return one_line(found), one_line(expected)


def main(argv: list[str] | None = None, details: bool = True) -> int:
    """Check what a command line names, print the report, in full or in brief, and return the exit status."""
    parser = argparse.ArgumentParser(description="Check a stability certificate.")
    parser.add_argument("certificate", type=Path, help="the file, or a folder with a certificate.json")
    parser.add_argument("--spec", type=Path, help="the specification, to be compared with the hash in the certificate")
    given = parser.parse_args(argv)
    getattr(sys.stdout, "reconfigure", dict)(errors="backslashreplace")  # a screen may lack alpha
    path = given.certificate / CERTIFICATE if given.certificate.is_dir() else given.certificate
    try:
        whose = path.parent / "manifest.json" if path.name in (CERTIFICATE, PROOF, SETS) else path
        if not path.exists() and (given.certificate.is_dir() or whose.exists()):
            found, expected = absent(path.parent, path.name)
            print(one_line(f"error: {path.parent}: {found}; expected one: {expected}"), file=sys.stderr)
            return 2
        report = check(files.read(path, MAX_TEXT).decode(), path.parent, given.spec)
    except Refused as e:
        say(f"refused: {path}: {e}")
        return 3
    except (OSError, ValueError) as e:
        where, what = getattr(e, "filename", None) or path, getattr(e, "strerror", f"not a certificate: {e}")
        print(one_line(f"error: {where}: {what}"), file=sys.stderr)
        return 2
    verdict = {0: "verified for the C", NO_CODE: "the algebra holds; it was not bound to code"}
    verdict[DOMAIN] = "verified for the C, under the conditions {}"
    said = f"{verdict[status(report)]} (exit status {status(report)})"
    more = "more: `stiction verify --details` also prints the algebra, the claim and its assumptions"
    last = said.format("above") if details else more
    say(f"{report.name}: {said.format('below')}", *in_words(report, details), last)
    return status(report)


if __name__ == "__main__":
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # whose reader has gone, as `| head`, ends without a traceback
    sys.exit(main())

"""``stiction verify``: a certificate or proof of the C, checked by the independent checker or written for another."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise, product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from codegen.base.border import verb, verb_that_raises
from codegen.base.errors import BadInput, Place
from codegen.base.files import refuse_target, write_atomically
from codegen.base.input_files import read_text
from codegen.base.shown import Shown
from codegen.base.text import render
from codegen.base.user_text import UserText
from codegen.certify.prefix import rational_text
from codegen.checker import verify as checker

if TYPE_CHECKING:
    from codegen.app.derived import Derived

CERTIFICATE = "a certificate (JSON)"
FORMAT = "stiction-verification/1"
REFUSED = 3
LONGEST_DWELL = 30_000


@dataclass(frozen=True, repr=False)
class Verified(Shown):
    """What the checker found."""

    report: checker.Report

    @property
    def summary(self) -> Mapping[str, object]:
        bound = "the C beside it" if self.report.proved else "no code"
        return {"machine": self.report.name, "claim": self.report.claim, "facts": len(self.report.facts), "of": bound}

    @property
    def content(self) -> dict[str, Any]:
        """The JSON object that ``stiction verify --json`` prints."""
        bound = {"bound": bool(self.report.proved)}
        return {"format": FORMAT, "verified": True, **bound, **self.report._asdict()}


@verb_that_raises(checker.Refused)
def verify(path: str | Path, spec: str | Path | None = None) -> Verified:
    """Check a certificate or a proof by the independent checker, with the files that lie beside it.

    Raises:
        BadInput: if the file cannot be read.
        codegen.checker.verify.Refused: if the claim does not hold.
    """
    path, spec = Path(path), None if spec is None else Path(spec)
    try:
        return Verified(checker.check(read_text(path, CERTIFICATE, checker.MAX_TEXT), path.parent, spec))
    except json.JSONDecodeError as error:
        raise _no_json(path, error) from None
    except OSError as error:  # of a file beside it, or of the spec
        found = f"unreadable ({error.strerror})"
        expected = "a file that the certificate names"
        raise BadInput(str(error.filename or path), found, expected, code="FILE001") from None
    except ValueError as error:
        raise BadInput(str(path), f"no certificate ({error})", CERTIFICATE, code="CALL003") from None


def readable(path: str | Path) -> None:
    """Nothing, where the file is a text of a certificate's size, and JSON.

    Raises:
        BadInput: where it cannot be read.
    """
    text = read_text(Path(path), CERTIFICATE, checker.MAX_TEXT)
    try:
        json.loads(text)
    except json.JSONDecodeError as error:
        raise _no_json(Path(path), error) from None
    except (ValueError, RecursionError):
        pass  # the checker has words for these


def _no_json(path: Path, error: json.JSONDecodeError) -> BadInput:
    return BadInput(Place(str(path), error.lineno), "text that is not JSON", CERTIFICATE, code="CALL003")


@verb
def verification_json(path: str | Path, spec: str | Path | None = None) -> tuple[dict[str, Any], int]:
    """What ``stiction verify --json`` prints, and the command's exit status.

    Raises:
        BadInput: if the file cannot be read.
    """
    try:
        found = verify(path, spec)
    except checker.Refused as error:
        return {"format": FORMAT, "verified": False, "refused": str(error)}, REFUSED
    return found.content, checker.status(found.report)


@verb_that_raises(checker.Refused)
def verify_machine(machine: Derived) -> Verified:
    """Check the certificate that ``generate`` would write for a machine, with the files that it would write beside it.

    Raises:
        BadInput: for a machine without a certificate.
        codegen.checker.verify.Refused: if the claim does not hold.
    """
    from codegen.certify.outcome import Refusal

    if isinstance(machine.outcome, Refusal):
        found = f"no certificate ({machine.outcome.reason})"
        raise BadInput(machine.spec.place("name"), found, "a certified machine", code="CALL003")
    sources = {name: text.encode() for name, text in machine.files.items()}
    return Verified(checker.check(machine.outcome.text, None, machine.spec.path, sources))


@verb
def write_smt(certificate: str | Path, out: str | Path) -> Path:
    """Write what the checker finds in a certificate as SMT-LIB 2, negated, for another solver to find ``unsat``.

    Raises:
        BadInput: for what is no certificate, if a dwell is too long for it, or for a file that is not to be written.
    """
    target = Path(out)
    refuse_target(target, {"the certificate itself": Path(certificate)}, (".smt2",))
    text = read_text(Path(certificate), CERTIFICATE, checker.MAX_TEXT)
    try:
        checker.parsed(text)
    except (checker.Refused, ValueError, RecursionError) as error:
        found = f"no certificate ({error})"
        raise BadInput(str(certificate), found, "a stability certificate", code="CALL003") from None
    write_atomically(target, smt_text(json.loads(text)))
    return target


def smt_text(content: Mapping[str, Any]) -> str:
    """A certificate or refutation that the checker has accepted as a ground SMT-LIB 2 file, for an independent solver.

    What the checker finds by LDL' at the vertices is negated and left to the arithmetic of z3 or cvc5; ``unsat``: it
    holds.

    Raises:
        BadInput: for a dwell time that is too long for exact powers, or a certificate with a cover.
    """
    if content["cover"]:
        found = "an inequality over sines and cosines, on the cells of a cover"
        expected = "one at the vertices of cells; only the checker verifies it"
        raise BadInput("certificate", found, expected, code="CALL003")
    for entry in content["reversals"]:
        if entry["dwell_samples"] > LONGEST_DWELL:
            found = f"{entry['dwell_samples']} samples of dwell time at {entry['contact']}"
            raise BadInput("certificate", found, f"at most {LONGEST_DWELL} samples for an SMT solver", code="CALL003")
    size = list(range(len(content["error"])))
    name, claim = UserText(content["subject"]["name"]), UserText(content["claim"])
    words = {"name": name, "claim": claim, "c": content, "size": size, "vertices": _vertices(content)}
    return render("text/certificate.smt2.j2", **words, digits=_digits)


def _digits(whole: int) -> str:
    return f"{whole:b}" if whole else ""


def _vertices(content: Mapping[str, Any]) -> list[dict[str, str]]:
    """Parameter → end of its interval, at every vertex of every cell, as the checker encloses them."""
    axes = {}
    for name, ends in content["variables"].items():
        at = [Fraction(x) for x in content["splits"].get(name, ends)]
        axes[name] = list(pairwise(at))
    ranges = {e["name"]: checker.parse(e["expression"], axes, e["name"])[1] for e in content["parameters"]}
    vertices = []
    for cell in product(*axes.values()):
        box = dict(zip(axes, cell, strict=True))
        ends = {name: sorted(set(checker.widen(*value(box)))) for name, value in ranges.items()}
        for point in product(*ends.values()):
            vertices.append({name: rational_text(x) for name, x in zip(ends, point, strict=True)})
    return vertices

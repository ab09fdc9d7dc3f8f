"""Check a stability certificate (docs/certificate.md) with Python alone: python3 verify.py CERTIFICATE [--spec SPEC].

Nothing that the certificate's author computed is believed: every inequality is decided anew in exact rational
arithmetic, and what is not rational (sin, exp, sqrt) is enclosed. Exit status: 0 verified, 3 refused, 2 unreadable.
"""

import argparse
import hashlib
import json
import math
import re
import sys
from collections import namedtuple
from collections.abc import Callable, Collection, Iterable, Mapping
from fractions import Fraction
from functools import reduce
from itertools import accumulate, pairwise, product
from operator import mul
from pathlib import Path
from reprlib import repr as brief
from typing import Any

MAX_TEXT, MAX_STRING, MAX_SIZE, MAX_POWER, MAX_VERTICES, MAX_TOTAL = 5_000_000, 4000, 32, 64, 4096, 200_000
TOO_LONG, DIGITS, FINEST = 1 << 2**14, 96, 512  # rounded numbers have DIGITS binary digits, none below 2^-FINEST
FORMS = json.loads(r"""{"FORMAT": "stiction-certificate/1", "TEXT": ".*", "LINE": ".*\\S.*", "HASH": "[0-9a-f]{64}",
    "NAME": "[A-Za-z][A-Za-z0-9_]*", "FILE": "[A-Za-z0-9_][A-Za-z0-9_.+-]{0,127}", "WHOLE": "0|[1-9][0-9]{0,8}",
    "RATIONAL": "-?[0-9]+(/0*[1-9][0-9]*)?", "STEP": "euler|semi_implicit|exponential|implicit"}""")
Report = namedtuple("Report", "name claim facts unbound assumptions")  # unbound: files named that were not there
# A certificate: {"field": ...} is an object with just these fields, {"FORM": ...} one with any keys of that form.
SCHEMA = json.loads("""{"format": "FORMAT", "tool": {"name": "TEXT", "version": "TEXT", "command": "TEXT"},
    "subject": {"name": "LINE", "spec_sha256": "HASH", "files": {"FILE": "HASH"}},
    "observer": {"kind": "TEXT", "velocity": "TEXT", "integration": "STEP"}, "claim": "LINE", "assumptions": ["LINE"],
    "sample_time": "RATIONAL", "decay_rate": "RATIONAL", "error": [{"name": "LINE", "meaning": "TEXT", "unit": "TEXT"}],
    "variables": {"NAME": ["RATIONAL"]}, "splits": {"NAME": ["RATIONAL"]}, "along": ["RATIONAL"],
    "parameters": [{"name": "NAME", "expression": "ANY"}], "matrix": [["ANY"]], "lyapunov_matrix": [["RATIONAL"]],
    "reversals": [{"contact": "LINE", "flips": ["WHOLE"], "growth": "RATIONAL", "dwell_samples": "WHOLE"}]}""")
OPERANDS = {"+": MAX_TEXT, "*": MAX_TEXT, "neg": 1, "/": 2, "^": 2, "sin": 1, "cos": 1, "exp": 1, "abs": 1, "sqrt": 1}
Interval = tuple[Fraction, Fraction]
Compiled = tuple[frozenset[str], Callable[[Mapping[str, Interval]], Interval]]  # an expression's names and its range


class Refused(Exception):
    """The certificate does not hold, or is not written as its format demands; the message says what and where."""


def demand(condition: bool, fault: str) -> None:
    if not condition:
        raise Refused(fault)


def show(x: Fraction) -> str:
    size = x.numerator.bit_length() - x.denominator.bit_length()
    return f"{float(x):.9g}" if abs(size) < 1000 else f"{'-' * (x < 0)}2^{size} or so"


def conform(raw: Any, schema: Any, where: str) -> Any:
    """What the JSON (objects as pairs, bare numbers as bytes) says, if it is as the schema asks."""
    if schema == "ANY":
        return raw
    if isinstance(schema, list) and isinstance(raw, list):
        return [conform(value, schema[0], f"{where}[{i}]") for i, value in enumerate(raw)]
    if isinstance(schema, dict) and isinstance(raw, tuple):
        keys = {key for key, _ in raw}
        demand(len(keys) == len(raw), f"{where}: a key stands twice")
        form = next(iter(schema.keys() & FORMS.keys()), "")
        demand(form != "" or keys == schema.keys(), f"{where}: fields missing or extra: {brief(keys ^ schema.keys())}")
        return {conform(k, form or "TEXT", where): conform(v, schema[form or k], f"{where}.{k}") for k, v in raw}
    good = isinstance(schema, str) and isinstance(raw, bytes if schema == "WHOLE" else str) and len(raw) <= MAX_STRING
    text = raw.decode() if good and schema == "WHOLE" else raw
    good = good and text.isprintable() and re.fullmatch(FORMS[schema], text) is not None  # the unprintable could forge
    demand(good, f"{where}: {brief(raw)} is no {brief(schema)}, printable and of at most {MAX_STRING} characters")
    return {"RATIONAL": Fraction, "WHOLE": int}.get(schema, str)(text)


def widen(low: Fraction, high: Fraction) -> Interval:
    """The interval rounded outwards, so that its ends are short numbers."""
    ends = []
    for x in (low, -high):
        unit = Fraction(2) ** min(DIGITS - x.numerator.bit_length() + x.denominator.bit_length(), FINEST)
        ends.append(x if max(abs(x.numerator), x.denominator) < 2**DIGITS else math.floor(x * unit) / unit)
    return ends[0], -ends[1]


def hull(numbers: Iterable[Fraction]) -> Interval:
    ends = sorted(numbers)
    demand(all(max(abs(x.numerator), x.denominator) < TOO_LONG for x in ends), "a number grew too long to go on")
    return ends[0], ends[-1]


# pi by Machin: the terms (16/5^n - 4/239^n)/n, n = 1, 3, 5, ..., fall and alternate, so successive sums enclose it.
SUMS = list(accumulate((-1) ** (n // 2) * (Fraction(16, 5**n) - Fraction(4, 239**n)) / n for n in range(1, 80, 2)))
PI = widen(*sorted(SUMS[-2:]))


def series(z: Fraction, divisors: list[int]) -> Interval:
    """1 + z/d1 + z/d1 z/d2 + ... give or take the size of the last term; on whole numbers, Fraction would be slow."""
    top, bottom, last = 1, 1, 1
    for divisor in reversed(divisors):
        bottom *= divisor * z.denominator
        top, last = bottom + z.numerator * top, abs(z.numerator) * last
    return widen(Fraction(top - last, bottom), Fraction(top + last, bottom))


def sine(low: Fraction, high: Fraction) -> Interval:
    """By Taylor: the terms fall from the |x|-th on, and Lagrange's remainder is at most the next one."""
    one = Fraction(1)
    low, high = widen(low, high) if max(-low, high) < 100 else (-4 * one, 4 * one)  # the latter gives [-1, 1]
    ends = [x * y for x in (low, high) for y in series(-x * x, [k * k + k for k in range(2, 44 + 4 * int(abs(x)), 2)])]
    for extreme in (one, -one):  # at (2k + extreme/2) pi: may a whole k, for all we know of pi, bring that in between?
        first, last = ([(end / pi - extreme / 2) / 2 for pi in PI] for end in (low, high))
        ends += [extreme] if math.ceil(min(first)) <= math.floor(max(last)) else []
    return hull(min(max(end, -one), one) for end in ends)


def exponential(low: Fraction, high: Fraction) -> Interval:
    """By Taylor, so far that each term is below half the one before: the last exceeds all that are left out."""
    demand(high <= 100, f"exp of a number up to {show(high)}, beyond 100")
    points = widen(max(low, Fraction(-100)), max(high, Fraction(-100)))
    ends = [end for x in points for end in series(x, list(range(1, 40 + 5 * math.ceil(abs(x)))))]
    return hull(ends + [Fraction(0)] * (low < -100))


def apply(op: str, args: list[Interval], where: str) -> Interval:
    """The range of an operator over the ranges of its operands."""
    (low, high), zero = args[0], Fraction(0)
    if op == "+":
        return hull(sum(ends, zero) for ends in zip(*args, strict=True))
    if op == "*":
        return reduce(lambda x, y: hull(a * b for a in x for b in y), args)
    if op == "/":
        demand(args[1][0] > 0 or args[1][1] < 0, f"{where}: divisor from {show(args[1][0])} to {show(args[1][1])}")
        return hull(a / b for a in args[0] for b in args[1])
    if op == "abs" or (op == "^" and args[1][0] % 2 == 0):
        low, high = max(low, -high, zero), max(-low, high)
    if op == "sqrt":
        demand(low >= 0, f"{where}: sqrt of a number down to {show(low)}")
        low, high = (x * 4**FINEST for x in widen(low, high))
        below, above = math.isqrt(math.floor(low)), math.isqrt(math.ceil(high))
        return widen(Fraction(below, 2**FINEST), Fraction(above + (above**2 < high), 2**FINEST))
    if op in ("exp", "sin"):
        return exponential(low, high) if op == "exp" else sine(low, high)
    if op in ("neg", "cos"):
        return (-high, -low) if op == "neg" else sine(low + PI[0] / 2, high + PI[1] / 2)
    return hull(end ** int(args[1][0]) for end in (low, high)) if op == "^" else (low, high)


def parse(raw: Any, known: Collection[str], where: str, affine: bool = False) -> Compiled:
    """An expression over the known names; `affine`: its form must show it affine in every single name."""
    if isinstance(raw, str) and raw in known:
        return frozenset({raw}), lambda at: at[raw]
    if not isinstance(raw, list):
        value = conform(raw, "RATIONAL", f"{where} (known names: {brief(sorted(known))})")
        return frozenset(), lambda at: (value, value)
    op, rest, admitted = (raw or [None])[0], raw[1:], ("+", "*", "neg", "/") if affine else (*OPERANDS,)
    good = op in admitted and min(2, OPERANDS[op]) <= len(rest) <= OPERANDS[op]
    demand(good, f"{where}: {brief(raw)} is no expression here")
    names, values = zip(*(parse(item, known, where, affine) for item in rest), strict=True)
    if op == "^" or (affine and op == "/"):
        number = conform(rest[1], "RATIONAL", where)
        demand(op == "/" or number in range(MAX_POWER + 1), f"{where}: exponent {show(number)}, not 0 to {MAX_POWER}")
    union = frozenset[str]().union(*names)
    demand(not affine or op != "*" or sum(map(len, names)) == len(union), f"{where}: a name stands in two factors")
    return union, lambda at: apply(op, [value(at) for value in values], where)


def integers(rows: list[list[Fraction]]) -> tuple[list[list[int]], int]:
    """(D * rows, D) with the least D > 0 for which all entries are whole."""
    common = math.lcm(*(x.denominator for row in rows for x in row))
    demand(common < TOO_LONG, "a common denominator grew too long to go on")
    return [[x.numerator * (common // x.denominator) for x in row] for row in rows], common


def positive_pivots(matrix: list[list[int]], scale: int, fault: str) -> int:
    """How many pivots of the symmetric matrix / scale are positive; refused if it is not positive semidefinite."""
    # LDL' on whole numbers (Bareiss): rest is the Schur complement times the last positive pivot, the division exact.
    rest, last, count = matrix[:], 1, 0
    for k, column in enumerate(rest):
        if (pivot := column[k]) < 0 or (pivot == 0 and any(column[k:])):
            raise Refused(f"{fault}: pivot {k + 1} is {show(Fraction(pivot, last * scale))}")
        if pivot > 0:
            for i in range(k + 1, len(rest)):
                rest[i] = [(pivot * x - column[i] * y) // last for x, y in zip(rest[i], column, strict=True)]
            last, count = pivot, count + 1
    return count


def contraction(top: dict[str, Any], axes: dict[str, Any], P: list[list[int]], scale: int, *factors: Fraction) -> str:
    """At how many vertices -(A'P + PA + q A'PA + loss P) is positive semidefinite: all, or refused."""
    thetas = {entry["name"]: parse(entry["expression"], axes, entry["name"])[1] for entry in top["parameters"]}
    (((a, b, c),), d), size = integers([[factors[1], Fraction(1), factors[0]]]), range(len(P))
    demand((cells := math.prod(map(len, axes.values()))) <= MAX_TOTAL, f"{cells} cells, more than {MAX_TOTAL}")
    A = [[parse(top["matrix"][i][j], thetas, f"matrix[{i}][{j}]", True) for j in size] for i in size]
    used = sorted({name for row in A for names, _ in row for name in names})
    grid = [dict(zip(axes, intervals, strict=True)) for intervals in product(*axes.values())]
    boxes = [{name: widen(*value(cell)) for name, value in thetas.items()} for cell in grid]
    counts = [math.prod(len(set(box[name])) for name in used) for box in boxes]
    fault = f"{max(counts)} vertices in a cell, {sum(counts)} in all, more than {MAX_VERTICES} or {MAX_TOTAL}"
    demand(max(counts) <= MAX_VERTICES and sum(counts) <= MAX_TOTAL, fault)
    for cell, box in zip(grid, boxes, strict=True):
        for ends in product(*(sorted(set(box[name])) for name in used)):
            point = {name: (end, end) for name, end in zip(used, ends, strict=True)}
            now, e = integers([[A[i][j][1](point)[0] for i in size] for j in size])  # e A, by columns
            PA = [[sum(map(mul, row, column)) for row in P] for column in now]  # e P A, by columns
            slow = [[a * e * e * P[i][j] + b * e * (PA[j][i] + PA[i][j]) for j in size] for i in size]
            gap = [[-x - c * sum(map(mul, now[i], PA[j])) for j, x in enumerate(slow[i])] for i in size]
            at = [f", {name} in [{show(low)}, {show(high)}]" for name, (low, high) in (cell | point).items()]
            count = positive_pivots(gap, d * e * e * scale, f"V may not fall{''.join(at)}")
            demand(not top["along"] or (count == len(P) and sum(counts) == 1), "not strict, or not one exact point")
    return f"{sum(counts)} vertices in {cells} cells"


def reversal(entry: dict[str, Any], P: list[list[int]], scale: int, fall: Fraction) -> str:
    """The fact that what V gains when a contact reverses is made good in time."""
    where, flips, growth, left = (entry[key] for key in ("contact", "flips", "growth", "dwell_samples"))
    where, size, (a, b) = f"reversal of {where}", range(len(P)), growth.as_integer_ratio()
    demand(growth >= 1, f"{where}: growth {show(growth)} is below 1")
    demand(sorted({*flips} & {*size}) == sorted(flips), f"{where}: flips {brief(flips)} twice or not below {len(P)}")
    gap = [[(a - b if (i in flips) == (j in flips) else a + b) * P[i][j] for j in size] for i in size]
    positive_pivots(gap, b * scale, f"{where}: V may grow by more than {show(growth)}")
    after, factor, fact = growth, fall, f"{where}: V grows at most by {show(growth)}, and {left} samples later"
    while left:  # after: an upper bound of growth * fall^left, by squaring, rounded up
        after = widen(after, after * factor)[1] if left % 2 else after
        factor, left = widen(factor, factor * factor)[1], left // 2
    demand(after <= 1, f"{fact} may still be {show(after)} times its value before")
    return f"{fact} is not above its value before"


def verify(top: dict[str, Any], folder: Path | None, spec: Path | None) -> Report:
    n, h, alpha, files = len(top["error"]), top["sample_time"], top["decay_rate"], top["subject"]["files"]
    demand(1 <= n <= MAX_SIZE, f"{n} error components, not 1 to {MAX_SIZE}")
    for part, key in (("error", "name"), ("parameters", "name"), ("reversals", "contact")):
        demand(len({entry[key] for entry in top[part]}) == len(top[part]), f"{part}: a {key} stands twice")
    for part in ("matrix", "lyapunov_matrix"):
        demand([len(row) for row in top[part]] == [n] * n, f"{part} is not {n} by {n}")
    q, law = (0 * h, "1/(1 + alpha*h)^2") if top["observer"]["integration"] == "implicit" else (h, "1 - 2*alpha*h")
    fall = 1 - 2 * alpha * h if q else 1 / (1 + abs(alpha * h)) ** 2
    demand(min(h, alpha, fall) > 0, f"h {show(h)}, alpha {show(alpha)}, the fall of V {show(fall)}: not all positive")
    demand(top["splits"].keys() <= top["variables"].keys(), "splits: a name is no variable")
    demand(all(e["name"] not in top["variables"] for e in top["parameters"]), "parameters: a name is a variable's")
    axes, (P, scale) = {}, integers(top["lyapunov_matrix"])
    for name, ends in top["variables"].items():
        at = top["splits"].get(name, ends)
        rise = all(a < b for a, b in pairwise(at)) or (at is ends and ends[:1] <= ends[1:])
        demand(rise and len(at) > 1 and at[:1] + at[-1:] == ends, f"{name}: no [low, high], or splits not so ordered")
        axes[name] = list(pairwise(at))
    demand(all(P[i][j] == P[j][i] for i in range(n) for j in range(i)), "lyapunov_matrix is not symmetric")
    if x := top["along"]:  # P would be the sum of Phi'^k gap Phi^k/fall^(k+1) > 0 if the error fell so fast
        demand(len(x) == n and any(x) and not top["reversals"], "along is no direction, or there are reversals")
        demand(sum(a * b * P[i][j] for i, a in enumerate(x) for j, b in enumerate(x)) <= 0, "P is positive along it")
    else:
        demand(positive_pivots(P, scale, "P is not positive definite") == n, "P is not positive definite: a pivot is 0")
    q, loss = (-h, alpha * (2 + h * alpha)) if x and not q else (q, 2 * alpha)  # E'PE > P/fall
    seen, who = contraction(top, axes, P, scale, q, loss), "no V with P > 0" if x else "V"
    facts = ["P is not positive definite" if x else f"P is positive definite: {n} positive pivots"]
    facts += [f"{seen}: {who} falls by at least the factor {law} = {show(fall)} a sample"]
    facts += [reversal(entry, P, scale, fall) for entry in top["reversals"]]
    own = all([top["error"][i]["name"] for i in e["flips"]] == [f"e_a_{e['contact']}"] for e in top["reversals"])
    demand(own, "reversals: flips are not the error e_a_CONTACT of their contact")
    bound = [(folder / name, digest) for name, digest in files.items() if folder and (folder / name).exists()]
    for path, expected in bound + [(spec, top["subject"]["spec_sha256"])] * bool(spec):
        found = hashlib.sha256(path.read_bytes()).hexdigest()
        demand(found == expected, f"{path.name} has the SHA-256 {found}, not {expected}")
        facts.append(f"{path.name} has the SHA-256 stated")
    unbound = tuple(name for name in files if not folder or not (folder / name).exists())
    return Report(top["subject"]["name"], top["claim"], tuple(facts), unbound, tuple(top["assumptions"]))


def check(text: str, folder: Path | None = None, spec: Path | None = None) -> Report:
    """Verify a certificate. Raises Refused; json.JSONDecodeError; OSError if a file to be compared cannot be read."""
    demand(len(text) <= MAX_TEXT, f"{len(text)} characters, more than {MAX_TEXT}")
    bare = str.encode
    try:
        raw = json.loads(text, object_pairs_hook=tuple, parse_int=bare, parse_float=bare, parse_constant=bare)
        return verify(conform(raw, SCHEMA, "certificate"), folder, spec)
    except RecursionError:
        raise Refused("nested too deeply") from None


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Check a stability certificate.")
    parser.add_argument("certificate", type=Path)
    parser.add_argument("--spec", type=Path, help="the specification, to be compared with the hash in the certificate")
    given = parser.parse_args(argv)
    getattr(sys.stdout, "reconfigure", dict)(errors="backslashreplace")  # a screen may lack alpha
    try:
        report = check(given.certificate.read_text("utf-8"), given.certificate.parent, given.spec)
    except Refused as e:
        print(f"refused: {e}")
        return 3
    except (OSError, ValueError) as e:
        print(f"error: {getattr(e, 'filename', given.certificate)}: {getattr(e, 'strerror', e)}", file=sys.stderr)
        return 2
    print(report.name, *report.facts, *(f"not bound, not here: {name}" for name in report.unbound), sep="\n  ")
    print("verified: these facts. In words, not checked:", f"{report.claim} Assumed:", *report.assumptions, sep="\n  ")
    return 0


if __name__ == "__main__":
    sys.exit(main())

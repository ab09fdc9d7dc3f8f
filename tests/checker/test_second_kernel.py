"""A second kernel: every shipped certificate is proved again by FLINT, with nothing of the checker or the project.

Numbers that are not rational are balls of Arb that hold them. P and the gap c P - F'PF are shown to be positive
definite by elimination in balls. V(F e) is convex in F, so the vertices of what the parameters can be stand for all of
it; where the checker has a cover of tangents and Bernstein coefficients, angles are halved here until each part holds.
"""

from __future__ import annotations

import json
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import pytest

from tests.slow_cases import slow_except

from .test_shipped_mutants import GENERATED, identity

flint = pytest.importorskip("flint", reason="python-flint is in the extra `smt`")
PROOFS = [p for p in sorted(GENERATED.glob("*/*.json")) if '"stiction-certificate/1"' in p.read_text("utf-8")]
BITS, MOST_CELLS = 128, 20_000
Ball = Any
Matrix = list[list[Ball]]


@pytest.fixture(autouse=True)
def precision() -> Any:
    before, flint.ctx.prec = flint.ctx.prec, BITS
    yield
    flint.ctx.prec = before


def number(text: str) -> Ball:
    above, _, below = text.partition("/")
    return flint.arb(flint.fmpq(int(above), int(below or 1)))


def value(entry: Any, at: dict[str, Ball]) -> Ball:
    """A prefix expression (docs/certificate_format.md)."""
    if isinstance(entry, str):
        return at[entry] if entry in at else number(entry)
    word, *rest = entry
    if word == "^":
        return value(rest[0], at) ** int(rest[1])
    first, *others = (value(part, at) for part in rest)
    if word in ("+", "*", "/"):
        for other in others:
            first = first + other if word == "+" else first * (other if word == "*" else reciprocal(other))
        return first
    if word == "abs" and first.contains(0):  # Arb takes |0 +- 20| for 0 +- 20
        return flint.arb(0).union(max(-first.lower(), first.upper()))
    return -first if word == "neg" else abs(first) if word == "abs" else getattr(first, word)()


def reciprocal(x: Ball) -> Ball:
    """Of a wide ball, tighter than Arb's."""
    return 1 / x if x.contains(0) else (1 / x.lower()).union(1 / x.upper())


def times(A: Matrix, B: Matrix) -> Matrix:
    columns = [*zip(*B, strict=True)]
    return [[sum((a * b for a, b in zip(row, c, strict=True)), flint.arb(0)) for c in columns] for row in A]


def definite(A: Matrix) -> bool:
    """Whether every symmetric matrix in these balls is positive definite: all pivots are above zero."""
    A = [[*row] for row in A]
    for k, row in enumerate(A):
        if not row[k] > 0:
            return False
        for other in A[k + 1 :]:
            factor = other[k] / row[k]
            for j in range(k, len(A)):
                other[j] -= factor * row[j]
    return True


def holds(cert: dict[str, Any]) -> bool:
    """Whether the claim is proved here."""
    n, h, alpha = len(cert["error"]), number(cert["sample_time"]), number(cert["decay_rate"])
    P = [[number(x) for x in row] for row in cert["lyapunov_matrix"]]
    implicit, along = cert["observer"]["integration"] == "implicit", [number(x) for x in cert["along"]]
    fall = 1 / (1 + alpha * h) ** 2 if implicit else 1 - 2 * alpha * h

    def falls(A: Matrix) -> bool:
        """Whether fall P - F'PF > 0 for F = I + hA, or for an implicit step what it follows from, in A to first order.

        With E = I - hA and s = 1 + alpha h, E'PE - s^2 P >= s (E'P + PE) - 2 s^2 P, as (E - s)'P(E - s) >= 0.
        """
        F = [[int(i == j) + (-h if implicit else h) * x for j, x in enumerate(row)] for i, row in enumerate(A)]
        turned = [[*row] for row in zip(*F, strict=True)]
        PF = times(P, F)
        if implicit and along:  # P/fall < E'PE
            moved = times(turned, PF)
            return definite([[m - p / fall for m, p in zip(*rows, strict=True)] for rows in zip(moved, P, strict=True)])
        if implicit:
            s = 1 + alpha * h
            return definite([[PF[i][j] + PF[j][i] - 2 * s * P[i][j] for j in range(n)] for i in range(n)])
        moved = times(turned, PF)
        return definite([[fall * p - m for p, m in zip(*rows, strict=True)] for rows in zip(P, moved, strict=True)])

    def everywhere(cell: dict[str, Ball], vertices: bool) -> bool:
        at = {p["name"]: value(p["expression"], cell) for p in cert["parameters"]}
        ends = [sorted({x.lower(), x.upper()}, key=float) if vertices else [x] for x in at.values()]
        return all(
            falls([[value(x, dict(zip(at, corner, strict=True))) for x in row] for row in cert["matrix"]])
            for corner in product(*ends)
        )

    def halved(cell: dict[str, Ball], cut: list[str], vertices: bool) -> bool:
        """The same for a cell, cut in halves across the widest of these variables where it does not hold."""
        left = [cell]
        for _ in range(MOST_CELLS):
            if not left:
                return True
            cell = left.pop()
            if everywhere(cell, vertices):
                continue
            if not cut:
                return False
            name = max(cut, key=lambda x: float(cell[x].rad() / whole[x].rad()))
            low, middle, high = cell[name].lower(), cell[name].mid(), cell[name].upper()
            left += [cell | {name: part} for part in (low.union(middle), middle.union(high))]
        return False

    for entry in cert["reversals"]:
        sign = [-1 if k in entry["flips"] else 1 for k in range(n)]
        growth = number(entry["growth"])
        gap = [[(growth - sign[i] * sign[j]) * P[i][j] for j in range(n)] for i in range(n)]
        if not (definite(gap) or all(x == 0 for row in gap for x in row)):
            return False
        if not growth * fall ** entry["dwell_samples"] <= 1:
            return False
    if along:
        rising = times([along], times(P, [[x] for x in along]))[0][0]
    if not (rising <= 0 if along else definite(P)) or not fall > 0:
        return False
    axes = {name: [number(x) for x in cert["splits"].get(name, ends)] for name, ends in cert["variables"].items()}
    whole = {name: at[0].union(at[-1]) for name, at in axes.items()}
    cut = [name for name in whole if whole[name].rad() > 0]
    if cert["cover"]:  # A is affine in all variables but the one that is cut: their ends stand for the rest
        name = cert["cover"][0][0].removesuffix(" t")
        if name != cert["cover"][0][0]:  # an angle
            whole[name] = flint.arb(0).union(4).union(-4)  # more than pi to both sides
        ends = [[whole[name]] if x == name else at for x, at in axes.items()]
        return all(halved(dict(zip(axes, cell, strict=True)), [name], False) for cell in product(*ends))
    stated = product(*([a.union(b) for a, b in pairwise(at)] for at in axes.values()))
    return all(halved(dict(zip(axes, cell, strict=True)), cut, not along) for cell in stated)


LONG = ("two_link_arm/certificate", "two_mass_gdfo/passing", "two_mass_gdfo/weak")
"""Of which the proof over many cells takes seconds here, and what they claim changes rarely."""


@pytest.mark.parametrize(
    "path",
    slow_except(PROOFS, [p for p in PROOFS if f"{p.parent.name}/{p.stem}" not in LONG]),
    ids=identity,
)
def test_what_is_shipped_is_proved_again(path: Path) -> None:
    assert holds(json.loads(path.read_text("utf-8")))


@pytest.mark.parametrize(
    ("path", "field", "new"),
    [
        ("one_mass/certificate.json", "decay_rate", "1125/100"),
        ("chain/certificate.json", "decay_rate", "982/100"),
        ("rig/limit.json", "decay_rate", "1286/100"),
        ("two_mass/certificate.json", "lyapunov_matrix", lambda P: [[row[0], "0", *row[2:]] for row in P]),
        ("one_mass/certificate.json", "reversals", lambda all_: [entry | {"growth": "31/10"} for entry in all_]),
        ("one_mass/certificate.json", "reversals", lambda all_: [entry | {"dwell_samples": 50} for entry in all_]),
    ],
)
def test_a_false_claim_is_not(path: str, field: str, new: Any) -> None:
    cert = json.loads((GENERATED / path).read_text("utf-8"))
    assert holds(cert)
    cert[field] = new(cert[field]) if callable(new) else new
    assert not holds(cert)

"""Sums of absolute impulse responses in rationals, over as many samples as the certificate's P does not make small."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from operator import mul
from typing import Any

import numpy as np
import sympy

from codegen.stability.certify import Certificate
from codegen.stability.disturbances import dot, fraction
from codegen.stability.error_response import Response

LONGEST = 20_000
REST = Fraction(1, 10_000)
GRID = 1 << 120
EVERY = 64
ROUNDING = 1e-9


@dataclass(frozen=True)
class Steady:
    """What bounded disturbances do to one component of the error in the long run.

    Attributes:
        bound: with the rest that is not summed.
        worst: without it, attained by independent disturbances.
        parts: cause → its share of the bound.
    """

    bound: Fraction
    worst: float
    parts: dict[str, float]


@dataclass(frozen=True)
class ColumnSum:
    """Σ |Φ^k b| of every component for one disturbance of size 1.

    Attributes:
        here: over the samples summed.
        rest: a bound on what is left, and on the rounding to the grid.
    """

    cause: str
    index: int
    here: list[Fraction]
    rest: list[Fraction]


class Tail:
    """What the certificate's P says about C Φ^i b for all i from some on."""

    def __init__(self, certificate: Certificate) -> None:
        rows = [[sympy.Rational(x) for x in row] for row in certificate.content["lyapunov_matrix"]]
        self.matrix = sympy.Matrix(rows)
        self.inverse = self.matrix.inv()
        fall = 1 - 2 * Fraction(certificate.content["decay_rate"]) * Fraction(certificate.content["sample_time"])
        self.gamma = root(fall)

        self.seen = [root(fraction(self.inverse[i, i])) / (1 - self.gamma) for i in range(len(rows))]

    @property
    def reach(self) -> Any:
        """√(C_i P⁻¹ C_i') √(e_j'Pe_j), m by m: |Φ^k|[i, j] is at most γ^k times it."""
        roots = [np.sqrt(np.array([float(m[i, i]) for i in range(m.rows)])) for m in (self.inverse, self.matrix)]
        return np.outer(*roots) * (1 + ROUNDING)

    def size(self, column: list[Fraction]) -> Fraction:
        """√(b'Pb)."""
        vector = sympy.Matrix([sympy.Rational(x.numerator, x.denominator) for x in column])
        return root(fraction((vector.T * self.matrix * vector)[0]))


def column_sums(response: Response, causes: Mapping[str, list[bool]], tail: Tail) -> list[ColumnSum] | None:
    """The sums of the disturbances asked for; None where the error decays too slowly to be summed.

    Args:
        causes: cause → for each of its disturbances whether it counts.
    """
    m, n = response.step.rows, response.noise.cols
    unit = sympy.eye(m)
    blocks = {
        "noise": response.noise,
        "displacement": response.displacement,
        "velocity": unit[:, :n],
        "acceleration": response.acceleration,
        "friction": unit[:, n:],
    }
    sums = []
    for cause, block in blocks.items():
        for k in range(block.cols):
            if not causes[cause][k] or not any(block.col(k)):
                continue
            found = _column_sum(response, [fraction(e) for e in block.col(k)], tail)
            if found is None:
                return None
            sums.append(ColumnSum(cause, k, *found))
    return sums


def steady_bounds(response: Response, sums: list[ColumnSum], sizes: Mapping[str, list[Fraction]]) -> list[Steady]:
    """For every component Σ_k |Φ^k B| δ over all disturbances, and the direct part of the noise."""
    direct = [dot(response.direct.row(i), sizes["noise"]) for i in range(response.step.rows)]
    shares: list[dict[str, Fraction]] = [{"noise": d} for d in direct]
    worst = list(direct)
    for s in sums:
        size = sizes[s.cause][s.index]
        for i in range(len(direct)):
            worst[i] += s.here[i] * size
            shares[i][s.cause] = shares[i].get(s.cause, Fraction(0)) + (s.here[i] + s.rest[i]) * size
    return [
        Steady(sum(share.values(), Fraction(0)), float(w), {k: float(v) for k, v in share.items()})
        for share, w in zip(shares, worst, strict=True)
    ]


def _column_sum(response: Response, column: list[Fraction], tail: Tail) -> tuple[list[Fraction], list[Fraction]] | None:
    """Σ |Φ^k b| of every component over so many k, and a bound on what is left and on the rounding to the grid."""
    m = len(column)
    entries = [fraction(e) for e in response.step]
    common = math.lcm(*(e.denominator for e in entries))
    step = [[int(entries[m * i + j] * common) for j in range(m)] for i in range(m)]
    vector, here = [round(x * GRID) for x in column], [0] * m
    # Each rounding is a disturbance of at most half a grid step an entry, for ever after.
    rounding = sum((tail.size([Fraction(int(i == k)) for i in range(m)]) for k in range(m)), Fraction(0)) / GRID
    for count in range(1, LONGEST + 1):
        here = [total + abs(x) for total, x in zip(here, vector, strict=True)]
        vector = [(sum(map(mul, row, vector)) + common // 2) // common for row in step]
        if count % EVERY == 0:
            left = tail.size([Fraction(x, GRID) for x in vector])
            rest = [seen * (left + (count + 1) * rounding) for seen in tail.seen]
            if all(r * GRID <= REST * total or not total for r, total in zip(rest, here, strict=True)):
                return [Fraction(total, GRID) for total in here], rest
    return None


def root(value: Fraction) -> Fraction:
    """√ of a number ≥ 0, rounded upwards."""
    scaled = math.ceil(value * GRID * GRID)
    return Fraction(math.isqrt(scaled) + 1, GRID)

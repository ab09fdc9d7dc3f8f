"""Sums of absolute impulse responses in doubles, over as many samples as the certificate's P does not make small.

``ROUNDING`` is added to each; in rationals the checker adds up the first samples (checker/ellipsoid.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from codegen.certify.bound.disturbances import dot
from codegen.certify.bound.error_response import Response
from codegen.certify.outcome import Certificate

LONGEST = 20_000
REST = 1e-4
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

    bound: float
    worst: float
    parts: dict[str, float]


@dataclass(frozen=True)
class ColumnSum:
    """Σ |Φ^k b| of every component for one disturbance of size 1.

    Attributes:
        here: over the samples summed.
        rest: a bound on what is left.
    """

    cause: str
    index: int
    here: Any
    rest: Any


class Tail:
    """What the certificate's P says about C Φ^i b for all i from some on.

    Attributes:
        gamma: √ of the certified fall.
        reach: √(C_i P⁻¹ C_i') √(e_j'Pe_j), m by m: |Φ^k|[i, j] is at most γ^k times it.
    """

    def __init__(self, certificate: Certificate) -> None:
        content = certificate.content
        self.matrix = np.array([[float(Fraction(x)) for x in row] for row in content["lyapunov_matrix"]])
        scale = np.sqrt(np.diag(self.matrix))
        seen = np.sqrt(np.diag(np.linalg.inv(self.matrix / np.outer(scale, scale)))) / scale
        fall = 1 - 2 * Fraction(content["decay_rate"]) * Fraction(content["sample_time"])
        self.gamma = float(fall) ** 0.5
        self.reach = np.outer(seen, scale) * (1 + ROUNDING)
        self.seen = seen / (1 - self.gamma) * (1 + ROUNDING)

    def sizes(self, columns: Any) -> Any:
        """√(b'Pb) of every column."""
        return np.sqrt(np.maximum(np.sum(columns * (self.matrix @ columns), axis=0), 0.0))


def column_sums(response: Response, causes: Mapping[str, list[bool]], tail: Tail) -> list[ColumnSum] | None:
    """The sums of the disturbances asked for; None where the error decays too slowly to be summed.

    Args:
        causes: cause → for each of its disturbances whether it counts.
    """
    step, n = _doubles(response.step), response.noise.cols
    unit = np.eye(len(step))
    blocks = {
        "noise": _doubles(response.noise),
        "displacement": _doubles(response.displacement),
        "velocity": unit[:, :n],
        "acceleration": _doubles(response.acceleration),
        "friction": unit[:, n:],
    }
    named = {
        (cause, k): block[:, k]
        for cause, block in blocks.items()
        for k, counts in enumerate(causes[cause])
        if counts and block[:, k].any()
    }
    if not named:
        return []
    vectors = np.column_stack(list(named.values()))
    here = np.zeros_like(vectors)
    for count in range(1, LONGEST + 1):
        here += np.abs(vectors)
        vectors = step @ vectors
        if count % EVERY == 0:
            rest = np.outer(tail.seen, tail.sizes(vectors))
            if (rest <= REST * here)[here > 0].all():
                more = 1 + ROUNDING
                return [ColumnSum(*name, here[:, k] * more, rest[:, k] * more) for k, name in enumerate(named)]
    return None


def steady_bounds(response: Response, sums: list[ColumnSum], sizes: Mapping[str, list[Fraction]]) -> list[Steady]:
    """For every component Σ_k |Φ^k B| δ over all disturbances, and the direct part of the noise."""
    direct = [float(dot(response.direct.row(i), sizes["noise"])) for i in range(response.step.rows)]
    shares: list[dict[str, float]] = [{"noise": d} for d in direct]
    worst = list(direct)
    for s in sums:
        size = float(sizes[s.cause][s.index])
        for i in range(len(direct)):
            worst[i] += float(s.here[i]) * size
            shares[i][s.cause] = shares[i].get(s.cause, 0.0) + float(s.here[i] + s.rest[i]) * size
    return [Steady(sum(share.values()), w, share) for share, w in zip(shares, worst, strict=True)]


def _doubles(matrix: Any) -> Any:
    return np.array(matrix.tolist(), dtype=float).reshape(matrix.rows, matrix.cols)

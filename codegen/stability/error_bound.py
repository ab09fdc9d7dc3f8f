"""A bound on the error of each friction estimate, in its own unit, as a function of time since the last reversal.

Every disturbance is bounded (|n| by the envelope's x_noise, |d_x| ≤ h² A/2, |d_v| ≤ h² J/2, |ΔF| ≤ h ρ), so the error
is at most the sum of the absolute impulse responses, which independent disturbances attain:
bound(k) = Σ_j (|D_j| + Σ_{i<k} |C Φ^i B_j|) δ_j + |C Φ^k| e₀. The sum is taken over so many samples that what is left,
bounded by the certificate's P, is below 1e-4 of it: |C Φ^i b| ≤ γ^i √(C P⁻¹ C') √(b'Pb) with γ² the certified fall.
The long-run sum is in rationals, rounded upwards; the decay of the start is in doubles, 1e-9 added.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from operator import mul
from typing import Any

import numpy as np
import sympy

from codegen.observers.equations import ErrorVariable, Observer
from codegen.spec.model import Spec
from codegen.stability.analysis import Analysis
from codegen.stability.certify import Certificate
from codegen.stability.domain_bound import DomainBound, Motion, domain_bound
from codegen.stability.error_response import Response, error_response

LONGEST = 20_000
REST = Fraction(1, 10_000)
GRID = 1 << 120
TIMES = 6
EVERY = 64
ROUNDING = 1e-9


@dataclass(frozen=True)
class ErrorBound:
    """The bound for one friction error.

    Attributes:
        name, unit: of the error component, as e_a_rail in N.
        steady: long after a reversal.
        parts: cause → its share of ``steady``: noise, displacement, velocity, friction, acceleration.
        start: |error| that is assumed at time 0, when the slip has its new sign in truth and estimate.
        after: (time in s, bound) from ``start`` on, falling to ``steady``.
        worst: the exact worst case of the first-order system over the samples summed, below ``steady``.
        slip_speed: the least slip speed at which truth and estimate have one sign, in the slip's unit/s.
        domain: what holds through reversals, where the spec asks for a ``domain``; or why nothing does.
    """

    name: str
    unit: str
    steady: float
    parts: dict[str, float]
    start: float
    after: tuple[tuple[float, float], ...]
    worst: float
    slip_speed: float
    domain: DomainBound | str | None = None


def error_bounds(spec: Spec, analysis: Analysis, certificate: Certificate) -> tuple[ErrorBound, ...] | str:
    """The bounds of every friction error, or why there are none.

    The envelope must bound the accelerations (``v_dot``), and v too where g depends on x; ``x_noise`` bounds the
    position noise, quantisation included, and is 0 where the envelope is silent.
    """
    observer = analysis.dynamics.observer
    system = observer.system
    missing = [f"{v}_dot" for v in system.velocities if f"{v}_dot" not in spec.envelope]
    if missing:
        return f"the envelope has no range for {', '.join(missing)}"
    response = error_response(observer)
    if response is None:
        return (
            "that takes estimated velocity, constant M and U, g affine in x and v, h(s) = s, and euler or semi_implicit"
        )
    sizes = _disturbances(spec, observer, response)
    if isinstance(sizes, str):
        return sizes
    tail = _Tail(certificate)
    sums = _sums(response, _columns(response, sizes), sizes["noise"], tail)
    if sums is None:
        return f"the error decays too slowly to be summed over {LONGEST} samples"
    n, h = system.degrees_of_freedom, float(observer.sample_time)
    steady = [float(s.steady) for s in sums]
    slips = system.distribution.subs(observer.values)
    speed = max(sum(abs(float(slips[r, c])) * steady[r] for r in range(n)) for c in range(slips.cols))
    domain = None
    if observer.domain is not None:
        motion = Motion(response, sizes, (steady[0], steady[1]), float(tail.gamma), tail.reach)
        domain = domain_bound(observer, observer.domain, motion)
    powers = _powers(response, h, certificate.decay_rate)
    result = []
    for i, error in list(enumerate(observer.errors))[n:]:
        start = [*steady[:n], *[steady[k] if k == i else 0.0 for k in range(n, len(steady))]]
        start[i] += _jump(observer, error)
        later = [(k * h, float(np.abs(power[i]) @ start) * (1 + ROUNDING) + steady[i]) for k, power in powers]
        after = ((0.0, start[i]), *later)
        result.append(
            ErrorBound(
                error.symbol.name, error.unit, steady[i], sums[i].parts, start[i], after, sums[i].worst, speed, domain
            )
        )
    return tuple(result)


@dataclass(frozen=True)
class _Sum:
    steady: Fraction
    worst: float
    parts: dict[str, float]


class _Tail:
    """What the certificate's P says about C Φ^i b for all i from some on."""

    def __init__(self, certificate: Certificate) -> None:
        rows = [[sympy.Rational(x) for x in row] for row in certificate.content["lyapunov_matrix"]]
        self.matrix = sympy.Matrix(rows)
        self.inverse = self.matrix.inv()
        fall = 1 - 2 * Fraction(certificate.content["decay_rate"]) * Fraction(certificate.content["sample_time"])
        self.gamma = _root(fall)

        self.seen = [_root(_fraction(self.inverse[i, i])) / (1 - self.gamma) for i in range(len(rows))]

    @property
    def reach(self) -> Any:
        """√(C_i P⁻¹ C_i') √(e_j'Pe_j), m by m: |Φ^k|[i, j] is at most γ^k times it."""
        roots = [np.sqrt(np.array([float(m[i, i]) for i in range(m.rows)])) for m in (self.inverse, self.matrix)]
        return np.outer(*roots) * (1 + ROUNDING)

    def size(self, column: list[Fraction]) -> Fraction:
        """√(b'Pb)."""
        vector = sympy.Matrix([sympy.Rational(x.numerator, x.denominator) for x in column])
        return _root(_fraction((vector.T * self.matrix * vector)[0]))


def _columns(response: Response, sizes: dict[str, list[Fraction]]) -> list[tuple[str, list[Fraction], Fraction]]:
    """(cause, column of the disturbance, its size)."""
    m, n = response.step.rows, response.noise.cols
    unit = sympy.eye(m)
    blocks = {
        "noise": response.noise,
        "displacement": response.displacement,
        "velocity": unit[:, :n],
        "acceleration": response.acceleration,
        "friction": unit[:, n:],
    }
    return [
        (cause, [_fraction(e) for e in block.col(k)], sizes[cause][k])
        for cause, block in blocks.items()
        for k in range(block.cols)
        if sizes[cause][k] > 0 and any(block.col(k))
    ]


def _sums(
    response: Response, columns: list[tuple[str, list[Fraction], Fraction]], noise: list[Fraction], tail: _Tail
) -> list[_Sum] | None:
    """For every component Σ_k |Φ^k B| δ over all disturbances, and the direct part of the noise."""
    m = response.step.rows
    direct = [_dot(response.direct.row(i), noise) for i in range(m)]
    shares: list[dict[str, Fraction]] = [{"noise": d} for d in direct]
    worst = list(direct)
    for cause, column, size in columns:
        found = _column_sum(response, column, tail)
        if found is None:
            return None
        here, rest = found
        for i in range(m):
            worst[i] += here[i] * size
            shares[i][cause] = shares[i].get(cause, Fraction(0)) + (here[i] + rest[i]) * size
    return [
        _Sum(sum(share.values(), Fraction(0)), float(w), {k: float(v) for k, v in share.items()})
        for share, w in zip(shares, worst, strict=True)
    ]


def _column_sum(
    response: Response, column: list[Fraction], tail: _Tail
) -> tuple[list[Fraction], list[Fraction]] | None:
    """Σ |Φ^k b| of every component over so many k, and a bound on what is left and on the rounding to the grid."""
    m = len(column)
    entries = [_fraction(e) for e in response.step]
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


def _powers(response: Response, h: float, rate: float) -> list[tuple[int, Any]]:
    """(k, Φ^k) at multiples of the certified time constant."""
    step = np.array(response.step.tolist(), dtype=float)
    counts = [math.ceil(share / rate / h) for share in range(1, TIMES)]
    return [(k, np.linalg.matrix_power(step, k)) for k in counts]


def _disturbances(spec: Spec, observer: Any, response: Response) -> dict[str, list[Fraction]] | str:
    """δ of every cause: m, m/s and the friction's unit a sample."""
    system, h = observer.system, _fraction(observer.sample_time)

    def largest(name: str) -> Fraction | None:
        ends = spec.envelope.get(name)
        return None if ends is None else max(abs(_fraction(e)) for e in ends)

    acceleration = [largest(f"{v}_dot") or Fraction(0) for v in system.velocities]
    speed = [largest(v.name) for v in system.velocities]
    if any(response.by_position) and None in speed:
        return "g depends on x, and the envelope has no range for every velocity"
    slips = system.distribution.subs(observer.values)
    rates, contacts = [], []
    for c, contact in enumerate(system.contacts):
        slope = contact.law.slope_bound({k: observer.values[s] for k, s in contact.law_parameters.items()})
        if not getattr(slope, "is_Rational", False):
            return f"the law {contact.law.name} at {contact.name} has no bound on its slope"
        contacts.append(_fraction(slope) * _dot(slips.col(c), acceleration))
    onto = [_dot(slips.row(i), contacts) for i in range(slips.rows)]
    for error in observer.errors[len(acceleration) :]:
        index = [f"F_{x.name}" for x in system.positions].index(error.truth.name) if error.contact is None else -1
        rates.append(onto[index] if error.contact is None else contacts[error.contact])
    jerk = [
        _dot(response.by_position.row(i), [s or Fraction(0) for s in speed])
        + _dot(response.by_velocity.row(i), acceleration)
        + _dot(response.by_force.row(i), onto)
        for i in range(len(acceleration))
    ]
    return {
        "noise": [largest(f"{x}_noise") or Fraction(0) for x in system.positions],
        "displacement": [h * h * a / 2 for a in acceleration],
        "velocity": [h * h * j / 2 for j in jerk],
        "acceleration": acceleration,
        "friction": [h * r for r in rates],
    }


def _jump(observer: Observer, error: ErrorVariable) -> float:
    """How far the friction itself jumps at a reversal: twice the declared level at rest, or that on a coordinate."""
    system = observer.system
    levels = [2 * float(abs((c.level_at_rest or sympy.Integer(0)).subs(observer.values))) for c in system.contacts]
    if error.contact is not None:
        return levels[error.contact]
    slips = system.distribution.subs(observer.values)
    row = [f"F_{x.name}" for x in system.positions].index(error.truth.name)
    return float(sum(abs(float(slips[row, c])) * level for c, level in enumerate(levels)))


def _dot(row: Any, sizes: list[Fraction]) -> Fraction:
    return sum((abs(_fraction(e)) * s for e, s in zip(row, sizes, strict=True)), Fraction(0))


def _fraction(value: Any) -> Fraction:
    exact = sympy.Rational(value)
    return Fraction(int(exact.p), int(exact.q))


def _root(value: Fraction) -> Fraction:
    """√ of a number ≥ 0, rounded upwards."""
    scaled = math.ceil(value * GRID * GRID)
    return Fraction(math.isqrt(scaled) + 1, GRID)

"""A bound on the error of each friction estimate, in its own unit, as a function of time since the last reversal.

Every disturbance is bounded (|n| by the envelope's x_noise, |d_x| ≤ h² A/2, |d_v| ≤ h² J/2, |ΔF| ≤ h ρ), so the error
is at most the sum of the absolute impulse responses, which independent disturbances attain:
bound(k) = Σ_j (|D_j| + Σ_{i<k} |C Φ^i B_j|) δ_j + |C Φ^k| e₀. The sum is taken over so many samples that what is left,
bounded by the certificate's P, is below 1e-4 of it: |C Φ^i b| ≤ γ^i √(C P⁻¹ C') √(b'Pb) with γ² the certified fall.
All of it is in doubles, 1e-9 added; what is proved of the C, in rationals, is in ellipsoid.py.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from codegen.analysis.analysis import Analysis
from codegen.base.errors import BadInput
from codegen.certify.bound.bounds import DomainBound, ErrorBound
from codegen.certify.bound.domain_bound import Motion, domain_bound, peaks
from codegen.certify.bound.error_response import (
    ModelError,
    Response,
    disturbances,
    dot,
    error_response,
    sliding,
    with_rounding,
)
from codegen.certify.outcome import Certificate
from codegen.observers.equations import ErrorVariable, Observer
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical

TIMES = 6
PERCENT = Fraction(1, 100)
OFF = {
    "mass": ModelError(mass=PERCENT),
    "input gain": ModelError(gain=PERCENT),
    "sample time": ModelError(time=PERCENT),
}
HALVINGS = 24
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


def error_bounds(
    spec: Spec,
    analysis: Analysis,
    certificate: Certificate,
    rounding: tuple[Fraction, list[Fraction]] = (Fraction(0), []),
) -> tuple[ErrorBound, ...] | str:
    """The bounds of every friction error, or why there are none.

    Args:
        rounding: of the measured positions, and of each state in a step; none by default.

    The envelope must bound the accelerations (``v_dot``), and v too where g depends on x; ``x_noise`` bounds the
    position noise, quantisation included, and is 0 where the envelope is silent.
    """
    observer = analysis.dynamics.observer
    system = observer.system
    response = error_response(observer)
    if isinstance(response, str):
        return response
    missing = [f"{v}_dot" for v in system.velocities if f"{v}_dot" not in spec.envelope]
    if missing:
        return f"the envelope has no range for {', '.join(missing)}"
    sizes = disturbances(spec, observer, response)
    if isinstance(sizes, str):
        return sizes
    sizes = with_rounding(sizes, response, *rounding)
    tail, moved = Tail(certificate), {k: disturbances(spec, observer, response, off) for k, off in OFF.items()}
    off_by = {cause: size for cause, size in moved.items() if not isinstance(size, str)}
    counts = {k: [any(s[k][i] > 0 for s in (sizes, *off_by.values())) for i in range(len(v))] for k, v in sizes.items()}
    sums = column_sums(response, counts, tail)
    if sums is None:
        return f"the error decays too slowly to be summed over {LONGEST} samples"
    bounds = steady_bounds(response, sums, sizes)
    n, h = system.degrees_of_freedom, float(observer.sample_time)
    steady = [b.bound for b in bounds]
    more = {cause: steady_bounds(response, sums, size) for cause, size in off_by.items()}
    slips = system.distribution.subs(observer.values)
    guarded = observer.domain
    speed = max(sum(abs(float(slips[r, c])) * steady[r] for r in range(n)) for c in range(slips.cols))
    speed += 0.0 if guarded is None else float(guarded.slip_speed)  # below it a guard learns nothing
    speed = max(speed, *(float(s.speed) for c in system.contacts if (s := sliding(observer, c)) is not None))
    units = sorted({f"{u}/s" for u in system.position_units})
    domain, stands = None, {}
    if guarded is not None:
        seen = peaks(response, guarded, tail.gamma, tail.reach)

        def motion(size: dict[str, list[Fraction]], at: list[Steady]) -> DomainBound | str:
            found = Motion(response, size, (at[0].bound, at[1].bound), seen)
            return domain_bound(observer, guarded, found)

        domain = motion(sizes, bounds)
        for cause in off_by:
            stands[cause] = _stands(spec, observer, response, sums, cause, motion)
    powers = _powers(response, h, certificate.decay_rate)
    jumps = {j: _jump(observer, error) for j, error in list(enumerate(observer.errors))[n:]}
    together = [j for j in jumps if observer.errors[j].contact is None]  # a contact may act on several coordinates
    result = []
    for i, error in list(enumerate(observer.errors))[n:]:
        start = [s + (jumps[j] if j in (i, *together) else 0.0) for j, s in enumerate(steady)]
        later = [(k * h, float(np.abs(power[i]) @ start) * (1 + ROUNDING) + steady[i]) for k, power in powers]
        after = ((0.0, start[i]), *later)
        result.append(
            ErrorBound(
                name=error.symbol.name,
                unit=error.unit,
                steady=steady[i],
                parts=bounds[i].parts,
                start=start[i],
                starts=tuple(start),
                after=after,
                worst=bounds[i].worst,
                slip_speed=speed,
                slip_unit=" or ".join(units),
                domain=domain,
                percent={cause: b[i].bound - bounds[i].bound for cause, b in more.items()},
                stands=stands,
                largest=_largest(spec, observer, error),
            )
        )
    return tuple(result)


@numerical("the bound on the error")
def with_bounds(spec: Spec, analysis: Analysis, certificate: Certificate) -> Certificate:
    """The certificate with the bounds on the friction errors, or the words why there are none.

    Raises:
        BadInput: for a domain in which there is no bound.
    """
    bounds = error_bounds(spec, analysis, certificate)
    refuse_empty_domain(spec, analysis.dynamics.observer, bounds)
    return replace(certificate, bounds=bounds)


def rounding_share(
    observer: Observer, certificate: Certificate, rounding: tuple[Fraction, list[Fraction]]
) -> list[float] | None:
    """What rounding adds to the long-run bound of each friction error: the bound of these disturbances alone.

    The errors are linear in the disturbances, so the bound with rounding is at most the bound without it and this sum,
    which has no difference in it. None where it is not known.

    Args:
        rounding: of the measured positions, and of each state in a step.
    """
    response = error_response(observer)
    if isinstance(response, str):
        return None
    n, m = observer.system.degrees_of_freedom, response.step.rows
    zero = Fraction(0)
    none = {"noise": [zero] * n, "displacement": [zero] * n, "velocity": [zero] * n}
    none |= {"acceleration": [zero] * n, "friction": [zero] * (m - n)}
    sizes = with_rounding(none, response, *rounding)
    counts = {cause: [size > 0 for size in each] for cause, each in sizes.items()}
    sums = column_sums(response, counts, Tail(certificate))
    return None if sums is None else [b.bound for b in steady_bounds(response, sums, sizes)[n:]]


def refuse_empty_domain(spec: Spec, observer: Observer, bounds: tuple[ErrorBound, ...] | str) -> None:
    """Raise BadInput for a domain in which there is no bound, so that no code says that it holds."""
    guarded = observer.domain
    if guarded is None:
        return
    domain = bounds if isinstance(bounds, str) else bounds[0].domain
    if isinstance(domain, str):
        raise BadInput(
            spec.place("observer.domain"),
            f"no error bound holds in the domain ({domain})",
            "a domain for which there is a bound",
            code="SPEC022",
        )
    if domain is not None and domain.inside is None:
        found = f"slip_speed {float(guarded.slip_speed):.6g}, for which there is no bound"
        expected = f"at least {domain.least_slip_speed * 1.006:.3g}"
        raise BadInput(spec.place("observer.domain.slip_speed"), found, expected, code="SPEC026")


def _stands(
    spec: Spec,
    observer: Observer,
    response: Response,
    sums: list[ColumnSum],
    cause: str,
    motion: Callable[[dict[str, list[Fraction]], list[Steady]], DomainBound | str],
) -> float:
    """The share by which a model may be off in ``cause`` before the domain's slip speed is too low, by bisection."""
    low, high = Fraction(0), Fraction(1)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        unit = OFF[cause]
        off = ModelError(*[100 * middle * e for e in (unit.mass, unit.gain, unit.time)])
        size = disturbances(spec, observer, response, off)
        assert not isinstance(size, str)
        found = motion(size, steady_bounds(response, sums, size))
        good = isinstance(found, DomainBound) and found.inside is not None
        low, high = (middle, high) if good else (low, middle)
    return float(low)


def _powers(response: Response, h: float, rate: float) -> list[tuple[int, Any]]:
    """(k, Φ^k) at multiples of the certified time constant."""
    step = np.array(response.step.tolist(), dtype=float)
    counts = [math.ceil(share / rate / h) for share in range(1, TIMES)]
    return [(k, np.linalg.matrix_power(step, k)) for k in counts]


def _jump(observer: Observer, error: ErrorVariable) -> float:
    """How far the friction itself jumps at a reversal: twice the declared level at rest, or that on a coordinate."""
    slides = [sliding(observer, contact) for contact in observer.system.contacts]
    return 2 * _of_levels(observer, error, [float(s.level) if s is not None else 0.0 for s in slides])


def _largest(spec: Spec, observer: Observer, error: ErrorVariable) -> float | None:
    """The largest |friction| that the error is about; None where the envelope and the law are silent on a level."""
    levels = []
    for contact in observer.system.contacts:
        ends = spec.envelope.get(f"a_{contact.name}")
        slides = sliding(observer, contact)
        if slides is None or (ends is None and contact.level_at_rest is None):
            return None
        levels.append(max(abs(float(e)) for e in ends or (slides.level,)))
    return _of_levels(observer, error, levels)


def _of_levels(observer: Observer, error: ErrorVariable, levels: list[float]) -> float:
    """A level at each contact → that of the error's contact, or their most on its coordinate."""
    if error.contact is not None:
        return levels[error.contact]
    system = observer.system
    slips = system.distribution.subs(observer.values)
    return float(sum(abs(float(slips[error.coordinate, c])) * level for c, level in enumerate(levels)))

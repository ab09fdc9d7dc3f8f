"""A bound on the error of each friction estimate, in its own unit, as a function of time since the last reversal.

Every disturbance is bounded (|n| by the envelope's x_noise, |d_x| ≤ h² A/2, |d_v| ≤ h² J/2, |ΔF| ≤ h ρ), so the error
is at most the sum of the absolute impulse responses, which independent disturbances attain:
bound(k) = Σ_j (|D_j| + Σ_{i<k} |C Φ^i B_j|) δ_j + |C Φ^k| e₀. The sum is taken over so many samples that what is left,
bounded by the certificate's P, is below 1e-4 of it: |C Φ^i b| ≤ γ^i √(C P⁻¹ C') √(b'Pb) with γ² the certified fall.
All of it is in doubles, 1e-9 added; what is proved of the C, in rationals, is in ellipsoid.py.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from codegen.analysis.analysis import Analysis
from codegen.base.errors import BadInput
from codegen.certify.bound.bounds import DomainBound, ErrorBound
from codegen.certify.bound.disturbances import ModelError, Sizes, disturbances, dot, with_rounding
from codegen.certify.bound.domain_bound import domain_bound, peaks
from codegen.certify.bound.error_response import Response, error_response
from codegen.certify.bound.friction_bounds import Sliding, largest_friction, sliding
from codegen.certify.outcome import Certificate
from codegen.certify.sticking import slowest_while_sticking
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
class Sums:
    """Σ |Φ^k b| of every error for disturbances of size 1, ``ROUNDING`` added.

    Attributes:
        of: cause and index of each disturbance.
        here: over the samples summed, m by disturbances; rest: a bound on the remaining sum.
    """

    of: tuple[tuple[str, int], ...]
    here: Any
    rest: Any


def lyapunov_tail(certificate: Certificate) -> tuple[Any, float, Any, Any]:
    """(P, γ, seen, scale): |Φ^k|[i, j] ≤ γ^k seen_i scale_j with seen_i = √(C_i P⁻¹ C_i') and scale_j = √(e_j'Pe_j)."""
    content = certificate.content
    p = np.array([[float(Fraction(x)) for x in row] for row in content["lyapunov_matrix"]])
    scale = np.sqrt(np.diag(p))
    seen = np.sqrt(np.diag(np.linalg.inv(p / np.outer(scale, scale)))) / scale
    fall = 1 - 2 * Fraction(content["decay_rate"]) * Fraction(content["sample_time"])
    return p, float(fall) ** 0.5, seen, scale


def impulse_sums(response: Response, sizes: Sequence[Sizes], certificate: Certificate) -> Sums | None:
    """The sums for the disturbances that are above zero in any of ``sizes``; None where the error decays too slowly."""
    p, gamma, seen, _ = lyapunov_tail(certificate)
    step, n = _doubles(response.step), response.noise.cols
    unit = np.eye(len(step))
    blocks = {
        "noise": _doubles(response.noise),
        "displacement": _doubles(response.displacement),
        "velocity": _doubles(response.velocity),
        "acceleration": _doubles(response.acceleration),
        "friction": unit[:, n:],
        "rounding": unit,
    }
    named = {
        (cause, k): column
        for cause, block in blocks.items()
        for k, column in enumerate(block.T)
        if column.any() and any(size[cause][k] > 0 for size in sizes)
    }
    vectors = np.column_stack([np.zeros((len(step), 0)), *named.values()])
    here, left = np.zeros_like(vectors), seen / (1 - gamma) * (1 + ROUNDING)
    for count in range(1, LONGEST + 1):
        here += np.abs(vectors)
        vectors = step @ vectors
        if count % EVERY == 0:
            rest = np.outer(left, np.sqrt(np.maximum(np.sum(vectors * (p @ vectors), axis=0), 0.0)))
            if (rest <= REST * here)[here > 0].all():
                return Sums(tuple(named), here * (1 + ROUNDING), rest * (1 + ROUNDING))
    return None


def steady_bounds(response: Response, sums: Sums, sizes: Sizes) -> list[Steady]:
    """For every component Σ_k |Φ^k B| δ over all disturbances, and the direct part of the noise."""
    result = []
    for i in range(response.step.rows):
        direct = float(dot(response.direct.row(i), sizes["noise"]))
        parts, worst = {"noise": direct}, direct
        for (cause, k), here, rest in zip(sums.of, sums.here[i], sums.rest[i], strict=True):
            size = float(sizes[cause][k])
            worst += float(here) * size
            parts[cause] = parts.get(cause, 0.0) + float(here + rest) * size
        result.append(Steady(sum(parts.values()), worst, parts))
    return result


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
    response = certificate.response or error_response(observer)
    if isinstance(response, str):
        return response
    missing = [f"{v}_dot" for v in system.velocities if f"{v}_dot" not in spec.envelope]
    if missing:
        return f"the envelope has no range for {', '.join(missing)}"
    sizes = disturbances(spec, observer, response)
    if isinstance(sizes, str):
        return sizes
    sizes = with_rounding(sizes, response, *rounding)
    moved = {cause: disturbances(spec, observer, response, off) for cause, off in OFF.items()}
    off_by = {cause: size for cause, size in moved.items() if not isinstance(size, str)}
    sums = impulse_sums(response, [sizes, *off_by.values()], certificate)
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
    slides = [sliding(observer, contact) for contact in system.contacts]
    speed = max(speed, *(float(s.speed) for s in slides if s is not None))
    most = largest_friction(spec, observer)
    domain, stands = None, {}
    if guarded is not None:
        _, gamma, seen, scale = lyapunov_tail(certificate)
        highest = peaks(response, guarded, gamma, np.outer(seen, scale) * (1 + ROUNDING))

        def inside(size: Sizes) -> DomainBound | str:
            at = steady if size is sizes else [b.bound for b in steady_bounds(response, sums, size)]
            return domain_bound(observer, response, size, at, highest)

        domain = inside(sizes)
        stands = {cause: _stands(spec, observer, response, OFF[cause], inside) for cause in off_by}
    powers = _powers(response, h, certificate.decay_rate)
    jumps = {j: _jump(observer, error, slides) for j, error in list(enumerate(observer.errors))[n:]}
    together = [j for j in jumps if observer.errors[j].contact is None]  # a contact may act on several coordinates
    result = []
    for i, error in list(enumerate(observer.errors))[n:]:
        start = [s + (jumps[j] if j in (i, *together) else 0.0) for j, s in enumerate(steady)]
        later = [(k * h, float(np.abs(power[i]) @ start) * (1 + ROUNDING) + steady[i]) for k, power in powers]
        result.append(
            ErrorBound(
                name=error.symbol.name,
                unit=error.unit,
                steady=steady[i],
                parts=bounds[i].parts,
                start=start[i],
                starts=tuple(start),
                after=((0.0, start[i]), *later),
                worst=bounds[i].worst,
                slip_speed=speed,
                slip_unit=" or ".join(sorted({f"{u}/s" for u in system.position_units})),
                domain=domain,
                percent={cause: b[i].bound - steady[i] for cause, b in more.items()},
                stands=stands,
                largest=_largest(observer, error, most),
            )
        )
    return tuple(result)


@numerical("the bound on the error")
def with_bounds(spec: Spec, analysis: Analysis, certificate: Certificate) -> Certificate:
    """The certificate with the bounds on the friction errors, or the words why there are none.

    Raises:
        BadInput: for a domain in which there is no bound.
    """
    observer = analysis.dynamics.observer
    response = error_response(observer)
    if not isinstance(response, str):
        certificate = replace(certificate, response=response, sticking=slowest_while_sticking(observer, response))
    bounds = response if isinstance(response, str) else error_bounds(spec, analysis, certificate)
    refuse_empty_domain(spec, observer, bounds)
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
    response = certificate.response or error_response(observer)
    if isinstance(response, str):
        return None
    n, rest = observer.system.degrees_of_freedom, len(observer.errors) - observer.system.degrees_of_freedom
    counts = {"noise": n, "displacement": n, "velocity": n, "acceleration": n, "friction": rest, "rounding": n + rest}
    sizes = with_rounding({cause: [Fraction(0)] * count for cause, count in counts.items()}, response, *rounding)
    sums = impulse_sums(response, [sizes], certificate)
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
    spec: Spec, observer: Observer, response: Response, unit: ModelError, inside: Callable[[Sizes], DomainBound | str]
) -> float:
    """The share by which a model may be off before the domain's slip speed is too low, by bisection.

    Args:
        unit: off by a percent.
    """
    low, high = Fraction(0), Fraction(1)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        off = ModelError(*[100 * middle * e for e in (unit.mass, unit.gain, unit.time)])
        size = disturbances(spec, observer, response, off)
        assert not isinstance(size, str)
        found = inside(size)
        good = isinstance(found, DomainBound) and found.inside is not None
        low, high = (middle, high) if good else (low, middle)
    return float(low)


def _powers(response: Response, h: float, rate: float) -> list[tuple[int, Any]]:
    """(k, Φ^k) at multiples of the certified time constant."""
    step = np.array(response.step.tolist(), dtype=float)
    counts = [math.ceil(share / rate / h) for share in range(1, TIMES)]
    return [(k, np.linalg.matrix_power(step, k)) for k in counts]


def _jump(observer: Observer, error: ErrorVariable, slides: Sequence[Sliding | None]) -> float:
    """How far the friction itself jumps at a reversal: twice the declared level at rest, or that on a coordinate."""
    return 2 * _of_levels(observer, error, [float(s.level) if s is not None else 0.0 for s in slides])


def _largest(observer: Observer, error: ErrorVariable, most: Sequence[Fraction | None]) -> float | None:
    """The largest |friction| that the error is about; None where that of a contact is not known."""
    levels = [float(x) for x in most if x is not None]
    return _of_levels(observer, error, levels) if len(levels) == len(most) else None


def _of_levels(observer: Observer, error: ErrorVariable, levels: list[float]) -> float:
    """A level at each contact → that of the error's contact, or their most on its coordinate."""
    if error.contact is not None:
        return levels[error.contact]
    system = observer.system
    slips = system.distribution.subs(observer.values)
    return float(sum(abs(float(slips[error.coordinate, c])) * level for c, level in enumerate(levels)))

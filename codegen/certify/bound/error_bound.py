"""Bound on the error of each friction estimate, in its own unit, as a function of time since the last reversal.

With |d_j| ≤ δ_j for every disturbance (``disturbances.py``), the error k samples after a reversal satisfies

    |C e[k]| ≤ Σ_j (|D_j| + Σ_{i<k} |C Φ^i B_j|) δ_j + |C Φ^k| e₀,

the L1 norms of the impulse responses; independent disturbances attain it. The infinite sum is computed up to a sample
from which on its remainder is below ``REST`` of it, by |C Φ^i b| ≤ γ^i √(C P⁻¹ C') √(b'Pb) with the certificate's P and
γ² = 1 − 2αh. All of this is in double precision with ``ROUNDING`` added; ellipsoid.py has the bound that is proved of
the C in rationals.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from codegen.analysis.analysis import Analysis
from codegen.base.errors import BadInput
from codegen.certify.bound.bounds import DomainBound, ErrorBound, SlipSpeed
from codegen.certify.bound.disturbances import ModelError, Sizes, disturbances, dot, of_friction, with_rounding
from codegen.certify.bound.domain_bound import domain_bound
from codegen.certify.bound.error_response import Response, error_response
from codegen.certify.bound.friction_bounds import Sliding, largest_friction, sliding
from codegen.certify.outcome import Certificate
from codegen.certify.sticking import slowest_while_sticking
from codegen.observers.equations import Observer
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical

SHARES = (1, 2, 3, 4, 6)
"""Times after a reversal at which the bound is stated, in units of 1/α, α the best rate known."""
PERCENT = Fraction(1, 100)
"""Relative model error for which the increase of the bound is stated."""
OFF = {
    "mass": ModelError(mass=PERCENT),
    "input gain": ModelError(gain=PERCENT),
    "sample time": ModelError(time=PERCENT),
}
"""Kind of model error → a model error of one percent."""
HALVINGS = 24
"""Bisection steps for the tolerated model error of a domain."""
LONGEST, EVERY = 20_000, 64
"""Largest number of samples that are summed, and number of samples between two checks of the remainder."""
REST, ENOUGH = 1e-6, 1e-4
"""Bound on the remainder relative to the sum, at which the summation ends; and the one accepted after ``LONGEST``."""
ROUNDING = 1e-9
"""Relative allowance for rounding errors."""


@dataclass(frozen=True)
class Steady:
    """Bound on one error component in the long run, under bounded disturbances: an L1 norm of impulse responses.

    Attributes:
        worst: Σ over the samples that were summed, which independent disturbances attain.
        parts: cause → its part of ``bound``.
    """

    worst: float
    parts: dict[str, float]

    @property
    def bound(self) -> float:
        """Σ over all samples, the remainder included."""
        return sum(self.parts.values())


@dataclass(frozen=True)
class Sums:
    """L1 norms Σ_k |Φ^k b| of the impulse responses of every error component to every disturbance; rounded up.

    Attributes:
        of: cause and index of each disturbance.
        finite: the sum over the samples that were computed, m by disturbances.
        remainder: bound on the sum over all later samples, m by disturbances.
    """

    of: tuple[tuple[str, int], ...]
    finite: Any
    remainder: Any


def lyapunov_tail(certificate: Certificate) -> tuple[Any, float, Any, Any]:
    """(P, γ, r, c) with |(Φ^k)_ij| ≤ γ^k r_i c_j, where r_i = √((P⁻¹)_ii), c_j = √(P_jj) and γ² = 1 − 2αh."""
    content = certificate.content
    p = np.array([[float(Fraction(x)) for x in row] for row in content["lyapunov_matrix"]])
    columns = np.sqrt(np.diag(p))
    rows = np.sqrt(np.diag(np.linalg.inv(p / np.outer(columns, columns)))) / columns
    decrease = 1 - 2 * Fraction(content["decay_rate"]) * Fraction(content["sample_time"])
    return p, float(decrease) ** 0.5, rows, columns


def impulse_sums(response: Response, sizes: Sequence[Sizes], certificate: Certificate) -> Sums | None:
    """The L1 norms for all disturbances that some of ``sizes`` has; None if ``LONGEST`` samples are too few.

    The bound on the remainder after N samples is √((P⁻¹)_ii) √(x'Px)/(1 − γ) with x = Φ^N b.
    """
    p, gamma, rows, _ = lyapunov_tail(certificate)
    step = np.array(response.step, dtype=float)
    named = {
        (cause, k): column
        for cause, block in response.inputs.items()
        for k, column in enumerate(np.array(block, dtype=float).T)
        if column.any() and any(size[cause][k] > 0 for size in sizes)
    }
    vectors = np.column_stack([np.zeros((len(step), 0)), *named.values()])
    finite, series = np.zeros_like(vectors), rows / (1 - gamma) * (1 + ROUNDING)
    for count in range(1, LONGEST + 1):
        finite += np.abs(vectors)
        vectors = step @ vectors
        if count % EVERY == 0:
            remainder = np.outer(series, np.sqrt(np.maximum(np.sum(vectors * (p @ vectors), axis=0), 0.0)))
            rest = REST if count + EVERY <= LONGEST else ENOUGH
            if (remainder <= rest * finite)[finite > 0].all():
                return Sums(tuple(named), finite * (1 + ROUNDING), remainder * (1 + ROUNDING))
    return None


def steady_bounds(response: Response, sums: Sums, sizes: Sizes) -> list[Steady]:
    """The long-run bound |D| δ_noise + Σ_j Σ_k |Φ^k B_j| δ_j of every error component."""
    result = []
    for i in range(response.step.rows):
        direct = float(dot(response.direct.row(i), sizes["noise"]))
        parts, worst = {"noise": direct}, direct
        for (cause, k), finite, remainder in zip(sums.of, sums.finite[i], sums.remainder[i], strict=True):
            size = float(sizes[cause][k])
            worst += float(finite) * size
            parts[cause] = parts.get(cause, 0.0) + float(finite + remainder) * size
        result.append(Steady(worst, parts))
    return result


def error_bounds(
    spec: Spec,
    analysis: Analysis,
    certificate: Certificate,
    rounding: tuple[Fraction, list[Fraction]] = (Fraction(0), []),
) -> tuple[ErrorBound, ...] | str:
    """The bounds on all friction errors as functions of time since the last reversal, or why there are none.

    The envelope must bound the accelerations (``v_dot``), and v too where g depends on x; ``x_noise`` bounds the
    position noise, quantisation included, and is 0 if the envelope does not have it.

    Args:
        rounding: bounds on the rounding errors of the measured positions and of each state in a step; zero by default.
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
    with_model_error = {cause: disturbances(spec, observer, response, off) for cause, off in OFF.items()}
    other_sizes = {cause: size for cause, size in with_model_error.items() if not isinstance(size, str)}
    sums = impulse_sums(response, [sizes, *other_sizes.values()], certificate)
    if sums is None:
        return f"the error has not decayed after {LONGEST} samples, the most that are summed"
    bounds = steady_bounds(response, sums, sizes)
    steady = [b.bound for b in bounds]
    other_bounds = {cause: steady_bounds(response, sums, size) for cause, size in other_sizes.items()}
    # ``disturbances`` has a bound for each contact, so each has a slope.
    slides = [s for s in (sliding(observer, contact) for contact in system.contacts) if s is not None]
    largest = [x for x in largest_friction(spec, observer) if x is not None]
    of_friction_errors = list(enumerate(observer.errors))[system.degrees_of_freedom :]
    levels = {i: float(of_friction(observer, e, [s.level for s in slides])) for i, e in of_friction_errors}
    starts = _at_reversal(observer, steady, levels)
    after = _after_reversal(observer, response, certificate, steady, starts)
    speeds = _slip_speeds(observer, steady, slides)
    domain, tolerated = _in_domain(spec, observer, response, certificate, sums, sizes, [*other_sizes])
    return tuple(
        ErrorBound(
            name=error.symbol.name,
            unit=error.unit,
            steady=steady[i],
            parts=bounds[i].parts,
            start=starts[i][i],
            starts=starts[i],
            after=after[i],
            worst=bounds[i].worst,
            slip_speeds=speeds,
            domain=domain,
            percent={cause: b[i].bound - steady[i] for cause, b in other_bounds.items()},
            largest_model_error=tolerated,
            largest=float(of_friction(observer, error, largest)) if len(largest) == len(slides) else None,
            level=levels[i],
            without_noise=tuple(x.name for x in system.positions if f"{x}_noise" not in spec.envelope),
        )
        for i, error in of_friction_errors
    )


def _at_reversal(
    observer: Observer, steady: Sequence[float], levels: Mapping[int, float]
) -> dict[int, tuple[float, ...]]:
    """Index of a friction error → bound on |error| of each component just after a reversal, at which that one jumps.

    The true friction jumps there by twice the level where sliding begins. A contact may act on several coordinates, so
    errors that are of coordinates jump together.

    Args:
        steady: bound on each error component in the long run.
        levels: index of a friction error → the level.
    """
    together = [j for j in levels if observer.errors[j].contact is None]
    return {i: tuple(s + (2 * levels[j] if j in (i, *together) else 0.0) for j, s in enumerate(steady)) for i in levels}


def _after_reversal(
    observer: Observer,
    response: Response,
    certificate: Certificate,
    steady: Sequence[float],
    starts: Mapping[int, tuple[float, ...]],
) -> dict[int, tuple[tuple[float, float], ...]]:
    """Index of a friction error → (seconds since a reversal, bound on that error), at 0 and at ``SHARES`` of 1/α."""
    h, best_rate = float(observer.sample_time), certificate.best_rate or certificate.decay_rate
    counts = [math.ceil(share / best_rate / h) for share in SHARES]
    reach, gamma = _reach(certificate)
    after = {}
    for i, start in starts.items():
        falling = _decay_of_start(response, i, np.array(start), counts, reach[i], gamma)
        later = [(k * h, left * (1 + ROUNDING) + steady[i]) for k, left in zip(counts, falling, strict=True)]
        after[i] = ((0.0, start[i]), *later)
    return after


def _in_domain(
    spec: Spec,
    observer: Observer,
    response: Response,
    certificate: Certificate,
    sums: Sums,
    sizes: Sizes,
    causes: Sequence[str],
) -> tuple[DomainBound | str | None, dict[str, float]]:
    """Bounds in the observer's domain, or why there are none, and cause → the model error up to which there are.

    Without a domain: None, and no causes.
    """
    if observer.domain is None:
        return None, {}
    inside = _bounds_in_domain(observer, response, sums, *_reach(certificate), observer.domain.samples)
    return inside(sizes), {cause: _tolerated(spec, observer, response, OFF[cause], inside) for cause in causes}


def _reach(certificate: Certificate) -> tuple[Any, float]:
    """(R, γ) with |(Φ^k)_ij| ≤ γ^k R_ij; rounded up."""
    _, gamma, rows, columns = lyapunov_tail(certificate)
    return np.outer(rows, columns) * (1 + ROUNDING), gamma


def _slip_speeds(observer: Observer, steady: Sequence[float], slides: Sequence[Sliding]) -> tuple[SlipSpeed, ...]:
    """For each contact the slip speed above which the sign of its estimate is right; |u − û| ≤ Σ_i |U_ic| |v_i − v̂_i|.

    Args:
        steady: bound on each error component in the long run.
        slides: of each contact.
    """
    slips = observer.distribution
    more = 0.0 if observer.domain is None else float(observer.domain.slip_speed)
    return tuple(
        SlipSpeed(
            contact=contact.name,
            unit=f"{contact.slip_unit}/s",
            error=sum(abs(float(slips[r, c])) * steady[r] for r in range(slips.rows)),
            more=more,
            sliding=float(slide.speed),
        )
        for c, (contact, slide) in enumerate(zip(observer.system.contacts, slides, strict=True))
    )


@numerical("the bound on the error")
def with_bounds(spec: Spec, analysis: Analysis, certificate: Certificate) -> Certificate:
    """The certificate with bounds on the friction errors, or with the reason why there are none.

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
    """Contribution of rounding to the long-run bound of each friction error; None if it is not known.

    The bound is linear in the sizes of the disturbances, so it is computed with rounding as the only disturbance, and
    not as the difference of two nearly equal numbers.

    Args:
        rounding: as in ``error_bounds``.
    """
    response = certificate.response or error_response(observer)
    if isinstance(response, str):
        return None
    none = {cause: [Fraction(0)] * block.cols for cause, block in response.inputs.items()}
    sizes, n = with_rounding(none, response, *rounding), response.noise.cols
    sums = impulse_sums(response, [sizes], certificate)
    return None if sums is None else [b.bound for b in steady_bounds(response, sums, sizes)[n:]]


def refuse_empty_domain(spec: Spec, observer: Observer, bounds: tuple[ErrorBound, ...] | str) -> None:
    """Raise BadInput for a domain in which there is no bound; no code with an output ``in_domain`` is generated."""
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


def _bounds_in_domain(
    observer: Observer, response: Response, sums: Sums, reach: Any, fall: float, settle: int
) -> Callable[[Sizes], DomainBound | str]:
    """The function (bounds on the disturbances) → bounds in the observer's domain, or the reason why there are none.

    Args:
        reach, fall: as of ``_decay_of_start``, ``reach`` for each error component.
        settle: samples after which the domain's bounds hold.
    """
    highest = {
        (i, j, k): _decay_of_start(response, i, unit, [k], reach[i], fall)[0] * (1 + ROUNDING)
        for i in (0, 1)
        for j, unit in enumerate(np.eye(response.step.rows)[:2])
        for k in {0, settle}
    }

    def inside(sizes: Sizes) -> DomainBound | str:
        at = [b.bound for b in steady_bounds(response, sums, sizes)]
        return domain_bound(observer, response, sizes, at, highest)

    return inside


def _tolerated(
    spec: Spec, observer: Observer, response: Response, unit: ModelError, inside: Callable[[Sizes], DomainBound | str]
) -> float:
    """The largest relative model error, up to 1, for which the domain has a bound; by bisection.

    Args:
        unit: a model error of this kind, of one percent.
        inside: bounds on the disturbances → bounds of the domain, or the reason why there are none.
    """
    low, high = Fraction(0), Fraction(1)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        off = ModelError(*[100 * middle * e for e in (unit.mass, unit.gain, unit.time)])
        size = disturbances(spec, observer, response, off)
        assert not isinstance(size, str)
        bound = inside(size)
        good = isinstance(bound, DomainBound) and bound.inside is not None
        low, high = (middle, high) if good else (low, middle)
    return float(low)


def _decay_of_start(
    response: Response, i: int, start: Any, counts: Sequence[int], reach: Any, fall: float
) -> list[float]:
    """sup over j ≥ k of Σ_l |(Φ^j)_il| start_l, for each number of samples k in ``counts``: decay of initial errors.

    The powers are computed until the bound on all later ones, from the certificate's P, is below the largest found.

    Args:
        i: index of the error component.
        start: |error| of each component at the start.
        reach, fall: numbers with |(Φ^j)_il| ≤ reach_l fall^j (``lyapunov_tail``).
    """
    step = np.array(response.step, dtype=float)
    row, found, last = np.linalg.matrix_power(step, counts[0])[i], [0.0 for _ in counts], counts[-1] + LONGEST
    for k in range(counts[0], last + 1):
        here, rest = float(np.abs(row) @ start), float(reach @ start) * fall ** (k + 1)
        here = max(here, rest) if k == last else here
        found = [max(left, here) if count <= k else left for left, count in zip(found, counts, strict=True)]
        if k >= counts[-1] and rest <= found[-1]:
            break
        row = row @ step
    return found

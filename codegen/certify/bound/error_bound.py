"""Bound on the error of each friction estimate, in its own unit, as a function of time since the last reversal.

With |d_j| ≤ δ_j for every disturbance (``disturbances.py``), the error of row C long after a reversal is within

    |D| δ_noise + Σ_j (Σ_{i<N} |C Φ^i B_j| + √(rP⁻¹r') a_j) δ_j,    r = C Φ^N,

the L1 norms of the impulse responses over N samples, and the invariant ellipsoid of the certificate's V for all later
ones (a_j: ``reach.py``). ellipsoid.py writes the same bound in rationals, and the checker proves it of the C.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
import sympy

from codegen.analysis.analysis import Analysis
from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.certify.bound.bounds import DomainBound, ErrorBound, SlipSpeed
from codegen.certify.bound.disturbances import EXACT, ModelError, Sizes, disturbances, dot, of_friction, with_rounding
from codegen.certify.bound.domain_bound import domain_bound
from codegen.certify.bound.error_response import Response, error_response
from codegen.certify.bound.friction_bounds import Sliding, fastest_slip, largest_friction, sliding
from codegen.certify.bound.reach import LONGEST, Reach, reach_of
from codegen.certify.certificate_text import fraction, upwards
from codegen.certify.outcome import Certificate
from codegen.certify.sticking import slowest_while_sticking
from codegen.mechanics.system import ContactFriction
from codegen.observers.equations import Observer
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical

SHARES = (1, 2, 3, 4, 6)
"""Times after a reversal at which the bound is stated, in units of 1/α, α the best rate known."""
BEYOND = 9
"""The same, from which on the ellipsoid alone bounds the error; it is not stated, and makes those before it smaller."""
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
MOST_HALVINGS, LARGER, MARGIN = 12, 1.1, 1e-3
"""Of the search in ``_steep_below``: most halvings of the speed; the ratio from which on a bound counts as larger than
another; the relative margin by which the speed exceeds E."""
PEAK_SAMPLES = 20.0
"""Time constants of V after which a peak of Φ^k is bounded by V."""


@dataclass(frozen=True)
class LongRun:
    """Bounds on every error component in the long run, linear in the sizes of the disturbances.

    Attributes:
        of: cause and index of each disturbance.
        columns: b of each, m by disturbances.
        summed: Σ_{k<N} |Φ^k b|, m by disturbances.
        rest: bound on the sum over all later k, m by disturbances.
    """

    response: Response
    of: tuple[tuple[str, int], ...]
    columns: Array
    summed: Array
    rest: Array

    def parts(self, sizes: Sizes, i: int) -> dict[str, float]:
        """Cause → its part of the bound on component i; their sum is the bound."""
        parts = {"noise": float(dot(self.response.direct.row(i), sizes["noise"]))}
        for (cause, k), whole in zip(self.of, self.summed[i] + self.rest[i], strict=True):
            parts[cause] = parts.get(cause, 0.0) + float(whole) * float(sizes[cause][k])
        return parts

    def bounds(self, sizes: Sizes) -> list[float]:
        """The bound on every component."""
        return [sum(self.parts(sizes, i).values()) for i in range(len(self.summed))]

    def driven(self, sizes: Sizes) -> tuple[Array, Array, Array]:
        """(columns b_j, bound on the direct feedthrough of noise to every component, d_j)."""
        size = np.array([float(sizes[cause][k]) for cause, k in self.of])
        rows = range(len(self.summed))
        return self.columns, np.array([float(dot(self.response.direct.row(i), sizes["noise"])) for i in rows]), size

    def attained(self, sizes: Sizes, i: int) -> float:
        """What some disturbances attain of component i in the samples that are summed."""
        direct = float(dot(self.response.direct.row(i), sizes["noise"]))
        return direct + sum(float(s) * float(sizes[c][k]) for (c, k), s in zip(self.of, self.summed[i], strict=True))


def long_run(response: Response, reach: Reach, sizes: Sequence[Sizes]) -> LongRun:
    """The bounds in the long run under the disturbances that are in some of ``sizes``."""
    named = {
        (cause, k): column
        for cause, block in response.inputs.items()
        for k, column in enumerate(np.array(block, dtype=float).T)
        if column.any() and any(size[cause][k] > 0 for size in sizes)
    }
    columns = np.column_stack([np.zeros((len(reach.step), 0)), *named.values()])
    numbers = [np.array([float(size[cause][k]) for cause, k in named]) for size in sizes]
    summed, rest, _ = reach.sums(np.eye(len(reach.step)), columns, numbers)
    return LongRun(response, tuple(named), columns, summed, rest)


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
    reach = reach_of(response, certificate.content)
    above = _steep_below(spec, observer, response, reach)
    sizes = disturbances(spec, observer, response, EXACT, above)
    if isinstance(sizes, str):
        return sizes
    sizes = with_rounding(sizes, response, *rounding)
    with_model_error = {cause: disturbances(spec, observer, response, off, above) for cause, off in OFF.items()}
    other_sizes = {cause: size for cause, size in with_model_error.items() if not isinstance(size, str)}
    later = long_run(response, reach, [sizes, *other_sizes.values()])
    driven, noise, size = later.driven(sizes)
    summed = later.summed @ size
    if not (later.rest @ size <= summed)[summed > 0].all():  # else the bound is within twice the worst error
        return f"the error has not decayed after {LONGEST} samples, the most that are summed"
    steady = later.bounds(sizes)
    with_other = {cause: later.bounds(size) for cause, size in other_sizes.items()}
    # ``disturbances`` has a bound for each contact, so each has a slope.
    slides = [s for s in (sliding(observer, contact) for contact in system.contacts) if s is not None]
    largest = [x for x in largest_friction(spec, observer) if x is not None]
    of_friction_errors = list(enumerate(observer.errors))[system.degrees_of_freedom :]
    levels = {i: float(of_friction(observer, e, [s.level for s in slides])) for i, e in of_friction_errors}
    # At a reversal the true friction jumps by twice the level where sliding begins. A contact may act on several
    # coordinates, so errors that are of coordinates jump together.
    together = [j for j in levels if observer.errors[j].contact is None]
    starts = {
        i: tuple(s + (2 * levels[j] if j in (i, *together) else 0.0) for j, s in enumerate(steady)) for i in levels
    }
    counts = after_reversal(observer, certificate)
    speeds = _slip_speeds(spec, observer, steady, slides, above)
    domain, tolerated = _in_domain(spec, observer, reach, later, sizes, [*other_sizes])
    times = [k * float(observer.sample_time) for k in counts[:-1] or counts]

    def after(i: int) -> tuple[tuple[float, float], ...]:
        """Bounds on friction error i from each of these times on, after the start that is assumed."""
        whole = np.array(starts[i]) + noise
        found = reach.later(np.eye(len(whole))[i], driven * size, counts, whole, reach.level_of(whole, driven, size))
        return tuple((t, x + noise[i]) for t, x in zip(times, found, strict=False))

    return tuple(
        ErrorBound(
            name=error.symbol.name,
            unit=error.unit,
            steady=steady[i],
            parts=later.parts(sizes, i),
            start=starts[i][i],
            starts=starts[i],
            after=after(i),
            worst=later.attained(sizes, i),
            slip_speeds=speeds,
            domain=domain,
            percent={cause: b[i] - steady[i] for cause, b in with_other.items()},
            largest_model_error=tolerated,
            largest=float(of_friction(observer, error, largest)) if len(largest) == len(slides) else None,
            level=levels[i],
            without_noise=tuple(x.name for x in system.positions if f"{x}_noise" not in spec.envelope),
        )
        for i, error in of_friction_errors
    )


def after_reversal(observer: Observer, certificate: Certificate) -> list[int]:
    """The numbers of samples after a reversal from which on a bound is stated, and one ``BEYOND`` these."""
    h, best_rate = float(observer.sample_time), certificate.best_rate or certificate.decay_rate
    counts = (math.ceil(share / best_rate / h) for share in (*SHARES, BEYOND))
    return [*dict.fromkeys(min(count, LONGEST) for count in counts)]


def _in_domain(
    spec: Spec, observer: Observer, reach: Reach, later: LongRun, sizes: Sizes, causes: Sequence[str]
) -> tuple[DomainBound | str | None, dict[str, float]]:
    """Bounds in the domain, or why there are none; and cause → the model error up to which there are bounds."""
    if observer.domain is None:
        return None, {}
    unit, more = np.eye(len(reach.step)), math.ceil(min(PEAK_SAMPLES / (1 - reach.gamma), LONGEST))
    peaks = {
        (i, j, k): reach.later(unit[i], unit[:, :0], [k, k + more], unit[j], reach.p[j, j])[0]
        for i in (0, 1)
        for j in (0, 1)
        for k in {0, observer.domain.samples}
    }

    def inside(sizes: Sizes) -> DomainBound | str:
        return domain_bound(observer, later.response, sizes, later.bounds(sizes), peaks)

    return inside(sizes), {cause: _tolerated(spec, observer, later.response, OFF[cause], inside) for cause in causes}


def _steep_below(spec: Spec, observer: Observer, response: Response, reach: Reach) -> tuple[Fraction, ...]:
    """For each contact the slip speed above which the bounds are stated; 0 where they hold at any slip speed.

    Only the slope of the law above this speed is counted. The speed must be at least E, the bound on |u − û|, since the
    sign of û is known only there. The search starts at the E that belongs to the slope over all speeds, or at half the
    fastest slip in the envelope if that is less. It halves the speed while no bound becomes ``LARGER`` than at the
    start. The result is used only if the slope over all speeds gives a bound that is ``LARGER``.
    """
    contacts = observer.system.contacts
    none, fastest = (Fraction(0),) * len(contacts), [fastest_slip(spec, observer, c) for c in range(len(contacts))]

    def is_steep(contact: ContactFriction, most: Any) -> bool:
        """Whether the law is less steep at the highest speed than at others."""
        each = [sliding(observer, contact, of) for of in (None, (fraction(most), fraction(most)))]
        slopes = [s.slope for s in each if s is not None]
        return bool(slopes) and slopes[0] > slopes[-1]

    steep = [0 < f < sympy.oo and is_steep(contact, f) for contact, f in zip(contacts, fastest, strict=True)]
    sizes = disturbances(spec, observer, response)
    if not any(steep) or isinstance(sizes, str) or observer.domain is not None:
        return none
    later, least, chosen = long_run(response, reach, [sizes]), list[float](), none
    whole = later.bounds(sizes)
    errors = _slip_errors(observer, whole)
    first = [min(e, float(f) / 2) if s else 0.0 for e, f, s in zip(errors, fastest, steep, strict=True)]
    for k in range(MOST_HALVINGS):
        above = tuple(upwards(speed / 2**k, 3) for speed in first)
        size = disturbances(spec, observer, response, EXACT, above)
        assert not isinstance(size, str)
        found = later.bounds(size)
        least, errors = least or found, _slip_errors(observer, found)
        known = all(e <= (1 - MARGIN) * a for e, a in zip(errors, above, strict=True) if a)
        smaller = any(LARGER * x < y for x, y in zip(found, whole, strict=True))
        if not known or not smaller or any(x > LARGER * y for x, y in zip(found, least, strict=True)):
            break
        chosen = above
    return chosen


def _slip_errors(observer: Observer, steady: Sequence[float]) -> list[float]:
    """For each contact Σ_i |U_ic| |v_i − v̂_i|, a bound on |u − û|; ``steady``: bound on each error in the long run."""
    slips = observer.distribution
    return [sum(abs(float(slips[r, c])) * steady[r] for r in range(slips.rows)) for c in range(slips.cols)]


def _slip_speeds(
    spec: Spec, observer: Observer, steady: Sequence[float], slides: Sequence[Sliding], above: Sequence[Fraction]
) -> tuple[SlipSpeed, ...]:
    """For each contact the slip speed above which the sign of its estimate is right.

    Args:
        steady: bound on each error component in the long run.
        above: as of ``_steep_below``.
    """
    more = 0.0 if observer.domain is None else float(observer.domain.slip_speed)
    return tuple(
        SlipSpeed(
            contact=contact.name,
            unit=f"{contact.slip_unit}/s",
            error=error,
            more=more,
            sliding=float(slide.speed),
            above=least,
            fastest=float(fastest_slip(spec, observer, c)),
        )
        for c, (contact, slide, error, least) in enumerate(
            zip(observer.system.contacts, slides, _slip_errors(observer, steady), above, strict=True)
        )
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
    if observer.domain is not None:  # no code with an output ``in_domain`` is generated where this has no bound
        domain = bounds if isinstance(bounds, str) else bounds[0].domain
        if isinstance(domain, str):
            expected = "a spec without that" if domain is bounds else "a domain for which there is a bound"
            found = f"no error bound holds in the domain ({domain})"
            raise BadInput(spec.place("observer.domain"), found, f"{expected}, or no `domain`", code="SPEC022")
        if domain is not None and domain.inside is None:
            found = f"slip_speed {float(observer.domain.slip_speed):.6g}, for which there is no bound"
            expected = f"at least {domain.least_slip_speed * 1.006:.3g}"
            raise BadInput(spec.place("observer.domain.slip_speed"), found, expected, code="SPEC026")
    return replace(certificate, bounds=bounds)


def rounding_share(
    observer: Observer, certificate: Certificate, rounding: tuple[Fraction, list[Fraction]]
) -> list[float] | None:
    """Contribution of rounding to the long-run bound of each friction error; None if it is not known.

    The bound is linear in the sizes of the disturbances, so it is computed with rounding as the only disturbance, and
    not as the difference of two nearly equal numbers. ``rounding``: as in ``error_bounds``.
    """
    response = certificate.response or error_response(observer)
    if isinstance(response, str):
        return None
    none = {cause: [Fraction(0)] * block.cols for cause, block in response.inputs.items()}
    sizes, n = with_rounding(none, response, *rounding), response.noise.cols
    return long_run(response, reach_of(response, certificate.content), [sizes]).bounds(sizes)[n:]


def _tolerated(
    spec: Spec, observer: Observer, response: Response, unit: ModelError, inside: Callable[[Sizes], DomainBound | str]
) -> float:
    """The largest relative model error, up to 1, for which the domain has a bound; by bisection.

    ``unit``: one percent of this error. ``inside``: bounds on the disturbances → bounds of the domain, or why not.
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

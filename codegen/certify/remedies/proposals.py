"""Remedies for a refused spec: the longest sample time, nearest gains, or an integration method, that are certified.

The search for gains uses the eigenvalues of the error matrices at the operating points. A remedy is proposed only if,
with it, the files are generated and the checker accepts their certificate.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from decimal import ROUND_FLOOR
from itertools import product
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.analysis.analysis import Analysis
from codegen.analysis.feasibility.axes import AROUND, GainAxis, gain_axes, gain_numbers
from codegen.analysis.feasibility.gain_dynamics import GainDynamics, Settings
from codegen.analysis.feasibility.region import LINE, bisect, stable
from codegen.base.arrays import Array
from codegen.base.errors import BadInput, Place
from codegen.base.significant import rounded_to
from codegen.base.text import render
from codegen.certify.certify import Certificate, Proposal, Proposals, certify
from codegen.certify.enclosure import enclose_family
from codegen.certify.family import NotEnclosable, build_family
from codegen.certify.size_limit import beyond_checker
from codegen.checker import verify
from codegen.mechanics.system import System
from codegen.observers import build_observer
from codegen.spec.expression import exact_number
from codegen.spec.free_gains import with_gains
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical

Numbers = Mapping[tuple[str, tuple[int, ...]], float]
"""(name of a gain, indices of an entry) → value."""

Derive = Callable[[Spec], Any]
"""Spec → its machine (app/derived.py), of which the attributes ``analysis`` and ``outcome`` are used."""

LARGEST = 8
"""Largest number of error components for which remedies are searched for."""
MOST_VERTICES, MOST_VERTICES_UNDECIDED = 150, 32
"""Largest number of vertices of the family of A; fewer if every operating point is stable, since the eigenvalues then
give the search no direction."""
ATTEMPTS, ATTEMPTS_VARYING = 9, 2
"""Largest number of calls of ``certify`` for each remedy, for a constant A and for one that varies."""
ATTEMPTS_FOR_STEP = 2
"""Largest number of calls of ``certify`` for other integration methods."""
ATTEMPTS_FOR_BOUND = 16
"""Largest number of sample times and steps that are tried for a bound below the friction."""
SHARES_OF_TIME = (1, 0.9, 0.7, 0.5, 0.25, 0.1)
"""Shares of the largest certified sample time that are tried, since another check may refuse that time itself."""
BEYOND_BOUNDARY = (0.05, 0.2, 0.7)
"""Distances beyond the boundary of stability that are tried, in |log| of the gain factors."""
SCATTERED = 120
"""Number of random directions of the search."""
NEAREST = 3
"""Number of directions, those of least distance, whose gains are tried."""
DIGITS = 3
"""Significant digits of proposed gains."""
SIGN_COSTS = np.log(10.0)
"""Distance that is added for each gain with changed signs."""


@numerical("gains or a sample time that would be certified")
def propose(spec: Spec, analysis: Analysis, derive: Derive, largest: Callable[[], Mapping[str, float]]) -> Proposals:
    """The largest sample time, nearest gains and integration method that are certified in place of a refused spec's.

    The distance of gains is the sum of |log factor| over the axes of ``gain_axes``, plus log 10 for each gain with
    changed signs. A sum of absolute values favours proposals that change few gains.

    Args:
        spec: the refused spec.
        derive: spec → its results; the outcome for a proposed spec is a certificate.
        largest: function that gives the largest certified sample times over the envelope (``largest_sample_times``).
    """
    observer, ranges = analysis.dynamics.observer, analysis.points.ranges
    system, count = observer.system, len(observer.errors)
    if beyond := beyond_checker(observer):
        return Proposals(None, None, beyond)
    if any(low <= 0 <= high for low, high in (ranges[f] for f in observer.truth_ranges if f in ranges)):
        # The friction is level times state: at a state of zero an error of the level changes no other one.
        return Proposals(None, None, "where the friction is zero, its level cannot be estimated with any of them")
    if count > LARGEST:
        return replace(_too_large("error components", count, LARGEST), measured=_with_measured_velocity(spec, derive))
    try:
        error_matrices = build_family(analysis.dynamics, analysis.points.ranges)
    except (NotEnclosable, TypeError) as error:
        return Proposals(None, None, str(error))
    by_gains = GainDynamics(analysis.dynamics, analysis.points)
    by_gains.start(by_gains.settings())
    certified = largest()
    times, sets = _sample_times(spec, certified), list(_gain_sets(spec, system, analysis, by_gains))
    steps = _other_steps(spec, certified)
    if not times and not sets and not steps:
        return Proposals(None, None)
    try:
        vertices = len(enclose_family(error_matrices).matrices)
    except (NotEnclosable, TypeError, verify.Refused) as error:
        return Proposals(None, None, str(error))
    limit = MOST_VERTICES_UNDECIDED if analysis.stable else MOST_VERTICES
    if vertices > limit:
        return _too_large("corner matrices over the envelope", vertices, limit)
    tried = ATTEMPTS if vertices == 1 else ATTEMPTS_VARYING
    longest = _first_certified("sample_time", times[:tried], derive)
    nearest = _first_certified("gains", sets[:tried], derive)
    useful = _with_useful_bound(spec, certified, derive) if longest is not None and longest.of_little_use else None
    known = useful is not None and useful.sample_time == float(observer.sample_time)  # which is with another step
    other = None if known else _first_certified("integration", steps[:ATTEMPTS_FOR_STEP], derive)
    return Proposals(longest, nearest, useful=useful, integration=other)


def _too_large(what: str, count: int, limit: int) -> Proposals:
    """No remedies, with the reason that a number exceeds its limit."""
    return Proposals(None, None, render("text/proposals_too_large.j2", what=what, count=count, limit=limit).strip())


def _first_certified(key: str, specs: Sequence[Spec], derive: Derive, useful: bool = False) -> Proposal | None:
    """The remedy by the first of these specs that is certified; None if none is.

    Args:
        key: what the specs change in ``observer:``, for the words of the remedy: sample_time, gains, step or velocity.
        specs: in the order in which they are tried.
        useful: whether its error bounds have to be below the friction.
    """
    for spec in specs:
        with suppress(BadInput):
            derived = derive(spec)
            if not isinstance(certify(spec, derived.analysis, {}, "certify", further=False), Certificate):
                continue  # saves the search for regions in ``derived.outcome``, which would be a refusal as well
            found = derived.outcome
            if isinstance(found, Certificate):
                h, gains = float(spec.required_observer.sample_time), spec.required_observer.gains
                step = spec.required_observer.integration
                line = render("text/proposed_line.j2", key=key, h=h, gains=gains, step=step).strip()
                bounds, useless = (
                    render("text/bounds_of_little_use.j2", bounds=found.bounds, every=every).strip()
                    for every in (True, False)
                )
                if useful and (useless or isinstance(found.bounds, str)):  # a text: why there are no bounds
                    continue
                where = spec.place("observer.gains")
                numbers = {name: _numbers(raw, where) for name, raw in gains.items()}
                return Proposal(line, h, numbers, found.decay_rate, useless, bounds)
    return None


def _with_useful_bound(spec: Spec, largest: Mapping[str, float], derive: Derive) -> Proposal | None:
    """The remedy by the longest sample time that gives error bounds below the friction; None if none does.

    The integration method is the spec's own or a semi-implicit step.

    Tried are the spec's own sample time, and shorter ones of one digit: 1, 2 or 5.

    Args:
        largest: integration → the largest certified sample time, s.
    """
    choice = spec.required_observer
    own = sympy.Rational(choice.sample_time)
    top = math.floor(math.log10(own)) + 1
    digits = (sympy.Rational(d) * sympy.Rational(10) ** (top - k) for k in range(5) for d in (5, 2, 1))
    steps = {choice.integration: None, "semi_implicit": None}
    tried = [
        replace(choice, sample_time=h, integration=step)
        for h in [own, *(h for h in digits if h < own)]
        for step in steps
        if h <= largest.get(step, 0.0) and (h, step) != (own, choice.integration)
    ]
    for observer in tried[:ATTEMPTS_FOR_BOUND]:
        found = _first_certified("step", [replace(spec, observer=observer)], derive, useful=True)
        if found is not None:
            return found
    return None


def _with_measured_velocity(spec: Spec, derive: Derive) -> Proposal | None:
    """The remedy of measured velocity with the spec's gains; None if it is measured already, or is not certified.

    A tracker (TO, GTO, MGTO) may then have a certificate by structure, for any number of errors (``structure.py``).
    """
    choice = spec.observer
    if choice is None or choice.velocity != "estimated":
        return None
    gains = {name: raw for name, raw in choice.gains.items() if name != "K_v"}
    with_measured = replace(spec, observer=replace(choice, velocity="measured", gains=gains))
    return _first_certified("velocity", [with_measured], derive)


def _numbers(raw: Any, where: Place) -> Any:
    """A gain as floats: scalar, list or list of rows."""
    return [_numbers(entry, where) for entry in raw] if isinstance(raw, list) else float(exact_number(str(raw), where))


def _sample_times(spec: Spec, largest: Mapping[str, float]) -> list[Spec]:
    """The spec with shorter sample times, the largest certified one first; empty if there is none."""
    choice = spec.required_observer
    longest = largest.get(choice.integration, 0.0)
    if not 0 < longest < float(choice.sample_time):
        return []
    exact = [sympy.Rational(rounded_to(longest * share, DIGITS, ROUND_FLOOR)) for share in SHARES_OF_TIME]
    return [replace(spec, observer=replace(choice, sample_time=h)) for h in exact]


def _other_steps(spec: Spec, largest: Mapping[str, float]) -> list[Spec]:
    """The spec with other integration methods whose largest certified sample time is not below its own."""
    choice = spec.required_observer
    own = float(choice.sample_time)
    others = [step for step, longest in largest.items() if step != choice.integration and longest >= own]
    return [replace(spec, observer=replace(choice, integration=step)) for step in others]


def _gain_sets(spec: Spec, system: System, analysis: Analysis, family: GainDynamics) -> Iterator[Spec]:
    """The spec with other gains, the nearest first."""
    rays = sorted(
        (ray for signed, flips in _signs(spec) for ray in _rays(signed, flips, system, family)),
        key=lambda ray: ray.distance,
    )
    for ray in rays[:NEAREST]:
        for deeper in BEYOND_BOUNDARY if ray.length or analysis.stable else (0.0, *BEYOND_BOUNDARY):
            yield ray.spec_at(ray.length + deeper)


@dataclass(frozen=True)
class _Ray:
    """A ray in the space of the logarithms of the gains, with its first stable point.

    Attributes:
        spec: the spec at the start of the ray, with signs of gains as chosen.
        direction: one number for each axis, their absolute values sum to 1.
        length: Σ |log factor| at the first stable point.
        distance: ``length`` plus the penalty for changed signs.
    """

    spec: Spec
    axes: tuple[GainAxis, ...]
    direction: Array
    length: float
    distance: float

    def spec_at(self, length: float) -> Spec:
        """The spec with the gains at this length of the ray, to three digits; an unchanged gain stays as written."""
        numbers = {}
        for axis, share in zip(self.axes, self.direction, strict=True):
            assert axis.chosen is not None
            for at, weight in axis.entries.items() if share * length else ():
                numbers[at] = float(f"{weight * axis.chosen * np.exp(length * share):.{DIGITS}g}")
        return with_gains(self.spec, numbers)


def _signs(spec: Spec) -> Iterator[tuple[Spec, int]]:
    """Pairs (spec with some combination of signs of its gains, number of gains with changed signs)."""
    numbers = gain_numbers(spec)
    options: list[list[Numbers]] = []
    for name in spec.required_observer.gains:
        own = {at: float(value) for at, value in numbers.items() if at[0] == name}
        others: list[Numbers] = [{at: -v for at, v in own.items()}]
        others += [
            {at: sign * abs(v) if len(set(at[1])) < 2 else v for at, v in own.items()} for sign in (1, -1)
        ]  # off the diagonal, either sign may be right
        options.append([{}, *(other for k, other in enumerate(others) if other not in (own, *others[:k]))])
    for chosen in product(*options):
        yield (
            with_gains(spec, {at: value for signed in chosen for at, value in signed.items()}),
            sum(1 for signed in chosen if signed),
        )


def _rays(spec: Spec, flips: int, system: System, family: GainDynamics) -> Iterator[_Ray]:
    """The rays on which a stable point is found, for one choice of signs."""
    try:
        observer = build_observer(spec, system)
        axes = gain_axes(spec, observer)
    except BadInput:  # a sign that the observer refuses, or no gain but zero
        return
    gains = np.array([[float(observer.gains[s]) for s in family.symbols]])
    base = Settings(family.symbols, gains, family.settings().sample_time)
    directions = _directions(len(axes))
    shares = np.linspace(0, 1, LINE // 2)
    longest = np.log(AROUND) / np.abs(directions).max(axis=1)
    inside = _stable(family, base, axes, (directions[:, None] * (longest[:, None] * shares)[:, :, None]))
    for k in np.flatnonzero(inside.any(axis=1)):
        first = int(inside[k].argmax())
        length = 0.0
        if first:
            along = directions[k] * longest[k]

            def is_stable(t: Array, along: Array = along) -> NDArray[np.bool_]:
                return _stable(family, base, axes, along * t[:, None])

            length = float(longest[k] * bisect(is_stable, shares[[first]], shares[[first - 1]])[1][0])
        yield _Ray(spec, axes, directions[k], length, length + flips * SIGN_COSTS)


def _directions(count: int) -> Array:
    """Search directions as rows, absolute values summing to 1: all gains by one factor, single gains, random ones."""
    rows = [s * np.ones(count) / count for s in (-1, 1)]
    if count > 1:
        rows += [s * e for e in np.eye(count) for s in (-1, 1)]
        scattered = np.random.default_rng(7).normal(size=(SCATTERED, count))
        rows += list(scattered / np.abs(scattered).sum(axis=1, keepdims=True))
    return np.array(rows)


def _stable(family: GainDynamics, base: Settings, axes: Sequence[GainAxis], shifts: Array) -> NDArray[np.bool_]:
    """Whether I + hA and Ψ are stable, with the gains of ``base`` times exp(shifts) along each axis.

    ``shifts``: (…, number of axes); the result has the shape (…).
    """
    settings, flat = base, shifts.reshape(-1, len(axes))
    for k, axis in enumerate(axes):
        assert axis.chosen is not None
        settings = settings.along(axis, axis.chosen * np.exp(flat[:, k]))
    both = stable(family, "sampled", settings)
    if both.any():
        both[both] = stable(family, "continuous", settings.rows(both))
    shaped: NDArray[np.bool_] = both.reshape(shifts.shape[:-1])
    return shaped

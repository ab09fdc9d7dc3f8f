"""What to change where a spec is refused: the longest sample time, or the nearest gains, that are certified.

The search looks at eigenvalues over the operating points. What is handed out passed what refused the spec: its
files were generated, its certificate found, and the checker took the one for that of the others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Protocol

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.analysis.analysis import Analysis
from codegen.analysis.feasibility.axes import AROUND, GainAxis, gain_axes, sample_time_axis
from codegen.analysis.feasibility.gain_dynamics import GainDynamics, Settings
from codegen.analysis.feasibility.region import LINE, bisect, stable
from codegen.base.arrays import Array
from codegen.base.errors import BadInput, Place
from codegen.base.text import render
from codegen.certify.certify import Certificate, Proposal, Proposals, Refusal, certify
from codegen.certify.enclosure import enclose_family
from codegen.certify.family import NotEnclosable, build_family
from codegen.certify.size import beyond_checker
from codegen.checker import verify
from codegen.mechanics.system import System
from codegen.observers import build_observer
from codegen.spec.expression import exact_number
from codegen.spec.free_gains import gain_entries, with_gains
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical

Numbers = Mapping[tuple[str, tuple[int, ...]], float]


class Judged(Protocol):
    """What is derived of a spec: its analysis, and its certificate bound to all that is generated from it."""

    @property
    def analysis(self) -> Analysis: ...

    @property
    def outcome(self) -> Certificate | Refusal: ...


Derive = Callable[[Spec], Judged]

LARGEST = 8
"""Error components up to which a search is made."""
MOST_VERTICES, MOST_VERTICES_UNDECIDED = 150, 32
"""The same for vertices of A's family; fewer where each point is stable, since then no eigenvalue guides the search."""
ATTEMPTS, ATTEMPTS_VARYING = 9, 2
"""How often ``certify`` is tried for each proposal: where A is one matrix, and where it varies over the envelope."""
SHORTER = 1e-5
SHARES = (0.995, 0.9, 0.7, 0.5, 0.25, 0.1)
INSIDE = (0.05, 0.2, 0.7)
SCATTERED = 120
NEAREST = 3
DIGITS = 3
SIGN_COSTS = np.log(10.0)


@numerical("gains or a sample time that would be certified")
def propose(spec: Spec, analysis: Analysis, derive: Derive) -> Proposals:
    """The largest sample time and the nearest gains that are certified in place of those of a refused spec.

    Gains are near where the factors on them are small: the distance is the sum of the factors' |log|, over gains taken
    as a whole, and a change of sign counts as a factor of ten. Sums favour proposals that change few gains.

    Args:
        derive: the same for another observer section; what is proposed has a certificate as its outcome.
    """
    system = analysis.dynamics.observer.system
    count = len(analysis.dynamics.observer.errors)
    if beyond := beyond_checker(analysis.dynamics.observer):
        return Proposals(None, None, beyond)
    if count > LARGEST:
        return replace(_too_large("error components", count, LARGEST), measured=_measured(spec, derive))
    try:
        held = build_family(analysis.dynamics, analysis.points.ranges)
    except (NotEnclosable, TypeError) as error:
        return Proposals(None, None, str(error))
    family = GainDynamics(analysis.dynamics, analysis.points)
    family.start(family.settings())
    times, sets = list(_sample_times(spec, analysis, family)), list(_gain_sets(spec, system, analysis, family))
    if not times and not sets:
        return Proposals(None, None)
    try:
        vertices = len(enclose_family(held).matrices)
    except (NotEnclosable, TypeError, verify.Refused) as error:
        return Proposals(None, None, str(error))
    limit = MOST_VERTICES_UNDECIDED if analysis.stable else MOST_VERTICES
    if vertices > limit:
        return _too_large("vertices of Psi over the envelope", vertices, limit)
    tried = ATTEMPTS if vertices == 1 else ATTEMPTS_VARYING
    return Proposals(_first("sample_time", times[:tried], derive), _first("gains", sets[:tried], derive))


def _too_large(what: str, count: int, limit: int) -> Proposals:
    return Proposals(None, None, render("text/proposals_too_large.j2", what=what, count=count, limit=limit).strip())


def _first(key: str, specs: Sequence[Spec], derive: Derive) -> Proposal | None:
    """The first of these specs that is certified, and its line under ``key`` in the observer section."""
    for spec in specs:
        with suppress(BadInput):
            derived = derive(spec)
            if not isinstance(certify(spec, derived.analysis, {}, "certify", further=False), Certificate):
                continue  # the whole outcome would be a refusal too, after a search for regions
            found = derived.outcome
            if isinstance(found, Certificate):
                assert spec.observer is not None
                h, gains = float(spec.observer.sample_time), spec.observer.gains
                line = render("text/proposed_line.j2", key=key, h=h, gains=gains).strip()
                where = spec.place("observer.gains")
                return Proposal(line, h, {name: _numbers(raw, where) for name, raw in gains.items()}, found.decay_rate)
    return None


def _measured(spec: Spec, derive: Derive) -> Proposal | None:
    """The spec's gains with measured velocity: a tracker's then have a certificate by structure, for any M(x)."""
    choice = spec.observer
    if choice is None or choice.velocity != "estimated":
        return None
    gains = {name: raw for name, raw in choice.gains.items() if name != "K_v"}
    return _first("velocity", [replace(spec, observer=replace(choice, velocity="measured", gains=gains))], derive)


def _numbers(raw: Any, where: Place) -> Any:
    return [_numbers(entry, where) for entry in raw] if isinstance(raw, list) else float(exact_number(str(raw), where))


def _sample_times(spec: Spec, analysis: Analysis, family: GainDynamics) -> Iterator[Spec]:
    """The spec with shorter sample times, the longest first; nothing where none is stable."""
    observer, own = analysis.dynamics.observer, family.settings()
    if analysis.dynamics.implicit or not stable(family, "continuous", own, True)[0]:
        return
    axis, h = sample_time_axis(observer), float(observer.sample_time)

    def inside(share: Array) -> NDArray[np.bool_]:
        return stable(family, "sampled", own.along(axis, h * SHORTER**share), True)

    shares = np.linspace(0, 1, LINE)
    good = np.flatnonzero(inside(shares))
    if not len(good):
        return
    at = good[:1]
    longest = h if at[0] == 0 else h * SHORTER ** float(bisect(inside, shares[at], shares[at - 1])[1][0])
    assert spec.observer is not None
    for share in SHARES:
        exact = sympy.Rational(f"{longest * share:.{DIGITS}g}")
        yield replace(spec, observer=replace(spec.observer, sample_time=exact))


def _gain_sets(spec: Spec, system: System, analysis: Analysis, family: GainDynamics) -> Iterator[Spec]:
    """The spec with other gains, the nearest first."""
    rays = sorted(
        (ray for signed, flips in _signs(spec) for ray in _rays(signed, flips, system, family)),
        key=lambda ray: ray.distance,
    )
    for ray in rays[:NEAREST]:
        for deeper in INSIDE if ray.length or analysis.stable else (0.0, *INSIDE):
            yield ray.spec_at(ray.length + deeper)


@dataclass(frozen=True)
class _Ray:
    """Gains that move in one direction of their logarithms, and where on it the error becomes stable.

    Attributes:
        direction: one entry an axis, their sizes sum to 1.
        length: the sum of |log| of the factors at which the error is stable first.
        distance: that, plus the penalty for changed signs.
    """

    spec: Spec
    axes: tuple[GainAxis, ...]
    direction: Array
    length: float
    distance: float

    def spec_at(self, length: float) -> Spec:
        """The spec with the gains there, to three digits; a gain that is not moved stays as written."""
        numbers = {}
        for axis, share in zip(self.axes, self.direction, strict=True):
            assert axis.chosen is not None
            for at, weight in axis.entries.items() if share * length else ():
                numbers[at] = float(f"{weight * axis.chosen * np.exp(length * share):.{DIGITS}g}")
        return with_gains(self.spec, numbers)


def _signs(spec: Spec) -> Iterator[tuple[Spec, int]]:
    """The spec, and with gains of another sign; with the number of gains changed."""
    assert spec.observer is not None
    entries = gain_entries(spec.observer.gains)
    options: list[list[Numbers]] = []
    for name in spec.observer.gains:
        own = {
            (e.gain, e.path): float(exact_number(str(e.value), spec.place(e.key))) for e in entries if e.gain == name
        }
        others: list[Numbers] = [{at: -v for at, v in own.items()}]
        others += [
            {at: sign * abs(v) if len(set(at[1])) < 2 else v for at, v in own.items()} for sign in (1, -1)
        ]  # off the diagonal, either sign may be right
        options.append([{}, *(other for k, other in enumerate(others) if other not in (own, *others[:k]))])
    for chosen in product(*options):
        yield (
            with_gains(spec, {at: value for numbers in chosen for at, value in numbers.items()}),
            sum(1 for numbers in chosen if numbers),
        )


def _rays(spec: Spec, flips: int, system: System, family: GainDynamics) -> Iterator[_Ray]:
    """The directions in which a stable error is found, for one choice of signs."""
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

            def holds(t: Array, along: Array = along) -> NDArray[np.bool_]:
                return _stable(family, base, axes, along * t[:, None])

            length = float(longest[k] * bisect(holds, shares[[first]], shares[[first - 1]])[1][0])
        yield _Ray(spec, axes, directions[k], length, length + flips * SIGN_COSTS)


def _directions(count: int) -> Array:
    """One gain alone, all by one factor, and scattered ones; rows whose sizes sum to 1."""
    rows = [s * np.ones(count) / count for s in (-1, 1)]
    if count > 1:
        rows += [s * e for e in np.eye(count) for s in (-1, 1)]
        scattered = np.random.default_rng(7).normal(size=(SCATTERED, count))
        rows += list(scattered / np.abs(scattered).sum(axis=1, keepdims=True))
    return np.array(rows)


def _stable(family: GainDynamics, base: Settings, axes: Sequence[GainAxis], shifts: Array) -> NDArray[np.bool_]:
    """Whether sampled error and Ψ are stable with the gains at exp(shifts) of their size; axes last in ``shifts``."""
    settings, flat = base, shifts.reshape(-1, len(axes))
    for k, axis in enumerate(axes):
        assert axis.chosen is not None
        settings = settings.along(axis, axis.chosen * np.exp(flat[:, k]))
    held = stable(family, "sampled", settings)
    if held.any():
        held[held] = stable(family, "continuous", settings.rows(held))
    inside: NDArray[np.bool_] = held.reshape(shifts.shape[:-1])
    return inside

"""Preflight of the columns: exchanged columns, flipped signs, and velocities that were read as positions.

Changes of the columns are tried. A finding names the change with which the balance of forces has a far smaller misfit
than as read. With the position q = −x and the right force u, for example, M a + d v + U λ − g(x) = u is in the log

    M a_q + d v_q + U λ + g(−q) = −u.

If g is odd, as without gravity or with a spring about zero, this is the machine with the input reversed, and a log
cannot distinguish a flipped position from a flipped input. With a weight, or a spring about another position, it can.

Declared values that are far off leave the forces unbalanced with the right columns too. That a velocity is the slope of
its position needs no values of the spec: an exchange with which this holds, and without which it does not, is reported
whatever the forces are.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations, islice, permutations

import numpy as np
from scipy.integrate import cumulative_trapezoid

from codegen.base.arrays import Array
from codegen.base.errors import Place
from codegen.base.significant import in_percent
from codegen.base.user_text import brief
from codegen.logs.audit.force_balance import Balance, Forces
from codegen.logs.log import Finding, Log
from codegen.logs.motion import Motion, low_pass, measured_motion
from codegen.spec.model import Spec
from codegen.spec.units import si_factor

FITS, BETTER = 0.25, 0.5
"""Largest misfit with a change that is accepted, and its largest ratio to the misfit as read."""
NEARLY = 0.05
"""Least misfit as read at which changes are tried. Up to ``FITS`` only axes are exchanged, and no two signs reversed:
if friction is large in both, the motion of one axis may balance most of the forces of another one."""
FAR_BETTER = 0.1
"""Largest ratio to the misfit as read, if that is below ``FITS`` or columns are integrated."""
IN_ANY_ORDER, MOST_TRIED, IN_PAIRS = 3, 70, 6
"""Most variables of which all orders are tried (of more, pairs and axes); most orders that are tried; most coordinates
and inputs of which two are reversed together."""
SLOPES = 0.02
"""Largest misfit of the velocities with an exchange that is accepted for their sake alone."""
UNSURE, ALL_FIT, MOST_ALIKE = 2.0, 0.01, 4
"""Changes are alternatives if their misfit is within a factor of the least or below a value; most that are reported."""
FORCE = "sign of the force"
"""Topic of the finding that the whole force of the spec has the other sign."""
Values = dict[str, Array]
"""Position, velocity if it was logged, or input → its values, (N,)."""


@dataclass(frozen=True)
class Case:
    """A log, its spec, and the forces along the measured motion.

    Attributes:
        of_speeds: whether changes are judged by the misfit of the velocities alone.
    """

    log: Log
    spec: Spec
    balance: Balance
    motion: Motion
    forces: Forces
    of_speeds: bool = False

    @property
    def values(self) -> Values:
        log, spec = self.log, self.spec
        values = dict(zip(spec.positions, log.positions.T, strict=True))
        if log.velocities is not None:
            values |= zip(spec.velocities, log.velocities.T, strict=True)
        return values | dict(zip((i.name for i in spec.inputs), log.inputs.T, strict=True))

    def misfit(self, values: Values) -> float:
        """The larger misfit of a log with other values: of the velocities, or of the forces unless ``of_speeds``."""
        log, spec = self.log, self.spec
        logged = log.velocities is not None
        other = replace(
            log,
            positions=np.column_stack([values[name] for name in spec.positions]),
            velocities=np.column_stack([values[name] for name in spec.velocities]) if logged else None,
            inputs=np.column_stack([values[i.name] for i in spec.inputs]) if spec.inputs else log.inputs,
            encoder_step=None,
            raw_data=replace(log.raw_data, smallest_step=()),
        )
        motion = measured_motion(other)
        if not motion.usable.any() or (slopes := velocity_mismatch(other, motion)) > FITS:
            return 1.0
        return slopes if self.of_speeds else max(self.balance.along(other, motion).moving_misfit, slopes)


def velocity_mismatch(log: Log, motion: Motion) -> float:
    """Σ(v − ẋ)² / (Σv² + Σẋ²), low-passed, the largest of the coordinates; 0 if no velocity was logged."""
    if log.velocities is None:
        return 0.0
    logged, slope = _speeds(log, log.velocities, motion)
    whole = np.sum(logged**2 + slope**2, axis=0)
    apart = np.sum((logged - slope) ** 2, axis=0)
    return float(np.max(apart[whole > 0] / whole[whole > 0])) if np.any(whole > 0) else 0.0


def velocities_unlike(log: Log, motion: Motion) -> float:
    """The share of Σv² that no multiple of ẋ explains, low-passed, the largest of the coordinates; 0 if not logged.

    A velocity in another unit, or with the other sign, is a multiple of the slope.
    """
    if log.velocities is None:
        return 0.0
    logged, slope = _speeds(log, log.velocities, motion)
    whole = np.sum(logged**2, axis=0) * np.sum(slope**2, axis=0)
    shared = np.sum(logged * slope, axis=0) ** 2
    return float(np.max(1 - shared[whole > 0] / whole[whole > 0])) if np.any(whole > 0) else 0.0


def _speeds(log: Log, velocities: Array, motion: Motion) -> tuple[Array, Array]:
    """Logged velocities and slopes of the positions of the usable samples, low-passed alike, (K, n) each."""
    smooth, _ = low_pass(log, velocities, motion.cutoff_hz)
    return smooth[motion.usable], motion.velocities[motion.usable]


@dataclass(frozen=True)
class Change:
    """A change of a log's columns, or of the spec's gravity and springs.

    Attributes:
        what: the finding as a clause, such as ``the sign of input w seems flipped``.
        other: the same as an alternative to another change, such as ``that of input w``.
        misfit: function that computes the misfit with it.
        lines: the lines of meta.yaml that make it; empty if the spec must be changed.
        topic: of the finding.
        turned: variables whose signs it reverses.
        mistakes: how many it corrects; changes with the fewest are reported.
        far_better: whether only a far smaller misfit is accepted, however large it is as read.
    """

    what: str
    other: str
    misfit: Callable[[], float]
    lines: str
    topic: str = "columns"
    turned: tuple[str, ...] = ()
    mistakes: int = 1
    far_better: bool = False

    def enough(self, now: float) -> float:
        """The largest misfit at which it is reported; ``now``: the misfit as read."""
        return min(FITS, (BETTER if now > FITS and not self.far_better else FAR_BETTER) * now)


def _exchanged(case: Case, sources: Mapping[str, str]) -> Change:
    """Variables that take the columns of others; ``sources``: variable → the one whose column it takes."""
    words = " and ".join(sources)
    if all(sources[source] == name for name, source in sources.items()):  # in pairs: x and y, v and u
        names = list(sources)
        words = ", ".join(f"{a} and {b}" for a, b in sources.items() if names.index(a) < names.index(b))

    def misfit() -> float:
        values, factor = case.values, {name: _stated_factor(name, case) for name in case.values}
        moved = {name: values[source] / factor[source] * factor[name] for name, source in sources.items()}
        return case.misfit(values | moved)

    entries = (f"{name}: {case.log.raw_data.columns.get(source, '...')}" for name, source in sources.items())
    lines = f"`columns: {{{', '.join(entries)}}}`"
    return Change(f"the columns of {words} seem exchanged", f"those of {words}", misfit, lines)


def _integrated(case: Case, coordinates: Sequence[str]) -> Change:
    """Coordinates whose columns are velocities. The integration constant is not known; the mean is set to zero."""
    names = " and ".join(coordinates)
    held = f"columns of {names} seem to hold their velocities"
    if len(coordinates) == 1:
        held = f"column of {names} seems to hold its velocity"

    def misfit() -> float:
        values, log = case.values, case.log
        for name in coordinates:
            way = values[name].copy()
            for start, stop in log.segments:
                part = cumulative_trapezoid(way[start:stop], initial=0) * log.sample_time
                way[start:stop] = part - part.mean()
            values[name] = way
        return case.misfit(values)

    columns = case.log.raw_data.columns
    some = [c for c in case.spec.coordinates if c.name in coordinates]
    entries = (f"{c.name}: none, {c.velocity}: {brief(str(columns.get(c.name, '...')))}" for c in some)
    lines = f"`columns: {{{', '.join(entries)}}}`, with the column of the position in place of `none` if there is one,"
    return Change(f"the {held}", f"the {held}", misfit, lines, far_better=True)


def _flipped(case: Case, turned: tuple[str, ...], words: str, mistakes: int = 1) -> Change:
    """Variables whose signs are reversed; ``words``: these in words."""
    inputs = [i.name for i in case.spec.inputs if i.name in turned]
    topic = f"sign and scale of {inputs[0]}" if inputs else f"sign of {turned[0]}"

    def misfit() -> float:
        return case.misfit({name: -values if name in turned else values for name, values in case.values.items()})

    lines = case.log.scale_lines(dict.fromkeys(turned, -1.0), case.spec)
    return Change(f"the sign of {words} seems flipped", f"that of {words}", misfit, lines, topic, turned, mistakes)


def _of_spec(case: Case, what: str, topic: str, changed: Forces) -> Change:
    """A force with the other sign, a mistake in the spec and not the log; ``changed``: the forces with it."""

    def misfit() -> float:
        return max(changed.moving_misfit, velocity_mismatch(case.log, case.motion))

    return Change(f"the sign of {what} seems flipped", f"that of {what}", misfit, "", topic)


def changed_columns(case: Case) -> Finding | None:
    """The finding on the change of columns with which the forces balance; None if they do as read, or with no one."""
    now = max(case.forces.moving_misfit, velocity_mismatch(case.log, case.motion))
    if now <= NEARLY or case.log.raw_data.doubted:
        return None
    tried = [(change.misfit(), change) for change in _changes(case, now)]
    fitting = [(left, change) for left, change in tried if left <= change.enough(now)]
    apart = f"squared forces{'' if case.log.velocities is None else ' or speeds'} stay unbalanced"
    if not fitting and velocities_unlike(case.log, case.motion) > FITS:
        speeds, apart = replace(case, of_speeds=True), "squared speeds differ from the slopes of the positions"
        now = velocity_mismatch(case.log, case.motion)
        tried = [(change.misfit(), change) for change in _all_exchanged(speeds, axes_alone=False)]
        fitting = [(left, change) for left, change in tried if left <= SLOPES]
    best = min((left for left, _ in fitting), default=1.0)
    alike = [change for left, change in fitting if left <= max(UNSURE * best, ALL_FIT)]
    named = [change for change in alike if change.mistakes == min(other.mistakes for other in alike)]
    in_spec = [change for change in named if not change.lines]
    if len(in_spec) < len(named):  # a column may be wrong, or the force in the spec, as the same equation
        named = [change for change in named if change.topic != FORCE]
    opposed = any(not change.lines for change in named)
    if not named or len(named) > MOST_ALIKE or (opposed and len(named) > 1):
        return None  # where a force of the spec may be wrong, the audit of the inputs reports which forces show
    what = ", or ".join([named[0].what, *(change.other for change in named[1:])])
    rest = min((left for left, change in tried if change not in alike), default=1.0)
    words = (
        f"{what[0].upper()}{what[1:]}: as read, {_share(now)} of the {apart}; changed so, "
        f"{in_percent(best)}; with any other change, {_share(rest)}. "
    )
    if len(named) > 1:
        words += "This log cannot decide which. "
    turned = {name for change in named for name in change.turned}
    positions = " and ".join(name for name in case.spec.positions if name in turned)
    if positions and len(named) > 1 and all(change.turned for change in named):
        words += f"A push by hand in the direction that the drawing calls positive shows the sign of {positions}. "
    if named[0].topic == FORCE:
        words += "All terms of `force` in the spec seem to have the wrong sign: M(x) v' = force - friction."
    elif opposed:
        words += "Check them in the spec, or the zero of a position (a pendulum's may be half a turn off)."
    else:
        words += f"({' or '.join(change.lines for change in named)} in meta.yaml beside the log corrects it)"
        words += _or_in_spec(named, bool(in_spec), case)
    return Finding("problem", named[0].topic, words, {"misfit": now, "misfit_mended": best})


def _share(misfit: float) -> str:
    """A misfit in percent; forces that oppose each other have one above 100 %, of which the figure says no more."""
    return in_percent(misfit) if misfit <= 1 else "more than 100 %"


def _or_in_spec(named: Sequence[Change], force: bool, case: Case) -> str:
    """A sentence on the signs in the spec that give the same equation as the changed columns; "" for none.

    ``force``: whether the whole force with the other sign explains the log as well.
    """
    turned = [i.name for i in case.spec.inputs if any(change.turned == (i.name,) for change in named)]
    terms = [f"the term of {' and '.join(turned)}"] * bool(turned) + ["all terms"] * force
    if not terms:
        return ""
    return f". If the log is right, the spec is not: {' or '.join(terms)} in `force` would have the other sign."


def _changes(case: Case, now: float) -> Iterator[Change]:
    """The changes to try, in the order in which alternatives are reported."""
    spec, velocities, forces = case.spec, case.log.velocities is not None, case.forces
    if np.any(forces.static):  # the forces of positions alone
        what = "gravity and springs"
        changed = replace(forces, undriven=forces.undriven - 2 * forces.static, static=-forces.static)
        yield _of_spec(case, what, f"sign of {what}", changed)
    if np.any(forces.undriven + forces.friction) and np.any(forces.driven):  # else it is one of the two alone
        undriven = -forces.undriven - 2 * forces.friction  # = g(x, v, 0) - U lambda
        # all of g but friction
        changed = replace(forces, undriven=undriven, static=-forces.static, driven=-forces.driven)
        yield _of_spec(case, "the force in the spec", FORCE, changed)
    yield from _flips(case, velocities, pairs=now > FITS)
    yield from _all_exchanged(case, axes_alone=now <= FITS)
    if now > FITS and not velocities:
        some = dict.fromkeys([*((name,) for name in spec.positions), tuple(spec.positions)])
        yield from (_integrated(case, coordinates) for coordinates in some)


def _flips(case: Case, velocities: bool, pairs: bool) -> Iterator[Change]:
    """Reversed signs: of inputs, coordinates, one column of a coordinate, and with ``pairs`` of any two."""
    spec, inputs = case.spec, {(i.name,): f"input {i.name}" for i in case.spec.inputs}
    whole = {(c.name, c.velocity) if velocities else (c.name,): f"the coordinate {c.name}" for c in spec.coordinates}
    tried = inputs | whole
    for c in spec.coordinates if velocities else ():
        tried |= {(c.name,): f"the position {c.name}", (c.velocity,): f"the velocity {c.velocity}"}
    for group, what in ((inputs, "inputs"), (whole, "the coordinates")):
        if len(group) > 1:
            tried[tuple(chain(*group))] = f"{what} {' and '.join(names[0] for names in group)}"
    yield from (_flipped(case, turned, words) for turned, words in tried.items())
    if pairs and len(inputs) + len(whole) <= IN_PAIRS:
        for (a, one), (b, other) in combinations([*inputs.items(), *whole.items()], 2):
            yield _flipped(case, a + b, f"{one} and {other}", mistakes=2)


def _all_exchanged(case: Case, axes_alone: bool) -> Iterator[Change]:
    """Exchanged columns, in at most ``MOST_TRIED`` orders."""
    orders = islice(_exchanges(case.spec, case.log.velocities is not None, axes_alone), MOST_TRIED)
    yield from (_exchanged(case, sources) for sources in orders)


def _exchanges(spec: Spec, velocities: bool, axes_alone: bool) -> Iterator[dict[str, str]]:
    """Exchanged columns, variable → the one whose column it takes.

    In any order if there are few variables, else pairs, axes, and positions with velocities.
    """
    inputs = [i.name for i in spec.inputs]
    moving = [list(spec.positions), list(spec.velocities)] if velocities else [list(spec.positions)]
    every = [*chain(*moving), *inputs]
    if len(every) <= IN_ANY_ORDER and not axes_alone:
        for order in islice(permutations(every), 1, None):
            yield {a: b for a, b in zip(every, order, strict=True) if a != b}
        return
    n = len(spec.positions)
    together = [[*moving, inputs], moving] if len(inputs) == n else [moving]
    axes = [[(kind[a], kind[b]) for kind in group] for group in together for a, b in combinations(range(n), 2)]
    alike = [[pair] for kind in (*moving, inputs) for pair in combinations(kind, 2)]
    slopes = [list(zip(*moving, strict=True))] if velocities else []
    others = [[pair] for pair in combinations(every, 2)]
    for pairs in axes if axes_alone else dict.fromkeys(map(tuple, [*alike, *axes, *slopes, *others])):
        taken = dict(pairs) | {b: a for a, b in pairs}
        yield {name: taken[name] for name in every if name in taken}


def _stated_factor(name: str, case: Case) -> float:
    """The factor that is stated for a variable, which it keeps when it takes another column."""
    about = case.log.description
    factor = about.stated_scale(name, case.spec)
    return factor * float(si_factor(about.units[name], Place(""))) if name in about.units else factor

"""Objections to an effect that forward selection accepts, and remarks that must accompany it."""

from collections.abc import Mapping

import numpy as np

from codegen.base.arrays import Array
from codegen.diagnosis.fit.output_error import levels_at_zero
from codegen.diagnosis.fit.residual import Problem, slip_velocities
from codegen.diagnosis.fit.signals import Motion, is_resolved
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.results import FoundEffect, worded
from codegen.effects import Effect
from codegen.effects.effect import Intervals
from codegen.mechanics.system import System

WHOLE_TURN = 2 * np.pi
"""rad."""
MOST_NAMED = 3
"""Parameters that one objection names."""
MOST_SPEED = 0.95
"""Quantile of the speeds of a log that counts as its top speed."""
PERIODS_TRIED, SHORTEST_PERIOD = 48, 1e-3
"""Number of periods, from the stroke down to this share of it, that ``resolvable_periods`` tests."""
LEAST_PERIOD = 0.95
"""Least share of a period that a log must cover to show that it repeats. Of 1200 seen practice logs the 142 with a true
wave cover 1.09 periods or more. On 138 of the others a wave was fitted that is none, with a period longer than the log
covers."""
WIDEST = 30.0
"""Largest ratio of the ends of the 95 % interval of an effect's size, or of a stiffness between two bodies: its
standard error on a logarithmic scale is then 0.9, so that it is known within a factor of 5 to either side. A load that
a damper alone drags along, as by a lag of the input, has one of more than two decades: the log shows no spring. Of some
800 diagnoses of seen logs no true load had a ratio above 30, and of 25 true bristles none above 5. Of 490 accepted
effects one size had more than 16: 435, of an inertia error for which free runs and force residual want two values."""


def objections(found: FoundEffect, part: Part, problem: Problem, model: System | None = None) -> list[str]:
    """Why an effect is not accepted: intervals that include its absence or any value, or values that no log shows.

    A candidate has passed the tests of its values in its round; effects that are found later change them.

    Args:
        model: with the fitted friction levels; by default the declared one.
    """
    words = []
    absent = may_be_absent(part.effect, found.intervals)
    if absent:
        spans = [(name, *found.intervals[name]) for name in absent][:MOST_NAMED]
        words.append(worded("absent", spans=spans, kind=found.kind))
    elif spans := undetermined(part.effect, found.intervals):
        words.append(worded("undetermined", spans=spans, kind=found.kind))
    top = _top_speed(problem.system, problem.motion, part)
    for p in part.effect.parameters:
        if p.seen_at is None or p.name not in found.intervals:
            continue
        (low, high), least = found.intervals[p.name], p.seen_at[0] * top
        if low < least:
            given = {"name": p.name, "unit": found.units[p.name], "kind": found.kind}
            words.append(worded("a level", low=low, high=high, least=least, **given))
    if is_level_or_line(problem.system, problem.motion, part, found.parameters):
        words.append(f"{found.kind} varies only outside the speeds of the log, within which it is a level or a line")
    stroke = _stroke(problem.system, problem.motion, part)
    if never_passed(problem.system, problem.motion, part, found.parameters):
        period, unit = found.parameters["period"], found.units["period"]
        words.append(worded("not passed", stroke=stroke, unit=unit, period=period, kind=found.kind))
    outside = part.effect.outside(model or problem.system, part.place, found.parameters, found.intervals, stroke)
    if outside:
        words.append(f"{found.kind} {outside}")
    held, delay = problem.motion.held, part.effect.delay(found.parameters)
    if 0 < delay <= held:
        words.append(worded("held readings", held=held, delay=delay, kind=found.kind))
    return words


def may_be_absent(effect: Effect, intervals: Intervals) -> list[str]:
    """The parameters that scale an effect, if the interval of each holds the value at which it is absent."""
    absences = [(p.name, p.absent_at if p.neutral is None else p.neutral) for p in effect.parameters]
    sizes = [(name, value) for name, value in absences if value is not None and name in intervals]
    absent = all(_holds(intervals[name], value) for name, value in sizes)
    return [name for name, _ in sizes] if absent else []


def undetermined(effect: Effect, intervals: Intervals) -> list[tuple[str, float, float]]:
    """The parameters without which an effect is nothing, and the ends of their intervals, where these are too wide.

    They are the essential shape parameters, and the sizes if each of them is undetermined: the ends of the interval are
    then at distances from the value at which the effect is absent whose ratio exceeds ``WIDEST``.
    """

    def wide(name: str, absent_at: float) -> bool:
        near, far = sorted(abs(end - absent_at) for end in intervals[name])
        return far > WIDEST * near

    known = [p for p in effect.parameters if p.name in intervals]
    found = [p.name for p in known if p.essential and wide(p.name, 0.0)]
    sizes = [p for p in known if p.neutral is not None]
    if sizes and all(wide(p.name, p.neutral or 0.0) for p in sizes):
        found += [p.name for p in sizes]
    return [(name, *intervals[name]) for name in found[:MOST_NAMED]]


def determined_form(part: Part, intervals: Intervals) -> Effect | None:
    """The simplest form of an effect that the log does not distinguish from the fitted one; None if there is none.

    A form with more parameters equals a simpler one where the additional parameters have their neutral values, at which
    they have no influence, or those by default; the phase of a wave of size zero has no influence either. The log does
    not distinguish two forms if the 95 % intervals of these parameters contain such values.
    """
    effect, ends = part.effect, {p.name: intervals.get(p.name, (np.inf, -np.inf)) for p in part.effect.parameters}
    values = {p.name: p.neutral if p.by_default is None else p.by_default for p in effect.parameters}
    neutral = {name for name, value in values.items() if value is not None and _holds(ends[name], value)}
    free = neutral | {phase for size, phase in effect.waves if size in neutral}
    return effect.without(free)


def _holds(interval: tuple[float, float], value: float) -> bool:
    return interval[0] <= value <= interval[1]


def never_passed(system: System, motion: Motion, part: Part, parameters: Mapping[str, float]) -> bool:
    """Whether a log covers clearly less than an effect's period, unless that is a whole turn of an angle."""
    period = part.effect.period(parameters)
    return _stroke(system, motion, part) < LEAST_PERIOD * period and not _known_turn(system, part, period)


def periods_covered(system: System, motion: Motion, part: Part, parameters: Mapping[str, float]) -> float:
    """How often a log covers an effect's period; infinite without a period, or with that of a turn of an angle."""
    period = part.effect.period(parameters)
    if period <= 0 or _known_turn(system, part, period):
        return float("inf")
    return _stroke(system, motion, part) / period


def resolvable_periods(system: System, motion: Motion, part: Part, parameters: Mapping[str, float]) -> float:
    """Number of distinguishable periods among which that of an effect was searched: stroke over shortest, or 1.

    Two periods are distinguishable if their numbers of repetitions in the stroke differ by at least one. The search
    takes the largest of so many squared amplitudes, which is judged as the best of so many hypotheses (R. B. Davies,
    Biometrika 74, 1987, to first order).
    """
    stroke, period = _stroke(system, motion, part), parameters.get("period")
    if period is None or stroke <= 0 or _known_turn(system, part, period):
        return 1.0
    x, v = _along(system, motion, part)
    shares = np.geomspace(SHORTEST_PERIOD, 1.0, PERIODS_TRIED)
    seen = (q for q in shares if is_resolved(q * stroke, x, v, motion.usable, motion.fine_hz))
    return float(1 / next(seen, 1.0))


def is_level_or_line(system: System, motion: Motion, part: Part, parameters: Mapping[str, float]) -> bool:
    """Whether a curve over speed has its bend at speeds that the log hardly has.

    With a bend far below the log's top speed the curve is a constant level on this log, far above it a straight line.
    """
    shares = {p.name: p.seen_at for p in part.effect.parameters if p.seen_at is not None}
    if not shares:
        return False
    top = _top_speed(system, motion, part)
    return any(not low * top <= parameters[name] <= high * top for name, (low, high) in shares.items())


def takes_the_level(problem: Problem, refit: System, augmented: System, with_friction: bool = True) -> str:
    """The objection to effects with which a friction level becomes zero; empty if there is none.

    In one direction a level is a constant force, which cannot be distinguished from a gain of the drive. Where the
    contact reverses, another effect of friction may replace the level. An effect that is no friction may not: the
    machine has friction, and an effect that replaces all of it explains the friction, as a dead zone can.

    Args:
        with_friction: whether some of the effects acts on a contact.
    """
    gone = set(levels_at_zero(problem.system, [augmented], problem.levels))
    gone -= set(levels_at_zero(problem.system, [refit], problem.levels))
    slip = slip_velocities(problem.system, problem.motion)[problem.motion.usable]
    for k, contact in enumerate(problem.system.contacts):
        lost = sorted(gone & {s.name for s in contact.law_parameters.values()})
        if not lost:
            continue
        if np.all(slip[:, k] > 0) or np.all(slip[:, k] < 0):
            return f"makes the friction level {lost[0]} zero, which a log that moves one way cannot show"
        if not with_friction:
            return f"makes the friction level {lost[0]} zero, so it explains the friction and not what is missing"
    return ""


def remarks(found: FoundEffect, part: Part, problem: Problem) -> list[str]:
    """Remarks on an accepted effect: what the log does not cover, missing intervals, and a motion logged late."""
    words = []
    delay = part.effect.delay(found.parameters)
    if delay:
        words.append(_motion_logged_late(found, part, problem, delay))
    if part.effect.rough:
        words.append(f"The values of {found.kind} have no interval, since the error is no smooth function of them")
    stroke, period = _stroke(problem.system, problem.motion, part), part.effect.period(found.parameters)
    if period > stroke and not never_passed(problem.system, problem.motion, part, found.parameters):
        unit = found.units.get("period", "rad")  # without this parameter it is a turn
        words.append(f"The log covers only {stroke:.3g} of {period:.3g} {unit} of the period of {found.title}")
    covered = {"{q}/s": _top_speed(problem.system, problem.motion, part), "s": float(np.ptp(problem.motion.time))}
    for p in part.effect.parameters:
        most = covered.get(p.unit)
        if most is None or p.neutral is not None or not found.parameters[p.name] > most:
            continue
        given = {"name": p.name, "value": found.parameters[p.name], "unit": found.units[p.name]}
        words.append(worded("beyond the log", named=found.title, most=most, **given))
    return words


def _motion_logged_late(found: FoundEffect, part: Part, problem: Problem, delay: float) -> str:
    """The remark on an input that acts late, which no log can distinguish from a motion that is logged late."""
    system, integrated = problem.system, problem.motion.integrated
    i = part.effect.coordinate(system, part.place)
    logged = (system.velocities if integrated and integrated[i] else system.positions)[i].name
    return worded("logged late", named=found.title, logged=logged, delay=delay)


def _known_turn(system: System, part: Part, period: float) -> bool:
    """Whether a period is a whole turn of an angle, which needs no evidence."""
    on_angle = part.effect.sits_on in ("coordinate", "sensor") and system.position_units[part.place] == "rad"
    return on_angle and abs(period - WHOLE_TURN) <= 1e-9 * WHOLE_TURN


def _stroke(system: System, motion: Motion, part: Part) -> float:
    if not motion.usable.any():
        return 0.0
    return float(np.ptp(_along(system, motion, part)[0][motion.usable]))


def _top_speed(system: System, motion: Motion, part: Part) -> float:
    return float(np.quantile(np.abs(_along(system, motion, part)[1]), MOST_SPEED))


def _along(system: System, motion: Motion, part: Part) -> tuple[Array, Array]:
    """(N,) position and speed at the place of an effect; of a contact its slip, where U is constant."""
    direction = np.zeros(system.degrees_of_freedom)
    if part.effect.sits_on == "contact":
        column = system.distribution[:, part.place].subs(system.values)
        direction[:] = [float(c) if c.is_number else 1.0 for c in column]
    else:
        direction[part.place if part.effect.sits_on in ("coordinate", "sensor", "axis") else 0] = 1.0
    return motion.positions @ direction, motion.velocities @ direction

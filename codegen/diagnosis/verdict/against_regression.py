"""Objections to effects by the force residual: curves that explain more, parameters that vary, waves that are none.

A law that the catalogue lacks may look like an effect that depends on one of its variables alone: friction in
proportion to the speed and periodic in position looks like friction over position, and friction that grows with the
speed and the load looks like viscous friction. Such an effect explains most of the force, and no curve over a single
variable explains what is left. But its parameters are then not the same at all speeds or loads. With r the residual
force that the model with the effect leaves, and θ the effect's parameters,

    r = Σ_j h_j(z) ∂r/∂θ_j,    z: speed, position, load, acceleration, time, distance since the last reversal

with smooth h_j is compared with the same for constant h_j, on held-out parts of the log (varying-coefficient model,
Hastie and Tibshirani 1993). The h_j of the effect's own variable are not asked for: they are an error of its curve.

A parameter may also have another value in intervals of time, as a torque constant before a motor is warm. A single
interval is in no other part of the log, so this is compared by least squares on the whole log, in the intervals in
which the force balance differs significantly (``changes_in_time.py``).

A sine with free amplitude, period and phase follows part of every smooth curve over a stroke of one or two periods,
such as friction in patches of a floor. Only a second period shows that the force repeats. Where the log does not cover
it, and a smooth curve over the position explains much of what the wave leaves, nothing shows that it is a wave.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import partial
from math import sqrt

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.reservations import periods_covered
from codegen.diagnosis.evidence.residual_regression import (
    STATE,
    acting_force,
    added_share,
    at_once,
    changed_on,
    explained_over,
    peak_hz,
    remainder_columns,
    sliding,
    splines,
    variables_of,
)
from codegen.diagnosis.fit.acceptance import is_far
from codegen.diagnosis.fit.drive import residual_at_drive
from codegen.diagnosis.fit.linear import regressed, rms
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.residual import Problem, level_columns, without_levels
from codegen.diagnosis.fit.trial import part_of, with_effects
from codegen.diagnosis.results import Change, FoundEffect, Remainder, titles, worded
from codegen.diagnosis.verdict.answer import Answer
from codegen.diagnosis.verdict.wrong_values import FAR_LESS
from codegen.effects import CATALOGUE
from codegen.effects.declare import effect_symbols, places_of
from codegen.effects.nameless import effect_called
from codegen.mechanics.system import System

VARIABLES = {
    "velocity": "speed",
    "position": "position",
    "load": "load",
    "acceleration": "acceleration",
    "input": "load",
    "input rate": "input rate",
    "time": "time",
}
"""Variable on which an effect depends most → variable of the flexible regression."""
OF_THE_MOTION = 0.02
"""Share of the squared velocity at a line of the spectrum above which the machine is moved with this frequency."""
SLOW_MOTION = 0.5
"""Share of the squared velocity that a curve over time explains above which it may be a curve over the motion."""
MOST = 0.5
"""Least share, of what a flexible regression on an effect's own variable explains, that the effect must remove."""


@dataclass(frozen=True)
class OtherCause:
    """Shares of a squared force residual that effects explain, and something else, which ``what`` names.

    Attributes:
        alone: by the other. by_law: by the force of the effects. both: by the two together.
    """

    what: str
    alone: float
    by_law: float
    both: float

    @property
    def makes_needless(self) -> bool:
        """Whether the effects explain little in addition to the other."""
        return self.both - self.alone < MOST * self.by_law

    @property
    def words(self) -> str:
        """The objection to the effects."""
        more = max(0.0, self.both - self.alone)
        return worded("other cause", what=self.what, alone=self.alone, by_law=self.by_law, more=more)


@dataclass(frozen=True)
class ForceEvidence:
    """Shares of the squared force residual on one coordinate.

    Attributes:
        removed: that the augmented model removes of the refit's. own: that a flexible regression on the effects' own
            variables explains on held-out parts.
        missed: RMS force of this regression that the effects do not explain, over the drive force.
        vibration: the highest line of the residual's spectrum, on held-out parts, without a constant in proportion to
            that of the effects' force; zero if the motion has that line too.
        drift: a smooth curve over time, on held-out parts; zero if the motion is as slow.
    """

    removed: float
    own: float
    missed: float
    vibration: OtherCause
    drift: OtherCause


def force_evidence(
    problem: Problem, refit: System, augmented: System, kinds: Sequence[str], acting: Collection[int]
) -> list[ForceEvidence]:
    """The evidence for effects of these kinds, on each coordinate on which they act."""
    motion = problem.motion
    before, after = (residual_at_drive(s, motion) for s in (refit, augmented))
    own = {VARIABLES[CATALOGUE[kind].seen_over] for kind in kinds}
    found = []
    for i in sorted(set(acting)):
        used = sliding(refit, motion, problem.used, i)
        over = remainder_columns(refit, motion, before, used, i)
        r, left = (without_levels(refit, motion, used, y[:, i], i) for y in (before, after))
        removed = 1 - float(np.sum(left[used] ** 2) / max(float(np.sum(r[used] ** 2)), 1e-300))
        together = explained_over(r, used, [over(name) for name in sorted(own)])
        drive = rms(acting_force(refit, motion)[used, i])
        missed = sqrt(max(0.0, together - max(0.0, removed))) * rms(r[used]) / max(drive, 1e-300)
        force, speed = (r - left)[:, None], motion.velocities[:, i]
        force = force / max(rms(force[used]), 1e-300)  # the ridge is that of columns near 1, in any unit
        by_law = explained_over(r, used, [force])
        shares = list[float]()
        for name, most in (("frequency", OF_THE_MOTION), ("time", SLOW_MOTION)):
            columns = over(name)
            moves = explained_over(speed, used, [columns]) > most
            shares += [0.0 if moves else explained_over(r, used, group) for group in ([columns], [columns, force])]
        line, with_line, time, with_time = shares
        # the constant of the regression over the line is not the vibration's, where the law's own force is constant
        own_constant = float(np.mean(force[used])) ** 2 * explained_over(r, used, [np.ones_like(force)])
        line = max(0.0, line - own_constant)
        hz = peak_hz(before[:, i], used, motion)
        vibration = OtherCause(f"a vibration of constant frequency, {hz:.3g} Hz,", line, by_law, with_line)
        drift = OtherCause("a slow change in time", time, by_law, with_time)
        found.append(ForceEvidence(removed, together, missed, vibration, drift))
    return found


def along_intervals(changes: Sequence[Change], time: Array) -> list[Array]:
    """(N, 3) polynomials of degree 2 in time for each interval, since a push is not constant; zero outside of it."""
    found = list[Array]()
    for c in changes:
        inside = (time >= c.start) & (time < c.stop)
        along = (time - c.start) / (c.stop - c.start) - 0.5
        found.append(np.where(inside, along ** np.arange(3)[:, None], 0.0).T)
    return found


def fitted_share(r: Array, used: NDArray[np.bool_], columns: Sequence[Array]) -> float:
    """Share of a squared residual that these columns, (N, m) each, remove by least squares."""
    if not columns:
        return 0.0
    y = r[used]
    left = regressed(y, np.column_stack(columns)[used])[1]
    return 1 - float(left @ left) / max(float(y @ y), 1e-300)


def acts_on(effect: FoundEffect, system: System) -> int:
    """Index of the coordinate on which an effect acts most (``Effect.coordinate``)."""
    kind = CATALOGUE[effect.kind].with_parameters(list(effect.parameters))
    return kind.coordinate(system, places_of(kind, system).index(effect.on))


def against_regression(
    final: Fit, problem: Problem, refit: System, augmented: System, named: Sequence[FoundEffect]
) -> str:
    """The objection of a nonparametric regression to effects, in words; empty if there is none.

    There are three objections. Backlash is exempt.

    - A smooth curve over the effects' own variables explains much more than they do; near the noise of the free runs
      only where they increase the residual force, by a material force, and not asked of a load behind a spring. Free
      runs about a few stops may prefer a limit of the input that doubles the squared force residual elsewhere.
    - A spectral line, a vibration in time, explains more, and the effects explain little in addition. A controller
      reacts to a vibration, so a delayed input can cancel it down to a few times the noise. Near the noise the line
      must leave less than ``FAR_LESS`` of the square that the effects leave.
    - A slow change in time leaves less than ``FAR_LESS`` of the square that the effects leave, and they explain little
      in addition. What a true effect leaves is noise, which no such curve explains.
    """
    if any(t.gap != 0 for t in augmented.transmissions):
        return ""
    near = not is_far(final)
    acting = [acts_on(effect, problem.system) for effect in named]
    for one in force_evidence(problem, refit, augmented, [effect.kind for effect in named], acting):
        exempt = near and (one.removed >= 0 or one.missed < problem.material or augmented.transmissions)
        if one.removed < MOST * one.own and not exempt:
            return "a smooth curve over its own variable explains twice as much of the residual force as the law does"
        for other, most in ((one.vibration, FAR_LESS if near else 1.0), (one.drift, FAR_LESS)):
            if 1 - other.alone < most * (1 - other.by_law) and other.makes_needless:
                return other.words
    return ""


OVER = (*STATE, "time")
"""Variables with which a parameter may vary."""
KNOTS = 8
"""Knots of a parameter's spline."""
MOST_OF_IT = 0.5
"""Least share of the squared residual force that varying parameters explain beyond constant ones, for an objection."""
MUCH_LESS = 0.5
"""Largest squared residual force with varying parameters, over that with a curve in addition to the effect."""
REPEATED = 2.0
"""Periods that a log must cover to show that a force repeats."""
MUCH_OF_THE_REST = 0.25
"""Least share of what a wave leaves of the squared residual force that a curve over its variable explains: half of its
RMS. Of true waves, where all that is left is noise or another force, it is zero."""
MUCH_IN_TIME = 1 / 3
"""Least RMS of a force that changes in time beside effects, over that of their own force, for an objection."""
ONE_EVENT = 0.8
"""Least share of the squared residual force, within ``AT_ONCE`` of the samples, that is one event, such as a push."""
STEP = 1e-3
"""Relative step of a parameter for its slope."""


@dataclass(frozen=True)
class Varying:
    """An effect whose parameters vary with a variable.

    Attributes:
        share: of the squared residual force that varying parameters explain beyond constant ones: on held-out parts, or
            with other values in intervals of time by least squares.
    """

    effect: FoundEffect
    over: str
    share: float

    @property
    def words(self) -> str:
        return worded("vary", named=self.effect.title, over=self.over, share=self.share)


def varying(problem: Problem, augmented: System, named: Sequence[FoundEffect], material: float) -> Varying | None:
    """The effect of a model whose parameters vary most, if they do so by a material force; else None.

    Of what constant parameters and levels leave, once these are fitted, varying ones must explain ``MOST_OF_IT`` and a
    force of the share ``material`` of the drive force, and leave less than ``MUCH_LESS`` of the square that a smooth
    curve over the same variable leaves in addition to constant parameters, in each direction of motion: where such a
    curve explains it as well, a further effect is missing. In intervals of time the parameters have constant
    values, and the curve is a polynomial of degree 2 in each.
    """
    found = list[Varying]()
    motion, known = problem.motion, symbols_of(problem.system, named)
    residual, acting = residual_at_drive(augmented, motion), acting_force(augmented, motion)
    for i in sorted({acts_on(effect, problem.system) for effect in named}):
        rows = sliding(augmented, motion, problem.used, i)
        r, drive = residual[:, i], rms(acting[rows, i])
        if not rms(r[rows]) >= material * drive:
            continue
        slopes = {
            k: [of_unit_size(slope_of_residual(problem, augmented, residual, s)[:, i], rows) for s in symbols]
            for k, symbols in enumerate(known)
        }
        slopes = {k: [c for c in columns if c.any()] for k, columns in slopes.items()}
        levels = [of_unit_size(c, rows) for c in level_columns(augmented, motion, i).T]
        constant = [c[:, None] for c in (*levels, *(c for columns in slopes.values() for c in columns))]
        left = sqrt(max(0.0, 1 - fitted_share(r, rows, constant))) * rms(r[rows])
        over = variables_of(augmented, motion, residual, i)
        sign = np.sign(over["speed"])[:, None]
        curves = {name: splines(over[name], KNOTS) for name in OVER}
        columns_over = remainder_columns(augmented, motion, residual, rows, i)
        events = along_intervals(changed_on(augmented, motion, r, rows, columns_over, i).changes, motion.time)
        held_out, whole = partial(added_share, r, rows, constant), partial(_added_by_fit, r, rows, constant)
        for k, columns in slopes.items():
            own = VARIABLES[effect_called(named[k].kind).seen_over]
            tests = [(v, held_out, [curves[v]], curves[v]) for v in OVER if v != own]
            if events and own != "time":
                tests.append(("time", whole, events, np.hstack([one[:, :1] for one in events])))
            for name, added, curve, values in tests if columns else ():
                share = added([c[:, None] * values for c in columns])
                if share < MOST_OF_IT or sqrt(share) * left < material * drive:
                    continue
                if 1 - share < MUCH_LESS * (1 - added([*curve, *(column * sign for column in curve)])):
                    found.append(Varying(named[k], name, share))
    return max(found, key=lambda one: one.share, default=None)


def unrepeated(problem: Problem, augmented: System, named: Sequence[FoundEffect], material: float) -> str:
    """The objection to the first wave that is covered less than ``REPEATED`` times and is no wave; empty if none.

    A smooth curve over its own variable explains ``MUCH_OF_THE_REST`` of what the model leaves, on held-out parts and
    beyond friction levels, and a force of the share ``material`` of the drive force. A whole turn of an angle repeats
    for certain.
    """
    motion, system = problem.motion, problem.system
    residual, acting = residual_at_drive(augmented, motion), acting_force(augmented, motion)
    for one in named:
        effect = effect_called(one.kind).with_parameters(list(one.parameters))
        part = part_of(effect, places_of(effect, system).index(one.on), system)
        covered = periods_covered(system, motion, part, one.parameters)
        if covered >= REPEATED:
            continue
        i = acts_on(one, system)
        rows = sliding(augmented, motion, problem.used, i)
        r, own = residual[:, i], VARIABLES[effect.seen_over]
        columns = remainder_columns(augmented, motion, residual, rows, i)(own)
        levels = [c[:, None] for c in level_columns(augmented, motion, i).T]
        left = sqrt(max(0.0, 1 - fitted_share(r, rows, levels))) * rms(r[rows])
        share = added_share(r, rows, levels, [columns])
        if share >= MUCH_OF_THE_REST and sqrt(share) * left >= material * rms(acting[rows, i]):
            return worded("unrepeated", named=one.title, covered=covered, own=own, share=share)
    return ""


def changes_beside(problem: Problem, answer: Answer, left: Sequence[Remainder], material: float) -> str:
    """The objection to effects that imitate a force acting only in some intervals of time; empty if there is none.

    A force that acts in some intervals, or depends on the path, has a mean and a slope over the motion. A constant, an
    asymmetry or a spring follows these, and leaves the rest. So effects are refused if most of what they leave is a
    material force that changes in time (``Remainder.is_mostly_in_time``), and its RMS is between ``MUCH_IN_TIME`` and 1
    times that of the effects' own force. An imitation takes more than it leaves. A larger rest is another force, such
    as a limit of the input that acts in moments. A single short event is no objection to effects that remove most of
    the squared residual force at all other times (``ONE_EVENT``, ``MOST``).
    """
    motion = problem.motion
    before, after = (residual_at_drive(s, motion) for s in (answer.refit, answer.augmented))
    for i in sorted({acts_on(effect, problem.system) for effect in answer.effects}):
        if not left[i].is_mostly_in_time(material):
            continue
        rows = sliding(answer.augmented, motion, problem.used, i)
        r, rest = (without_levels(answer.augmented, motion, rows, y[:, i], i) for y in (before, after))
        event, others = at_once(rest, rows, ONE_EVENT), rows.copy()
        if event is not None:
            others[event[0] : event[1] + 1] = False
            if np.sum(rest[others] ** 2) < (1 - MOST) * np.sum(r[others] ** 2):
                continue
        share = left[i].rms * sqrt(left[i].changed) / max(rms((r - rest)[rows]), 1e-300)
        if MUCH_IN_TIME <= share < 1:
            return worded("changes beside", named=titles(answer.effects), share=share, explained=left[i].changed)
    return ""


def _added_by_fit(r: Array, rows: NDArray[np.bool_], columns: Sequence[Array], further: Sequence[Array]) -> float:
    """Share of what ``columns`` leave of a squared residual (N,) that ``further`` ones remove by least squares."""
    plain, richer = (fitted_share(r, rows, some) for some in (columns, [*columns, *further]))
    return (richer - plain) / max(1 - plain, 1e-300)


def symbols_of(system: System, named: Sequence[FoundEffect]) -> list[list[sympy.Symbol]]:
    """The symbols of each effect's parameters, in a system to which the effects are added in this order."""
    found = list[list[sympy.Symbol]]()
    for one in named:
        effect = effect_called(one.kind).with_parameters(list(one.parameters))
        symbols = effect_symbols(effect, one.on, system)
        found.append([symbols[name] for name in one.parameters])
        system = with_effects(system, (one,))
    return found


def slope_of_residual(problem: Problem, model: System, residual: Array, symbol: sympy.Symbol) -> Array:
    """(N, n) slope of a model's residual force by a parameter, by a finite difference."""
    value = float(model.values[symbol])
    step = STEP * (abs(value) or 1.0)
    other = model.with_parameters({symbol: sympy.Float(value + step)}, {})
    return np.asarray((residual_at_drive(other, problem.motion) - residual) / step)


def of_unit_size(column: Array, rows: NDArray[np.bool_]) -> Array:
    """A column over its RMS at the samples ``rows``; the ridge is that of columns near 1, in any unit."""
    size = rms(column[rows])
    return np.asarray(column / size) if size > 0 and np.isfinite(size) else np.zeros(len(column))

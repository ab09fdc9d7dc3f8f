"""Curves over positions: objections to effects that follow one in part, and one over a position that none describes.

A cable or spring from a link of an arm to a fixed point acts on several joints, on each by the positions of all. A
weight and an offset on one joint and a spring on another together follow a part of that. So the refit's force residual
is regressed on polynomials of all positions, and on the effects, each beside friction levels and all toleranced
parameters. An effect with the right law leaves noise, and no polynomial leaves much less. A curve over the
effect's own position is compared as well: where it explains the rest, the law is only nearly right, and no force acts
between coordinates.

Forces that depend on the same position alone, such as a constant and a weight, add up to one curve. Seen over less than
the period of a wave among them it is an arc, and an offset with a weight has three values, as a parabola has. So the
force of a gas strut on a lid looks like both together, and the weight is then as large as the curvature needs, with an
offset that takes most of it away. A polynomial over the position is fitted to the force residual in their place. They
are named only if the log prefers them to the polynomial with as many values, or with one more if they cancel: large
forces against each other follow any curve, and two true ones seldom balance. Nor are they if one value more leaves much
less.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from math import comb

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.force_gain import force_gain
from codegen.diagnosis.evidence.reservations import LEAST_PERIOD
from codegen.diagnosis.evidence.residual_regression import (
    POSITION_KNOTS,
    acting_force,
    added_share,
    explained_over,
    repeated_share,
    sliding,
    smooth_curve,
    splines,
)
from codegen.diagnosis.fit.acceptance import LEAST_SHARE, TIE_LEVEL
from codegen.diagnosis.fit.drive import bounded_least_squares, residual_at_drive
from codegen.diagnosis.fit.identity_cache import OF_MODELS, identity_cache
from codegen.diagnosis.fit.linear import rms
from codegen.diagnosis.fit.output_error import WITHIN
from codegen.diagnosis.fit.residual import Problem, level_columns
from codegen.diagnosis.fit.trial import with_effects
from codegen.diagnosis.results import Fact, FoundEffect, titles
from codegen.diagnosis.verdict.against_regression import (
    MOST,
    MUCH_OF_THE_REST,
    OtherCause,
    acts_on,
    of_unit_size,
    slope_of_residual,
    symbols_of,
)
from codegen.effects.nameless import effect_called
from codegen.mechanics.system import System

HIGHEST_DEGREE, MOST_TERMS = 3, 40
"""Greatest degree of the polynomial, and the number of its terms up to which a degree is taken."""
BY_OTHERS = 0.1
"""Least share, of what the effects and a spline over their own position leave, that the polynomial explains."""


def over_positions(problem: Problem, refit: System, named: Sequence[FoundEffect]) -> str:
    """The objection to the effects, in words; empty if there is none.

    On a coordinate on which they act

    - the curve leaves less than ``MOST`` of the square that they leave, and the difference is a material force, or more
      than they explain;
    - it explains at least ``BY_OTHERS`` of what they and a spline over their own position leave;
    - both together leave at least ``MOST`` of what the curve leaves. Where a spring between coordinates moves the
      machine, a curve over the positions follows an acceleration too, but beside it a true inertia error still explains
      the rest.
    """
    motion = problem.motion
    moving = np.flatnonzero(np.ptp(motion.positions, axis=0))
    if len(moving) < 2:
        return ""
    residual, slopes = residual_at_drive(refit, motion), _parameter_slopes(problem, refit)
    drive = acting_force(refit, motion)
    laws = [residual - residual_at_drive(with_effects(refit, [one]), motion) for one in named]
    for i in sorted({acts_on(one, problem.system) for one in named}):
        rows, r = sliding(refit, motion, problem.used, i), residual[:, i]

        def scaled(columns: Sequence[Array], rows: NDArray[np.bool_] = rows) -> list[Array]:
            return [c[:, None] for c in (of_unit_size(one, rows) for one in columns) if c.any()]

        known = scaled([*level_columns(refit, motion, i).T, *(slope[:, i] for slope in slopes)])
        law, curve = scaled([one[:, i] for one in laws]), scaled(_polynomial(motion.positions[:, moving], rows))
        if not (rows.any() and law):
            continue
        own = splines(motion.positions[:, i], POSITION_KNOTS)
        by_known, *shares = (explained_over(r, rows, [*known, *more]) for more in ([], curve, law, [*law, *curve]))
        alone, by_law, both = (max(0.0, share - by_known) / max(1 - by_known, 1e-300) for share in shares)
        further = np.sqrt(max(0.0, alone - by_law) * (1 - by_known)) * rms(r[rows])
        large = further >= problem.material * rms(drive[rows, i]) or by_law < MOST * alone
        better = large and 1 - alone < MOST * (1 - by_law) and 1 - both >= MOST * (1 - alone)
        if better and added_share(r, rows, [*known, *law, own], curve) >= BY_OTHERS:
            return OtherCause("a smooth curve over the positions of all coordinates", alone, by_law, both).words
    return ""


@identity_cache(OF_MODELS)
def _parameter_slopes(problem: Problem, refit: System) -> list[Array]:
    """(N, n) slopes of the refit's force residual by each parameter with a tolerance."""
    residual = residual_at_drive(refit, problem.motion)
    return [slope_of_residual(problem, refit, residual, symbol) for symbol in problem.deviation]


def _polynomial(x: Array, rows: NDArray[np.bool_]) -> list[Array]:
    """(N,) products of positions (N, m), each less its mean and over half its range at these rows; no constant."""
    used = x[rows] if rows.any() else x
    z = (x - used.mean(axis=0)) / np.maximum(np.ptp(used, axis=0) / 2, 1e-300)
    count = x.shape[1]
    degree = max((d for d in range(1, HIGHEST_DEGREE + 1) if comb(count + d, d) <= MOST_TERMS), default=1)
    picked = (some for d in range(1, degree + 1) for some in combinations_with_replacement(range(count), d))
    return [np.prod(z[:, list(some)], axis=1) for some in picked]


CANCEL = 0.5
"""Square of a sum of forces over the sum of their squares below which they cancel; 1 if they are orthogonal."""


def arc_of_a_curve(
    problem: Problem, refit: System, augmented: System, named: Sequence[FoundEffect]
) -> tuple[Fact, Fact] | None:
    """The objection to effects over one position, and the experiments that would show them; None if there is none.

    Both the effects and the polynomial are fitted by least squares with the friction levels, and with the toleranced
    values within their limits, to the force residual of the augmented model.
    """
    motion, system, symbols = problem.motion, problem.system, symbols_of(problem.system, named)
    residual, plain = (residual_at_drive(model, motion) for model in (augmented, refit))
    for i in sorted({acts_on(one, system) for one in named}) if len(named) > 1 else ():
        group = [k for k, one in enumerate(named) if acts_on(one, system) == i and _depends_on(one, refit, i)]
        period = max((effect_called(named[k].kind).period(named[k].parameters) for k in group), default=0.0)
        x, rows = motion.positions[:, i], sliding(augmented, motion, problem.used, i)
        stroke = float(np.ptp(x[motion.usable]))
        if len(group) < 2 or stroke >= LEAST_PERIOD * period or not rows.any():
            continue
        forces = [(residual_at_drive(with_effects(refit, [named[k]]), motion) - plain)[:, i] for k in group]
        force = np.sum(forces, axis=0)
        sizes, together = tuple(rms(one[rows]) for one in forces), rms(force[rows])
        own = [slope_of_residual(problem, augmented, residual, s)[:, i] for k in group for s in symbols[k]]
        cancel = together**2 < CANCEL * sum(size**2 for size in sizes)
        known = _known(problem, augmented, residual, i)
        law, curve = residual.copy(), residual.copy()
        law[:, i] = _least(residual[:, i], rows, own, known)
        for values in (len(own), len(own) + 1):
            powers = list(np.vander((x - x.mean()) / stroke, values).T)
            curve[:, i] = _least(residual[:, i] - force, rows, powers, known)
            gain = force_gain(problem, curve, law, i)
            better = gain.left * (1 - MUCH_OF_THE_REST) > 1
            preferred = gain.left <= 1 - LEAST_SHARE and gain.p_of_rivals() <= TIE_LEVEL
            if better or ((cancel or values == len(own)) and not preferred):
                these, on = titles(named[k] for k in group), system.positions[i].name
                about = {"stroke": stroke, "period": period, "unit": system.position_units[i], "on": on}
                given = {"sizes": sizes, "together": together, "force_unit": system.force_unit(i), "values": values}
                against = Fact.worded("not accepted", "one curve", named=these, better=better, **about, **given)
                return against, Fact.worded("next", "whole curve", **about)
    return None


def _depends_on(one: FoundEffect, system: System, i: int) -> bool:
    """Whether an effect is a force on coordinate i by the position of that alone."""
    other = with_effects(system, [one])
    added = [sympy.expand_mul(a - b) for a, b in zip(other.equation_error, system.equation_error, strict=True)]
    known = {system.positions[i], *other.values}
    return added[i] != 0 and added[i].free_symbols <= known and all(a == 0 for k, a in enumerate(added) if k != i)


def _known(problem: Problem, model: System, residual: Array, i: int) -> tuple[Array, Array, Array]:
    """(N, p) force on coordinate i by levels and toleranced values, and the least and greatest change of each, (p,)."""
    symbols, levels = problem.uncertain, level_columns(model, problem.motion, i)
    slopes = [-slope_of_residual(problem, model, residual, s)[:, i] for s in symbols]
    moved = np.array([float(model.values[s] - problem.system.values[s]) for s in symbols])
    reach = np.array([WITHIN * problem.deviation[s] for s in symbols])
    free = np.full(levels.shape[1], np.inf)
    return np.column_stack([levels, *slopes]), np.append(-free, -reach - moved), np.append(free, reach - moved)


def _least(r: Array, rows: NDArray[np.bool_], columns: Sequence[Array], known: tuple[Array, Array, Array]) -> Array:
    """A residual (N,) less what these columns, without limits, and ``_known`` ones explain at the samples ``rows``."""
    free = np.full(len(columns), np.inf)
    every, low, high = np.column_stack([*columns, known[0]]), np.append(-free, known[1]), np.append(free, known[2])
    return np.asarray(r - every @ bounded_least_squares(every[rows], r[rows], (low, high)))


@dataclass(frozen=True)
class Curve:
    """A force over the position that a model lacks.

    Attributes:
        share: of the squared residual force that it explains on held-out parts.
        points: (position, force) at the ends of the stroke and in its middle.
    """

    on: str
    unit: str
    force_unit: str
    share: float
    points: tuple[tuple[float, float], ...]

    @property
    def fact(self) -> Fact:
        return Fact.worded("unexplained", "curve", curve=self)


def missing_curve(problem: Problem, model: System) -> Curve | None:
    """The force over one position that a model lacks, that of the largest share; None if there is none.

    A smooth curve over the position explains ``MOST`` of the squared residual beyond a constant, a material force.
    """
    motion, system, found = problem.motion, problem.system, list[Curve]()
    residual, drive = residual_at_drive(model, motion), acting_force(model, motion)
    for i, x in enumerate(motion.positions.T):
        rows, r = sliding(model, motion, problem.used, i), residual[:, i]
        if not rows.any():
            continue
        columns = splines(x, POSITION_KNOTS)
        share, constant = (repeated_share(r, rows, [some]) for some in (columns, np.ones((len(r), 1))))
        varies = np.sqrt(max(0.0, share - constant)) * rms(r[rows]) >= problem.material * rms(drive[rows, i])
        if not varies or share - constant < MOST * (1 - constant):
            continue
        order = np.flatnonzero(rows)[np.argsort(x[rows])]
        shown = order[[0, len(order) // 2, -1]]
        forces = -smooth_curve(r, rows, columns)[shown]
        points = tuple((float(a), float(f)) for a, f in zip(x[shown], forces, strict=True))
        found.append(Curve(system.positions[i].name, system.position_units[i], system.force_unit(i), share, points))
    return max(found, key=lambda one: one.share, default=None)

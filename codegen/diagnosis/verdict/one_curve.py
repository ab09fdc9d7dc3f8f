"""Curves over a position: effects that add up to one of which a log shows an arc, and a force that no effect describes.

Forces that depend on the same position alone, such as a constant and a weight, add up to one curve. Seen over less than
the period of a wave among them it is an arc, and an offset with a weight has three values, as a parabola has. So the
force of a gas strut on a lid looks like both together, and the weight is then as large as the curvature needs, with an
offset that takes most of it away. A polynomial over the position is fitted to the force residual in their place. They
are named only if the log prefers them to the polynomial with as many values, or with one more if they cancel: large
forces against each other follow any curve, and two true ones seldom balance. Nor are they if one value more leaves much
less.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.force_gain import force_gain
from codegen.diagnosis.evidence.reservations import LEAST_PERIOD
from codegen.diagnosis.evidence.residual_regression import (
    POSITION_KNOTS,
    acting_force,
    repeated_share,
    sliding,
    smooth_curve,
    splines,
)
from codegen.diagnosis.fit.acceptance import LEAST_SHARE, TIE_LEVEL
from codegen.diagnosis.fit.drive import bounded_least_squares, residual_at_drive
from codegen.diagnosis.fit.linear import rms
from codegen.diagnosis.fit.output_error import WITHIN
from codegen.diagnosis.fit.residual import Problem, level_columns
from codegen.diagnosis.fit.trial import with_effects
from codegen.diagnosis.results import Fact, FoundEffect, titles
from codegen.diagnosis.verdict.against_regression import MOST, acts_on
from codegen.diagnosis.verdict.against_remainder import MUCH_OF_THE_REST, slope_of_residual, symbols_of
from codegen.effects.nameless import effect_called
from codegen.mechanics.system import System

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
                against = Fact.said("not accepted", "one curve", named=these, better=better, **about, **given)
                return against, Fact.said("next", "whole curve", **about)
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
        return Fact.said("unexplained", "curve", curve=self)


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

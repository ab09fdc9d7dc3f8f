"""Objections to effects by the force that their model leaves: parameters that vary, and waves that are none.

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

from __future__ import annotations

from collections.abc import Sequence
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
    changed_on,
    remainder_columns,
    sliding,
    splines,
    variables_of,
)
from codegen.diagnosis.fit.drive import residual_at_drive
from codegen.diagnosis.fit.linear import rms
from codegen.diagnosis.fit.residual import Problem, level_columns
from codegen.diagnosis.fit.trial import part_of, with_effects
from codegen.diagnosis.results import FoundEffect, worded
from codegen.diagnosis.verdict.against_regression import VARIABLES, acts_on, along_intervals, fitted_share
from codegen.effects.declare import effect_symbols, places_of
from codegen.effects.nameless import effect_called
from codegen.mechanics.system import System

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

"""The objection to waves over position of which the log shows no second period, and whose curve is another one.

A sine with free amplitude, period and phase follows part of every smooth curve over a stroke of one or two periods,
such as friction in patches of a floor. That the force repeats is shown only by a second period. Where the log does not
cover it, and a smooth curve over the position explains much of what the wave leaves, the force is one over position
and nothing shows that it is a wave.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

from codegen.diagnosis.evidence.reservations import periods_covered
from codegen.diagnosis.evidence.residual_regression import (
    acting_force,
    added_share,
    remainder_columns,
    sliding,
)
from codegen.diagnosis.fit.drive import residual_at_drive
from codegen.diagnosis.fit.linear import rms
from codegen.diagnosis.fit.residual import Problem, level_columns
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.results import FoundEffect, worded
from codegen.diagnosis.verdict.against_regression import VARIABLES, acts_on, fitted_share
from codegen.effects.declare import places_of
from codegen.effects.nameless import effect_called
from codegen.mechanics.system import System

REPEATED = 2.0
"""Periods that a log must cover to show that a force repeats."""
MUCH_OF_THE_REST = 0.25
"""Least share of what a wave leaves of the squared residual force that a curve over its variable explains: half of its
RMS. Of true waves, where all that is left is noise or another force, it is zero."""


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
        columns = remainder_columns(augmented, motion, residual, rows, i)[own]
        levels = [c[:, None] for c in level_columns(augmented, motion, i).T]
        left = sqrt(max(0.0, 1 - fitted_share(r, rows, levels))) * rms(r[rows])
        share = added_share(r, rows, levels, [columns])
        if share >= MUCH_OF_THE_REST and sqrt(share) * left >= material * rms(acting[rows, i]):
            return worded("unrepeated", named=one.title, covered=covered, own=own, share=share)
    return ""

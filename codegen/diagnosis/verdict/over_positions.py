"""The objection to effects by a smooth curve over the positions of several coordinates.

A cable or spring from a link of an arm to a fixed point acts on several joints, on each by the positions of all. A
weight and an offset on one joint and a spring on another together follow a part of that. So the refit's force residual
is regressed on polynomials of all positions, and on the effects, each beside friction levels and all toleranced
parameters. An effect with the right law leaves noise, and no polynomial leaves much less. A curve over the
effect's own position is compared as well: where it explains the rest, the law is only nearly right, and no force acts
between coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations_with_replacement
from math import comb

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.residual_regression import (
    POSITION_KNOTS,
    acting_force,
    added_share,
    explained_over,
    sliding,
    splines,
)
from codegen.diagnosis.fit.drive import residual_at_drive
from codegen.diagnosis.fit.identity_cache import OF_MODELS, identity_cache
from codegen.diagnosis.fit.linear import rms
from codegen.diagnosis.fit.residual import Problem, level_columns
from codegen.diagnosis.fit.trial import with_effects
from codegen.diagnosis.results import FoundEffect
from codegen.diagnosis.verdict.against_regression import MOST, OtherCause, acts_on
from codegen.diagnosis.verdict.against_remainder import of_unit_size, slope_of_residual
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

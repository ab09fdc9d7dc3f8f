"""What the named effects do to the force residual, against what a flexible regression on their variables explains."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis.balance import slip_velocities
from codegen.diagnosis.problem import Problem
from codegen.diagnosis.referee import explained_over, remainder_columns, sliding
from codegen.diagnosis.residual import inverse_dynamics_residual
from codegen.diagnosis.signals import Motion
from codegen.effects import CATALOGUE
from codegen.mechanics.system import System

Array = NDArray[np.float64]

VARIABLES = {
    "velocity": "speed",
    "position": "position",
    "load": "load",
    "acceleration": "acceleration",
    "input": "load",
    "input rate": "input rate",
    "time": "time",
}
"""Axis over which an effect is seen best → the referee's variable."""


@dataclass(frozen=True)
class ForceEvidence:
    """What effects explain of the force residual on one coordinate.

    Attributes:
        coordinate: index.
        removed: share of the refit's squared residual that the augmented model removes.
        own: share of it that a flexible regression on the effects' own variables explains on held-out parts.
        others: other variable → (share that it explains alone, share that it explains together with what the effects
            changed).
    """

    coordinate: int
    removed: float
    own: float
    others: Mapping[str, tuple[float, float]]


def force_evidence(
    problem: Problem, refit: System, augmented: System, kinds: Sequence[str], acting: Collection[int]
) -> list[ForceEvidence]:
    """Of effects of these kinds, on each coordinate on which they are seen."""
    motion = problem.motion
    before, after = (inverse_dynamics_residual(s, motion) for s in (refit, augmented))
    own = {VARIABLES[CATALOGUE[kind].seen_over] for kind in kinds}
    found = []
    for i in sorted(set(acting)):
        variables = remainder_columns(refit, motion, before, i)
        used = sliding(refit, motion, problem.masks, i)
        r, left = (without_levels(refit, motion, used, y[:, i], i) for y in (before, after))
        removed = 1 - float(np.sum(left[used] ** 2) / max(float(np.sum(r[used] ** 2)), 1e-300))
        shape = (r - left)[:, None]
        others = {
            name: (explained_over(r, used, [columns]), explained_over(r, used, [columns, shape]))
            for name, columns in variables.items()
            if name not in own
        }
        together = explained_over(r, used, [variables[name] for name in sorted(own)])
        found.append(ForceEvidence(i, removed, together, others))
    return found


def without_levels(system: System, motion: Motion, used: NDArray[np.bool_], residual: Array, i: int) -> Array:
    """A residual on one coordinate, (N,), with the friction levels there refitted to it by least squares.

    The free runs weigh the log differently and put the levels elsewhere; what a level can take is no effect.
    """
    touching = [c for c in range(system.distribution.shape[1]) if system.distribution[i, c] != 0]
    if not touching or not used.any():
        return residual
    columns = motion.low_pass(np.sign(slip_velocities(system, motion)[:, touching]))
    weights = np.linalg.lstsq(columns[used], residual[used], rcond=None)[0]
    return np.asarray(residual - columns @ weights)

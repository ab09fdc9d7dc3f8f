"""What is left of the friction under the best input: on which coordinate, and whether it still only takes energy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from codegen.cancellation.optimum import best_inputs
from codegen.cancellation.plan import Plan
from codegen.cancellation.reach import Reach
from codegen.cancellation.weight import whitener

Array = NDArray[np.float64]
NOTHING = 1e-9


@dataclass(frozen=True)
class Leftover:
    """At the centre of the envelope, for a true estimate and gain 1.

    Attributes:
        gains: K, inputs by contacts: ū = K F̄.
        force: B K − U, coordinates by contacts: what still acts.
        pushing: contacts whose rest may feed energy: their column of ``force`` is no non-positive multiple of their
            column of U, so for some motion it acts along the slip and not against it.
    """

    gains: Array
    force: Array
    pushing: tuple[str, ...]


def leftover(found: Reach, plan: Plan) -> Leftover:
    """K and the rest of friction at the centre of the envelope."""
    system = found.system
    B, U, M = (found.numbers(m)[0] for m in (found.input_matrix, system.distribution, system.mass_matrix))
    gains = np.zeros((len(system.inputs), len(system.contacts)))
    chosen = list(plan.contacts)
    gains[:, chosen] = _inputs(found, plan, B, M, U[:, chosen])
    force = B @ gains - U
    names = [c.name for c in system.contacts]
    return Leftover(gains, force, tuple(n for j, n in enumerate(names) if not _brakes(force[:, j], U[:, j])))


def _inputs(found: Reach, plan: Plan, B: Array, M: Array, forces: Array) -> Array:
    if not plan.damping:
        return best_inputs(B, M, forces, found.weight, plan.pivots)
    white = whitener(found.weight, M) @ B
    regular = white.T @ white + plan.damping * np.eye(B.shape[1])
    return np.asarray(np.linalg.solve(regular, white.T @ whitener(found.weight, M) @ forces))


def _brakes(rest: Any, direction: Any) -> bool:
    size = float(direction @ direction)
    if size == 0:
        return True
    share = -float(rest @ direction) / size
    off = np.linalg.norm(rest + share * direction)
    return bool(share >= -NOTHING and off <= NOTHING * np.sqrt(size))

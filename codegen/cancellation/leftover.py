"""Remaining friction under the best input: on which coordinates, and whether it is still dissipative."""

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
    """Remaining friction for a perfect estimate and gain 1.

    Attributes:
        gains: K at the centre of the envelope, inputs by contacts: ū = K F̄.
        force: B K − U there, coordinates by contacts: the remaining force.
        pushing: contacts whose remainder may feed energy somewhere in the envelope: it is no non-positive multiple of
            the contact's direction d, so for some motion it acts along the slip. The best input leaves −(I − P) d, with
            P d the reachable part of d: a multiple of d only where P d is d or 0. So these are the contacts cancelled
            in part, and with damping also reachable ones whose remainder is not parallel to d.
    """

    gains: Array
    force: Array
    pushing: tuple[str, ...]


def leftover(found: Reach, plan: Plan) -> Leftover:
    """K and the remaining friction at the centre of the envelope, and the contacts that may feed energy in it."""
    system = found.system
    B, U, M = (found.numbers(m) for m in (found.input_matrix, system.distribution, system.mass_matrix))
    gains = _gains(found, plan, B[0], M[0], U[0])
    pushing = {found.contacts[j].name for j in plan.contacts if found.contacts[j].kind == "partial"}
    if plan.damping:
        for b, m, u in zip(B, M, U, strict=True):
            rest = b @ _gains(found, plan, b, m, u) - u
            pushing |= {v.name for j, v in enumerate(found.contacts) if not _brakes(rest[:, j], u[:, j])}
    return Leftover(gains, B[0] @ gains - U[0], tuple(v.name for v in found.contacts if v.name in pushing))


def _gains(found: Reach, plan: Plan, B: Array, M: Array, U: Array) -> Array:
    gains = np.zeros((B.shape[1], U.shape[1]))
    chosen = list(plan.contacts)
    gains[:, chosen] = _inputs(found, plan, B, M, U[:, chosen])
    return gains


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

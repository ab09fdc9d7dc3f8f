"""Stick–slip modes of contacts at rest: the consistent mode, found by enumeration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from codegen.base.arrays import Array

ROUNDING = 1e-9
"""Relative tolerance of an inequality."""
_SINGULAR = 1e-11
"""Ratio of smallest to largest eigenvalue below which stuck contacts count as linearly dependent."""
_FAINT = 64 * float(np.finfo(np.float64).eps)
"""Ratio of a force to the sum of magnitudes it results from, below which it counts as a rounding error."""


class NoMode(Exception):
    """No mode is consistent, as when a quantity is not finite."""


@dataclass(frozen=True)
class Limits:
    """Levels of each contact, (contacts,), not negative: sliding forward and backward, and at rest."""

    forward: Array
    backward: Array
    held_forward: Array
    held_backward: Array


@dataclass(frozen=True)
class Mode:
    """A stick–slip mode with its forces and accelerations.

    Attributes:
        directions: of each contact: 1 slides forward, −1 backward, 0 sticks.
        forces: λ (contacts,); unique if the stuck contacts are linearly independent.
        accelerations: u' (contacts,), exactly zero where a contact sticks.
        margin: the smallest relative distance from a violated inequality; the mode is consistent above −ROUNDING.
    """

    directions: tuple[int, ...]
    forces: Array
    accelerations: Array
    margin: float


def find_mode(
    directions: Sequence[int],
    resting: Sequence[int],
    free: Array,
    mobility: Array,
    limits: Limits,
    leaving: Mapping[int, int] | None = None,
) -> Mode:
    """The consistent mode among all 3^resting modes of the contacts at rest; the other contacts continue to slide.

    A contact that sticks has u' = 0 and λ within its levels at rest; one that begins to slide has u' along its
    direction and λ at its level of sliding. For Coulomb friction and U'M⁻¹U positive definite this is a linear
    complementarity problem with a P-matrix: exactly one acceleration is consistent, and modes with this acceleration
    differ at boundaries only. With a static level above the sliding one several modes may be consistent. A contact at
    rest breaks away only if it must, so the mode with the most stuck contacts is chosen, and of these the one with the
    largest margin.

    Args:
        directions: of each contact; those of ``resting`` are not used.
        resting: contacts with u = 0.
        free: slip accelerations without contact forces, (contacts,).
        mobility: U'M⁻¹U.
        limits: levels at the present state.
        leaving: contact whose force has just reached a level → direction in which it begins to slide.

    Raises:
        NoMode: if none is consistent.

    Source: Lötstedt 1981, Coulomb friction in two-dimensional rigid body systems; Cottle, Pang and Stone 1992,
    theorem 3.3.7.
    """
    choices = [(leaving[c],) if leaving and c in leaving else (0, 1, -1) for c in resting]
    modes: list[Mode] = []
    for chosen in sorted(product(*choices), key=np.count_nonzero):
        if modes and np.count_nonzero(chosen) > sum(modes[0].directions[c] != 0 for c in resting):
            break
        trial = list(directions)
        for c, direction in zip(resting, chosen, strict=True):
            trial[c] = direction
        mode = _tried(tuple(trial), resting, free, mobility, limits)
        if mode.margin >= -ROUNDING:
            modes.append(mode)
    if not modes:
        raise NoMode(f"{len(resting)} contacts at rest")
    return max(modes, key=lambda mode: mode.margin)


def forces_of(directions: Sequence[int], free: Array, mobility: Array, limits: Limits) -> Array:
    """The forces λ of a mode: ±level of a sliding contact, and the force that keeps u' = 0 of a stuck one."""
    way = np.asarray(directions)
    forces = np.where(way > 0, limits.forward, np.where(way < 0, -limits.backward, 0.0))
    stuck = np.flatnonzero(way == 0)
    if len(stuck):
        own = mobility[np.ix_(stuck, stuck)]
        needed = (free - mobility @ forces)[stuck]
        forces[stuck] = _holding(own, needed, limits.held_forward[stuck], limits.held_backward[stuck])
    return np.asarray(forces, dtype=float)


def _holding(own: Array, needed: Array, forward: Array, backward: Array) -> Array:
    """The q with own q = needed; if stuck contacts are linearly dependent, a solution within the levels if possible."""
    values = np.linalg.eigvalsh(own)
    if values[0] > _SINGULAR * values[-1]:
        force = np.asarray(np.linalg.solve(own, needed), dtype=float)
        # A force that is only the rounding error of the others is set to zero: it would make the contact creep.
        tiny = np.abs(np.diag(own) * force) <= _FAINT * (np.abs(own) @ np.abs(force))
        return np.where(tiny, 0.0, force)
    from scipy.optimize import lsq_linear  # its import takes half a second, and is seldom needed

    room = np.finfo(float).tiny
    within = lsq_linear(own, needed, (-backward - room, forward + room), method="bvls", tol=1e-14).x
    if np.max(np.abs(own @ within - needed)) <= ROUNDING * (np.max(np.abs(needed)) + np.finfo(float).tiny):
        return np.asarray(within, dtype=float)
    return np.asarray(np.linalg.lstsq(own, needed, rcond=_SINGULAR)[0], dtype=float)


def _tried(directions: tuple[int, ...], resting: Sequence[int], free: Array, mobility: Array, limits: Limits) -> Mode:
    """The forces, accelerations and margin of a mode, consistent or not."""
    forces = forces_of(directions, free, mobility, limits)
    accelerations = free - mobility @ forces
    sizes = np.abs(free) + np.abs(mobility) @ np.abs(forces) + np.finfo(float).tiny
    margins = [np.inf]
    for c in resting:
        if directions[c]:
            margins.append(directions[c] * accelerations[c] / sizes[c])
        else:
            room = min(limits.held_forward[c] - forces[c], limits.held_backward[c] + forces[c])
            scale = limits.held_forward[c] + limits.held_backward[c] + abs(forces[c]) + np.finfo(float).tiny
            margins += [room / scale, -abs(accelerations[c]) / sizes[c]]
            accelerations[c] = 0.0
    found = np.min(margins)
    return Mode(directions, forces, accelerations, float(found) if np.isfinite(found) or found > 0 else -np.inf)

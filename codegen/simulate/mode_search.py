"""Sticking and sliding of contacts at rest: the consistent mode, found by enumeration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from codegen.base.arrays import Array

ROUNDING = 1e-9
"""What an inequality may miss, relative to the sizes it compares."""
_SINGULAR = 1e-11
_FAINT = 64 * float(np.finfo(np.float64).eps)


class NoMode(Exception):
    """No mode is consistent: something is not finite."""


@dataclass(frozen=True)
class Limits:
    """Levels of each contact, (contacts,), not negative: sliding forward and backward, and at rest."""

    forward: Array
    backward: Array
    held_forward: Array
    held_backward: Array


@dataclass(frozen=True)
class Mode:
    """A consistent mode: the forces obey each contact's law and the slips move as they must.

    Attributes:
        directions: of each contact: 1 slides forward, −1 backward, 0 sticks.
        forces: λ (contacts,). Unique where the stuck contacts are independent, else one of those that hold.
        accelerations: u' (contacts,), exactly zero where a contact sticks.
        margin: the least distance from a broken inequality, relative; −ROUNDING at least.
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
    """The consistent mode of the contacts at rest, from all 3^resting of them; the others slide on.

    A contact that sticks has u' = 0 and λ within its levels at rest; one that begins to slide has u' along its
    direction and λ at its level of sliding. For Coulomb friction and U'M⁻¹U positive definite this is a linear
    complementarity problem of a P-matrix: exactly one acceleration is consistent, and modes that share it differ
    at boundaries only. With a static level above the sliding one several modes may be consistent: a contact at
    rest breaks away only if it must, so that the mode with the most stuck contacts is taken, and of these the one with
    the largest margin.

    Args:
        directions: of each contact; those of ``resting`` are not used.
        resting: contacts with u = 0.
        free: slip accelerations without contact forces, (contacts,).
        mobility: U'M⁻¹U.
        limits: levels at the present state.
        leaving: contacts whose force has just reached a level, and the direction in which they begin to slide.

    Raises:
        NoMode: where none is consistent.

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
    """λ of a mode: the level of sliding where a contact slides, what keeps u' = 0 where it sticks."""
    way = np.asarray(directions)
    forces = np.where(way > 0, limits.forward, np.where(way < 0, -limits.backward, 0.0))
    stuck = np.flatnonzero(way == 0)
    if len(stuck):
        own = mobility[np.ix_(stuck, stuck)]
        needed = (free - mobility @ forces)[stuck]
        forces[stuck] = _holding(own, needed, limits.held_forward[stuck], limits.held_backward[stuck])
    return np.asarray(forces, dtype=float)


def _holding(own: Array, needed: Array, forward: Array, backward: Array) -> Array:
    """q with own q = needed; of many, where stuck contacts depend on each other, one within the levels if there is."""
    values = np.linalg.eigvalsh(own)
    if values[0] > _SINGULAR * values[-1]:
        force = np.asarray(np.linalg.solve(own, needed), dtype=float)
        # A force that is the rounding of its neighbours' is none: what it holds would creep.
        tiny = np.abs(np.diag(own) * force) <= _FAINT * (np.abs(own) @ np.abs(force))
        return np.where(tiny, 0.0, force)
    from scipy.optimize import lsq_linear  # half a second, and seldom needed

    room = np.finfo(float).tiny
    within = lsq_linear(own, needed, (-backward - room, forward + room), method="bvls", tol=1e-14).x
    if np.max(np.abs(own @ within - needed)) <= ROUNDING * (np.max(np.abs(needed)) + np.finfo(float).tiny):
        return np.asarray(within, dtype=float)
    return np.asarray(np.linalg.lstsq(own, needed, rcond=_SINGULAR)[0], dtype=float)


def _tried(directions: tuple[int, ...], resting: Sequence[int], free: Array, mobility: Array, limits: Limits) -> Mode:
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

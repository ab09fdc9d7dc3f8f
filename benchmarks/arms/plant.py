"""A serial arm with Coulomb friction and one further effect; its rigid-body dynamics are MuJoCo's."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import pi, sin

import mujoco
import numpy as np
from numpy.typing import NDArray

from benchmarks.arms.robots import Joint, urdf
from benchmarks.machines.disturbances import FORCES, LEVELS

Array = NDArray[np.float64]
STEP = 1.25e-4
"""s, of the integration."""
SWEEPS, SETTLED = 60, 1e-12
"""Most Gauss–Seidel sweeps for the friction of a step, and the change of an impulse, N m s, at which they end."""


@dataclass(frozen=True)
class Extra:
    """What an effect adds at its joint.

    Attributes:
        force: towards positive positions, of (q, v, w, t) there; w is the drive's force.
        level: added to the Coulomb level, of the same.
    """

    force: Callable[[float, float, float, float], float] = lambda q, v, w, t: 0.0
    level: Callable[[float, float, float, float], float] = lambda q, v, w, t: 0.0


def extra(kind: str, p: Mapping[str, float]) -> Extra:
    """Effects by their equations in docs/effects.md, and ``push``: half a sine of ``width`` s each ``every`` s."""
    values = dict(p)
    if kind in FORCES:
        return Extra(lambda q, v, w, t: FORCES[kind](values, q, v))
    if kind in LEVELS:
        return Extra(level=lambda q, v, w, t: LEVELS[kind](values, t, q, v, w))
    match kind:
        case "viscous_asymmetry":
            return Extra(lambda q, v, w, t: -p["d_b"] * abs(v))
        case "input_gain":
            return Extra(lambda q, v, w, t: (p["gain"] - 1) * w)
        case "push":
            return Extra(lambda q, v, w, t: p["peak"] * sin(pi * min(t % p["every"], p["width"]) / p["width"]))
    raise ValueError(f"no effect {kind}")


@dataclass
class Plant:
    """An arm in motion: M(q) v' = w − h(q, v) − d v + e − λ, with |λ| ≤ level, and λ = level·sgn(v) where v ≠ 0.

    Semi-implicit Euler steps. λ of a step is the solution of its complementarity problem at the step's end, by
    projected Gauss–Seidel, so joints stick. Level and e are those at its start.

    Attributes:
        at: index of the joint with the effect.
    """

    joints: tuple[Joint, ...]
    effect: Extra = field(default_factory=Extra)
    at: int = 0

    def __post_init__(self) -> None:
        self.model = mujoco.MjModel.from_xml_string(urdf("arm", self.joints))
        self.model.dof_armature[:] = [joint.rotor for joint in self.joints]
        self.data = mujoco.MjData(self.model)
        self._damping = np.array([joint.damping for joint in self.joints])
        self._levels = np.array([joint.friction for joint in self.joints])
        n = len(self.joints)
        self._mass, self._bias, self._impulse, self.time = np.zeros((n, n)), np.zeros(n), [0.0] * n, 0.0

    def start(self, q: Array) -> None:
        """Set the positions, with all joints at rest and the time at zero."""
        self.data.qpos[:], self.data.qvel[:], self.time = q, 0.0, 0.0

    def dynamics(self) -> tuple[Array, Array]:
        """M(q) with the rotors, and h(q, v) with gravity, at the present state."""
        model, data = self.model, self.data
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_crb(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 0, self._bias)
        mujoco.mj_fullM(model, data, self._mass)
        return self._mass, self._bias

    def step(self, w: Array) -> None:
        """One step under the forces of the drives."""
        mass, bias = self.dynamics()
        q, v, k = self.data.qpos, self.data.qvel, self.at
        own = float(q[k]), float(v[k]), float(w[k]), self.time
        force, levels = w - bias - self._damping * v, self._levels.copy()
        force[k] += self.effect.force(*own)
        levels[k] = max(0.0, levels[k] + self.effect.level(*own))
        inverse = np.linalg.inv(mass)
        v += STEP * (inverse @ force)
        v -= inverse @ self._friction(inverse, v, STEP * levels)
        q += STEP * v
        self.time += STEP

    def _friction(self, inverse: Array, free: Array, most: Array) -> Array:
        """Impulses of the friction that bring the velocities without it, ``free``, to their values."""
        rows, start, limits, impulse = inverse.tolist(), free.tolist(), most.tolist(), self._impulse
        for _ in range(SWEEPS):
            change = 0.0
            for i, row in enumerate(rows):
                rest = start[i] - sum(a * b for a, b in zip(row, impulse, strict=True)) + row[i] * impulse[i]
                new = min(limits[i], max(-limits[i], rest / row[i]))
                change, impulse[i] = max(change, abs(new - impulse[i])), new
            if change < SETTLED:
                break
        return np.array(impulse)

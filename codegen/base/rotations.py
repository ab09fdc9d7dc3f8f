"""Rotation matrices as quaternions and as angles about fixed axes, in the conventions of URDF, MJCF and USD."""

from math import atan2, pi, sqrt
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from codegen.base.arrays import Array


def of_quaternion(quaternion: Array) -> Array:
    """The rotation of a quaternion w, x, y, z, which need not have unit length."""
    return np.asarray(Rotation.from_quat(np.roll(quaternion, -1)).as_matrix())


def about_axis(axis: Array, angle: float) -> Array:
    """The rotation by an angle, rad, about a unit axis."""
    return np.asarray(Rotation.from_rotvec(angle * axis).as_matrix())


def quaternion(rotation: Array) -> list[float]:
    """(w, x, y, z) of a rotation matrix, with w ≥ 0."""
    return [float(q) for q in np.roll(Rotation.from_matrix(rotation).as_quat(canonical=True), 1)]


def roll_pitch_yaw(r: Any) -> list[float]:
    """[roll, pitch, yaw] of a rotation matrix, rad, about fixed axes x, y, z; for a pitch of ±π/2 the roll is zero.

    Not by SciPy, whose angles give the rotation to 2e-7 only where the pitch is within 1e-7 of ±π/2.
    """
    pitch = atan2(-r[2, 0], sqrt(r[0, 0] ** 2 + r[1, 0] ** 2))
    if abs(abs(pitch) - pi / 2) < 1e-9:
        return [0.0, float(pitch), float(atan2(-r[0, 1], r[1, 1]))]
    return [float(atan2(r[2, 1], r[2, 2])), float(pitch), float(atan2(r[1, 0], r[0, 0]))]

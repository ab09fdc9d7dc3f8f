"""Rotation matrices as quaternions and as angles about fixed axes, in the conventions of URDF, MJCF and USD."""

from __future__ import annotations

from math import atan2, pi, sqrt
from typing import Any

import numpy as np

from codegen.base.arrays import Array


def of_quaternion(quaternion: Array) -> Array:
    """The rotation of a unit quaternion w, x, y, z."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def roll_pitch_yaw(r: Any) -> list[float]:
    """[roll, pitch, yaw] of a rotation matrix, rad, about fixed axes x, y, z; for a pitch of ±π/2 the roll is zero."""
    pitch = atan2(-r[2, 0], sqrt(r[0, 0] ** 2 + r[1, 0] ** 2))
    if abs(abs(pitch) - pi / 2) < 1e-9:
        return [0.0, float(pitch), float(atan2(-r[0, 1], r[1, 1]))]
    return [float(atan2(r[2, 1], r[2, 2])), float(pitch), float(atan2(r[1, 0], r[0, 0]))]


def quaternion(rotation: Any) -> list[float]:
    """(w, x, y, z) of a rotation matrix, by its largest component."""
    r = rotation
    squares = [
        1 + r[0, 0] + r[1, 1] + r[2, 2],
        1 + r[0, 0] - r[1, 1] - r[2, 2],
        1 - r[0, 0] + r[1, 1] - r[2, 2],
        1 - r[0, 0] - r[1, 1] + r[2, 2],
    ]
    largest = int(np.argmax(squares))
    products = np.array(
        [
            [squares[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], squares[1], r[1, 0] + r[0, 1], r[0, 2] + r[2, 0]],
            [r[0, 2] - r[2, 0], r[1, 0] + r[0, 1], squares[2], r[2, 1] + r[1, 2]],
            [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[2, 1] + r[1, 2], squares[3]],
        ]
    )
    return [float(q) for q in products[largest] / (2 * sqrt(squares[largest]))]

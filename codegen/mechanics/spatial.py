"""Spatial vector algebra over CasADi SX, with 6D vectors kept as pairs of 3D ones.

Featherstone, Rigid Body Dynamics Algorithms (2008), chapter 2 and appendix A: a motion vector is (ω, v), a force
vector (n, f), both in body coordinates at the body's origin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi


@dataclass(frozen=True)
class Spatial:
    """A spatial vector: ``angular`` and ``linear``, each 3 by 1 (ω and v of a motion, n and f of a force)."""

    angular: Any
    linear: Any

    def __add__(self, other: Spatial) -> Spatial:
        return Spatial(self.angular + other.angular, self.linear + other.linear)

    def times(self, scalar: Any) -> Spatial:
        """The vector times a scalar."""
        return Spatial(self.angular * scalar, self.linear * scalar)

    def dot(self, other: Spatial) -> Any:
        """Power of a force on a motion."""
        return casadi.dot(self.angular, other.angular) + casadi.dot(self.linear, other.linear)

    def cross_motion(self, m: Spatial) -> Spatial:
        """v × m, (2.31)."""
        return Spatial(cross(self.angular, m.angular), cross(self.angular, m.linear) + cross(self.linear, m.angular))

    def cross_force(self, f: Spatial) -> Spatial:
        """v ×* f, (2.32)."""
        return Spatial(cross(self.angular, f.angular) + cross(self.linear, f.linear), cross(self.angular, f.linear))


@dataclass(frozen=True)
class JointTransform:
    """X from a parent's to a body's coordinates, (2.24): rotation E, body from parent; r, the body's origin in parent.

    Attributes:
        rotation: E, 3 by 3.
        origin: r, 3 by 1, m.
    """

    rotation: Any
    origin: Any

    def motion(self, m: Spatial) -> Spatial:
        """X m: a motion vector in body coordinates."""
        return Spatial(self.rotation @ m.angular, self.rotation @ (m.linear - cross(self.origin, m.angular)))

    def force_to_parent(self, f: Spatial) -> Spatial:
        """X' f: a force vector in parent coordinates."""
        linear = self.rotation.T @ f.linear
        return Spatial(self.rotation.T @ f.angular + cross(self.origin, linear), linear)

    def inertia_to_parent(self, inertia: SpatialInertia) -> SpatialInertia:
        """X' I X: the same body's inertia in parent coordinates (appendix A, rigid-body inertia transforms)."""
        moment = self.rotation.T @ inertia.first_moment
        r, shifted = casadi.skew(self.origin), moment + inertia.mass * self.origin
        turned = self.rotation.T @ inertia.rotational @ self.rotation
        moved = turned - r @ casadi.skew(moment) - casadi.skew(shifted) @ r
        # Symmetric in exact arithmetic: the lower triangle for both, so that half of it is never computed.
        return SpatialInertia(inertia.mass, shifted, casadi.tril2symm(casadi.tril(moved)))


@dataclass(frozen=True)
class SpatialInertia:
    """Of a rigid body, (2.63): mass m, first moment h = m c, and rotational inertia Ī about the frame's origin."""

    mass: Any
    first_moment: Any
    rotational: Any

    def __add__(self, other: SpatialInertia) -> SpatialInertia:
        return SpatialInertia(
            self.mass + other.mass, self.first_moment + other.first_moment, self.rotational + other.rotational
        )

    def times(self, m: Spatial) -> Spatial:
        """I m: the momentum of a motion, or the force of an acceleration."""
        return Spatial(
            self.rotational @ m.angular + cross(self.first_moment, m.linear),
            self.mass * m.linear - cross(self.first_moment, m.angular),
        )


def cross(a: Any, b: Any) -> Any:
    """a × b, 3 by 1."""
    return casadi.vertcat(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])

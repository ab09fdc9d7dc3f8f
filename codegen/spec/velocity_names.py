"""Common names of velocities, for messages on an unknown name."""

from __future__ import annotations

from collections.abc import Mapping

_USUAL = ("{}_dot", "{}dot", "dot_{}", "d{}", "d_{}", "{}_d", "{}_vel", "vel_{}", "v_{}")


def meant_velocity(name: str, velocities: Mapping[str, str]) -> str:
    """The velocity that is probably meant by an unknown name such as ``q_dot``, in words; "" if there is none.

    Args:
        velocities: coordinate → name of its velocity.
    """
    for coordinate, velocity in velocities.items():
        if name in (pattern.format(coordinate) for pattern in _USUAL):
            return f"`{velocity}`: the velocity of {coordinate} is called {velocity}"
    return ""

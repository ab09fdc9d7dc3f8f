"""An input that was computed from the position: what moves the machine is then in no column of the log.

A controller that compensates gravity commands u = f(q). Moved by hand under it, the machine slides to and fro with
friction and inertia that u does not carry. A spring held by a controller gives such an input too; but there what swings
is the inertia against friction, so that no other force is asked for.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from codegen.logs.finding import Finding
from codegen.logs.log import Array
from codegen.spec.model import Spec

KNOTS = 60
COMPUTED = 0.01
"""Of the input's force: what a function of the position leaves of one that was computed from it."""
CARRIED, MATERIAL = 10.0, 0.03
"""Times that, and of both forces: what such a function leaves of the force that the motion takes, where another force
moves the machine."""
SWINGING = 0.5
"""Of what such a function leaves of the inertia's force: what friction explains of it in a free oscillation."""


def audit_position(
    given: Array, inertia: Array, rest: Array, friction: Array, motion: Array, spec: Spec, left_out: frozenset[int]
) -> Iterator[Finding]:
    """What there is to say of inputs that follow a position.

    Args:
        given: (K, n) what the inputs add to g. inertia, rest, friction: (K, n) M a, g(x, v, 0) − U λ, and U λ.
        motion: (K, 2n) positions and velocities. left_out: coordinates of which nothing is to be said.
    """
    n = given.shape[1]
    for i, c in enumerate(spec.coordinates):
        size = float(np.std(given[:, i]))
        if i in left_out or size == 0:
            continue
        columns = np.column_stack([given[:, i], inertia[:, i] - rest[:, i], inertia[:, i], friction[:, i]])
        left = _beside_position(np.column_stack([columns, motion[:, n + i]]), motion[:, i])
        share, taken = (float(np.sqrt(np.mean(y**2))) / size for y in left.T[:2])
        least = max(CARRIED * share, MATERIAL, MATERIAL * float(np.std(columns[:, 1])) / size)
        if share > COMPUTED or taken < least or _swings(left[:, 2], left[:, 3:]):
            continue
        words = (
            f"The force of the inputs on {c.name} is a function of {c.name} alone, to {100 * share:.2g} %, but the "
            f"motion takes {100 * taken:.2g} % that no such function gives. So it was computed from {c.name}, as a "
            "controller does that compensates gravity, and what moves the machine (a hand?) is in no column: "
            "friction, inertia and effects cannot be learnt from this log."
        )
        figures = {"share": share, "taken": taken}
        yield Finding("problem", f"input computed from {c.name}", words, figures)


def _beside_position(columns: Array, x: Array) -> Array:
    """(K, m) columns less their best piecewise linear functions of x, (K,)."""
    knots = np.unique(np.quantile(x, np.linspace(0, 1, KNOTS)))
    if len(knots) < 3:
        return np.asarray(columns - columns.mean(axis=0))
    hats = np.column_stack([np.interp(x, knots, row) for row in np.eye(len(knots))])
    gram = hats.T @ hats + 1e-9 * len(x) / len(knots) * np.eye(len(knots))
    return np.asarray(columns - hats @ np.linalg.solve(gram, hats.T @ columns))


def _swings(inertia: Array, against: Array) -> bool:
    """Whether forces that grow with the speed explain most of the inertia's, (K,)."""
    size = np.linalg.norm(against, axis=0)
    scaled = against[:, size > 0] / size[size > 0]
    left = inertia - scaled @ np.linalg.lstsq(scaled, inertia, rcond=1e-8)[0]
    return bool(left @ left <= (1 - SWINGING) * (inertia @ inertia))

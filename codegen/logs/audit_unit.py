"""Preflight of a coordinate's unit: the one unit in which motion, inputs and model fit together.

Where masses are coupled, a coordinate in another unit disturbs the balance of all, and the balance of another may be
the worse one. So each coordinate is taken in each other usual unit in turn, and named if that alone makes it fit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from codegen.base.errors import Place
from codegen.logs.finding import Finding
from codegen.logs.log import Array
from codegen.logs.motion import Motion
from codegen.spec.column_unit import is_brought
from codegen.spec.model import Spec
from codegen.spec.units import si_factor

UNITS = ("m", "cm", "mm", "um", "rad", "deg", "mrad")
FITS, BETTER = 0.25, 0.5
"""Most misfit with the right unit, and most over that of any other coordinate's and of the numbers as they are."""


def misfit(inertia: Array, rest: Array, given: Array) -> float:
    """Σ(M a − g + U λ)² over the sum of the squares of these forces, the mean over the coordinates; 0 is a balance.

    Args:
        inertia, rest, given: (K, n) M a, g without inputs − U λ, and what the inputs add to g.
    """
    left = np.sum((inertia - rest - given) ** 2, axis=0)
    whole = np.sum(inertia**2 + rest**2 + given**2, axis=0)
    return float(np.mean(left[whole > 0] / whole[whole > 0])) if np.any(whole > 0) else 1.0


def audit_unit(
    spec: Spec, motion: Motion, misfit_of: Callable[[Motion], float], found: Sequence[Finding]
) -> Iterator[Finding]:
    """The coordinate that fits in another unit, if there is one.

    Args:
        misfit_of: of the forces along a motion.
        found: on the scale of coordinates, by the balance of each; what it says of the named one stays in the figures.
    """
    here, tried = Place(""), []
    for j, c in enumerate(spec.coordinates):
        for unit in UNITS:
            if unit != c.unit and is_brought(unit, c.unit):
                factor = float(si_factor(unit, here) / si_factor(c.unit, here))
                tried.append((misfit_of(_scaled(motion, j, factor)), j, unit))
    if not tried:
        return
    least, j, unit = min(tried)
    others = [misfit_of(motion), *(left for left, k, _ in tried if k != j)]
    if least > FITS or least > BETTER * min(others):
        return
    name = spec.coordinates[j].name
    words = (
        f"The scale of {name} seems off: is {name} in {unit}? As {spec.coordinates[j].unit}, motion and inputs leave "
        f"{100 * others[0]:.2g} % of the squared forces unbalanced, as {unit} {100 * least:.2g} %. "
        f"(`units: {{{name}: {unit}}}` in a log description)"
    )
    topic, figures = f"scale of {name}", {"misfit": others[0], "misfit_in_unit": least}
    for one in found:
        if one.topic == topic:
            figures |= one.figures
    yield Finding("problem", topic, words, figures)


def _scaled(motion: Motion, j: int, factor: float) -> Motion:
    """The motion with one coordinate times a factor."""
    by = np.ones(motion.positions.shape[1])
    by[j] = factor
    return replace(
        motion,
        positions=motion.positions * by,
        velocities=motion.velocities * by,
        accelerations=motion.accelerations * by,
        threshold=motion.threshold * by,
    )

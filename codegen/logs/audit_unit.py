"""Preflight of a coordinate's unit: the one unit in which motion, inputs and model fit together.

Where masses are coupled, a coordinate in another unit disturbs the balance of all, and the balance of another may be
the worse one. So each coordinate is taken in each other usual unit in turn, and named if that alone makes it fit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from codegen.base.errors import Place
from codegen.logs.finding import Finding
from codegen.logs.log import Array, Log
from codegen.logs.motion import Motion
from codegen.spec.column_unit import is_brought
from codegen.spec.model import Spec
from codegen.spec.units import si_factor

UNITS = ("m", "cm", "mm", "um", "rad", "deg", "mrad")
SAME, APART = 0.9, 2.0
"""Least correlation of a measured velocity with the position's slope, and the ratio from which on they differ."""
NEAR = 0.05
"""Relative deviation of a ratio from the power of ten that it is taken for."""
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
    spec: Spec,
    motion: Motion,
    misfit_of: Callable[[Motion], float],
    found: Sequence[Finding],
    stated: Mapping[str, str],
    possible: Callable[[int, float], bool],
) -> Iterator[Finding]:
    """The coordinate that fits in another unit, if there is one.

    Args:
        stated: coordinate → the unit that a log description says it is in; SI where it says none.
        possible: whether the factor on the coordinate of an index is one that its inertia allows.
        misfit_of: of the forces along a motion.
        found: on the scale of coordinates, by the balance of each; what it says of the named one stays in the figures.
    """
    tried = []
    for j, c in enumerate(spec.coordinates):
        for unit, factor in _other_units(stated.get(c.name, c.unit)):
            if possible(j, factor):
                tried.append((misfit_of(_scaled(motion, j, factor)), j, unit))
    if not tried:
        return
    least, j, unit = min(tried)
    others = [misfit_of(motion), *(left for left, k, _ in tried if k != j)]
    if least > FITS or least > BETTER * min(others):
        return
    name = spec.coordinates[j].name
    taken = stated.get(name, spec.coordinates[j].unit)
    words = (
        f"The scale of {name} seems off: is {name} in {unit}? As {taken}, motion and inputs leave "
        f"{100 * others[0]:.2g} % of the squared forces unbalanced, as {unit} {100 * least:.2g} %. "
        f"(`units: {{{name}: {unit}}}` in a log description)"
    )
    topic, figures = f"scale of {name}", {"misfit": others[0], "misfit_in_unit": least}
    for one in found:
        if one.topic == topic:
            figures |= one.figures
    yield Finding("problem", topic, words, figures)


def audit_velocity(log: Log, spec: Spec, motion: Motion) -> Iterator[Finding]:
    """Each position against its measured velocity, where both are logged: by how much their scales differ."""
    if log.velocities is None:
        return
    for j, c in enumerate(spec.coordinates):
        said, seen = log.velocities[motion.usable, j], motion.velocities[motion.usable, j]
        sizes = float(np.linalg.norm(said)), float(np.linalg.norm(seen))
        if min(sizes) == 0 or abs(float(said @ seen)) < SAME * sizes[0] * sizes[1]:
            continue
        factor = float(said @ seen) / sizes[0] ** 2
        if 1 / APART < factor < APART:
            continue
        unit = log.description.units.get(c.name, c.unit)
        meant = [other for other, by in _other_units(unit) if abs(by * factor - 1) < NEAR]
        words = (
            f"{c.name} moves {factor:.3g} times as far as the integral of the measured {c.velocity} says: the scale or "
            f"sign of one of the two is off. If it is that of {c.name}: "
        )
        words += f"`units: {{{c.name}: {meant[0]}}}`" if meant else f"`scale: {{{c.name}: {1 / factor:.4g}}}`"
        yield Finding("warning", f"scale of {c.name}", f"{words} in a log description.", {"factor": factor})


def steps_apart(log: Log) -> bool:
    """Whether a position moves in steps that are a power of ten times those that the description says."""
    seen, said = log.intake.smallest_step or (), log.encoder_step or ()
    return any(_is_power_of_ten(a / b) for a, b in zip(seen, said, strict=False) if a > 0 and b > 0)


def _is_power_of_ten(ratio: float) -> bool:
    power = float(np.log10(ratio))
    return round(power) != 0 and abs(power - round(power)) < np.log10(1 + NEAR)


def _other_units(unit: str) -> list[tuple[str, float]]:
    """Each other usual unit of the same kind, and by how much numbers that were read in ``unit`` are multiplied."""
    here = Place("")
    usual = [other for other in UNITS if other != unit and is_brought(other, unit)]
    return [(other, float(si_factor(other, here) / si_factor(unit, here))) for other in usual]


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

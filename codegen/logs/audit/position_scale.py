"""Preflight of a position scale: a position logged as a multiple of the spec's, for example measured before a gear.

If the position is k times too large, q = k x, the machine M a + d v + U λ = u appears in the log as

    (M/k) a_q + (d/k) v_q + U λ = u.

Forces that are linear in position or speed are divided by k; Coulomb levels and constant forces are not. If instead the
input is c times too small, all forces are divided by c:

    (M/c) a + (d/c) v + (U λ)/c = u.

So inertia, damping and springs do not distinguish k from c. Friction levels and constant forces do; a level that is
known to a factor of three, only if k or 1/k is larger than that. A mass that is k times too large differs from both in
damping and springs, if the log shows these.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from codegen.base.arrays import Array
from codegen.base.significant import in_percent
from codegen.logs.audit.force_balance import Balance, Forces, partial_correlation
from codegen.logs.log import Finding, Log
from codegen.logs.motion import Motion, scaled
from codegen.spec.model import Spec

APPARENT = 1.5
"""Least factor, either way, that is reported: a smaller one is an error of a parameter."""
SURE = 3.0
"""Least factor, either way, that is a problem, if friction distinguishes it from a wrong scale of the input."""
SEEN = 0.5
"""Partial correlation of the declared inertia with the input's force from which on its factor is a starting value."""
EXPLAINED, MUCH_LESS = 0.02, 0.25
"""Largest unbalanced share of the squared forces with the factor, and its largest ratio to that without."""
ABOUT, TOLERANCE = 2.0, 1e-3
"""Range of the search about the starting value, either way, and its relative accuracy."""
ALIKE = 2.0
"""Ratio of unbalanced shares up to which two explanations are not distinguished."""
LEVEL_FITS, LEVEL_SEEN = 3.0, 0.15
"""Largest factor on the declared friction, and least partial correlation at which that factor is judged."""
NEAR = 0.05
"""Relative deviation up to which a parameter explains a factor, as a gear ratio."""


@dataclass(frozen=True)
class Explained:
    """The best factor of one explanation.

    Attributes:
        factor: k of the position, c of the input, or the factor by which a mass is too large.
        left: unbalanced share of the squared forces, with the friction level refitted.
        level: factor on the declared friction.
    """

    factor: float
    left: float
    level: float


def position_scales(log: Log, spec: Spec, balance: Balance, motion: Motion, forces: Forces) -> Iterator[Finding]:
    """Findings on the positions that balance the forces much better if they are divided by a factor."""
    for j in range(len(spec.coordinates)):
        found = _scale_of(j, log, spec, balance, motion, forces)
        if found is not None:
            yield found


def _scale_of(j: int, log: Log, spec: Spec, balance: Balance, motion: Motion, forces: Forces) -> Finding | None:
    """The finding on one coordinate; None if no factor balances the forces much better."""
    inertia, seen = forces.inertia_factor(j)
    if seen < SEEN or inertia <= 0 or 1 / APPARENT < inertia < APPARENT:
        return None

    def divided(factor: float) -> Forces:
        return balance.along(log, scaled(motion, j, 1 / factor))

    position = _best(lambda k: _left(divided(k), j), 1 / inertia)
    found, plain = divided(position.factor), _left(forces, j)
    wide = not 1 / APPARENT < position.factor < APPARENT
    explains = position.left <= min(EXPLAINED, MUCH_LESS * plain.left)
    if not (wide and explains and found.misfit < forces.misfit):
        return None
    driving = [i.name for i, force in zip(spec.inputs, forces.driven, strict=True) if np.any(force[:, j])]
    by_input = _best(lambda c: _left(forces, j, given=c), position.factor)
    by_mass = _best(lambda w: _left(forces, j, mass=1 / w), position.factor)
    return _finding(spec, log, j, position, by_input, by_mass, plain, driving, _level_seen(found, j))


def _left(forces: Forces, j: int, given: float = 1.0, mass: float = 1.0) -> Explained:
    """The unbalanced share on coordinate j with the friction level fitted.

    Args:
        given: factor on the input's force.
        mass: factor on the inertia.
    """
    push, inertia, friction = given * forces.given[:, j], mass * forces.inertia[:, j], forces.friction[:, j]
    other = inertia - (forces.rest[:, j] + friction)
    size = float(friction @ friction)
    level = float(friction @ (push - other)) / size if size > 0 else 1.0
    rest = push - other - level * friction
    power = float(push @ push + inertia @ inertia + (other - inertia) @ (other - inertia)) + level**2 * size
    return Explained(1.0, float(rest @ rest) / power if power > 0 else 1.0, level)


def _best(left: Callable[[float], Explained], start: float) -> Explained:
    """The explanation with the least unbalanced share, for a factor within ``ABOUT`` of ``start``."""
    ends = np.log(start) - np.log(ABOUT), np.log(start) + np.log(ABOUT)
    options = {"xatol": TOLERANCE}
    found = minimize_scalar(lambda p: left(float(np.exp(p))).left, bounds=ends, method="bounded", options=options)
    factor = float(np.exp(found.x))
    best = left(factor)
    return Explained(factor, best.left, best.level)


def _level_seen(forces: Forces, j: int) -> bool:
    """Whether the declared friction on coordinate j shows in the input's force."""
    others: Array = np.column_stack([forces.inertia[:, j], forces.motion, np.ones(len(forces.motion))])
    return partial_correlation(forces.given[:, j], forces.friction[:, j], others)[1] > LEVEL_SEEN


def _finding(
    spec: Spec,
    log: Log,
    j: int,
    position: Explained,
    by_input: Explained,
    by_mass: Explained,
    plain: Explained,
    driving: Sequence[str],
    level_seen: bool,
) -> Finding | None:
    """The finding, with the other explanations that the log does not exclude; None if one of these is better."""
    name, k = spec.coordinates[j].name, position.factor
    fits = {"position": _is_near(position.level), "input": _is_near(by_input.level)}
    rivals, excluded = [], ""
    if by_mass.left * ALIKE < position.left:
        return None
    if len(driving) == 1:
        apart = not by_input.left <= ALIKE * position.left
        if by_input.left * ALIKE < position.left or (level_seen and fits["input"] and not fits["position"]):
            return None
        if not apart and not (level_seen and fits["position"] and not fits["input"]):
            line = log.scale_lines({driving[0]: by_input.factor}, spec)
            rivals.append(f"{driving[0]} is {by_input.factor:.3g} times too small ({line})")
        elif not apart:
            excluded = (
                f" If {driving[0]} were {by_input.factor:.3g} times too small instead, it would "
                f"be against {by_input.level:.2g} times the declared friction; now it is {position.level:.2g} times."
            )
    if by_mass.left <= ALIKE * position.left:
        rivals.append(f"the declared inertia is {by_mass.factor:.3g} times too large")
    sure = not rivals and fits["position"] and not 1 / SURE < k < SURE
    gear, ratio = gear_ratio(spec, k)
    side = (
        f"measured on the other side of a gear (the parameter {gear} has this value)"
        if gear
        else "measured before a gear, or in another unit"
    )
    line = log.scale_lines({name: 1 / ratio}, spec)
    words = (
        f"The scale of {name} seems off by a factor of {k:.3g}. As read, {in_percent(plain.left)} of the squared "
        f"forces stay unbalanced; divided by it, with the declared inertia, {in_percent(position.left)}. "
        f"Is it {side}? ({line} in meta.yaml beside the log){excluded}"
    )
    if rivals:
        words += f" This log cannot tell that from another cause: {'; or '.join(rivals)}."
    figures = {"factor": k, "level": position.level, "misfit": plain.left, "misfit_scaled": position.left}
    return Finding("problem" if sure else "warning", f"scale of {name}", words, figures)


def _is_near(level: float) -> bool:
    """Whether a factor on the declared friction is within its uncertainty."""
    return 1 / LEVEL_FITS < level < LEVEL_FITS


def gear_ratio(spec: Spec, factor: float) -> tuple[str, float]:
    """The dimensionless parameter whose value or inverse is near a factor, and this ratio; else "" and the factor."""
    for p in spec.parameters:
        if p.unit in ("", "1") and p.value:
            for ratio in (float(p.value), 1 / float(p.value)):
                if abs(ratio / factor - 1) < NEAR:
                    return p.name, ratio
    return "", factor

"""Preflight of signs: the positions, velocities or inputs whose signs must be reversed for the forces to balance.

With the position q = −x and the right force u, the machine M a + d v + U λ − g(x) = u appears in the log as

    M a_q + d v_q + U λ + g(−q) = −u.

If g is odd, as without gravity or with a spring about zero, this is the machine with the input reversed, and a log
cannot distinguish a flipped position from a flipped input. With a weight, or a spring about another position, it can.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from codegen.base.significant import in_percent
from codegen.logs.audit.exchanged_columns import (
    BETTER,
    FAR_BETTER,
    FITS,
    NEARLY,
    UNSURE,
    forces_of,
    values_of,
    velocity_mismatch,
    with_values,
)
from codegen.logs.audit.force_balance import Balance, Forces
from codegen.logs.log import Finding, Log
from codegen.logs.motion import Motion
from codegen.spec.model import Spec

IN_PAIRS = 6
"""Most coordinates and inputs of which two are reversed together."""
MOST_ALIKE = 4
"""Most explanations that are reported as alternatives."""
Flipped = tuple[str, ...]
"""Positions, velocities and inputs whose signs are reversed."""
POSITION_FORCES: Flipped = ("gravity and springs",)
"""The forces of the spec that depend on positions alone; their wrong sign is a mistake in the spec, not the log."""


def flipped_signs(log: Log, spec: Spec, balance: Balance, motion: Motion, forces: Forces) -> Iterator[Finding]:
    """A finding on the variables whose signs must be reversed for the forces to balance; none if they do as read."""
    slopes = velocity_mismatch(log, motion)
    now = max(forces.moving_misfit, slopes)
    if now <= NEARLY or log.intake.doubted:
        return
    names, values = values_of(log, spec)
    tried = []
    for count, group in _explanations(spec, log.velocities is not None, pairs=now > FITS):
        signs = np.array([-1.0 if name in group else 1.0 for name in names])
        found = forces_of(with_values(log, values * signs), balance)
        if found is not None:
            tried.append((max(found[0].moving_misfit, found[1]), count, group))
    if np.any(forces.static):
        other = replace(forces, rest=forces.rest - 2 * forces.static, static=-forces.static)
        tried.append((max(other.moving_misfit, slopes), 1, POSITION_FORCES))
    best = min((left for left, _, _ in tried), default=1.0)
    if best > (min(FITS, BETTER * now) if now > FITS else FAR_BETTER * now):
        return
    alike = [(count, group, left) for left, count, group in tried if left <= UNSURE * best]
    fewest = min(count for count, _, _ in alike)
    named = [(group, left) for count, group, left in alike if count == fewest]
    if len(named) > MOST_ALIKE or (len(named) > 1 and POSITION_FORCES in dict(named)):
        return  # a force of the spec may be wrong: the audit of the inputs reports which forces show in the log
    others = [(left, group) for left, count, group in tried if count == fewest and left > UNSURE * best]
    yield _finding(log, spec, named, min(others, default=None), now)


def _explanations(spec: Spec, velocities: bool, pairs: bool) -> list[tuple[int, Flipped]]:
    """The groups that may be flipped, each with the number of mistakes behind it; a coordinate is one mistake."""
    coordinates: list[Flipped] = [(c.name, c.velocity) if velocities else (c.name,) for c in spec.coordinates]
    inputs: list[Flipped] = [(i.name,) for i in spec.inputs]
    alone = [(name,) for names in coordinates for name in names] if velocities else []
    singles = [*inputs, *coordinates, *alone, *(sum(all_of, ()) for all_of in (inputs, coordinates) if len(all_of) > 1)]
    found = dict.fromkeys(singles, 1)
    if pairs and len(coordinates) + len(inputs) <= IN_PAIRS:
        for a, b in combinations([*inputs, *coordinates], 2):
            found.setdefault(a + b, 2)
    return [(count, group) for group, count in found.items()]


def _finding(
    log: Log, spec: Spec, named: Sequence[tuple[Flipped, float]], other: tuple[float, Flipped] | None, now: float
) -> Finding:
    """The finding.

    Args:
        named: the explanations with the least misfit, each with it.
        other: the best of the other explanations.
        now: the misfit as read.
    """
    least = min(left for _, left in named)
    variables = [_in_words(group, log, spec) for group, _ in named]
    mended = [dict.fromkeys(group, -1.0) for group, _ in named if group != POSITION_FORCES]
    lines = " or ".join(log.scale_lines(factors, spec) for factors in mended)
    which = f"{variables[0]} seems flipped" + "".join(f", or that of {one}" for one in variables[1:])
    rival = (
        f"; with {_in_words(other[1], log, spec)} reversed, {in_percent(other[0])}" if other and len(named) == 1 else ""
    )
    words = (
        f"The sign of {which}: as read, {in_percent(now)} of the squares stay unbalanced; reversed, "
        f"{in_percent(least)}{rival}. "
    )
    if len(named) > 1:
        words += (
            "This log cannot decide which: the forces of the spec fit either. A push by hand in the direction that the "
            f"drawing calls positive shows the sign of {_positions(named, spec)}. "
        )
    if named[0][0] == POSITION_FORCES:
        words += "Check them in the spec, or the zero of a position (a pendulum's may be half a turn off)."
    else:
        words += f"({lines} in meta.yaml beside the log)"
    inputs = [i.name for i in spec.inputs if any(i.name in group for group, _ in named)]
    topic = f"sign and scale of {inputs[0]}" if inputs else f"sign of {named[0][0][0]}"
    return Finding("problem", topic, words, {"misfit": now, "misfit_mended": least})


def _positions(named: Sequence[tuple[Flipped, float]], spec: Spec) -> str:
    """The positions of the explanations, in words."""
    return " and ".join(c.name for c in spec.coordinates if any(c.name in group for group, _ in named))


def _in_words(group: Flipped, log: Log, spec: Spec) -> str:
    """The flipped variables in words; a coordinate is a position with its velocity."""
    if group == POSITION_FORCES:
        return "gravity and springs"
    inputs = [i.name for i in spec.inputs if i.name in group]
    both = [c.name for c in spec.coordinates if c.name in group and (c.velocity in group or log.velocities is None)]
    positions = [c.name for c in spec.coordinates if c.name in group and c.name not in both]
    velocities = [c.velocity for c in spec.coordinates if c.velocity in group and c.name not in group]
    kinds = {"input": inputs, "the coordinate": both, "the position": positions, "the velocity": velocities}
    return " and ".join(
        f"{kind}{'s' * (len(names) > 1)} {' and '.join(names)}" for kind, names in kinds.items() if names
    )

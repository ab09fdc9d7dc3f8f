"""Forces that no target has as elements: their mean over the envelope is held, and the rest is the error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import sympy

from codegen.export.mechanism import Direction, Leftover, Line, LineFriction, Mechanism
from codegen.export.region import Region
from codegen.export.remarks import Remark
from codegen.mechanics.system import System

NEGLIGIBLE = 0.05
"""A mean below this share of the force's root mean square is the chance of the sampled points."""


def with_means(mechanism: Mechanism, region: Region, remarks: list[Remark]) -> Mechanism:
    """The mechanism with the means of its leftovers as elements; what that costs is added to ``remarks``."""
    lines = {line.direction: replace(line, frictions=list(line.frictions)) for line in mechanism.lines}
    for leftover in mechanism.leftovers:
        remarks.append(_take(leftover, lines, mechanism.system, region))
    return replace(mechanism, lines=tuple(lines.values()), leftovers=())


def _take(leftover: Leftover, lines: dict[Direction, Line], system: System, region: Region) -> Remark:
    values = region.sampled(leftover.force, leftover.direction)
    finite = values[np.isfinite(values)]
    mean = float(finite.mean()) if len(finite) else 0.0
    if abs(mean) < NEGLIGIBLE * float(np.sqrt(np.mean(finite**2))) or (leftover.friction and mean < 0):
        mean = 0.0
    line = lines.setdefault(leftover.direction, Line(leftover.direction))
    if leftover.friction and mean:
        line.frictions.append(LineFriction(leftover.friction, "a mean", sympy.Float(mean), None, False))
    elif mean:
        line.constant += mean
    unit = unit_along(system, leftover.direction)
    over = over_assumed(region, {s for s in leftover.force.free_symbols if isinstance(s, sympy.Symbol)})
    kept = f"its mean over the envelope, {mean:.4g} {unit}, is held" if mean else "nothing is near"
    return Remark.costing(
        leftover.where,
        "nearest" if mean else "dropped",
        f"{_shown(leftover.force)} along {combination(leftover.direction, system)} is no element here; {kept}{over}",
        finite - mean,
        unit,
    )


def over_assumed(region: Region, names: set[sympy.Symbol]) -> str:
    """In words, the ranges of these symbols that the spec's envelope does not give; empty where it gives all."""
    assumed = region.said(names)
    return f" (over {', '.join(assumed)}, assumed: the envelope says nothing of it)" if assumed else ""


def unit_along(system: System, direction: Direction) -> str:
    """The unit of a force along a line: that of the first coordinate in it."""
    return system.force_unit(next((i for i, c in enumerate(direction) if c), 0))


def combination(direction: Direction, system: System) -> str:
    """A line in words: ``x``, ``x2 - x1``."""
    names = [x.name for x in system.positions]
    parts = []
    for c, name in sorted(zip(direction, names, strict=True), key=lambda part: -part[0]):
        if c:
            size = "" if abs(c) == 1 else f"{abs(c):.6g}*"
            parts.append(f"{'-' if c < 0 else '+'} {size}{name}")
    return " ".join(parts).removeprefix("+ ")


def _shown(expression: sympy.Expr) -> str:
    """With six digits of each number; ``s`` is the slip speed."""
    fractions = {r: sympy.Float(r, 6) for r in expression.atoms(sympy.Rational) if not r.is_Integer}
    return str(sympy.sstr(expression.xreplace(fractions)))

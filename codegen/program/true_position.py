"""Correction of a declared sensor error in the generated code: the true position from the measured one."""

from __future__ import annotations

from typing import Any

import casadi
import sympy

from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import System
from codegen.program.model import Block

STEPS = 4
"""Newton steps; with |η'| < 1/2, required by the catalogue, the remaining error is below 1e-13 of the period."""


def true_positions(system: System, names: dict[sympy.Symbol, Any]) -> list[Block]:
    """A block for each sensor with an error; the true position replaces the position's symbol in ``names``.

    x_measured = x + η(x) is solved for x by Newton's method, starting at x_measured − η(x_measured).
    """
    blocks = []
    for x, unit in zip(system.positions, system.position_units, strict=True):
        error = system.sensor_errors.get(x)
        if error is None:
            continue
        reading, slope = names[x], error.diff(x)
        found = reading - to_casadi(error, names)
        for _ in range(STEPS):
            here = {**names, x: found}
            found = found - (found + to_casadi(error, here) - reading) / (1 + to_casadi(slope, here))
        names[x] = casadi.SX.sym(f"{x}_true")
        blocks.append(Block("true_position", (f"{x}_true",), names[x], found, (unit,), "x_measured = x + eta(x)"))
    return blocks

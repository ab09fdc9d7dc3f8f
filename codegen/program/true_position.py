"""The true position behind a sensor that reads wrong, in the generated code."""

from __future__ import annotations

from typing import Any

import casadi
import sympy

from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import System
from codegen.program.model import Block

STEPS = 4
"""Of Newton's method; with |η'| < 1/2, which the catalogue demands, what is left is below 1e-13 of the period."""


def true_positions(system: System, names: dict[sympy.Symbol, Any]) -> list[Block]:
    """A block for each wrong sensor; from now on the position's symbol stands for the true one in ``names``.

    x_measured = x + η(x) is solved for x, from x_measured − η(x_measured) on.
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

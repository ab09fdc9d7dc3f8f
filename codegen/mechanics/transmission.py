"""A spring between a motor and its load, with play or without: one coordinate becomes two."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import sympy

from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol

if TYPE_CHECKING:
    from codegen.mechanics.system import System


@dataclass(frozen=True)
class Transmission:
    """Between the motor, whose position is the coordinate, and its load.

    Attributes:
        coordinate: index of the motor's position; encoder, inputs, damping and contacts are at the motor.
        stiffness, damping: k, c.
        load_fraction: ρ: ρM at the load, (1 − ρ)M at the motor.
        gap: full width of the play; 0 for none.
    """

    coordinate: int
    stiffness: sympy.Expr
    damping: sympy.Expr
    load_fraction: sympy.Expr
    gap: sympy.Expr = sympy.S.Zero

    def force(self, deflection: sympy.Expr, rate: sympy.Expr) -> sympy.Expr:
        """What pulls the motor back and the load on, at dx = x − x_load and its rate.

        With play: sgn(dx) max(0, k p + c p') where p = |dx| − gap/2 > 0, else none.
        """
        if self.gap == 0:
            return self.stiffness * deflection + self.damping * rate
        side, depth = Sgn(deflection), Magnitude(deflection) - self.gap / 2
        push = self.stiffness * depth + self.damping * side * rate
        return side * (1 + Sgn(depth)) / 2 * (push + Magnitude(push)) / 2


def with_loads(system: System) -> System:
    """The system with a coordinate more for each load, behind all others; the system itself where there is none.

    Declared forces on the coordinate that depend on neither velocity nor input act at the load.
    """
    for transmission in system.transmissions:
        system = _with_load(system, transmission)
    return replace(system, transmissions=())


def _with_load(system: System, transmission: Transmission) -> System:
    i = transmission.coordinate
    x, v = system.positions[i], system.velocities[i]
    x_load, v_load = symbol(f"{x}_load"), symbol(f"{v}_load")
    share = transmission.load_fraction
    mass = sympy.diag(system.mass_matrix, share * system.mass_matrix[i, i])
    mass[i, i] = (1 - share) * system.mass_matrix[i, i]
    still = system.force[i].subs(dict.fromkeys((*system.inputs, *system.velocities), 0))
    between = transmission.force(x - x_load, v - v_load)
    force = sympy.Matrix([*system.force, still.subs(x, x_load) + between])
    force[i] += -still - between
    return replace(
        system,
        positions=(*system.positions, x_load),
        velocities=(*system.velocities, v_load),
        position_units=(*system.position_units, system.position_units[i]),
        mass_matrix=sympy.ImmutableMatrix(mass),
        force=sympy.ImmutableMatrix(force),
        distribution=sympy.ImmutableMatrix(system.distribution.col_join(sympy.zeros(1, len(system.contacts)))),
    )

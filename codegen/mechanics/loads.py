"""Two-mass form of compliant axes: a coordinate with a transmission becomes a motor and a load coordinate."""

from __future__ import annotations

from dataclasses import replace

import sympy

from codegen.mechanics.system import System
from codegen.mechanics.transmission import Transmission
from codegen.spec.model import symbol


def with_loads(system: System) -> System:
    """The system in two-mass form: for each transmission a load coordinate x_load is appended.

    The load has the inertia ρ M_ii, the motor (1 − ρ) M_ii, and the transmission's force acts between them. Declared
    forces on the coordinate that depend on neither velocity nor input, such as gravity, act at the load; forces that
    effects add, such as cogging, act at the motor.
    """
    for transmission in system.transmissions:
        system = _with_load(system, transmission)
    return replace(system, transmissions=())


def _with_load(system: System, transmission: Transmission) -> System:
    """The system with the load coordinate of one transmission."""
    i = transmission.coordinate
    x, v = system.positions[i], system.velocities[i]
    x_load, v_load = symbol(f"{x}_load"), symbol(f"{v}_load")
    share = transmission.load_fraction
    mass = sympy.diag(system.mass_matrix, share * system.mass_matrix[i, i])
    mass[i, i] = (1 - share) * system.mass_matrix[i, i]
    still = system.declared_force[i].subs(dict.fromkeys((*system.inputs, *system.velocities), 0))
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

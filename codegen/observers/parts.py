"""Equations shared by all observers: slip, known friction, acceleration."""

from collections.abc import Sequence

import sympy

from codegen.mechanics.system import Matrix, System
from codegen.observers.equations import Equation, ErrorOf, ErrorVariable
from codegen.spec.functions import Sgn
from codegen.spec.model import symbol


def vector(prefix: str, names: list[str]) -> Matrix:
    """A column of symbols prefix_name."""
    return Matrix([symbol(f"{prefix}_{name}") for name in names])


def contact_names(system: System) -> list[str]:
    """Names of the contacts."""
    return [c.name for c in system.contacts]


def velocity_units(system: System) -> tuple[str, ...]:
    """Units of the velocities."""
    return tuple(f"{unit}/s" for unit in system.position_units)


def contact_units(system: System) -> tuple[str, ...]:
    """Units of the friction forces at the contacts."""
    return tuple(c.unit for c in system.contacts)


def force_units(system: System) -> tuple[str, ...]:
    """Units of the forces on the coordinates."""
    return tuple(system.force_unit(i) for i in range(system.degrees_of_freedom))


def slip_equations(system: System, velocity: Matrix) -> tuple[Equation, Equation]:
    """Slip velocities û = U' v̂ and their signs, S of (4.13)."""
    names = contact_names(system)
    slip, sign = vector("slip", names), vector("sign", names)
    slips = Equation(
        "slip_velocity",
        slip,
        Matrix(system.distribution.T * velocity),
        tuple(f"{c.slip_unit}/s" for c in system.contacts),
        "U' v, (4.5)",
    )
    signs = Equation("slip_sign", sign, Matrix([Sgn(u) for u in slip]), ("1",) * len(names), "(4.13)")
    return slips, signs


def times(a: Matrix, b: Matrix) -> Matrix:
    """diag(a) b."""
    return Matrix([p * q for p, q in zip(a, b, strict=True)])


def per(unit: str, *below: str) -> str:
    """A unit divided by others; divisors "1" are omitted, and so is a leading factor "1*"."""
    divisors = [u for u in below if u != "1"]
    plain = unit.removeprefix("1*")
    return "/".join([plain, *(u if "/" not in u and "*" not in u else f"({u})" for u in divisors)])


def slip_rate(system: System, velocity: Matrix, acceleration: Matrix) -> Matrix:
    """d(U'v)/dt = U' v' + (dU/dt)' v; the thesis omits the second term, which is zero for constant U."""
    distribution = sympy.Matrix(system.distribution)
    rate = sympy.zeros(*distribution.shape)
    moving = distribution.free_symbols
    for x, v in zip(system.positions, velocity, strict=True):
        if x in moving:
            rate += distribution.diff(x) * v
    return Matrix(distribution.T * acceleration + rate.T * velocity)


def friction_equations(system: System, slip: Equation, law_force: Matrix, source: str) -> list[Equation]:
    """Equations of the known friction of declared effects, of F̂ at the contacts, and of U F̂ on the coordinates.

    ``law_force``: estimated contact forces without the known friction.
    """
    equations = []
    if has_declared_friction(system):
        equations.append(declared_friction(system, slip.symbols))
        law_force = Matrix(law_force + equations[0].symbols)
    names, units = contact_names(system), contact_units(system)
    contact = Equation("contact_friction", vector("F_hat", names), law_force, units, source, output=True)
    return [*equations, contact, force_equation(system, Matrix(system.distribution * contact.symbols), source)]


def force_equation(system: System, force: Matrix, source: str) -> Equation:
    """The estimated generalised friction force on the coordinates."""
    estimate = vector("F_hat_on", [x.name for x in system.positions])
    return Equation("friction_force", estimate, force, force_units(system), source, output=True)


def declared_friction(system: System, slip: Matrix) -> Equation:
    """Equation of the contact forces of declared effects, which are known and not estimated."""
    known = system.known_friction(slip)
    return Equation(
        "known_friction", vector("known", contact_names(system)), known, contact_units(system), "declared effects"
    )


def has_declared_friction(system: System) -> bool:
    """Whether declared effects add friction at a contact."""
    return any(c.known_force != 0 for c in system.contacts)


def acceleration_equation(system: System, velocity: Matrix, friction: Matrix) -> Equation:
    """M(x) a = g(x, v̂, w) − F̂, with the estimated generalised friction ``friction``."""
    force = system.force.xreplace(dict(zip(system.velocities, velocity, strict=True)))
    symbols = Matrix([symbol(f"{v.name}_dot_hat") for v in system.velocities])
    units = tuple(f"{unit}/s^2" for unit in system.position_units)
    return Equation("acceleration", symbols, Matrix(force - friction), units, "(4.2)", form="mass_solve")


def errors_of(
    of: ErrorOf, truth: str, estimate: str, names: Sequence[str], units: Sequence[str], by_contact: bool = True
) -> tuple[ErrorVariable, ...]:
    """The errors truth_NAME − estimate_NAME of all contacts, or of all coordinates."""
    return tuple(
        ErrorVariable(
            symbol(f"e_{truth}_{name}"),
            symbol(f"{truth}_{name}"),
            of,
            k if by_contact else None,
            None if by_contact else k,
            f"{truth}_{name} - {estimate}_{name}",
            unit,
        )
        for k, (name, unit) in enumerate(zip(names, units, strict=True))
    )

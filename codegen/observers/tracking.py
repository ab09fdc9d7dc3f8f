"""TO, GTO and MGTO, disturbance observers: friction is estimated as an unknown constant input force."""

import sympy

from codegen.mechanics.system import Matrix, System
from codegen.observers import parts
from codegen.observers.equations import Cascade, Equation, Observer, ObserverKind
from codegen.observers.gains import read_gain
from codegen.observers.velocity import States, velocity_of
from codegen.spec.model import Spec


def tracking_observer(spec: Spec, system: System) -> Observer:
    """TO (2.9)–(2.10), (3.11)–(3.12), GTO (4.16)–(4.17), (4.33) and MGTO (5.14)–(5.15).

    F̂ = z + K_1 x + K_2 v̂,  dz/dt = −K_1 v̂ − K_2 M⁻¹[g − F̂], with F̂ the (n,) forces on the coordinates. An MGTO
    estimates the contact forces instead, and U F̂ takes the place of F̂ in the bracket.

    Friction of declared effects, λ_d(û), is known: the bracket then also contains −U λ_d, and z + K_1 x + K_2 v̂ (the
    output ``tracked``) estimates the remaining friction. ``F_hat`` of an MGTO is the sum of both. Raises BadInput for
    gains of wrong shape or sign.
    """
    choice = spec.required_observer
    by_contact = KINDS[choice.kind].by_contact
    positions = [x.name for x in system.positions]
    names = parts.contact_names(system) if by_contact else positions
    units = parts.contact_units(system) if by_contact else parts.force_units(system)
    velocity = velocity_of(spec, choice, system)
    square = len(names) == len(positions)
    first = read_gain(spec, choice, "K_1", names, positions, optional=square)
    second = read_gain(spec, choice, "K_2", names, positions, sign=0 if velocity.estimated or by_contact else -1)

    state = parts.vector("z", names)
    tracked = Equation(
        "tracked_friction",
        parts.vector("tracked", names),
        Matrix(state + first.matrix * system.x + second.matrix * velocity.symbols),
        units,
        "(5.14)" if by_contact else "(4.16)",
        state=state,
        output=True,
    )
    onto = Matrix(system.distribution) if by_contact else Matrix(sympy.eye(len(positions)))
    equations, estimate = [tracked], tracked.symbols
    force = Matrix(onto * estimate)
    if parts.has_declared_friction(system):
        slip, _ = parts.slip_equations(system, velocity.symbols)
        known = parts.declared_friction(system, slip.symbols)
        equations += [slip, known]
        force = Matrix(force + system.distribution * known.symbols)
        estimate = Matrix(estimate + known.symbols) if by_contact else estimate
    if by_contact:
        hats = parts.vector("F_hat", names)
        equations.append(Equation("contact_friction", hats, estimate, units, "(5.14)", output=True))
    total = parts.force_equation(system, force, "(4.16)")
    acceleration = parts.acceleration_equation(system, velocity.symbols, total.symbols)
    equations += [total, acceleration]

    rates = -first.matrix * velocity.symbols - second.matrix * acceleration.symbols
    initial = -first.matrix * system.x - second.matrix * velocity.known
    errors = parts.errors_of("force", "F", "tracked", names, units, by_contact)
    q = system.position_units
    gain_units = first.units(units, [f"/{unit}" for unit in q]) | second.units(units, [f"*s/{unit}" for unit in q])
    cascade = Cascade(Matrix(-second.matrix), onto, onto, velocity.matrix, "-K_2", "-K_2 M^-1")
    return velocity.observer(
        choice,
        equations,
        States(state, units, rates, initial),
        errors,
        onto * Matrix([e.truth for e in errors]),
        (first, second),
        gain_units,
        level_errors=False,
        cascade=None if by_contact else cascade,
    )


GAINS = ("K_1", "K_2", "K_v")
KINDS = {
    "to": ObserverKind(tracking_observer, GAINS, general="gto", by_contact=False),
    "gto": ObserverKind(tracking_observer, GAINS, by_contact=False),
    "mgto": ObserverKind(tracking_observer, GAINS),
}

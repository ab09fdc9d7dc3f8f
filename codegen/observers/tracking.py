"""TO, GTO and MGTO (disturbance observers): friction is an unknown constant input, and the force is estimated."""

from __future__ import annotations

import sympy

from codegen.mechanics.system import Matrix, System
from codegen.observers import parts
from codegen.observers.equations import Cascade, Equation, ErrorVariable, Observer
from codegen.observers.gains import read_gain, refuse_unknown_gains
from codegen.observers.velocity import velocity_of
from codegen.spec.model import Spec, symbol


def tracking_observer(spec: Spec, system: System) -> Observer:
    """TO (2.9)–(2.10), (3.11)–(3.12), GTO (4.16)–(4.17), (4.33) and MGTO (5.14)–(5.15).

    F̂ = z + K_1 x + K_2 v̂,  dz/dt = −K_1 v̂ − K_2 M⁻¹[g − F̂]; for the MGTO F̂ are the contact forces and U F̂ acts.

    Raises:
        BadInput: for gains of wrong shape or sign.
    """
    choice = spec.observer
    assert choice is not None
    refuse_unknown_gains(spec, choice, ("K_1", "K_2", "K_v"))
    by_contact = choice.kind == "mgto"
    positions = [x.name for x in system.positions]
    names = parts.contact_names(system) if by_contact else positions
    units = parts.contact_units(system) if by_contact else parts.force_units(system)
    velocity = velocity_of(spec, choice, system)
    square = len(names) == len(positions)
    first = read_gain(spec, choice, "K_1", names, positions, optional=square)
    second = read_gain(spec, choice, "K_2", names, positions, sign=0 if velocity.estimated or by_contact else -1)
    values = first.values | second.values | velocity.values
    equations = [*velocity.equations]

    state = Matrix([symbol(f"z_{name}") for name in names])
    tracked = Equation(
        "tracked_friction",
        parts.vector("tracked", names),
        Matrix(state + first.matrix * system.x + second.matrix * velocity.symbols),
        units,
        "(5.14)" if by_contact else "(4.16)",
        state=state,
        output=True,
    )
    equations.append(tracked)
    contact_force = tracked.symbols if by_contact else None
    force = Matrix(system.distribution * tracked.symbols) if by_contact else tracked.symbols
    if parts.has_declared_friction(system):
        slip, _ = parts.slip_equations(system, velocity.symbols)
        known = parts.declared_friction(system, slip.symbols)
        equations += [slip, known]
        force = Matrix(force + system.distribution * known.symbols)
        contact_force = Matrix(contact_force + known.symbols) if contact_force is not None else None
    if contact_force is not None:
        equations.append(
            Equation("contact_friction", parts.vector("F_hat", names), contact_force, units, "(5.14)", output=True)
        )
    total = Equation(
        "friction_force", parts.vector("F_hat_on", positions), force, parts.force_units(system), "(4.16)", output=True
    )
    acceleration = parts.acceleration_equation(system, velocity.symbols, total.symbols)
    equations += [total, acceleration]

    rates = -first.matrix * velocity.symbols - second.matrix * acceleration.symbols
    known_velocity = sympy.zeros(len(positions), 1) if velocity.estimated else system.v
    initial = -first.matrix * system.x - second.matrix * known_velocity
    states = velocity.with_own(acceleration.symbols, state, units, rates, initial)

    truths = [symbol(f"F_{name}") for name in names]
    errors = tuple(
        ErrorVariable(
            symbol(f"e_F_{name}"),
            truth,
            "force",
            k if by_contact else None,
            None if by_contact else k,
            f"F_{name} - tracked_{name}",
            unit,
        )
        for k, (name, truth, unit) in enumerate(zip(names, truths, units, strict=True))
    )
    truth_force = system.distribution * Matrix(truths) if by_contact else Matrix(truths)
    q = system.position_units
    gain_units = first.units(units, [f"/{unit}" for unit in q]) | second.units(units, [f"*s/{unit}" for unit in q])
    return Observer(
        kind=choice.kind,
        velocity=choice.velocity,
        system=system,
        equations=tuple(equations),
        states=states.symbols,
        state_units=states.units,
        rates=states.rates,
        initial=states.initial,
        errors=velocity.errors + errors,
        true_friction=Matrix(truth_force),
        signs=tuple(symbol(f"s_{c.name}") for c in system.contacts),
        gains=values,
        gain_units={s: gain_units.get(s, "1/s") for s in values},
        sample_time=choice.sample_time,
        level_errors=False,
        cascade=None
        if by_contact
        else Cascade(
            Matrix(-second.matrix),
            Matrix(sympy.eye(len(names))),
            Matrix(sympy.eye(len(names))),
            velocity.gain,
            "-K_2",
            "-K_2 M^-1",
        ),
    )

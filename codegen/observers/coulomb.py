"""CFO and GCFO: friction as an unknown level times the sign of slip; the level is estimated."""

from __future__ import annotations

import sympy

from codegen.errors import BadInput
from codegen.mechanics.system import Matrix, System
from codegen.observers import parts
from codegen.observers.equations import Equation, ErrorVariable, Observer
from codegen.observers.gains import read_gain, refuse_unknown_gains
from codegen.spec.functions import Magnitude
from codegen.spec.model import Spec, symbol

LARGEST_EXPONENT = 8


def coulomb_friction_observer(spec: Spec, system: System) -> Observer:
    """CFO (2.6)–(2.8), (3.8)–(3.10) and GCFO (4.10)–(4.15), (4.27)–(4.28), with h(|u|) = |u|^μ.

    â = z_F − K_F h(|û|),  F̂ = U S â,  dz_F/dt = K_F D S U' M⁻¹[g − F̂],  D = diag(μ |û|^(μ−1)).

    Raises:
        BadInput: for gains of wrong shape or sign, or an exponent that is not positive or above 8.
    """
    choice = spec.observer
    assert choice is not None
    if not 0 < choice.exponent <= LARGEST_EXPONENT:
        wanted = f"a positive number up to {LARGEST_EXPONENT}"
        raise BadInput(spec.place("observer.exponent"), f"exponent {choice.exponent}", wanted)
    refuse_unknown_gains(spec, choice, ("K_F", "K_v"))
    names, velocities = parts.contact_names(system), parts.velocity_names(system)
    friction_gain = read_gain(spec, choice, "K_F", names, names, sign=1)
    estimated = choice.velocity == "estimated"
    equations: list[Equation] = []
    states, rates, initial, units = [], [], [], []
    values = dict(friction_gain.values)

    if estimated:
        velocity_gain = read_gain(spec, choice, "K_v", velocities, velocities, sign=1)
        values |= velocity_gain.values
        equations.append(parts.velocity_estimate(system, velocity_gain.matrix))
        velocity = equations[-1].symbols
    else:
        velocity = system.v

    slip, sign = parts.slip_equations(system, velocity)
    equations += [slip, sign]
    mu = choice.exponent
    speed = Matrix([Magnitude(u) ** mu for u in slip.symbols])
    state = Matrix([symbol(f"z_{name}") for name in names])
    level = Equation(
        "friction_level",
        parts.vector("a_hat", names),
        Matrix(state - friction_gain.matrix * speed),
        parts.contact_units(system),
        "(4.11)",
        state=state,
        output=True,
    )
    law_force = Matrix([s * a for s, a in zip(sign.symbols, level.symbols, strict=True)])
    equations.append(level)
    if parts.has_declared_friction(system):
        known = parts.declared_friction(system, slip.symbols)
        equations.append(known)
        law_force = Matrix(law_force + known.symbols)
    contact = Equation(
        "contact_friction", parts.vector("F_hat", names), law_force, parts.contact_units(system), "(4.10)", output=True
    )
    force = Equation(
        "friction_force",
        parts.vector("F_hat_on", [x.name for x in system.positions]),
        Matrix(system.distribution * contact.symbols),
        parts.force_units(system),
        "(4.10)",
        output=True,
    )
    acceleration = parts.acceleration_equation(system, velocity, force.symbols)
    equations += [contact, force, acceleration]

    if estimated:
        states += list(equations[0].state or [])
        rates += list(parts.velocity_rate(system, velocity_gain.matrix, velocity, acceleration.symbols))
        initial += list(-velocity_gain.matrix * system.x)
        units += list(parts.velocity_units(system))
    slope = sympy.diag(*[mu * Magnitude(u) ** (mu - 1) * s for u, s in zip(slip.symbols, sign.symbols, strict=True)])
    states += list(state)
    rates += list(friction_gain.matrix * (slope * (system.distribution.T * acceleration.symbols)))
    initial += _declared_levels(system, None if estimated else system.slip_velocity, friction_gain.matrix, mu)
    units += list(parts.contact_units(system))

    signs = tuple(symbol(f"s_{name}") for name in names)
    truths = [symbol(f"a_{name}") for name in names]
    errors = tuple(
        ErrorVariable(symbol(f"e_a_{name}"), truth, k, f"a_{name} - a_hat_{name}", system.contacts[k].unit)
        for k, (name, truth) in enumerate(zip(names, truths, strict=True))
    )
    truth_force = system.distribution * Matrix([s * a for s, a in zip(signs, truths, strict=True)])
    return Observer(
        kind=choice.kind,
        velocity=choice.velocity,
        system=system,
        equations=tuple(equations),
        states=Matrix(states),
        state_units=tuple(units),
        rates=Matrix(rates),
        initial=Matrix(initial),
        errors=(parts.velocity_errors(system) if estimated else ()) + errors,
        true_friction=Matrix(truth_force),
        signs=signs,
        gains=values,
        gain_units={s: _gain_unit(s, values, friction_gain.values, system, mu) for s in values},
        sample_time=choice.sample_time,
        level_errors=True,
    )


def _declared_levels(system: System, slip: Matrix | None, gain: Matrix, mu: sympy.Expr) -> list[sympy.Expr]:
    """z_F at the start, so that â is the level that the spec declares for zero slip."""
    levels = Matrix([c.law_level.subs(c.slip, 0) for c in system.contacts])
    if slip is None:
        return list(levels)
    return list(levels + gain * Matrix([Magnitude(u) ** mu for u in slip]))


def _gain_unit(
    s: sympy.Symbol, values: object, friction: dict[sympy.Symbol, object], system: System, mu: sympy.Expr
) -> str:
    if s not in friction:
        return "1/s"
    contact = system.contacts[0]
    return f"{contact.unit}*s/{contact.slip_unit}" if mu == 1 else f"{contact.unit}*(s/{contact.slip_unit})^{mu}"

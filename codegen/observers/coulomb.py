"""CFO and GCFO: friction is modelled as an unknown level times the sign of slip; the level is estimated."""

from __future__ import annotations

import sympy

from codegen.mechanics.sparse import diagonal
from codegen.mechanics.system import Matrix, System
from codegen.observers import parts
from codegen.observers.domain import read_domain
from codegen.observers.equations import Cascade, Equation, ErrorVariable, Observer
from codegen.observers.gains import GainMatrix, read_gain, refuse_unknown_gains
from codegen.observers.shape import Shape, read_shape
from codegen.observers.velocity import velocity_of
from codegen.spec.model import Spec, symbol


def coulomb_friction_observer(spec: Spec, system: System) -> Observer:
    """CFO (2.6)–(2.8), (3.8)–(3.10) and GCFO (4.10)–(4.15), (4.27)–(4.28), with any monotone h; s^μ in the thesis.

    â = z_F − K_F h(|û|),  F̂ = U S â,  dz_F/dt = K_F D S d(U'v)/dt,  D = diag(h'(|û|)),
    d(U'v)/dt = U' M⁻¹[g − F̂] + U̇' v̂.

    The thesis has no U̇' v̂ in (4.12); without it the level estimate moves at e = 0 where U depends on x.

    Raises:
        BadInput: for gains of wrong shape or sign, an h that does not rise, or a domain that cannot be guarded.
    """
    choice = spec.observer
    assert choice is not None
    shape = read_shape(spec, system)
    refuse_unknown_gains(spec, choice, ("K_F", "K_v"))
    names = parts.contact_names(system)
    friction_gain = read_gain(spec, choice, "K_F", names, names, sign=1)
    velocity = velocity_of(spec, choice, system)
    values = friction_gain.values | velocity.values

    slip, sign = parts.slip_equations(system, velocity.symbols)
    equations = [*velocity.equations, slip, sign]
    speed = Matrix([shape.value(u) for u in slip.symbols])
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
    equations += parts.friction_equations(system, slip, law_force, "(4.10)")
    acceleration = parts.acceleration_equation(system, velocity.symbols, equations[-1].symbols)
    equations.append(acceleration)

    slope = diagonal(shape.slope(u) * s for u, s in zip(slip.symbols, sign.symbols, strict=True))
    slip_rate = parts.slip_rate(system, velocity.symbols, acceleration.symbols)
    rates = friction_gain.matrix * (slope * slip_rate)
    first_slip = None if velocity.estimated else system.slip_velocity
    initial = _declared_levels(system, first_slip, friction_gain.matrix, shape)
    states = velocity.with_own(acceleration.symbols, state, parts.contact_units(system), rates, initial)

    signs = tuple(symbol(f"s_{name}") for name in names)
    truths = [symbol(f"a_{name}") for name in names]
    errors = tuple(
        ErrorVariable(
            symbol(f"e_a_{name}"), truth, "level", k, None, f"a_{name} - a_hat_{name}", system.contacts[k].unit
        )
        for k, (name, truth) in enumerate(zip(names, truths, strict=True))
    )
    truth_force = system.distribution * Matrix([s * a for s, a in zip(signs, truths, strict=True)])
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
        signs=signs,
        gains=values,
        gain_units=dict.fromkeys(values, "1/s") | _gain_units(friction_gain, system, shape),
        sample_time=choice.sample_time,
        level_errors=True,
        domain=read_domain(spec, system),
        cascade=Cascade(
            friction_gain.matrix,
            diagonal(shape.slope(u) for u in system.slip_velocity),
            system.distribution,
            velocity.gain,
            "K_F",
            "K_F U' M^-1 U" if shape.exponent == 1 else "K_F D U' M^-1 U, D = diag(h'(|u|))",
        ),
    )


def _declared_levels(system: System, slip: Matrix | None, gain: Matrix, shape: Shape) -> list[sympy.Expr]:
    """Initial z_F, such that â is the declared level at zero slip; 0 where the law has no level there."""
    at_rest = [c.level_at_rest for c in system.contacts]
    levels = Matrix([0 if level is None else level for level in at_rest])
    speeds = [0] * len(levels) if slip is None else list(slip)
    return list(levels + gain * Matrix([shape.value(u) for u in speeds]))


def _gain_units(gain: GainMatrix, system: System, shape: Shape) -> dict[sympy.Symbol, str]:
    """Units of K_F: level over h of a slip speed."""
    mu, slips = shape.exponent, [c.slip_unit for c in system.contacts]
    if mu is None:
        divisors = [" per unit of h"] * len(slips)
    else:
        divisors = [f"*s/{q}" if mu == 1 else f"*(s/{q})^{mu}" for q in slips]
    return gain.units(parts.contact_units(system), divisors)

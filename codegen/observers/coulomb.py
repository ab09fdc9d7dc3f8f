"""CFO and GCFO: friction is modelled as an unknown level times the sign of slip; the level is estimated."""

from __future__ import annotations

import sympy

from codegen.base.errors import BadInput
from codegen.mechanics.sparse import diagonal
from codegen.mechanics.system import Matrix, System
from codegen.observers import parts
from codegen.observers.equations import Cascade, Domain, Equation, Observer
from codegen.observers.gains import GainMatrix, read_gain, refuse_unknown_gains
from codegen.observers.shape import Shape, read_shape
from codegen.observers.velocity import States, velocity_of
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
    names, units = parts.contact_names(system), parts.contact_units(system)
    friction_gain = read_gain(spec, choice, "K_F", names, names, sign=1)
    velocity = velocity_of(spec, choice, system)

    slip, sign = parts.slip_equations(system, velocity.symbols)
    speed = Matrix([shape.value(u) for u in slip.symbols])
    state = parts.vector("z", names)
    level = Equation(
        "friction_level",
        parts.vector("a_hat", names),
        Matrix(state - friction_gain.matrix * speed),
        units,
        "(4.11)",
        state=state,
        output=True,
    )
    equations = [slip, sign, level]
    equations += parts.friction_equations(system, slip, parts.times(sign.symbols, level.symbols), "(4.10)")
    acceleration = parts.acceleration_equation(system, velocity.symbols, equations[-1].symbols)
    equations.append(acceleration)

    slope = diagonal(shape.slope(u) * s for u, s in zip(slip.symbols, sign.symbols, strict=True))
    slip_rate = parts.slip_rate(system, velocity.symbols, acceleration.symbols)
    rates = friction_gain.matrix * (slope * slip_rate)
    first_slip = None if velocity.estimated else system.slip_velocity
    initial = _declared_levels(system, first_slip, friction_gain.matrix, shape)
    errors = parts.errors_of("level", "a", "a_hat", names, units)
    signs = [symbol(f"s_{name}") for name in names]
    cascade = Cascade(
        friction_gain.matrix,
        diagonal(shape.slope(u) for u in system.slip_velocity),
        system.distribution,
        velocity.matrix,
        "K_F",
        "K_F U' M^-1 U" if shape.exponent == 1 else "K_F D U' M^-1 U, D = diag(h'(|u|))",
    )
    return velocity.observer(
        choice,
        equations,
        States(state, units, rates, initial),
        errors,
        system.distribution * Matrix([s * e.truth for s, e in zip(signs, errors, strict=True)]),
        (friction_gain,),
        _gain_units(friction_gain, system, shape),
        level_errors=True,
        domain=read_domain(spec, system),
        cascade=cascade,
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


def read_domain(spec: Spec, system: System) -> Domain | None:
    """The domain of the spec; the range of the true level is the envelope's ``a_CONTACT``.

    Raises:
        BadInput: for a domain on several coordinates or contacts, with measured velocity, another h than h(s) = s or
            exponential or implicit steps, or without a range for the level that contains the declared one.
    """
    choice = spec.observer
    assert choice is not None
    if choice.domain is None:
        return None
    place = spec.place("observer.domain")
    if system.degrees_of_freedom > 1 or len(system.contacts) > 1:
        found = f"a domain for {system.degrees_of_freedom} coordinates and {len(system.contacts)} contacts"
        raise BadInput(
            place, found, "one coordinate with one contact; for several there is no such domain", code="SPEC022"
        )
    if choice.velocity != "estimated" or choice.integration not in ("euler", "semi_implicit"):
        found = f"a domain with {choice.velocity} velocity under {choice.integration}"
        raise BadInput(place, found, "`velocity: estimated`, and euler or semi_implicit", code="SPEC022")
    if choice.exponent != 1 or choice.shape is not None:
        raise BadInput(
            place,
            "a domain together with `exponent` or `h`",
            "neither of them: a domain needs h(s) = s",
            code="SPEC005",
        )
    contact = system.contacts[0]
    key = f"a_{contact.name}"
    level = spec.envelope.get(key)
    if level is None:
        raise BadInput(
            place,
            f"no range for {key}",
            f"`{key}: [low, high]` in the envelope: the true friction level",
            code="SPEC026",
        )
    at_rest = contact.level_at_rest
    if level[0] < 0 or (at_rest is not None and not level[0] <= at_rest.subs(system.values) <= level[1]):
        found = f"[{level[0]}, {level[1]}]"
        raise BadInput(
            spec.place(f"envelope.{key}"),
            found,
            "a range of levels >= 0 in which the declared one lies",
            code="SPEC007",
        )
    domain = choice.domain
    samples = max(1, int(sympy.ceiling(domain.settle / choice.sample_time)))
    return Domain(domain.slip_speed, samples, level, domain.innovation)

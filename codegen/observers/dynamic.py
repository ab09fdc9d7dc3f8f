"""DFO and GDFO, the dynamic friction observers: they estimate the state f and the level a of λ = a φ(u, f)."""

from dataclasses import dataclass, replace
from typing import Any

import sympy

from codegen.base.errors import BadInput
from codegen.friction import DynamicLaw, FrictionLaw
from codegen.mechanics.contacts import law_of
from codegen.mechanics.system import ContactFriction, Matrix, System
from codegen.observers import parts
from codegen.observers.equations import Equation, LawFunction, Observer, ObserverKind
from codegen.observers.gains import GainMatrix, read_gain
from codegen.observers.velocity import States, velocity_of
from codegen.spec.model import Spec, symbol

Gains = tuple[GainMatrix, GainMatrix, GainMatrix]
"""K_a, K_f1 and K_f2."""


@dataclass(frozen=True)
class AssumedLaw:
    """The one-state law that the observer assumes at a contact: λ = a φ(u, f), f' = ξ₁(u, f).

    Attributes:
        parameters: name → symbol; for a dimensionless parameter its exact value.
        level: declared value of a: of the law's scale parameter, or 1 where the law has none, and the observer's a is
            then a factor of the whole force.
        level_unit: of a; "1" for a factor.
        values, units: of the law's parameter symbols, if the observer assumes a law other than the plant's.
    """

    contact: ContactFriction
    law: DynamicLaw
    parameters: dict[str, Any]
    level: Any
    level_unit: str
    values: dict[sympy.Symbol, Any]
    units: dict[sympy.Symbol, str]

    @property
    def state_unit(self) -> str:
        """The unit of f."""
        return self.law.states[0].unit.format(F=self.contact.unit, q=self.contact.slip_unit)

    def force(self, level: Any, slip: Any, state: Any) -> Any:
        """λ at the level a = ``level``."""
        if self.law.scale:
            return self.law.force(slip, (state,), {**self.parameters, self.law.scale: level})
        return level * self.law.force(slip, (state,), self.parameters)

    def rate(self, slip: Any, state: Any) -> Any:
        """ξ₁(u, f)."""
        return self.law.rates(slip, (state,), self.parameters)[0]


def dynamic_friction_observer(spec: Spec, system: System) -> Observer:
    """DFO (6.13)–(6.15) and GDFO (7.10)–(7.12), for any law with one state.

    f̂ = z_f + K_f1 x + K_f2 v̂,  â = z_a + K_a diag(f̂) û,  F̂ = U diag(â) φ(û, f̂),
    dz_f/dt = −K_f1 v̂ − K_f2 M⁻¹[g − F̂] + ξ₁(û, f̂),
    dz_a/dt = −K_a {diag(û) ξ₁ + diag(f̂) d(U'v)/dt},  d(U'v)/dt = U' M⁻¹[g − F̂] + U̇' v̂.

    The thesis omits U̇' v̂ in (7.10); if U depends on x, e = 0 is no equilibrium without it. Raises BadInput for gains
    of wrong shape, or a contact whose law does not have exactly one state.
    """
    choice = spec.required_observer
    laws = [_assumed_law(spec, system, contact) for contact in system.contacts]
    names = parts.contact_names(system)
    positions = [x.name for x in system.positions]
    square = len(names) == len(positions)
    level_gain = read_gain(spec, choice, "K_a", names, names)
    first = read_gain(spec, choice, "K_f1", names, positions, optional=square)
    second = read_gain(spec, choice, "K_f2", names, positions, optional=square)
    velocity = velocity_of(spec, choice, system)

    slip, _ = parts.slip_equations(system, velocity.symbols)
    gains = level_gain, first, second
    state, level, unit_force = _estimates(laws, system, velocity.symbols, slip.symbols, gains)
    f_hat, a_hat = state.symbols, level.symbols
    equations = [slip, state, level, unit_force]
    equations += parts.friction_equations(system, slip, parts.times(a_hat, unit_force.symbols), "(7.12)")
    acceleration = parts.acceleration_equation(system, velocity.symbols, equations[-1].symbols)
    rate = Equation(
        "friction_state_rate",
        parts.vector("f_rate", names),
        Matrix([law.rate(u, f) for law, u, f in zip(laws, slip.symbols, f_hat, strict=True)]),
        tuple(parts.per(law.state_unit, "s") for law in laws),
        "xi_1 of (6.5), (6.6)",
        law=_law_functions("xi", names, slip.symbols, f_hat),
    )
    equations += [acceleration, rate]

    slip_rate = parts.slip_rate(system, velocity.symbols, acceleration.symbols)
    state_rates = -first.matrix * velocity.symbols - second.matrix * acceleration.symbols + rate.symbols
    level_rates = -level_gain.matrix * (parts.times(slip.symbols, rate.symbols) + parts.times(f_hat, slip_rate))
    units = [law.state_unit for law in laws] + [law.level_unit for law in laws]
    state_errors = parts.errors_of("state", "f", "f_hat", names, [law.state_unit for law in laws])
    level_errors = parts.errors_of("level", "a", "a_hat", names, [law.level_unit for law in laws])
    true_state, true_level = ([e.truth for e in errors] for errors in (state_errors, level_errors))
    fixed = {a: law.level for a, law in zip(true_level, laws, strict=True) if a.name not in spec.envelope}
    assumed_units = {a: law.level_unit for a, law in zip(true_level, laws, strict=True)}
    return velocity.observer(
        choice,
        equations,
        States(
            [*parts.vector("z_f", names), *parts.vector("z_a", names)],
            units,
            [*state_rates, *level_rates],
            _initial_states(laws, system, velocity.known, gains),
        ),
        state_errors + level_errors,
        _true_force(laws, system, true_level, true_state),
        gains,
        _gain_units(laws, system, gains),
        level_errors=False,
        assumed=fixed | {s: value for law in laws for s, value in law.values.items()},
        assumed_units=assumed_units | {s: unit for law in laws for s, unit in law.units.items()},
        truth_ranges={f: r for f, law in zip(true_state, laws, strict=True) if (r := _range(spec, system, law))},
        level_ranges={a: spec.envelope[a.name] for a in true_level if a.name in spec.envelope},
        exact=all(law.contact.law is law.law and not law.values for law in laws),
    )


def _law_functions(label: str, names: list[str], slip: Matrix, state: Matrix) -> tuple[LawFunction, ...]:
    """A function of (u, f) for each contact, whose partial derivatives are symbols in Ψ."""
    return tuple(LawFunction(f"{label}_{n}", {"u": u, "f": f}) for n, u, f in zip(names, slip, state, strict=True))


def _assumed_law(spec: Spec, system: System, contact: ContactFriction) -> AssumedLaw:
    """The law of ``observer: laws:`` for this contact, or else the plant's; BadInput unless it has one state."""
    choice = spec.required_observer
    place = spec.place(f"friction.contacts[{system.contact_index(contact.name)}].law")
    law: FrictionLaw = contact.law
    parameters: dict[str, Any] = dict(contact.law_parameters)
    values: dict[sympy.Symbol, Any] = {}
    units: dict[sympy.Symbol, str] = {}
    known = dict(system.values)
    if contact.name in choice.laws:
        key = f"observer.laws.{contact.name}"
        place = spec.place(f"{key}.law")
        law, parameters, values, units = law_of(spec, key, choice.laws[contact.name], contact.slip_unit, "assumed_")
        known = values
    if not isinstance(law, DynamicLaw) or law.drives != "state" or len(law.states) != 1:
        reason = law.why_not or f"{law.name} has no state"
        expected = "a law in state-space form, such as dahl, or one under `observer: laws:`"
        raise BadInput(
            place, f"the law {law.name} at {contact.name} under a {choice.kind}: {reason}", expected, code="SPEC020"
        )
    for p in law.parameters:
        if p.unit == "1":  # with a numeric exponent, powers become products, whose slopes are finite
            parameters[p.name] = known[parameters[p.name]]
    if law.scale:
        scale = parameters[law.scale]
        return AssumedLaw(contact, law, parameters, known[scale], contact.unit, values, units)
    return AssumedLaw(contact, law, parameters, sympy.Integer(1), "1", values, units)


def _estimates(
    laws: list[AssumedLaw], system: System, velocity: Matrix, slip: Matrix, gains: Gains
) -> tuple[Equation, Equation, Equation]:
    """The equations of f̂, of â and of the force φ(û, f̂) at level 1; ``velocity`` is v̂ and ``slip`` û."""
    level, first, second = gains
    names = parts.contact_names(system)
    z_f, z_a = parts.vector("z_f", names), parts.vector("z_a", names)
    f_hat, a_hat = parts.vector("f_hat", names), parts.vector("a_hat", names)
    f_equation = Equation(
        "friction_state",
        f_hat,
        Matrix(z_f + first.matrix * system.x + second.matrix * velocity),
        tuple(law.state_unit for law in laws),
        "(7.11)",
        state=z_f,
        output=True,
    )
    a_equation = Equation(
        "friction_level",
        a_hat,
        Matrix(z_a + level.matrix * parts.times(f_hat, slip)),
        tuple(law.level_unit for law in laws),
        "(7.10)",
        state=z_a,
        output=True,
    )
    force_equation = Equation(
        "unit_friction",
        parts.vector("phi_hat", names),
        Matrix([law.force(1, u, f) for law, u, f in zip(laws, slip, f_hat, strict=True)]),
        tuple(parts.per(law.contact.unit, law.level_unit) for law in laws),
        "the law's force at level 1; f of (7.12)",
        law=_law_functions("phi", names, slip, f_hat),
    )
    return f_equation, a_equation, force_equation


def _initial_states(laws: list[AssumedLaw], system: System, known: Matrix, gains: Gains) -> list[Any]:
    """z_f and z_a at which f̂ is the law's state at rest and â its level, for the velocity ``known`` at the start."""
    level, first, second = gains
    rest = Matrix([law.law.rest_state(law.parameters)[0] for law in laws])
    slip = system.distribution.T * known
    # The scale parameter is a symbol here, since the generated code has it as a parameter.
    levels = Matrix([law.parameters[law.law.scale] if law.law.scale else law.level for law in laws])
    return [
        *(rest - first.matrix * system.x - second.matrix * known),
        *(levels - level.matrix * parts.times(rest, slip)),
    ]


def _true_force(laws: list[AssumedLaw], system: System, levels: list[Any], states: list[Any]) -> Matrix:
    """U diag(a) φ(u, f), coordinates by 1, of the true levels a, states f and slip velocities u."""
    slips = [c.slip for c in system.contacts]
    forces = Matrix([law.force(a, u, f) for law, a, u, f in zip(laws, levels, slips, states, strict=True)])
    velocities = dict(zip(slips, system.slip_velocity, strict=True))
    return system.distribution * forces.subs(velocities, simultaneous=True)


def _range(spec: Spec, system: System, law: AssumedLaw) -> tuple[Any, Any] | None:
    """Exact range of the law's state for the slip speeds in the envelope; None if these are unknown and matter."""
    column = system.distribution.col(system.contact_index(law.contact.name)).subs(system.values)
    top_speed: Any = sympy.Integer(0)  # |u| ≤ Σ |U_i| max|v_i|; None where U varies or a velocity has no range
    for entry, v in zip(column, system.velocities, strict=True):
        if entry == 0:
            continue
        if entry.free_symbols or v.name not in spec.envelope:
            top_speed = None
            break
        top_speed += abs(entry) * max(abs(end) for end in spec.envelope[v.name])
    known = {**system.values, **law.values}
    numbers = {name: known.get(s, s) for name, s in law.parameters.items()}
    # The top speed is a symbol, since the range of many laws, such as Dahl's, does not depend on it.
    speed_symbol = symbol("top_speed_")
    low, high = law.law.state_range(speed_symbol, numbers)[0]
    if top_speed is None:
        independent = not (low.has(speed_symbol) or high.has(speed_symbol))
        return (_rational(low, -1), _rational(high, 1)) if independent else None
    return _rational(low.subs(speed_symbol, top_speed), -1), _rational(high.subs(speed_symbol, top_speed), 1)


def _rational(value: Any, outward: int) -> Any:
    """An end of a range as a rational; an irrational one is rounded outwards (−1: down, 1: up) by a relative 10⁻¹⁵."""
    if value.is_Rational:
        return value
    number = sympy.Rational(str(sympy.N(value, 20)))
    return number + outward * abs(number) * sympy.Rational(1, 10**15)


def _gain_units(laws: list[AssumedLaw], system: System, gains: Gains) -> dict[sympy.Symbol, str]:
    """Gain symbol → unit: that of the estimate over that of the gain's factor f̂ û, x or v̂."""
    level, first, second = gains
    states, positions = [law.state_unit for law in laws], [f"/{q}" for q in system.position_units]
    return (
        level.units(
            [f"{law.level_unit}*s".removeprefix("1*") for law in laws],
            [parts.per("", law.state_unit, law.contact.slip_unit) for law in laws],
        )
        | first.units(states, positions)
        | second.units([f"{state}*s".removeprefix("1*") for state in states], positions)
    )


_GENERAL = ObserverKind(dynamic_friction_observer, ("K_a", "K_f1", "K_f2", "K_v"), ("laws",))
KINDS = {"dfo": replace(_GENERAL, general="gdfo"), "gdfo": _GENERAL}

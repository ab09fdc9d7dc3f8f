"""CFO and GCFO, the Coulomb friction observers: they estimate the level a of F = a sgn(u) at each contact."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sympy

from codegen.base.errors import BadInput
from codegen.base.exact_numbers import geometric
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.sparse import diagonal
from codegen.mechanics.system import Matrix, System
from codegen.observers import parts
from codegen.observers.equations import Cascade, Domain, Equation, Observer, ObserverKind
from codegen.observers.gains import GainMatrix, read_gain
from codegen.observers.velocity import SAMPLE_TIME, States, Velocity, velocity_of
from codegen.spec.functions import Magnitude
from codegen.spec.model import ObserverChoice, Spec, symbol

LARGEST_EXPONENT = 8
"""Largest exponent μ of a GCFO's h(s)."""
FORGOTTEN = 10_000
"""An error of the velocity estimate at the start of an observer with a domain ÷ its part that is left when the level is
first updated."""
SPEED = symbol("s")
"""Slip speed, the argument of h(s)."""
SAMPLES = 400
"""Slip speeds at which the slope of h is checked, logarithmic and linear."""


def coulomb_friction_observer(spec: Spec, system: System) -> Observer:
    """CFO (2.6)–(2.8), (3.8)–(3.10) and GCFO (4.10)–(4.15), (4.27)–(4.28), with any monotone h; s^μ in the thesis.

    â = z_F − K_F h(|û|),  F̂ = U S â,  dz_F/dt = K_F D S d(U'v)/dt,  D = diag(h'(|û|)),
    d(U'v)/dt = U' M⁻¹[g − F̂] + U̇' v̂.

    The thesis omits U̇' v̂ in (4.12); if U depends on x, e = 0 is no equilibrium without it. Raises BadInput for gains
    of wrong shape or sign, an h that is not increasing, or an invalid domain.
    """
    choice = spec.required_observer
    shape = read_shape(spec, system)
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
        domain=read_domain(spec, system, velocity),
        cascade=cascade,
    )


def _declared_levels(system: System, slip: Matrix | None, gain: Matrix, shape: Shape) -> list[sympy.Expr]:
    """Initial z_F, with which â is the declared level at rest; 0 if the law has no level there."""
    at_rest = [c.level_at_rest for c in system.contacts]
    levels = Matrix([0 if level is None else level for level in at_rest])
    speeds = [0] * len(levels) if slip is None else list(slip)
    return list(levels + gain * Matrix([shape.value(u) for u in speeds]))


def _gain_units(gain: GainMatrix, system: System, shape: Shape) -> dict[sympy.Symbol, str]:
    """Gain symbol → unit of K_F: that of a level over that of h(s)."""
    mu, slips = shape.exponent, [c.slip_unit for c in system.contacts]
    if mu is None:
        divisors = [" per unit of h"] * len(slips)
    else:
        divisors = [f"*s/{q}" if mu == 1 else f"*(s/{q})^{mu}" for q in slips]
    return gain.units(parts.contact_units(system), divisors)


def read_domain(spec: Spec, system: System, velocity: Velocity) -> Domain | None:
    """The domain of the spec's observer; the range of the true level is ``a_CONTACT`` in the envelope.

    Raises BadInput for a domain with several coordinates or contacts, with measured velocity, an h other than h(s) = s,
    or exponential or implicit steps, or without a range for the level that contains the declared one.
    """
    choice = spec.required_observer
    if choice.domain is None:
        return None
    place = spec.place("observer.domain")
    if system.degrees_of_freedom > 1 or len(system.contacts) > 1:
        found = f"a domain for {system.degrees_of_freedom} coordinates and {len(system.contacts)} contacts"
        expected = "one coordinate with one contact; for several there is no such domain"
        raise BadInput(place, found, expected, code="SPEC022")
    if choice.velocity != "estimated" or choice.integration not in ("euler", "semi_implicit"):
        found = f"a domain with {choice.velocity} velocity under {choice.integration}"
        raise BadInput(place, found, "`velocity: estimated`, and euler or semi_implicit", code="SPEC022")
    if choice.exponent != 1 or choice.shape is not None:
        found = "a domain together with `exponent` or `h`"
        raise BadInput(place, found, "neither of them: a domain needs h(s) = s", code="SPEC005")
    contact = system.contacts[0]
    key = f"a_{contact.name}"
    level = spec.envelope.get(key)
    if level is None:
        expected = f"`{key}: [low, high]` in the envelope: the true friction level"
        raise BadInput(place, f"no range for {key}", expected, code="SPEC026")
    at_rest = contact.level_at_rest
    if level[0] < 0 or (at_rest is not None and not level[0] <= at_rest.subs(system.values) <= level[1]):
        found, expected = f"[{level[0]}, {level[1]}]", "a range of levels >= 0 in which the declared one lies"
        raise BadInput(spec.place(f"envelope.{key}"), found, expected, code="SPEC007")
    domain = choice.domain
    samples = max(1, int(sympy.ceiling(domain.settle / choice.sample_time)))
    return Domain(domain.slip_speed, samples, _restart(choice, velocity), level, domain.innovation)


def _restart(choice: ObserverChoice, velocity: Velocity) -> int:
    """Number of samples in which the velocity estimate forgets all but 1/FORGOTTEN of an error, at a constant level."""
    assert velocity.gain is not None and velocity.step is not None
    values = {**velocity.gain.values, SAMPLE_TIME: choice.sample_time}
    left = 1 - float(choice.sample_time * velocity.step[0][0, 0].xreplace(values))
    return max(1, math.ceil(math.log(FORGOTTEN) / -math.log(left))) if 0 < left < 1 else 1


@dataclass(frozen=True)
class Shape:
    """The function h(s) of the level estimate, with h' > 0 for s > 0; s^μ in the thesis (2.6).

    Attributes:
        expression: h over ``SPEED``.
    """

    expression: Any

    def value(self, slip: Any) -> Any:
        """h(|u|)."""
        return self.expression.subs(SPEED, Magnitude(slip))

    def slope(self, slip: Any) -> Any:
        """h'(|u|)."""
        return self.expression.diff(SPEED).subs(SPEED, Magnitude(slip))

    @property
    def exponent(self) -> Any:
        """μ of h = s^μ; None for another h."""
        base, power = self.expression.as_base_exp()
        return power if base == SPEED and power.is_number else None


def read_shape(spec: Spec, system: System) -> Shape:
    """The spec's ``h``, or s^μ for its ``exponent`` μ.

    Raises BadInput for an exponent outside (0, 8], or an h that is not increasing up to the top slip speed of the
    envelope (10 for a velocity without a range).
    """
    choice = spec.required_observer
    if choice.shape is None:
        if not 0 < choice.exponent <= LARGEST_EXPONENT:
            wanted = f"a positive number up to {LARGEST_EXPONENT}"
            raise BadInput(spec.place("observer.exponent"), f"exponent {choice.exponent}", wanted, code="SPEC007")
        return Shape(SPEED**choice.exponent)
    shape = Shape(choice.shape)
    place = spec.place("observer.h")
    if not choice.shape.has(SPEED):
        raise BadInput(place, f"h = {choice.shape}", "an expression that rises with the slip speed s", code="SPEC022")
    ends = [spec.envelope.get(v.name, (-10, 10)) for v in system.velocities]
    # An upper estimate of the slip speed in the envelope.
    top = max(1e-3, *[max(abs(float(lo)), abs(float(hi))) for lo, hi in ends]) * max(1, len(ends))
    speeds = np.concatenate([geometric(1e-6, 1, SAMPLES), np.linspace(0, 1, SAMPLES)[1:]]) * top
    slopes = [float(to_casadi(shape.expression.diff(SPEED), {SPEED: s})) for s in speeds]
    for s, slope in zip(speeds, slopes, strict=True):
        if not slope > 0:
            found = f"h = {choice.shape}, whose slope at s = {s:.3g} is {slope:.3g}"
            expected = f"a function that rises up to the envelope's top slip speed {top:.3g}"
            raise BadInput(place, found, expected, code="SPEC022")
    return shape


def refuse_infinite_slope(spec: Spec) -> None:
    """Raise BadInput if the envelope contains v = 0 and h has an infinite slope there, so that Ψ is unbounded."""
    choice = spec.observer
    if choice is None:
        return
    if not all(low <= 0 <= high for low, high in (spec.envelope.get(v, (-1, 1)) for v in spec.velocities)):
        return
    shape = Shape(SPEED**choice.exponent if choice.shape is None else choice.shape)
    if not np.isfinite(float(to_casadi(shape.expression.diff(SPEED), {SPEED: 0.0}))):
        key = "exponent" if choice.shape is None else "h"
        found = f"h(s) = {shape.expression}, whose slope is infinite at rest"
        expected = "a finite slope (exponent 1 or more), or velocities that are never 0"
        raise BadInput(spec.place(f"observer.{key}"), found, expected, code="SPEC033")


_GENERAL = ObserverKind(coulomb_friction_observer, ("K_F", "K_v"), ("exponent", "h", "domain"))
KINDS = {"cfo": replace(_GENERAL, general="gcfo"), "gcfo": _GENERAL}

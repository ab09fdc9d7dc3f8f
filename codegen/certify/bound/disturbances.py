"""How large the disturbances of the error are that an envelope, and a model that is off, allow in one sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import sympy

from codegen.certify.bound.error_response import Response
from codegen.certify.decimals import upwards
from codegen.friction.law import DynamicLaw
from codegen.mechanics.system import ContactFriction, System
from codegen.observers.equations import Observer
from codegen.spec.model import Spec


@dataclass(frozen=True)
class ModelError:
    """By which share a machine is above its model: 1/100 is a percent, of either sign.

    Attributes:
        mass: of M(x), all of it; gain: of the inputs' effect; time: of every sample's length.
    """

    mass: Fraction = Fraction(0)
    gain: Fraction = Fraction(0)
    time: Fraction = Fraction(0)


EXACT = ModelError()
DIGITS = 12
"""Of a slope that is not rational, rounded up."""


def disturbances(
    spec: Spec, observer: Observer, response: Response, off: ModelError = EXACT
) -> dict[str, list[Fraction]] | str:
    """δ of every cause, m, m/s and the friction's unit a sample; or what the envelope lacks for it.

    With M = (1 + p) M̂ the model's acceleration is by p v' off at the same forces, and with an input that acts by
    B(1 + p) by p M⁻¹Bw. Samples of h(1 + p) are, by the clock of the code, a machine that moves at v(1 + p) and changes
    that by v'(1 + p)², which is (2p + p²) v' more, under forces of v. Each is a velocity of h times that in a sample.
    Inputs are held from sample to sample: what they move within one is not in it.
    """
    system, h = observer.system, fraction(observer.sample_time)
    if said := left_out(system):
        return said
    slower = 1 + off.time

    def largest(name: str) -> Fraction | None:
        ends = spec.envelope.get(name)
        return None if ends is None else max(abs(fraction(e)) for e in ends)

    true = [largest(f"{v}_dot") or Fraction(0) for v in system.velocities]
    acceleration = [slower * slower * a for a in true]
    speed = [largest(v.name) for v in system.velocities]
    if any(response.by_position) and None in speed:
        return "g depends on x, and the envelope has no range for every velocity"
    speeds = [s or Fraction(0) for s in speed]
    pushed = [largest(w.name) for w in system.inputs]
    if off.gain and None in pushed:
        return "the envelope has no range for every input"
    if off.time and any(response.by_velocity) and None in speed:
        return "g depends on v, and the envelope has no range for every velocity"
    slips = system.distribution.subs(observer.values)
    rates, contacts = [], []
    for c, contact in enumerate(system.contacts):
        slides = sliding(observer, contact)
        if slides is None:
            return f"the law {contact.law.name} at {contact.name} has no bound on its slope"
        contacts.append(slower * slides.slope * dot(slips.col(c), true))
    onto = [dot(slips.row(i), contacts) for i in range(slips.rows)]
    for error in observer.errors[len(acceleration) :]:
        if error.contact is not None:
            rates.append(contacts[error.contact])
        elif error.coordinate is not None:
            rates.append(onto[error.coordinate])
    jerk = [
        dot(response.by_position.row(i), [slower * s for s in speeds])
        + dot(response.by_velocity.row(i), acceleration)
        + dot(response.by_force.row(i), onto)
        for i in range(len(acceleration))
    ]
    more = [
        (off.mass + slower * slower - 1) * a
        + off.time * dot(response.by_velocity.row(i), speeds)
        + off.gain * dot(response.by_input.row(i), [w or Fraction(0) for w in pushed])
        for i, a in enumerate(true)
    ]
    return {
        "noise": [largest(f"{x}_noise") or Fraction(0) for x in system.positions],
        "displacement": [h * h * a / 2 for a in acceleration],
        "velocity": [h * h * j / 2 + h * m for j, m in zip(jerk, more, strict=True)],
        "acceleration": [a + m for a, m in zip(acceleration, more, strict=True)],
        "friction": [h * r for r in rates],
    }


@dataclass(frozen=True)
class Sliding:
    """A contact's law in sliding of one sign, in the contact's units.

    Attributes:
        slope: bound on |dF/du|, exact or rounded up, of a law with a state once that has come to its level.
        level: declared, where sliding begins; speed: from which on a law with a state slides, 0 for others.
    """

    slope: Fraction
    level: Fraction
    speed: Fraction


def sliding(observer: Observer, contact: ContactFriction) -> Sliding | None:
    """What the law says of sliding; None where its slope has no bound. One that is not rational is rounded up."""
    law, values = contact.law, {k: observer.values[s] for k, s in contact.law_parameters.items()}
    found = law.in_sliding(values) if isinstance(law, DynamicLaw) else (sympy.Integer(0), law.slope_bound(values))
    if found is None or not getattr(found[1], "is_finite", False):
        return None
    slope = found[1] if found[1].is_Rational else upwards(float(found[1]) * (1 + 1e-12), DIGITS)
    begun = law.level(found[0], values) if isinstance(law, DynamicLaw) else contact.level_at_rest or sympy.Integer(0)
    level = abs(begun.subs(observer.values))
    exact = level if level.is_Rational else sympy.Rational(float(level) * (1 + 1e-12))
    return Sliding(fraction(slope), fraction(exact), fraction(found[0]))


def left_out(system: System) -> str:
    """What the system holds that no size here bounds, in words; empty where there is nothing."""
    for transmission in system.transmissions:
        return f"{system.positions[transmission.coordinate]} moves a load behind a spring"
    for contact in system.contacts:
        law = contact.law
        if isinstance(law, DynamicLaw) and law.in_sliding(contact.law_parameters) is None:
            return f"the law {law.name} at {contact.name} has a state, which changes friction beside the slip"
    for x in system.sensor_errors:
        return f"the sensor of {x} reads wrong, and what that makes of noise is not bounded"
    return ""


def with_rounding(
    sizes: dict[str, list[Fraction]], response: Response, positions: Fraction, states: list[Fraction]
) -> dict[str, list[Fraction]]:
    """The sizes with what rounding adds: to every position, and to the errors by every state in a step."""
    if not states:
        return sizes
    n, errors = len(sizes["noise"]), [dot(response.by_state.row(i), states) for i in range(len(states))]
    return sizes | {
        "noise": [s + positions for s in sizes["noise"]],
        "velocity": [s + e for s, e in zip(sizes["velocity"], errors[:n], strict=True)],
        "friction": [s + e for s, e in zip(sizes["friction"], errors[n:], strict=True)],
    }


def dot(row: Any, sizes: Sequence[Fraction]) -> Fraction:
    """Σ |row| sizes."""
    return sum((abs(fraction(e)) * s for e, s in zip(row, sizes, strict=True)), Fraction(0))


def fraction(value: Any) -> Fraction:
    """A SymPy rational."""
    exact = sympy.Rational(value)
    return Fraction(int(exact.p), int(exact.q))

"""Bounds on a contact's friction and its slope, from its law and the envelope, as exact numbers."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import sympy

from codegen.certify.prefix import fraction, rational_above
from codegen.friction.law import DynamicLaw, ZeroMemoryLaw
from codegen.mechanics.system import ContactFriction
from codegen.observers.equations import Observer
from codegen.spec.functions import Sgn
from codegen.spec.model import Spec


@dataclass(frozen=True)
class Sliding:
    """A contact's law while it slides in one direction, in the contact's units.

    Attributes:
        slope: bound on |dF/du|; for a law with a state, once the state has reached its steady value.
        level: declared |F| at ``speed``, where sliding begins; an irrational one is rounded up.
        speed: the least |u| at which a law with a state is in its sliding range; 0 for a law without states.
    """

    slope: Fraction
    level: Fraction
    speed: Fraction


def sliding(observer: Observer, contact: ContactFriction) -> Sliding | None:
    """The law of a contact in sliding: its slope bound, level and least slip speed; None if its slope has no bound."""
    law, values = contact.law, {k: observer.values[s] for k, s in contact.law_parameters.items()}
    known = law.in_sliding(values) if isinstance(law, DynamicLaw) else (sympy.Integer(0), law.slope_bound(values))
    if known is None or not getattr(known[1], "is_finite", False):
        return None
    speed, slope = known
    begun = law.level(speed, values) if isinstance(law, DynamicLaw) else contact.level_at_rest or sympy.Integer(0)
    level = abs(begun.xreplace(observer.values))
    exact = level if level.is_Rational else sympy.Rational(float(level) * (1 + 1e-12))
    return Sliding(fraction(rational_above(slope)), fraction(exact), fraction(speed))


def largest_friction(spec: Spec, observer: Observer) -> list[Fraction | None]:
    """Upper bound on |friction| of each contact for every slip in the envelope, rest included; None if there is none.

    It is that of the law and of ``extra_level``; ``extra_force`` of declared effects is not included. The largest slip
    speed is Σ |U_i| max |v_i|.

    - Law without memory: the larger of the level at rest and that at u → 0, plus the slope bound times the largest slip
      speed.
    - The same with a range ``a_NAME`` in the envelope: the larger of the level at rest and the ends of the range.
    - Law with one state: its force at the ends of the state's range; with a range ``a_NAME``, at the largest level in
      it.

    There is none for a U that depends on position, for a speed without a range that the bound needs, and without a
    range ``a_NAME`` for a contact with a declared effect on its level.
    """
    system, bounds = observer.system, list[Fraction | None]()
    distribution = observer.distribution

    def end(name: str) -> Any:
        return max((abs(sympy.Rational(e)) for e in spec.envelope.get(name, ())), default=sympy.oo)

    for c, contact in enumerate(system.contacts):
        law, values = contact.law, {k: observer.values[s] for k, s in contact.law_parameters.items()}
        column = zip(distribution.col(c), system.velocities, strict=True)
        fastest = sum((0 if u == 0 else abs(u) * end(v.name) for u, v in column), sympy.Integer(0))
        ranged = f"a_{contact.name}" in spec.envelope
        if ranged and not isinstance(law, DynamicLaw):
            rest = contact.level_at_rest
            bound = sympy.Max(end(f"a_{contact.name}"), 0 if rest is None else rest.xreplace(observer.values))
        elif (contact.extra_level != 0 and not ranged) or distribution.col(c).free_symbols:
            bound = sympy.oo
        elif isinstance(law, DynamicLaw):
            scaled = {law.scale: end(f"a_{contact.name}")} if ranged and law.scale else {}
            bound = _largest_force_of_state(law, values | scaled, fastest)
        elif isinstance(law, ZeroMemoryLaw) and contact.level_at_rest is not None:
            slope, s = law.slope_bound(values), sympy.Symbol("s", positive=True)
            slow = law.level(s, values).replace(Sgn, lambda _: sympy.Integer(1)).subs(s, 0)
            bound = sympy.Max(slow, contact.level_at_rest.xreplace(observer.values))
            bound += slope * fastest if slope != 0 else 0
        else:
            bound = sympy.oo
        bounds.append(fraction(rational_above(bound)) if bound.is_finite else None)
    return bounds


def _largest_force_of_state(law: DynamicLaw, values: Any, fastest: Any) -> Any:
    """The largest |λ| of a law whose force is a constant times its only state; oo for other laws."""
    if len(law.states) != 1 or not fastest.is_finite:
        return sympy.oo
    u, z = sympy.symbols("u z", real=True)
    force = sympy.expand(law.force(u, (z,), values))
    slope = force.diff(z)
    if slope.free_symbols or force != slope * z:
        return sympy.oo
    ((low, high),) = law.state_range(fastest, values)
    return abs(slope) * sympy.Max(abs(low), abs(high))

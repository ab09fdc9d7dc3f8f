"""Bounds on a contact's friction and its slope, from its law and the envelope, as exact numbers."""

from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any

import sympy

from codegen.certify.certificate_text import fraction, rational_above, to_prefix, upwards
from codegen.checker import verify
from codegen.friction.law import DynamicLaw, ZeroMemoryLaw
from codegen.mechanics.system import ContactFriction
from codegen.observers.equations import Observer
from codegen.spec.functions import Sgn
from codegen.spec.model import Spec

CUTS = 100
"""Number of times that a range of speeds is cut to enclose the slope of a law over it."""


@dataclass(frozen=True)
class Sliding:
    """A contact's law while it slides in one direction, in the contact's units.

    Attributes:
        slope: bound on |dF/du| over the speeds asked for; for a law with a state, once it has reached its steady value.
        level: declared |F| at ``speed``, where sliding begins; an irrational one is rounded up.
        speed: the least |u| at which a law with a state is in its sliding range; 0 for a law without states.
    """

    slope: Fraction
    level: Fraction
    speed: Fraction


def sliding(
    observer: Observer, contact: ContactFriction, between: tuple[Fraction, Fraction] | None = None
) -> Sliding | None:
    """The law of a contact while it slides in one direction, by default at any speed; None if its slope has no bound.

    Args:
        between: the least and the largest |u|, for which ``slope`` is to hold.
    """
    law, values = contact.law, {k: observer.values[s] for k, s in contact.law_parameters.items()}
    known = law.in_sliding(values) if isinstance(law, DynamicLaw) else (sympy.Integer(0), law.slope_bound(values))
    if known is None or not getattr(known[1], "is_finite", False):
        return None
    speed, slope = known
    begun = law.level(speed, values) if isinstance(law, DynamicLaw) else contact.level_at_rest or sympy.Integer(0)
    level = abs(begun.xreplace(observer.values))
    most = rational_above(slope)
    if between is not None and isinstance(law, ZeroMemoryLaw):
        most = min(most, _steepest(law, tuple(values.items()), *between) or most)
    return Sliding(most, rational_above(level), fraction(speed))


@cache
def _steepest(law: ZeroMemoryLaw, values: Any, low: Fraction, high: Fraction) -> Fraction | None:
    """Upper bound on |da/du| from ``low`` to ``high`` above 0, by interval arithmetic; None where that is none."""
    u = sympy.Symbol("u", positive=True)
    slope = law.level(u, dict(values)).replace(Sgn, lambda _: sympy.Integer(1)).diff(u)
    try:
        value = verify.parse(to_prefix(slope), ["u"], law.name)[1]

        def piece(a: Fraction, b: Fraction) -> tuple[Fraction, Fraction, Fraction]:
            least, most = verify.widen(*value({"u": (a, b)}))
            return max(-least, most), a, b

        pieces = [piece(low, high)]
        for _ in range(CUTS):
            top = max(pieces)
            pieces.remove(top)
            _, a, b = top
            pieces += [piece(a, (a + b) / 2), piece((a + b) / 2, b)]
    except (TypeError, verify.Refused):  # no such expression, or beyond what is enclosed
        return None
    return upwards(float(max(pieces)[0]) * (1 + 1e-12), 12)


def fastest_slip(spec: Spec, observer: Observer, c: int) -> Any:
    """The largest |u| of contact ``c`` in the envelope, Σ |U_i| max |v_i|; oo if a speed that counts has no range."""
    terms = zip(observer.distribution.col(c), observer.system.velocities, strict=True)
    speeds = (abs(u) * largest_in_envelope(spec, v.name, sympy.oo) for u, v in terms if u != 0)
    return sum(speeds, sympy.Integer(0))


def largest_friction(spec: Spec, observer: Observer) -> list[Fraction | None]:
    """Upper bound on |friction| of each contact for every slip in the envelope, rest included; None if there is none.

    The friction is that of the law and of ``extra_level``; ``extra_force`` of declared effects is not included. There
    is no bound for a U that depends on position, for a speed without a range that the bound needs, and without a range
    ``a_NAME`` for a contact with a declared effect on its level.
    """
    bounds = [_largest_friction(spec, observer, c) for c in range(len(observer.system.contacts))]
    return [rational_above(bound) if bound.is_finite else None for bound in bounds]


def _largest_friction(spec: Spec, observer: Observer, c: int) -> Any:
    """The bound on the friction of contact ``c``, exact; oo if there is none.

    - Law without memory: the larger of the level at rest and ``largest_level`` for the largest slip speed.
    - The same with a range ``a_NAME`` in the envelope: the larger of the level at rest and the ends of the range.
    - Law with one state: its force at the ends of the state's range; with a range ``a_NAME``, at the largest level.
    """
    contact, column = observer.system.contacts[c], observer.distribution.col(c)
    law, values = contact.law, {k: observer.values[s] for k, s in contact.law_parameters.items()}
    rest = None if contact.level_at_rest is None else contact.level_at_rest.xreplace(observer.values)
    ranged = f"a_{contact.name}" in spec.envelope
    largest_level = largest_in_envelope(spec, f"a_{contact.name}", sympy.oo)
    fastest = fastest_slip(spec, observer, c)
    if ranged and not isinstance(law, DynamicLaw):
        return sympy.Max(largest_level, rest or 0)
    if (contact.extra_level != 0 and not ranged) or column.free_symbols:
        return sympy.oo
    if isinstance(law, DynamicLaw):
        scaled = {law.scale: largest_level} if ranged and law.scale else {}
        return _largest_force_of_state(law, values | scaled, fastest)
    if isinstance(law, ZeroMemoryLaw) and rest is not None:
        return sympy.Max(rest, law.largest_level(fastest, values))
    return sympy.oo


def largest_in_envelope(spec: Spec, name: str, without: Any) -> Any:
    """The largest magnitude in the envelope's range of a variable; ``without`` if it has none."""
    return max((abs(sympy.Rational(e)) for e in spec.envelope.get(name, ())), default=without)


def _largest_force_of_state(law: DynamicLaw, values: Any, fastest: Any) -> Any:
    """The largest |λ| of a law whose force is a constant times its only state, up to this slip speed; else oo."""
    if len(law.states) != 1 or not fastest.is_finite:
        return sympy.oo
    u, z = sympy.symbols("u z", real=True)
    force = sympy.expand(law.force(u, (z,), values))
    slope = force.diff(z)
    if slope.free_symbols or force != slope * z:
        return sympy.oo
    ((low, high),) = law.state_range(fastest, values)
    return abs(slope) * sympy.Max(abs(low), abs(high))

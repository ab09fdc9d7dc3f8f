"""Friction contacts of a spec as ``ContactFriction``: law by name, checked parameter values, parameter symbols."""

from typing import Any

import sympy

from codegen.base.errors import BadInput, Faults, nearest_name, refuse_unknown
from codegen.friction import ALSO_CALLED, LAWS, FrictionLaw, LawParameter
from codegen.mechanics.system import ContactFriction, Matrix
from codegen.spec.model import Contact, Spec, symbol
from codegen.spec.quantity import refuse_other_unit
from codegen.spec.units import dimension, parse_unit

Values = dict[sympy.Symbol, Any]
"""Parameter symbol → exact value."""
Units = dict[sympy.Symbol, str]
"""Parameter symbol → unit."""

HINT = "a force in addition to the law, such as viscous friction, is declared under `effects:` (`stiction effects`)"
"""Hint in the message on an unknown law or parameter, which often belongs to a declared effect."""


def build_contacts(spec: Spec, distribution: Matrix) -> tuple[tuple[ContactFriction, ...], Values, Units]:
    """The contacts in order, and the exact values and units of their laws' parameter symbols.

    Raises BadInput for an unknown law, for a law parameter that is missing, unknown or out of range, or for a contact
    whose column of U is zero.
    """
    contacts: list[ContactFriction] = []
    values: Values = {}
    units: Units = {}
    faults = Faults()
    for index, contact in enumerate(spec.contacts):
        with faults.noting():
            slip_unit = _slip_unit(spec, distribution, index, contact)
            law, symbols, law_values, law_units = law_of(spec, f"friction.contacts[{index}]", contact, slip_unit)
            values |= law_values
            units |= law_units
            slip = symbol(f"slip_{contact.name}")
            contacts.append(ContactFriction(contact.name, contact.unit, slip_unit, slip, law, symbols))
    faults.raise_noted()
    return tuple(contacts), values, units


def law_of(
    spec: Spec, key: str, contact: Contact, slip_unit: str, prefix: str = ""
) -> tuple[FrictionLaw, dict[str, sympy.Symbol], Values, Units]:
    """A contact's law, its parameters' symbols, and their exact values and units; BadInput as ``build_contacts``.

    Args:
        key: place in the spec of the contact, or of the law that the observer assumes for it.
        slip_unit: unit of the contact's slip, for the units of the parameters.
        prefix: put before the symbols' names, so that parameters of a law that the observer assumes differ from the
            plant's.
    """
    law = _known_law(spec, key, contact)
    symbols = {p.name: symbol(f"{prefix}{contact.name}_{p.name}") for p in law.parameters}
    faults = Faults()
    values: Values = {}
    names = [p.name for p in law.parameters]
    expected = f"name, law, unit and {', '.join(names)} of the law {law.name}; {HINT}"
    for name in contact.parameters:
        with faults.noting():
            refuse_unknown(name, names, spec.place(f"{key}.{name}"), "unknown key", expected, code="SPEC004")
    for p in law.parameters:
        with faults.noting():
            values[symbols[p.name]] = _value(spec, key, law, p, contact)
    faults.raise_noted()
    units = {symbols[p.name]: p.unit.format(F=contact.unit, q=slip_unit) for p in law.parameters}
    for name, given in contact.units.items():
        refuse_other_unit(given, units[symbols[name]], f"{name} in `{given}`", spec.place(f"{key}.{name}"))
    return law, symbols, values, units


def _known_law(spec: Spec, key: str, contact: Contact) -> FrictionLaw:
    """The law that a contact names; BadInput if there is no such law."""
    law = LAWS.get(contact.law)
    if law is None:
        synonym_of = ALSO_CALLED.get(contact.law.lower())
        found, nearest = f"unknown law `{contact.law}`", synonym_of or nearest_name(contact.law, LAWS)
        if synonym_of:
            parameters = ", ".join(p.name for p in LAWS[synonym_of].parameters)
            found += f", another name for `{synonym_of}`: its parameters are {parameters}"
        expected = f"one of {', '.join(LAWS)}; {HINT}"
        raise BadInput(spec.place(f"{key}.law"), found, expected, nearest, code="SPEC008")
    return law


def _slip_unit(spec: Spec, distribution: Matrix, index: int, contact: Contact) -> str:
    """The unit of a contact's slip: that of the first coordinate on which it acts.

    Where ``sliding`` says which bodies slide on each other, the slip may be a length although the coordinate is an
    angle. The unit is then m if the friction is a force, and rad if it is a torque.
    """
    touched = [i for i in range(len(spec.coordinates)) if distribution[i, index] != 0]
    if not touched:
        place = spec.place("friction.distribution" if contact.sliding is None else f"friction.contacts[{index}]")
        raise BadInput(
            place, f"column {index + 1} of zeros", f"a coordinate on which {contact.name} acts", code="SPEC019"
        )
    if contact.sliding is not None:
        place = spec.place(f"friction.contacts[{index}].unit")
        return "m" if dimension(parse_unit(contact.unit, place)) == dimension(parse_unit("N", place)) else "rad"
    return spec.coordinates[touched[0]].unit


def _value(spec: Spec, key: str, law: FrictionLaw, p: LawParameter, contact: Contact) -> Any:
    """The exact value of a law's parameter, or its default."""
    if p.name not in contact.parameters:
        if p.default is None:
            found = f"`{p.name}` ({p.meaning}) is missing"
            raise BadInput(spec.place(key), found, f"`{p.name}:` for the law {law.name}", code="SPEC003")
        return sympy.Rational(p.default)
    value = contact.parameters[p.name]
    if p.lowest is not None and (value < p.lowest or (p.positive and value == p.lowest)):
        raise BadInput(spec.place(f"{key}.{p.name}"), f"{p.meaning} {float(value):g}", admissible(p), code="SPEC007")
    return value


def admissible(p: LawParameter) -> str:
    """The admissible range of a parameter in words."""
    if p.lowest is None:
        return "a number"
    if p.lowest == 0:
        return "a positive number" if p.positive else "zero or a positive number"
    return f"a number above {p.lowest}" if p.positive else f"a number of at least {p.lowest}"

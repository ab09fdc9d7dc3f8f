"""Reading of the sections ``observer`` and ``cancellation``."""

from collections.abc import Sequence
from typing import Any

import sympy

from codegen.base.errors import BadInput, Faults, PlaceOf, refuse_unknown
from codegen.spec.expression import exact_number, parse_expression
from codegen.spec.free_gains import read_free_gains
from codegen.spec.model import CancellationChoice, Contact, DomainChoice, ObserverChoice, symbol
from codegen.spec.quantity import read_numbers, read_quantity
from codegen.spec.schema import CancellationSection, ObserverSection

SLIP_SPEED = "s"
"""The variable |u| in the function ``h`` of a spec."""


def read_observer(
    section: ObserverSection | None, contacts: Sequence[Contact], place: PlaceOf
) -> ObserverChoice | None:
    """The observer section of a spec; None without one.

    ``contacts``: of the spec; the section's ``laws`` may give a law that the observer assumes for each.
    """
    if section is None:
        return None
    faults = Faults()
    period = faults.result(_sample_time, section, place)
    exponent = faults.result(exact_number, section.exponent, place("observer.exponent"))
    shape = faults.result(_shape, section, place)
    laws = {name: faults.result(_assumed, section, name, contacts, place) for name in section.laws}
    gains = {
        name: faults.result(read_free_gains, raw, f"observer.gains.{name}", place)
        for name, raw in section.gains.items()
    }
    domain = faults.result(_domain, section, place)
    faults.raise_noted()
    assumed = {name: law for name, law in laws.items() if law is not None}
    return ObserverChoice(
        section.kind, section.velocity, gains, period, exponent, shape, assumed, section.integration, domain
    )


def _sample_time(section: ObserverSection, place: PlaceOf) -> sympy.Rational:
    period = read_quantity(section.sample_time, "s", place("observer.sample_time"))
    if period <= 0:
        found = f"sample time {section.sample_time}"
        raise BadInput(place("observer.sample_time"), found, "a positive time in s", code="SPEC007")
    return period


def _shape(section: ObserverSection, place: PlaceOf) -> sympy.Expr | None:
    """The function ``h`` of the section; None without one."""
    if section.h is None:
        return None
    where = place("observer.h")
    if "exponent" in section.model_fields_set:
        expected = "one of them: an exponent mu means h = s**mu"
        raise BadInput(where, "both `h` and `exponent`", expected, code="SPEC005")
    return parse_expression(section.h, where).symbolic({SLIP_SPEED: symbol(SLIP_SPEED)})


def _domain(section: ObserverSection, place: PlaceOf) -> DomainChoice | None:
    """The domain of the section, with exact numbers; None without one."""
    given = section.domain
    if given is None:
        return None
    numbers: dict[str, Any] = {}
    for key in sorted(given.model_fields_set):
        where, text = place(f"observer.domain.{key}"), getattr(given, key)
        if text is None:
            raise BadInput(where, "nothing", "a number; leave the key out if there is none", code="SPEC006")
        numbers[key] = read_quantity(text, "s", where) if key == "settle" else exact_number(text, where)
        if not numbers[key] > 0:
            raise BadInput(where, f"{key} {text}", "a positive number", code="SPEC007")
    return DomainChoice(**numbers)


def _assumed(section: ObserverSection, name: str, contacts: Sequence[Contact], place: PlaceOf) -> Contact:
    """A contact with the law that the observer assumes for it, in the force unit of the plant's."""
    key = f"observer.laws.{name}"
    refuse_unknown(name, [c.name for c in contacts], place(key), "unknown contact", code="SPEC008")
    unit = next(c.unit for c in contacts if c.name == name)
    law = section.laws[name]
    values, units = read_numbers(law.model_extra or {}, key, place)
    return Contact(name, law.law, unit, values, units=units)


def read_cancellation(
    section: CancellationSection | None, contacts: Sequence[Contact], place: PlaceOf
) -> CancellationChoice | None:
    """The cancellation section of a spec; None without one."""
    if section is None:
        return None
    gain = exact_number(section.gain, place("cancellation.gain"))
    if not 0 < gain <= 2:
        expected = "a factor on the friction estimate: above 0, up to 2"
        raise BadInput(place("cancellation.gain"), f"gain {section.gain}", expected, code="SPEC007")
    damping = exact_number(section.damping, place("cancellation.damping"))
    if damping < 0:
        words = f"damping {section.damping}"
        raise BadInput(place("cancellation.damping"), words, "0 or a positive number", code="SPEC007")
    if damping and section.method == "appendix_b":
        found = "`damping` with `method: appendix_b`, which does not use it"
        raise BadInput(place("cancellation.damping"), found, "method: minimum_norm", "minimum_norm", code="SPEC022")
    chosen = section.contacts
    if isinstance(chosen, str):
        return CancellationChoice(section.method, section.weight, gain, chosen, damping)
    names = [c.name for c in contacts]
    for k, name in enumerate(chosen):
        refuse_unknown(name, names, place(f"cancellation.contacts[{k}]"), "unknown contact", code="SPEC008")
    if not chosen or len(set(chosen)) < len(chosen):
        expected = "names of contacts, each once"
        raise BadInput(place("cancellation.contacts"), "no contact, or one twice", expected, code="SPEC015")
    return CancellationChoice(section.method, section.weight, gain, tuple(chosen), damping)

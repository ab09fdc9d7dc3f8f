"""Adding an effect to a System, with a check that its parameters can be identified at all."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import astuple
from typing import Any

import sympy

from codegen.base.errors import BadInput, Place
from codegen.effects.effect import Effect
from codegen.friction import DynamicLaw
from codegen.mechanics.system import ContactFriction, System


def added(
    effect: Effect, system: System, place: int, symbols: Mapping[str, sympy.Symbol], where: Place | str
) -> System:
    """The system with an effect at a place.

    Args:
        symbols: of the effect's parameters; none of them in the system's equations yet.

    Raises:
        BadInput: if a parameter appears in no equation, or the effect changes the coordinates, inputs or contacts.
    """
    after = effect.add(system, place, symbols)
    if _consists_of(after) != _consists_of(system):
        found = f"{effect.kind} adds or removes coordinates, inputs or contacts"
        expected = "an `add` that leaves these as they are; for a load behind a spring, add a transmission"
        raise BadInput(where, found, expected, code="SPEC021")
    held = set().union(*(sympy.sympify(e).free_symbols for e in _changed(system, after)))
    without = [name for name, s in symbols.items() if s not in held]
    if without:
        found = f"no equation of the machine depends on {', '.join(f'`{name}`' for name in without)} of {effect.kind}"
        expected = "an `add` that puts every parameter into a force, level, law, inertia, stage, sensor or transmission"
        raise BadInput(where, found, expected, code="SPEC021")
    return after


def _consists_of(system: System) -> tuple[Any, ...]:
    names = [c.name for c in system.contacts]
    return system.positions, system.velocities, system.inputs, names


def _changed(before: System, after: System) -> Iterator[Any]:
    """The expressions of a system that differ from another's."""
    for name in ("mass_matrix", "force", "distribution"):
        yield from (new for new, old in zip(getattr(after, name), getattr(before, name), strict=True) if new != old)
    for contact, old in zip(after.contacts, before.contacts, strict=True):
        if contact != old:
            yield from (contact.extra_level, contact.extra_force, *_law(contact))
    for chain in after.actuators.values():
        yield from chain.numbers
    yield from after.sensor_errors.values()
    for transmission in after.transmissions:
        yield from astuple(transmission)


def _law(contact: ContactFriction) -> Iterator[Any]:
    law, p = contact.law, contact.law_parameters
    yield contact.law_level
    if isinstance(law, DynamicLaw):
        states = tuple(sympy.Dummy(state.name) for state in law.states)
        yield from (law.force(contact.slip, states, p), *law.rates(contact.slip, states, p))

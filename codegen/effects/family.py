"""Relations between effect classes: inherited kinds, and user effects that are identical to a shipped one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from codegen.effects import CATALOGUE, Effect
from codegen.effects.declare import effect_symbols, places_of
from codegen.effects.register import is_own
from codegen.mechanics.system import ContactFriction, System


def kinds_of(kind: str) -> set[str]:
    """A kind and the kinds of its base classes, whose confusions it inherits."""
    classes = type(CATALOGUE[kind]).__mro__
    return {kind, *(c.kind for c in classes if issubclass(c, Effect) and "kind" in vars(c))}


def candidates(system: System) -> Iterator[tuple[Effect, int]]:
    """(effect, place) of the catalogue wherever it applies; a user's own replaces an identical shipped effect."""
    for effect in CATALOGUE.values():
        users = [] if is_own(effect.kind) else [CATALOGUE[k] for k in CATALOGUE if is_own(k)]
        for place in range(len(places_of(effect, system))):
            if effect.applies(system, place) and not any(is_identical(own, effect, system, place) for own in users):
                yield effect, place


def is_identical(own: Effect, effect: Effect, system: System, place: int) -> bool:
    """Whether a user's effect is identical to one it is derived from: same parameters, same change of the System."""
    comes_from_it = isinstance(own, type(effect)) and own.sits_on == effect.sits_on
    if not comes_from_it or [p.name for p in own.parameters] != [p.name for p in effect.parameters]:
        return False
    if not own.applies(system, place):
        return False
    symbols = effect_symbols(effect, places_of(effect, system)[place], system)
    changed = [e.add(system, place, symbols) for e in (own, effect)]
    return _compared(changed[0]) == _compared(changed[1])


def _compared(system: System) -> tuple[Any, ...]:
    """A System as a comparable value: laws have no equality of their own."""
    laws = [(type(c.law), vars(c.law)) for c in system.contacts]
    return replace(system, contacts=()), [_without_law(c) for c in system.contacts], laws


def _without_law(contact: ContactFriction) -> tuple[Any, ...]:
    return contact.slip, dict(contact.law_parameters), contact.extra_level, contact.extra_force

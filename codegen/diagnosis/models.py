"""Systems with refitted values and found effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import sympy

from codegen.diagnosis.candidates import Fit
from codegen.effects.declare import effect_symbols, unit_words
from codegen.mechanics.system import System


def with_values(system: System, refitted: Mapping[str, float]) -> System:
    """The system with refitted values; a friction level below zero is zero."""
    levels = {s.name for contact in system.contacts for s in contact.law_parameters.values()}
    new = {s: refitted[s.name] for s in system.values if s.name in refitted}
    return system.with_parameters({s: sympy.Float(max(v, 0.0) if s.name in levels else v) for s, v in new.items()}, {})


def with_effect(system: System, fit: Fit) -> System:
    """The system with one fitted effect declared in it."""
    symbols = effect_symbols(fit.effect, fit.on, system)
    units = unit_words(fit.effect, fit.place, system)
    system = system.with_parameters(
        {s: sympy.Float(fit.parameters[name]) for name, s in symbols.items()},
        {s: units[name] for name, s in symbols.items()},
    )
    return fit.effect.add(system, fit.place, symbols)


def with_effects(system: System, fits: Sequence[Fit]) -> System:
    for fit in fits:
        system = with_effect(system, fit)
    return system

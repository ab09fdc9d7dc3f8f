"""Systems with refitted values and with found effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.diagnosis.results import FoundEffect
from codegen.diagnosis.trial import Trial
from codegen.effects import CATALOGUE
from codegen.effects.declare import effect_symbols, places_of, unit_words
from codegen.mechanics.system import System

Array = NDArray[np.float64]


def with_values(system: System, refitted: Mapping[str, float]) -> System:
    """The system with refitted values; a negative friction level becomes zero."""
    levels = {s.name for contact in system.contacts for s in contact.law_parameters.values()}
    new = {s: refitted[s.name] for s in system.values if s.name in refitted}
    return system.with_parameters({s: sympy.Float(max(v, 0.0) if s.name in levels else v) for s, v in new.items()}, {})


def with_effects(system: System, found: Sequence[FoundEffect]) -> System:
    """The system with fitted effects added to it."""
    for one in found:
        effect = CATALOGUE[one.kind].with_parameters(list(one.parameters))
        place = places_of(effect, system).index(one.on)
        symbols = effect_symbols(effect, one.on, system)
        units = unit_words(effect, place, system)
        system = system.with_parameters(
            {s: sympy.Float(one.parameters[name]) for name, s in symbols.items()},
            {s: units[name] for name, s in symbols.items()},
        )
        system = effect.add(system, place, symbols)
    return system


def model_of(trial: Trial, theta: Array) -> System:
    """The system with the values of a fit's vector: refitted parameters, and each part with its own."""
    moved, found = trial.split(theta)
    values = dict(zip((s.name for s in trial.moved), map(float, moved), strict=True))
    effects = [FoundEffect(p.kind, p.on, one, {}) for p, one in zip(trial.parts, found, strict=True)]
    return with_effects(with_values(trial.system, values), effects)

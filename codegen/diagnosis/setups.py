"""Changes of a machine between two logs of the same motion: load, payload, mounting, speed, temperature.

A log under one load cannot tell load-dependent friction from a larger Coulomb level, and a log in one mounting cannot
tell weight from an offset of the drive. A known change of the machine, or one that affects all friction alike, can.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import sympy

from codegen.diagnosis.measure import drive_force, inverse_mass
from codegen.diagnosis.signals import Motion
from codegen.diagnosis.trial import Part
from codegen.mechanics.system import System

Kind = Literal["none", "load", "payload", "mounting", "speed", "temperature"]

LOAD = 0.5
"""Constant force of the additional load, over the RMS drive force."""
PAYLOAD = 0.5
"""Added inertia over a coordinate's mean inertia."""
PACES = (0.5, 2.0)
"""Factors on the speed along the log's path."""
WARM = 0.7
"""Factor on the friction of all contacts at another temperature; unknown to the fit."""
MASSES = {"m": "kg", "rad": "kg·m²"}
DIGITS = 2


@dataclass(frozen=True)
class Setup:
    """One change of the machine.

    Attributes:
        words: the change in words, for the report.
        pace: factor on the speed along the log's path.
        force, inertia: known additions, SI, by index of the coordinate.
        turned: whether gravity acts in the opposite direction.
        friction: unknown factor on the friction of all contacts; None for no change.
    """

    kind: Kind
    words: str
    pace: float = 1.0
    force: Mapping[int, float] | None = None
    inertia: Mapping[int, float] | None = None
    turned: bool = False
    friction: float | None = None

    def base(self, system: System) -> System:
        """The declared system with the known part of the change: added forces and inertias."""
        for i, value in (self.force or {}).items():
            system = system.with_force(i, sympy.Float(value))
        for i, value in (self.inertia or {}).items():
            system = system.with_inertia(i, sympy.Float(value))
        return system

    def values(self, part: Part, values: Mapping[str, float], factor: float) -> dict[str, float]:
        """The parameters of an effect after the change; ``factor`` is that of friction."""
        changed = part.effect.turned(values) if self.turned else dict(values)
        if self.friction is None or part.effect.sits_on != "contact":
            return changed
        sized = {p.name: p.neutral for p in part.effect.parameters if p.neutral is not None}
        return {n: sized[n] + factor * (v - sized[n]) if n in sized else v for n, v in changed.items()}


def setups(system: System, motion: Motion, parts: Sequence[Part]) -> list[Setup]:
    """The log's motion repeated, and every change that is possible on the machine.

    Args:
        parts: effects of all models to be discriminated.
    """
    drive = np.sqrt(np.mean(drive_force(system, motion)[motion.usable] ** 2, axis=0))
    inertia = 1 / np.maximum(np.diagonal(inverse_mass(system, motion).mean(axis=0)), 1e-300)
    found = [Setup("none", "the same motion again, nothing changed")]
    for i, x in enumerate(system.positions):
        force, more = _short(LOAD * drive[i]), _short(PAYLOAD * float(inertia[i]))
        if force > 0:
            unit = _words(system.force_unit(i))
            found.append(Setup("load", f"a constant force of {force:g} {unit} on {x.name}", force={i: force}))
        if system.position_units[i] in MASSES:
            unit = MASSES[system.position_units[i]]
            words = f"{more:g} {unit} more on {x.name}, balanced so that its weight does not pull"
            found.append(Setup("payload", words, inertia={i: more}))
    ones = [(part.effect, dict.fromkeys(part.names, 1.0)) for part in parts]
    if any(effect.turned(values) != values for effect, values in ones):
        words = "the machine mounted upside down, so that weight pulls the other way"
        found.append(Setup("mounting", words, turned=True))
    for pace in PACES:
        words = "half" if pace < 1 else "twice"
        found.append(Setup("speed", f"the same path at {words} the speed", pace=pace))
    if any(part.effect.sits_on == "contact" for part in parts):
        words = "the machine at another temperature, cold or warm, at which its friction has changed"
        found.append(Setup("temperature", words, friction=WARM))
    return found


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _words(unit: str) -> str:
    return unit.replace("*", "·")

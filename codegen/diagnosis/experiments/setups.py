"""Changes of a machine that discriminate between effects: load, payload, mounting, speed, temperature.

With one load, load-dependent friction and a larger Coulomb level give the same log; in one mounting, so do weight and
an offset of the drive. A second log of the same motion after a change distinguishes them.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import sympy

from codegen.diagnosis.fit.measure import drive_force, inverse_mass
from codegen.diagnosis.fit.signals import Motion
from codegen.diagnosis.fit.trial import Part
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
"""Significant digits of proposed loads and payloads."""


@dataclass(frozen=True)
class Setup:
    """One change of the machine, or of the speed of its motion by the factor ``pace``.

    Attributes:
        force, inertia: known additional force and inertia, SI: index of the coordinate → value.
        turned: whether gravity acts in the opposite direction.
        friction: factor on the friction of all contacts, which the fit does not know; None for no change.
    """

    kind: Kind
    words: str
    pace: float = 1.0
    force: Mapping[int, float] | None = None
    inertia: Mapping[int, float] | None = None
    turned: bool = False
    friction: float | None = None

    def base(self, system: System) -> System:
        """The declared system with the known additional forces and inertias."""
        for i, value in (self.force or {}).items():
            system = system.with_force(i, sympy.Float(value))
        for i, value in (self.inertia or {}).items():
            system = system.with_inertia(i, sympy.Float(value))
        return system

    def values(self, part: Part, values: Mapping[str, float], factor: float) -> dict[str, float]:
        """The parameters of an effect after the change, with friction times a factor.

        A parameter of an effect on a contact becomes neutral + factor (value − neutral), where it has a neutral value.
        """
        changed = part.effect.turned(values) if self.turned else dict(values)
        if self.friction is None or part.effect.sits_on != "contact":
            return changed
        neutral = {p.name: p.neutral for p in part.effect.parameters if p.neutral is not None}
        return {n: neutral[n] + factor * (v - neutral[n]) if n in neutral else v for n, v in changed.items()}


def setups(system: System, motion: Motion, parts: Sequence[Part], loaded: Collection[int]) -> list[Setup]:
    """The unchanged machine, as a reference, and every change that this machine and the models' effects allow.

    Args:
        loaded: coordinates that may have another load or payload.
    """
    drive = np.sqrt(np.mean(drive_force(system, motion)[motion.usable] ** 2, axis=0))
    inertia = 1 / np.maximum(np.diagonal(inverse_mass(system, motion).mean(axis=0)), 1e-300)
    possible = [Setup("none", "the same motion again, nothing changed")]
    for i in sorted(loaded):
        x = system.positions[i]
        force, added_inertia = _short(LOAD * drive[i]), _short(PAYLOAD * float(inertia[i]))
        if force > 0:
            unit = system.force_unit(i).replace("*", "·")
            possible.append(Setup("load", f"a constant force of {force:g} {unit} on {x.name}", force={i: force}))
        if system.position_units[i] in MASSES:
            unit = MASSES[system.position_units[i]]
            words = f"{added_inertia:g} {unit} more on {x.name}, balanced so that its weight does not pull"
            possible.append(Setup("payload", words, inertia={i: added_inertia}))
    ones = [(part.effect, dict.fromkeys(part.names, 1.0)) for part in parts]
    if any(effect.turned(values) != values for effect, values in ones):
        words = "the machine mounted upside down, so that weight pulls the other way"
        possible.append(Setup("mounting", words, turned=True))
    for pace in PACES:
        words = "half" if pace < 1 else "twice"
        possible.append(Setup("speed", f"the same path at {words} the speed", pace=pace))
    if any(part.effect.sits_on == "contact" for part in parts):
        words = "the machine at another temperature, cold or warm, at which its friction has changed"
        possible.append(Setup("temperature", words, friction=WARM))
    return possible


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")

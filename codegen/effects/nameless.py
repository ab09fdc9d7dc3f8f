"""Forces over position that the catalogue has no name for, as rivals of the effects that look like them.

Along a motion in which friction takes most of the drive force, that force is nearly a constant with the sign of the
speed. A force in proportion to it and periodic in position, such as a torque ripple of a motor that grows with the
current, is then nearly friction that depends on position; under a constant weight it is nearly cogging. A diagnosis
fits these forces in place of a named effect, and does not name that effect where they explain the log as well.
"""

from __future__ import annotations

from dataclasses import replace

import sympy

from codegen.effects import CATALOGUE
from codegen.effects.effect import Effect
from codegen.effects.periodic import AMPLITUDE, PERIOD, PHASE, Cogging, PositionDependentFriction
from codegen.effects.places import drive_force
from codegen.mechanics.system import System
from codegen.spec.functions import Magnitude

SHARE = replace(AMPLITUDE, unit="1", meaning="amplitude over the drive force")


class DriveOverPosition(PositionDependentFriction):
    """λ −= L·amplitude sin(2π s/period + phase), with L the force of the inputs in the direction of the contact."""

    kind = "drive_force_over_position"
    equation = "λ −= L·amplitude·sin(2π s/period + phase), and the same of amplitude_2 with 4π where given"
    signature = "a force in proportion to the drive force and periodic in position"
    parameters = (SHARE, PERIOD, PHASE)
    more_forms = ((*parameters, replace(SHARE, name="amplitude_2"), replace(PHASE, name="phase_2")),)
    nameless = ()

    def applies(self, system: System, place: int) -> bool:
        return bool(drive_force(system, place) != 0)

    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        return system.with_contact_force(place, -drive_force(system, place) * wave)


class _DriveOnCoordinate(Cogging):
    """Base class of forces in proportion to the force L of the inputs on a coordinate, or to its magnitude."""

    parameters = (SHARE, PERIOD, PHASE)
    nameless = ()

    def applies(self, system: System, place: int) -> bool:
        return bool(_drive_on(system, place) != 0)


class DriveWave(_DriveOnCoordinate):
    """e = L·amplitude sin(2π x/period + phase)."""

    kind = "drive_force_wave"
    equation = "e = L·amplitude·sin(2π x/period + phase)"
    signature = DriveOverPosition.signature

    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        return system.with_force(place, _drive_on(system, place) * wave)


class LoadWave(_DriveOnCoordinate):
    """e = |L|·amplitude sin(2π x/period + phase)."""

    kind = "load_wave"
    equation = "e = |L|·amplitude·sin(2π x/period + phase)"
    signature = "a force in proportion to the magnitude of the drive force and periodic in position"

    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        return system.with_force(place, Magnitude(_drive_on(system, place)) * wave)


def _drive_on(system: System, coordinate: int) -> sympy.Expr:
    """The force of the inputs on a coordinate: g(w) − g(0)."""
    force = system.force[coordinate]
    return sympy.expand(force - force.subs(dict.fromkeys(system.inputs, 0)))


NAMELESS: dict[str, Effect] = {effect.kind: effect for effect in (DriveOverPosition(), DriveWave(), LoadWave())}
"""Kind → effect; no spec declares one, and no verdict names one."""


def effect_called(kind: str) -> Effect:
    """The effect of a kind, of the catalogue or nameless."""
    return NAMELESS[kind] if kind in NAMELESS else CATALOGUE[kind]

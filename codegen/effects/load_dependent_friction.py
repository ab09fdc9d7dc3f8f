"""Friction that grows with the transmitted load: gears, screws, belts, bearings."""

from __future__ import annotations

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import drive_force
from codegen.mechanics.system import System
from codegen.spec.functions import Magnitude

NEEDS = "a contact on a coordinate that an input drives"
SEVERAL_LOADS = "several loads, driving and back-driving"


class LoadDependentFriction(Effect):
    """level += mu |L|, L the generalised drive force on the contact's coordinate."""

    kind = "load_dependent_friction"
    sits_on = "contact"
    equation = "level += mu·|L|"
    signature = "a step at reversal whose height follows the drive force"
    seen_over = "load"
    parameters = (EffectParameter("mu", "1", "share of the drive force", low=0.0, neutral=0.0),)
    confused_with = (
        Confusion("input_gain", SEVERAL_LOADS),
        Confusion("drive_backdrive_friction", SEVERAL_LOADS),
    )
    needs = NEEDS

    def applies(self, system: System, place: int) -> bool:
        return bool(drive_force(system, place) != 0)

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_level(place, p["mu"] * Magnitude(drive_force(system, place)))


class DriveBackdriveFriction(Effect):
    """level += mu_drive |L| where the drive pushes along the slip and mu_back |L| where it brakes.

    Written without a jump: the mean of the two acts on |L| as a level, half their difference on L as a force, since
    sgn(u)·|L|·sgn(L u) = L.
    """

    kind = "drive_backdrive_friction"
    sits_on = "contact"
    equation = "level += mu_drive·|L| for L·u > 0, mu_back·|L| for L·u < 0"
    signature = "a step at reversal whose height follows the drive force, another one in driving than in braking"
    seen_over = "load"
    refines = "load_dependent_friction"
    parameters = (
        EffectParameter("mu_drive", "1", "share of the drive force while it drives", low=0.0, neutral=0.0),
        EffectParameter("mu_back", "1", "share of the drive force while it is driven back", low=0.0, neutral=0.0),
    )
    confused_with = (
        Confusion("load_dependent_friction", SEVERAL_LOADS),
        Confusion("input_gain", SEVERAL_LOADS),
    )
    needs = NEEDS

    def applies(self, system: System, place: int) -> bool:
        return bool(drive_force(system, place) != 0)

    def add(self, system: System, place: int, p: Symbols) -> System:
        load = drive_force(system, place)
        mean, half = (p["mu_drive"] + p["mu_back"]) / 2, (p["mu_drive"] - p["mu_back"]) / 2
        return system.with_level(place, mean * Magnitude(load)).with_contact_force(place, half * load)

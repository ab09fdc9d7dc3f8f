"""Force laws outside the catalogue, as alternative explanations of the effects that they resemble.

Along a motion in which friction takes most of the drive force, that force is nearly a constant with the sign of the
speed. A force in proportion to it and periodic in position, such as a torque ripple of a motor that grows with the
current, is then nearly friction that depends on position; under a constant weight it is nearly cogging. A diagnosis
fits these forces in place of a named effect, and does not name that effect where they explain the log as well.

Friction in proportion to speed and drive force, as of a loaded worm gear or bearing, is nearly a drag that grows with
the square of the speed, since a faster motion takes more force. It is fitted in place of ``viscous`` and
``quadratic_drag``.

A load that only friction drives, such as that of a belt that slips, is nearly one behind a spring and a strong damper.
It is fitted in place of ``compliance`` and ``backlash``.
"""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import sympy

from codegen.base.significant import in_percent
from codegen.effects import CATALOGUE
from codegen.effects.compliance import DAMPING, OnAxis
from codegen.effects.compliance import SHARE as LOAD_FRACTION
from codegen.effects.effect import Effect, EffectParameter, Symbols
from codegen.effects.periodic import AMPLITUDE, PERIOD, PHASE, Cogging, PositionDependentFriction
from codegen.effects.places import drive_force, drive_on
from codegen.effects.start import Covered
from codegen.mechanics.actuator import Transmission
from codegen.mechanics.system import System
from codegen.spec.functions import Magnitude

FRICTION_ALONE = (
    "To tell them apart, log accelerations several times smaller, at which friction holds: the load then moves with "
    "the motor, and a spring still rings"
)
ANOTHER_LOAD = (
    "To tell them apart, log the same motion under another load, slow motion against a load, and accelerations several "
    "times as large at the same speeds: friction and cogging stay as they are, and a force in proportion to the drive "
    "force grows with it"
)
LOADED_DAMPING = (
    "To tell them apart, log the same motion under another load: viscous friction and drag stay as they are, and a "
    "damping in proportion to the drive force grows with it"
)
SLIPPING_LOADS, SLIPPING_FORCES, SLIPPING_SPEEDS = (0.3, 0.5, 0.7), (0.3, 0.6, 1.0), (0.02, 0.3)
"""Starting values of a load that slips, as ratios: load to total inertia; limit of the friction to the force that moves
the load; slip speed at which the damper reaches this limit to the top speed."""
SHARE = replace(AMPLITUDE, unit="1", meaning="amplitude over the drive force")


class Nameless(Effect):
    """Base class of laws outside the catalogue, which no verdict names.

    Attributes:
        if_better: whether this law keeps an effect from being named only where it fits the log better, not where both
            fit alike; so for a law with more freedom than the effect, which fits alike wherever the effect does, and
            for one that is much rarer in machines.
        discriminating_experiment: the experiment that discriminates this law from the effect, in words for the user.
    """

    nameless: ClassVar[tuple[str, ...]] = ()
    if_better: ClassVar[bool] = False
    discriminating_experiment: ClassVar[str]

    @abstractmethod
    def in_words(self, values: Mapping[str, float], units: Mapping[str, str]) -> str:
        """The law with its values."""


class _ByDrive(Nameless):
    """Base class of forces in proportion to the force L of the inputs on a coordinate or along a contact."""

    def drive(self, system: System, place: int) -> sympy.Expr:
        """L, by the kind of place."""
        return drive_force(system, place) if self.sits_on == "contact" else drive_on(system, place)

    def applies(self, system: System, place: int) -> bool:
        return bool(self.drive(system, place) != 0)


class _Wave(_ByDrive):
    """Base class of forces in proportion to the drive force and periodic in position."""

    parameters = (SHARE, PERIOD, PHASE)

    discriminating_experiment = ANOTHER_LOAD

    def in_words(self, values: Mapping[str, float], units: Mapping[str, str]) -> str:
        share, period = in_percent(values["amplitude"]), f"{values['period']:.3g} {units['period']}"
        return f"{self.signature} (amplitude {share} of that, period {period})"


class DriveOverPosition(_Wave, PositionDependentFriction):
    """λ −= L·amplitude sin(2π s/period + phase)."""

    kind = "drive_force_over_position"
    equation = "λ −= L·amplitude·sin(2π s/period + phase), and the same of amplitude_2 with 4π where given"
    signature = "a force in proportion to the drive force and periodic in position"
    more_forms = ((SHARE, PERIOD, PHASE, replace(SHARE, name="amplitude_2"), replace(PHASE, name="phase_2")),)

    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        return system.with_contact_force(place, -self.drive(system, place) * wave)


class DriveWave(_Wave, Cogging):
    """e = L·amplitude sin(2π x/period + phase)."""

    kind = "drive_force_wave"
    equation = "e = L·amplitude·sin(2π x/period + phase)"
    signature = DriveOverPosition.signature

    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        return system.with_force(place, self.drive(system, place) * wave)


class LoadWave(_Wave, Cogging):
    """e = |L|·amplitude sin(2π x/period + phase).

    A force that is even in the drive, as of a rotor whose reluctance the current changes, is much rarer than cogging,
    which every motor with magnets has; where both fit alike, cogging is named.
    """

    kind = "load_wave"
    equation = "e = |L|·amplitude·sin(2π x/period + phase)"
    signature = "a force in proportion to the magnitude of the drive force and periodic in position"
    if_better = True

    def act(self, system: System, place: int, wave: sympy.Expr) -> System:
        return system.with_force(place, Magnitude(self.drive(system, place)) * wave)


class _DriveDamping(_ByDrive):
    """Base class of damping in proportion to the magnitude of the drive force."""

    seen_over = "velocity"
    signature = "a braking force in proportion to the speed and to the magnitude of the drive force"
    parameters = (EffectParameter("c", "s/{q}", "damping coefficient over the drive force", neutral=0.0),)
    if_better = True
    discriminating_experiment = LOADED_DAMPING

    def in_words(self, values: Mapping[str, float], units: Mapping[str, str]) -> str:
        return f"{self.signature} (c = {values['c']:.3g} {units['c']})"


class DriveViscous(_DriveDamping):
    """λ += c·|L|·u."""

    kind = "drive_viscous"
    sits_on = "contact"
    equation = "λ += c·|L|·u"

    def add(self, system: System, place: int, p: Symbols) -> System:
        slip = system.contacts[place].slip
        return system.with_contact_force(place, p["c"] * Magnitude(self.drive(system, place)) * slip)


class DriveDrag(_DriveDamping):
    """e = −c·|L|·v."""

    kind = "drive_drag"
    sits_on = "coordinate"
    equation = "e = −c·|L|·v"

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_force(place, -p["c"] * Magnitude(self.drive(system, place)) * system.velocities[place])


class SlippingLoad(Nameless, OnAxis):
    """A load that friction drives: (1 − ρ)·M at the motor, ρ·M at the load, c·dv/(1 + |c·dv|/limit) between them."""

    kind = "slipping_load"
    equation = "(1 − ρ)·M at the motor, ρ·M at the load; between them c·dv/(1 + |c·dv|/limit)"
    signature = "a load that slips, driven by friction alone"
    parameters = (DAMPING, EffectParameter("limit", "{F}", "greatest force on the load", low=0.0), LOAD_FRACTION)
    if_better = True
    discriminating_experiment = FRICTION_ALONE

    def add(self, system: System, place: int, p: Symbols) -> System:
        slip = Transmission(place, sympy.S.Zero, p["c"], p["load_fraction"], limit=p["limit"])
        return system.with_transmission(slip)

    def starts(self, covered: Covered) -> list[dict[str, float]]:
        """Limits about the force that moves the load, approached at small or at large shares of the top speed."""
        return [
            {"c": limit / (speed * covered.top_speed), "limit": limit, "load_fraction": load}
            for load in SLIPPING_LOADS
            for limit in (share * load * covered.force for share in SLIPPING_FORCES)
            for speed in SLIPPING_SPEEDS
        ]

    def in_words(self, values: Mapping[str, float], units: Mapping[str, str]) -> str:
        share, limit = in_percent(values["load_fraction"]), f"{values['limit']:.3g} {units['limit']}"
        return f"{self.signature} ({share} of the inertia, at most {limit})"


_LAWS: tuple[Nameless, ...] = (
    DriveOverPosition(),
    DriveWave(),
    LoadWave(),
    DriveViscous(),
    DriveDrag(),
    SlippingLoad(),
)
NAMELESS: dict[str, Nameless] = {effect.kind: effect for effect in _LAWS}
"""Kind → effect; no spec declares one, and no verdict names one."""


def effect_called(kind: str) -> Effect:
    """The effect of a kind, of the catalogue or nameless."""
    return NAMELESS[kind] if kind in NAMELESS else CATALOGUE[kind]

"""Effects on coordinates: forces of position and velocity, and inertia."""

from collections.abc import Mapping
from typing import ClassVar

from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.places import lone_contacts, pair_contacts, pairs, sole_drive
from codegen.mechanics.system import System
from codegen.spec.functions import Magnitude


class Offset(Effect):
    """Constant force e = f0; e is a force added to g, the right side of the equation of motion, here and below."""

    kind = "offset"
    sits_on = "coordinate"
    equation = "e = f0"
    signature = "a constant force, whatever the motion"
    seen_over = "time"
    parameters = (EffectParameter("f0", "{F}", "constant force", neutral=0.0),)
    confused_with = (
        Confusion("coulomb_asymmetry", "a log in another mounting; in one mounting both are a constant force"),
        Confusion("gravity_imbalance", "another position of the axis"),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_force(place, p["f0"])

    def turned(self, values: Mapping[str, float]) -> dict[str, float]:
        """−f0: a constant force that changes its sign when the machine is turned over is a weight."""
        return {"f0": -values["f0"]}

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        return [("coulomb_asymmetry", system.contacts[c].name) for c in lone_contacts(system, place)]


class Spring(Effect):
    """Linear spring to ground: e = −k x."""

    kind = "spring"
    sits_on = "coordinate"
    equation = "e = −k·x"
    signature = "a force proportional to position, the same in both directions"
    seen_over = "position"
    parameters = (EffectParameter("k", "{F}/{q}", "stiffness", neutral=0.0),)
    confused_with = (
        Confusion("hardening_spring", "a range on both sides of zero, twice as wide"),
        Confusion("gravity_imbalance", "a wider range, on which the force of a spring keeps rising"),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_force(place, -p["k"] * system.positions[place])


class HardeningSpring(Effect):
    """Hardening (cubic) spring: e = −k3 x³."""

    kind = "hardening_spring"
    sits_on = "coordinate"
    equation = "e = −k3·x³"
    signature = "a force that grows with the cube of position, the same in both directions"
    seen_over = "position"
    parameters = (EffectParameter("k3", "{F}/{q}^3", "cubic stiffness", neutral=0.0),)
    confused_with = (Confusion("spring", "a range on both sides of zero, twice as wide"),)

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_force(place, -p["k3"] * system.positions[place] ** 3)


class QuadraticDrag(Effect):
    """Quadratic drag: e = −c v |v|."""

    kind = "quadratic_drag"
    sits_on = "coordinate"
    equation = "e = −c·v·|v|"
    signature = "a braking force that grows with the square of velocity"
    seen_over = "velocity"
    parameters = (EffectParameter("c", "{F}*s^2/{q}^2", "drag coefficient", neutral=0.0),)
    nameless: ClassVar[tuple[str, ...]] = ("drive_drag",)
    confused_with = (
        Confusion("viscous", "a speed ladder over two decades"),
        Confusion("stribeck", "slow motion, where a wide Stribeck curve still falls"),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        v = system.velocities[place]
        return system.with_force(place, -p["c"] * v * Magnitude(v))


class InertiaError(Effect):
    """Error of an inertia: M_ii += delta."""

    kind = "inertia_error"
    sits_on = "coordinate"
    equation = "M_ii += delta"
    signature = "a force proportional to acceleration"
    seen_over = "acceleration"
    parameters = (EffectParameter("delta", "{F}*s^2/{q}", "added inertia", neutral=0.0),)
    demands = "an inertia above 0 with delta"
    confused_with = (
        Confusion("input_gain", "another force on the axis: a known load or spring"),
        Confusion("input_delay", "two frequencies"),
        Confusion("presliding", "two frequencies"),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_inertia(place, p["delta"])

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        drive = sole_drive(system, place)
        return [] if drive is None else [("input_gain", system.inputs[drive].name)]

    def admissible(self, system: System, place: int, values: Mapping[str, float]) -> bool:
        """Within the bounds, and M_ii + delta stays positive."""
        declared = system.mass_matrix[place, place].subs(system.values).subs(dict.fromkeys(system.positions, 0))
        return float(declared) + values["delta"] > 0


class Coupling(Effect):
    """Viscous coupling of two coordinates: e₁ = −c (v₁ − v₂), e₂ = +c (v₁ − v₂)."""

    kind = "coupling"
    sits_on = "two coordinates"
    equation = "e₁ = −c·(v₁ − v₂), e₂ = +c·(v₁ − v₂)"
    signature = "a force that grows with the difference of two velocities, equal and opposite on the two coordinates"
    seen_over = "velocity"
    parameters = (EffectParameter("c", "{F}*s/{q}", "viscous coefficient", neutral=0.0),)
    confused_with = (Confusion("viscous", "the two coordinates moved apart from each other: one held, one moved"),)
    needs = "two coordinates of one unit"

    def applies(self, system: System, place: int) -> bool:
        first, second = pairs(system)[place]
        return system.position_units[first] == system.position_units[second]

    def add(self, system: System, place: int, p: Symbols) -> System:
        first, second = pairs(system)[place]
        force = p["c"] * (system.velocities[first] - system.velocities[second])
        return system.with_force(first, -force).with_force(second, force)

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        return [("viscous", system.contacts[c].name) for c in pair_contacts(system, *pairs(system)[place])]

"""Effects on contacts: friction that depends on slip velocity, load, presliding distance or time."""

from collections.abc import Mapping, Set
from dataclasses import replace
from typing import ClassVar

import sympy

from codegen.base.significant import in_percent
from codegen.effects.coordinate import Between
from codegen.effects.effect import Confusion, Effect, EffectParameter, Intervals, Symbols
from codegen.effects.places import damping, drive_force, lone_coordinate, pair_contacts, pairs
from codegen.effects.start import Covered, bristles, slow_times, speeds
from codegen.friction.law import DynamicLaw, LawParameter, LawState, Ranges, States, Values
from codegen.friction.zero_memory import Coulomb
from codegen.mechanics.system import TIME, System
from codegen.spec.functions import Magnitude, Sgn

COEFFICIENT = EffectParameter(
    "b", "{F}*s/{q}", "viscous coefficient; of a curve, slope at rest less slope at high speed", neutral=0.0
)
# Bounds of seen_at: with a lower v_s the curve is nearly Coulomb friction over the whole log, with a higher one linear.
THINNING_SPEED = EffectParameter(
    "v_s", "{q}/s", "speed at which the slope has fallen by half of b", low=0.0, start=speeds, seen_at=(0.01, 3.0)
)
HIGH_SPEED_SLOPE = EffectParameter(
    "b_inf", "{F}*s/{q}", "slope of a curve at high speed, 0 where it is not given", neutral=0.0
)


class Viscous(Effect):
    """Viscous friction λ += b u, or with ``v_s`` the curve λ += b v_s ln(1 + |u|/v_s) sgn(u) + b_inf u.

    The slope of the curve falls from b + b_inf at standstill to b_inf, as with a shear-thinning lubricant: in harmonic
    drives, servo gears and greased bearings friction grows less than in proportion to speed. Where the declared
    model has a viscous term, b_inf may be negative and reduces it, at most to zero: a force that falls with speed
    without limit would do positive work.
    """

    kind = "viscous"
    sits_on = "contact"
    equation = "λ += b·u, or b·v_s·ln(1 + ∣u∣/v_s)·sgn(u) + b_inf·u where v_s is given"
    signature = "a force that grows with slip velocity and changes sign with it"
    seen_over = "velocity"
    parameters = (COEFFICIENT,)
    more_forms = ((COEFFICIENT, THINNING_SPEED), (COEFFICIENT, THINNING_SPEED, HIGH_SPEED_SLOPE))
    nameless: ClassVar[tuple[str, ...]] = ("drive_viscous",)
    confused_with = (
        Confusion("quadratic_drag", "a speed ladder over two decades"),
        Confusion("back-EMF", "a speed ladder over two decades"),
        Confusion("actuator_lag", "a speed ladder at constant speeds: a lag leaves nothing there"),
        Confusion("coupling", "one of the two coordinates held, the other moved"),
    )
    demands = "b above 0 where v_s is given, and b_inf no lower than minus the declared viscous coefficient"

    def admissible(self, system: System, place: int, values: Mapping[str, float]) -> bool:
        """Within the bounds, and a curve is one of viscous friction at all speeds.

        With a negative b it would be a Stribeck curve. With b_inf below minus the declared coefficient the sum would
        fall with speed without limit.
        """
        if not super().admissible(system, place, values):
            return False
        slope = damping(system, place).subs(system.values)
        known = slope.is_number and type(system.contacts[place].law) is Coulomb  # other laws may have one of their own
        falls = HIGH_SPEED_SLOPE.name in values and known and values[HIGH_SPEED_SLOPE.name] < slope
        return not falls and (THINNING_SPEED.name not in values or values["b"] > 0)

    def without(self, free: Set[str]) -> Effect | None:
        """As in ``Effect``; a curve whose b may be zero is the line of slope b_inf."""
        is_line = HIGH_SPEED_SLOPE in self.parameters and COEFFICIENT.name in free
        return self.forms[0] if is_line else super().without(free)

    def add(self, system: System, place: int, p: Symbols) -> System:
        slip = system.contacts[place].slip
        if THINNING_SPEED.name not in p:
            return system.with_contact_force(place, p["b"] * slip)
        curve = p["b"] * p["v_s"] * sympy.log(1 + Magnitude(slip) / p["v_s"]) * Sgn(slip)
        return system.with_contact_force(place, curve + p.get("b_inf", 0) * slip)

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        if THINNING_SPEED in self.parameters:
            return []  # a coupling is linear in speed
        x = system.positions
        between = [pair for pair in pairs(system) if place in pair_contacts(system, *pair)]
        return [("coupling", f"{x[i]}, {x[j]}") for i, j in between]


class ViscousAsymmetry(Effect):
    """Direction-dependent viscous friction λ += d_b |u|: the coefficient is b + d_b for u > 0, b − d_b for u < 0."""

    kind = "viscous_asymmetry"
    sits_on = "contact"
    equation = "λ += d_b·|u|"
    signature = "a force that grows with slip speed and keeps its sign when the motion turns"
    seen_over = "velocity"
    both_ways = True
    parameters = (EffectParameter("d_b", "{F}*s/{q}", "half the difference of the viscous coefficients", neutral=0.0),)
    confused_with = (
        Confusion("viscous", "both directions at the same speeds"),
        Confusion("coulomb_asymmetry", "a speed ladder in both directions"),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_contact_force(place, p["d_b"] * Magnitude(system.contacts[place].slip))


class CoulombAsymmetry(Effect):
    """Direction-dependent Coulomb friction: level a + d for u > 0 and a − d for u < 0, that is λ += d (|d| ≤ a)."""

    kind = "coulomb_asymmetry"
    sits_on = "contact"
    equation = "level = a + d for u > 0, a − d for u < 0"
    signature = "a constant force, whatever the motion"
    seen_over = "velocity"
    both_ways = True
    demands = "|d| no larger than the friction level, so that neither direction's level is negative"
    parameters = (EffectParameter("d", "{F}", "half the difference of the two levels", neutral=0.0),)
    confused_with = (Confusion("offset", "a log in another mounting; in one mounting both are a constant force"),)

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_contact_force(place, p["d"])

    def admissible(self, system: System, place: int, values: Mapping[str, float]) -> bool:
        """|d| ≤ a, as friction does no positive work. A larger constant force is an offset."""
        level = _level_at_rest(system, place)
        return level is None or abs(values["d"]) <= level

    def twins(self, system: System, place: int) -> list[tuple[str, str]]:
        coordinate = lone_coordinate(system, place)
        return [] if coordinate is None else [("offset", system.positions[coordinate].name)]


RISE = EffectParameter("delta", "{F}", "rise of the level at standstill", low=0.0, neutral=0.0)
STRIBECK_VELOCITY = EffectParameter("v_s", "{q}/s", "Stribeck velocity", low=0.0, start=speeds)
EXPONENT = EffectParameter(
    "exponent", "1", "2 where it is not given; 1 for an exponential", low=0.5, high=4.0, as_number=True, by_default=2.0
)
RISE_DIFFERENCE = EffectParameter("d_delta", "{F}", "half the difference of the rises for u > 0 and u < 0", neutral=0.0)


class Stribeck(Effect):
    """Stribeck friction: level += delta exp(−(|u|/v_s)^exponent), with the exponent 2 where it is not given.

    With ``d_delta`` the rise depends on the direction, as in a worm gear: delta + d_delta for u > 0, delta − d_delta
    for u < 0. A diagnosis tries this form with Stribeck velocities up to half of the log's top speed. Above that its
    force over the log has the shape of a viscous asymmetry, which has fewer parameters.

    Exponents between 0.5 and 1 have been measured in ball bearings and gears (Armstrong-Hélouvry, Dupont and Canudas
    de Wit 1994); the exponent 1 is Tustin's curve. Below 1 the slope is infinite at standstill. A certificate can have
    whole exponents only: where an observer with estimated velocity is to be certified, declare the nearest of 1, 2
    and 3.
    """

    kind = "stribeck"
    sits_on = "contact"
    equation = (
        "level += delta·exp(−(|u|/v_s)²), or with exponent in place of 2, or (delta + d_delta·sgn(u)) in place of "
        "delta, where given"
    )
    signature = "extra friction at low slip speed that is gone above the Stribeck velocity"
    seen_over = "velocity"
    parameters = (RISE, STRIBECK_VELOCITY)
    more_forms = (
        (RISE, STRIBECK_VELOCITY, EXPONENT),
        (RISE, replace(STRIBECK_VELOCITY, seen_at=(0.0, 0.5)), RISE_DIFFERENCE),
    )
    confused_with = (
        Confusion("friction_drift", "speeds in random order: in a rising ladder speed and time are correlated"),
        Confusion("presliding", "a microscopic slow sine"),
        Confusion("quantisation", "a finer encoder, or slow motion in one direction"),
        Confusion("quadratic_drag", "slow motion, where a wide Stribeck curve still falls"),
    )
    demands = "d_delta such that the level is not negative in either direction"

    def admissible(self, system: System, place: int, values: Mapping[str, float]) -> bool:
        """No level at rest is negative, in either direction: friction does no positive work."""
        smaller_rise = values["delta"] - abs(values.get(RISE_DIFFERENCE.name, 0.0))
        level = None if smaller_rise >= 0 else _level_at_rest(system, place)
        return super().admissible(system, place, values) and (level is None or level + smaller_rise >= 0)

    def starts(self, covered: Covered) -> list[dict[str, float]]:
        """A Stribeck velocity from a hundredth to 0.8 of the top speed, and an exponent of 1."""
        exponent = {"exponent": 1.0} if EXPONENT in self.parameters else {}
        return [{"v_s": float(v)} | exponent for v in speeds(covered)]

    def add(self, system: System, place: int, p: Symbols) -> System:
        slip = system.contacts[place].slip
        if EXPONENT.name in p:
            power = Magnitude(slip) ** p["exponent"] / p["v_s"] ** p["exponent"]
            return system.with_level(place, p["delta"] * sympy.exp(-power))
        curve = sympy.exp(-((slip / p["v_s"]) ** 2))
        changed = system.with_level(place, p["delta"] * curve)
        # (delta + d_delta sgn u) sgn u = delta sgn u + d_delta: a level delta and a force d_delta.
        return changed.with_contact_force(place, p["d_delta"] * curve) if RISE_DIFFERENCE.name in p else changed


def _level_at_rest(system: System, place: int) -> float | None:
    """The declared friction level at rest, N or N m; None for a law with states, which has no level at rest."""
    contact = system.contacts[place]
    level = None if isinstance(contact.law, DynamicLaw) else contact.level_at_rest
    return None if level is None else float(level.subs(system.values))


SEVERAL_LOADS = "several loads, driving and back-driving"
"""Experiment that discriminates friction that depends on the load from a gain error."""


class _LoadDependent(Effect):
    """Friction that grows with the transmitted load L: the force of the inputs in the direction of the contact."""

    sits_on = "contact"
    seen_over = "load"
    needs = "a contact on a coordinate that an input drives"

    def applies(self, system: System, place: int) -> bool:
        return bool(drive_force(system, place) != 0)


SHARE_OF_LOAD = EffectParameter(
    "mu_load", "1", "share of the load", low=0.0, high=0.9, neutral=0.0, moved_in=Between(-0.9, 0.9)
)
"""From 1 on a gear locks itself: no load drives it back, and the law has no solution in braking."""


class LoadDependentFriction(_LoadDependent):
    """Load-dependent friction: level += mu |L|, with L the force of the inputs in the direction of the contact.

    With ``mu_load`` in place of mu the friction grows with the force R that is left for the load, as in a gear whose
    teeth carry the load alone: λ = (a + mu_load |R|) sgn(u) with R = D − λ, where D is the force of the inputs and of
    linear damping, both on the motor's side, and a the level without this effect. Effects on the same contact that are
    listed before it count in a and D, those listed after it are added to λ alone. Solved for λ, with L = D − a sgn(u),
    the added level is mu_load/(1 + mu_load) |L| in driving (L u > 0), and mu_load/(1 − mu_load) |L| in braking: the
    efficiency of the gear is 1/(1 + mu_load) in driving and 1 − mu_load in braking. A diagnosis tries it where the spec
    has a force on the contact that depends on position, such as the weight of a pendulum: most loads without one are
    M a alone. A constant weight, as of a vertical axis, can be declared and is not tried.
    """

    kind = "load_dependent_friction"
    equation = "level += mu·|L|, or mu_load·|R| with R the force that friction leaves for the load"
    signature = "a step at reversal whose height is proportional to the drive force"
    parameters = (EffectParameter("mu", "1", "share of the drive force", low=0.0, neutral=0.0),)
    more_forms = ((SHARE_OF_LOAD,),)
    confused_with = (Confusion("input_gain", SEVERAL_LOADS), Confusion("drive_backdrive_friction", SEVERAL_LOADS))

    def add(self, system: System, place: int, p: Symbols) -> System:
        if SHARE_OF_LOAD.name not in p:
            return system.with_level(place, p["mu"] * Magnitude(drive_force(system, place)))
        contact, share = system.contacts[place], p[SHARE_OF_LOAD.name]
        level = contact.law_level + contact.extra_level
        motor = drive_force(system, place) + damping(system, place) * contact.slip - contact.extra_force
        # sgn(u) |motor − level sgn(u)| is sgn(u) (up + down)/2 + (down − up)/2, without a case distinction.
        up, down = Magnitude(motor + level), Magnitude(motor - level)
        mean, half = share / (1 - share**2), -(share**2) / (1 - share**2)
        changed = system.with_level(place, mean * (up + down) / 2 - half * level)
        return changed.with_contact_force(place, mean * (down - up) / 2 + half * motor)

    def is_tried(self, system: System, place: int) -> bool:
        if SHARE_OF_LOAD not in self.parameters:
            return True
        at_rest = system.force.subs(dict.fromkeys((*system.inputs, *system.velocities), 0))
        return bool(system.distribution[:, place].dot(at_rest).has(*system.positions))


class DriveBackdriveFriction(_LoadDependent):
    """Gear friction that differs between driving and braking: level += mu_drive |L| if L u > 0, mu_back |L| if L u < 0.

    L is the force of the inputs in the direction of the contact. Since sgn(u)·|L|·sgn(L u) = L, this is
    level += (mu_drive + mu_back)/2·|L| and λ += (mu_drive − mu_back)/2·L, without a case distinction.
    The second part is an input's gain of 1 − (mu_drive − mu_back)/2: where all masses and forces may be refitted within
    their tolerances, other values of these have the same effect, and `load_dependent_friction` is named with them.
    """

    kind = "drive_backdrive_friction"
    equation = "level += mu_drive·|L| for L·u > 0, mu_back·|L| for L·u < 0"
    signature = "a step at reversal in proportion to the drive force, with different factors in driving and braking"
    refines = "load_dependent_friction"
    parameters = (
        EffectParameter("mu_drive", "1", "share of the drive force while it drives", low=0.0, neutral=0.0),
        EffectParameter("mu_back", "1", "share of the drive force while it is driven back", low=0.0, neutral=0.0),
    )
    confused_with = (Confusion("load_dependent_friction", SEVERAL_LOADS), Confusion("input_gain", SEVERAL_LOADS))

    def add(self, system: System, place: int, p: Symbols) -> System:
        load = drive_force(system, place)
        mean, half = (p["mu_drive"] + p["mu_back"]) / 2, (p["mu_drive"] - p["mu_back"]) / 2
        return system.with_level(place, mean * Magnitude(load)).with_contact_force(place, half * load)


LONGEST_PRESLIDING = 0.1
"""Longest displacement a/sigma of presliding, as a share of the stroke of a log. Friction is within 5 % of its level
only 3.7 of these displacements after a reversal, and presliding is what comes before sliding: micrometres in rolling
and sliding guides (Armstrong-Hélouvry, Dupont and Canudas de Wit 1994). Of the true ones of practice logs and other
machines none is above 2 %; a gas spring with heat exchange was fitted with 17 %."""


class PreslidingLaw(DynamicLaw):
    """Dahl's law λ = sigma z, z' = u − (sigma/a) z |u|, with the stiffness sigma as a parameter and a the level."""

    name = "presliding"
    source = "Dahl 1976"
    parameters = (
        LawParameter("a", "{F}", True, "Coulomb level"),
        LawParameter("sigma", "{F}/{q}", True, "presliding stiffness"),
    )
    states = (LawState("z", "{q}", "presliding deflection"),)

    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        return (u - p["sigma"] / p["a"] * z[0] * Magnitude(u),)

    def force(self, u: sympy.Expr, z: States, p: Values) -> sympy.Expr:
        return p["sigma"] * z[0]

    def state_range(self, top_speed: sympy.Expr, p: Values) -> Ranges:
        """±a/sigma: at these z, z' is zero or points inwards for every u."""
        return ((-p["a"] / p["sigma"], p["a"] / p["sigma"]),)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["a"]

    def bristle_stiffness(self, p: Values) -> sympy.Expr:
        return p["sigma"]


class Presliding(Effect):
    """Presliding: Dahl's law λ = sigma z, z' = u − (sigma/a) z |u| in place of the set-valued Coulomb law."""

    kind = "presliding"
    sits_on = "contact"
    equation = "λ = sigma·z, dz/dt = u − (sigma/a)·z·|u| in place of a·sgn(u)"
    signature = "hysteresis over position at each reversal, in place of a step"
    seen_over = "position"
    parameters = (EffectParameter("sigma", "{F}/{q}", "presliding stiffness", low=0.0, start=bristles, essential=True),)
    confused_with = (
        Confusion("backlash", "a microscopic slow sine: presliding resists it with a force, backlash does not"),
        Confusion("input_delay", "a microscopic slow sine"),
        Confusion("stribeck", "a microscopic slow sine"),
        Confusion("inertia_error", "two frequencies"),
    )
    needs = "a contact whose law is coulomb; laws that have presliding themselves are lugre, dahl and others"

    def applies(self, system: System, place: int) -> bool:
        return isinstance(system.contacts[place].law, Coulomb)

    def followed(self, covered: Covered) -> list[dict[str, float]]:
        """All starting stiffnesses, also those that free runs would rule out.

        Where the contact is soft, the friction level of the model without presliding is fitted too low, and the free
        runs with that level do not show which stiffness is near the optimum.
        """
        return [{"sigma": sigma} for sigma in bristles(covered)]

    def outside(
        self, model: System, place: int, values: Mapping[str, float], intervals: Intervals, stroke: float
    ) -> str:
        """That the displacement a/sigma, at the stiff end of its interval, is above ``LONGEST_PRESLIDING`` strokes."""
        level = float(model.values[model.contacts[place].law_parameters["a"]])
        travel = level / max(values["sigma"], intervals.get("sigma", (0.0, 0.0))[1])
        if travel <= LONGEST_PRESLIDING * stroke:
            return ""
        return (
            f"slides only after a displacement a/sigma of {in_percent(travel / stroke)} of the stroke; above "
            f"{in_percent(LONGEST_PRESLIDING)} the log does not tell it from other forces over position"
        )

    def add(self, system: System, place: int, p: Symbols) -> System:
        contact = system.contacts[place]
        return system.with_law(place, PreslidingLaw(), {**contact.law_parameters, "sigma": p["sigma"]})


class FrictionDrift(Effect):
    """Friction that drifts: level += delta exp(−t/T), t from the start of the log, or of the observer."""

    kind = "friction_drift"
    sits_on = "contact"
    equation = "level += delta·exp(−t/T)"
    signature = "friction that changes slowly in time, whatever the motion"
    seen_over = "time"
    parameters = (
        EffectParameter("delta", "{F}", "change of the level at the start", neutral=0.0),
        EffectParameter("T", "s", "time constant", low=0.0, start=slow_times),
    )
    confused_with = (
        Confusion("stribeck", "speeds in random order: in a rising ladder speed and time are correlated"),
        Confusion("temperature", "repeat the same motion later"),
    )

    def add(self, system: System, place: int, p: Symbols) -> System:
        return system.with_level(place, p["delta"] * sympy.exp(-TIME / p["T"]))

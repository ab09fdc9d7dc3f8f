"""The catalogue of effects that a model may lack. To add one: a file with its class, and the class in CATALOGUE."""

from codegen.effects.actuator_lag import ActuatorLag
from codegen.effects.cogging import Cogging
from codegen.effects.cogging_harmonics import CoggingHarmonics
from codegen.effects.compliance import Backlash, Compliance
from codegen.effects.coulomb_asymmetry import CoulombAsymmetry
from codegen.effects.coupling import Coupling
from codegen.effects.dead_zone import DeadZone
from codegen.effects.effect import Confusion, Effect, EffectParameter
from codegen.effects.encoder_eccentricity import EncoderEccentricity
from codegen.effects.friction_drift import FrictionDrift
from codegen.effects.gravity_imbalance import GravityImbalance
from codegen.effects.hardening_spring import HardeningSpring
from codegen.effects.inertia_error import InertiaError
from codegen.effects.input_delay import InputDelay
from codegen.effects.input_gain import InputGain
from codegen.effects.load_dependent_friction import DriveBackdriveFriction, LoadDependentFriction
from codegen.effects.offset import Offset
from codegen.effects.position_dependent_friction import PositionDependentFriction
from codegen.effects.presliding import Presliding
from codegen.effects.quadratic_drag import QuadraticDrag
from codegen.effects.saturation import Saturation
from codegen.effects.spring import Spring
from codegen.effects.stribeck import Stribeck
from codegen.effects.viscous import Viscous
from codegen.effects.viscous_asymmetry import ViscousAsymmetry

CATALOGUE: dict[str, Effect] = {
    effect.kind: effect
    for effect in (
        Viscous(),
        QuadraticDrag(),
        Stribeck(),
        Offset(),
        CoulombAsymmetry(),
        PositionDependentFriction(),
        LoadDependentFriction(),
        Presliding(),
        FrictionDrift(),
        Cogging(),
        InputGain(),
        InputDelay(),
        ActuatorLag(),
        DeadZone(),
        Saturation(),
        Compliance(),
        Backlash(),
        InertiaError(),
        GravityImbalance(),
        Spring(),
        HardeningSpring(),
        Coupling(),
        EncoderEccentricity(),
        ViscousAsymmetry(),
        CoggingHarmonics(),
        DriveBackdriveFriction(),
    )
}

__all__ = ["CATALOGUE", "Confusion", "Effect", "EffectParameter"]

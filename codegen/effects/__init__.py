"""Catalogue of the physical effects that a model may lack. To add one: a file with its class, an entry in CATALOGUE."""

from codegen.effects.compliance import Backlash, Compliance
from codegen.effects.effect import Confusion, Effect, EffectParameter
from codegen.effects.on_contact import (
    CoulombAsymmetry,
    DriveBackdriveFriction,
    FrictionDrift,
    LoadDependentFriction,
    Presliding,
    Stribeck,
    Viscous,
    ViscousAsymmetry,
)
from codegen.effects.on_coordinate import Coupling, HardeningSpring, InertiaError, Offset, QuadraticDrag, Spring
from codegen.effects.on_input import ActuatorLag, DeadZone, InputDelay, InputGain, Saturation
from codegen.effects.periodic import (
    Cogging,
    CoggingHarmonics,
    EncoderEccentricity,
    GravityImbalance,
    PositionDependentFriction,
)

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
"""Kind → effect; those of a user are added by ``register``."""

__all__ = ["CATALOGUE", "Confusion", "Effect", "EffectParameter"]

"""The catalogue of effects a model may lack. Adding one: a file with its class, and its class in CATALOGUE."""

from codegen.effects.cogging import Cogging
from codegen.effects.coulomb_asymmetry import CoulombAsymmetry
from codegen.effects.effect import Effect, EffectParameter
from codegen.effects.inertia_error import InertiaError
from codegen.effects.input_delay import InputDelay
from codegen.effects.input_gain import InputGain
from codegen.effects.offset import Offset
from codegen.effects.quadratic_drag import QuadraticDrag
from codegen.effects.spring import Spring
from codegen.effects.stribeck import Stribeck
from codegen.effects.viscous import Viscous
from codegen.effects.viscous_asymmetry import ViscousAsymmetry

CATALOGUE: dict[str, Effect] = {
    effect.kind: effect
    for effect in (
        Viscous(),
        Offset(),
        CoulombAsymmetry(),
        ViscousAsymmetry(),
        Stribeck(),
        Cogging(),
        QuadraticDrag(),
        Spring(),
        InertiaError(),
        InputGain(),
        InputDelay(),
    )
}

__all__ = ["CATALOGUE", "Effect", "EffectParameter"]

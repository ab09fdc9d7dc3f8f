"""Registry of the friction laws. To add one: a file with its class, and the class in LAWS."""

from codegen.friction.law import DynamicLaw, FrictionLaw, LawParameter, LawState, MemoryLaw, ZeroMemoryLaw
from codegen.friction.memory import Bristle, Derjaguin, HessSoomLag, Karnopp, Kato, SevenParameter
from codegen.friction.state_space import (
    Dahl,
    ExtendedDynamic,
    ExtendedResetIntegrator,
    LinkerDieterich,
    LuGre,
    ResetIntegrator,
    Ruina,
    Walrath,
)
from codegen.friction.zero_memory import (
    BoPavelescu,
    Canudas,
    Coulomb,
    ExtendedCoulomb,
    Gaussian,
    GaussianOffset,
    Lorentzian,
    Polynomial,
    StaticViscous,
    Tustin,
)

_ZERO_MEMORY: tuple[FrictionLaw, ...] = (
    *(Coulomb(), StaticViscous(), Tustin(), BoPavelescu(), Gaussian(), GaussianOffset(), Lorentzian(), Polynomial()),
    *(Canudas(), ExtendedCoulomb()),
)
_STATE_SPACE: tuple[FrictionLaw, ...] = (
    *(Dahl(), ResetIntegrator(), LuGre(), Walrath(), Ruina(), LinkerDieterich(), ExtendedDynamic()),
    ExtendedResetIntegrator(),
)
_MEMORY: tuple[FrictionLaw, ...] = (Derjaguin(), Kato(), HessSoomLag(), SevenParameter(), Karnopp(), Bristle())

LAWS: dict[str, FrictionLaw] = {law.name: law for law in (*_ZERO_MEMORY, *_STATE_SPACE, *_MEMORY)}
ALSO_CALLED = {"stribeck": "gaussian", "viscous": "static_viscous", "stiction": "static_viscous"}
"""Other names for these laws."""

__all__ = ["ALSO_CALLED", "LAWS", "DynamicLaw", "FrictionLaw", "LawParameter", "LawState", "MemoryLaw", "ZeroMemoryLaw"]

"""The friction laws. To add one: a file with its class, and the class in LAWS."""

from codegen.friction.bo_pavelescu import BoPavelescu
from codegen.friction.bristle import Bristle
from codegen.friction.canudas import Canudas
from codegen.friction.coulomb import Coulomb
from codegen.friction.dahl import Dahl
from codegen.friction.extended_coulomb import ExtendedCoulomb
from codegen.friction.extended_dynamic import ExtendedDynamic, ExtendedResetIntegrator
from codegen.friction.gaussian import Gaussian
from codegen.friction.gaussian_offset import GaussianOffset
from codegen.friction.hess_soom_lag import HessSoomLag
from codegen.friction.karnopp import Karnopp
from codegen.friction.law import DynamicLaw, FrictionLaw, LawParameter, LawState, MemoryLaw, ZeroMemoryLaw
from codegen.friction.linker_dieterich import LinkerDieterich
from codegen.friction.lorentzian import Lorentzian
from codegen.friction.lugre import LuGre
from codegen.friction.polynomial import Polynomial
from codegen.friction.reset_integrator import ResetIntegrator
from codegen.friction.rising_static import Derjaguin, Kato
from codegen.friction.ruina import Ruina
from codegen.friction.seven_parameter import SevenParameter
from codegen.friction.static_viscous import StaticViscous
from codegen.friction.tustin import Tustin
from codegen.friction.walrath import Walrath

_ZERO_MEMORY: tuple[FrictionLaw, ...] = (
    Coulomb(),
    StaticViscous(),
    Tustin(),
    BoPavelescu(),
    Gaussian(),
    GaussianOffset(),
    Lorentzian(),
    Polynomial(),
    Canudas(),
    ExtendedCoulomb(),
)
_STATE_SPACE: tuple[FrictionLaw, ...] = (
    Dahl(),
    ResetIntegrator(),
    LuGre(),
    Walrath(),
    Ruina(),
    LinkerDieterich(),
    ExtendedDynamic(),
    ExtendedResetIntegrator(),
)
_MEMORY: tuple[FrictionLaw, ...] = (Derjaguin(), Kato(), HessSoomLag(), SevenParameter(), Karnopp(), Bristle())

LAWS: dict[str, FrictionLaw] = {law.name: law for law in (*_ZERO_MEMORY, *_STATE_SPACE, *_MEMORY)}
ALSO_CALLED = {"stribeck": "gaussian", "viscous": "static_viscous", "stiction": "static_viscous"}
"""Other names for these laws."""

__all__ = ["ALSO_CALLED", "LAWS", "DynamicLaw", "FrictionLaw", "LawParameter", "LawState", "MemoryLaw", "ZeroMemoryLaw"]

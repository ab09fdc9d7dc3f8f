"""The friction laws. Adding one: a file with its class, and its class in LAWS."""

from codegen.friction.coulomb import Coulomb
from codegen.friction.dahl import Dahl
from codegen.friction.extended_coulomb import ExtendedCoulomb
from codegen.friction.law import DynamicLaw, FrictionLaw, LawParameter, LawState, MemoryLaw, ZeroMemoryLaw
from codegen.friction.lugre import LuGre
from codegen.friction.reset_integrator import ResetIntegrator

LAWS: dict[str, FrictionLaw] = {
    law.name: law for law in (Coulomb(), ExtendedCoulomb(), Dahl(), ResetIntegrator(), LuGre())
}

__all__ = ["LAWS", "DynamicLaw", "FrictionLaw", "LawParameter", "LawState", "MemoryLaw", "ZeroMemoryLaw"]

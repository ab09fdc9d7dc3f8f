"""The friction laws. Adding one: a file with its class, and its class in LAWS."""

from codegen.friction.coulomb import Coulomb
from codegen.friction.extended_coulomb import ExtendedCoulomb
from codegen.friction.law import DynamicLaw, FrictionLaw, LawParameter, LawState, MemoryLaw, ZeroMemoryLaw

LAWS: dict[str, FrictionLaw] = {law.name: law for law in (Coulomb(), ExtendedCoulomb())}

__all__ = ["LAWS", "DynamicLaw", "FrictionLaw", "LawParameter", "LawState", "MemoryLaw", "ZeroMemoryLaw"]

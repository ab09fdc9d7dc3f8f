"""Spec → System: the matrices of the equation of motion."""

from codegen.mechanics.build import build_system
from codegen.mechanics.system import ContactFriction, System

__all__ = ["ContactFriction", "System", "build_system"]

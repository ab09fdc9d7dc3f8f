"""Equation of motion M(x) v' = g(x, v, w) − U λ of a spec, as a ``System`` of SymPy matrices."""

from codegen.mechanics.build import build_system
from codegen.mechanics.system import ContactFriction, System

__all__ = ["ContactFriction", "System", "build_system"]

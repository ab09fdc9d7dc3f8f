"""Simplification of derived equations of motion: products of sines and cosines become sums of harmonics."""

from typing import Any

import sympy
from sympy.simplify.fu import TR8

from codegen.spec.functions import Magnitude, Sgn

LONGEST = 4000
"""Number of operations above which an expression is not simplified."""
HIGHEST_POWER = 6
"""Largest power of a sum that is expanded."""


def compact(expression: Any) -> Any:
    """The shortest form of an expression: as given, expanded, or expanded with products of sines and cosines as sums.

    In the last form sin² + cos² is 1 and cos a cos(a + b) + sin a sin(a + b) is cos b, since harmonics are linearly
    independent; ``simplify`` would find the same by trial, in minutes instead of milliseconds. ``expression``: a scalar
    or a matrix; one of more than ``LONGEST`` operations is returned as it is.
    """
    if isinstance(expression, sympy.MatrixBase):
        return expression.applyfunc(compact)
    sums = (p for p in expression.atoms(sympy.Pow) if p.base.is_Add and p.exp.is_Integer)
    short = sympy.count_ops(expression) <= LONGEST and all(abs(p.exp) <= HIGHEST_POWER for p in sums)
    if expression.is_Atom or not short:
        return _own_functions(expression)
    expanded = sympy.expand(expression)
    forms = [expanded, expression]
    if expanded.has(sympy.sin, sympy.cos) and sympy.count_ops(expanded) <= LONGEST:
        forms.insert(0, sympy.expand(TR8(expanded)))
    return _own_functions(min(forms, key=sympy.count_ops))  # the first of equal lengths: a canonical choice


def _own_functions(expression: Any) -> Any:
    """Replace SymPy's Abs, which it makes of √(x²), by ``Magnitude``, the absolute value of specs."""
    return expression.replace(sympy.Abs, Magnitude).replace(sympy.sign, Sgn)

"""SymPy → the prefix expressions of a certificate (docs/certificate_format.md)."""

from __future__ import annotations

from typing import Any

import sympy

from codegen.spec.functions import Magnitude

_CALLS = {sympy.sin: "sin", sympy.cos: "cos", sympy.exp: "exp", sympy.Abs: "abs", Magnitude: "abs"}


def rational_text(value: Any) -> str:
    """An exact rational as ``p`` or ``p/q``."""
    return str(sympy.Rational(value))


def to_prefix(e: Any) -> Any:
    """A prefix expression: a string or a nested list.

    Raises:
        TypeError: for a function without a word.
    """
    if e.is_Rational:
        return rational_text(e)
    if e.is_Symbol:
        return e.name
    if e.is_Add:
        return ["+", *[to_prefix(a) for a in e.args]]
    if e.is_Mul:
        above = [f for f in e.args if not (f.is_Pow and f.exp.is_number and f.exp.is_negative)]
        below = [f.base ** (-f.exp) for f in e.args if f.is_Pow and f.exp.is_number and f.exp.is_negative]
        top = to_prefix(above[0]) if len(above) == 1 else ["*", *[to_prefix(a) for a in above]] if above else "1"
        for divisor in below:
            top = ["/", top, to_prefix(divisor)]
        return top
    if e.is_Pow:
        return _power(e)
    if e.func is sympy.tan:
        return ["/", ["sin", to_prefix(e.args[0])], ["cos", to_prefix(e.args[0])]]
    word = _CALLS.get(e.func)
    if word is None:
        raise TypeError(str(e.func))
    return [word, to_prefix(e.args[0])]


def _power(e: Any) -> Any:
    if e.base is sympy.E:
        return ["exp", to_prefix(e.exp)]
    if e.exp == sympy.Rational(1, 2):
        return ["sqrt", to_prefix(e.base)]
    if e.exp.is_Integer and e.exp > 0:
        return ["^", to_prefix(e.base), str(e.exp)]
    if e.exp.is_Integer:
        return ["/", "1", to_prefix(e.base ** (-e.exp))]
    raise TypeError(f"the power {e.exp}")

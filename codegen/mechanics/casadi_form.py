"""SymPy expressions → CasADi SX, operation by operation, with powers as products."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import casadi
import sympy

from codegen.spec.functions import Magnitude, Sgn

_FUNCTIONS: dict[Any, Callable[[Any], Any]] = {
    sympy.sin: casadi.sin,
    sympy.cos: casadi.cos,
    sympy.tan: casadi.tan,
    sympy.exp: casadi.exp,
    sympy.log: casadi.log,
    sympy.tanh: casadi.tanh,
    Magnitude: casadi.fabs,
    Sgn: casadi.sign,
}


def to_casadi(expression: Any, names: Mapping[sympy.Symbol, Any]) -> Any:
    """The CasADi SX of a SymPy expression or matrix.

    Args:
        expression: scalar or matrix over the symbols in ``names``.
        names: symbol → SX scalar or number.

    Raises:
        KeyError: for a symbol without an entry.
        TypeError: for a SymPy node that no spec can hold.
    """
    if isinstance(expression, sympy.MatrixBase):
        result = casadi.SX(expression.rows, expression.cols)
        for i in range(expression.rows):
            for j in range(expression.cols):
                if expression[i, j] != 0:
                    result[i, j] = _scalar(expression[i, j], names)
        return result
    return _scalar(expression, names)


def _scalar(e: Any, names: Mapping[sympy.Symbol, Any]) -> Any:
    if e.is_Symbol:
        return names[e]
    if e.is_Number or e is sympy.pi or e is sympy.E:
        return casadi.SX(float(e))
    if e.is_Add:
        # SymPy keeps terms in its own order; a leading negative term would cost an operation.
        terms = sorted(e.args, key=lambda term: term.could_extract_minus_sign())
        total = _scalar(terms[0], names)
        for term in terms[1:]:
            total = total - _scalar(-term, names) if term.could_extract_minus_sign() else total + _scalar(term, names)
        return total
    if e.is_Mul:
        return _product(e, names)
    if e.is_Pow:
        return _power(e.base, e.exp, names)
    function = _FUNCTIONS.get(e.func)
    if function is None:
        raise TypeError(f"no CasADi form for {e.func}")
    return function(_scalar(e.args[0], names))


def _product(e: Any, names: Mapping[sympy.Symbol, Any]) -> Any:
    above, below, negative = None, None, False
    for factor in e.args:
        if factor == -1:
            negative = not negative
        elif factor.is_Pow and factor.exp.is_number and factor.exp.is_negative:
            value = _power(factor.base, -factor.exp, names)
            below = value if below is None else below * value
        elif factor.is_Rational and not factor.is_Integer and factor.p in (1, -1):
            negative ^= factor.p < 0
            value = casadi.SX(float(factor.q))
            below = value if below is None else below * value
        else:
            value = _scalar(factor, names)
            above = value if above is None else above * value
    result = casadi.SX(1.0) if above is None else above
    if below is not None:
        result = result / below
    return -result if negative else result


def _power(base: Any, exponent: Any, names: Mapping[sympy.Symbol, Any]) -> Any:
    value = _scalar(base, names)
    if exponent.is_Integer:
        n = int(exponent)
        return _repeated(value, n) if n >= 0 else 1 / _repeated(value, -n)
    if exponent == sympy.Rational(1, 2):
        return casadi.sqrt(value)
    if base is sympy.E:
        return casadi.exp(_scalar(exponent, names))
    return casadi.power(value, _scalar(exponent, names))


def _repeated(value: Any, n: int) -> Any:
    """value**n as products by squaring: the same operations in every language, and no call of pow."""
    if n == 0:
        return casadi.SX(1.0)
    half = _repeated(value, n // 2) if n > 1 else None
    squared = value if half is None else half * half
    return squared * value if n > 1 and n % 2 else squared

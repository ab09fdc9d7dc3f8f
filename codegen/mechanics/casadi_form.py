"""SymPy expressions → CasADi SX, operation by operation, with powers as products."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi
import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.mechanics.computed import ComputedEntry
from codegen.spec.functions import Magnitude, Sgn

MANY_WAVES = 4
"""Sines and cosines of multiples of one angle that are worth being built from one of each."""
_ROWS = 200
"""Evaluated at once by ``over_rows``: few enough that arguments and results stay in the cache."""

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


@dataclass(frozen=True)
class _Scope:
    """The values of symbols, and the computations that are already put in: all entries of one share its graph."""

    names: Mapping[sympy.Symbol, Any]
    computed: dict[tuple[Any, ...], Any] = field(default_factory=dict)
    turns: dict[Any, dict[int, tuple[Any, Any]]] = field(default_factory=dict)
    """Angle → n → (cos n·angle, sin n·angle), for angles of which sines and cosines are built from those of n = 1."""


def to_casadi(expression: Any, names: Mapping[sympy.Symbol, Any], by_angle: bool = False) -> Any:
    """The CasADi SX of a SymPy expression or matrix.

    Args:
        names: symbol → SX scalar or number, of every symbol in the expression.
        by_angle: build many sines and cosines of multiples of one angle from one sine and one cosine of it, by the
            addition theorem; equal to rounding.

    Raises:
        KeyError: for a symbol without an entry.
        TypeError: for a SymPy node that no spec can hold.
    """
    scope = _Scope(names, turns=_angles(expression) if by_angle else {})
    if isinstance(expression, sympy.MatrixBase):
        result = casadi.SX(expression.rows, expression.cols)
        for (i, j), entry in sorted(expression.todok().items()):
            result[i, j] = _scalar(entry, scope)
        return result
    return _scalar(expression, scope)


def symbol_values(
    numbers: Mapping[sympy.Symbol, Any], *columns: tuple[Sequence[sympy.Symbol], Any]
) -> dict[sympy.Symbol, Any]:
    """The values of symbols in ``to_casadi``: numbers, and the entries of columns, which come before numbers."""
    names: dict[sympy.Symbol, Any] = {s: casadi.SX(float(value)) for s, value in numbers.items()}
    for symbols, column in columns:
        names |= {s: column[k] for k, s in enumerate(symbols)}
    return names


def over_rows(function: casadi.Function, rows: Array) -> Array:
    """A function, (k, 1) → (r, 1) and dense, at each of N rows, (N, k): (N, r); NumPy and CasADi share the memory."""
    count, width = len(rows), function.size1_out(0)
    if not count or not width:
        return np.zeros((count, width))
    size = max(1, min(_ROWS, count))
    whole = -(-count // size) * size
    arguments = np.zeros((whole, function.size1_in(0)))
    arguments[:count], arguments[count:] = rows, rows[-1:]
    results = np.empty((whole, width))
    mapped: Any = function.map(size)  # its stub lacks the form of set_arg that takes memory
    buffer, evaluate = mapped.buffer()
    for k in range(0, whole, size):
        buffer.set_arg(0, arguments[k : k + size].data)
        buffer.set_res(0, results[k : k + size].data)
        evaluate()
    return results[:count]


def _scalar(e: Any, scope: _Scope) -> Any:
    if e.is_Symbol:
        return scope.names[e]
    if e.is_Number or e is sympy.pi or e is sympy.E:
        return casadi.SX(float(e))
    if e.is_Add:
        # SymPy keeps terms in its own order; a leading negative term would cost an operation.
        terms = sorted(e.args, key=lambda term: term.could_extract_minus_sign())
        total = _scalar(terms[0], scope)
        for term in terms[1:]:
            total = total - _scalar(-term, scope) if term.could_extract_minus_sign() else total + _scalar(term, scope)
        return total
    if e.is_Mul:
        return _product(e, scope)
    if e.is_Pow:
        return _power(e.base, e.exp, scope)
    if isinstance(e, ComputedEntry):
        return _computed(e, scope)
    function = _FUNCTIONS.get(e.func)
    if function is None:
        raise TypeError(f"no CasADi form for {e.func}")
    if e.func in (sympy.sin, sympy.cos) and scope.turns:
        times, angle = e.args[0].as_coeff_Mul()
        if angle in scope.turns and times.is_Integer and times > 0:
            return _turned(int(times), angle, scope)[e.func is sympy.sin]
    return function(_scalar(e.args[0], scope))


def _angles(expression: Any) -> dict[Any, dict[int, tuple[Any, Any]]]:
    """The angles of whose multiples there are ``MANY_WAVES`` sines and cosines."""
    count: Counter[Any] = Counter()
    for wave in expression.atoms(sympy.sin, sympy.cos):
        times, angle = wave.args[0].as_coeff_Mul()
        if times.is_Integer and times > 0:
            count[angle] += 1
    return {angle: {} for angle, waves in count.items() if waves >= MANY_WAVES}


def _turned(times: int, angle: Any, scope: _Scope) -> tuple[Any, Any]:
    """(cos, sin) of a multiple of an angle: e^(i n a) = e^(i p a) e^(i q a) with p + q = n, each power once."""
    known = scope.turns[angle]
    if times not in known:
        if times == 1:
            value = _scalar(angle, scope)
            known[times] = casadi.cos(value), casadi.sin(value)
        else:
            (a, b), (c, d) = (_turned(n, angle, scope) for n in (times // 2, times - times // 2))
            known[times] = a * c - b * d, a * d + b * c
    return known[times]


def _computed(e: ComputedEntry, scope: _Scope) -> Any:
    key = (e.computation, *e.arguments)
    if key not in scope.computed:
        scope.computed[key] = e.computation.function(casadi.vertcat(*[_scalar(a, scope) for a in e.arguments]))
    return scope.computed[key][e.index]


def _product(e: Any, scope: _Scope) -> Any:
    above, below, negative = None, None, False
    for factor in e.args:
        if factor == -1:
            negative = not negative
        elif factor.is_Pow and factor.exp.is_number and factor.exp.is_negative:
            value = _power(factor.base, -factor.exp, scope)
            below = value if below is None else below * value
        elif factor.is_Rational and not factor.is_Integer and factor.p in (1, -1):
            negative ^= factor.p < 0
            value = casadi.SX(float(factor.q))
            below = value if below is None else below * value
        else:
            value = _scalar(factor, scope)
            above = value if above is None else above * value
    result = casadi.SX(1.0) if above is None else above
    if below is not None:
        result = result / below
    return -result if negative else result


def _power(base: Any, exponent: Any, scope: _Scope) -> Any:
    value = _scalar(base, scope)
    if exponent.is_Integer:
        n = int(exponent)
        return _repeated(value, n) if n >= 0 else 1 / _repeated(value, -n)
    if exponent == sympy.Rational(1, 2):
        return casadi.sqrt(value)
    if base is sympy.E:
        return casadi.exp(_scalar(exponent, scope))
    return casadi.power(value, _scalar(exponent, scope))


def _repeated(value: Any, n: int) -> Any:
    """value**n as products by squaring: the same operations in every language, and no call of pow."""
    if n == 0:
        return casadi.SX(1.0)
    half = _repeated(value, n // 2) if n > 1 else None
    squared = value if half is None else half * half
    return squared * value if n > 1 and n % 2 else squared

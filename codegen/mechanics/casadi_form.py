"""Conversion of SymPy expressions to CasADi SX, node by node, with integer powers as products."""

import ctypes
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from types import MappingProxyType
from typing import Any

import casadi
import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.base.compiler import loaded
from codegen.base.errors import BadInput
from codegen.mechanics.computed import ComputedEntry
from codegen.spec.functions import Magnitude, Sgn

MANY_WAVES = 4
"""Least number of sines and cosines of multiples of one angle that are built by the addition theorem."""
_TOGETHER, _SHORT, _MANY = 16, 150, 5000
"""Points for which a function of at most so many operations is written out, if it is evaluated at so many rows."""
_ROWS = 800
"""Rows that ``over_rows`` evaluates per call: few enough that arguments and results stay in the processor's cache."""

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
"""SymPy function → CasADi function."""


@dataclass(frozen=True)
class _Scope:
    """Symbol table and caches of one conversion.

    Attributes:
        names: symbol → SX scalar or number.
        computed: (computation, arguments) → its SX result, which all its entries share.
        multiples: angle → n → (cos n·angle, sin n·angle), for the angles that the addition theorem is used for.
    """

    names: Mapping[sympy.Symbol, Any]
    computed: dict[tuple[Any, ...], Any] = field(default_factory=dict)
    multiples: dict[Any, dict[int, tuple[Any, Any]]] = field(default_factory=dict)


def to_casadi(expression: Any, names: Mapping[sympy.Symbol, Any], by_angle: bool = False) -> Any:
    """The CasADi SX of a SymPy expression or matrix.

    Args:
        names: symbol → SX scalar or number, for every symbol in the expression.
        by_angle: if there are ``MANY_WAVES`` sines and cosines of multiples of one angle, compute them from one sine
            and one cosine of it by the addition theorem; the values differ by rounding only.

    Raises:
        KeyError: for a symbol that ``names`` does not contain.
        TypeError: for a SymPy node that the expression language of specs does not have.
    """
    scope = _Scope(names, multiples=_angles(expression) if by_angle else {})
    if isinstance(expression, sympy.MatrixBase):
        result = casadi.SX(expression.rows, expression.cols)
        for (i, j), entry in sorted(expression.todok().items()):
            result[i, j] = _scalar(entry, scope)
        return result
    return _scalar(expression, scope)


def symbol_values(
    numbers: Mapping[sympy.Symbol, Any], *columns: tuple[Sequence[sympy.Symbol], Any]
) -> dict[sympy.Symbol, Any]:
    """The ``names`` of ``to_casadi``: symbol → number, and symbol → entry of a column vector, which takes precedence.

    ``columns``: pairs of the symbols of a vector's entries and the SX vector.
    """
    names: dict[sympy.Symbol, Any] = {s: casadi.SX(float(value)) for s, value in numbers.items()}
    for symbols, column in columns:
        names |= {s: column[k] for k, s in enumerate(symbols)}
    return names


def function_of(
    expression: Any, symbols: Sequence[sympy.Symbol], numbers: Mapping[sympy.Symbol, Any] = MappingProxyType({})
) -> Any:
    """The dense CasADi function of a SymPy expression or matrix; its argument is the column of the symbols' values.

    ``numbers``: of the other symbols in it.
    """
    at = casadi.SX.sym("at", max(1, len(symbols)))
    value = to_casadi(sympy.sympify(expression), symbol_values(numbers, (symbols, at)))
    return casadi.Function("of", [at], [casadi.densify(value)])


def at_points(function: Any, points: Array) -> Array:
    """A dense CasADi function of one column, such as ``function_of``, at N points (N, symbols): (N, rows, columns).

    A value that is not a real number is NaN or infinite.
    """
    rows, columns = function.size_out(0)
    given = np.zeros((len(points), function.size1_in(0)))
    given[:, : points.shape[1]] = points
    found = over_rows(function, given).reshape(len(points), columns, rows)
    return np.ascontiguousarray(found.transpose(0, 2, 1))


def in_place(function: Any, arguments: Sequence[Any], results: Sequence[Any]) -> tuple[Any, Callable[[], None]]:
    """(buffer, call): call() evaluates a CasADi function on NumPy arrays, and needs ``buffer`` kept alive."""
    buffer, evaluate = function.buffer()
    for place, arrays in ((buffer.set_arg, arguments), (buffer.set_res, results)):
        for index, array in enumerate(arrays):
            place(index, memoryview(array))
    return buffer, evaluate


_VISIBLE = ("-O1", "-fvisibility=default")
"""Compiler flags. -O2 takes half as long again, and the code is no faster."""


def compiled_in_place(
    function: Any, arguments: Sequence[Array], results: Sequence[Array]
) -> tuple[Any, Callable[[], None]]:
    """``in_place`` by compiled C: the same bits in a fifth of the time; by CasADi where nothing can be compiled."""
    generator = casadi.CodeGenerator("function", {"with_header": False})
    generator.add(function)
    try:
        library = loaded(generator.dump(), _VISIBLE)
    except BadInput:
        return in_place(function, arguments, results)
    given, found = (
        (ctypes.c_void_p * size)(*(array.ctypes.data for array in arrays))
        for size, arrays in ((function.sz_arg(), arguments), (function.sz_res(), results))
    )
    work = (ctypes.c_longlong * function.sz_iw())(), (ctypes.c_double * function.sz_w())()
    return (arguments, results), partial(library[function.name()], given, found, *work, 0)


def over_rows(function: casadi.Function, rows: Array, constants: Sequence[float] | Array = ()) -> Array:
    """A dense CasADi function (k, 1) → (r, 1) evaluated at each row of (N, k − c), followed by c constants: (N, r).

    A matrix result is flattened column by column. NumPy and CasADi share the memory. The rows are evaluated in blocks
    of equal size, the last one filled up with copies of the last row.
    """
    count, width = len(rows), function.numel_out(0)
    if not count or not width:
        return np.zeros((count, width))
    size = min(_ROWS, count)
    padded = -(-count // size) * size
    arguments = np.empty((padded, function.size1_in(0)))
    own = arguments.shape[1] - len(constants)
    arguments[:count, :own], arguments[count:, :own], arguments[:, own:] = rows, rows[-1:], constants
    results = np.empty((padded, width))
    buffer, evaluate = _mapped(function, size, count >= _MANY).buffer()
    for k in range(0, padded, size):
        buffer.set_arg(0, arguments[k : k + size].data)
        buffer.set_res(0, results[k : k + size].data)
        evaluate()
    return results[:count]


@lru_cache(32)
def _mapped(function: casadi.Function, count: int, often: bool) -> Any:
    """The function mapped over ``count`` points; cached, since the construction takes 3 ms.

    A short one that is evaluated often is first written out for ``_TOGETHER`` points: a call takes longer than its
    operations.
    """
    if not often or count % _TOGETHER or not function.is_a("SXFunction") or function.n_instructions() > _SHORT:
        return function.map(count)
    at = casadi.SX.sym("at", function.size1_in(0), _TOGETHER)
    results = casadi.horzcat(*(function(at[:, k]) for k in range(_TOGETHER)))
    return casadi.Function("of_several", [at], [results]).map(count // _TOGETHER)


def _scalar(e: Any, scope: _Scope) -> Any:
    """The SX scalar of a SymPy expression."""
    if e.is_Symbol:
        return scope.names[e]
    if e.is_Number or e is sympy.pi or e is sympy.E:
        return casadi.SX(float(e))
    if e.is_Add:
        # Positive terms first: a leading negative term would cost a negation.
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
    if e.func in (sympy.sin, sympy.cos) and scope.multiples:
        n, angle = e.args[0].as_coeff_Mul()
        if angle in scope.multiples and n.is_Integer and n > 0:
            cosine, sine = _cos_sin_of_multiple(int(n), angle, scope)
            return cosine if e.func is sympy.cos else sine
    return function(_scalar(e.args[0], scope))


def _angles(expression: Any) -> dict[Any, dict[int, tuple[Any, Any]]]:
    """Angle → empty table of multiples, for each angle of which ``MANY_WAVES`` or more sines and cosines occur."""
    count: Counter[Any] = Counter()
    for wave in expression.atoms(sympy.sin, sympy.cos):
        n, angle = wave.args[0].as_coeff_Mul()
        if n.is_Integer and n > 0:
            count[angle] += 1
    return {angle: {} for angle, waves in count.items() if waves >= MANY_WAVES}


def _cos_sin_of_multiple(n: int, angle: Any, scope: _Scope) -> tuple[Any, Any]:
    """(cos nφ, sin nφ) by e^(i n φ) = e^(i p φ) e^(i q φ), p = ⌊n/2⌋ and q = n − p; each multiple is computed once."""
    known = scope.multiples[angle]
    if n not in known:
        if n == 1:
            value = _scalar(angle, scope)
            known[n] = casadi.cos(value), casadi.sin(value)
        else:
            (a, b), (c, d) = (_cos_sin_of_multiple(part, angle, scope) for part in (n // 2, n - n // 2))
            known[n] = a * c - b * d, a * d + b * c
    return known[n]


def _computed(e: ComputedEntry, scope: _Scope) -> Any:
    """An entry of a computation, whose CasADi function is called once for all entries at the same arguments."""
    key = (e.computation, *e.arguments)
    if key not in scope.computed:
        scope.computed[key] = e.computation.function(casadi.vertcat(*[_scalar(a, scope) for a in e.arguments]))
    return scope.computed[key][e.index]


def _product(e: Any, scope: _Scope) -> Any:
    """A product as ± numerator / denominator, with a single division; a rational factor 1/q becomes a division by q."""
    numerator, denominator, negative = None, None, False
    for factor in e.args:
        if factor == -1:
            negative = not negative
        elif factor.is_Pow and factor.exp.is_number and factor.exp.is_negative:
            value = _power(factor.base, -factor.exp, scope)
            denominator = value if denominator is None else denominator * value
        elif factor.is_Rational and not factor.is_Integer and factor.p in (1, -1):
            negative ^= factor.p < 0
            value = casadi.SX(float(factor.q))
            denominator = value if denominator is None else denominator * value
        else:
            value = _scalar(factor, scope)
            numerator = value if numerator is None else numerator * value
    result = casadi.SX(1.0) if numerator is None else numerator
    if denominator is not None:
        result = result / denominator
    return -result if negative else result


def _power(base: Any, exponent: Any, scope: _Scope) -> Any:
    """base**exponent: integer powers by products, then sqrt or pow."""
    value = _scalar(base, scope)
    if exponent.is_Integer:
        n = int(exponent)
        return _repeated(value, n) if n > 0 else 1 / _repeated(value, -n)
    if exponent == sympy.Rational(1, 2):
        return casadi.sqrt(value)
    return casadi.power(value, _scalar(exponent, scope))


def _repeated(value: Any, n: int) -> Any:
    """value**n, n ≥ 1, by repeated squaring: the same operations in every language, and no call of pow."""
    if n == 1:
        return value
    half = _repeated(value, n // 2)
    squared = half * half
    return squared * value if n % 2 else squared

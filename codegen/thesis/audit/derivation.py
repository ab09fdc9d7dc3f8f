"""Derivations: the symbols of a group of printed formulas, quantities derived in these symbols, and values of formulas.

The parser of specs (``codegen.spec.expression``) parses a formula and evaluates nothing; here its tree gets values. In
addition to the syntax of specs, products of matrices and symbols as exponents are allowed, and ``sgn`` and ``abs`` of a
vector are taken element by element, as in sgn(U'v).
"""

import ast
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import sympy

from codegen.base.errors import BadInput, Place
from codegen.spec.expression import Algebra, Expression, evaluate_tree, parse_expression
from codegen.spec.functions import FUNCTIONS, Magnitude, Sgn

Formula = str | int | Sequence["Formula"]
_RELATION = re.compile(r"(<=|>=|<|>)")


class Misfit(BadInput):
    """A formula that can be read, but whose matrices have shapes that cannot be added or multiplied."""


def evaluate(formula: Any, names: Mapping[str, Any], place: Place) -> Any:
    """The value of a formula; rows of formulas are blocks of one matrix.

    Args:
        formula: text, a list (a column) or a list of lists (rows).
        names: name → expression or matrix.

    Raises:
        BadInput: for text that is no expression, an unknown name, or matrices whose shapes do not match.
    """
    if isinstance(formula, list):
        rows = [row if isinstance(row, list) else [row] for row in formula]
        blocks = [[as_matrix(evaluate(cell, names, place)) for cell in row] for row in rows]
        try:
            return sympy.Matrix.vstack(*[sympy.Matrix.hstack(*row) for row in blocks])
        except sympy.matrices.exceptions.ShapeError as error:
            raise Misfit(place, f"blocks that do not fit ({error})", "blocks of one matrix") from None
    parsed = parse_expression(str(formula), place)
    try:
        return evaluate_tree(parsed.tree, parsed, Algebra(names, "a name of this derivation's", _call, _combine))
    except sympy.matrices.exceptions.ShapeError as error:
        raise Misfit(place, f"`{formula}`: {error}", "matrices of fitting shapes") from None


def inequalities(text: str, names: Mapping[str, Any], place: Place) -> list[tuple[Any, bool]]:
    """``a < b < c`` as [(b − a, strict), (c − b, strict)]: expressions that must be positive, or not negative."""
    parts = _RELATION.split(text)
    if len(parts) < 3:
        raise BadInput(place, f"`{text}`", "an inequality such as `k_v > 0`", code="SPEC010")
    sides = [evaluate(part, names, place) for part in parts[::2]]
    result = []
    for left, relation, right in zip(sides, parts[1::2], sides[1:], strict=False):
        result.append((right - left if "<" in relation else left - right, "=" not in relation))
    return result


def as_text(formula: Any) -> str:
    """A formula as one line; rows in brackets."""
    if isinstance(formula, list):
        return "[" + "; ".join(", ".join(map(str, r)) if isinstance(r, list) else str(r) for r in formula) + "]"
    return str(formula)


def as_matrix(value: Any) -> Any:
    """A scalar as a 1 by 1 matrix; a matrix unchanged."""
    return value if isinstance(value, sympy.MatrixBase) else sympy.Matrix([[value]])


def _call(name: str, value: Any, *_: object) -> Any:
    return value.applyfunc(FUNCTIONS[name]) if isinstance(value, sympy.MatrixBase) else FUNCTIONS[name](value)


def _combine(op: ast.operator, a: Any, b: Any, whole: Expression, _: ast.expr) -> Any:
    matrices = isinstance(a, sympy.MatrixBase), isinstance(b, sympy.MatrixBase)
    match op:
        case ast.Mult():
            return a * b
        case ast.Div() if not matrices[1]:
            return a / b
        case ast.Pow() if not any(matrices):
            return a**b
        case ast.Add() | ast.Sub() if matrices[0] == matrices[1]:
            return a + b if isinstance(op, ast.Add) else a - b
    raise Misfit(whole.place, f"`{whole.text}`", "sums of equal shapes, and no division by a matrix")


class Derived(NamedTuple):
    """A derived quantity.

    Attributes:
        value: in the symbols of its ``Derivations``, as a matrix (1 by 1 for a scalar).
        form: the same in the thesis' notation, proven equal to ``value`` before it is shown; empty if SymPy's form is
            short enough.
    """

    value: Any
    form: Any = ""


@dataclass(frozen=True)
class Derivations:
    """Symbols and derived quantities of a group of formulas.

    Attributes:
        names: name in a printed formula → expression or matrix in free symbols. Without an entry, a free symbol of
            these or of a derived quantity has its own name, NAME_T is the transpose of a matrix, and diag_NAME the
            diagonal matrix of a column.
        derived: name → quantity, given as (value, form) or as a value alone.
        steady: symbols that are zero if U does not depend on x: the elements of dU/dt.
        positive: free symbols that are positive by their meaning.
        ranges: free symbol → its allowed values, if these are few.
    """

    names: Mapping[str, Any]
    derived: Mapping[str, Any]
    steady: tuple[Any, ...] = ()
    positive: frozenset[Any] = frozenset()
    ranges: Mapping[Any, tuple[Any, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Convert every quantity to a ``Derived`` with a matrix, and add the names that need no entry."""
        given = {name: one if isinstance(one, tuple) else (one,) for name, one in self.derived.items()}
        made = {name: Derived(as_matrix(value), *form) for name, (value, *form) in given.items()}
        object.__setattr__(self, "derived", made)
        values = [*self.names.values(), *(one.value for one in made.values())]
        symbols = {s for value in values for s in sympy.sympify(value).free_symbols}
        matrices = {name: value for name, value in self.names.items() if isinstance(value, sympy.MatrixBase)}
        further = {f"{name}_T": value.T for name, value in matrices.items()}
        further |= {f"diag_{name}": diagonal(value) for name, value in matrices.items() if value.cols == 1}
        object.__setattr__(self, "names", named(symbols) | further | dict(self.names))


def real(*names: str) -> tuple[Any, ...]:
    """Real symbols."""
    return tuple(sympy.Symbol(name, real=True) for name in names)


def column(name: str, count: int) -> Any:
    """A column of real symbols name1, name2, …"""
    return sympy.Matrix([sympy.Symbol(f"{name}{i + 1}", real=True) for i in range(count)])


def full(name: str, rows: int, columns: int) -> Any:
    """A matrix of real symbols."""
    return sympy.Matrix(rows, columns, lambda i, j: sympy.Symbol(f"{name}{i + 1}{j + 1}", real=True))


def symmetric(name: str, size: int) -> Any:
    """A symmetric matrix of real symbols."""
    return sympy.Matrix(size, size, lambda i, j: sympy.Symbol(f"{name}{min(i, j) + 1}{max(i, j) + 1}", real=True))


def diagonal(entries: Any) -> Any:
    """diag{entries}."""
    return sympy.diag(*list(entries))


def named(symbols: Iterable[Any]) -> dict[str, Any]:
    """Name → symbol."""
    return {s.name: s for s in symbols}


def rate(expression: Any, flows: Mapping[Any, Any]) -> Any:
    """Time derivative by the chain rule: Σ ∂/∂s · ds/dt over the symbols s of ``flows``."""
    if isinstance(expression, sympy.MatrixBase):
        return expression.applyfunc(lambda entry: rate(entry, flows))
    return sum((expression.diff(s) * flows[s] for s in expression.free_symbols if s in flows), sympy.S.Zero)


def moving(symbols: Any, rates: Any) -> dict[Any, Any]:
    """Symbol → its replacement or time derivative, for the elements of two matrices."""
    return dict(zip(symbols, rates, strict=True))


def jacobian_at_zero(rates: Any, errors: Any, first_order: Mapping[Any, Any]) -> Any:
    """∂rates/∂errors at zero error; ``first_order``: symbol → its expansion to first order in the errors."""
    expanded = rates.xreplace(dict(first_order))
    return expanded.jacobian(errors).xreplace(dict.fromkeys(errors, sympy.S.Zero))


def tidy(expression: Any) -> Any:
    """Products of signs multiplied out: sgn² = 1, u·sgn(u) = |u|."""
    expression = sympy.expand(expression)
    for s in expression.atoms(Sgn):
        u = s.args[0]
        expression = expression.subs(s**3, s).subs(s**2, 1)
        expression = sympy.expand(expression.subs(u * s, Magnitude(u)))
    return sympy.expand(sympy.powsimp(expression), power_exp=False)  # |u|^μ/|u| is |u|^(μ−1)


def readable(derived: Derived) -> Any:
    """The shown form of a quantity: its own form, else SymPy's expressions."""
    if derived.form:
        return derived.form
    value = derived.value
    rows = [[str(_shortest(value[i, j])) for j in range(value.cols)] for i in range(value.rows)]
    return rows[0][0] if value.shape == (1, 1) else rows


def _shortest(expression: Any) -> Any:
    spread = tidy(expression)
    tries = [spread, sympy.factor(spread)] if sympy.count_ops(spread) < 120 else [spread]
    return min(tries, key=lambda e: int(sympy.count_ops(e)))

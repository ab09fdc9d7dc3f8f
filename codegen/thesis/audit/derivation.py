"""Derivations: the symbols of a group of printed formulas, and quantities derived in these symbols."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import sympy

from codegen.spec.functions import Magnitude, Sgn
from codegen.thesis.audit.formula import as_matrix


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

"""The symbols that a group of printed formulas uses, and our own derivations in these symbols."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import sympy

from codegen.spec.functions import Magnitude, Sgn
from codegen.thesis.audit.formula import as_matrix


class Derived(NamedTuple):
    """One thing that was derived.

    Attributes:
        value: over the world's symbols, as a matrix (1 by 1 for a scalar).
        form: the same in the thesis' notation, proven equal to ``value`` before it is shown; empty where SymPy's own
            writing is short enough.
    """

    value: Any
    form: Any = ""


@dataclass(frozen=True)
class World:
    """Names and derivations.

    Attributes:
        names: what a printed formula may call; expressions and matrices over free symbols.
        derived: by name; given as (value, form) or as a value alone.
        steady: symbols that are zero where U does not depend on x (the elements of dU/dt), if there are any.
        positive: free symbols that are positive by their meaning.
        ranges: free symbols that have a meaning only for some values.
    """

    names: Mapping[str, Any]
    derived: Mapping[str, Any]
    steady: tuple[Any, ...] = ()
    positive: frozenset[Any] = frozenset()
    ranges: Mapping[Any, tuple[Any, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Make every derivation a ``Derived`` with a matrix."""
        given = {name: one if isinstance(one, tuple) else (one,) for name, one in self.derived.items()}
        made = {name: Derived(as_matrix(value), *form) for name, (value, *form) in given.items()}
        object.__setattr__(self, "derived", made)


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
    """Symbols by their names."""
    return {s.name: s for s in symbols}


def rate(expression: Any, flows: Mapping[Any, Any]) -> Any:
    """d/dt by the chain rule: the sum of ∂/∂s times ds/dt over the symbols s that move."""
    if isinstance(expression, sympy.MatrixBase):
        return expression.applyfunc(lambda entry: rate(entry, flows))
    return sum((expression.diff(s) * flows[s] for s in expression.free_symbols if s in flows), sympy.S.Zero)


def moving(symbols: Any, rates: Any) -> dict[Any, Any]:
    """The flows of a matrix of symbols."""
    return dict(zip(symbols, rates, strict=True))


def jacobian_at_zero(rates: Any, errors: Any, first_order: Mapping[Any, Any]) -> Any:
    """∂rates/∂errors at zero error, with what depends on the estimate given to first order in the error."""
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
    """What to show for a derivation: its form if it has one, else the expressions that SymPy gives."""
    if derived.form:
        return derived.form
    value = derived.value
    rows = [[str(_shortest(value[i, j])) for j in range(value.cols)] for i in range(value.rows)]
    return rows[0][0] if value.shape == (1, 1) else rows


def _shortest(expression: Any) -> Any:
    spread = tidy(expression)
    tries = [spread, sympy.factor(spread)] if sympy.count_ops(spread) < 120 else [spread]
    return min(tries, key=lambda e: int(sympy.count_ops(e)))

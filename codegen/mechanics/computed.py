"""SymPy functions defined by a CasADi expression, for quantities too large for a symbolic expression.

An example is M(x) of a seven-joint arm, whose symbolic expansion takes too long. Here each entry is one SymPy function
of its arguments. It can be substituted in and differentiated (the derivative, by CasADi, is another such function), and
``to_casadi`` inserts its definition, once for all entries at the same arguments.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, cast

import casadi
import sympy
from sympy import ImmutableMatrix

from codegen.base.files import sha256


class Computation(sympy.Atom):
    """A vector function of named arguments, defined by a CasADi expression.

    Two computations are equal if they have the same labels, arguments and instructions.

    Attributes:
        names: names of the arguments on which any entry depends, in order.
        labels: the printed name of each entry.
    """

    def __new__(cls, labels: Sequence[str], expression: Any, arguments: Mapping[str, Any]) -> Computation:
        """Make one from its definition.

        Args:
            labels: the printed name of each entry.
            expression: k by 1 SX over the symbols of ``arguments``.
            arguments: name → SX symbol.
        """
        self: Computation = super().__new__(cls)
        used = {s.name() for s in casadi.symvar(casadi.SX(expression))}
        kept = {name: s for name, s in arguments.items() if s.name() in used}
        self.labels, self.names = tuple(labels), tuple(kept)
        self._symbols, self._expression = list(kept.values()), expression
        return self

    @cached_property
    def function(self) -> Any:
        """The CasADi function of the arguments stacked in one column."""
        column = casadi.SX.sym("arguments", len(self.names))
        value = casadi.substitute(self._expression, casadi.vertcat(*self._symbols), column) if self.names else None
        return casadi.Function("computed", [column], [self._expression if value is None else value])

    @cached_property
    def digest(self) -> str:
        """Hash of the CasADi instructions, for comparison of two computations."""
        return sha256(f"{self.labels} {self.names} {self.function.serialize()}")

    @cached_property
    def slope(self) -> Computation:
        """Derivatives of every entry with respect to every argument, argument by argument."""
        column = casadi.vertcat(*self._symbols)
        jacobian = casadi.vec(casadi.jacobian(self._expression, column))
        labels = [f"d{label}_d{name}" for name in self.names for label in self.labels]
        return Computation(labels, jacobian, dict(zip(self.names, self._symbols, strict=True)))

    def entry(self, index: int, arguments: Mapping[str, Any]) -> Any:
        """One entry as a SymPy expression at ``arguments``; an exact number where it is constant."""
        value = self._expression[index]
        if value.is_constant():
            return sympy.Rational(f"{float(value):.15g}")
        return ComputedEntry(self, sympy.Integer(index), *[arguments[name] for name in self.names])

    def _hashable_content(self) -> tuple[Any, ...]:
        return (self.digest,)

    def _sympystr(self, printer: Any) -> str:
        return f"{self.labels[0]}..{self.labels[-1]}"

    def sort_key(self, order: Any = None) -> Any:
        """Key of SymPy's ordering: the labels first, so that the order does not depend on CasADi's instructions."""
        return self.class_key(), (2, (self.labels[0], self.digest)), sympy.S.One.sort_key(), sympy.S.One


class ComputedEntry(sympy.Function):
    """One entry of a ``Computation`` at given arguments; ``args`` are the computation, the index and the arguments."""

    is_real = True
    is_commutative = True

    @property
    def computation(self) -> Computation:
        """The vector function of which this is an entry."""
        return cast(Computation, self.args[0])

    @property
    def index(self) -> int:
        """Index of the entry."""
        return int(self.args[1])

    @property
    def arguments(self) -> tuple[Any, ...]:
        """The arguments, in the order of ``Computation.names``."""
        return tuple(self.args[2:])

    @cached_property
    def free_symbols(self) -> set[Any]:
        """The free symbols, cached: SymPy asks for them at every node of every derivative."""
        return set().union(*(a.free_symbols for a in self.arguments))

    def _eval_derivative(self, s: Any) -> Any:
        """The chain rule; the outer derivatives are entries of the computation's slope."""
        at = dict(zip(self.computation.names, self.arguments, strict=True))
        total = sympy.S.Zero
        for k, argument in enumerate(self.arguments):
            if s in argument.free_symbols:
                outer = self.computation.slope.entry(k * len(self.computation.labels) + self.index, at)
                total += outer * argument.diff(s)
        return total

    def _eval_evalf(self, precision: int) -> Any:
        """The numeric value; None if an argument is not a number."""
        values = [a.evalf(precision) for a in self.arguments]
        if not all(v.is_Float or v.is_Integer for v in values):
            return None
        return sympy.Float(float(self.computation.function([float(v) for v in values])[self.index]))

    def _sympystr(self, printer: Any) -> Any:
        """The entry's label, followed by those arguments that differ from the computation's own names."""
        pairs = zip(self.computation.names, self.arguments, strict=True)
        other = ", ".join(f"{name}={printer._print(a)}" for name, a in pairs if str(a) != name)
        return self.computation.labels[self.index] + (f"({other})" if other else "")

    _sympyrepr = _sympystr

    def _latex(self, printer: Any, exp: str | None = None) -> str:
        """The entry's text as upright LaTeX, with an exponent if one is given."""
        body = r"\mathrm{" + str(self).replace("_", r"\_") + "}"
        return rf"{body}^{{{exp}}}" if exp else body


def by_computed(expression: sympy.Expr) -> tuple[sympy.Expr, sympy.Expr]:
    """(terms with computed entries, all others) of a sum; a product of sums with computed entries is expanded."""
    computed: list[sympy.Expr] = []
    others: list[sympy.Expr] = []
    for term in sympy.Add.make_args(expression):
        for part in sympy.Add.make_args(sympy.expand_mul(term)) if term.has(ComputedEntry) else [term]:
            (computed if part.has(ComputedEntry) else others).append(part)
    return sympy.Add(*computed), sympy.Add(*others)


def computed_matrix(
    label: Callable[[int, int], str], value: Any, arguments: Mapping[sympy.Symbol, Any], symmetric: bool = False
) -> Any:
    """An n by m matrix of computed entries; constant ones become exact numbers, structural zeros 0.

    Args:
        label: (i, j) → the entry's name.
        value: n by m SX over ``arguments``, which are SymPy symbol → SX symbol.
        symmetric: whether the lower triangle serves for the upper one too.
    """
    rows, columns = value.shape
    places = [(i, j) for j in range(columns) for i in range(rows) if not symmetric or j <= i]
    column = casadi.vertcat(*[casadi.densify(value)[i, j] for i, j in places])
    computation = Computation([label(i, j) for i, j in places], column, {s.name: x for s, x in arguments.items()})
    named = {s.name: s for s in arguments}
    entries = {place: computation.entry(k, named) for k, place in enumerate(places)}
    return ImmutableMatrix(rows, columns, lambda i, j: entries[max(i, j), min(i, j)] if symmetric else entries[i, j])

"""Generic ranks of matrices over the envelope: exact where the entries are rational in x, sin x and cos x."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import sympy
from sympy.polys.matrices import DomainMatrix

from codegen.mechanics import sampling
from codegen.mechanics.system import Matrix

LONGEST = 3000


@dataclass(frozen=True)
class Ranks:
    """Generic ranks of matrices of one system.

    Attributes:
        values: exact parameter values.
        points: of the envelope, for entries that have no exact form.
    """

    values: dict[sympy.Symbol, Any]
    points: list[dict[sympy.Symbol, Any]]

    def rank(self, matrix: Any) -> int:
        """The rank at almost every point of the envelope."""
        form = self._exact(matrix)
        return int(form.rank()) if form is not None else sampling.rank(Matrix(matrix), self.points)

    def is_exact(self, matrices: Iterable[Any]) -> bool:
        """Whether the ranks of these matrices are exact rather than from sampled points."""
        return all(self._exact(m) is not None for m in matrices)

    def is_constant(self, matrix: Any) -> bool:
        """Whether a matrix depends on parameters only."""
        return bool(matrix.free_symbols <= set(self.values))

    def _exact(self, matrix: Any) -> DomainMatrix | None:
        """The matrix over the field of rational functions; None where it has no such form."""
        matrix = sympy.Matrix(matrix).subs(self.values)
        if 0 in matrix.shape:
            return DomainMatrix.from_Matrix(matrix).to_field()
        if sympy.count_ops(matrix) > LONGEST:
            return None
        algebraic = matrix.applyfunc(_algebraic)
        if algebraic.atoms(sympy.Function) or not all(e.is_rational_function() for e in algebraic):
            return None
        form = DomainMatrix.from_Matrix(algebraic).to_field()
        domain = form.domain
        return form if domain.is_QQ or (domain.is_Composite and domain.domain in (sympy.QQ, sympy.ZZ)) else None


def _algebraic(entry: Any) -> Any:
    """sin and cos of an angle by the tangent of half the angle, which makes them algebraically independent."""
    if not entry.has(sympy.sin, sympy.cos, sympy.tan):
        return entry
    expanded = sympy.expand_trig(entry.rewrite(sympy.tan, sympy.sin) if entry.has(sympy.tan) else entry)
    halves: dict[Any, Any] = {}
    for call in expanded.atoms(sympy.sin, sympy.cos):
        angle = call.args[0]
        if not angle.is_Symbol:
            continue
        t = sympy.Symbol(f"{angle.name}__tangent", real=True)
        halves[call] = 2 * t / (1 + t**2) if call.func is sympy.sin else (1 - t**2) / (1 + t**2)
    return expanded.subs(halves)

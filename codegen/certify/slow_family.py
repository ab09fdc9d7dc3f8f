"""A(θ, v, …) in the form that a parameter-dependent P(θ) needs (docs/certificate_theory.md, theorem 3).

A is affine in functions of the position θ alone, each replaced by its chord over an interval, with coefficients that do
not depend on θ: velocities, signs and other parameters.
"""

from __future__ import annotations

from typing import Any

import sympy

from codegen.analysis.terms import expand_products
from codegen.certify.family import Family
from codegen.spec.model import symbol


def along(family: Family, variable: sympy.Symbol, velocity: sympy.Symbol) -> Family | None:
    """The same matrices, every parameter a function of θ alone or free of it, no two of θ in a product.

    None where A is not of that form, or the velocity of θ stands within another factor.
    """
    curves: dict[Any, sympy.Symbol] = {}
    free: dict[Any, sympy.Symbol] = {}
    known = {e: p for p, e in family.parameters.items() if not e.is_Symbol}

    def factors_of(p: sympy.Symbol) -> tuple[Any, ...]:
        e = family.parameters.get(p, p)
        return sympy.Mul.make_args(e) if e.has(variable) else (e,)

    def named(factor: Any) -> sympy.Symbol:
        if factor not in free:
            made = f"at_{factor.name}" if factor.is_Symbol else f"free{len(free) + 1}"
            free[factor] = known.get(factor) or symbol(made)
        return free[factor]

    def rewrite(entry: Any) -> Any:
        total = sympy.Integer(0)
        for term in sympy.Add.make_args(expand_products(entry)):
            coefficient, rest = term.as_coeff_Mul()
            factors = [f for p in sympy.Mul.make_args(rest) for f in factors_of(p)]
            coefficient *= sympy.Mul(*(f for f in factors if f.is_Rational))
            curve = sympy.Mul(*(f for f in factors if f.has(variable)))
            others = [f for f in factors if not f.is_Rational and not f.has(variable)]
            if curve != 1:
                others.append(curves.setdefault(curve, symbol(f"{variable.name}_{len(curves) + 1}")))
            total += coefficient * sympy.Mul(*(f if f in curves.values() else named(f) for f in others))
        return total

    matrix = family.matrix.applyfunc(rewrite)
    parameters = {name: factor for group in (curves, free) for factor, name in group.items()}
    alone = all(curve.free_symbols == {variable} for curve in curves)
    bare = all(factor == velocity or not factor.has(velocity) for factor in free)
    clear = not {s.name for s in parameters} & {v.name for v in family.variables}
    once = all(entry.is_polynomial(*parameters) for entry in matrix) and all(
        sympy.degree(entry, p) < 2 for entry in matrix for p in parameters if entry.has(p)
    )
    return Family(family.variables, parameters, matrix, family.bounded) if alone and bare and clear and once else None

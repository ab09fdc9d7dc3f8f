"""Characteristic polynomials and stability criteria: Routh–Hurwitz (Liénard–Chipart) for Ψ, Jury for the step.

The Jury conditions are Routh–Hurwitz conditions after the bilinear map z = (1 + sh/2)/(1 − sh/2) of the open left half
plane onto the open unit disc; with δ = (z − 1)/h that is δ = s/(1 − sh/2).
"""

from collections.abc import Sequence
from typing import Any

import sympy


def expand_products(expression: Any) -> Any:
    """Expand products of sums, except inside functions: exp(−(u/v)²) must not become a product of exponentials."""
    if _multiplied_out(expression):
        return expression
    outermost = _outermost_functions(expression)
    mask = {f: sympy.Dummy(f"f{k}", real=True) for k, f in enumerate(outermost)}
    masked = expression.xreplace(mask)
    # Each rule traverses the whole expression several times, so rules that would find nothing are disabled.
    powers = any(not p.exp.is_Integer for p in masked.atoms(sympy.Pow))
    expanded = sympy.expand(masked, power_base=powers, power_exp=powers, log=False, basic=False)
    return expanded.xreplace({dummy: f for f, dummy in mask.items()})


def _multiplied_out(expression: Any) -> bool:
    """Whether it is a sum of products of numbers, symbols, functions, and whole powers of symbols."""
    factors = (f for term in sympy.Add.make_args(expression) for f in sympy.Mul.make_args(term))
    return all(f.is_Atom or f.is_Function or (f.is_Pow and f.base.is_Symbol and f.exp.is_Integer) for f in factors)


def _outermost_functions(expression: Any) -> list[Any]:
    """The function calls of an expression that are inside no other call, each once."""
    if isinstance(expression, sympy.Function):
        return [expression]
    found: list[Any] = []
    for argument in getattr(expression, "args", ()):
        found += [f for f in _outermost_functions(argument) if f not in found]
    return found


def characteristic_polynomial(matrix: Any) -> list[Any]:
    """Coefficients of |sI − A|, highest power first, by the Faddeev–LeVerrier algorithm.

    N₀ = I, c_k = −tr(A N_{k−1})/k, N_k = A N_{k−1} + c_k I for k = 1…m. It divides by 1…m only, so the coefficients
    stay polynomials in the entries.
    """
    m = matrix.rows
    coefficients: list[Any] = [sympy.Integer(1)]
    auxiliary = sympy.eye(m)  # N
    for k in range(1, m + 1):
        product = (matrix * auxiliary).applyfunc(expand_products)
        coefficients.append(expand_products(-product.trace() / k))
        auxiliary = product + coefficients[-1] * sympy.eye(m)
    return coefficients


def hurwitz_determinant(c: Sequence[Any], order: int) -> Any:
    """The leading principal minor of this order of a polynomial's Hurwitz matrix; coefficients highest first."""

    def at(index: int) -> Any:
        return c[index] if 0 <= index < len(c) else sympy.Integer(0)

    matrix = sympy.Matrix(order, order, lambda i, j: at(2 * (j + 1) - (i + 1)))
    return sympy.expand(matrix.det(method="berkowitz"))


def routh_hurwitz(c: Sequence[Any]) -> list[tuple[str, Any]]:
    """Conditions > 0, necessary and sufficient for all roots in the open left half plane (Liénard–Chipart).

    They are (name, expression) pairs: every second coefficient counted from the last, and every second Hurwitz
    determinant. ``c``: coefficients, highest first; the highest must be positive.
    """
    n = len(c) - 1
    conditions = [(f"c{n - i}", c[i]) for i in range(n, 0, -2)]
    conditions += [(f"D{k}" if k > 1 else f"c{n - 1}", hurwitz_determinant(c, k)) for k in range(n - 1, 0, -2)]
    if n == 1:
        conditions = [("c0", c[1])]
    return conditions[::-1]


def bilinear(c: Sequence[Any], h: Any) -> list[Any]:
    """Coefficients in s, highest first, of (1 − hs/2)ⁿ p(δ) with δ = s/(1 − hs/2); ``c``: those of p, highest first."""
    s = sympy.Symbol("s_", real=True)
    n = len(c) - 1
    total = sum(coefficient * s ** (n - i) * (1 - h * s / 2) ** i for i, coefficient in enumerate(c))
    polynomial = sympy.expand(total)
    return [sympy.expand(polynomial.coeff(s, k)) for k in range(n, -1, -1)]


def jury(c: Sequence[Any], h: Any) -> list[tuple[str, Any]]:
    """Conditions > 0, necessary and sufficient for |z| < 1 at every root, for a polynomial in δ = (z − 1)/h.

    The first is p(−2/h)·(−h/2)ⁿ > 0 (no root beyond z = −1): it is the highest coefficient after the map, which
    Routh–Hurwitz takes to be positive. The rest are the conditions of Routh–Hurwitz on the mapped polynomial.
    """
    mapped = bilinear(c, h)
    return [("p(z=-1)", mapped[0]), *[(f"J:{name}", e) for name, e in routh_hurwitz(mapped)]]

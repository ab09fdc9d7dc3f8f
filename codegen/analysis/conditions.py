"""Routh–Hurwitz and Jury conditions on the gains, from the characteristic polynomial of each diagonal block of Ψ."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray
from sympy.utilities.iterables import strongly_connected_components

from codegen.analysis.error_dynamics import ErrorDynamics
from codegen.analysis.polynomials import characteristic_polynomial, jury, routh_hurwitz
from codegen.base.arrays import Array
from codegen.mechanics.casadi_form import at_points, function_of
from codegen.mechanics.system import Matrix
from codegen.spec.model import symbol

SYMBOLIC_ORDER = 4
"""Highest order of a block whose conditions are derived symbolically."""
PRINTABLE = 40
"""Most operations in an expression that is printed."""
MOST_DEGREE = 24
"""Highest total degree of a polynomial in several variables that is factored: at 35, minutes were not enough."""


@dataclass(frozen=True)
class Condition:
    """A stability condition ``expression`` > 0.

    Attributes:
        label: the coefficient or determinant that must be positive, such as ``c0``, ``D3`` or ``J:c1``.
        expression: without factors that are known to be positive.
        value: smallest value over the operating points, at the spec's numbers.
    """

    label: str
    expression: Any
    value: float

    @property
    def readable(self) -> bool:
        """Whether the expression is short enough to print; otherwise only its label is printed."""
        return int(sympy.count_ops(self.expression)) <= PRINTABLE

    @property
    def holds(self) -> bool:
        """Whether it holds at every operating point."""
        return self.value > 0


@lru_cache(maxsize=256)  # the expressions do not depend on the values of gains and parameters
def reduce_conditions(
    raw: tuple[tuple[str, Any], ...], positive: frozenset[sympy.Symbol]
) -> tuple[tuple[str, Any], ...]:
    """The conditions (label, expression > 0) without positive factors: symbols, earlier ones, squares in denominators.

    A square in a numerator stays unless it is known to be nonzero: a slip speed or a friction state may pass zero.
    """
    known: list[Any] = [*positive]
    result: list[tuple[str, Any]] = []
    for name, expression in raw:
        reduced = sympy.S.Zero if expression == 0 else _without(expression, known)  # 0 > 0 is never satisfied
        if reduced.is_number and reduced > 0:
            continue
        known.append(reduced)
        result.append((name, reduced))
    return tuple(result)


def _without(expression: Any, known: Sequence[Any]) -> Any:
    """The expression without factors that are known to be positive; its sign is unchanged."""
    if int(sympy.count_ops(expression)) > 400:
        return expression  # too expensive to factor
    numerator, denominator = sympy.fraction(sympy.together(expression))
    positive = {_multiplied_out(k) for k in known}
    sign = 1
    kept: list[Any] = []
    squares: list[Any] = []
    factors = [(part, power, True) for part, power in _factors(numerator)]
    factors += [(part, power, False) for part, power in _factors(denominator)]
    for part, power, above in factors:
        odd = power % 2 == 1
        if part.is_number:
            sign *= -1 if odd and part < 0 else 1
        elif _multiplied_out(part) in positive:
            continue
        elif _multiplied_out(-part) in positive:
            sign *= -1 if odd else 1
        elif odd:
            kept.append(part)
        elif above:
            squares.append(part**2)
    if not kept and sign < 0:
        return sympy.Integer(-1)  # negative for any values of the squares
    reduced = sympy.Mul(sign, *kept, *squares)
    return sympy.expand(reduced) if len(kept) + len(squares) <= 1 else reduced


@lru_cache(maxsize=1024)
def _multiplied_out(expression: Any) -> Any:
    """``sympy.expand``, cached: polynomials are equal if and only if their expanded forms are."""
    return sympy.expand(expression)


def _factors(expression: Any) -> list[tuple[Any, int]]:
    """(factor, power) of a polynomial over the rationals; an expression that is none, or of a high degree, is its own
    factor.
    """
    try:
        if not _is_factorable(expression):
            return [(expression, 1)]
        constant, factors = sympy.factor_list(expression)
    except sympy.PolynomialError:  # a power with a real exponent
        return [(expression, 1)]
    return [(constant, 1), *[(f, int(p)) for f, p in factors]]


def _is_factorable(expression: Any) -> bool:
    """Whether each factor as written has one variable or a low degree; otherwise factoring may take minutes."""
    for factor in sympy.Mul.make_args(expression):
        base = factor.as_base_exp()[0]
        if not base.is_number:
            polynomial = sympy.Poly(base)
            if len(polynomial.gens) > 1 and polynomial.total_degree() > MOST_DEGREE:
                return False
    return True


@dataclass(frozen=True)
class BlockConditions:
    """Characteristic polynomial and stability conditions of one diagonal block of Ψ in force errors.

    Attributes:
        errors: its components of e.
        polynomial: coefficients of |sI − Ψ_block|, highest first; None above order 4.
        routh: conditions > 0, necessary and sufficient for a Hurwitz block of Ψ; () above order 4.
        jury: the same for |z| < 1 of the step; () above order 4 or with an implicit step.
    """

    errors: tuple[sympy.Symbol, ...]
    polynomial: tuple[Any, ...] | None
    routh: tuple[Condition, ...]
    jury: tuple[Condition, ...]


def independent_blocks(*matrices: Matrix) -> list[list[int]]:
    """Index sets of the diagonal blocks of matrices that a common permutation makes block-triangular.

    These are the strongly connected components of the graph of all nonzero entries, in the order of their first index.
    """
    m = matrices[0].rows
    edges = {place for a in matrices for place in a.todok()}
    return sorted(sorted(block) for block in strongly_connected_components((range(m), edges)))


def block_conditions(dynamics: ErrorDynamics, continuous: Any, sampled: Any) -> tuple[BlockConditions, ...]:
    """Polynomial and conditions of every block; over the gains if short, else over the polynomial's coefficients c.

    ``continuous`` and ``sampled`` are Ψ and A in force errors at the operating points, points by m by m.
    """
    psi, step = dynamics.in_force(dynamics.jacobian), dynamics.in_force(dynamics.sampled)
    blocks = independent_blocks(psi, step)
    positive = {name for name, value in dynamics.observer.system.values.items() if value > 0}
    period, h = symbol("h"), float(dynamics.observer.sample_time)

    def of_block(block: list[int]) -> BlockConditions:
        """The conditions of the errors with these indices."""
        errors, order = tuple(dynamics.errors[i] for i in block), len(block)
        if order > SYMBOLIC_ORDER:
            return BlockConditions(errors, None, (), ())
        c = [sympy.Integer(1), *[symbol(f"c{k}") for k in range(order - 1, -1, -1)]]
        prefix = f"{errors[-1]}: " if len(blocks) > 1 else ""

        def conditions(
            raw: list[tuple[str, Any]], of: Sequence[Any], at: Any, known: set[Any]
        ) -> tuple[Condition, ...]:
            smallest = _smallest(raw, c, at[:, block][:, :, block], h)
            written = written_conditions(raw, c, of, known)
            return tuple(Condition(prefix + label, e, smallest[label]) for label, e in written)

        polynomial = tuple(characteristic_polynomial(psi[block, block]))
        routh = conditions(routh_hurwitz(c), polynomial, continuous, positive)
        if dynamics.implicit:
            return BlockConditions(errors, polynomial, routh, ())
        of_step = characteristic_polynomial(step[block, block])
        stepped = conditions(jury(c, period), of_step, sampled, positive | {period})
        return BlockConditions(errors, polynomial, routh, stepped)

    return tuple(map(of_block, blocks))


def written_conditions(
    raw: Sequence[tuple[str, Any]], c: Sequence[Any], coefficients: Sequence[Any], positive: set[sympy.Symbol]
) -> tuple[tuple[str, Any], ...]:
    """Conditions in printed form, together equivalent to those of ``raw``, which are over ``c``.

    A factor is removed only if it is positive by its meaning or by an earlier condition of the same list, so the Jury
    conditions do not depend on those of Routh–Hurwitz. The coefficients are inserted up to order 2, and above where the
    result is short.

    Args:
        c: symbols of the coefficients, highest first; the first is 1.
        coefficients: their expressions over gains and parameters.
    """
    values = dict(zip(c[1:], coefficients[1:], strict=True))
    written = []
    for name, e in raw:
        value = e.subs(values)
        short = len(c) <= 3 or e in values or int(sympy.count_ops(value)) <= PRINTABLE
        written.append((name, value if short else e))
    return reduce_conditions(tuple(written), frozenset(positive))


def _smallest(raw: Sequence[tuple[str, Any]], c: Sequence[Any], matrices: Any, h: float) -> dict[str, float]:
    """Label → smallest value of the condition over the points, from the matrices (points, order, order)."""
    function = function_of(Matrix([e for _, e in raw]), c[1:], {symbol("h"): h})
    coefficients = _coefficients(np.asarray(matrices))
    values = at_points(function, coefficients.T)[:, :, 0].min(axis=0)
    return {name: float(value) for (name, _), value in zip(raw, values, strict=True)}


def _coefficients(matrices: Array) -> Array:
    """Coefficients of |sI − A| after the first, order by points, computed exactly and rounded to doubles.

    Faddeev–LeVerrier in integers: in doubles its cancellation would lose a slow rate in the presence of a fast one.
    OverflowError is raised if a coefficient exceeds the range of a double.
    """
    ratios = [value.as_integer_ratio() for value in matrices.ravel().tolist()]
    scale = max((below for _, below in ratios), default=1)  # each is a power of two
    numbers = [above * (scale // below) for above, below in ratios]
    whole: NDArray[np.object_] = np.array(numbers, dtype=object).reshape(matrices.shape)
    order, unit = matrices.shape[1], np.eye(matrices.shape[1], dtype=int).astype(object)
    found, product = [], np.broadcast_to(unit, matrices.shape)
    for k in range(1, order + 1):
        current = sum(whole[:, :, j, None] * product[:, None, j, :] for j in range(order))
        coefficient = -sum(current[:, j, j] for j in range(order)) // k  # exact division
        found.append([c / scale**k for c in coefficient])
        product = current + coefficient[:, None, None] * unit
    return np.array(found)

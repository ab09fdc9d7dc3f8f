"""Covers of the envelope by cells, for an error matrix rational in variables and in sines and cosines of angles.

A box of parameters, such as sin q and cos q/det M, treats them as independent, which costs much of the rate or takes
thousands of cells. So P is found at sampled points, and the checker verifies it on cells of the variables themselves
(kernel.py, lemmas 3 and 7). Cut are t = tan(q/2) of each angle q, which takes all values whatever its range in the
envelope, and each variable in which A is not affine.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache, partial
from itertools import product
from typing import Any

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.certify.certificate_text import fraction, rounded_matrix, texts, to_prefix
from codegen.certify.content import Found, as_prefix
from codegen.certify.enclosure import exact_ranges
from codegen.certify.family import Family
from codegen.certify.lyapunov import common_lyapunov
from codegen.checker import decay, kernel, verify

MOST_POINTS, MOST_CORNERS = 16, 64
"""Largest number of sampled points of all variables that are cut together (3 for each at least), and of vertices of the
other variables."""
LESS = (0.99, 0.97, 0.9, 0.75, 0.5)
"""Shares of the rate at the sampled points that are tried for all points."""
DEEPEST, MOST_ERRORS = 6, 12
"""Largest number of bisections for each variable, and largest number of errors."""
DEEPEST_BOX = 12
"""Largest number of bisections of the box of ``some_is_nonzero`` one after another."""
DIGITS = 9
"""Significant digits of P in the test of a cell."""
Cell = dict[str, tuple[Fraction, Fraction]]
"""Variable that is cut, "q t" for an angle q → (low, high), which is [0, 1] for all of an angle."""


def over_variables(family: Family) -> tuple[Any, list[sympy.Symbol], list[sympy.Symbol]]:
    """A over the variables; the angles in its sines and cosines; the other variables with a range where A is curved."""
    matrix = family.matrix.xreplace(dict(family.parameters))
    angles = sorted({a for e in matrix for f in e.atoms(sympy.sin, sympy.cos) for a in f.free_symbols}, key=str)
    ranged = [v for v, (low, high) in family.variables.items() if low < high and v not in angles]
    return matrix, angles, [v for v in ranged if any(e.diff(v).has(v) for e in matrix)]


def sampled_matrices(family: Family) -> Array | None:
    """A at sampled points, N by m by m; None if no variable is cut, or if there can be no cover.

    There is none with functions other than sines and cosines in A, or with too many errors or variables.
    """
    matrix, angles, curved = over_variables(family)
    others = [v for v in family.variables if v not in (*angles, *curved)]
    alike = all(f.func in (sympy.sin, sympy.cos) for e in matrix for f in e.atoms(sympy.Function))
    rational = all(p.exp.is_Integer for e in matrix for p in e.atoms(sympy.Pow))
    cut = len(angles) + len(curved)
    if not cut or not alike or not rational or matrix.rows > MOST_ERRORS or 2 ** len(others) > MOST_CORNERS:
        return None
    count = max(3, int(MOST_POINTS ** (1 / cut)))
    circle = np.linspace(-np.pi, np.pi, count, endpoint=False)
    ends = {v: [float(e) for e in family.variables[v]] for v in (*curved, *others)}
    function = sympy.lambdify([*angles, *curved, *others], matrix, "numpy")
    lines: list[Any] = [
        *[circle] * len(angles),
        *[np.linspace(ends[v][0], ends[v][1], count) for v in curved],
        *[ends[v] for v in others],
    ]
    sampled = {tuple(np.array(function(*point), dtype=float).ravel()) for point in product(*lines)}
    return np.array(sorted(sampled)).reshape(-1, *matrix.shape)


def by_cover(family: Family, h: Any) -> Found | None:
    """A proposal with a cover; None if there can be none (``sampled_matrices``), or if no P is found."""
    matrices = sampled_matrices(family)
    found = None if matrices is None else common_lyapunov(matrices, float(h))
    return None if found is None else with_cover(Found(family, *found), h)


def with_cover(found: Found, h: Any) -> Found | None:
    """The proposal with cells on which its P decreases, at the largest of the shares ``LESS`` of its rate; or None."""
    try:
        decreases = _leaf(found.family, h, found.p)
    except ValueError:  # powers beyond the checker's limits
        return None
    (matrix, angles, curved), ranges = over_variables(found.family), exact_ranges(found.family)
    # The checker has no t of an angle that occurs in sums alone, as in sin(q + h w).
    whole: Cell = {f"{a.name} t": (Fraction(0), Fraction(1)) for a in angles if matrix.has(sympy.sin(a), sympy.cos(a))}
    whole |= {v.name: ranges[v] for v in curved}

    @cache
    def tree(share: float) -> Any:
        factor = 1 - 2 * Fraction(str(h)) * Fraction(f"{share * found.rate:.9g}")
        return covering(partial(decreases, factor), whole, DEEPEST * len(whole))

    if tree(LESS[0]) is None and tree(LESS[-1]) is None:
        return None  # where the least share has no cover, none has
    share = next(share for share in LESS if tree(share) is not None)
    return replace(found, rate=share * found.rate * 0.999, cover=(tree(share),))


def _leaf(family: Family, h: Any, p: Array) -> Callable[[Fraction, Cell], bool]:
    """The test (c, cell) → whether Φ'PΦ ≤ cP on a cell, by the checker's own functions."""
    known: dict[Any, Any] = {}
    box = {v.name: ends for v, ends in exact_ranges(family).items()}
    stated: dict[str, Any] = {
        "observer": {"integration": "euler"},
        "sample_time": str(h),
        "variables": box,
        **as_prefix(family),
    }
    step = decay.step(stated, {x: kernel.term(1, x) for x in box}, decay.polynomials(known))
    scale = p / np.abs(p).max()
    stated["lyapunov_matrix"] = texts(rounded_matrix(scale, DIGITS, np.sqrt(np.diag(scale))))

    def decreases(factor: Fraction, cell: Cell) -> bool:
        try:
            decay.decreases(stated, step, factor, box | cell, "", known)
        except ValueError:
            return False
        return True

    return decreases


def covering(holds: Callable[[Cell], bool], whole: Cell, deepest: int, cell: Cell | None = None) -> Any:
    """A binary tree of bisections of the longest side, with a condition true on each leaf; None if it would be deeper.

    "" is a leaf; [name, cut, lower part, upper part] is a bisection.

    Args:
        whole: the cell at the root; sides are compared relative to its own.
        deepest: largest number of bisections one after another.
        cell: the part that is covered; all by default.
    """
    cell = whole if cell is None else cell
    if holds(cell):
        return ""
    if deepest == 0:
        return None
    name = max(whole, key=lambda x: (cell[x][1] - cell[x][0]) / (whole[x][1] - whole[x][0]))
    low, high = cell[name]
    middle, parts = (low + high) / 2, []
    for ends in ((low, middle), (middle, high)):
        part = covering(holds, whole, deepest - 1, cell | {name: ends})
        if part is None:
            return None
        parts.append(part)
    return [name, str(middle), *parts]


def some_is_nonzero(
    expressions: Sequence[Any], variables: Sequence[sympy.Symbol], bounds: Sequence[tuple[float, float]]
) -> bool:
    """Whether it is proven that everywhere within the bounds of the variables some expression is not zero.

    On each cell one of the expressions must have an enclosure, in the checker's interval arithmetic, without 0.
    """
    whole = {v.name: (fraction(low), fraction(high)) for v, (low, high) in zip(variables, bounds, strict=True)}
    try:
        values = [verify.parse(to_prefix(e), [*whole], "expression")[1] for e in expressions]
    except (TypeError, verify.Refused):  # a function that certificates do not have
        return False

    def away_from_zero(value: Any, cell: Cell) -> bool:
        try:
            low, high = value(cell)
        except verify.Refused:
            return False
        return bool(low > 0 or high < 0)

    return covering(lambda cell: any(away_from_zero(value, cell) for value in values), whole, DEEPEST_BOX) is not None

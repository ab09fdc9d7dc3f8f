"""Common P for an error matrix that is rational in sines, cosines and variables, such as that of a robot arm.

A box of parameters, such as sin q and cos q/det M, treats them as independent, which costs much of the rate. So P is
found at sampled angles, and the checker verifies it on cells of t = tan(q/2), in which A is a quotient of polynomials
(kernel.py, lemmas 3 and 7). An angle takes all values, whatever its range in the envelope.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.certify.certificate_text import rounded_matrix, texts
from codegen.certify.content import Found, as_prefix
from codegen.certify.enclosure import exact_ranges
from codegen.certify.family import Family
from codegen.certify.lyapunov import common_lyapunov
from codegen.checker import decay, kernel

MOST_POINTS, MOST_CORNERS = 16, 64
"""Largest number of sampled points of all angles together (3 for each angle at least), and of vertices of the other
variables."""
LESS = (0.99, 0.97, 0.9, 0.75, 0.5)
"""Shares of the rate at the sampled angles that are tried for all angles."""
DEEPEST, MOST_ERRORS = 6, 12
"""Largest number of bisections for each angle, and largest number of errors."""
DIGITS = 9
"""Significant digits of P in the test of a cell."""
Cell = dict[str, tuple[Fraction, Fraction]]
"""Tangent variable "q t" of an angle q → (low, high) in [0, 1]."""


def angles_of(family: Family) -> list[sympy.Symbol]:
    """The symbols in sines and cosines of A, by name."""
    matrix = family.matrix.xreplace(dict(family.parameters))
    found = {a for e in matrix for f in e.atoms(sympy.sin, sympy.cos) for a in f.free_symbols}
    return sorted(found, key=str)


def over_angles(family: Family, h: Any) -> Found | None:
    """A proposal with a cover of the angles; None if A has other functions or no angle, or if no P is found.

    Args:
        family: the error matrices.
        h: sample time of the explicit step, s, exact.
    """
    matrix = family.matrix.xreplace(dict(family.parameters))
    angles = angles_of(family)
    others = [v for v in family.variables if v not in angles]
    alike = all(f.func in (sympy.sin, sympy.cos) for e in matrix for f in e.atoms(sympy.Function))
    rational = all(p.exp.is_Integer for e in matrix for p in e.atoms(sympy.Pow))
    if not angles or not alike or not rational or matrix.rows > MOST_ERRORS or 2 ** len(others) > MOST_CORNERS:
        return None
    circle = np.linspace(-np.pi, np.pi, max(3, int(MOST_POINTS ** (1 / len(angles)))), endpoint=False)
    function = sympy.lambdify([*angles, *others], matrix, "numpy")
    corners = product(*[circle] * len(angles), *[[float(e) for e in family.variables[v]] for v in others])
    sampled = {tuple(np.array(function(*corner), dtype=float).ravel()) for corner in corners}
    found = common_lyapunov([np.array(a).reshape(matrix.shape) for a in sorted(sampled)], float(h))
    if found is None:
        return None
    p, alpha = found
    decreases = _leaf(family, h, p)
    for share in LESS:
        factor = 1 - 2 * Fraction(str(h)) * Fraction(f"{share * alpha:.9g}")
        tree = _cover(partial(decreases, factor), [f"{a.name} t" for a in angles])
        if tree is not None:
            return Found(family, p, share * alpha * 0.999, cover=(tree,))
    return None


def _leaf(family: Family, h: Any, p: Array) -> Callable[[Fraction, Cell], bool]:
    """The test (c, cell) → whether Φ'PΦ ≤ cP on a cell of the tangent variables, by the checker's own functions."""
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


def _cover(decreases: Callable[[Cell], bool], names: list[str], cell: Cell | None = None, depth: int = 0) -> Any:
    """A binary tree of bisections of the longest side, with V decreasing on every leaf; None if it would be too deep.

    "" is a leaf; [name, cut, lower part, upper part] is a bisection.
    """
    cell = cell or dict.fromkeys(names, (Fraction(0), Fraction(1)))
    if decreases(cell):
        return ""
    if depth >= DEEPEST * len(names):
        return None
    name = max(names, key=lambda x: cell[x][1] - cell[x][0])
    low, high = cell[name]
    middle, parts = (low + high) / 2, []
    for ends in ((low, middle), (middle, high)):
        part = _cover(decreases, names, cell | {name: ends}, depth + 1)
        if part is None:
            return None
        parts.append(part)
    return [name, str(middle), *parts]

"""Conversion of SymPy expressions to a NumPy function, for fits of parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import sympy

_MODULES: list[Any] = [{"Magnitude": np.abs, "Sgn": np.sign}, "numpy"]
"""Functions by which ``lambdify`` evaluates an expression."""


def numpy_function(
    expressions: Sequence[Any], arguments: Sequence[sympy.Symbol], values: Mapping[sympy.Symbol, Any]
) -> Callable[..., list[Any]]:
    """A function of ``arguments`` that returns the list of ``expressions``.

    Args:
        values: numbers for the other symbols.
    """
    if not any(sympy.sympify(e).free_symbols for e in expressions):  # constants, as of most actuators: no compilation
        constant = [float(e) for e in expressions]
        return lambda *at: list(constant)
    others = {s for e in expressions for s in sympy.sympify(e).free_symbols} - set(arguments)
    known = sorted(others, key=str)
    numbers = [float(values[s]) for s in known]
    function = sympy.lambdify([*arguments, *known], [sympy.sympify(e) for e in expressions], _MODULES)
    return lambda *at: list(function(*at, *numbers))

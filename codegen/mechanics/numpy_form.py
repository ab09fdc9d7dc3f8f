"""Conversion of SymPy expressions to a NumPy function, for fits of parameters."""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import sympy

_MODULES: list[Any] = [{"Magnitude": np.abs, "Sgn": np.sign}, "numpy"]
"""Functions by which ``lambdify`` evaluates an expression."""
KEPT = 256
"""Compiled functions that are kept."""


def numpy_function(
    expressions: Sequence[Any], arguments: Sequence[sympy.Symbol], values: Mapping[sympy.Symbol, Any]
) -> Callable[..., list[Any]]:
    """A function of ``arguments`` that returns the list of ``expressions``.

    ``values``: numbers for the other symbols.
    """
    if not any(sympy.sympify(e).free_symbols for e in expressions):  # constants, as of most actuators: no compilation
        constant = [float(e) for e in expressions]
        return lambda *at: list(constant)
    exact = tuple(sympy.sympify(e) for e in expressions)
    symbols = set().union(*(e.free_symbols for e in exact))
    places = [k for k, s in enumerate(arguments) if s in symbols]
    known = sorted(symbols - set(arguments), key=str)
    numbers = [float(values[s]) for s in known]
    function = _function(exact, (*(arguments[k] for k in places), *known))
    return lambda *at: list(function(*(at[k] for k in places), *numbers))


@lru_cache(maxsize=KEPT)
def _function(expressions: tuple[sympy.Expr, ...], arguments: tuple[sympy.Symbol, ...]) -> Callable[..., list[Any]]:
    """The compiled function; that of an actuator is asked for by every model that has it."""
    function: Callable[..., list[Any]] = sympy.lambdify(arguments, list(expressions), _MODULES)
    return function

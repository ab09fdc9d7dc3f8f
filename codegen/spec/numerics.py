"""Failures of a numerical library on a user's numbers, reported as bad input."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Concatenate, ParamSpec, TypeVar

import numpy as np
from sympy.matrices.exceptions import MatrixError
from sympy.polys.polyerrors import PolynomialDivisionFailed

from codegen.base.errors import BadInput, Place
from codegen.spec.model import Spec

Rest = ParamSpec("Rest")
Result = TypeVar("Result")
Station = Callable[Concatenate[Spec, Rest], Result]
_NUMERICAL = (np.linalg.LinAlgError, ArithmeticError, MatrixError, PolynomialDivisionFailed)
EXPECTED = (
    "numbers whose products and inverses are within the range of a double (1e-308 to 1e308), and no mass close to zero"
)


def numerical(quantity: str, given: bool = True) -> Callable[[Station[Rest, Result]], Station[Rest, Result]]:
    """Decorator of a function whose first argument is the spec: where it cannot compute, the spec is bad input.

    Errors that do not come from numbers, such as a TypeError, pass: they are faults of the tool.

    Args:
        quantity: what the station computes, in the user's words.
        given: whether it computes with the numbers of the spec. A search tries numbers of its own: if Python divides by
            zero there, that is a fault of the tool as well.
    """

    def guarded(station: Station[Rest, Result]) -> Station[Rest, Result]:
        @wraps(station)
        def work(spec: Spec, /, *rest: Rest.args, **named: Rest.kwargs) -> Result:
            try:
                return station(spec, *rest, **named)
            except (*_NUMERICAL, RuntimeError, ValueError) as error:
                if not is_numerical(error) or (isinstance(error, ArithmeticError) and not given):
                    raise
                found = f"{quantity} cannot be computed ({type(error).__name__}: {error})"
                raise BadInput(Place(str(spec.path)), found, EXPECTED, code="SPEC028") from error

        return work

    return guarded


def is_numerical(error: Exception) -> bool:
    """Whether a library says by this that it cannot compute with the numbers; CasADi has no exception of its own."""
    said = str(error).lower()
    casadi = isinstance(error, RuntimeError) and "casadi" in said
    scipy = isinstance(error, ValueError) and "infs or nans" in said
    return isinstance(error, _NUMERICAL) or casadi or scipy


def require_finite(spec: Spec, content: object, quantity: str) -> None:
    """Raise BadInput where a result, made of dicts and lists, holds a number that is not finite."""
    if isinstance(content, float) and not math.isfinite(content):
        raise BadInput(Place(str(spec.path)), f"{quantity} cannot be computed ({content})", EXPECTED, code="SPEC028")
    parts = (
        content.items()
        if isinstance(content, Mapping)
        else enumerate(content)
        if isinstance(content, list | tuple)
        else ()
    )
    for key, part in parts:
        require_finite(spec, part, f"{quantity} ({key})" if isinstance(key, str) and "(" not in quantity else quantity)

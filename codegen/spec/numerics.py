"""Conversion of failures of numerical libraries on a user's numbers into BadInput."""

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
    """Decorator of a function whose first argument is the spec: numerical failures in it are raised as BadInput.

    Other errors, such as a TypeError, are faults of the tool and are not converted.

    Args:
        quantity: what the function computes, in the user's words.
        given: whether it computes with the numbers of the spec. A search uses numbers of its own; a division by zero in
            Python is then a fault of the tool too.
    """

    def guarded(station: Station[Rest, Result]) -> Station[Rest, Result]:
        @wraps(station)
        def work(spec: Spec, /, *rest: Rest.args, **named: Rest.kwargs) -> Result:
            try:
                return station(spec, *rest, **named)
            except (*_NUMERICAL, RuntimeError, ValueError) as error:
                if not is_numerical(error) or (isinstance(error, ArithmeticError) and not given):
                    raise
                said = "" if isinstance(error, ArithmeticError) else f" ({error})"  # Python's say nothing of the spec
                found = f"{quantity} cannot be computed{said}"
                raise BadInput(Place(str(spec.path)), found, EXPECTED, code="SPEC028") from error

        return work

    return guarded


def is_numerical(error: Exception) -> bool:
    """Whether an exception of a library is about the numbers; CasADi has no exception class of its own."""
    said = str(error).lower()
    casadi = isinstance(error, RuntimeError) and "casadi" in said
    scipy = isinstance(error, ValueError) and "infs or nans" in said
    return isinstance(error, _NUMERICAL) or casadi or scipy


def require_finite(spec: Spec, content: object, quantity: str) -> None:
    """Raise BadInput if a result, made of dicts and lists, contains a number that is not finite."""
    if isinstance(content, float) and not math.isfinite(content):
        raise BadInput(Place(str(spec.path)), f"{quantity} cannot be computed ({content})", EXPECTED, code="SPEC028")
    listed = enumerate(content) if isinstance(content, list | tuple) else ()
    for key, part in content.items() if isinstance(content, Mapping) else listed:
        require_finite(spec, part, f"{quantity} ({key})" if isinstance(key, str) and "(" not in quantity else quantity)

"""Which failures of a library are told as numbers out of range, and which are faults of the tool."""

from __future__ import annotations

import pytest
import sympy
from sympy.polys.polyerrors import PolynomialDivisionFailed, PolynomialError

from codegen.spec.numerics import numerical
from tests.expected_errors import refused
from tests.machines import one_mass


def no_polynomial():
    """A form that SymPy takes for no polynomial, whatever the numbers."""
    x = sympy.Symbol("x")
    sympy.Poly(x + sympy.sin(x), x)


def vanishing_remainder():
    """A division in which rounding hides that a leading coefficient is zero."""
    raise PolynomialDivisionFailed([1.0], [1.0], sympy.RR)


def test_a_fault_of_form_is_no_number_out_of_range():
    """It passes the border as it is, so that it is told as an internal error with a traceback."""
    with pytest.raises(PolynomialError):
        numerical("a polynomial")(lambda spec: no_polynomial())(one_mass()[0])


@pytest.mark.parametrize("fails", [vanishing_remainder, lambda: 1e308**2, lambda: sympy.zeros(2).inv()])
def test_numbers_out_of_range_are_told(fails):
    with refused("SPEC028"):
        numerical("a number")(lambda spec: fails())(one_mass()[0])


def test_a_search_that_divides_by_zero_is_a_fault_of_the_tool():
    """A fit of a candidate divided by the drive that it left; the spec was told to have a mass close to zero."""
    searched = numerical("a fit", given=False)
    with pytest.raises(ZeroDivisionError):
        searched(lambda spec: 1 / 0.0)(one_mass()[0])
    with refused("SPEC028"):
        searched(lambda spec: sympy.zeros(2).inv())(one_mass()[0])

"""Coordinates of bounded parameters: the two directions undo each other, and a fit may round a value to its bound."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from codegen.effects.coordinate import FREE, Above, Between, Coordinate


@given(st.floats(-25.0, 25.0))
def test_a_value_between_its_bounds_comes_back(inner: float) -> None:
    for coordinate in (Above(), Between(0.0, 1.0)):
        assert coordinate.inward(coordinate.outward(inner)) == pytest.approx(inner, rel=1e-4, abs=1e-9)


@pytest.mark.parametrize(
    ("coordinate", "inner"),
    [(Between(0.5, 4.0), 60.0), (Between(0.5, 4.0), -60.0), (Above(3.0), -80.0), (Above(0.0), -1e4)],
)
def test_a_value_that_is_rounded_to_its_bound_has_a_finite_coordinate(coordinate: Coordinate, inner: float) -> None:
    """Between 0.5 and 4, the coordinate 60 is 4 to the last digit: the distance to 4 is no number to divide by."""
    value = coordinate.outward(inner)
    again = coordinate.inward(value)
    assert math.isfinite(again)
    assert coordinate.outward(again) == pytest.approx(value, rel=1e-12, abs=1e-100)


def test_a_linear_step_is_taken_in_the_parameter_within_its_bounds() -> None:
    """dv/dq is v − low for a logarithm, and (v − low)(high − v)/(high − low) for a logit."""
    above, between = Above(1.0), Between(0.0, 4.0)
    assert above.outward(above.moved(above.inward(3.0), 2.3)) == pytest.approx(3.0 + 2.3 * 2.0)
    assert above.outward(above.moved(above.inward(3.0), -0.5)) == pytest.approx(3.0 - 0.5 * 2.0)
    assert between.outward(between.moved(between.inward(1.0), 1.5)) == pytest.approx(1.0 + 1.5 * 0.75)
    assert FREE.moved(-7.0, 12.0) == 5.0
    # beyond a bound the step is one of the coordinate
    assert above.moved(0.5, -1.2) == pytest.approx(-0.7)
    assert between.moved(between.inward(1.0), 5.0) == pytest.approx(between.inward(1.0) + 5.0)


@given(st.floats(-3.0, 3.0), st.floats(-1e-3, 1e-3))
def test_a_small_step_is_the_same_in_the_coordinate(inner: float, step: float) -> None:
    for coordinate in (Above(), Between(0.0, 1.0), FREE):
        assert coordinate.moved(inner, step) == pytest.approx(inner + step, abs=1e-6 + step**2)

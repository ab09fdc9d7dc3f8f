"""Coordinates of bounded parameters: the two directions undo each other, and a fit may round a value to its bound."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from codegen.effects.coordinate import Above, Between, Coordinate


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

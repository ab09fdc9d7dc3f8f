"""The table of units against another library's, pint, which took most of a second to load for each spec."""

from __future__ import annotations

from fractions import Fraction
from itertools import product

import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st

from codegen.base.errors import Place
from codegen.spec.si_units import UNITS, Dimension, si_unit
from codegen.spec.units import si_factor

FORMS = [
    *("{a}*{b}", "{a}/{b}", "{a}/({b}*{c})", "{a}^2*{b}", "{a}*{b}/{c}^-3", "1/{a}", "({a}*{b})/{c}", "{a}/{b}/{c}"),
    *("(({a}))", "{a}/({b}/({c}*{a}))"),
]


PINT: pint.UnitRegistry[Fraction] = pint.UnitRegistry(non_int_type=Fraction)
for alias in ("turn = rev", "revolutions_per_minute = RPM", "pound = lbm", "kilogram_force = kp"):
    PINT.define(f"@alias {alias}")
for alias in ("force_pound = lb_f", "force_ounce = oz_f"):
    PINT.define(f"@alias {alias}")
DIGITS = Fraction(1, 10**47)


def agrees(text: str) -> None:
    """The factor to the digits of pi that pint has, the dimension, and the power of the radian."""
    found = si_unit(text)
    assert found is not None, text
    quantity = PINT.Quantity(1, PINT.parse_units(text)).to_base_units()
    assert abs(found.factor / Fraction(quantity.magnitude) - 1) < DIGITS, text
    assert found.dimension == Dimension({k: Fraction(p) for k, p in quantity.dimensionality.items()}), text
    assert found.angle == dict(quantity.unit_items()).get("radian", 0), text


@pytest.mark.parametrize("name", sorted(UNITS))
def test_a_unit_is_pints(name: str) -> None:
    agrees(name)


@given(st.sampled_from(FORMS), *[st.sampled_from(sorted(UNITS)) for _ in range(3)])
def test_a_product_of_units_is_pints(form: str, a: str, b: str, c: str) -> None:
    agrees(form.format(a=a, b=b, c=c))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "m*",
        "*m",
        "(m",
        "m)",
        "m^",
        "m^21",
        "deg C2",
        "furlong",
        "m2",
        "m//s",
        "True",
        "-m",
        "((km^20)^20)^20",
        "pi",
    ],
)
def test_anything_else_is_no_unit(text: str) -> None:
    assert si_unit(text) is None


@pytest.mark.parametrize("text", ["N m", "kg m^2", "m^(1/2)", "newtons", "degrees/s", "rad/(N m)"])
def test_other_ways_to_write_a_product_or_a_power_are_pints_too(text: str) -> None:
    agrees(text)


def test_dimensions_multiply_as_exponents_add() -> None:
    length, time = Dimension({"[length]": 1}), Dimension({"[time]": 1})
    for a, b in product(range(-3, 4), repeat=2):
        powers = {"[length]": Fraction(a), "[time]": Fraction(-b, 2)}
        assert length**a / time ** Fraction(b, 2) == Dimension(powers)
    assert length / length == Dimension({}) and hash(length * time) == hash(time * length)


def test_a_millimetre_is_exact() -> None:
    assert si_factor("mm", Place("s.yaml")) * 1000 == 1

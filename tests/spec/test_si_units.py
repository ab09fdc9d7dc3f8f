"""The units that are known without pint, against pint's own reading of them."""

from __future__ import annotations

from fractions import Fraction
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from codegen.base.errors import Place
from codegen.spec.si_units import UNITS, Dimension, si_unit
from codegen.spec.units import registry, si_factor

FORMS = [
    *("{a}*{b}", "{a}/{b}", "{a}/({b}*{c})", "{a}^2*{b}", "{a}*{b}/{c}^-3", "1/{a}", "({a}*{b})/{c}", "{a}/{b}/{c}"),
    *("(({a}))", "{a}/({b}/({c}*{a}))"),
]


def by_pint(text: str) -> tuple[Fraction, Dimension]:
    quantity = registry().Quantity(1, registry().parse_units(text)).to_base_units()
    return Fraction(quantity.magnitude), Dimension({k: Fraction(p) for k, p in quantity.dimensionality.items()})


def agrees(text: str) -> None:
    found = si_unit(text)
    assert found is not None, text
    assert (found.factor, found.dimension) == by_pint(text), text


@pytest.mark.parametrize("name", UNITS)
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
        "m m",
        "(m",
        "m)",
        "m^",
        "m^12",
        "m^(1/2)",
        "deg",
        "furlong",
        "m2",
        "m//s",
        "True",
        "-m",
        "m**2.5",
    ],
)
def test_anything_else_is_left_to_pint(text: str) -> None:
    assert si_unit(text) is None


def test_dimensions_multiply_as_exponents_add() -> None:
    length, time = Dimension({"[length]": 1}), Dimension({"[time]": 1})
    for a, b in product(range(-3, 4), repeat=2):
        powers = {"[length]": Fraction(a), "[time]": Fraction(-b, 2)}
        assert length**a / time ** Fraction(b, 2) == Dimension(powers)
    assert length / length == Dimension({}) and hash(length * time) == hash(time * length)


def test_a_millimetre_is_exact() -> None:
    assert si_factor("mm", Place("s.yaml")) * 1000 == 1

"""The friction laws against (1) and (2.5) of the thesis, and the slope bound of Lemma 2.1 against the true slopes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy

from codegen.friction import LAWS
from codegen.spec.functions import Magnitude

U = sympy.Symbol("u", real=True)


def force(name: str, p: dict[str, float]) -> Any:
    law = LAWS[name]
    level = law.level(Magnitude(U), {k: sympy.Float(v) for k, v in p.items()})
    return lambda u: float(sympy.sign(u) * level.subs(U, u))


EXTENDED = {"a1": 3.0, "a2": 1.5, "a3": 4.0, "a4": 0.7}


def test_coulomb_is_its_level_against_the_slip() -> None:
    law = force("coulomb", {"a": 5.0})
    assert [law(u) for u in (-2.0, -1e-9, 1e-9, 3.0)] == [-5, -5, 5, 5]


@pytest.mark.parametrize("u", [-3.0, -0.2, 1e-9, 0.05, 1.0, 20.0])
def test_extended_coulomb_is_2_5(u: float) -> None:
    right = np.sign(u) * (3.0 + 1.5 * np.exp(-4.0 * abs(u)) + 0.7 * abs(u))
    assert force("extended_coulomb", EXTENDED)(u) == pytest.approx(right, rel=1e-12)


@pytest.mark.parametrize("seed", range(50))
def test_the_slope_bound_holds_and_is_reached(seed: int) -> None:
    """Lemma 2.1: |∂a/∂u| over a dense grid of slip speeds never exceeds the bound, and comes within 1 % of it."""
    p = dict(zip(("a1", "a2", "a3", "a4"), np.random.default_rng(seed).uniform(0.01, 5, 4), strict=True))
    speed = np.concatenate([np.geomspace(1e-6, 1e3, 4000)])
    slope = np.abs(p["a4"] - p["a2"] * p["a3"] * np.exp(-p["a3"] * speed))
    bound = float(LAWS["extended_coulomb"].slope_bound({k: sympy.Float(v) for k, v in p.items()}))
    assert slope.max() <= bound * (1 + 1e-12)
    assert slope.max() >= 0.99 * bound


def test_coulomb_has_no_slope() -> None:
    assert LAWS["coulomb"].slope_bound({"a": sympy.Integer(5)}) == 0


@pytest.mark.parametrize("name", LAWS)
def test_every_law_says_where_it_comes_from(name: str) -> None:
    assert LAWS[name].name == name
    assert LAWS[name].source and all(p.meaning for p in LAWS[name].parameters)

"""The level of every law against its closed form written anew, and the bound on its slope against the true slopes."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from codegen.friction import LAWS, LawParameter, ZeroMemoryLaw
from tests.friction.samples import bound, draw, level, slope
from tests.slow_cases import slow_except


def phi(s, p):
    """φ, the inverse of (6.33): found by interpolation, φ⁻¹ being monotone and piecewise linear."""
    f = np.array([0.0, 1.0, 1e6])
    return np.interp(s, np.array([0.0, p["D2"], p["D2"] + p["D1"] * (1e6 - 1)]), f)


def stribeck(shape):
    return lambda s, p: p["F_c"] * (1 - shape(s, p)) + p["F_s"] * shape(s, p) + p["F_v"] * s


def extended(s, p):
    return p["a1"] + p["a2"] * np.exp(-p["a3"] * s) + p["a4"] * s


def rock(s, p):
    return p["F_0"] + p["a"] * np.log(s / p["v_0"]) - p["b"] * np.log(s / p["v_0"])


CLOSED = {
    "coulomb": lambda s, p: p["a"] + 0 * s,
    "static_viscous": lambda s, p: p["F_c"] + p["F_v"] * s,
    "tustin": stribeck(lambda s, p: np.exp(-s / p["v_c"])),
    "bo_pavelescu": stribeck(lambda s, p: np.exp(-np.power(s / p["alpha"], p["n"]))),
    "gaussian": stribeck(lambda s, p: np.exp(-(s**2) / p["v_s"] ** 2)),
    "gaussian_offset": stribeck(lambda s, p: np.exp(-((s - p["v_0"]) ** 2) / p["v_s"] ** 2)),
    "lorentzian": stribeck(lambda s, p: p["v_s"] ** 2 / (p["v_s"] ** 2 + s**2)),
    "polynomial": lambda s, p: np.polyval([p["a3"], p["a2"], p["a1"], p["a0"]], s),
    "canudas": lambda s, p: p["alpha_0"] + p["alpha_1"] * s**0.5 + p["alpha_2"] * s,
    "extended_coulomb": extended,
    "dahl": lambda s, p: p["a"] + 0 * s,
    "reset_integrator": lambda s, p: p["a"] * phi(s, p),
    "lugre": lambda s, p: p["F_c"] + (p["F_s"] - p["F_c"]) * np.exp(-(s**2) / p["v_s"] ** 2) + p["sigma_2"] * s,
    "walrath": lambda s, p: p["T"] + 0 * s,
    "ruina": rock,
    "linker_dieterich": rock,
    "extended_dynamic": extended,
    "extended_reset_integrator": lambda s, p: extended(s, p) * phi(s, p),
    "rising_static_derjaguin": lambda s, p: p["F_c"] + 0 * s,
    "rising_static_kato": lambda s, p: p["F_c"] + 0 * s,
    "hess_soom_lag": stribeck(lambda s, p: p["v_s"] ** 2 / (p["v_s"] ** 2 + s**2)),
    "seven_parameter": lambda s, p: p["F_c"] + p["F_v"] * s + p["F_s_inf"] / (1 + (s / p["v_s"]) ** 2),
    "karnopp": lambda s, p: p["F_c"] + p["F_v"] * s,
    "bristle": lambda s, p: p["N"] * p["sigma_0"] * 2 * p["delta_s"] / 3 + 0 * s,
}
SPEEDS = np.unique(np.concatenate([np.geomspace(1e-6, 1e3, 40000), np.linspace(1e-4, 20, 40000)]))
NEVER_BOUNDED = ("canudas", "polynomial", "ruina", "linker_dieterich", "extended_reset_integrator")
BOUNDED = [name for name in LAWS if name not in NEVER_BOUNDED]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", LAWS)
def test_the_level_is_the_closed_form(name: str, seed: int) -> None:
    p = draw(name, seed)
    np.testing.assert_allclose(level(name, p)(SPEEDS), CLOSED[name](SPEEDS, p), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", slow_except(range(20), range(4)))
@pytest.mark.parametrize("name", BOUNDED)
def test_no_slope_exceeds_the_bound_and_one_comes_within_a_percent(name: str, seed: int) -> None:
    """Lemma 2.1 generalised: by SymPy's derivative, and by differences of the closed form."""
    p = draw(name, seed)
    slopes = np.abs(slope(name, p)(SPEEDS))
    assert slopes.max() <= bound(name, p) * (1 + 1e-9)
    assert slopes.max() >= 0.99 * bound(name, p)
    chords = np.abs(np.diff(CLOSED[name](SPEEDS, p)) / np.diff(SPEEDS))
    assert chords.max() <= bound(name, p) * (1 + 1e-6) + 1e-5


@pytest.mark.parametrize(
    ("name", "change", "speeds"),
    [
        ("canudas", {"alpha_1": -1.0}, np.geomspace(1e-3, 1e-12, 10)),
        ("bo_pavelescu", {"n": 0.6, "F_s": 3.0, "F_c": 1.0}, np.geomspace(1e-3, 1e-12, 10)),
        ("ruina", {"a": 1.0, "b": 2.0}, np.geomspace(1e-3, 1e-12, 10)),
        ("linker_dieterich", {"a": 1.0, "b": 2.0}, np.geomspace(1e-3, 1e-12, 10)),
        ("polynomial", {"a3": 1.0}, np.geomspace(10, 1e9, 10)),
        ("extended_reset_integrator", {"a4": 1.0}, np.geomspace(1e4, 1e12, 10)),
    ],
)
def test_where_there_is_no_bound_the_slope_grows_without_end(name: str, change, speeds) -> None:
    p = draw(name, 0) | change
    slopes = np.abs(slope(name, p)(speeds))
    assert bound(name, p) == np.inf
    assert slopes[-1] > 100 * slopes[0] and (np.diff(slopes) > 0).all()


@pytest.mark.parametrize(
    ("name", "change", "expected"),
    [
        ("canudas", {"alpha_1": 0.0, "alpha_2": 0.7}, 0.7),
        ("polynomial", {"a1": -2.5, "a2": 0.0, "a3": 0.0}, 2.5),
        ("bo_pavelescu", {"n": 0.6, "F_s": 2.0, "F_c": 2.0, "F_v": 0.3}, 0.3),
        ("bo_pavelescu", {"n": 1.0, "F_s": 3.0, "F_c": 2.0, "F_v": 0.0, "alpha": 0.5}, 2.0),
        ("ruina", {"a": 0.5, "b": 0.5}, 0.0),
    ],
)
def test_the_bound_of_special_cases(name: str, change, expected: float) -> None:
    assert bound(name, draw(name, 0) | change) == pytest.approx(expected)


def test_the_crest_of_the_gaussian_with_offset_near_standstill() -> None:
    """With v_0 < v_s/√2 the curve rises steepest at standstill, with F_s < F_c that slope counts."""
    p = {"F_c": 3.0, "F_s": 1.0, "v_s": 1.0, "v_0": 0.3, "F_v": 0.0}
    steepest = np.abs(np.diff(CLOSED["gaussian_offset"](SPEEDS, p)) / np.diff(SPEEDS)).max()
    assert bound("gaussian_offset", p) == pytest.approx(steepest, rel=1e-3)


def test_static_viscous_holds_its_static_level_at_standstill_only() -> None:
    at = level("static_viscous", {"F_c": 2.0, "F_s": 3.0, "F_v": 0.5})
    assert at(np.array([0.0, 1e-12, 2.0])) == pytest.approx([3.0, 2.0, 3.0])


def test_bounds_are_exact_in_exact_parameters() -> None:
    """A certificate needs a bound over rationals, not over doubles."""
    p = {"F_c": sympy.Integer(1), "F_s": sympy.Integer(2), "v_s": sympy.Rational(1, 10), "F_v": sympy.Integer(0)}
    assert LAWS["lorentzian"].slope_bound(p) == 30 * sympy.sqrt(3) / 8


@pytest.mark.parametrize(("rise", "expected"), [(0, 0), (2, sympy.oo)])
def test_a_law_without_a_bound_of_its_own_has_none_if_its_level_depends_on_the_speed(rise: int, expected) -> None:
    """A law of a user's own effect: the default raised an error, with a traceback."""

    class Rising(ZeroMemoryLaw):
        name, source, parameters = "rising", "a test", (LawParameter("s", "{F}", True, ""),)

        def level(self, slip_speed, p):
            return p["s"] + rise * slip_speed

    assert Rising().slope_bound({"s": sympy.Symbol("s", positive=True)}) == expected

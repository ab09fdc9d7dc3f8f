"""The laws that need a history: rising static friction, time lag, the seven parameters, Karnopp's band, bristles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from codegen.friction import LAWS, MemoryLaw
from tests.expected_errors import refused
from tests.friction.samples import draw, level

MEMORY = {name: law for name, law in LAWS.items() if isinstance(law, MemoryLaw)}


def response(name: str, time: Any, u: Any, p: dict[str, float], applied: Any = None) -> Any:
    return MEMORY[name].response(time, u, p, applied)


@pytest.mark.parametrize("u", [-0.8, 0.8])
@pytest.mark.parametrize("name", [n for n in MEMORY if n != "bristle"])
def test_steady_sliding_ends_at_the_level(name: str, u: float) -> None:
    p, time = draw(name, 1), np.linspace(0, 5, 4000)
    force = response(name, time, np.full_like(time, u), p)
    assert force[-1] == pytest.approx(np.sign(u) * float(level(name, p)(np.array([0.8]))[0]), rel=1e-9)


@pytest.mark.parametrize("applied", [-9.0, -2.0, 0.0, 1.5, 9.0])
def test_static_friction_rises_after_derjaguin_and_after_kato(applied: float) -> None:
    """Slip, rest of 2 s, slip, rest: at rest the force balances what is applied, up to F_s of that rest's age."""
    time = np.linspace(0, 6, 6001)
    u = np.where((time < 1) | ((time >= 3) & (time < 4)), 0.3, 0.0)
    age = np.where(time < 3, time - 1, time - 4)
    p = {"F_c": 2.0, "F_s_inf": 3.0, "gamma": 0.4, "n": 0.6}
    for name, rise in (
        ("rising_static_derjaguin", lambda t: t / (t + 0.4)),
        ("rising_static_kato", lambda t: 1 - np.exp(-0.4 * t**0.6)),
    ):
        limit = 2.0 + rise(np.maximum(age, 0))
        expected = np.where(u > 0, 2.0, np.sign(applied) * np.minimum(abs(applied), limit))
        np.testing.assert_allclose(response(name, time, u, p, np.full_like(time, applied)), expected, atol=1e-9)


def test_a_rest_without_applied_force_is_refused() -> None:
    for name in ("rising_static_derjaguin", "rising_static_kato", "karnopp"):
        with refused("SPEC020"):
            response(name, [0.0, 1.0], [0.1, 0.0], draw(name, 1))


def test_hess_soom_friction_lags() -> None:
    p = {"F_c": 2.0, "F_s": 3.0, "v_s": 0.1, "tau_L": 0.05, "F_v": 0.5}
    time = np.linspace(0, 2, 2001)
    u = 0.2 + 0.5 * time**2
    before = 0.2 + 0.5 * np.maximum(time - 0.05, 0) ** 2
    expected = 2 + 0.5 * u + 1 / (1 + (before / 0.1) ** 2)
    np.testing.assert_allclose(response("hess_soom_lag", time, u, p), expected, rtol=1e-6)
    np.testing.assert_allclose(response("hess_soom_lag", time, -u, p), -expected, rtol=1e-6)
    assert (expected > 2 + 0.5 * u + 1 / (1 + (u / 0.1) ** 2))[1:].all()


def test_without_lag_hess_soom_is_the_lorentzian() -> None:
    p = {"F_c": 2.0, "F_s": 3.0, "v_s": 0.1, "tau_L": 0.0, "F_v": 0.5}
    u = np.linspace(-1, 1, 400)
    expected = np.sign(u) * level("lorentzian", p)(np.abs(u))
    np.testing.assert_allclose(response("hess_soom_lag", np.linspace(0, 1, 400), u, p), expected, rtol=1e-12)


SEVEN = {"k_t": 1e4, "F_c": 40.0, "F_v": 100.0, "F_s_inf": 20.0, "v_s": 0.02, "tau_L": 0.005, "gamma": 0.5}


def test_the_seven_parameter_law_is_a_spring_until_it_breaks_away() -> None:
    time = np.linspace(0, 1, 10001)
    u = np.full_like(time, 0.02)
    force = response("seven_parameter", time, u, SEVEN)
    stuck = time * 0.02 < 0.999 * 60 / 1e4
    np.testing.assert_allclose(force[stuck], 1e4 * 0.02 * time[stuck], rtol=1e-9)
    assert force[-1] == pytest.approx(40 + 100 * 0.02 + 20 / 2)


@pytest.mark.parametrize("dwell", [0.05, 0.5, 5.0])
def test_the_seven_parameter_laws_breakaway_rises_with_the_time_stuck(dwell: float) -> None:
    """Fast sliding stops at once, so that by the lag little Stribeck friction is left; then creep breaks away."""
    time = np.arange(0, 2 + dwell + 4, 1e-3)
    u = np.where(time < 2, 0.4, np.where(time < 2 + dwell, 0.0, 0.001))
    force = response("seven_parameter", time, u, SEVEN)
    left = 20 / (1 + (0.4 / 0.02) ** 2)
    after = time >= 2 + dwell
    slipped = int(np.argmax(after & (np.diff(force, prepend=force[0]) < 0.4 * SEVEN["k_t"] * 0.001 * 1e-3)))
    stuck_for = time[slipped] - 2.0
    expected = 40 + left + (20 - left) * stuck_for / (stuck_for + 0.5)
    assert force[after].max() == pytest.approx(expected, abs=0.2)
    assert abs(force).max() <= 60 + 100 * 0.4 + 1e-9


def test_karnopp_holds_a_mass_under_less_than_its_static_level() -> None:
    """1 kg under a force that grows: friction balances it to the last bit until F_s, then the mass slides."""
    p = {"F_c": 4.0, "F_s": 6.0, "D_v": 1e-3, "F_v": 0.5}
    v, step, moved_at = 0.0, 1e-3, None
    for k in range(10000):
        pull = 1e-3 * k
        (friction,) = response("karnopp", [k * step], [v], p, [pull])
        if pull <= 6.0:
            assert friction == pull and v == 0.0
        v += step * (pull - friction)
        if moved_at is None and v > p["D_v"]:
            moved_at = pull
    assert moved_at is not None and 6.0 < moved_at < 6.2
    assert response("karnopp", [0.0], [v], p)[0] == pytest.approx(4.0 + 0.5 * v)


def test_karnopp_saturates_within_the_band_and_slides_outside_it() -> None:
    p = {"F_c": 4.0, "F_s": 6.0, "D_v": 0.01, "F_v": 0.5}
    force = response("karnopp", range(6), [0.005, -0.005, 0.01, 0.011, -2.0, 0.0], p, [9.0, -9.0, 3.0, 9.0, 9.0, 0.0])
    assert force == pytest.approx([6.0, -6.0, 3.0, 4.0055, -5.0, 0.0])


BRISTLES = {"N": 400.0, "sigma_0": 50.0, "delta_s": 0.002}


def test_bristles_are_springs_before_any_snaps_and_slide_at_their_mean() -> None:
    time = np.linspace(0, 1, 20001)
    force = response("bristle", time, np.full_like(time, 0.2), BRISTLES)
    one = 0.002 / 400
    first = time * 0.2 < one
    np.testing.assert_allclose(force[first], 400 * 50 * 0.2 * time[first], atol=1e-9)
    sliding = force[time * 0.2 > 20 * 0.002]
    assert sliding.mean() == pytest.approx(2 / 3 * 400 * 50 * 0.002, rel=0.02)
    assert sliding.std() == pytest.approx(np.sqrt(400) * 50 * 0.002 / np.sqrt(18), rel=0.25)
    np.testing.assert_array_equal(force, response("bristle", time, np.full_like(time, 0.2), BRISTLES))


def test_half_a_bristle_is_refused() -> None:
    with refused("SPEC007 bristle: 2.5"):
        response("bristle", [0.0], [0.0], BRISTLES | {"N": 2.5})


@pytest.mark.parametrize("name", ["seven_parameter", "bristle", "hess_soom_lag"])
def test_the_loop_is_dissipative_and_has_a_width(name: str) -> None:
    """Over a cycle of a sinusoidal slip the friction takes energy, and it is not a function of the velocity."""
    p = SEVEN if name == "seven_parameter" else draw(name, 2) | {"v_s": 0.03, "tau_L": 0.01}
    time = np.linspace(0, 3, 30001)
    u = 0.1 * np.sin(2 * np.pi * time)
    force = response(name, time, u, p)
    last = time > 2
    assert np.trapezoid(force[last] * u[last], time[last]) > 0
    up, down = (time > 2.0) & (time < 2.25), (time > 2.25) & (time < 2.5)
    speeds = np.linspace(0.005, 0.09, 30)
    gap = np.interp(speeds, u[up], force[up]) - np.interp(speeds, u[down][::-1], force[down][::-1])
    assert np.abs(gap).max() > 0.01 * np.abs(force).max()

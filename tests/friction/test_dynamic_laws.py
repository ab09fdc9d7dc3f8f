"""The laws in state-space form: rates written anew, closed forms of their motions, steady sliding, invariant ranges."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from codegen.friction import LAWS, DynamicLaw
from tests.friction.samples import DYNAMIC, draw, dynamics, level, numbers, state_range
from tests.slow_cases import slow_except


def phi_inverse(f, p):
    """(6.33) as it is printed."""
    if f > 1:
        return p["D1"] * (f - 1) + p["D2"]
    return p["D1"] * (f + 1) - p["D2"] if f < -1 else p["D2"] * f


def dahl(u, f, p):
    gap = 1 - f * np.sign(u)
    return p["c"] * u * abs(gap) ** p["i"] * np.sign(gap)


def g(u, p):
    return (p["F_c"] + (p["F_s"] - p["F_c"]) * np.exp(-((u / p["v_s"]) ** 2))) / p["sigma_0"]


RATES: dict[str, Callable[[float, float, dict[str, float]], float]] = {
    "dahl": dahl,
    "reset_integrator": lambda u, f, p: p["c"] * (u - phi_inverse(f, p)),
    "lugre": lambda u, z, p: u - abs(u) * z / g(u, p),
    "walrath": lambda u, f, p: (-p["T"] * f + p["T"] * np.sign(u)) / (p["tau"] * p["T"]),
    "ruina": lambda u, f, p: -abs(u) / p["L"] * (f + p["b"] * np.log(abs(u) / p["v_0"])),
    "linker_dieterich": lambda u, theta, p: 1 - abs(u) * theta / p["L"],
    "extended_dynamic": dahl,
    "extended_reset_integrator": lambda u, f, p: p["c"] * (u - phi_inverse(f, p)),
}


def extended(u, p):
    return p["a1"] + p["a2"] * np.exp(-p["a3"] * abs(u)) + p["a4"] * abs(u)


FORCES: dict[str, Callable[[float, float, dict[str, float]], float]] = {
    "dahl": lambda u, f, p: p["a"] * f,
    "reset_integrator": lambda u, f, p: p["a"] * f,
    "lugre": lambda u, z, p: p["sigma_0"] * z + p["sigma_1"] * RATES["lugre"](u, z, p) + p["sigma_2"] * u,
    "walrath": lambda u, f, p: p["T"] * f,
    "ruina": lambda u, f, p: np.sign(u) * (p["F_0"] + p["a"] * np.log(abs(u) / p["v_0"]) + f),
    "linker_dieterich": lambda u, theta, p: (
        np.sign(u) * (p["F_0"] + p["a"] * np.log(abs(u) / p["v_0"]) + p["b"] * np.log(theta * p["v_0"] / p["L"]))
    ),
    "extended_dynamic": lambda u, f, p: extended(u, p) * f,
    "extended_reset_integrator": lambda u, f, p: extended(u, p) * f,
}


def integrate(name: str, p: dict[str, float], u: Callable[[float], float], times: Any, start: float) -> Any:
    rate, _ = dynamics(name, p)
    done = solve_ivp(
        lambda t, z: [rate(u(t), z[0])], (times[0], times[-1]), [start], "LSODA", times, rtol=1e-10, atol=1e-12
    )
    assert done.success
    return done.y[0]


def rest(name: str, p: dict[str, float]) -> float:
    law = LAWS[name]
    assert isinstance(law, DynamicLaw)
    return float(law.rest_state(numbers(p))[0])


@pytest.mark.parametrize("name", DYNAMIC)
def test_rates_and_forces_are_those_of_the_source(name: str) -> None:
    random = np.random.default_rng(1)
    for seed in range(50):
        p = draw(name, seed)
        rate, force = dynamics(name, p)
        u = random.uniform(-2, 2)
        z = random.uniform(0.1, 2) if name == "linker_dieterich" else random.uniform(-1.2, 1.2)
        assert rate(u, z) == pytest.approx(RATES[name](u, z, p), rel=1e-10, abs=1e-12)
        assert force(u, z) == pytest.approx(FORCES[name](u, z, p), rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("u", [-1.5, -0.05, 0.05, 1.5])
@pytest.mark.parametrize("name", DYNAMIC)
def test_the_level_is_where_long_sliding_ends(name: str, u: float) -> None:
    p = draw(name, 3) | ({"i": 1.0} if "i" in draw(name, 3) else {})
    _, force = dynamics(name, p)
    end = integrate(name, p, lambda t: u, [0.0, 600.0 / abs(u)], rest(name, p))[-1]
    assert force(u, end) == pytest.approx(np.sign(u) * float(level(name, p)(np.array([abs(u)]))[0]), rel=1e-6)


@pytest.mark.parametrize("seed", slow_except(range(4), [0]))
@pytest.mark.parametrize("name", DYNAMIC)
def test_no_history_of_slip_leads_out_of_the_range(name: str, seed: int) -> None:
    random = np.random.default_rng([seed, 5])
    p, top = draw(name, seed), 2.0
    low, high = state_range(name, p, top)
    assert low <= rest(name, p) <= high
    knots = np.linspace(0, 5, 60)
    slips = top * random.choice([-1, 1, 0.3, -0.01, 0.6], 60)
    starts = [low, low + random.random() * (min(high, 50.0) - low)] + ([high] if np.isfinite(high) else [])
    for start in starts:
        z = integrate(name, p, lambda t: np.interp(t, knots, slips) or 1e-9, np.linspace(0, 5, 3000), start)
        assert z.min() >= low - 1e-6 * max(1, abs(low))
        assert z.max() <= high + 1e-6 * max(1, abs(high))


@pytest.mark.parametrize("name", ["dahl", "reset_integrator", "lugre", "walrath"])
def test_the_range_is_no_wider_than_it_must_be(name: str) -> None:
    p = draw(name, 1) | ({"F_s": 3.0, "F_c": 3.0} if name == "lugre" else {"i": 1.0} if name == "dahl" else {})
    low, high = state_range(name, p, 2.0)
    assert integrate(name, p, lambda t: 2.0, [0.0, 50.0], 0.0)[-1] == pytest.approx(high, rel=1e-3)
    assert integrate(name, p, lambda t: -2.0, [0.0, 50.0], 0.0)[-1] == pytest.approx(low, rel=1e-3)


@pytest.mark.parametrize("i", [0.5, 1.0, 1.5, 2.0])
@pytest.mark.parametrize("start", [-0.9, 0.0])
def test_dahl_follows_its_closed_presliding_curve(i: float, start: float) -> None:
    """(1 − f)^(1−i) = (1 − f0)^(1−i) + (i − 1) c x, an exponential for i = 1, whatever the speed on the way."""
    p = {"a": 50.0, "c": 500.0, "i": i}
    times = np.linspace(0, 1, 50)
    amplitude = 0.002
    f = integrate("dahl", p, lambda t: amplitude * np.pi / 2 * np.sin(np.pi * t), times, start)
    x = amplitude * (1 - np.cos(np.pi * times)) / 2
    if i == 1:
        gap = (1 - start) * np.exp(-p["c"] * x)
    else:
        gap = ((1 - start) ** (1 - i) + (i - 1) * p["c"] * x) ** (1 / (1 - i))
    np.testing.assert_allclose(f, 1 - gap, atol=1e-7)


def test_the_width_of_the_reset_integrators_hysteresis_is_two_over_c() -> None:
    p = {"a": 50.0, "c": 100.0, "D1": 1000.0, "D2": 1e-4}
    omega, amplitude = 2 * np.pi, 0.05
    times = np.linspace(0, 2, 20001)
    f = integrate("reset_integrator", p, lambda t: amplitude * omega * np.cos(omega * t), times, 0.0)
    x = amplitude * np.sin(omega * times)
    back = (times > 1.25) & (times < 1.75)
    span = x[back][np.argmax(f[back] < 1 - 1e-3)] - x[back][np.argmax(f[back] < -1 + 1e-3)]
    assert span == pytest.approx(2 / p["c"], rel=0.01)


def test_the_reset_integrator_is_a_spring_within_its_level() -> None:
    p = {"a": 50.0, "c": 100.0, "D1": 1000.0, "D2": 1e-9}
    times = np.linspace(0, 1, 200)
    f = integrate("reset_integrator", p, lambda t: 0.005 * 2 * np.pi * np.cos(2 * np.pi * t), times, 0.0)
    np.testing.assert_allclose(f, p["c"] * 0.005 * np.sin(2 * np.pi * times), atol=1e-5)


LUGRE = {"sigma_0": 1e5, "sigma_1": 316.0, "sigma_2": 0.4, "F_c": 1.0, "F_s": 1.5, "v_s": 0.001}


def breakaway(ramp: float) -> float:
    """Peak friction on 1 kg under a force that grows at ``ramp`` N/s, up to where it slides."""
    rate, force = dynamics("lugre", LUGRE)

    def motion(t, y):
        return [(ramp * t - force(y[0], y[1])) / 1.0, rate(y[0], y[1])]

    times = np.linspace(0, 2.2 / ramp, 4000)
    v, z = solve_ivp(motion, (0, times[-1]), [0.0, 0.0], "Radau", times, rtol=1e-8, atol=1e-12).y
    sliding = int(np.argmax(v > 2 * LUGRE["v_s"]))
    assert sliding > 0
    return float(max(force(a, b) for a, b in zip(v[:sliding], z[:sliding], strict=True)))


def test_lugre_breaks_away_near_its_static_level_and_earlier_under_a_fast_ramp() -> None:
    """As in figure 3 of the source: the break-away force falls with the rate of the applied force."""
    peaks = [breakaway(ramp) for ramp in (0.5, 5.0, 50.0)]
    assert 0.95 * LUGRE["F_s"] < peaks[0] <= LUGRE["F_s"] * 1.001
    assert peaks[0] > 1.03 * peaks[1] > 1.06 * peaks[2]


def test_walrath_reverses_along_an_exponential() -> None:
    p = {"T": 3.0, "tau": 0.1}
    times = np.linspace(0, 0.5, 20)
    f = integrate("walrath", p, lambda t: -0.3, times, 1.0)
    np.testing.assert_allclose(f, -1 + 2 * np.exp(-times / 0.1), atol=1e-8)


def test_ruina_and_linker_dieterich_step_by_the_direct_effect_and_decay_over_the_characteristic_slip() -> None:
    p = {"F_0": 60.0, "a": 0.6, "b": 0.9, "L": 1e-5, "v_0": 1e-6}
    slip = np.linspace(0, 5e-5, 30)
    for name, start in (("ruina", 0.0), ("linker_dieterich", p["L"] / p["v_0"])):
        _, force = dynamics(name, p)
        assert force(1e-6, start) == pytest.approx(60.0) and force(1e-5, start) == pytest.approx(60 + 0.6 * np.log(10))
        z = integrate(name, p, lambda t: 1e-5, slip / 1e-5, start)
        left = np.exp(-slip / p["L"])
        state = -np.log(10) * (1 - left) if name == "ruina" else np.log(0.1 + 0.9 * left)
        np.testing.assert_allclose(
            [force(1e-5, s) for s in z], 60 + 0.6 * np.log(10) + 0.9 * state, rtol=1e-7, err_msg=name
        )


def test_age_grows_with_the_time_at_rest() -> None:
    rate, _ = dynamics("linker_dieterich", draw("linker_dieterich", 1))
    assert rate(0.0, 3.0) == 1.0


def test_a_history_of_dahl_s_force_is_its_exponential() -> None:
    """f' = c u (1 − f) at a constant u > 0 from rest, so F = a (1 − exp(−c u t)); zero memory: the level."""
    time, speed = np.linspace(0, 0.1, 50), np.full(50, 0.2)
    values = {"a": 50.0, "c": 100.0, "i": 1}
    np.testing.assert_allclose(LAWS["dahl"].response(time, speed, values), 50 * -np.expm1(-100 * 0.2 * time), atol=1e-5)
    at_level = LAWS["static_viscous"].response(time, -speed, {"F_c": 40.0, "F_s": 60.0, "F_v": 100.0})
    np.testing.assert_allclose(at_level, -(40 + 100 * 0.2))

"""The force balance on a motion in closed form: sensor errors, bristles and loads behind springs are in it."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from codegen.diagnosis.fit.residual import unfiltered_residual
from codegen.diagnosis.fit.signals import Motion
from tests.diagnosis.stage import stage, system_of

H = 1e-3


T = np.arange(0, 6, H)
RATE = 2 * np.pi * 0.7


def _x(t: np.ndarray | float) -> np.ndarray:
    return np.asarray(0.2 * np.sin(RATE * t))


def _v(t: np.ndarray | float) -> np.ndarray:
    return np.asarray(0.2 * RATE * np.cos(RATE * t))


def _motion(positions: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray, w: np.ndarray) -> Motion:
    columns = [np.ascontiguousarray(c[:, None]) for c in (positions, velocities, accelerations, w)]
    return Motion(T, *columns, columns[3], H, 20.0, 50.0, np.ones(len(T), dtype=bool), columns[0])


def _residual(effects: str, motion: Motion) -> np.ndarray:
    return unfiltered_residual(system_of(stage(effects)), motion)[100:-100, 0]


def test_the_residual_of_a_declared_sensor_error_is_that_of_the_true_motion() -> None:
    x, v, a = _x(T), _v(T), -(RATE**2) * _x(T)
    wave = 2 * np.pi / 0.05
    slope, bend = 8e-4 * wave * np.cos(wave * x + 0.4), -8e-4 * wave**2 * np.sin(wave * x + 0.4)
    w = 2 * a + 6 * v + 4 * np.sign(v)
    true = _motion(x, v, a, w)
    read = _motion(x + 8e-4 * np.sin(wave * x + 0.4), v * (1 + slope), a * (1 + slope) + bend * v**2, w)
    moving = np.abs(v[100:-100]) > 0.05
    np.testing.assert_allclose(_residual("[]", true)[moving], 0.0, atol=1e-9)
    # The error of the sensor makes a force of several newtons on this motion; taken out, the residual is zero again.
    assert np.abs(_residual("[]", read)).max() > 5
    declared = "[{kind: encoder_eccentricity, on: x, parameters: {amplitude: 8e-4, period: 0.05, phase: 0.4}}]"
    np.testing.assert_allclose(_residual(declared, read)[moving], 0.0, atol=2e-2)


def test_a_bristle_follows_the_motion_through_its_reversals() -> None:
    def rate(t: float, z: np.ndarray) -> np.ndarray:
        return np.asarray(_v(t) - 400.0 / 4.0 * z * abs(float(_v(t))))

    z = solve_ivp(rate, (0, T[-1]), [0.0], t_eval=T, rtol=1e-9, atol=1e-12, max_step=0.01).y[0]
    a = -(RATE**2) * _x(T)
    motion = _motion(_x(T), _v(T), a, 2 * a + 6 * _v(T) + 400.0 * z)
    assert np.abs(_residual("[]", motion)).max() > 3
    found = _residual("[{kind: presliding, on: rail, parameters: {sigma: 400}}]", motion)
    np.testing.assert_allclose(found, 0.0, atol=2e-2)


def test_a_load_behind_a_spring_with_play_follows_its_motor() -> None:
    k, c, share, gap = 900.0, 3.0, 0.4, 0.01

    def pull(t: float | np.ndarray, x_load: np.ndarray, v_load: np.ndarray) -> np.ndarray:
        dx, dv = _x(t) - x_load, _v(t) - v_load
        up = np.maximum(k * (dx - gap / 2) + c * dv, 0) * (dx > gap / 2)
        return np.asarray(up + np.minimum(k * (dx + gap / 2) + c * dv, 0) * (dx < -gap / 2))

    def rate(t: float, y: np.ndarray) -> list[float]:
        return [float(y[1]), float(pull(t, y[0], y[1])) / (share * 2)]

    load = solve_ivp(rate, (0, T[-1]), [0.0, float(_v(0.0))], t_eval=T, rtol=1e-9, atol=1e-12, max_step=5e-4).y
    a = -(RATE**2) * _x(T)
    w = (1 - share) * 2 * a + 6 * _v(T) + 4 * np.sign(_v(T)) + pull(T, load[0], load[1])
    motion = _motion(_x(T), _v(T), a, w)
    entry = f"[{{kind: backlash, on: x, parameters: {{k: {k}, c: {c}, load_fraction: {share}, gap: {gap}}}}}]"
    moving = np.abs(_v(T)[100:-100]) > 0.05
    lacking, found = _residual("[]", motion)[moving], _residual(entry, motion)[moving]
    # At an impact the force jumps by several newtons between two samples.
    assert np.sqrt(np.mean(found**2)) < 0.02 * np.sqrt(np.mean(lacking**2))

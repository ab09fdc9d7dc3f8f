"""One step and a whole run against the observer's equations, written here anew from the thesis with NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from .build import Built, motion
from .specs import spec_text

H = 0.001


def two_mass_gcfo(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """GCFO (4.10)-(4.15) with the velocity observer (4.25)-(4.26) on the two masses of section 4.7."""
    M, U = np.diag([10.0, 50.0]), np.array([[1.0, 0.0], [-1.0, 1.0]])
    K_F, K_v = np.diag([500.0, 700.0]), np.diag([10.0, 10.0])
    z_v, z_F = -K_v @ rows[0, :2], np.array([10.0, 20.0])
    outputs, states = [], []
    for x1, x2, w in rows:
        x = np.array([x1, x2])
        v = z_v + K_v @ x
        u = U.T @ v
        S = np.diag(np.sign(u))
        a = z_F - K_F @ np.abs(u)
        F = S @ a
        g = np.array([-(50 + 20) * x1 + 20 * x2, 20 * x1 - (100 + 20) * x2 + w])
        acceleration = np.linalg.inv(M) @ (g - U @ F)
        outputs.append([*v, *a, *F, *(U @ F)])
        z_v, z_F = z_v + H * (-K_v @ v + acceleration), z_F + H * (K_F @ S @ U.T @ acceleration)
        states.append([*z_v, *z_F])
    return np.array(outputs), np.array(states)


def one_mass_to(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """TO (3.11)-(3.12) with (3.6)-(3.7), K_1 = 7, K_2 = -10, K_v = 110."""
    z_v, z = -110 * rows[0, 0], -7 * rows[0, 0]
    outputs, states = [], []
    for x, w in rows:
        v = z_v + 110 * x
        F = z + 7 * x - 10 * v
        outputs.append([v, F, F])
        z_v, z = z_v + H * (-110 * v + (w - F)), z + H * (-7 * v + 10 * (w - F))
        states.append([z_v, z])
    return np.array(outputs), np.array(states)


def emps_cfo_measured(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """CFO (3.8)-(3.10) with measured velocity."""
    z = 20.3935 + 4000 * abs(rows[0, 1])
    outputs, states = [], []
    for _, v, u in rows:
        a = z - 4000 * abs(v)
        outputs.append([a, a * np.sign(v), a * np.sign(v)])
        z += H * 4000 * np.sign(v) * (35.1507 * u - 203.5034 * v + 3.1648 - a * np.sign(v)) / 95.1089
        states.append([z])
    return np.array(outputs), np.array(states)


CASES = {
    "two_mass GCFO": (spec_text("two_mass"), two_mass_gcfo),
    "one_mass TO": (spec_text("one_mass", "to"), one_mass_to),
    "emps CFO": (spec_text("emps", "cfo", "measured"), emps_cfo_measured),
}


@pytest.mark.parametrize("case", CASES)
def test_code_is_the_thesis(tmp_path, case):
    text, observer = CASES[case]
    built = Built(tmp_path, text)
    rows = motion(built.program, 60)
    expected, states = observer(rows)
    for outputs, after in (built.c_run(rows), built.python_run(rows)):
        assert outputs == pytest.approx(expected, rel=1e-11, abs=1e-13)
        assert after == pytest.approx(states, rel=1e-11, abs=1e-13)


@pytest.mark.parametrize(
    ("delay", "whole", "share"), [(0.0025, 2, 0.5), (0.0007, 0, 0.7), (0.003, 3, 0.0), (0.00125, 1, 0.25)]
)
def test_delayed_input_is_the_mean_of_what_was_held(tmp_path, delay, whole, share):
    """w(t - T) over a sample takes two held values; its mean enters the step."""
    effect = f"effects: [{{kind: input_delay, on: w, parameters: {{T: {delay}}}}}]"
    delayed = Built(tmp_path, spec_text("one_mass", "to").replace("effects: []", effect))
    rows = motion(delayed.program, 100)
    fine, steps = 1e-5, 100
    held = np.concatenate([np.full(10 * steps, rows[0, 1]), np.repeat(rows[:, 1], steps)])
    shift = round(delay / fine)
    mean = [held[10 * steps + k * steps - shift :][:steps].mean() for k in range(len(rows))]
    expected = one_mass_to(np.column_stack([rows[:, 0], mean]))[0]
    assert delayed.c_run(rows)[0] == pytest.approx(expected, rel=1e-9, abs=1e-12)
    past = [f.name for f in delayed.program.states if f.name.startswith("w_past")]
    assert past == [f"w_past_{k + 1}" for k in range(whole + (share > 0))]


def test_the_first_step_of_an_arm(tmp_path):
    """M(q) a = g - F is solved, at one point, with a full mass matrix."""
    built = Built(tmp_path, spec_text("arm", "gcfo", "measured"))
    names = [f.name for f in built.program.inputs]
    at = {"q1": 0.3, "q2": -0.8, "p1": 0.7, "p2": -0.4, "u1": 1.1, "u2": -0.6}
    row = np.array([[at[name] for name in names]])
    A, B, C, G, vs, H_ = 0.35, 0.12, 0.09, 2.3, 0.1, 0.6
    c2, s2, p1, p2 = np.cos(at["q2"]), np.sin(at["q2"]), at["p1"], at["p2"]
    M = np.array([[A + 2 * C * c2, B + C * c2], [B + C * c2, B]])
    g = np.array(
        [
            at["u1"] + C * s2 * (2 * p1 * p2 + p2**2) - G * np.cos(at["q1"]) - H_ / 3 * np.tanh(p1 / vs),
            at["u2"] - C * s2 * p1**2 - G / 4 * np.cos(at["q1"] + at["q2"]),
        ]
    )
    level, speed, sign = np.array([0.9, 0.3]), np.abs([p1, p2]), np.sign([p1, p2])
    gain = np.array([[3, 0.2], [0.1, 2]])
    acceleration = np.linalg.solve(M, g - level * sign)
    expected = level + gain @ speed + H * gain @ (sign * acceleration)
    assert built.c_run(row)[1][0] == pytest.approx(expected, rel=1e-12)

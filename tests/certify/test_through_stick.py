"""What a GCFO's certificate between reversals does not say, by its compiled C beside constant friction without noise.

Levels are forgotten at rest, and one contact that sticks keeps the error of another from falling.
"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import sympy

from codegen.app.certify import Certified
from codegen.app.derived import Derived
from codegen.certify.outcome import Certificate
from codegen.certify.sticking import slowest_while_sticking
from codegen.replay.engine import Engine
from codegen.simulate.closed_loop import simulate
from codegen.spec import parse_spec
from tests.checker.test_kernel import spec_path


def at_rest(name: str, inputs: dict[str, float], samples: int, h: float | None = None) -> dict[str, Any]:
    """The outputs of a shipped spec's C beside a machine that does not move, after one sample of a small jolt."""
    text = spec_path(name).read_text("utf-8")
    text = text if h is None else text.replace("sample_time: 0.001", f"sample_time: {h}")
    machine = Derived(parse_spec(text, Path(f"{name}.yaml")))
    program = machine.program
    rows = np.tile([inputs.get(f.name, 0.0) for f in program.inputs], (samples, 1))
    engine = Engine(program, machine.sources)
    jolt = rows[0] - [1e-9 * (f.name in machine.spec.positions) for f in program.inputs]
    engine.start(jolt)
    return dict(zip([n for n, _, _ in program.outputs], engine.run(rows)[0].T, strict=True))


@pytest.mark.parametrize("h", [0.001, 0.0001])
def test_a_level_is_forgotten_at_rest(h: float) -> None:
    """Without load the sign turns in every sample, and the level falls by K_F U'M^-1U h of itself: 10 1/s, at any h."""
    out = at_rest("one_mass", {}, round(0.6 / h), h)
    level, begun = out["a_hat_rail"], round(0.1 / h)
    assert (np.diff(np.sign(out["v_hat"][begun:])) != 0).all()
    assert -np.log(level[begun + 1 :] / level[begun:-1]) / h == pytest.approx(10, rel=0.01)
    assert level[-1] < 0.01 * 50


@pytest.mark.parametrize("load", [10.0, 30.0])
def test_under_a_load_at_rest_the_level_falls_to_the_load(load: float) -> None:
    """d(a^2)/dt = -2 K_F N (a^2 - w^2), averaged over the chatter: the force is known, and no longer the level."""
    level = at_rest("one_mass", {"w": load}, 1000)["a_hat_rail"]
    time = 0.001 * np.arange(1000)
    expected = np.sqrt(load**2 + (50**2 - load**2) * np.exp(-20 * time))
    assert np.abs(level - expected).max() < 3 and abs(level[-1] - load) < 0.2


def test_both_levels_of_two_masses_are_forgotten_at_rest() -> None:
    out = at_rest("two_mass", {}, 1500)
    assert out["a_hat_between"][0] > 9 and out["a_hat_ground"][0] > 19
    assert abs(out["a_hat_between"][-1]) < 0.1 and abs(out["a_hat_ground"][-1]) < 0.1


COUPLED = """
name: coupled
coordinates: {x1: {velocity: v1, unit: m}, x2: {velocity: v2, unit: m}}
inputs: {w1: {unit: N}, w2: {unit: N}}
parameters: {m: {value: 1, unit: kg}, c: {value: 0.8, unit: kg}}
mass_matrix: [[m, c], [c, m]]
force: [w1, w2]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {name: first, law: coulomb, a: 30, unit: N}
    - {name: second, law: coulomb, a: 10, unit: N}
observer:
  {kind: gcfo, velocity: estimated, gains: {K_F: [5, 5], K_v: %s}, sample_time: 0.001}
envelope: {v1: [-20, 20], v2: [-20, 20]}
simulation: {duration: 8, sample_time: 0.001, observer: true, inputs: {w1: 15, w2: 11}}
"""


def second_level(velocity_gain: str) -> tuple[Certificate, Any]:
    """The certificate, and the error of the second level at each sample while only the second contact slides."""
    spec = parse_spec(COUPLED % velocity_gain, Path("coupled.yaml"))
    machine = Derived(spec)
    assert isinstance(machine.outcome, Certificate)
    run = simulate(spec, machine.system)
    assert (run.true_velocities[:, 0] == 0).all() and (run.true_velocities[1:, 1] > 0).all()
    assert np.ptp(run.friction[1:], axis=0).max() < 1e-6  # 14.2 N at the contact that sticks, 10 N at the other
    return machine.outcome, 10 - run.estimates[:, run.outputs.index("a_hat_second")]


def test_a_contact_that_sticks_keeps_the_error_of_another_alive() -> None:
    """Every truth is constant and the model exact. The matrix between reversals falls at 2.8 1/s; where the estimate of
    the first slip chatters about zero, its coordinate is gone, and what is left of the matrix is unstable."""
    outcome, error = second_level("[[20, -40], [0, 10]]")
    assert 2.8 < outcome.spectral_rate < 2.9 and 0.948 * outcome.spectral_rate < outcome.decay_rate
    seconds = np.abs(error).reshape(8, 1000).max(axis=1)
    assert (seconds[2:] > 3).all() and seconds[4:].max() > 10
    M, K_v = np.array([[1, 0.8], [0.8, 1]]), np.array([[20, -40], [0, 10]])
    on_surface = np.array([[-(M @ K_v)[1, 1], -1], [5 * 10, 0]])  # m v2' = ..., a2' = K_F K_v e_v2, with e_v1 = 0
    assert np.linalg.eigvals(on_surface).real.min() > 2
    said = outcome.sticking
    assert said is not None and said.contacts == ("first",)
    assert said.rate == pytest.approx(-np.linalg.eigvals(on_surface).real.max(), rel=1e-6)
    assert "an error of the other contacts grows at 19.5 1/s" in " ".join(Certified(outcome, "", {}).text().split())


def test_with_one_velocity_gain_it_stays_small() -> None:
    """K_v = k I: friction's monotonicity acts against the velocity error, whatever sticks."""
    outcome, error = second_level("[10, 10]")
    assert np.abs(error[4000:]).max() < 1
    assert outcome.sticking is not None and outcome.sticking.rate == pytest.approx(5, rel=0.01)


def second_level_with_the_first_held(velocity_gain: Any, h: float, duration: float = 12.0) -> Any:
    """That machine by hand: the first level held at its true 30 N, as by a guard, and the second learns."""
    inverse, gain = np.linalg.inv([[1, 0.8], [0.8, 1]]), np.array(velocity_gain, dtype=float)
    truth, forces = np.array([0.0, 1e4]), np.array([15.0, 10.0])
    estimate, level, errors = truth + np.array([0.0, 1e-3]), 10.0, []
    for _ in range(round(duration / h)):
        signs, pull = np.sign(estimate), gain @ (truth - estimate)
        estimate = estimate + h * (inverse @ (forces - signs * [30, level]) + pull)
        level -= h * 5 * signs[1] * pull[1]
        errors.append(10 - level)
    return np.array(errors)


def test_a_guard_that_holds_the_level_of_the_contact_that_sticks_does_not_help() -> None:
    error = np.abs(second_level_with_the_first_held([[20, -40], [0, 10]], 0.001)).reshape(12, 1000).max(axis=1)
    assert (error[2:] > 20).all() and error.max() > 40


def test_with_one_velocity_gain_what_is_left_falls_with_the_sample_time() -> None:
    """V of theorem 12 does not rise; what the sampled chatter leaves is of the order of h."""
    errors = [second_level_with_the_first_held([[10, 0], [0, 10]], h, 5.0) for h in (1e-3, 1e-4)]
    left = [np.abs(error[-len(error) // 5 :]).max() for error in errors]  # over the last second
    assert left[0] < 0.5 and left[1] < 0.2 * left[0]


@pytest.mark.parametrize("seed", range(20))
def test_beside_any_contacts_that_stick_the_others_fall_with_one_velocity_gain(seed: int) -> None:
    """Random mass matrices, distributions and gains: V = k e_v'Me_v + sum e_a^2/K_F cannot rise on any surface."""
    dice = np.random.default_rng(seed)
    n, count = (int(x) for x in dice.integers(2, 5, 2))
    count = min(n, count)
    root, U = dice.normal(size=(n, n)), dice.normal(size=(n, count))
    mass, k = root @ root.T + 0.1 * np.eye(n), float(dice.uniform(1, 100))
    inverse, h = np.linalg.inv(mass), 1e-4
    learn = np.diag(10 ** dice.uniform(-1, 2, count)) @ U.T * k
    change = np.block([[-k * np.eye(n), -inverse @ U], [learn, np.zeros((count, count))]])
    system = SimpleNamespace(contacts=[SimpleNamespace(name=f"c{i}") for i in range(count)])
    observer: Any = SimpleNamespace(
        system=system, distribution=sympy.Matrix(U.tolist()), sample_time=h, level_errors=True
    )
    response: Any = SimpleNamespace(
        step=sympy.Matrix((np.eye(n + count) + h * change).tolist()), by_force=sympy.Matrix((-inverse).tolist())
    )
    found = slowest_while_sticking(observer, response)
    assert found is not None and found.rate > 0
    change[:n, :n] = k * np.eye(n)  # and it sees what grows
    response.step = sympy.Matrix((np.eye(n + count) + h * change).tolist())
    grows = slowest_while_sticking(observer, response)
    assert grows is not None and grows.rate < 0

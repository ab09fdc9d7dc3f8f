"""Whatever a user's own effect changes in a System acts in the diagnosis's free runs as in the simulator's."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.fit.acceptance import noise_ratio
from codegen.diagnosis.fit.record import Record, record_of
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.shooting import Shooter
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import Part, Runner, Trial, part_of, with_effects
from codegen.diagnosis.results import FoundEffect
from codegen.effects import CATALOGUE
from codegen.effects.declare import add_declared_effects, places_of
from codegen.effects.register import load_effects
from codegen.mechanics import System, build_system
from codegen.simulate.sensors import SensorError
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import log_of, stage, system_of
from tests.effects.own_hooks import VALUES
from tests.simulate.open_loop import simulate_open_loop

H, COUNT, SUBSTEPS = 0.002, 3000, 8
AXES = """\
name: axes
coordinates:
  x: {velocity: v, unit: m}
  y: {velocity: w, unit: m}
inputs: {f: {unit: N}, g: {unit: N}}
parameters: {m: {value: 2, unit: kg}, k: {value: 150, unit: N/m}}
mass_matrix: [[m, 0], [0, 2*m]]
force: [f - k*x, g - k*y]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {name: rail, law: coulomb, a: 3, unit: N}
    - {name: way, law: coulomb, a: 2, unit: N}
"""
PLACES = {"contact": "rail", "coordinate": "x", "axis": "x", "sensor": "x", "input": "f"}


@pytest.fixture(autouse=True)
def own() -> Iterator[None]:
    before = dict(CATALOGUE)
    load_effects(Path(__file__).parents[1] / "effects" / "own_hooks.py")
    yield
    CATALOGUE.clear()
    CATALOGUE.update(before)


def machine(text: str = AXES) -> System:
    spec = parse_spec(text, Path("axes.yaml"))
    return add_declared_effects(build_system(spec), spec)


def motion_of(system: System) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(positions, velocities, commands) of the true machine."""
    time = H * np.arange(COUNT)
    commands = np.column_stack([14 * np.sin(4 * time) + 6 * np.sin(15 * time), 20 * np.sin(3 * time + 1)])
    positions, velocities = simulate_open_loop(system, time, commands, np.zeros(2), np.zeros(2), substeps=40)
    return positions, velocities, commands


def predicted(trial: Trial, theta: np.ndarray, moving: tuple[np.ndarray, np.ndarray, np.ndarray]) -> np.ndarray:
    """The diagnosis's free runs over one record, every one 0.3 s long, from states along the motion."""
    positions, velocities, commands = moving
    start = np.arange(500, COUNT - 200, 150, dtype=np.int32)
    record = Record(positions, positions, velocities, commands, H, np.full(2, 1e-6), start, 150)
    shooter = Shooter([trial.changed], [trial.free])
    return Runner(trial, shooter, 0, record, SUBSTEPS).run(theta, np.zeros((len(start), 4)))


def part(kind: str, system: System) -> Part:
    effect = CATALOGUE[kind]
    return part_of(effect, places_of(effect, system).index(PLACES[effect.sits_on]), system)


def changed(kind: str, system: System) -> System:
    return with_effects(system, [FoundEffect(kind, PLACES[CATALOGUE[kind].sits_on], VALUES[kind], {})])


@pytest.mark.parametrize("kind", VALUES)
def test_a_free_run_is_the_simulator_s(kind: str) -> None:
    """Its segments are predicted with the effect, and not without it."""
    system = machine()
    truth = changed(kind, system)
    positions, velocities, commands = motion_of(truth)
    sensor = SensorError(truth)
    read = sensor.measured(positions)
    rate = np.gradient(read, H, axis=0) if truth.sensor_errors else velocities
    moving = (read, rate, commands)
    one = Trial(system, (part(kind, system),), ())
    theta = one.theta(np.zeros(0), [VALUES[kind]])
    start = np.arange(500, COUNT - 200, 150)
    wanted = read[start[:, None] + np.arange(150)]
    with_it = np.abs(predicted(one, theta, moving) - wanted).mean()
    without = np.abs(predicted(Trial(system, (), ()), np.zeros(0), moving) - wanted).mean()
    assert with_it < 0.03 * without, (with_it, without)


@pytest.mark.parametrize("kind", ["soft", "creeping"])
def test_two_of_them_act_at_once(kind: str) -> None:
    """On either axis: the second takes no place of the first."""
    system = machine()
    effect = CATALOGUE[kind]
    parts = tuple(part_of(effect, k, system) for k in (0, 1))
    truth = with_effects(system, [FoundEffect(kind, p.on, VALUES[kind], {}) for p in parts])
    moving = motion_of(truth)
    start = np.arange(500, COUNT - 200, 150)
    wanted = moving[0][start[:, None] + np.arange(150)]

    def error(which: tuple[Part, ...]) -> np.ndarray:
        trial = Trial(system, which, ())
        run = predicted(trial, trial.theta(np.zeros(0), [VALUES[kind]] * len(which)), moving)
        return np.abs(run - wanted).mean(axis=(0, 1))

    both, first, second = error(parts), error(parts[:1]), error(parts[1:])
    assert both[0] < 0.03 * second[0] and both[1] < 0.03 * first[1], (both, first, second)


@pytest.mark.parametrize(
    "law", ["lugre, sigma_0: 20000, sigma_1: 60, sigma_2: 1, F_c: 3, F_s: 4, v_s: 0.05", "dahl, a: 3, c: 900, i: 2"]
)
def test_a_declared_law_with_states_is_run_as_the_simulator_runs_it(law: str) -> None:
    system = machine(AXES.replace("law: coulomb, a: 3", f"law: {law}"))
    moving = motion_of(system)
    start = np.arange(500, COUNT - 200, 150)
    wanted = moving[0][start[:, None] + np.arange(150)]

    def error(own: System) -> float:
        return float(np.abs(predicted(Trial(own, (), ()), np.zeros(0), moving) - wanted)[..., 0].mean())

    assert error(system) < 0.03 * error(machine())


def test_a_refit_finds_the_parameters_of_a_declared_law_with_states(tmp_path: Path) -> None:
    """By its level of steady sliding alone the static level was far off, and the log `unknown` (F_s = 3.2 for 5)."""
    text = "law: lugre, sigma_0: 20000, sigma_1: 60, sigma_2: 1, F_c: 4, F_s: {F_s}, v_s: 0.02"

    def machine_with(F_s: float) -> Spec:
        plain = stage(duration=7.0)
        return parse_spec(plain.text.replace("law: coulomb, a: 4.0", text.format(F_s=F_s)), plain.path)

    log = log_of(machine_with(5.0), tmp_path, "log.csv")
    motion = smooth_motion(log)
    problem = Problem(system_of(machine_with(4.5)), motion, {})
    refit = search_on(problem, lambda share: record_of(motion, log, share)).refit()
    found = {s.name: value for s, value in zip(refit.runner.trial.refitted_symbols, refit.theta, strict=True)}
    assert found["rail_F_s"] == pytest.approx(5.0, rel=0.01)
    assert noise_ratio(refit) < 1.5


def test_a_declared_sensor_error_is_in_the_free_runs() -> None:
    entry = "[{kind: encoder_eccentricity, on: x, parameters: {amplitude: 0.002, period: 0.05, phase: 0.4}}]"
    system = machine(AXES + f"effects: {entry}\n")
    positions, _, commands = motion_of(system)
    read = SensorError(system).measured(positions)
    moving = (read, np.gradient(read, H, axis=0), commands)
    start = np.arange(500, COUNT - 200, 150)

    def error(own: System) -> float:
        run = predicted(Trial(own, (), ()), np.zeros(0), moving)
        return float(np.abs(run - read[start[:, None] + np.arange(150)]).mean())

    assert error(system) < 0.03 * error(machine())


@pytest.mark.parametrize("kind", VALUES)
def test_the_force_residual_sees_it(kind: str, tmp_path: Path) -> None:
    """Of a log made with the effect, the balance with it leaves less than a fifth of what it leaves without."""
    place = {"rail": "rail", "x": "x", "f": "w"}[PLACES[CATALOGUE[kind].sits_on]]
    values = ", ".join(f"{name}: {value}" for name, value in VALUES[kind].items())
    entry = f"[{{kind: {kind}, on: {place}, parameters: {{{values}}}}}]"
    motion = smooth_motion(log_of(stage(entry, level=4.0, duration=6.0), tmp_path, "log.csv"))
    moving = motion.usable & (np.abs(motion.velocities[:, 0]) > 0.05)
    left, without = (
        np.abs(inverse_dynamics_residual(system_of(stage(e)), motion)[moving, 0]).mean() for e in (entry, "[]")
    )
    assert left < 0.2 * without, (left, without)

"""What the diagnosis evaluates in bulk against the same, one at a time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import casadi
import numpy as np
import pytest

from codegen.base.arrays import Array
from codegen.diagnosis.fit import shooting
from codegen.diagnosis.fit.record import Record
from codegen.diagnosis.fit.residual import ResidualAlong, level_parameters, moves_sensors, unfiltered_residual
from codegen.diagnosis.fit.shooting import Shooter
from codegen.diagnosis.fit.signals import Motion, smooth_motion
from codegen.diagnosis.fit.trial import Runner, Trial, model_of, part_of
from codegen.diagnosis.verdict.replay import tracked_friction, tracking_choice
from codegen.effects import CATALOGUE
from codegen.effects.register import candidates
from codegen.emit.package import emit_sources, make_header
from codegen.mechanics import System, build_system
from codegen.mechanics.casadi_form import over_rows
from codegen.observers import build_observer
from codegen.program import build_program
from codegen.spec import parse_spec, read_spec
from tests.diagnosis.stage import log_of, stage, system_of
from tests.twin import TwinEngine


@pytest.mark.parametrize("count", [0, 1, 799, 800, 1601])
def test_rows_in_bulk_are_the_rows_alone(count: int) -> None:
    x = casadi.SX.sym("x", 3)
    function = casadi.Function("f", [x], [casadi.vertcat(casadi.sin(x[0]) * x[1], x[2] / x[0])])
    rows = np.random.default_rng(1).normal(size=(count, 3))
    alone = [np.asarray(function(row)).ravel() for row in rows]
    assert np.array_equal(over_rows(function, rows), np.array(alone).reshape(count, 2))
    assert np.array_equal(over_rows(function, np.asfortranarray(rows)), np.array(alone).reshape(count, 2))
    rows[:, 2] = 0.7
    assert np.array_equal(over_rows(function, rows[:, :2], [0.7]), over_rows(function, rows))


def test_a_function_without_results_has_rows_without_columns() -> None:
    x = casadi.SX.sym("x", 2)
    assert over_rows(casadi.Function("none", [x], [casadi.SX(0, 1)]), np.ones((5, 2))).shape == (5, 0)


@pytest.mark.parametrize(("length", "n"), [(41, 1), (134, 1), (400, 2), (90, 3), (30, 2)])
def test_means_of_a_run_are_those_of_numpy_and_a_coordinate_that_diverges_spoils_no_other(length: int, n: int) -> None:
    noise = np.random.default_rng(length)
    group = max(1, length // 40)
    record = cast(Any, SimpleNamespace(length=length, group=group, compared=lambda positions: positions))
    run = 3 + noise.normal(size=(7, length, n))
    kept = length // record.group
    expected = run[:, : kept * record.group].reshape(7, kept, record.group, n).mean(axis=2)
    assert np.allclose(Record.means(record, run), expected, rtol=1e-13, atol=0)
    run[2, 5:, 0] = np.inf
    run[4, 9:, 0] = np.nan
    found = Record.means(record, run)
    assert np.isinf(found[2, -1, 0]) and np.isnan(found[4, -1, 0])
    assert np.allclose(found[:, :, 1:], expected[:, :, 1:], rtol=1e-13, atol=0)


LACKING = {
    "spring": {"k": 30.0},
    "stribeck": {"delta": 3.0, "v_s": 0.05},
    "presliding": {"sigma": 2e4},
    "compliance": {"k": 9e3, "c": 8.0, "load_fraction": 0.4},
    "backlash": {"gap": 1e-4, "k": 9e3, "c": 8.0, "load_fraction": 0.4},
    "actuator_lag": {"tau": 0.01},
}


def moved_axis() -> tuple[System, Array, Array]:
    """An axis with a friction of 4 N, positions and velocities along two sines, and an input that changes its sign."""
    t = 1e-3 * np.arange(1500)
    positions = 0.02 * np.sin(9 * t) + 0.004 * np.sin(41 * t)
    velocities = 0.18 * np.cos(9 * t) + 0.164 * np.cos(41 * t)
    return system_of(stage()), positions[:, None], velocities[:, None]


def trial_of(system: System, *kinds: str) -> Trial:
    parts = tuple(part_of(CATALOGUE[kind], 0, system) for kind in kinds)
    return Trial(system, parts, tuple(level_parameters(system)))


def test_loops_for_each_model_apart_give_the_bits_of_loops_that_all_share(monkeypatch: pytest.MonkeyPatch) -> None:
    system, positions, velocities = moved_axis()
    start = np.arange(0, 1300, 100, dtype=np.int32)
    commands = 12 * np.sign(np.sin(20 * 1e-3 * np.arange(1500)))[:, None]
    record = Record(positions, positions, velocities, commands, 1e-3, np.ones(1), start, 90)
    trials = [trial_of(system, kind) for kind in LACKING]
    thetas = [t.theta(np.array([3.5]), [v]) for t, v in zip(trials, LACKING.values(), strict=True)]

    def runs() -> list[Array]:
        made = Shooter([t.changed for t in trials], [t.free for t in trials])
        ran = (Runner(trial, made, k, record, 3).run(thetas[k], record.at_rest) for k, trial in enumerate(trials))
        return list(ran)

    apart = runs()
    monkeypatch.setattr(shooting, "MOST_APART", 0)
    shared = runs()
    assert all(np.array_equal(a, b) for a, b in zip(apart, shared, strict=True))
    assert all(np.ptp(a - apart[0]) > 1e-7 for a in apart[1:])


def test_code_that_few_runs_need_is_compiled_when_the_first_run_asks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A third of the time of an arm's diagnosis went to compiling candidates that were never run."""
    system, positions, velocities = moved_axis()
    record = Record(
        positions, positions, velocities, np.zeros((1500, 1)), 1e-3, np.ones(1), np.array([0], np.int32), 90
    )
    trial, asked = trial_of(system, "spring"), []

    def library(*arguments: Any) -> Any:
        asked.append(arguments)
        return compiled(*arguments)

    compiled = shooting._library
    monkeypatch.setattr(shooting, "_library", library)
    theta = trial.theta(np.array([3.5]), [{"k": 30.0}])
    later, at_once = (Shooter([trial.changed], [trial.free], at_once=flag) for flag in (False, True))
    assert len(asked) <= 1
    found = [Runner(trial, one, 0, record, 3).run(theta, record.at_rest) for one in (at_once, later, later)]
    assert len(asked) == 2 and all(np.array_equal(one, found[0]) for one in found)


@pytest.mark.parametrize("kind", LACKING)
def test_a_residual_for_many_values_is_that_of_each_model(tmp_path: Path, kind: str) -> None:
    motion = smooth_motion(log_of(stage(), tmp_path, "train.csv"))
    trial = replace(trial_of(system_of(stage()), kind), refitted_symbols=())
    along = ResidualAlong(trial, motion)
    thetas = [
        trial.theta(np.zeros(0), [{name: factor * value for name, value in LACKING[kind].items()}])
        for factor in (1.0, 0.5, 0.6, 0.7, 0.8)
    ]
    for theta, found in zip(thetas, along.several(thetas), strict=True):
        assert np.array_equal(found, unfiltered_residual(model_of(trial, theta), motion))
        assert np.array_equal(along.at(theta), found)


def test_the_compiled_tracking_observer_gives_the_bits_of_its_twin() -> None:
    spec = read_spec("specs/two_mass.yaml")
    system, noise = build_system(spec), np.random.default_rng(2)
    t = 0.001 * np.arange(300)
    measured = np.column_stack([np.sin(9 * t), 0.3 * np.cos(5 * t)]) + 1e-5 * noise.normal(size=(300, 2))
    motion = SimpleNamespace(
        positions=measured, measured=measured, commands=80 * np.sin(7 * t)[:, None], sample_time=0.001,
        usable=np.ones(300, dtype=bool),
    )  # fmt: skip
    given = cast(Motion, cast(Any, motion))
    observer = build_observer(replace(spec, observer=tracking_choice(system, given, 60.0)), system)
    program = build_program(observer)
    twin = TwinEngine(program, emit_sources(program, make_header("s", "0", "")))
    rows = np.hstack([measured, motion.commands])
    twin.start(rows[0])
    names = [name for name, _, _ in program.outputs]
    expected = twin.run(rows)[0][:, [names.index("F_hat_on_x1"), names.index("F_hat_on_x2")]]
    assert np.isfinite(expected).all() and np.abs(expected).max() > 1
    assert np.array_equal(tracked_friction(spec, system, given, 60.0), expected)


def test_every_effect_has_the_residual_of_its_model_or_moves_a_sensor(tmp_path: Path) -> None:
    motion, system = smooth_motion(log_of(stage(), tmp_path, "train.csv")), system_of(stage())
    moving = set()
    for effect, place in candidates(system):
        part = part_of(effect, place, system)
        trial = Trial(system, (part,), tuple(level_parameters(system)))
        if moves_sensors(trial):
            moving.add(effect.kind)
            continue
        theta = trial.theta(np.array([3.5]), [{p.name: 0.3 for p in part.effect.parameters}])
        along, model = ResidualAlong(trial, motion).at(theta), unfiltered_residual(model_of(trial, theta), motion)
        np.testing.assert_allclose(along, model, rtol=1e-9, atol=1e-9 * np.abs(model).max(), err_msg=effect.kind)
    assert moving == {"encoder_eccentricity"}


@pytest.mark.parametrize("kinds", [("presliding",), ("compliance",), ("backlash",), ("compliance", "actuator_lag")])
def test_several_vectors_at_once_have_the_bits_of_each_alone(kinds: tuple[str, ...]) -> None:
    """Also five, more than the loops advance in turn, and on few segments, before each of which a load begins anew.

    With a lag each vector has inputs of its own, which move the observer of a load.
    """
    system, positions, velocities = moved_axis()
    commands = 12 * np.sign(np.sin(20 * 1e-3 * np.arange(1500)))[:, None]
    trial = trial_of(system, *kinds)
    first = trial.theta(np.array([3.5]), [LACKING[kind] for kind in kinds])
    thetas = [first + 0.02 * k for k in range(5)]
    for starts in (np.arange(0, 1300, 100, dtype=np.int32), np.array([1200], dtype=np.int32)):
        record = Record(positions, positions, velocities, commands, 1e-3, np.ones(1), starts, 90)
        runner = Runner(trial, Shooter([trial.changed], [trial.free]), 0, record, 3)
        alone = [runner.run(theta, record.at_rest) for theta in thetas]
        assert runner.at_once == shooting.LANES and not np.array_equal(alone[0], alone[1])
        for count in (1, 3, 4, 5):
            found = [run(record.at_rest) for run in runner.several(thetas[:count])]
            assert all(np.array_equal(one, other) for one, other in zip(found, alone[:count], strict=True))


LUGRE = "lugre, sigma_0: 1e4, sigma_1: 30, sigma_2: 0.4, F_c: 3, F_s: 4, v_s: 0.05"


@pytest.mark.parametrize(
    ("law", "kinds", "idle"),
    [
        ("coulomb, a: 4.0", ("presliding", "spring"), {"m", "b", "spring_x_k"}),
        ("coulomb, a: 4.0", ("presliding", "stribeck"), {"m", "b"}),
        ("coulomb, a: 4.0", ("presliding", "position_dependent_friction"), {"m", "b"}),
        (LUGRE, ("spring",), {"m", "b", "spring_x_k"}),
        ("coulomb, a: 4.0", ("presliding", "load_dependent_friction"), set()),
        ("coulomb, a: 4.0", ("presliding", "actuator_lag"), {"m", "b", "actuator_lag_w_tau"}),
        ("coulomb, a: 4.0", ("presliding", "compliance"), set()),
    ],
)
def test_states_are_kept_for_values_that_do_not_act_on_them(
    law: str, kinds: tuple[str, ...], idle: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With each value changed in turn they have the bits of a simulation of their own."""
    spec = parse_spec(stage().text.replace("coulomb, a: 4.0", law), Path("stage.yaml"))
    system, (_, positions, velocities) = system_of(spec), moved_axis()
    others = tuple(s for s in system.values if s.name in ("m", "b"))
    trial = trial_of(system, *kinds)
    trial = replace(trial, refitted_symbols=(*others, *trial.refitted_symbols))
    commands = 12 * np.sign(np.sin(20 * 1e-3 * np.arange(1500)))[:, None]
    start = np.arange(0, 1300, 100, dtype=np.int32)
    record = Record(positions, positions, velocities, commands, 1e-3, np.ones(1), start, 90)
    called, simulate = list[int](), Shooter._followed

    def counted(shooter: Shooter, model: int, values: Any, *others: Any) -> tuple[Array, Array]:
        called.append(len(values))
        return simulate(shooter, model, values, *others)

    monkeypatch.setattr(Shooter, "_followed", counted)
    effects = [LACKING.get(kind) or {p.name: 0.3 for p in CATALOGUE[kind].parameters} for kind in kinds]
    refitted_values = np.array([float(system.values[s]) for s in trial.refitted_symbols])
    runner, first = Runner(trial, made(trial), 0, record, 3), trial.theta(refitted_values, effects)
    runner.hidden(first)
    kept = set()
    for k, symbol in enumerate(trial.symbols):
        theta = first.copy()
        theta[k] += 0.01 * max(1.0, abs(theta[k]))
        called.clear()
        found = runner.hidden(theta)
        kept |= set() if called else {symbol.name}
        assert np.array_equal(found, Runner(trial, made(trial), 0, record, 3).hidden(theta)), symbol
        assert np.ptp(found) > 0
    assert kept == idle


def made(trial: Trial) -> Shooter:
    return Shooter([trial.changed], [trial.free])

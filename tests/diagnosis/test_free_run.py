"""Free-run prediction of a log: against the simulator's plant, and against the practice logs' own simulator."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy
from ruamel.yaml import YAML
from scipy.signal import butter, filtfilt

from codegen.diagnosis.fit.measure import free_run
from codegen.effects import CATALOGUE
from codegen.effects.declare import add_declared_effects
from codegen.mechanics.build import build_system
from codegen.mechanics.system import System
from codegen.spec.model import DeclaredEffect
from codegen.spec.reader import read_spec
from tests.machines import SPRING_MASS, one_mass, read_machine
from tests.simulate.open_loop import simulate_open_loop
from tests.slow_cases import slow_except

PRACTICE = Path(__file__).parents[3] / "shared" / "practice"
STEP = 0.002
DELAYED = "effects: [{kind: input_delay, on: w, parameters: {T: 0.0037}}]"


def motion(system: System, seconds: float = 3.3):
    time = 2.0 + np.arange(0, seconds, STEP)
    w = (9 * np.sin(4 * time) + 3 * np.sin(9.1 * time))[:, None]
    return time, w, *simulate_open_loop(system, time, w, np.zeros(1), np.zeros(1))


@pytest.mark.parametrize("more", ["", DELAYED])
@pytest.mark.parametrize("trim_s", [0.0, 0.3])
def test_true_model_predicts_its_own_motion(more: str, trim_s: float):
    _, system = one_mass(k=20, more=more)
    time, w, x, v = motion(system)
    predicted = free_run(system, STEP, x, v, w, restart_s=0.5, trim_s=trim_s)
    cut = round(trim_s / STEP)
    assert np.all(np.isnan(predicted[:cut]))
    assert np.all(np.isnan(predicted[len(time) - cut :]))
    kept = slice(cut, len(time) - cut)
    assert np.max(np.abs(predicted[kept] - x[kept])) < 1e-12


@pytest.mark.parametrize("law", ["static_viscous", "karnopp"])
def test_a_static_level_holds_until_it_is_overcome(law: str):
    """The simulator's plant predicts it to rounding; with the sliding level alone each standstill would be shorter."""
    band = ", D_v: 0.001" if law == "karnopp" else ""
    declared = f"law: {law}, F_c: 4, F_s: 8, F_v: 0.5{band}"
    _, system = read_machine(SPRING_MASS.replace("law: coulomb, a: {a}", declared).format(m=2, k=60, b=20))
    _, w, x, v = motion(system)
    assert np.mean(v == 0) > 0.1
    assert np.max(np.abs(free_run(system, STEP, x, v, w) - x)) < 1e-12


def test_restarts_are_where_they_should_be():
    _, system = one_mass(k=20)
    _, wrong = one_mass(k=20, a=1)
    _, w, x, v = motion(system)
    error = np.abs(free_run(wrong, STEP, x, v, w, restart_s=0.4) - x)[:, 0]
    assert np.all(error[::200] == 0)
    assert np.all(error[199::200] > 1e-4)


def test_divergence_is_reported_as_infinite():
    _, system = one_mass(b=-1e6)
    _, w, x, v = motion(one_mass()[1])
    assert np.isinf(free_run(system, STEP, x, v, w)[-1, 0])
    state = x.copy()
    state[250] = np.nan
    assert np.isinf(free_run(one_mass()[1], STEP, state, v, w)).any()


def test_the_shortest_log():
    _, system = one_mass()
    _, w, x, v = motion(system)
    assert free_run(system, STEP, x[:2], v[:2], w[:2]).shape == (2, 1)


def practice_cases() -> list[Path]:
    """Cases of both tiers whose true effects have the form of effects.md and are all that is there."""
    cases = []
    for folder in sorted(PRACTICE.glob("*/case_*")):
        truth = json.loads((folder / "truth.json").read_text())
        written = all(e["kind"] in CATALOGUE and "form" not in e for e in truth["effects"])
        if written and truth["group"] != "foreign":
            cases.append(folder)
    return cases


def true_system(folder: Path, truth: dict) -> System:
    spec = read_spec(folder / "spec.yaml")
    effects = []
    for e in truth["effects"]:
        on = (e["on"],) if isinstance(e["on"], str) else tuple(e["on"])
        effects.append(DeclaredEffect(e["kind"], on, {k: sympy.Rational(p) for k, p in e["parameters"].items()}))
    spec = replace(spec, effects=tuple(effects))
    system = build_system(spec)
    levels = {
        c.law_parameters["a"]: sympy.Rational(a) for c, a in zip(system.contacts, truth["true_friction_a"], strict=True)
    }
    return add_declared_effects(replace(system, values={**system.values, **levels}), spec)


@pytest.mark.skipif(not PRACTICE.is_dir(), reason="the practice logs are not here")
@pytest.mark.parametrize(
    "folder",
    slow_except(practice_cases(), practice_cases()[::10]) if PRACTICE.is_dir() else [],
    ids=lambda folder: f"{folder.parent.name}-{folder.name}",
)
def test_true_model_predicts_a_practice_log_as_well_as_its_own_simulator(folder: Path):
    truth = json.loads((folder / "truth.json").read_text())
    evaluation = YAML(typ="safe").load(folder / "meta.yaml")["evaluation"]
    system = true_system(folder, truth)
    header = (folder / "test.csv").open().readline().strip().split(",")
    column = dict(zip(header, np.loadtxt(folder / "test.csv", delimiter=",", skiprows=1).T, strict=True))
    time = column["t"]
    raw = np.column_stack([column[x.name] for x in system.positions])
    w = np.column_stack([column[u.name] for u in system.inputs])
    low_pass = butter(4, evaluation["cutoff_hz"] * 2 * (time[1] - time[0]))
    x = filtfilt(*low_pass, raw, axis=0)
    v = np.gradient(x, time, axis=0)
    error = free_run(system, time[1] - time[0], x, v, w, evaluation["restart_s"], trim_s=evaluation["trim_s"]) - raw
    oracle = truth["oracle"]["true_parameters"]["sim_rmse"]
    # The oracle starts a load where its motor is; from the state of an observer it is as little off as the noise.
    least = truth["noise"]["position_rms"][0] if system.transmissions else oracle
    assert 0.8 * least < np.sqrt(np.nanmean(error**2)) < 1.1 * oracle

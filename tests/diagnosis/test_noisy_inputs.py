"""Noise of a logged input, which a lag or a larger inertia attenuates, is named as neither."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from codegen.diagnosis.case import case_of
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.search import Search, search_on
from codegen.diagnosis.results import Diagnosis
from codegen.diagnosis.selection import attenuated_noise
from codegen.diagnosis.selection.attenuated_noise import inputs_that_move, is_attenuated_noise
from codegen.diagnosis.selection.candidate_fits import every_part, fit_candidates
from codegen.logs import Log
from codegen.spec import parse_spec
from tests.diagnosis.stage import STAGE, TRAIN, among, log_of, stage, system_of
from tests.slow_cases import slow_except

LAG = "[{kind: actuator_lag, on: w, parameters: {tau: 0.015}}]"
HEAVIER = "[{kind: inertia_error, on: x, parameters: {delta: 1}}]"
CANDIDATES = ("actuator_lag", "inertia_error", "viscous")


def noisy(log: Log, share: float, seed: int) -> Log:
    """A log whose input has noise below a tenth of the sample rate; ``share``: over the RMS of the input."""
    b, a = butter(2, 0.2)
    white = np.random.default_rng(seed).normal(size=log.size + 500)
    noise = lfilter(b, a, white)[500:, None]
    return replace(log, inputs=log.inputs + share * np.std(log.inputs) * noise / np.std(noise))


def fitted(log: Log, kind: str, every: int = 1) -> tuple[Search, Fit, Fit]:
    """The search on a log by the spec without effects, its refit, and the fit with one effect.

    Args:
        every: rows of the log in a step of free runs.
    """
    spec = stage()
    case = case_of(spec, system_of(spec), log, None, 0.02)
    search = search_on(case.problem, lambda share: record_of(case.problem.motion, log, share).thinned(every))
    soft, base = search.with_noise_floor(search.refit())
    parts = [part for part in every_part(search, []) if part.kind == kind]
    return search, base, fit_candidates(soft, base, parts[:1])[0]


def said_of(log: Log) -> Diagnosis:
    spec = stage()
    with among(*CANDIDATES):
        return diagnose_log(spec, system_of(spec), log)[0]


@pytest.mark.parametrize("seed", slow_except([1, 2], [1]))
def test_attenuated_noise_is_no_effect(seed: int, tmp_path: Path) -> None:
    log = noisy(log_of(stage(), tmp_path, "log.csv"), 0.7, seed)
    search, base, lag = fitted(log, "actuator_lag")
    assert lag.cost < base.cost - 10  # free runs are better with it, and nothing lags
    assert is_attenuated_noise(search.problem, base, lag)
    assert said_of(log).effects == ()


NAMED = [(LAG, "actuator_lag"), (HEAVIER, "inertia_error")]


@pytest.mark.parametrize(("effects", "kind"), slow_except(NAMED, NAMED[:1], several=True))
def test_an_effect_is_named_in_spite_of_the_noise(effects: str, kind: str, tmp_path: Path) -> None:
    log = noisy(log_of(stage(effects), tmp_path, "log.csv"), 0.4, 1)
    search, base, found = fitted(log, kind)
    assert not is_attenuated_noise(search.problem, base, found)
    assert {e.kind for e in said_of(log).effects} == {kind}


def test_the_ripple_of_an_input_is_no_load_behind_a_spring(tmp_path: Path) -> None:
    log = log_of(stage(noise=2e-6), tmp_path, "log.csv")
    ripple = np.std(log.inputs) * np.sin(2 * np.pi * 90 * log.time)[:, None]
    search, base, load = fitted(replace(log, inputs=log.inputs + ripple), "compliance")
    assert load.cost < base.cost - 10  # its resonance attenuates the ripple
    assert is_attenuated_noise(search.problem, base, load)


def test_an_effect_in_a_log_without_noise_passes(tmp_path: Path) -> None:
    search, base, found = fitted(log_of(stage(LAG), tmp_path, "log.csv"), "actuator_lag")
    assert not is_attenuated_noise(search.problem, base, found)


@pytest.mark.parametrize("limit", slow_except([4.5, 6], [4.5]))
def test_a_limit_that_most_commands_exceed_attenuates_no_noise(limit: float, tmp_path: Path) -> None:
    """It was refused: inputs that move the machine without it stay below it, so it explains nothing with them."""
    log = log_of(stage(f"[{{kind: saturation, on: w, parameters: {{limit: {limit}}}}}]"), tmp_path, "log.csv")
    search, base, found = fitted(log, "saturation")
    assert found.cost < base.cost - 10
    assert not is_attenuated_noise(search.problem, base, found)


def test_an_effect_with_which_free_runs_are_worse_attenuates_no_noise(tmp_path: Path) -> None:
    """It reduces no error, with or without noise; that it is worse is for other tests to say."""
    log = log_of(stage("[{kind: viscous, on: rail, parameters: {b: 4}}]"), tmp_path, "log.csv")
    search, base, found = fitted(log, "viscous")
    turned = np.append(found.theta[:-1], -found.theta[-1])  # the friction that is missing, taken off once more
    for theta in (found.theta, turned):
        assert not is_attenuated_noise(search.problem, base, replace(found, theta=theta))


@pytest.mark.parametrize("every", slow_except([1, 2], [2]))
def test_free_runs_of_several_rows_a_step_have_the_same_inputs_without_noise(every: int, tmp_path: Path) -> None:
    """Those of all rows were simulated at the longer steps, half of them and at other times."""
    log = log_of(stage(LAG), tmp_path, "log.csv")
    search, base, lag = fitted(log, "actuator_lag", every)
    assert not is_attenuated_noise(search.problem, base, lag)
    search, base, lag = fitted(noisy(log_of(stage(), tmp_path, "plain.csv"), 0.7, 1), "actuator_lag", every)
    assert is_attenuated_noise(search.problem, base, lag)


@pytest.mark.parametrize("force", ["w", "w*cos(k*x)"])
def test_inputs_without_noise_are_those_that_acted(force: str, tmp_path: Path) -> None:
    """Also where the input acts with another lever at each position, from half to all."""
    text = STAGE.format(effects="[]", level=4, reference=TRAIN, duration=14, noise=0)
    text = text.replace("parameters:\n", "parameters:\n  k: {value: 4, unit: rad/m}\n").replace(
        "[w - b*v]", f"[{force} - b*v]"
    )
    spec = parse_spec(text, Path("stage.yaml"))
    log, system = log_of(spec, tmp_path, "log.csv"), system_of(spec)
    case = case_of(spec, system, noisy(log, 0.7, 1), None, 0.02)
    motion = case.problem.motion
    found = inputs_that_move(case.problem, system, motion)
    acted = motion.low_pass(log.inputs[: len(motion.time)])
    rows = case.problem.used[:, 0]
    off, logged = (float(np.std((w - acted)[rows])) for w in (found, motion.low_pass(motion.commands)))
    assert off < 0.1 * logged


KEPT = 10 * attenuated_noise.LEAST_KEPT
ENOUGH = 10 * attenuated_noise.LEAST_BY_NOISE


@pytest.mark.parametrize(
    ("clean", "by_noise", "attenuated"),
    [
        ((KEPT, 0), (), False),
        ((0, KEPT), (), False),
        ((0, 0), (ENOUGH, 0), True),
        ((0, 0), (0, ENOUGH), True),
        ((0, 0), (0, 0), False),
    ],
)
def test_the_better_of_two_inputs_without_noise_counts(
    clean: tuple[float, ...], by_noise: tuple[float, ...], attenuated: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of what explains 10 with the noise."""
    again = [] if KEPT in clean else [10.0]  # with segments weighted by what the effect changes in them
    explained, none = iter((10.0, *clean, *again, *by_noise)), lambda *_: None
    monkeypatch.setattr(attenuated_noise, "_explained", lambda *_: next(explained))
    monkeypatch.setattr(attenuated_noise, "_without_noise", lambda *_: iter((None, None)))
    for name in ("_change", "_change_by_inputs", "_acting", "inputs_that_move"):
        monkeypatch.setattr(attenuated_noise, name, none)
    record = SimpleNamespace(with_inputs=none)
    fit: Any = SimpleNamespace(model=SimpleNamespace(inputs=("w",)), runner=SimpleNamespace(record=record))
    problem: Any = SimpleNamespace(motion=SimpleNamespace(low_pass=none, commands=None))
    assert is_attenuated_noise(problem, fit, fit) is attenuated


@pytest.mark.parametrize(("explained", "attenuated"), [(0, True), (1, False)])
def test_what_inputs_explain_where_the_effect_does_not_act_is_no_noise_of_its_own(
    explained: int, attenuated: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A limit was refused for a play that is missing too: inputs that follow the motion explain the play's segments.

    Of two segments with one error each, a limit acts in the first. Inputs without noise explain one of the two.
    """
    error = np.array([[30.0, -30.0, 30.0, 30.0], [30.0, 30.0, -30.0, 30.0]])
    one = np.eye(2)[:, :, None] * error  # the error of each segment alone
    changes = iter((one[0], 0 * error, 0 * error))  # with the logged inputs, then with two without noise
    monkeypatch.setattr(attenuated_noise, "_change", lambda *_: next(changes))
    monkeypatch.setattr(attenuated_noise, "_change_by_inputs", lambda *_: one[explained])
    monkeypatch.setattr(attenuated_noise, "_without_noise", lambda *_: iter((None, None)))
    monkeypatch.setattr(attenuated_noise, "inputs_that_move", lambda *_: None)
    record = SimpleNamespace(with_inputs=lambda _: None)
    fit: Any = SimpleNamespace(
        model=SimpleNamespace(inputs=("w",)), runner=SimpleNamespace(record=record), residual=error
    )
    problem: Any = SimpleNamespace(motion=SimpleNamespace(low_pass=lambda _: None, commands=None))
    assert is_attenuated_noise(problem, fit, fit) is attenuated

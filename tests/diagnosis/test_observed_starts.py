"""Start states of loads behind springs by an observer, for a backlash that rattles while the motor hardly moves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from codegen.diagnosis.fit.output_error import mean_residuals, segment_cost, state_slopes
from codegen.diagnosis.fit.record import Record
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.shooting import OBSERVER
from codegen.diagnosis.fit.trial import Trial, part_of, runner_of
from codegen.diagnosis.selection.candidate_fits import CandidateFits
from codegen.effects import CATALOGUE
from codegen.effects.declare import add_declared_effects
from codegen.mechanics import build_system
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import STAGE, log_of
from tests.diagnosis.test_adoption import search_of
from tests.slow_cases import slow_except

LEVEL = 6.4
TRUTH = {"gap": 2.5e-5, "k": 430000.0, "c": 2200.0, "load_fraction": 0.67}
CHIRP = "0.02*sin(2*pi*0.5*t) + 0.001*sin(2*pi*(2 + 1.2*t)*t)"


def heavy_stage(effects: str = "[]") -> Spec:
    """The stage with 12 kg, sampled at 2 kHz."""
    text = STAGE.format(effects=effects, level=LEVEL, reference=CHIRP, duration=8, noise=0.0)
    changes = {
        "value: 2,": "value: 12,",
        "value: 6,": "value: 12,",
        "sample_time: 0.002": "sample_time: 0.0005",
        "{w: 900}": "{w: 20000}",
        "{w: 30}": "{w: 700}",
        "{x: 2e-6}": "{x: 8e-6}",
    }
    for old, new in changes.items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    return parse_spec(text, Path("stage.yaml"))


def declared(kind: str, **values: float) -> str:
    return f"[{{kind: {kind}, on: x, parameters: {{{', '.join(f'{n}: {v!r}' for n, v in values.items())}}}}}]"


@pytest.fixture(scope="module")
def search(tmp_path_factory: pytest.TempPathFactory) -> Search:
    log = log_of(heavy_stage(declared("backlash", **TRUTH)), tmp_path_factory.mktemp("log"), "train.csv")
    return search_of(heavy_stage(), log)


def test_the_true_backlash_comes_near_the_noise_from_observed_starts_alone(search: Search) -> None:
    trial = Trial(search.system, (part_of(CATALOGUE["backlash"], 0, search.system),), search.refitted_symbols)
    (runner,) = search.runners([trial])
    theta, at_rest = trial.theta(np.array([LEVEL]), [TRUTH]), search.record.at_rest
    costs = []
    for smoothed in (True, False):
        predict = runner.at(theta, smoothed=smoothed)
        residual = mean_residuals(runner, predict(at_rest))
        starts = state_slopes(runner, predict, at_rest, residual)
        costs.append(segment_cost(starts.project(residual)))
    noise = 0.5 * residual.size * np.log1p(1 - 2 / residual.shape[1])
    assert costs[0] > 2.5 * noise
    assert costs[1] - noise < 0.3 * (costs[0] - noise)


def test_offsets_of_a_fit_with_a_load_are_none_of_one_without(search: Search) -> None:
    base = search.refit()
    trial = base.trial.with_part(part_of(CATALOGUE["compliance"], 0, search.system))
    (loaded,) = search.runners([trial])
    assert base.offsets.any()
    assert not loaded.offsets_of(base.runner, base.offsets).any()
    assert loaded.offsets_of(loaded, base.offsets) is base.offsets


def test_a_small_gap_is_found_beside_the_compliance_that_explains_most(search: Search) -> None:
    parts = tuple(part_of(CATALOGUE[kind], 0, search.system) for kind in ("compliance", "backlash"))
    tried = CandidateFits(search, search.refit(), parts)
    compliance, backlash = tried.restarted(tried.fitted(tried.screened([0, 1])))
    assert backlash.cost < compliance.cost - 20
    assert backlash.parameters["gap"] == pytest.approx(TRUTH["gap"], rel=0.3)


def test_the_observer_begins_anew_after_a_gap(search: Search) -> None:
    """What the log had before a gap changes nothing after it; without the gap it does."""
    trial = Trial(search.system, (part_of(CATALOGUE["backlash"], 0, search.system),), search.refitted_symbols)
    theta = trial.theta(np.array([LEVEL]), [TRUTH])
    (runner,) = search.runners([trial])
    record = search.record
    gap = int(record.start[9]) - 20
    moved = replace(record, positions=record.positions + 0.01 * (np.arange(len(record.positions)) < gap)[:, None])

    def later(one: Record) -> np.ndarray:
        return replace(runner, record=one).run(theta, one.at_rest)[9:]

    resumed = later(replace(record, resumed=(gap,)))
    np.testing.assert_array_equal(later(replace(moved, resumed=(gap,))), resumed)
    assert np.abs(later(moved) - later(record)).max() > 1e-3
    assert not np.array_equal(resumed, later(record))


@pytest.mark.parametrize("gap", slow_except([0.0, 0.002], [0.002]))
def test_start_states_are_those_of_the_observer(gap: float) -> None:
    """x' = v + 2 g e, v' = a + g² e with the load's own equations, and the free run after it, by an ODE solver."""
    m, b, k, c, share, step = 2.0, 6.0, 900.0, 12.0, 0.6, 1e-3
    kind = "backlash" if gap else "compliance"
    values = {"k": k, "c": c, "load_fraction": share} | ({"gap": gap} if gap else {})
    text = STAGE.format(effects=declared(kind, **values), level=4, reference="0", duration=1, noise=0.0)
    spec = parse_spec(text, Path("stage.yaml"))
    system = add_declared_effects(build_system(spec), spec)
    time = np.arange(1400) * step
    force = 10 + 3 * np.sin(9 * time)
    speed = 0.8 + 0.3 * np.sin(7 * time)  # always forwards: the friction is its level
    place = 0.8 * time + 0.3 / 7 * (1 - np.cos(7 * time))
    start, length = 1000, 300
    columns = place[:, None], place[:, None], speed[:, None], force[:, None]
    record = Record(*columns, step, np.ones(1), np.array([start], dtype=np.int32), length)
    runner = runner_of(Trial(system, (), ()), record, 8)
    found = runner.run(np.zeros(0), record.at_rest)[0, :, 0]

    def rates(t: float, y: np.ndarray, gain: float) -> list[float]:
        x, v, there, load_v = y
        row = min(int(t / step + 1e-9), len(time) - 1)
        over = abs(x - there) - gap / 2
        push = np.sign(x - there) * k * over + c * (v - load_v) if over > 0 else 0.0
        push = push if push * (x - there) > 0 or not gap else 0.0
        error = np.interp(t, time, place) - x
        a = (force[row] - b * v - 4 - push) / (m * (1 - share))
        return [v + 2 * gain * error, a + gain**2 * error, load_v, push / (m * share)]

    gain = OBSERVER / (length * step)
    y = np.array([place[0], speed[0], place[0], speed[0]])
    predicted = []
    for row in range(start + length):
        if row >= start:
            predicted.append(y[0])
        now = gain if row < start else 0.0
        y = solve_ivp(rates, (row * step, (row + 1) * step), y, rtol=1e-9, atol=1e-12, args=(now,)).y[:, -1]
    assert np.ptp(predicted) > 0.1
    np.testing.assert_allclose(found, predicted, atol=3e-4)

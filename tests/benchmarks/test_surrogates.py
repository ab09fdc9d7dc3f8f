"""Surrogates keep the motion and the size of the residual, and take the law out of it; their p is counted."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest

from benchmarks.rates import Rate
from benchmarks.surrogates.__main__ import LEAST, PAGE, PICTURE, page, picture, steps
from benchmarks.surrogates.runs import Trial, Trials, least_p, table
from benchmarks.surrogates.surrogate import WAYS, Way, at_reversals, faded, scrambled, surrogate
from codegen.diagnosis.fit.acceptance import LEAST_NET
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.results import Candidate
from tests.diagnosis.stage import RESTS, log_of, stage, system_of
from tests.slow_cases import slow_except

MADE = 8
GAIN = "[{kind: input_gain, on: w, parameters: {gain: 1.3}}]"
SPRING = "[{kind: spring, on: x, parameters: {k: 30}}]"


def test_signs_turn_whole_blocks_and_the_order_keeps_them() -> None:
    """Blocks of 40 samples that fade into each other within 10; the middle of each is kept, but for its sign."""
    residual = np.arange(1.0, 151.0)[:, None] * np.array([1.0, 2.0])
    middle = np.arange(40).reshape(1, 40)[:, 5:35] + 40 * np.arange(3)[:, None]
    signs = scrambled(residual, 40, 10, "signs", np.random.default_rng(1)) / residual
    assert {tuple(np.unique(signs[rows].round(9))) for rows in middle} <= {(1.0,), (-1.0,)}
    many = scrambled(np.ones((4000, 1)), 40, 10, "signs", np.random.default_rng(1))
    assert many.min() == pytest.approx(-1) and many.max() == pytest.approx(1)
    assert np.abs(np.diff(many[:, 0])).max() < 2 * 2 / 10  # no step
    orders = [scrambled(residual, 40, 10, "order", np.random.default_rng(k)) for k in range(5)]
    for order in orders:
        assert sorted(order[20:120:40, 0].round(9)) == [21, 61, 101]
        assert np.allclose(order[126:], residual[126:])
        assert all(np.allclose(np.diff(order[rows], axis=0), np.diff(residual[rows], axis=0)) for rows in middle)
    assert len({tuple(order[:, 0].round(9)) for order in orders}) > 1


def test_no_sample_that_is_not_used_takes_part() -> None:
    used = np.ones((200, 1), dtype=bool)
    used[90:110] = False
    weight = faded(used, 10)[:, 0]
    assert np.all(weight[90:110] == 0) and np.allclose(weight[:79], 1) and np.allclose(weight[121:], 1)
    assert np.abs(np.diff(weight)).max() < 2 / 10


@pytest.mark.parametrize("way", slow_except(WAYS, WAYS[1:]))
def test_a_surrogate_has_the_motion_the_residuals_size_and_no_spring(way: Way, tmp_path: Path) -> None:
    """The log is of a spring of 30 N/m that no model has, so the residual is its force."""
    log, system = log_of(stage(SPRING), tmp_path, "log.csv"), system_of(stage())
    made = [surrogate(log, system, way, np.random.default_rng(k)) for k in range(MADE)]
    assert all(np.abs(one.positions - log.positions).max() < 0.1 * np.ptp(log.positions) for one in made)
    before = smooth_motion(log)
    near = round(4 / (before.cutoff_hz * log.sample_time))  # no disturbance at a reversal, and little near it
    used = (Problem(system, before, {}).used & ~at_reversals(system, before, near))[:, 0]
    x = before.positions[used, 0]
    residual, *others = [inverse_dynamics_residual(system, smooth_motion(one))[used, 0] for one in (log, *made)]
    assert float(residual @ x / (x @ x)) == pytest.approx(30, rel=0.02)  # the drive makes up for the spring
    # Signs and order are random: one surrogate may keep some of the spring, on the average nothing is left of it.
    assert abs(np.mean([r @ x / (x @ x) for r in others])) < 10
    sizes = [np.sqrt(np.mean(r**2) / np.mean(residual**2)) for r in others]
    assert 0.6 < np.mean(sizes) < 1.15
    again = surrogate(log, system, way, np.random.default_rng(0))
    assert np.array_equal(again.inputs, made[0].inputs) and np.array_equal(again.positions, made[0].positions)


def test_what_the_augmented_model_explains_is_not_in_a_surrogate(tmp_path: Path) -> None:
    log, system, whole = log_of(stage(SPRING), tmp_path, "log.csv"), system_of(stage()), system_of(stage(SPRING))
    before = smooth_motion(log)
    used = Problem(system, before, {}).used[:, 0]
    for k, way in enumerate(WAYS):
        made = surrogate(log, system, way, np.random.default_rng(k), augmented=whole)
        left = inverse_dynamics_residual(system, smooth_motion(made))[used, 0]
        own = inverse_dynamics_residual(whole, before)[used, 0]
        # The spring's force is gone altogether; what is left is as small as what the whole model leaves.
        assert np.sqrt(np.mean(left**2)) < 3 * np.sqrt(np.mean(own**2))


def test_a_log_that_is_long_enough_to_test_on_has_a_surrogate(tmp_path: Path) -> None:
    log = log_of(stage(SPRING), tmp_path, "log.csv")
    some = slice(0, round(3.5 / log.sample_time))
    short = replace(log, time=log.time[some], positions=log.positions[some], inputs=log.inputs[some])
    made = [surrogate(short, system_of(stage()), "signs", np.random.default_rng(k), 20.0) for k in range(MADE)]
    assert all(one.inputs.shape == short.inputs.shape for one in made)
    assert not all(np.array_equal(one.inputs, short.inputs) for one in made)  # three blocks may all keep their sign


def found() -> list[Trials]:
    """Two practice logs and a real one."""
    trials = [
        Trial("signs", "none", 0.002, 0.5, (), 10.0),
        Trial("order", "effect", 0.004, 0.004, ("spring",), 20.0),
        Trial("signs", "none", 0.05, 0.05, (), 30.0),
    ]
    one, two = Trials("standard", "standard/case_0001", "none", tuple(trials)), trials[1:2]
    return [one, Trials("standard", "standard/case_0002", "effect", tuple(two)), Trials("rig", "rig", "unfit", ())]


def test_a_small_candidate_counts_in_p_and_not_among_the_material_ones() -> None:
    none = float("nan")
    small, large, untried = (
        Candidate("spring", "x", {}, 0.5, 3.0, 8, 8, 0.5, False, "", (), size=size, p=p)
        for p, size in ((1e-9, 2e-4), (0.3, 0.05), (none, none))
    )
    both, only_small = (SimpleNamespace(candidates=c) for c in ((small, large, untried), (small, untried)))
    assert (least_p(both), least_p(both, LEAST_NET)) == (1e-9, 0.3)
    assert (least_p(only_small), least_p(only_small, LEAST_NET)) == (1e-9, 1.0)


def test_the_table_counts_acceptance_and_p_apart() -> None:
    rows = table(found(), 0.01)
    assert [(r["group"], r["way"], r["logs"]) for r in rows] == [("standard", "signs", 1), ("standard", "order", 2)]
    signs, order = rows
    assert (signs["accepted"], signs["at_alpha"], signs["material"]) == (Rate(0, 2), Rate(1, 2), Rate(0, 2))
    assert (order["accepted"], order["at_alpha"], order["cpu"]) == (Rate(2, 2), Rate(2, 2), 20.0)
    assert signs["cpu"] == 20.0 and signs["verdicts"] == [("none", 2)]


def test_the_page_names_each_false_alarm_and_what_could_not_be_tried() -> None:
    files = page(found(), "abc")
    assert "- standard/case_0002, order: spring (p = 0.004)" in files[PAGE]
    assert "Without a surrogate, as log and model do not fit together: rig." in files[PAGE]
    assert f"]({PICTURE})" in files[PAGE]
    assert "| an effect is accepted | 2 of 4: 50 % (15 … 85) | ≤ 3 % | **missed** |" in files[PAGE]
    assert "| p ≤ 0.01, of a material candidate | 2 of 4: 50 % (15 … 85) | ≤ 1 % | **missed** |" in files[PAGE]
    assert "| p ≤ 0.01, of any candidate | 3 of 4: 75 % (30 … 95) | – | – |" in files[PAGE]
    assert "| standard | order | 2 | 2/2 | 2/2 | 2/2 | effect 2 | 20 |" in files[PAGE]


def test_the_picture_is_the_empirical_distribution_and_the_same_each_time() -> None:
    assert steps([0.5, 0.0, 0.5, 0.1]) == ([LEAST, 0.1, 0.5, 0.5, 1.0], [0.25, 0.5, 0.75, 1.0, 1.0])
    ways = {"signs": {"standard": [0.5, 0.02, 0.7], "real sets": []}, "order": {"standard": [0.9], "real sets": []}}
    one, two = picture(ways, 0.01), picture(ways, 0.01)
    assert one == two
    assert ElementTree.fromstring(one).tag.endswith("svg")


@pytest.mark.parametrize("way", slow_except(WAYS, WAYS[:1]))
@pytest.mark.parametrize("missing", ["[]", GAIN])
def test_the_noise_of_the_positions_stays_noise(missing: str, way: Way, tmp_path: Path) -> None:
    """Free runs of the model that a surrogate is made with end at the noise, also if the log has an effect.

    Where the low-passed force of a gain was added to the logged input in place of a simulation, what it has above the
    cutoff was left over, in every surrogate alike: the median square was 4 to 6000 times that of the noise.
    """
    spec, system = stage(missing, reference=RESTS, noise=2e-5), system_of(stage())
    log = log_of(spec, tmp_path, "log.csv")
    for k in range(2):
        made = surrogate(log, system, way, np.random.default_rng(k), 5.0, system_of(spec))
        motion = smooth_motion(made, 5.0)
        base = search_on(Problem(system, motion, {}), partial(record_of, motion, made)).refit()
        squares = base.by_segment / base.residual.shape[1]
        assert np.median(squares) < 1.5 and squares.max() < 8


def test_the_noise_of_a_surrogate_is_not_that_of_the_log(tmp_path: Path) -> None:
    """With the measured positions kept, the input that fits them had the noise with which they are compared."""
    log, system = log_of(stage(noise=1e-3), tmp_path, "log.csv"), system_of(stage())
    made = [surrogate(log, system, "signs", np.random.default_rng(k)) for k in range(2)]
    noises = [(one.positions - smooth_motion(one).positions)[:, 0] for one in (log, *made)]
    assert np.abs(np.corrcoef(noises) - np.eye(3)).max() < 0.05
    assert [np.std(n) for n in noises] == pytest.approx([1e-3] * 3, rel=0.1)

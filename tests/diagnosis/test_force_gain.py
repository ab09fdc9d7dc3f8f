"""The force residual as second criterion: evidence for one model over another, and what refitted levels explain."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.fft import dct
from scipy.ndimage import minimum_filter1d
from scipy.signal import lfilter
from scipy.stats import binom

from benchmarks.real.sets import DATA
from codegen.diagnosis.evidence.force_gain import ForceCriterion, ForceGain, force_gain, prewhitened_gain
from codegen.diagnosis.evidence.timing import acting_earlier
from codegen.diagnosis.fit.acceptance import ALPHA, Evidence, random_signs
from codegen.diagnosis.fit.drive import (
    bounded_least_squares,
    drive_left,
    drive_shares,
    residual_at_drive,
    residual_over_friction,
)
from codegen.diagnosis.fit.force_rows import residual_slopes, slopes_of_evidence
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual, used_samples
from codegen.diagnosis.fit.search import Search, search_on
from codegen.diagnosis.fit.signals import Motion, low_pass, smooth_motion
from codegen.diagnosis.fit.trial import part_of, with_values
from codegen.diagnosis.selection.comparison import differ_in_time, force_prefers
from codegen.diagnosis.selection.force_fits import ForceFits
from codegen.diagnosis.selection.ranking import credible
from codegen.diagnosis.selection.refusals import absorbed_by_refit, contradicted_by_force, only_reduces_drive
from codegen.diagnosis.selection.significance import combined_p
from codegen.effects import CATALOGUE
from codegen.logs import Log, read_log
from codegen.mechanics import System, build_system
from codegen.simulate.drive import MeanInput
from codegen.spec import Spec, parse_spec, read_spec
from tests.diagnosis.stage import STAGE, TRAIN, log_of, stage, system_of
from tests.slow_cases import drawn

ONE_WAY = "0.25*t + 0.02*sin(2*pi*0.7*t)"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return log_of(stage(), tmp_path_factory.mktemp("log"), "train.csv")


def problem_of(log: Log) -> Problem:
    return Problem(system_of(stage()), smooth_motion(log), {})


def search_in(log: Log) -> Search:
    problem = problem_of(log)
    return search_on(problem, partial(record_of, problem.motion, log))


def blocks_of(problem: Problem) -> NDArray[np.int_]:
    """(N,) index of each sample among 48 blocks, which have as many used samples each."""
    used = np.flatnonzero(problem.used.any(axis=1))
    first = [block[0] for block in np.array_split(used, 48)]
    return np.maximum(np.searchsorted(first, np.arange(len(problem.motion.time)), side="right") - 1, 0)


def test_nats_are_those_of_as_many_residuals_as_the_band_holds(log: Log) -> None:
    """White residuals whose size falls by a tenth: n/2 ln(1.21), n = 2 f T of the samples that are used."""
    problem = problem_of(log)
    white = np.random.default_rng(1).normal(size=(len(problem.motion.time), 1))
    gain = force_gain(problem, 1.1 * white, white)
    seconds = problem.used.sum() * problem.motion.sample_time
    assert gain.left == pytest.approx(1 / 1.21)
    assert gain.nats == pytest.approx(problem.motion.cutoff_hz * seconds * np.log(1.21), rel=0.15)
    assert force_gain(problem, white, 1.1 * white).p == 1.0


def test_what_a_few_accelerations_show_is_no_chance(log: Log) -> None:
    """Ten jerks in the log, where alone the residual falls, to a thirtieth: ten signs are chance once in a thousand.

    They touch at most 20 blocks, so t is at most √20.
    """
    problem, draw = problem_of(log), np.random.default_rng(7)
    count = len(problem.motion.time)
    after = draw.normal(size=(count, 1))
    jerk = np.isin(np.arange(count) * 40 // count, draw.choice(40, 10, replace=False))[:, None]
    gain = force_gain(problem, np.where(jerk, 30.0, 1.0) * after, after)
    assert gain.by_signs > random_signs(np.sqrt(20)) and gain.p < 1e-8
    assert force_gain(problem, after, np.where(jerk, 30.0, 1.0) * after).p == 1.0


def test_equal_gains_in_five_blocks_tell_no_rivals_apart(log: Log) -> None:
    """Five signs agree by chance once in 32 times; there are two tests: 2/32."""
    problem = problem_of(log)
    block = blocks_of(problem)[:, None]
    sizes, sign = np.ones(block.shape), np.where(np.arange(len(block)) % 2, 1.0, -1.0)[:, None]
    larger = np.where(np.isin(block, [3, 11, 22, 31, 44]), 1.2, 1.0)
    gain = replace(force_gain(problem, larger * sign * sizes, sizes), ratios=(), nats=50.0)
    assert gain.by_signs == pytest.approx(1 / 32, rel=0.2)
    assert gain.p_of_rivals() == pytest.approx(2 / 32, rel=0.2)


def test_parameters_more_than_the_rival_has_count() -> None:
    few = ForceGain(left=0.5, nats=4.0, by_signs=1e-3)
    assert few.p_of_rivals() < 0.05 < few.p_of_rivals(3)  # exp(−4) and exp(−1)


@drawn(100, 400)
def test_jerks_of_different_size_under_two_models_that_are_as_good_are_told_apart_as_rarely_as_stated(
    log: Log, draws: int
) -> None:
    problem, draw = problem_of(log), np.random.default_rng(8)
    count = len(problem.motion.time)
    block, p = blocks_of(problem), []
    for _ in range(draws):
        common = np.exp(2 * draw.normal(size=48))
        before, after = (
            (common * np.exp(0.7 * draw.normal(size=48)))[block, None] * draw.normal(size=(count, 1)) for _ in range(2)
        )
        p.append(force_gain(problem, before, after).p)
    for alpha in (0.01, 0.05, 0.2):
        assert np.mean(np.array(p) <= alpha) <= binom.ppf(0.999, draws, alpha) / draws


@drawn(100, 400)
def test_two_models_that_are_as_good_are_told_apart_as_rarely_as_stated(log: Log, draws: int) -> None:
    problem, draw = problem_of(log), np.random.default_rng(2)
    shape = (len(problem.motion.time), 1)
    p = [force_gain(problem, draw.normal(size=shape), draw.normal(size=shape)).p for _ in range(draws)]
    for alpha in (0.05, 0.2):
        assert np.mean(np.array(p) <= alpha) <= alpha


@drawn(100, 400)
def test_a_force_that_is_not_there_is_accepted_as_rarely_as_stated(log: Log, draws: int) -> None:
    """A wave fitted by least squares to residuals with jerks, of the log's spectrum: one coefficient too many."""
    problem, draw = problem_of(log), np.random.default_rng(3)
    count, rows = len(problem.motion.time), problem.used
    wave = problem.motion.low_pass(np.sin(0.05 * np.arange(count))[:, None])
    p = []
    for _ in range(draws):
        noise = problem.motion.low_pass(
            draw.normal(size=(count, 1)) * np.exp(draw.normal(size=48))[blocks_of(problem), None]
        )
        size = float(noise[rows] @ wave[rows] / (wave[rows] @ wave[rows]))
        p.append(force_gain(problem, noise, noise - size * wave).p_added(1))
    for alpha in (0.01, 0.05, 0.2):
        assert np.mean(np.array(p) <= alpha) <= binom.ppf(0.999, draws, alpha) / draws


@pytest.mark.parametrize(
    ("pole", "share"),
    [
        pytest.param(0.99, 1 / 3, id="shorter than a block"),
        pytest.param(0.9975, 1 / 2, id="longer than a block"),
    ],
)
@drawn(100, 400)
def test_a_force_of_three_coefficients_is_accepted_as_rarely_as_stated_where_part_of_the_residual_is_slow(
    pole: float, share: float, log: Log, draws: int
) -> None:
    """Neighbours of the residual, white but for a slow part of a share of its size, are nearly uncorrelated."""
    problem, draw = problem_of(log), np.random.default_rng(5)
    count, rows = len(problem.motion.time), problem.used[:, 0]
    waves = np.sin(np.outer(np.arange(count), [0.0021, 0.0033, 0.0049]))
    p = []
    for _ in range(draws):
        slow = lfilter([1.0], [1.0, -pole], draw.normal(size=count + 4000))[4000:]
        noise = problem.motion.low_pass(draw.normal(size=(count, 1)))[:, 0]
        noise += slow * share * np.std(noise) / np.std(slow)
        fitted = waves @ np.linalg.lstsq(waves[rows], noise[rows], rcond=None)[0]
        p.append(force_gain(problem, noise[:, None], (noise - fitted)[:, None]).p_added(3))
    for alpha in (0.01, 0.05, 0.2):
        assert np.mean(np.array(p) <= alpha) <= binom.ppf(0.999, draws, alpha) / draws


@pytest.mark.parametrize("coefficients", [2, 10, 60])
@drawn(50, 150)
def test_forces_fitted_where_most_is_left_are_accepted_as_rarely_as_stated(
    coefficients: int, log: Log, draws: int
) -> None:
    """Harmonics of a motion in eight blocks of 48, where alone the residual is large: ten of them take a share of it,
    in each block alike, and with as many as there are blocks the score test says nothing.
    """
    problem, draw = problem_of(log), np.random.default_rng(6)
    count, rows = len(problem.motion.time), problem.used[:, 0]
    block, p = blocks_of(problem), []
    for _ in range(draws):
        moved = np.isin(block, draw.choice(np.arange(4, 44), 8, replace=False))
        noise = problem.motion.low_pass(draw.normal(size=(count, 1)))[:, 0] * np.where(moved, 10.0, 1.0)
        angle = np.outer(np.arange(count), np.arange(1, coefficients // 2 + 1) * draw.uniform(4, 6) * 2 * np.pi / count)
        waves = np.hstack([np.sin(angle), np.cos(angle)]) * moved[:, None]
        fitted = waves @ np.linalg.lstsq(waves[rows], noise[rows], rcond=None)[0]
        p.append(force_gain(problem, noise[:, None], (noise - fitted)[:, None]).p_added(coefficients))
    for alpha in (0.01, 0.05, 0.2):
        assert np.mean(np.array(p) <= alpha) <= binom.ppf(0.999, draws, alpha) / draws


def test_many_coefficients_that_explain_nearly_all_of_a_few_accelerations_are_no_chance(log: Log) -> None:
    """Of 60 coefficients no score test says anything; ten blocks in which about a thirtieth is left do."""
    problem, draw = problem_of(log), np.random.default_rng(7)
    count = len(problem.motion.time)
    after = draw.normal(size=(count, 1))
    times = np.ones(48)
    times[draw.choice(np.arange(4, 44), 10, replace=False)] = draw.uniform(20, 40, 10)
    gain = force_gain(problem, times[blocks_of(problem), None] * after, after)
    assert gain.values > 60 and gain.p_added(60) < 1e-6


def test_a_coefficient_five_deviations_from_zero_is_no_chance_though_the_gains_of_blocks_leave_doubt(log: Log) -> None:
    """A wave whose size by least squares is 5 standard errors, in white residuals."""
    problem, draw = problem_of(log), np.random.default_rng(4)
    count, rows = len(problem.motion.time), problem.used
    wave = np.sin(0.05 * np.arange(count))[:, None]
    noise = problem.motion.low_pass(draw.normal(size=(count, 1)))
    rate = 2 * problem.motion.cutoff_hz * problem.motion.sample_time
    error = float(np.std(noise[rows]) / np.sqrt(rate * (wave[rows] @ wave[rows])))
    before = noise - wave * float(noise[rows] @ wave[rows] / (wave[rows] @ wave[rows])) + 5 * error * wave
    gain = force_gain(problem, before, before - 5 * error * wave)
    assert gain.score[0] == pytest.approx(5, rel=0.2) and gain.p_added(1) < 1e-4
    assert gain.by_signs > random_signs(3.2) and gain.p > 1e-3


@pytest.mark.parametrize("used", [1.0, 0.25])
@drawn(100, 300)
def test_a_log_that_stands_still_most_of_the_time_shows_an_added_force_as_well(
    used: float, log: Log, draws: int
) -> None:
    """A wave 7 standard errors from zero: samples that are not used are in no block of the score test. And one
    that is not there is accepted as rarely as stated, though all 48 blocks then lie in a quarter of the log.
    """
    problem, draw = problem_of(log), np.random.default_rng(9)
    count = len(problem.motion.time)
    rows = problem.used & (np.arange(count)[:, None] >= (1 - used) * count)
    some: Any = SimpleNamespace(motion=problem.motion, used=rows)
    wave = problem.motion.low_pass(np.sin(0.05 * np.arange(count))[:, None])
    rate = 2 * problem.motion.cutoff_hz * problem.motion.sample_time
    power = float(wave[rows] @ wave[rows])
    found, false = [], []
    for k in range(draws):
        noise = problem.motion.low_pass(draw.normal(size=(count, 1)))
        size = float(noise[rows] @ wave[rows]) / power
        false.append(force_gain(some, noise, noise - size * wave).p_added(1))
        if k < 60:
            size = 7 * float(np.std(noise[rows]) / np.sqrt(rate * power))
            gain = force_gain(some, noise + size * wave, noise)
            found.append(gain.p_added(1) < 1e-3 / 23)
    assert np.mean(found) > 0.9
    for alpha in (0.01, 0.05, 0.2):
        assert np.mean(np.array(false) <= alpha) <= binom.ppf(0.999, draws, alpha) / draws


def test_an_offset_that_a_level_takes_is_alike_where_the_motion_never_turns(tmp_path: Path, log: Log) -> None:
    for some, alike in ((log_of(stage(reference=ONE_WAY), tmp_path, "one_way.csv"), True), (log, False)):
        search = search_in(some)
        base = search.refit()
        trial = base.runner.trial.with_part(part_of(CATALOGUE["offset"], 0, search.system))
        moved = base.theta.copy()
        moved[0] -= 1.0
        fit = replace(base, runner=replace(base.runner, trial=trial), theta=np.append(moved, -1.0))
        before, after = ForceCriterion(search, base), ForceCriterion(search, fit)
        assert bool(absorbed_by_refit(before, after)) is alike


def test_the_force_residual_decides_where_free_runs_leave_doubt(log: Log) -> None:
    """A spring of 18 N/m that is there: p = 0.05 by free runs; and the same for one that is not."""
    search = search_in(log)
    base = search.refit()
    trial = base.runner.trial.with_part(part_of(CATALOGUE["spring"], 0, search.system))
    lacking = replace(base, runner=replace(base.runner, trial=trial), theta=np.append(base.theta, 18.0))
    declared, false = ForceCriterion(search, base), ForceCriterion(search, lacking)
    assert combined_p(0.05, declared, false, 20) > ALPHA
    assert combined_p(0.05, false, declared, 20) < ALPHA
    assert combined_p(0.001, declared, false, 20) == pytest.approx(0.001 / 0.9)


def test_what_a_value_within_its_tolerance_explains_of_the_force_is_no_evidence_for_an_effect(log: Log) -> None:
    """A refit leaves the mass 1 % off; a spring of no stiffness that is fitted with the right mass is not accepted.

    A mass that its tolerance holds there leaves a force that an effect is needed for.
    """
    problem = problem_of(log)
    mass = next(s for s in problem.system.values if s.name == "m")
    tolerant = replace(problem, deviation={mass: 0.1})
    search = search_on(tolerant, partial(record_of, problem.motion, log))
    base = search.refit()
    off = base.theta.copy()
    off[search.refitted_symbols.index(mass)] *= 0.99
    trial = base.runner.trial.with_part(part_of(CATALOGUE["spring"], 0, search.system))
    richer = ForceCriterion(
        search, replace(base, runner=replace(base.runner, trial=trial), theta=np.append(base.theta, 0.0))
    )
    before = ForceCriterion(search, replace(base, theta=off))
    assert richer.over(before).p_added(1) < 1e-4
    assert combined_p(0.05, before, richer, 20) > ALPHA
    prior = base.prior
    tight = replace(prior, centre=off, precision=1e6 * prior.precision, deviation=1e-3 * prior.deviation)
    held = replace(base, theta=off, prior=tight)
    assert combined_p(0.05, ForceCriterion(search, held), richer, 20) < ALPHA


@pytest.mark.parametrize("share", [0.1, 0.4])
def test_values_that_may_all_be_small_explain_no_effect(share: float, tmp_path: Path) -> None:
    """With a motor constant of a large tolerance beside others, all forces may be zero, and explained any residual."""
    log = log_of(stage("[{kind: spring, on: x, parameters: {k: 60}}]"), tmp_path, "spring.csv")  # N/m
    text = STAGE.format(effects="[]", level=4.0, reference=TRAIN, duration=14.0, noise=0.0)
    text = text.replace("[w - b*v]", "[kt*w - b*v]").replace("parameters:", "parameters:\n  kt: {value: 1}")
    system = system_of(parse_spec(text, Path("stage.yaml")))
    deviation = {s: share * float(value) for s, value in system.values.items() if s.name in ("m", "b", "kt")}
    problem = Problem(system, smooth_motion(log), deviation)
    search = search_on(problem, partial(record_of, problem.motion, log))
    base = search.refit()
    trial = base.runner.trial.with_part(part_of(CATALOGUE["spring"], 0, system))
    richer = replace(base, runner=replace(base.runner, trial=trial), theta=np.append(search.declared, 60.0))
    gain = ForceCriterion(search, richer).added_to(ForceCriterion(search, base))
    assert gain.left < 0.5 and gain.p_added(1) < ALPHA / 23
    assert ForceCriterion(search, base).added_to(ForceCriterion(search, richer)).p_added(1) > 0.5


def test_a_parameter_without_limits_hides_no_loose_motor_constant(tmp_path: Path) -> None:
    """The mass does not change the drive force: infinite limits of it change no slope."""
    log = log_of(stage(), tmp_path, "plain.csv")
    text = STAGE.format(effects="[]", level=4.0, reference=TRAIN, duration=14.0, noise=0.0)
    text = text.replace("[w - b*v]", "[kt*w - b*v]").replace("parameters:", "parameters:\n  kt: {value: 1}")
    system, motion = system_of(parse_spec(text, Path("stage.yaml"))), smooth_motion(log)
    mass, constant = (next(s for s in system.values if s.name == name) for name in ("m", "kt"))
    least = np.array([-np.inf, -0.9])
    without, finite = (
        slopes_of_evidence(system, motion, [mass, constant], (low, -low)) for low in (least, np.array([-0.1, -0.9]))
    )
    assert np.array_equal(without, finite)
    assert not np.allclose(without, residual_slopes(system, motion, [mass, constant]))


def test_values_that_act_alike_or_not_at_all_are_fitted_within_their_limits() -> None:
    """Two equal columns, whose sum alone is determined, one of zeros, and one with the limit 0.1 that needs 1."""
    draw = np.random.default_rng(11)
    one, other = draw.normal(size=(2, 500))
    columns = np.column_stack([one, one, np.zeros(500), other])
    high = np.array([np.inf, 1.0, 1.0, 0.1])
    weights = bounded_least_squares(columns, 3 * one + other, (-high, high))
    along = float(one @ (3 * one + 0.9 * other)) / float(one @ one)
    assert weights[0] + weights[1] == pytest.approx(along, rel=1e-4) and abs(weights[1]) <= 1
    assert weights[2] == 0 and weights[3] == pytest.approx(0.1, rel=1e-6)


@pytest.mark.parametrize("off", [0.0, 3.0])
@drawn(100, 300)
def test_beside_a_toleranced_value_a_force_that_is_not_there_is_accepted_as_rarely_as_stated(
    off: float, log: Log, draws: int
) -> None:
    """A wave fitted together with the acceleration, where the residual without it has that some standard errors off."""
    problem, draw = problem_of(log), np.random.default_rng(10)
    count, rows = len(problem.motion.time), problem.used[:, 0]
    columns = np.column_stack([problem.motion.accelerations[:, 0], np.sin(0.05 * np.arange(count))])
    columns = problem.motion.low_pass(columns / np.sqrt(np.mean(columns**2, axis=0)))
    columns[:, 1] += columns[:, 0]  # correlated
    rate, wide = 2 * problem.motion.cutoff_hz * problem.motion.sample_time, (np.full(1, -np.inf), np.full(1, np.inf))
    p = []
    for _ in range(draws):
        noise = problem.motion.low_pass(draw.normal(size=count))
        error = float(np.std(noise[rows]) / np.sqrt(rate * rows.sum() * np.mean(columns[rows, 0] ** 2)))
        before = noise + off * error * columns[:, 0]
        after = before - columns @ np.linalg.lstsq(columns[rows], before[rows], rcond=None)[0]
        left = [r - columns[:, :1] @ bounded_least_squares(columns[rows, :1], r[rows], wide) for r in (before, after)]
        p.append(force_gain(problem, left[0][:, None], left[1][:, None]).p_added(1))
    for alpha in (0.01, 0.05, 0.2):
        assert np.mean(np.array(p) <= alpha) <= binom.ppf(0.999, draws, alpha) / draws


@pytest.mark.parametrize(("delta", "refused"), [(1000.0, True), (-0.6, True), (0.0, False)])
def test_a_mass_that_the_forces_contradict_is_refused(delta: float, refused: bool, log: Log) -> None:
    """Of a machine of 2 kg: with a thousand more it goes on at the measured speed, whatever acts, in short runs."""
    search = search_in(log)
    base = search.refit()
    trial = base.runner.trial.with_part(part_of(CATALOGUE["inertia_error"], 0, search.system))
    heavy = replace(base, runner=replace(base.runner, trial=trial), theta=np.append(base.theta, delta))
    before, after = ForceCriterion(search, base), ForceCriterion(search, heavy)
    assert bool(contradicted_by_force(before, after)) is refused
    assert not contradicted_by_force(after, before)


@pytest.mark.parametrize(("kind", "share"), [("dead_zone", 2.0), ("saturation", 1e-3), ("dead_zone", 0.3)])
def test_an_input_of_which_nothing_acts_is_no_effect(kind: str, share: float, log: Log) -> None:
    search = search_in(log)
    base = search.refit()
    trial = base.runner.trial.with_part(part_of(CATALOGUE[kind], 0, search.system))
    value = float(trial.parts[-1].inward({trial.parts[-1].names[0]: share * np.abs(log.inputs).max()})[0])
    moved = replace(base, runner=replace(base.runner, trial=trial), theta=np.append(base.theta, value))
    before, after = ForceCriterion(search, base), ForceCriterion(search, moved)
    assert ("too little to move" in only_reduces_drive(before, after, Evidence(1.0, 0.99, 3.0, 8, 8))) is (share != 0.3)


SLOW = "0.25*sin(2*pi*0.08*t)"
"""At most 0.13 m/s and 0.13 N of inertia force, beside 40 N of friction."""


@pytest.mark.parametrize("kind", ["dead_zone", "saturation"])
def test_a_drive_that_friction_cancels_moves_nothing(kind: str, tmp_path: Path) -> None:
    """Where friction is nearly all of the drive: behind a limit of half its level, the drive is the sign of the speed.

    A level of as much cancels it, or a level of zero all that passes a wide dead zone; the machine then goes on as
    fast as it is, in free runs and by forces, although an offset of 12 N is what the model lacks.
    """
    lacking = "[{kind: offset, on: x, parameters: {f0: 12}}]"
    log = log_of(stage(lacking, level=40.0, reference=SLOW, duration=30.0), tmp_path, "slow.csv")
    search = search_in(log)
    base = search.refit()
    part = part_of(CATALOGUE[kind], 0, search.system)
    size = {"dead_zone": 2 * np.abs(log.inputs).max(), "saturation": 15.0}[kind]
    trial = base.runner.trial.with_part(part)
    theta = np.append(base.theta, part.inward({part.names[0]: size}))
    theta[0] = {"dead_zone": 0.0, "saturation": 15.0}[kind]
    cancelled = replace(base, runner=replace(base.runner, trial=trial), theta=theta)
    before, after = ForceCriterion(search, base), ForceCriterion(search, cancelled)
    words = only_reduces_drive(before, after, Evidence(1.0, 0.99, 3.0, 8, 8))
    assert "too little to move the machine" in words
    assert not credible(search, base, cancelled, 20)


@pytest.mark.parametrize(("share", "refused"), [(0.11, True), (0.9, False)])
def test_a_dead_zone_that_takes_as_much_of_the_drive_as_of_the_residual_explains_nothing(
    share: float, refused: bool, tmp_path: Path
) -> None:
    """Of an elbow whose upper arm moves, which the model leaves out, 1.5 times the drive was left: with a dead zone of
    most of the drive it was less, and that was named.
    """
    lacking = "[{kind: spring, on: x, parameters: {k: 120}}]"
    search = search_in(log_of(stage(lacking), tmp_path, "spring.csv"))
    base = search.refit()
    part = part_of(CATALOGUE["dead_zone"], 0, search.system)
    trial = base.runner.trial.with_part(part)
    theta = np.append(base.theta, part.inward({"width": 5.0}))
    moved = replace(base, runner=replace(base.runner, trial=trial), theta=theta)
    before, after = ForceCriterion(search, base), ForceCriterion(search, moved)
    assert 0.5 < after.over(before).left < 0.7
    words = only_reduces_drive(before, after, Evidence(1.0, share, 3.0, 8, 8))
    assert ("explains no larger share" in words) is refused


TWO_AXES = """\
name: axes
coordinates:
  x: {{velocity: vx, unit: m}}
  y: {{velocity: vy, unit: m}}
inputs: {{wx: {{unit: N}}, wy: {{unit: N}}}}
parameters: {{m: {{value: 2, unit: kg}}}}
mass_matrix: [[m, 0], [0, m]]
force: [wx, wy]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {{name: rail_x, law: coulomb, a: 4, unit: N}}
    - {{name: rail_y, law: coulomb, a: 4, unit: N}}
effects: {effects}
simulation:
  duration: 14
  sample_time: 0.002
  reference: {{x: "0.2*sin(2*pi*0.4*t)", y: "0.15*sin(2*pi*0.9*t)"}}
  position_gain: {{wx: 900, wy: 900}}
  velocity_gain: {{wx: 30, wy: 30}}
  encoder_step: {{x: 2e-6, y: 2e-6}}
"""


def test_an_effect_that_weakens_one_drive_is_not_judged_on_the_other_axis(tmp_path: Path) -> None:
    """A dead zone that takes half of the drive of y, and a spring on x that the model lacks as well: x is as before."""
    lacking = (
        "[{kind: dead_zone, on: wy, parameters: {width: 8}}, {kind: spring, on: x, parameters: {k: 120}}]"  # 120 N/m
    )
    plant, plain = (parse_spec(TWO_AXES.format(effects=e), Path("axes.yaml")) for e in (lacking, "[]"))
    log = log_of(plant, tmp_path, "axes.csv")
    problem = Problem(system_of(plain), smooth_motion(log), {})
    search = search_on(problem, partial(record_of, problem.motion, log))
    base = search.refit()
    part = part_of(CATALOGUE["dead_zone"], 1, search.system)
    trial = base.runner.trial.with_part(part)
    moved = replace(
        base,
        runner=replace(base.runner, trial=trial),
        theta=np.append(search.declared, part.inward({"width": 8.0})),
    )
    before, after = ForceCriterion(search, base), ForceCriterion(search, moved)
    shares = drive_shares(after.fit.model, before.fit.model, problem.motion, problem.used)
    assert shares[0] == pytest.approx(1) and shares[1] < 0.7
    left = [np.sqrt(np.mean(c.without_levels**2, axis=0)) for c in (before, after)]
    assert left[1][0] == pytest.approx(left[0][0], rel=1e-3) and left[1][1] < 0.1 * left[0][1]
    assert only_reduces_drive(before, after, Evidence(1.0, 0.99, 3.0, 8, 8)) == ""


STEADY = "0.25*t"


def by_load(mu: float, share: float = 1.0) -> System:
    """The stage with friction that follows the drive, and so much of its own friction."""
    system = system_of(stage(f"[{{kind: load_dependent_friction, on: rail, parameters: {{mu: {mu}}}}}]"))
    named = {s.name: float(v) for s, v in system.values.items()}
    return with_values(system, {"rail_a": share * named["rail_a"], "b": share * named["b"]})


NOISE = 2e-5
SPEED_NOISE = 3 * NOISE * 2 * np.pi * 50.0 * np.sqrt(2 * 50.0 * 0.002 / 3)
"""Three standard deviations of the derivative of white noise at 500 Hz, low-passed at 50 Hz."""


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_creep_in_the_noise_of_the_speed_is_a_standstill(seed: int, tmp_path: Path) -> None:
    """At 40 % of three standard deviations of the speed's noise, single samples above that were taken for motion.

    A right model was told that a force of −7.2 N acts for 0.3 s: the sign of the slip was noise there.
    """
    plain = log_of(stage(), tmp_path, "plain.csv")
    t = plain.time - plain.time[0]
    moving = np.minimum(t, 7.0)
    x = 0.02 * np.sin(2 * np.pi * moving) + 0.4 * SPEED_NOISE * np.maximum(t - 7.0, 0.0)
    noise = NOISE * np.random.default_rng(seed).normal(size=len(t))
    motion = smooth_motion(replace(plain, positions=(x + noise)[:, None]), cutoff_hz=20.0)
    problem = Problem(system_of(stage()), motion, {})
    assert problem.noise_speed == pytest.approx(SPEED_NOISE, rel=0.15)
    used, creep = problem.used[:, 0], (t > 7.1) & motion.usable
    assert not used[creep].any() and used[~creep & motion.usable].mean() > 0.9


@pytest.mark.parametrize("size", [2.0**-12, 1.0, 2.0**12])
def test_a_coordinate_is_at_standstill_by_its_own_noise(size: float, tmp_path: Path) -> None:
    """One threshold for all coordinates took an axis of millimetres for standing, by the noise of an angle beside it.

    The second coordinate and its noise are as large as in another unit; contacts are on each and between both.
    """
    text = """name: two
coordinates: {x: {velocity: v, unit: m}, y: {velocity: z, unit: m}}
inputs: {u: {unit: N}, r: {unit: N}}
parameters: {m: {value: 1, unit: kg}}
mass_matrix: [[m, 0], [0, m]]
force: [u, r]
friction:
  distribution: [[1, 0, -1], [0, 1, RATIO]]
  contacts:
    - {name: one, law: coulomb, a: 1, unit: N}
    - {name: two, law: coulomb, a: 1, unit: N}
    - {name: three, law: coulomb, a: 1, unit: N}
"""
    plain = log_of(stage(), tmp_path, "plain.csv")
    t = plain.time - plain.time[0]
    noise = NOISE * np.random.default_rng(4).normal(size=(len(t), 2))
    both = np.column_stack([0.02 * np.sin(2 * np.pi * t), 0.02 * np.sin(2 * np.pi * 0.7 * t)]) + noise
    found = []
    for by in (1.0, size):
        system = system_of(parse_spec(text.replace("RATIO", repr(1 / by)), Path("two.yaml")))
        log = replace(plain, positions=both * [1.0, by], velocities=None, inputs=np.tile(plain.inputs, 2))
        found.append(Problem(system, smooth_motion(log, cutoff_hz=20.0), {}).used)
    assert (found[0] == found[1]).all()
    assert (found[0].mean(axis=0) > 0.5).all()


def test_friction_that_follows_the_measured_drive_does_not_explain_its_noise(tmp_path: Path) -> None:
    """At a steady speed friction is all of the drive: `a share of the drive` leaves that share of any residual."""
    plain = log_of(stage(reference=STEADY), tmp_path, "plain.csv")
    noise = 0.4 * np.random.default_rng(4).normal(size=plain.inputs.shape)
    motion = smooth_motion(replace(plain, inputs=plain.inputs + noise))
    declared, trap = system_of(stage()), by_load(0.97, 0.03)
    used = used_samples(declared, motion)[:, 0]

    def rms(residual: np.ndarray) -> float:
        return float(np.sqrt(np.mean(residual[used, 0] ** 2)))

    assert drive_left(declared, motion) == pytest.approx([1.0])
    u, v = motion.inputs[:, 0], motion.velocities[:, 0]
    net, drive = (motion.low_pass(f)[motion.usable] for f in (u - 0.97 * np.abs(u) * np.sign(v), u))
    left = float(np.sqrt(np.mean(net**2) / np.mean(drive**2)))  # the speed has one sign
    assert drive_left(trap, motion)[0] == pytest.approx(left, rel=0.05) and left < 0.1
    crawl = replace(motion, velocities=motion.velocities * np.where(np.arange(len(v)) % 500 < 100, -1.0, 1.0)[:, None])
    assert drive_left(trap, crawl)[0] < 0.1
    raw = rms(inverse_dynamics_residual(trap, motion)) / rms(inverse_dynamics_residual(declared, motion))
    fair = rms(residual_at_drive(trap, motion)) / rms(residual_at_drive(declared, motion))
    assert raw < 0.1 and fair > 0.95


def test_friction_that_does_follow_the_drive_still_explains_it(tmp_path: Path) -> None:
    effect = "[{kind: load_dependent_friction, on: rail, parameters: {mu: 0.3}}]"
    motion = smooth_motion(log_of(stage(effect), tmp_path, "load.csv"))
    declared, true = system_of(stage()), by_load(0.3)
    used = used_samples(declared, motion)[:, 0]
    before, after = (residual_at_drive(s, motion)[used, 0] for s in (declared, true))
    assert 0.6 < drive_left(true, motion)[0] <= 1.0
    assert np.mean(after**2) < 0.05 * np.mean(before**2)


@pytest.mark.parametrize("measure", [residual_at_drive, residual_over_friction])
def test_an_error_of_the_drive_counts_alike_in_driving_and_in_braking(
    measure: Callable[[System, Motion], NDArray[np.float64]], tmp_path: Path
) -> None:
    """Friction in proportion to the load takes 30 % of an error in driving, and adds as much in braking."""
    effect, error = "[{kind: load_dependent_friction, on: rail, parameters: {mu: 0.3}}]", 0.1
    motion = smooth_motion(log_of(stage(effect), tmp_path, "load.csv"), cutoff_hz=20.0)
    true, pull = by_load(0.3), np.full_like(motion.inputs, 5.0)  # which drives one way and brakes the other way
    motion = replace(motion, inputs=pull, commands=pull)
    wrong = replace(motion, inputs=motion.inputs + error, commands=motion.commands + error)
    more = (measure(true, wrong) - measure(true, motion))[:, 0]
    raw = (inverse_dynamics_residual(true, wrong) - inverse_dynamics_residual(true, motion))[:, 0]
    v = motion.velocities[:, 0]
    for way, share in ((v > 0.05, 0.7), (v < -0.05, 1.3)):
        inside = minimum_filter1d(way & motion.usable, 101)  # the low-pass mixes both ways about a reversal
        assert inside.sum() > 100
        assert np.median(raw[inside]) == pytest.approx(share * error, rel=0.02)
        assert np.median(more[inside]) == pytest.approx(error, rel=0.02)


@pytest.mark.parametrize(("share", "passes"), [(0.92, True), (0.17, True), (0.15, False), (-0.1, False)])
def test_friction_that_follows_the_drive_must_remove_more_than_in_proportion(
    share: float, passes: bool, tmp_path: Path
) -> None:
    """With 0.94 of the drive left, scaling alone removes 1 − 0.94² = 12 %; 5 % more are asked for."""
    plain = log_of(stage(reference=STEADY), tmp_path, "plain.csv")
    plain.positions[:, 0] += 1e-4 * np.random.default_rng(3).normal(size=len(plain.time))
    search = search_in(plain)
    base = search.refit()
    trial = base.runner.trial.with_part(part_of(CATALOGUE["input_gain"], 0, search.system))
    weak = replace(base, runner=replace(base.runner, trial=trial), theta=np.append(base.theta, np.log(0.94)))
    before, after = ForceCriterion(search, base), ForceCriterion(search, weak)
    assert drive_left(after.fit.model, search.motion) == pytest.approx([0.94], abs=1e-3)
    assert after.over(before).left > 0.95
    assert bool(only_reduces_drive(before, after, Evidence(1.0, share, 3.0, 8, 8))) is not passes


@pytest.mark.parametrize("gain", [0.3, 0.9, 1.2])
def test_a_gain_scales_the_drive_by_its_value(gain: float, log: Log) -> None:
    weak = system_of(stage(f"[{{kind: input_gain, on: w, parameters: {{gain: {gain}}}}}]"))
    assert drive_left(weak, smooth_motion(log)) == pytest.approx([gain])


@pytest.mark.parametrize("gain", [0.8, 1.25])
def test_a_gain_and_the_same_machine_divided_by_it_have_one_residual(gain: float, log: Log) -> None:
    """gain w = M a + b v + λ and w = (M a + b v + λ)/gain are one motion, so neither is preferred by its force."""
    effect = f"[{{kind: input_gain, on: w, parameters: {{gain: {gain}}}}}]"
    strong, plain = system_of(stage(effect)), system_of(stage())
    values = {s.name: float(v) for s, v in plain.values.items()}
    divided = with_values(plain, {name: values[name] / gain for name in ("m", "b", "rail_a")})
    one, other = (residual_at_drive(s, smooth_motion(log)) for s in (strong, divided))
    np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("kind", ["dead_zone", "saturation"])
def test_a_dead_zone_takes_of_the_drive_and_nothing_of_its_errors(kind: str, tmp_path: Path) -> None:
    """A newton more at the input is a newton more behind it: the residual is not scaled."""
    motion = smooth_motion(log_of(stage(), tmp_path, "plain.csv"))
    size = float(np.median(np.abs(motion.commands)))
    words = {"dead_zone": f"width: {0.5 * size}", "saturation": f"limit: {1.5 * size}"}[kind]
    behind = system_of(stage(f"[{{kind: {kind}, on: w, parameters: {{{words}}}}}]"))
    assert drive_left(behind, motion) == pytest.approx([1.0])


def test_a_command_that_steps_through_a_dead_zone_has_the_mean_of_what_acts() -> None:
    """From −3 N to 2 N through ±1 N: −2 N and 1 N act, −0.5 N on average, for which the command is −1.5 N."""
    behind = system_of(stage("[{kind: dead_zone, on: w, parameters: {width: 1}}]"))
    commands = np.array([-3.0, -3.0, 2.0, 2.0, 0.5, 0.5])
    found = MeanInput(behind, 0).at(commands, 1e-3, np.zeros(0))
    assert found[1:5] == pytest.approx([-3.0, -1.5, 2.0, 1.5])


HEAVY = {
    "value: 2,": "value: 240,",
    "value: 6,": "value: 900,",
    "w: 900}": "w: 120000}",
    "w: 30}": "w: 9000}",
    "2e-6": "5e-6",
}


def cylinder(effects: str = "[]") -> Spec:
    """The stage with the mass, friction and drive of a slow hydraulic cylinder."""
    text = stage(effects, 330, "0.14*sin(2*pi*0.13*t) + 0.03*sin(2*pi*0.41*t)", 20).text
    for light, heavy in HEAVY.items():
        assert text.count(light) == 1
        text = text.replace(light, heavy)
    return parse_spec(text, Path("cylinder.yaml"))


def test_a_limit_far_below_the_commands_is_no_effect_of_a_slow_heavy_machine(tmp_path: Path) -> None:
    """Without forces it goes on at its speed: free runs of 0.2 s leave little, and the balance of forces nearly all."""
    lacking = "[{kind: coulomb_asymmetry, on: rail, parameters: {d: 90}}, "
    lacking += "{kind: position_dependent_friction, on: rail, parameters: {amplitude: 80, period: 0.16, phase: 0.7}}]"
    log = log_of(cylinder(lacking), tmp_path, "train.csv")
    problem = Problem(system_of(cylinder()), smooth_motion(log), {})
    search = search_on(problem, partial(record_of, problem.motion, log))
    base = search.refit()
    evidence = Evidence(1.0, 0.96, 3.0, 8, 8)  # of free runs of such a machine that moves from point to point
    nothing, less = "too little to move the machine", "of which a larger share stays unexplained"
    for kind, values, why in (
        ("saturation", {"limit": 151.0}, nothing),
        ("saturation", {"limit": 250.0}, less),
        ("offset", {"f0": -90.0}, ""),
    ):
        part = part_of(CATALOGUE[kind], 0, search.system)
        trial = base.trial.with_part(part)
        moved = replace(
            base, runner=replace(base.runner, trial=trial), theta=np.append(base.theta, part.inward(values))
        )
        words = only_reduces_drive(ForceCriterion(search, base), ForceCriterion(search, moved), evidence)
        assert why in words and bool(words) is bool(why)


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_a_slow_error_hides_no_difference_at_higher_frequencies(share: float) -> None:
    """Noise of 1 in a slow error of 30: prewhitened, a further error of 0.7 shows; half of it in each is no difference.

    The gain in nats is that of the likelihood with the true spectrum of the noise, to a tenth.
    """
    rng, phi, count = np.random.default_rng(3), 0.998, 6000
    noise = lfilter([1.0], [1.0, -phi], rng.standard_normal(count))[:, None]
    noise *= 30 / noise.std()
    white, further = rng.standard_normal((2, count, 1))
    right, other = noise + white + (share - 1) * 0.7 * further, noise + white + share * 0.7 * further
    motion: Any = SimpleNamespace(cutoff_hz=50.0, sample_time=0.01, step=lambda samples: 1)
    problem: Any = SimpleNamespace(motion=motion, used=np.ones((count, 1), dtype=bool))
    plain, found = force_gain(problem, other, right), prewhitened_gain(problem, other, right)
    assert plain.p_of_rivals() > 0.05 and prewhitened_gain(problem, right, other).p_of_rivals() > 0.05
    if share < 1:
        assert found.p_of_rivals() > 0.05
        return
    assert found.p_of_rivals() < 1e-4
    turn = np.exp(-1j * np.pi * np.arange(count) / count)
    step = 900 * (1 - phi**2)  # variance of the slow error's innovations
    spectrum = 1 + 0.35**2 + step / np.abs(1 - phi * turn) ** 2
    power = (dct(r[:, 0], norm="ortho") ** 2 for r in (other, right))
    before, after = (float((p / spectrum).sum()) for p in power)
    assert found.nats == pytest.approx(0.5 * count * np.log(before / after), rel=0.1)


@pytest.mark.skipif(not DATA.is_dir(), reason="../shared/data is not here")
@pytest.mark.parametrize("true", ["input_delay", "actuator_lag"])
def test_a_delay_of_a_real_drive_is_told_from_a_lag(true: str) -> None:
    """EMPS with 3 ms put in: below 20 Hz what both laws leave at reversals hid the difference, and they tied."""
    spec = read_spec(Path(__file__).resolve().parents[2] / "specs" / "emps.yaml")
    system, plain = build_system(spec), read_log(DATA / "emps" / "DATA_EMPS.mat", spec)
    h = plain.sample_time
    if true == "input_delay":
        log = acting_earlier(plain, {0: 0.003 / h})
    else:
        log = replace(plain, inputs=plain.inputs + 0.003 * np.gradient(low_pass(plain.inputs, 20.0, h), h, axis=0))
    motion = smooth_motion(log)
    search = search_on(Problem(system, motion, {}), lambda share: record_of(motion, log, share))
    fits = ForceFits(search, search.refit())

    def fitted(kind: str, name: str) -> ForceCriterion:
        trial = search.declared_trial.with_part(part_of(CATALOGUE[kind], 0, system))
        return ForceCriterion(search, fits.fit(trial, trial.theta(fits.adopted, [{name: 0.003}])))

    one, other = fitted("input_delay", "T"), fitted("actuator_lag", "tau")
    one, other = (one, other) if true == "input_delay" else (other, one)
    assert differ_in_time(one.fit, other.fit) and not differ_in_time(one.fit, one.fit)
    assert force_prefers(one, other) and not force_prefers(other, one)
    assert one.over_in_time(other).p_of_rivals() < 1e-4

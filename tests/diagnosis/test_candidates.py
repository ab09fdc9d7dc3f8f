"""What a log can show is what is tried on it, and of many segments as many as are needed."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.evidence.adoption import Refit
from codegen.diagnosis.evidence.coverage import survey
from codegen.diagnosis.fit.acceptance import FAR, LEAST_NET, is_negligible, misfit, near_noise, noise_ratio, share_far
from codegen.diagnosis.fit.output_error import Fit, polish
from codegen.diagnosis.fit.record import MOST_STEPS, PLENTY, Record, is_shortened, record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import Search, search_on
from codegen.diagnosis.fit.shooting import Shooter
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import Runner, Trial, part_of
from codegen.diagnosis.selection.candidate_fits import CandidateFits, every_part, fit_candidates, start_compiling
from codegen.diagnosis.verdict.admission import options_of
from codegen.effects import CATALOGUE
from codegen.logs import Log
from codegen.mechanics import build_system
from codegen.spec import parse_spec
from tests.diagnosis.stage import RESTS, log_of, stage, system_of

SPEC = """\
name: one
coordinates: {x: {velocity: v, unit: m}}
inputs: {w: {unit: N}}
parameters: {m: {value: 2, unit: kg}}
mass_matrix: [[m]]
force: [w]
friction: {distribution: [[1]], contacts: [{name: rail, law: coulomb, a: 1, unit: N}]}
"""


def search(
    speed: float,
    seconds: float = 12.0,
    cutoff_hz: float = 20.0,
    step: float = 0.002,
    lacking: float = 0.0,
    noise: float = 0.0,
) -> Search:
    """A mass that moves by 0.3 sin 4t about a constant speed, with noise, and an input that lacks some of the force."""
    t = np.arange(round(seconds / step)) * step
    x, w = 0.3 * np.sin(4 * t) + speed * t, -9.6 * np.sin(4 * t) + lacking * np.sin(9 * t)
    x = x + noise * np.random.default_rng(1).normal(size=len(t))
    log = Log(Path("a.csv"), "a", t, x[:, None], None, w[:, None], step, cutoff_hz, None, None, ())
    motion = smooth_motion(log)
    problem = Problem(build_system(parse_spec(SPEC, Path("one.yaml"))), motion, {})
    return search_on(problem, lambda share: record_of(motion, log, share))


@pytest.mark.parametrize(("speed", "both"), [(0.0, True), (0.5, True), (1.5, False), (-1.5, False)])
def test_friction_that_differs_by_direction_is_tried_where_the_log_has_both(speed: float, both: bool) -> None:
    kinds = {p.kind for p in every_part(search(speed), ())}
    assert ({"coulomb_asymmetry", "viscous_asymmetry"} <= kinds) == both
    assert both or not kinds & {"coulomb_asymmetry", "viscous_asymmetry"}
    assert {"offset", "viscous", "stribeck", "cogging"} <= kinds


def test_the_first_round_compiles_nothing_that_was_not_started_before_the_refit() -> None:
    one = search(0.0)
    start_compiling(one)
    started = dict(one.compiled)
    base = one.refit()
    one.runners([base.trial, *(base.trial.with_part(part) for part in every_part(one, base.trial.parts))])
    assert one.compiled == started


def test_segments_of_a_fast_motion_are_spread_over_the_log() -> None:
    fast, usual = (search(0.0, 120.0, cutoff).record for cutoff in (80.0, 20.0))
    assert len(fast.start) == max(PLENTY, MOST_STEPS // (fast.length * 8))  # 50 · 80 Hz · 2 ms = 8 steps a sample
    assert fast.start[0] < 1000 and fast.start[-1] > 58_000 and np.all(np.diff(fast.start) >= fast.length)
    assert len(usual.start) * usual.length * 2 <= MOST_STEPS
    whole = search(0.0, 24.0).record  # nothing is left out of an ordinary log
    assert len(whole.start) * whole.length > 0.9 * 11_000


def test_free_runs_of_a_very_dense_log_take_several_rows_a_step() -> None:
    """At 10 kHz a segment of 0.25 s has 2500 rows: steps of 1 ms, 50 in a period of the cutoff, are near enough."""
    rows, h = 100_000, 1e-4
    t = h * np.arange(rows)
    x, v = 0.05 * np.sin(7 * t) + 0.01 * np.sin(31 * t), 0.35 * np.cos(7 * t) + 0.31 * np.cos(31 * t)
    a = -2.45 * np.sin(7 * t) - 9.61 * np.sin(31 * t)
    u = 2.0 * a + 4.0 * np.sign(v) + 3.0 * np.sin(400 * t)
    columns = [one[:, None] for one in (x, x, v, u)]
    start = np.arange(1000, 90_000, 2600, dtype=np.int32)
    whole = Record(*columns, h, np.ones(1), start, 2500, resumed=(40_001,))
    thin = whole.thinned(5)
    assert (thin.every, thin.length, thin.resumed) == (5, 500, (8001,)) and thin.sample_time == pytest.approx(5e-4)
    assert np.array_equal(thin.measured, whole.measured[::5]) and np.array_equal(thin.start * 5, whole.start)
    assert thin.commands[7, 0] == pytest.approx(whole.commands[35:40, 0].mean())
    assert np.array_equal(thin.noise, whole.noise)
    assert replace(whole, integrated=(True,)).thinned(4).noise == pytest.approx(2 * whole.noise)  # of four steps
    system = system_of(stage())
    trial = Trial(system, (), ())
    full, few = (
        Runner(trial, Shooter([system], [()]), 0, record, 1).run(np.zeros(0), record.at_rest)
        for record in (whole, thin)
    )
    moved = full[:, ::5] - full[:, :1]
    assert np.sqrt(np.mean((few - full[:, ::5]) ** 2)) < 1e-3 * np.sqrt(np.mean(moved**2))


@pytest.mark.parametrize(("step", "coarse"), [(0.0005, (0.002, 1)), (0.002, (0.002, 1)), (0.004, (0.004, 2))])
def test_far_from_the_data_few_segments_take_steps_of_25_in_a_period(step: float, coarse: tuple[float, int]) -> None:
    """In place of 50 or, at 2 kHz, 100; runs differ by little of what the base leaves. Near the data they are usual."""
    one, near = (search(0.0, step=step, lacking=lacking, noise=1e-4) for lacking in (2.0, 0.0))
    base, exact = one.refit(), near.refit()
    assert noise_ratio(base) > FAR > noise_ratio(exact)
    few, kept = (
        CandidateFits(s, fit, tuple(every_part(s, ())[:1])).base_on_few[None] for s, fit in ((one, base), (near, exact))
    )
    runner = few.runner
    assert (runner.record.sample_time, runner.substeps) == (pytest.approx(coarse[0]), coarse[1])
    rows = runner.record.every
    segments = replace(one.record, start=runner.record.start * rows, length=runner.record.length * rows)
    usual = replace(runner, record=segments, substeps=one.substeps)
    runs = [r.run(few.theta, r.record.at_rest) for r in (runner, usual)]
    left = runs[0] - runner.record.targets
    assert np.sqrt(np.mean((runs[0] - runs[1][:, ::rows]) ** 2)) < 0.02 * np.sqrt(np.mean(left**2))
    assert (kept.runner.record.sample_time, kept.runner.substeps) == (near.record.sample_time, near.substeps)


@pytest.mark.parametrize(("rate", "seconds", "every"), [(10_000, 12.0, 2), (1000, 120.0, 1), (2000, 12.0, 1)])
def test_only_a_long_log_with_many_rows_in_a_period_is_thinned(rate: int, seconds: float, every: int) -> None:
    """12 s at 10 kHz are 120,000 steps; 120 s at 1 kHz as well, but with 50 in a period of the cutoff of 20 Hz."""
    t = np.arange(round(rate * seconds)) / rate
    x = 0.05 * np.sin(7 * t) + 0.01 * np.sin(31 * t)
    log = Log(Path("a.csv"), "a", t, x[:, None], None, np.sin(7 * t)[:, None], 1 / rate, 20.0, None, None, ())
    motion = smooth_motion(log)
    made = record_of(motion, log)
    assert not is_shortened(made, motion)
    assert made.every == every and made.sample_time == pytest.approx(every / rate)
    assert len(made.start) * made.length <= MOST_STEPS * every


def test_the_values_adopted_without_an_effect_are_tried_with_it_too() -> None:
    system = build_system(parse_spec(SPEC, Path("one.yaml")))
    (symbol,) = search(0.0).refitted_symbols
    name = symbol.name
    one, two, three = (np.array([value]) for value in (1.0, 1.1, 1.3))
    refit = Refit((name,), one, two, one, two, (), ())
    options = options_of(system, refit, {name: float(three[0])})
    assert [float(model.values[symbol]) for _, model in options] == [1.1, 1.3, 1.0]
    assert [float(model.values[symbol]) for _, model in options_of(system, refit)] == [1.1, 1.0]


def test_values_that_are_the_declared_ones_are_called_so() -> None:
    """Of a refit whose levels stayed it was written `refitted friction levels alone`."""
    system = system_of(stage())
    names, declared, moved = ("rail_a", "m"), np.array([4.0, 2.0]), np.array([4.0, 2.2])
    refit = Refit(names, declared, moved, np.zeros(2), declared, (), ())
    assert [name for name, _ in options_of(system, refit)] == ["refitted values", "declared values"]


@pytest.mark.parametrize("level", [16.0, 25.0])
def test_a_soft_contact_is_found_although_the_refit_has_a_third_of_its_level(level: float, tmp_path: Path) -> None:
    """Presliding over the whole stroke is a hysteresis that a set-valued law follows with a low level."""
    lacking = "[{kind: presliding, on: rail, parameters: {sigma: 30}}]"
    log = log_of(stage(lacking, level=level, noise=1e-3), tmp_path, "soft.csv")
    problem = Problem(system_of(stage()), smooth_motion(log), {})
    one = search_on(problem, partial(record_of, problem.motion, log))
    base = one.refit()
    assert base.theta[0] < level / 3
    part = part_of(CATALOGUE["presliding"], 0, one.system)
    (found,) = fit_candidates(one, base, [part])
    assert found.parameters["sigma"] == pytest.approx(30, rel=0.01)
    assert found.theta[0] == pytest.approx(level, rel=0.01)


PULSE = "0.2*sin(2*pi*0.4*t) + 0.25*exp(-((t - 20)/0.15)**2)"
"""One quick move in 40 s asks for 46 N, the rest for 10 N."""


@pytest.mark.parametrize(("limit", "rare"), [(60, False), (30, True)])
def test_an_effect_that_acts_once_starts_from_the_force_residual(limit: float, rare: bool, tmp_path: Path) -> None:
    """A base that is at the noise but for one move was taken for one that leaves nothing to start from."""
    lacking = f"[{{kind: saturation, on: w, parameters: {{limit: {limit}}}}}]"
    log = log_of(stage(lacking, reference=PULSE, duration=40.0, noise=1e-4), tmp_path, f"pulse{limit}.csv")
    problem = Problem(system_of(stage()), smooth_motion(log), {})
    one = search_on(problem, partial(record_of, problem.motion, log))
    base = one.refit()
    assert near_noise(base) and bool(share_far(base)) is rare
    assert not (rare and is_negligible(base))
    part = part_of(CATALOGUE["saturation"], 0, one.system)
    tried = CandidateFits(one, base, (part,))
    tried.promising([0])
    assert bool(tried.starts_by_force) is rare
    if rare:
        start = part.outward(tried.starts_by_force[0][-1][-1:])
        assert start["limit"] == pytest.approx(limit, rel=0.02)


@pytest.mark.parametrize("k", [0.02, 0.4])
def test_what_is_left_is_negligible_below_the_least_force_of_an_effect(k: float, tmp_path: Path) -> None:
    """Of a spring that the spec lacks, the force over that of the drive, which m a + b v + a sgn v takes on its way."""
    log = log_of(stage(f"[{{kind: spring, on: x, parameters: {{k: {k}}}}}]"), tmp_path, f"spring{k}.csv")
    t = np.arange(0.0, 14.0, 0.002)
    slow, fast = 2 * np.pi * 0.4, 2 * np.pi * 1.1
    x = 0.2 * np.sin(slow * t) + 0.06 * np.sin(fast * t)
    v = 0.2 * slow * np.cos(slow * t) + 0.06 * fast * np.cos(fast * t)
    a = -0.2 * slow**2 * np.sin(slow * t) - 0.06 * fast**2 * np.sin(fast * t)
    share = k * np.sqrt(np.mean(x**2) / np.mean((2 * a + 6 * v + 4 * np.sign(v)) ** 2))
    problem = Problem(system_of(stage()), smooth_motion(log), {})
    base = search_on(problem, partial(record_of, problem.motion, log)).refit()
    assert is_negligible(base) == (share < LEAST_NET)
    assert misfit(base) == pytest.approx(share, rel=0.5)


def test_periods_are_sought_in_what_the_effects_found_leave(tmp_path: Path) -> None:
    """Beside a spring, the periods of a cogging were those of the residual without the spring."""
    both = "[{kind: spring, on: x, parameters: {k: 300}}, "
    both += "{kind: cogging, on: x, parameters: {amplitude: 0.8, period: 0.083, phase: 1}}]"
    log = log_of(stage(both), tmp_path, "train.csv")
    motion = smooth_motion(log)
    found = search_on(Problem(system_of(stage()), motion, {}), lambda share: record_of(motion, log, share))
    spring, cogging = (part_of(CATALOGUE[kind], 0, found.system) for kind in ("spring", "cogging"))
    base = found.refit()
    base = found.with_parts(base, base.values[0], [spring], [{"k": 300.0}])
    tried = CandidateFits(found, base, (cogging,))
    periods = tried.covered(cogging).periods()
    within = 0.25 / np.ptp(motion.positions)  # a quarter of what the span resolves
    assert min(abs(1 / p - 1 / 0.083) for p in periods) < within, periods


def test_periods_are_sought_where_the_axis_moves(tmp_path: Path) -> None:
    """Moves with rests: static friction balances any force at rest, so the residual there says nothing of position."""
    spec = stage("[{kind: cogging, on: x, parameters: {amplitude: 0.5, period: 0.041, phase: 1}}]", reference=RESTS)
    motion = smooth_motion(log_of(spec, tmp_path, "train.csv"))
    part = part_of(CATALOGUE["cogging"], 0, system_of(stage()))
    found = survey(system_of(stage()), motion).covered(part, [4.0], motion.measured.std(axis=0)).periods()
    assert found[0] == pytest.approx(0.041, rel=0.02), found


def test_a_period_longer_than_each_move_is_sought(tmp_path: Path) -> None:
    """Moves of 42 mm with rests between, three of which make a period: a rest within it hides nothing of it."""
    spec = stage(
        "[{kind: cogging, on: x, parameters: {amplitude: 1.5, period: 0.13, phase: 1}}]",
        reference="0.03*t - 0.03*1.4/(2*pi)*sin(2*pi/1.4*t)",
    )
    motion = smooth_motion(log_of(spec, tmp_path, "train.csv"))
    part = part_of(CATALOGUE["cogging"], 0, system_of(stage()))
    found = survey(system_of(stage()), motion).covered(part, [4.0], motion.measured.std(axis=0)).periods()
    assert found[0] == pytest.approx(0.13, rel=0.05), found


def test_a_fit_whose_slopes_are_not_read_is_the_same_with_fewer_free_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lacking = "[{kind: stribeck, on: rail, parameters: {delta: 2.0, v_s: 0.05}}]"
    log = log_of(stage(lacking), tmp_path, "stribeck.csv")
    problem = Problem(system_of(stage()), smooth_motion(log), {})
    search = search_on(problem, partial(record_of, problem.motion, log))
    base = search.refit()
    part = part_of(CATALOGUE["stribeck"], 0, search.system)
    (runner,) = search.runners([base.trial.with_part(part)])
    theta = np.append(base.theta, part.inward({"delta": 0.5, "v_s": 0.2}))
    _ = base.raw_slopes
    counted = []
    several = Runner.several
    monkeypatch.setattr(Runner, "several", lambda one, *given: counted.extend(given[0]) or several(one, *given))

    def fitted(rounds: int, final_slopes: bool) -> tuple[Fit, int]:
        counted.clear()
        fit = search.fit_from(runner, theta, base, rounds, final_slopes=final_slopes)
        fit = polish(fit, rounds, search.prior(fit.trial, fit.theta, fit.prior.tempering), final_slopes)
        return fit, len(counted)

    for rounds in (1, 3):
        (plain, often), (quick, seldom) = fitted(rounds, True), fitted(rounds, False)
        assert np.array_equal(plain.theta, quick.theta) and plain.cost == quick.cost
        assert np.array_equal(plain.offsets, quick.offsets) and np.array_equal(plain.limited, quick.limited)
        own, all_of_them = (
            len(part.names),
            len(theta),
        )  # of the first fit, which knows the base's slopes, and the second
        assert often - seldom in (own, all_of_them, own + all_of_them)


@pytest.mark.slow
def test_a_dead_zone_beside_a_weight_that_takes_most_of_it_has_its_width(tmp_path: Path) -> None:
    """A weight takes most of a dead zone while the input keeps its sign, and goes back once that is in the model."""
    text = stage("[{kind: dead_zone, on: w, parameters: {width: 6}}]").text
    text = (
        text.replace("2e-6", "1e-5")
        .replace("[w - b*v]", "[k*w - b*v - G]")
        .replace("value: 2, unit: kg", "value: 2, unit: kg, tolerance: 5%")
    )
    more = "  G: {value: 12, unit: N, tolerance: 10%}\n  k: {value: 1, unit: 1, tolerance: 3%}\n"
    plant = parse_spec(text.replace("  b: {", f"{more}  b: {{"), Path("lift.yaml"))
    log = log_of(plant, tmp_path, "log.csv")
    spec = parse_spec(plant.text.replace("[{kind: dead_zone, on: w, parameters: {width: 6}}]", "[]"), Path("lift.yaml"))
    diagnosis, _ = diagnose_log(spec, system_of(spec), log)
    (found,) = diagnosis.effects
    assert found.kind == "dead_zone" and found.parameters["width"] == pytest.approx(6.0, rel=0.01)

"""What speaks against an effect, what is said with it, and which values are no estimates."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest

from codegen.diagnosis.diagnose import Models, diagnose_log
from codegen.diagnosis.evidence.estimate import Estimate, named_effects
from codegen.diagnosis.evidence.reservations import determined_form, may_be_absent, objections, remarks
from codegen.diagnosis.fit.output_error import Fit, at_limit
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.results import Diagnosis, FoundEffect
from codegen.diagnosis.verdict import examination
from codegen.diagnosis.verdict.examination import _objections
from codegen.effects import CATALOGUE
from codegen.logs import Log
from codegen.report.page import render_report
from tests.diagnosis.stage import among, log_of, stage, system_of
from tests.diagnosis.test_adoption import search_of

UNITS = {
    "amplitude": "N",
    "period": "m",
    "phase": "rad",
    "k": "N/m",
    "delta": "N",
    "v_s": "m/s",
    "T": "s",
    "gain": "1",
    "tau": "s",
    "tau_each": "s",
}
SURE = {"amplitude": (1.4, 1.6), "k": (17.0, 19.0), "delta": (1.9, 2.1), "gain": (1.05, 1.15)}


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    """14 s between −0.258 and 0.258 m, at most 0.8 m/s."""
    return log_of(stage("[{kind: spring, on: x, parameters: {k: 18}}]"), tmp_path_factory.mktemp("log"), "train.csv")


def said(log: Log, kind: str, **values: float) -> tuple[list[str], list[str]]:
    system = system_of(stage())
    on = {"contact": "rail", "input": "w"}.get(CATALOGUE[kind].sits_on, "x")
    intervals = {name: SURE[name] for name in values if name in SURE}
    found = FoundEffect(kind, on, values, {name: UNITS[name] for name in values}, (), intervals)
    problem = Problem(system, smooth_motion(log), {})
    part = part_of(CATALOGUE[kind].with_parameters(list(values)), 0, system)
    return objections(found, part, problem), remarks(found, part, problem)


def test_a_rough_loss_gives_values_without_intervals(log: Log) -> None:
    """Impacts shift by a sample with a small change of a gap: slopes gave 0.01 % about values 160 % off."""
    system = system_of(stage())
    gap, spring = (part_of(CATALOGUE[kind], 0, system) for kind in ("backlash", "spring"))
    values = [{p.name: (1.0, (0.9, 1.1)) for p in part.effect.parameters} for part in (gap, spring)]
    rough, smooth = named_effects([gap, spring], Estimate({}, tuple(values)), system)
    assert rough.intervals == {} and smooth.intervals == {"k": (0.9, 1.1)}
    problem = Problem(system, smooth_motion(log), {})
    assert len([words for words in remarks(rough, gap, problem) if "have no interval" in words]) == 1
    assert remarks(smooth, spring, problem) == []


@pytest.mark.parametrize(("least", "refused"), [(2e-3, True), (2e-2, False)])
def test_a_speed_whose_interval_reaches_below_those_of_the_log_is_refused(
    log: Log, least: float, refused: bool
) -> None:
    """Viscous friction that saturates at a hundredth of the top speed of 0.8 m/s is a friction level."""
    part = part_of(CATALOGUE["viscous"].with_parameters(["b", "v_s"]), 0, system_of(stage()))
    intervals = {"b": (10.0, 90.0), "v_s": (least, 0.09)}
    values, units = {"b": 50.0, "v_s": 0.03}, {"b": "N*s/m", "v_s": "m/s"}
    found = FoundEffect("viscous", "rail", values, units, (), intervals)
    words = objections(found, part, Problem(system_of(stage()), smooth_motion(log), {}))
    assert bool(words) is refused and all("is a level on this log" in one for one in words)


@pytest.mark.parametrize(("speed", "refused"), [(0.2, False), (0.7, True)])
def test_a_rise_by_direction_that_is_a_line_on_the_log_is_not_accepted(log: Log, speed: float, refused: bool) -> None:
    """In a round it is no candidate; beside a wrong inertia, found later, a real drive got one above its top speed."""
    values = {"delta": 15.0, "v_s": speed, "d_delta": 6.0}
    part = part_of(CATALOGUE["stribeck"].with_parameters(list(values)), 0, system_of(stage()))
    intervals = {"delta": (0.3, 29.0), "v_s": (0.9 * speed, 1.1 * speed), "d_delta": (3.8, 8.1)}
    found = FoundEffect("stribeck", "rail", values, {"delta": "N", "v_s": "m/s", "d_delta": "N"}, (), intervals)
    words = objections(found, part, Problem(system_of(stage()), smooth_motion(log), {}))
    assert bool(words) is refused and all("is a level or a line" in one for one in words)


def test_a_period_longer_than_the_stroke_is_not_accepted(log: Log) -> None:
    stroke = np.ptp(log.positions[500:-500])  # without the second at each end that is not used
    for times, accepted in ((0.9, True), (1.03, True), (1.1, False), (1.78, False)):
        for kind in ("cogging", "position_dependent_friction", "encoder_eccentricity"):
            against, remarked = said(log, kind, amplitude=1.5, period=times * stroke, phase=0.3)
            assert (against == []) == accepted, kind
            assert any("of the period of" in words for words in remarked) == (accepted and times > 1)
    assert "nothing shows that it repeats" in against[0] and f"covers only {stroke:.3g} m" in against[0]


def test_a_weight_that_is_seen_over_less_than_a_turn_is_named_with_the_range_of_the_log(log: Log) -> None:
    """A hose on an arm's joint that moved by 1.6 rad was named gravity_imbalance, without a word on its range."""
    system = replace(system_of(stage()), position_units=("rad",))
    part = part_of(CATALOGUE["gravity_imbalance"], 0, system)
    units = {"G": "N*m", "phase": "rad"}
    found = FoundEffect("gravity_imbalance", "x", {"G": 8.7, "phase": 2.1}, units, (), {"G": (7.8, 9.6)})
    problem = Problem(system, smooth_motion(log), {})
    stroke = np.ptp(log.positions[500:-500])
    assert objections(found, part, problem) == []
    assert remarks(found, part, problem) == [
        f"The log covers only {stroke:.3g} of 6.28 rad of the period of gravity_imbalance on x"
    ]


@pytest.mark.parametrize(
    ("kind", "name", "values"), [("spring", "k", {"k": 18.0}), ("input_gain", "gain", {"gain": 1.1})]
)
def test_an_interval_that_holds_the_neutral_value_speaks_against_an_effect(
    kind: str, name: str, values: dict[str, float], log: Log, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert said(log, kind, **values) == ([], [])
    monkeypatch.setitem(SURE, name, (-0.14, 1.80))
    (words,), _ = said(log, kind, **values)
    assert "-0.14 to 1.8" in words and "absent" in words


@pytest.mark.parametrize(("ends", "refused"), [((0.0, 1.9e130), True), ((62.6, 2.0e7), True), ((300.0, 9e3), False)])
def test_a_spring_whose_stiffness_the_log_does_not_determine_is_refused(
    log: Log, ends: tuple[float, float], refused: bool
) -> None:
    """A belt gantry with presliding and a filtered current was said to have a load behind a spring of 0.008 N/m."""
    values = {"k": 0.008, "c": 3.8e3, "load_fraction": 0.36}
    units = {"k": "N/m", "c": "N*s/m", "load_fraction": "1"}
    intervals = {"k": ends, "c": (1e2, 1.4e5), "load_fraction": (0.03, 0.91)}
    part = part_of(CATALOGUE["compliance"], 0, system_of(stage()))
    found = FoundEffect("compliance", "x", values, units, (), intervals)
    words = objections(found, part, Problem(system_of(stage()), smooth_motion(log), {}))
    assert bool(words) is refused and all("of k (" in one and "does not determine compliance" in one for one in words)


@pytest.mark.parametrize(("ends", "refused"), [((0.2, 2.1e5), True), ((2e4, 5e4), False)])
def test_a_bristle_whose_stiffness_the_log_does_not_determine_is_refused(
    log: Log, ends: tuple[float, float], refused: bool
) -> None:
    """Stribeck friction added to the log of a real motor was called presliding, with a stiffness of 0.2 to 2.1e5."""
    part = part_of(CATALOGUE["presliding"], 0, system_of(stage()))
    found = FoundEffect("presliding", part.on, {"sigma": 3e4}, {"sigma": "N/m"}, (), {"sigma": ends})
    words = objections(found, part, Problem(system_of(stage()), smooth_motion(log), {}))
    assert bool(words) is refused and all("does not determine presliding" in one for one in words)


@pytest.mark.parametrize(("ends", "refused"), [((2e-4, 0.091), True), ((-0.091, -2e-4), True), ((0.004, 0.091), False)])
def test_a_size_that_the_log_does_not_determine_is_refused(
    log: Log, ends: tuple[float, float], refused: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One of six logs of a double pendulum gave its elbow an inertia error of 0.0002 to 0.091 kg·m²."""
    monkeypatch.setitem(UNITS, "delta", "kg")
    monkeypatch.setitem(SURE, "delta", ends)
    words, _ = said(log, "inertia_error", delta=0.004)
    assert bool(words) is refused and all("does not determine inertia_error" in one for one in words)


@pytest.mark.parametrize(("both", "refused"), [((2e-4, 0.091), True), ((0.0, 0.02), True), ((0.002, 0.02), False)])
def test_free_runs_and_force_residual_must_agree_on_the_size(
    log: Log, both: tuple[float, float], refused: bool
) -> None:
    """Free runs gave the inertia error of the elbow a narrow interval; that of both criteria is the one printed."""
    part = part_of(CATALOGUE["inertia_error"], 0, system_of(stage()))
    own = FoundEffect("inertia_error", "x", {"delta": 0.004}, {"delta": "kg"}, (), {"delta": (0.003, 0.005)})
    problem = Problem(system_of(stage()), smooth_motion(log), {})
    words = _objections(own, replace(own, intervals={"delta": both}), part, problem, problem.system)
    assert bool(words) is refused


def test_a_gain_is_as_wide_as_its_distance_from_1(log: Log, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SURE, "gain", (1.01, 1.4))
    assert "does not determine input_gain" in said(log, "input_gain", gain=1.1)[0][0]
    monkeypatch.setitem(SURE, "gain", (0.02, 0.9))
    assert said(log, "input_gain", gain=0.7)[0] == []


def test_one_determined_size_of_an_effect_is_enough(log: Log, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SURE, "d_delta", (0.001, 2.0))
    monkeypatch.setitem(UNITS, "d_delta", "N")
    assert said(log, "stribeck", delta=2.0, v_s=0.05, d_delta=0.5)[0] == []


@pytest.mark.parametrize(("share", "refused"), [(0.02, False), (0.08, False), (0.13, True), (0.5, True)])
def test_a_force_that_yields_over_much_of_the_stroke_is_no_presliding(log: Log, share: float, refused: bool) -> None:
    """A gas spring with heat exchange was called presliding, its a/sigma of 0.13 m 17 % of the stroke."""
    declared, level = system_of(stage()), 9.0
    fitted = declared.with_parameters(dict.fromkeys(declared.contacts[0].law_parameters.values(), level), {})
    part, motion = part_of(CATALOGUE["presliding"], 0, declared), smooth_motion(log)
    sigma = level / (share * float(np.ptp(motion.positions[motion.usable])))
    found = FoundEffect("presliding", part.on, {"sigma": sigma}, {"sigma": "N/m"}, (), {"sigma": (0.9 * sigma, sigma)})
    words = objections(found, part, Problem(declared, motion, {}), fitted)
    assert bool(words) is refused and all("of the stroke" in one for one in words)
    of_a_wide_interval = replace(found, intervals={"sigma": (0.9 * sigma, 9 * sigma)})
    assert not objections(of_a_wide_interval, part, Problem(declared, motion, {}), fitted), "it may be stiff"


def test_a_shape_beyond_what_the_log_covers_is_said(log: Log) -> None:
    assert said(log, "stribeck", delta=2.0, v_s=0.05) == ([], [])
    against, (words,) = said(log, "stribeck", delta=2.0, v_s=5.0)
    assert against == [] and "v_s = 5 m/s" in words and "beyond what the log covers" in words
    assert said(log, "friction_drift", delta=2.0, T=4.0) == ([], [])
    assert "T = 40 s" in said(log, "friction_drift", delta=2.0, T=40.0)[1][0]


def test_a_value_at_the_end_of_its_reach_is_marked(log: Log) -> None:
    """A period may move by a factor exp(0.2) from where its fit starts; the start is far from any wave."""
    search = search_of(stage(), log)
    base = search.refit()
    part = part_of(CATALOGUE["cogging"], 0, search.system)
    start = {"amplitude": 2.0, "period": 0.3, "phase": 0.0}
    raw = search.with_parts(base, base.theta, [part], [start])
    first = replace(raw, theta=np.append(base.theta, part.inward(start)))
    trial = first.runner.trial
    reach = search.prior(trial, first.theta).reach
    place = len(trial.refitted_symbols) + part.names.index("period")
    fitted = search.fit_from(first.runner, first.theta, base, 10, [])
    moved = abs(fitted.theta[place] - first.theta[place])
    assert (at_limit(fitted) == [("period",)]) == bool(moved >= 0.999 * reach[place])
    held = replace(fitted, limited=np.arange(len(fitted.theta)) == place)
    assert at_limit(held) == [("period",)]
    assert at_limit(replace(held, limited=np.zeros(len(fitted.theta), dtype=bool))) == [()]


def test_a_value_at_a_bound_is_marked(log: Log) -> None:
    search = search_of(stage(), log)
    base = search.refit()
    part = part_of(CATALOGUE["compliance"], 0, search.system)
    for fraction, marks in ((0.5, ()), (0.9999, ("load_fraction",)), (1e-4, ("load_fraction",))):
        values = {"k": 8000.0, "c": 20.0, "load_fraction": fraction}
        trial = search.declared_trial.with_part(part)
        theta = trial.theta(base.theta, [values])
        fit = replace(
            base, runner=replace(base.runner, trial=trial), theta=theta, limited=np.zeros(len(theta), dtype=bool)
        )
        assert at_limit(fit) == [marks]


@pytest.fixture(scope="module")
def marked(log: Log) -> tuple[Diagnosis, Models]:
    """The log's diagnosis, in which the first parameter of each effect is said to be at its limit."""

    def first(fit: Fit) -> list[tuple[str, ...]]:
        return [(part.names[0],) for part in fit.runner.trial.parts]

    of_position = ("spring", "cogging", "position_dependent_friction", "encoder_eccentricity")
    with patch.object(examination, "at_limit", first), among(*of_position):
        return diagnose_log(stage(), system_of(stage()), log)


def test_a_limit_is_told_in_sentence_json_and_table(marked: tuple[Diagnosis, Models]) -> None:
    diagnosis, models = marked
    assert diagnosis.effects[0].at_limit == ("k",)
    assert "N/m (at its limit, no estimate)" in diagnosis.statement.of("values")[0]
    assert diagnosis.as_json()["effects"][0]["at_limit"] == ["k"]
    assert '<span class="limit">at its limit</span>' in render_report(stage(), diagnosis, models)


def test_no_candidate_is_accepted_with_a_period_that_was_never_passed(
    log: Log, marked: tuple[Diagnosis, Models]
) -> None:
    """A piece of a long wave fits a spring's line: it would come first, be refused, and hide the spring."""
    diagnosis, _ = marked
    stroke = np.ptp(log.positions[500:-500])
    long = [c for c in diagnosis.candidates if c.parameters.get("period", 0.0) > stroke]
    assert long and not any(c.accepted for c in long)
    assert [e.kind for e in diagnosis.effects] == ["spring"]


@pytest.mark.parametrize(
    ("kind", "values", "by"),
    [
        ("input_delay", {"T": 0.004}, "4 ms"),
        ("actuator_lag", {"tau": 0.003}, "3 ms"),
        ("actuator_lag", {"tau_each": 0.002}, "4 ms"),
    ],
)
def test_an_input_that_acts_late_looks_like_a_motion_that_is_logged_late(
    log: Log, kind: str, values: dict[str, float], by: str
) -> None:
    (words,) = said(log, kind, **values)[1]
    assert f"as if x were logged {by} late" in words and f"`late: {{x: {by}}}` in meta.yaml" in words


@pytest.mark.parametrize(
    ("load", "absent"), [((2.2e-5, 0.99998), True), ((0.53, 0.75), False), ((0.011, 0.014), False)]
)
def test_a_load_of_any_size_may_be_none(load: tuple[float, float], absent: bool) -> None:
    """A spring of 6e-6 to 1e4 N·m/rad with a load of nothing to all of the inertia was named beside presliding."""
    found = may_be_absent(CATALOGUE["compliance"], {"k": (5.7e-6, 1.1e4), "c": (4e-6, 7.8e3), "load_fraction": load})
    assert found == (["load_fraction"] if absent else [])


@pytest.mark.parametrize(
    ("kind", "intervals", "names"),
    [
        ("stribeck", {"delta": (0.54, 0.57), "v_s": (0.18, 0.21), "d_delta": (-0.017, 0.007)}, ["delta", "v_s"]),
        ("stribeck", {"delta": (0.54, 0.57), "v_s": (0.18, 0.21), "d_delta": (0.002, 0.007)}, None),
        ("stribeck", {"delta": (-0.01, 0.57), "v_s": (0.18, 0.21)}, None),
        ("stribeck", {"delta": (0.54, 0.57), "v_s": (0.18, 0.21), "exponent": (1.5, 2.5)}, ["delta", "v_s"]),
        ("stribeck", {"delta": (0.54, 0.57), "v_s": (0.18, 0.21), "exponent": (1.5, 1.9)}, None),
        ("viscous", {"b": (2.0, 3.0), "v_s": (0.1, 0.2), "b_inf": (-0.1, 0.1)}, ["b", "v_s"]),
        ("viscous", {"b": (2.0, 3.0), "v_s": (0.1, 0.2)}, None),
        ("viscous", {"b": (-0.3, 3.0), "v_s": (0.1, 0.2)}, None),
        ("viscous", {"b": (-0.3, 3.0)}, None),
        ("viscous", {"b": (-0.3, 4.7), "v_s": (0.003, 15.8), "b_inf": (0.3, 1.7)}, ["b"]),
        (
            "position_dependent_friction",
            {"amplitude": (1, 2), "period": (1, 2), "phase": (0, 1), "amplitude_2": (0.0, 0.2), "phase_2": (-3, 3)},
            ["amplitude", "period", "phase"],
        ),
        (
            "cogging_harmonics",
            {"period": (1, 2), "sin_1": (1, 2), "cos_1": (-1, 1), "sin_8": (-0.1, 0.2), "cos_8": (-0.1, 0.3)},
            ["period", "sin_1", "cos_1"],
        ),
        ("cogging_harmonics", {"period": (1, 2), "sin_1": (1, 2), "cos_1": (-1, 1), "sin_8": (0.1, 0.2)}, None),
        ("cogging_harmonics", {"period": (1, 2), "sin_1": (-1, 2), "cos_1": (-1, 1)}, None),
    ],
)
def test_a_parameter_whose_interval_holds_zero_or_its_default_is_not_named(
    kind: str, intervals: dict[str, tuple[float, float]], names: list[str] | None
) -> None:
    """A Stribeck curve of a robot's joint was named with a d_delta of -0.005 (-0.017 to 0.007); truth has none.

    A gimbal's viscous friction was refused since v_s of its curve was not determined, though only the line is needed.
    Of a stepper's cogging orders 8 and 12 were named, with zero in the intervals of their sines and cosines.
    """
    part = part_of(CATALOGUE[kind].with_parameters(list(intervals)), 0, system_of(stage()))
    form = determined_form(part, intervals)
    assert (form and [p.name for p in form.parameters]) == names


@pytest.mark.parametrize(
    ("kind", "values", "stale", "refused"),
    [
        ("input_delay", {"T": 0.006}, 0.75, True),
        ("input_delay", {"T": 0.009}, 0.75, False),  # later than the readings are held
        ("input_delay", {"T": 0.003}, 0.4, False),
        ("actuator_lag", {"tau": 0.006}, 0.75, True),
        ("spring", {"k": 50.0}, 0.75, False),
    ],
)
def test_readings_that_are_held_look_like_a_delay(
    log: Log, kind: str, values: dict[str, float], stale: float, refused: bool
) -> None:
    """A log of a bus that is slower than its rows: each reading in four rows of 2 ms was a delay of the input."""
    held = replace(log, raw_data=replace(log.raw_data, stale=stale))
    motion = smooth_motion(held)
    assert motion.held == pytest.approx(log.sample_time / (1 - stale) if stale >= 0.5 else 0.0)
    part = part_of(CATALOGUE[kind], 0, system_of(stage()))
    found = FoundEffect(kind, part.on, values, dict.fromkeys(values, "s"), (), {})
    words = objections(found, part, Problem(system_of(stage()), motion, {}))
    assert bool(words) is refused and all("repeats each reading for 8 ms" in one for one in words)

"""Scoring of the practice logs: the exact interval of a rate, what is declared, and what PySINDy's terms stand for."""

from __future__ import annotations

import importlib.util
import json
from math import pi
from pathlib import Path
from typing import Any

import pytest
from scipy.stats import binom

from benchmarks.practice.cases import Case
from benchmarks.practice.declared import candidates, clopper_pearson, row, tally, with_truth
from benchmarks.practice.peer import Reading, Term, is_right, kinds_of, readings, table, totals
from benchmarks.practice.runs import Run, diagnosed, result_in, times, typical
from benchmarks.practice.score import coverage, right, within
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.results import ProposedTerms
from codegen.diagnosis.verdict.proposal import propose_terms
from codegen.spec import parse_spec
from tests.diagnosis.stage import TEST, TRAIN, log_of, stage, system_of
from tests.slow_cases import slow_except

needs_pysindy = pytest.mark.skipif(importlib.util.find_spec("pysindy") is None, reason="the extra sindy is not here")

DRAG = {"kind": "quadratic_drag", "on": "x", "parameters": {"c": 25.0}}
OFFSET = {"kind": "offset", "on": "x", "parameters": {"f0": -0.2}}
ASYMMETRY = {"kind": "coulomb_asymmetry", "on": "rail"}


def case(folder: Path, *effects: dict[str, Any], twins: tuple[dict[str, Any], ...] = ()) -> Case:
    """A case with this truth."""
    folder.mkdir()
    group = ("none", "single", "double")[len(effects)]
    truth = {"group": group, "effects": effects, "equivalents": [twins] * len(effects)}
    (folder / "truth.json").write_text(json.dumps(truth))
    return Case("standard", folder)


@pytest.mark.parametrize(("hits", "trials"), [(0, 65), (1, 77), (9, 31), (12, 12)])
def test_at_the_ends_of_the_exact_interval_the_tails_are_a_fortieth(hits: int, trials: int) -> None:
    low, high = clopper_pearson(hits, trials)
    assert low == 0 if hits == 0 else binom.sf(hits - 1, trials, low) == pytest.approx(0.025)
    assert high == 1 if hits == trials else binom.cdf(hits, trials, high) == pytest.approx(0.025)


def test_false_alarms_are_effects_and_nothing_else(tmp_path: Path) -> None:
    known = case(tmp_path / "case_0001", DRAG)
    results = [
        {"verdict": "effect", "effects": [{"kind": "spring"}], "candidates": [{"kind": "offset"}]},
        {"verdict": "unknown", "effects": [], "candidates": [{"kind": "a"}, {"kind": "b"}, {"kind": "c"}]},
        {"verdict": "none", "effects": [], "candidates": [{"kind": "looked at and refused"}]},
        {"verdict": "unfit", "effects": [], "candidates": []},
    ]
    rows = [row(known, result) for result in results]
    assert [r["named"] for r in rows] == [["spring"], ["a", "b"], [], []]
    found = tally(rows)
    assert found["logs"] == 4
    assert found["alarms"] == (0.25, *clopper_pearson(1, 4))
    assert found["not_none"] == (0.75, *clopper_pearson(3, 4))
    assert dict(found["verdicts"]) == {"effect": 1, "ambiguous": 0, "unknown": 1, "none": 1, "unfit": 1, "refused": 0}


def test_the_truth_is_declared_as_it_stands_and_nothing_else_changes() -> None:
    text = stage().text.replace("effects: [] # what diagnosis adds\n", "")
    pair = {"kind": "cogging", "on": "x", "parameters": {"amplitude": 1e-05, "period": 2e-3, "phase": -1.5}}
    spec = parse_spec(with_truth(text, [DRAG, {**pair, "remark": "no"}]), Path("stage.yaml"))
    assert [(e.kind, list(e.on)) for e in spec.effects] == [("quadratic_drag", ["x"]), ("cogging", ["x"])]
    assert {k: float(v) for k, v in spec.effects[1].parameters.items()} == pair["parameters"]
    assert spec.contacts == stage().contacts
    assert system_of(spec).force[0].has(system_of(spec).positions[0])


def test_only_effects_in_the_form_of_the_catalogue_are_declared(tmp_path: Path) -> None:
    plain, odd = case(tmp_path / "a", DRAG), case(tmp_path / "b", {**DRAG, "form": {"POWER": 1.7}})
    none, two = case(tmp_path / "c"), case(tmp_path / "d", DRAG, OFFSET)
    assert candidates([plain, odd, none, two]) == [plain, two]


@pytest.mark.parametrize("verdict", ["effect", "unknown", "ambiguous", "unfit", "no result"])
def test_where_nothing_is_missing_only_none_is_right(verdict: str) -> None:
    scored = {"group": "none", "false_alarm": verdict == "effect"}
    assert right({**scored, "verdict": "none"})
    assert not right({**scored, "verdict": verdict})


def test_a_phase_may_be_off_by_turns_and_an_interval_open() -> None:
    assert within(3.1, -3.3, -3.1, turns=True) and not within(3.1, -3.3, -3.1)
    assert not within(3.1 + pi, -3.3, -3.1, turns=True)
    assert within(5, None, 6) and within(5, 4, None) and not within(5, None, 4)


def test_values_without_an_interval_are_not_counted(tmp_path: Path) -> None:
    """A backlash has none: its loss is not smooth."""
    play = {"kind": "backlash", "on": "x", "parameters": {"gap": 1e-3, "k": 5e3}}
    cases = [case(tmp_path / "case_0001", DRAG), case(tmp_path / "case_0002", play)]
    for one, effect, intervals in ((cases[0], DRAG, {"c": [26.0, 30.0]}), (cases[1], play, {})):
        folder = tmp_path / "out" / one.name
        folder.mkdir(parents=True)
        said = {"verdict": "effect", "effects": [{**effect, "intervals": intervals}]}
        (folder / "diagnosis.json").write_text(json.dumps(said))
    assert coverage(tmp_path / "out", cases) == (0, 1)


def test_a_parameter_that_the_truth_has_not_is_outside(tmp_path: Path) -> None:
    """Another form of the effect was found, such as a Stribeck curve with an exponent."""
    one = case(tmp_path / "case_0001", DRAG)
    (tmp_path / "out" / one.name).mkdir(parents=True)
    low, high = 0.9 * DRAG["parameters"]["c"], 1.1 * DRAG["parameters"]["c"]
    said = {"verdict": "effect", "effects": [{**DRAG, "intervals": {"c": [low, high], "bend": [0.1, 2.0]}}]}
    (tmp_path / "out" / one.name / "diagnosis.json").write_text(json.dumps(said))
    assert coverage(tmp_path / "out", [one]) == (1, 2)


def test_times_are_of_logs_as_they_are() -> None:
    runs = [Run(f"c{n}", wall, 2 * wall, n, "", "") for n, wall in ((6000, 4.0), (24000, 9.0), (48000, 30.0))]
    failed = Run("bad", 99.0, 99.0, 0, "refused", "")
    assert [run.case for run in typical([*runs, failed])] == ["c24000"]
    found = times([*runs, failed])
    assert found is not None
    assert (found.logs, found.samples, found.wall[0], found.wall[2], found.cpu[2]) == (3, (6000, 48000), 9, 30, 60)
    assert found.wall[1] == pytest.approx(9 + 0.8 * 21)
    assert times([failed]) is None


@pytest.mark.slow
def test_a_run_without_result_says_why_and_is_kept(tmp_path: Path) -> None:
    (tmp_path / "stage.yaml").write_text(stage().text)
    asked = ("case_0001", tmp_path, tmp_path / "stage.yaml", tmp_path / "out")
    run = diagnosed(*asked)
    assert run.failure.startswith("exit code 2: ") and "train.csv" in run.failure
    assert (run.samples, run.wall_s > run.cpu_s / 2 > 0, result_in(tmp_path / "out")["verdict"]) == (0, True, "refused")
    (tmp_path / "stage.yaml").unlink()
    assert diagnosed(*asked) == run
    assert diagnosed(*asked, again=True).failure != run.failure


def problems(folder: Path, effects: str) -> list[Problem]:
    """Logs of a stage with effects, as the stage without them sees them; its level is right."""
    spec = stage()
    logs = [log_of(stage(effects, reference=r), folder, f"{k}.csv") for k, r in enumerate((TRAIN, TEST))]
    return [Problem(system_of(spec), smooth_motion(log), {}) for log in logs]


HELD = [
    ("viscous", "rail", "b", 3, ("viscous",)),
    ("quadratic_drag", "x", "c", 25, ("quadratic_drag",)),
    ("spring", "x", "k", 30, ("spring",)),
    ("hardening_spring", "x", "k3", 900, ("hardening_spring",)),
    ("offset", "x", "f0", 1, ("offset", "coulomb_asymmetry")),
    ("viscous_asymmetry", "rail", "d_b", 3, ("viscous_asymmetry",)),
]


@needs_pysindy
@pytest.mark.parametrize(("kind", "on", "name", "value", "kinds"), slow_except(HELD, [HELD[0], HELD[4]], several=True))
def test_pysindy_names_what_its_library_holds(
    tmp_path: Path, kind: str, on: str, name: str, value: float, kinds: tuple[str, ...]
) -> None:
    train, test = problems(tmp_path, f"[{{kind: {kind}, on: {on}, parameters: {{{name}: {value}}}}}]")
    sums = propose_terms(train.system, train, test, slice(0, len(test.motion.time)))
    alone, _ = readings(train.system, train, sums)
    assert alone.kinds == kinds


@needs_pysindy
def test_pysindy_names_nothing_where_nothing_is_missing(tmp_path: Path) -> None:
    train, test = problems(tmp_path, "[]")
    sums = propose_terms(train.system, train, test, slice(0, len(test.motion.time)))
    assert readings(train.system, train, sums) == (Reading(), Reading())


def test_terms_that_cancel_and_levels_do_not_hide_the_one_that_explains(tmp_path: Path) -> None:
    train, _ = problems(tmp_path, "[{kind: spring, on: x, parameters: {k: 30}}]")
    # Of the 30 N/m a sum of three that nearly cancel; the level is larger than all.
    terms = {"x": 30.0, "x**3": 2e4, "v**3": 40.0, "sgn(v)": 50.0}
    alone, largest = readings(train.system, train, [ProposedTerms("x", "N", terms, 0.9)])
    assert (alone.kinds, alone.term) == (("spring",), "x on x")
    assert (largest.kinds, largest.term) == (("hardening_spring",), "x**3 on x")
    assert alone.size == pytest.approx(train_share(train, 30.0), rel=0.05)
    for share in (0.04, float("nan")):
        assert readings(train.system, train, [ProposedTerms("x", "N", terms, share)])[0] == Reading()


def train_share(train: Problem, stiffness: float) -> float:
    """A spring's force over the drive force, from the logged input and the motion alone."""
    used = train.motion.usable
    force, drive = stiffness * train.motion.positions[used, 0], train.motion.inputs[used, 0]
    return float((force @ force / (drive @ drive)) ** 0.5)


def test_what_a_velocity_stands_for_on_two_coordinates() -> None:
    own, other = Term("{}", "velocity", 0), Term("{}", "velocity", 1)
    assert kinds_of(own, 0, {own: 2.0}) == ("viscous",)
    assert kinds_of(own, 0, {own: 2.0, other: 0.4}) == ("viscous",)
    assert kinds_of(own, 0, {own: 2.0, other: -0.9}) == ("viscous",)
    assert kinds_of(own, 0, {own: 2.0, other: -1.9}) == ("coupling",)
    assert kinds_of(other, 0, {other: 2.0}) == ("coupling",)
    assert kinds_of(Term("{}", "position", 1), 0, {}) == ()
    assert kinds_of(Term("{}**3", "velocity", 0), 0, {}) == ()


def test_a_twin_is_right_and_a_term_is_wrong_where_nothing_is_missing(tmp_path: Path) -> None:
    twin = case(tmp_path / "a", OFFSET, twins=(ASYMMETRY,))
    none = case(tmp_path / "b")
    asymmetry, nameless = Reading(("coulomb_asymmetry",), "1 on x", 0.1), Reading((), "x**2 on x", 0.1)
    assert is_right(twin, asymmetry) and not is_right(twin, nameless) and not is_right(twin, Reading())
    assert is_right(none, Reading()) and not is_right(none, nameless)
    answers = [(twin, asymmetry, True), (twin, nameless, True), (none, nameless, None)]
    assert totals(answers, "single") == (2, 1, 2)
    assert totals(answers, "none") == (1, 0, None)
    assert [(r["kind"], r["cases"], r["peer"], r["ours"]) for r in table(answers)] == [
        ("none", 1, 0, None),
        ("offset", 2, 1, 2),
    ]

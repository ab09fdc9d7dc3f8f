"""A measured input that is late behind a filter, where a drift of friction hides that before effects are sought."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from codegen.diagnosis import case as case_module
from codegen.diagnosis import diagnose, free_runs
from codegen.diagnosis.case import Case, Findings, case_of
from codegen.diagnosis.evidence import timing
from codegen.diagnosis.evidence.timing import open_inputs
from codegen.diagnosis.fit.acceptance import evidence_of, most_explained
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.record import Record, record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import Search, search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.selection.candidate_fits import every_part
from codegen.diagnosis.selection.forward_selection import Outcome, Progress, find_effects, within_reach
from codegen.diagnosis.verdict import late_inputs
from codegen.diagnosis.verdict.late_inputs import corrected_for_leads, late_is_better
from codegen.logs import Log
from codegen.logs.description import LogDescription
from tests.diagnosis.stage import among, log_of, stage, system_of
from tests.diagnosis.test_adoption import shaken
from tests.diagnosis.test_input_timing import EVERY, every, measured

DRIFT = "{kind: friction_drift, on: rail, parameters: {delta: 6.0, T: 5.0}}"
LAG = 0.006
KINDS = "friction_drift", "compliance"
DRIFTING, DAMPED = {"delta": 6.0, "T": 5.0}, {"k": 2000.0, "c": 200.0, "load_fraction": 0.6}


def logged(effects: str, folder: Path, lag: float) -> Log:
    """A stage with these effects, its input measured behind a low-pass, every fourth sample."""
    return measured(log_of(stage(f"[{effects}]"), folder, "train.csv"), lag)


def fitted(log: Log, found: dict[str, dict[str, float]]) -> tuple[Case, Search, Fit]:
    """The case of a log, and the fit with these effects from these values."""
    spec = stage()
    case = case_of(spec, system_of(spec), log, None, 0.02)
    search, base = within_reach(search_on(case.problem, lambda share: record_of(case.problem.motion, case.log, share)))
    parts = [next(p for p in every_part(search, []) if p.kind == kind) for kind in found]
    return case, search, search.with_parts(base, base.values[0], parts, list(found.values()))


@pytest.mark.parametrize("lag", [LAG, 0.024])  # the second is longer than what is corrected before effects are sought
def test_a_damped_compliance_that_corrects_a_late_input_gives_way_to_its_lead(tmp_path: Path, lag: float) -> None:
    """In slow motion the force balance showed none of a motor's current, 5 rows late, and presliding was named."""
    log = logged(DRIFT, tmp_path, lag)
    case, search, final = fitted(log, {"friction_drift": DRIFTING, "compliance": DAMPED})
    assert not case.leads  # the drift hides it
    corrected = corrected_for_leads(case, search, final)
    assert corrected is not None
    # The mean of four samples is centred half a row before the row.
    lead = 0.5 + lag / (EVERY * 0.002)
    assert corrected.leads[0] == pytest.approx(lead, abs=0.3)
    (found,) = (f for f in corrected.findings["train"] if f.topic == "timing of w")
    assert "With it compliance on x is not needed" in found.words and "`late: {w: 0}`" in found.words
    acting = every(log_of(stage(f"[{DRIFT}]"), tmp_path, "train.csv"), means=True).inputs
    before, after = (abs(one.inputs - acting)[20:-20].mean() for one in (case.log, corrected.log))
    assert after < 0.5 * before and "So it is taken" in found.words
    np.testing.assert_array_equal(corrected.motion.positions, case.motion.positions)
    assert corrected.window == case.window and corrected.problem.used.shape == case.problem.used.shape


def test_where_held_commands_are_stated_nothing_is_corrected(tmp_path: Path) -> None:
    log = replace(logged(DRIFT, tmp_path, LAG), description=LogDescription(input_hold="zero-order"))
    assert corrected_for_leads(*fitted(log, {"friction_drift": DRIFTING, "compliance": DAMPED})) is None


def test_beside_an_effect_that_hid_it_free_runs_tell_how_late_an_input_is(tmp_path: Path) -> None:
    """A cogging with its current 2 to 3 rows late was `unknown`: the lead was asked beside loads behind springs only.

    The force balance gave 1.5 rows with 0.5 of deviation before the cogging was found, and 2.1 ± 0.1 beside it.
    """
    log = logged(DRIFT, tmp_path, LAG)
    case, search, final = fitted(log, {"friction_drift": DRIFTING})
    corrected = corrected_for_leads(case, search, final)
    assert corrected is not None and not case.leads
    # The mean of four samples is centred half a row before the row.
    assert corrected.leads[0] == pytest.approx(0.5 + LAG / (EVERY * 0.002), abs=0.15)
    (told,) = (f for f in corrected.findings["train"] if f.topic == "timing of w")
    assert "So it is taken" in told.words and told.severity == "warning"


@pytest.mark.parametrize("effects", ["", DRIFT, "{kind: offset, on: x, parameters: {f0: 0.8}}"])
def test_where_no_input_is_late_free_runs_tell_none(tmp_path: Path, effects: str) -> None:
    """Also where the model lacks an effect, which a lead resembles in part."""
    log = replace(log_of(stage(f"[{effects}]"), tmp_path, "train.csv"), description=LogDescription())
    assert corrected_for_leads(*fitted(log, {})) is None


@pytest.mark.parametrize(("damping", "lag"), [(40.0, 0.0), (4.0, LAG)])
def test_a_load_behind_a_spring_does_not_give_way(tmp_path: Path, damping: float, lag: float) -> None:
    """Without the damped one the input seems to lead by 1.3 rows, and free runs are worse with that.

    Free runs with the load then tell how late the input is, and the load is sought again with that.
    """
    load = {"k": 900.0, "c": damping, "load_fraction": 0.5}
    text = ", ".join(f"{name}: {value}" for name, value in load.items())
    log = logged(f"{DRIFT}, {{kind: compliance, on: x, parameters: {{{text}}}}}", tmp_path, lag)
    corrected = corrected_for_leads(*fitted(log, {"friction_drift": DRIFTING, "compliance": load}))
    assert corrected is not None and corrected.leads[0] == pytest.approx(0.5 + lag / (EVERY * 0.002), abs=0.15)
    assert not any("not needed" in f.words for f in corrected.findings["train"])


@pytest.mark.parametrize("shown", [True, False])
def test_a_lead_that_free_runs_do_not_show_is_not_corrected_far_from_the_noise(tmp_path: Path, shown: bool) -> None:
    """With dead zone and viscous friction missing in a real motor, a lead of 3.0 ± 0.7 rows hid both.

    Here a force that no model has keeps free runs at 60 times the noise. The lead is true.
    """
    log = shaken(logged(DRIFT, tmp_path, LAG), 1, 0.2)
    case, search, final = fitted(log, {"friction_drift": DRIFTING, "compliance": DAMPED})
    with patch.object(late_inputs, "late_is_better", lambda *_: shown):
        corrected = late_inputs._in_place_of_states(case, search, final)
    assert (corrected is not None) is shown
    if corrected is not None:
        assert corrected.leads[0] == pytest.approx(0.5 + LAG / (EVERY * 0.002), abs=0.3)


def short(folder: Path, means: bool) -> Log:
    """4 s of a stage, every fourth sample: its command at the row, or the mean of the four, which is a held one."""
    log = log_of(stage(), folder, "train.csv")
    rows = slice(300, 2340)
    return every(replace(log, time=log.time[rows], positions=log.positions[rows], inputs=log.inputs[rows]), means)


@pytest.mark.parametrize("found", [{}, {"viscous": {"b": 0.5}}])
@pytest.mark.parametrize("means", [False, True])
def test_where_the_force_balance_of_a_short_log_tells_no_lead_free_runs_do(
    tmp_path: Path, means: bool, found: dict[str, dict[str, float]]
) -> None:
    """Of 6 s of a motor's measured torque at 100 Hz the balance gave 0.26 ± 0.15 rows, and nothing was corrected.

    Refitted with held torques, inertia and damping then left 12 % of the drive force, in place of 6.4 %.
    """
    case, search, final = fitted(short(tmp_path, means), found)
    assert not case.leads
    corrected = corrected_for_leads(case, search, final)
    if means:
        assert corrected is None
        return
    assert corrected is not None and corrected.leads == {0: 0.5}
    (told,) = (f for f in corrected.findings["train"] if f.topic == "timing of w")
    assert "treated as a measurement" in told.words


def test_where_held_commands_are_stated_free_runs_are_not_asked(tmp_path: Path) -> None:
    log = replace(short(tmp_path, False), description=LogDescription(input_hold="zero-order"))
    assert corrected_for_leads(*fitted(log, {})) is None


@pytest.mark.parametrize("lag", [0.024, 0.0])
def test_where_a_nameless_force_hides_how_late_an_input_is_free_runs_tell(tmp_path: Path, lag: float) -> None:
    """A gimbal's torque was 2.1 ± 0.24 rows late by the force, which explained 27 %; nothing was corrected or said.

    Its free runs were 2.6 times as far from held-out data.
    """
    log = replace(shaken(logged("", tmp_path, lag), 1, 0.3), description=LogDescription())
    case, search, base = fitted(log, {})
    assert not case.leads
    corrected = corrected_for_leads(case, search, base)
    if not lag:
        assert corrected is None or corrected.leads == {0: 0.5}
        return
    # Its mean of four samples is centred half a row before the row, and read as half a row later.
    assert corrected is not None and corrected.leads[0] == pytest.approx(lag / (EVERY * 0.002) + 0.5, abs=0.3)


@pytest.mark.parametrize(
    ("hold", "late", "inputs"), [("", {}, [0]), ("linear", {}, [0]), ("zero-order", {}, []), ("", {"w": 0.0}, [])]
)
def test_inputs_whose_time_is_stated_are_not_taken_earlier(
    tmp_path: Path, hold: str, late: dict[str, float], inputs: list[int]
) -> None:
    log = replace(logged("", tmp_path, LAG), description=LogDescription(input_hold=hold, late=late))
    assert open_inputs(system_of(stage()), log) == inputs


@pytest.mark.parametrize(
    ("share", "t", "gained", "better"),
    [(0.5, 3.0, 11.0, True), (0.49, 3.0, 11.0, False), (0.5, 1.0, 11.0, False), (0.5, 3.0, 9.0, False)],
)
def test_a_lead_must_be_shown_as_an_effect_is(share: float, t: float, gained: float, better: bool) -> None:
    """On a motor without the weight of its arm, a lead that it had not gained 20 nats and 59 % of the sum of squares.

    That was in few segments: of the mean over segments it explained 28 %, with t = 1.0.
    """
    first, late = SimpleNamespace(residual=np.ones((3, 8))), SimpleNamespace(residual=np.zeros((3, 8)))
    about: dict[str, Any] = {"evidence_of": lambda *_: SimpleNamespace(share=share, t=t)}
    about |= {"independent_share": lambda fit: 0.5, "segment_cost": lambda residual: 2 * gained * float(residual[0, 0])}
    with patch.multiple(late_inputs, **about):
        assert late_is_better(late, first) is better  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("hold", "parts", "rows", "explained", "taken"),
    [
        ("", (), 0.5, 0.0, True),
        ("", (), 1.0, 0.0, False),
        ("linear", (), 0.5, 0.0, False),
        ("", ("viscous",), 0.5, 0.0, False),
        ("linear", ("viscous",), 3.0, 0.5, True),
    ],
)
def test_half_a_row_needs_no_more_than_nats_only_where_it_is_open_and_nothing_is_found(
    hold: str, parts: tuple[str, ...], rows: float, explained: float, taken: bool
) -> None:
    case: Any = SimpleNamespace(log=SimpleNamespace(description=LogDescription(input_hold=hold)))
    final: Any = SimpleNamespace(trial=SimpleNamespace(parts=parts))
    about: dict[str, Any] = {"_nearest": lambda *_: {0: timing.Lead(rows, explained=explained)}}
    about |= {"most_explained": lambda _: 0.9, "_taken_earlier": lambda *_: case}
    with patch.multiple(late_inputs, **about):
        found = late_inputs._by_free_runs(case, None, final)  # type: ignore[arg-type]
    assert (found is case) is taken


@pytest.mark.parametrize(("faults", "steady"), [(True, False), (False, True)])
def test_no_lead_is_selected_on_a_faulty_log_or_at_constant_speed(faults: bool, steady: bool) -> None:
    none: Any = None
    case: Any = SimpleNamespace(faults=faults, steady=steady)
    assert late_inputs._nearest(case, none, none) == {}


def test_beside_effects_that_leave_the_noise_no_lead_is_selected(tmp_path: Path) -> None:
    """It cost 18 % of the time of a log that was not late."""
    log = replace(log_of(stage(f"[{DRIFT}]"), tmp_path, "train.csv"), description=LogDescription())
    case, search, final = fitted(log, {"friction_drift": DRIFTING})
    with patch.object(late_inputs, "_nearest", side_effect=AssertionError):
        assert corrected_for_leads(case, search, final) is None
    # No fit removes a larger share than this bound.
    base = search.without(final, 0)
    assert evidence_of(final, final).share == 0 and evidence_of(base, final).share <= most_explained(base)
    with patch.object(late_inputs, "_with_earlier_inputs", wraps=late_inputs._with_earlier_inputs) as tried:
        assert late_inputs._nearest(case, search, final) == {}
    assert [call.args[2][0].rows for call in tried.call_args_list] == [0.5]


def test_a_lead_below_the_least_one_is_none(tmp_path: Path) -> None:
    """Free runs that are nearest without a lead reduce none: a delay or lag that is found beside it does."""
    log = replace(log_of(stage(), tmp_path, "train.csv"), description=LogDescription())
    with patch.object(case_module, "input_leads", lambda problem, log: ({0: 1.0}, ())):
        case, search, final = fitted(log, {})
    assert case.leads == {0: 1.0} and late_inputs._nearest(case, search, final) == {}
    with patch.object(late_inputs, "LEAST_LEAD", 0.0):
        assert late_inputs._nearest(case, search, final)[0].rows < 0.25


@pytest.mark.parametrize(("loads", "gives_way"), [(1, False), (2, True)])
def test_each_effect_with_states_must_gain_ten_nats_over_the_lead(loads: int, gives_way: bool) -> None:
    """Free runs with the effects gain 15 nats over those with the lead."""
    final: Any = SimpleNamespace(trial=SimpleNamespace(parts=[SimpleNamespace(title="load")] * loads))
    search: Any = SimpleNamespace(without=lambda fit, k: fit)
    case: Any = SimpleNamespace()
    about: dict[str, Any] = {"_nearest": lambda *_: {0: timing.Lead(1.0)}, "_adds_states": lambda *_: True}
    about |= {"_with_earlier_inputs": lambda *_: search, "is_far": lambda _: False, "_gained": lambda *_: -15.0}
    about |= {"_taken_earlier": lambda *_: case}
    with patch.multiple(late_inputs, **about):
        assert (late_inputs._in_place_of_states(case, search, final) is case) is gives_way


@pytest.mark.parametrize(("present", "first", "found"), [(3.0, [2.0, 4.0], {}), (2.9, [2.0, 3.0, 4.0], {0: 3.0})])
def test_a_lead_is_selected_from_the_present_one(present: float, first: list[float], found: dict[int, float]) -> None:
    """The input leads by 3 rows, and the present fit counts as tried where it has one of the leads that are tried."""
    tried = list[float]()

    def at(case: Any, search: Any, leads: dict[int, timing.Lead]) -> Any:
        tried.append(leads[0].rows)
        return SimpleNamespace(fitted_again=lambda fit: SimpleNamespace(residual=leads[0].rows))

    case: Any = SimpleNamespace(faults=False, steady=False, leads={0: present}, log=None)
    case.problem = SimpleNamespace(system=None)
    fit: Any = SimpleNamespace(residual=present)
    about: dict[str, Any] = {"open_inputs": lambda *_: [0], "_with_earlier_inputs": at}
    about |= {"segment_cost": lambda rows: 1e4 * (rows - 3.0) ** 2, "independent_share": lambda _: 1.0}
    about |= {"late_is_better": lambda *_: False}
    none: Any = None
    with patch.multiple(late_inputs, **about):
        nearest = late_inputs._nearest(case, none, fit)
    assert tried[: len(first)] == first
    assert {k: lead.rows for k, lead in nearest.items()} == pytest.approx(found, abs=0.05)


LOADED = "{kind: compliance, on: x, parameters: {k: 2000, c: 20, load_fraction: 0.5}}"


@pytest.mark.parametrize("lag", [LAG, 2 * LAG])
def test_the_lead_of_a_machine_with_a_load_behind_a_spring_is_that_of_its_input(tmp_path: Path, lag: float) -> None:
    """The load looked in part like a lead: a belt's 1.25 rows were found as 1.63, a turntable's 0.5 as 1.57.

    With the input taken too early, the compliance explained too little of the free runs to be named.
    """
    log = replace(logged(LOADED, tmp_path, lag), description=LogDescription(input_hold="linear"))
    with patch.object(case_module, "input_leads", lambda problem, log: ({}, ())):
        case = case_of(stage(), system_of(stage()), log, None, 0.02)
    # The mean of four samples is centred half a row before the row.
    assert timing.lead_of(case.problem, 0).estimate == pytest.approx(0.5 + lag / (EVERY * 0.002), abs=0.15)


def test_no_resonance_is_selected_beside_a_lead_that_is_not_significant(tmp_path: Path) -> None:
    log = shaken(log_of(stage(f"[{LOADED}]"), tmp_path, "train.csv"), 1, 0.3)
    with patch.object(timing, "resonances", side_effect=AssertionError):
        lead = timing.lead_of(Problem(system_of(stage()), smooth_motion(log), {}), 0)
    assert lead.deviation < 1 and lead.deviations_from(0.0) <= timing.SURE


def test_the_lead_by_every_second_row_of_a_long_log_is_that_by_all(tmp_path: Path) -> None:
    """Its two regressions and the resonance took 2 s for 200,000 rows, up to four times for each input."""
    log = shaken(log_of(stage(f"[{LOADED}]"), tmp_path, "train.csv"), 1, 0.3)
    log = replace(log, inputs=np.vstack([log.inputs[:1]] * 2 + [log.inputs[:-2]]))
    found = []
    for most in (10**6, 2000):
        with patch.object(timing, "MOST_ROWS", most):
            found.append(timing.lead_of(Problem(system_of(stage()), smooth_motion(log), {}), 0))
    every, second = found
    assert second != every and second.estimate == pytest.approx(every.estimate, abs=every.deviation / 5)
    assert second.deviation == pytest.approx(every.deviation, rel=0.1)


def test_the_effects_are_selected_again_with_the_input_taken_earlier(tmp_path: Path) -> None:
    """The first search is given the compliance that logs of a filtered current led to; the second one is as it is."""
    spec, told, outcomes = stage(), list[Findings](), list[Outcome]()

    def sought(search: Search, base: Fit, progress: Progress, faults: bool, *_: object) -> Outcome:
        outcomes.append(find_effects(search, base, progress, faults))
        if len(outcomes) == 1:
            parts = [next(p for p in every_part(search, []) if p.kind == kind) for kind in KINDS]
            final = search.with_parts(base, base.values[0], parts, [DRIFTING, DAMPED])
            outcomes[0] = replace(outcomes[0], final=final)
        return outcomes[-1]

    log = logged(DRIFT, tmp_path, LAG)
    with among(*KINDS), patch.object(free_runs, "find_effects", sought):
        diagnosis, _ = diagnose.diagnose_log(spec, system_of(spec), log, on_findings=told.append)
    assert diagnosis.verdict == "effect" and [e.kind for e in diagnosis.effects] == ["friction_drift"]
    first, second = told
    assert not any("w acts" in words for words in first["train"])
    assert len(second["train"]) == 1 and "With it compliance on x is not needed" in second["train"][0]
    assert second["train"][0] in diagnosis.findings["train"]


@pytest.mark.parametrize(
    ("rigid", "may_be_late", "accepted", "freed", "final", "asked"),
    [
        (True, True, ["first", "late", "third"], ["late"], "late", ["first", "late", "late"]),
        (False, True, ["load", "late", "third"], ["late"], "late", ["late", "late"]),
        (False, True, ["load", "two loads"], ["late load"], "late load", ["two loads"]),  # without limits only
        (
            False,
            True,
            ["late load"],
            ["1", "late load", "3"],
            "late load",
            ["late load", "1", "late load", "late load"],
        ),
        (False, True, ["late load"], ["one", "two"], "two", ["late load", "one", "two", "two"]),
        (False, False, ["late"], ["one", "late", "three"], "three", []),
    ],
)
def test_nothing_is_searched_twice_where_an_input_is_late(
    rigid: bool,
    may_be_late: bool,
    accepted: list[str],
    freed: list[str],
    final: str,
    asked: list[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Presliding on the second of six joints was a late input, and four more joints were searched before it was asked.

    A load behind a spring of a machine that is simulated as a whole is judged with all effects. If the answer is
    yes, a search without limits of parameters ends with the first fit that gives way too; if none does, it counts as
    without a late input.
    """
    found = list[Any]()
    search: Any = SimpleNamespace(rigid=() if rigid else None)
    free: Any = SimpleNamespace(rigid=None)

    def find(search: Any, base: Any, progress: Any, faults: bool, is_superseded: Any) -> Any:
        fits = freed if search is free else accepted
        return SimpleNamespace(final=next((one for one in fits if is_superseded(one)), fits[-1]), parts=())

    def corrected(case: Any, search: Any, final: Any) -> Any:
        found.append(final)
        return case if "late" in final else None

    monkeypatch.setattr(free_runs, "find_effects", find)
    monkeypatch.setattr(free_runs, "corrected_for_leads", corrected)
    monkeypatch.setattr(free_runs, "adds_states", lambda final: "load" in final)
    monkeypatch.setattr(free_runs.wrong_values, "released", lambda *_: (free, None))
    monkeypatch.setattr(free_runs.wrong_values, "is_better", lambda *_: True)
    case: Any = SimpleNamespace(faults=False, steady=False)
    base: Any = None
    own, outcome, _ = free_runs._selected(search, base, lambda turn, share: None, case, may_be_late)
    assert outcome.final == final and found == asked
    assert (own is search) == (rigid or all("late" in one for one in (asked or [""])[:: max(1, len(asked) - 1)]))


@pytest.mark.parametrize(("rows", "left"), [(0.5, 0.0), (1.0, 0.0), (2.0, None)])
def test_a_delay_that_cancels_a_lead_gives_way_to_a_smaller_one(
    tmp_path: Path, rows: float, left: float | None
) -> None:
    """Held commands that were taken earlier need a delay of as much; a longer delay is that of the machine."""
    effects = "[]" if left is not None else "[{kind: input_delay, on: w, parameters: {T: 0.002}}]"
    lead = rows if left is not None else 1.0
    log = log_of(stage(effects), tmp_path, "train.csv")
    with patch.object(case_module, "input_leads", lambda problem, log: ({0: lead}, ())):
        case, search, final = fitted(log, {"input_delay": {"T": rows * log.sample_time}})
    (values,) = final.values[1]
    assert values["T"] == pytest.approx(rows * log.sample_time, rel=0.05)
    corrected = corrected_for_leads(case, search, final)
    assert (corrected is None) == (left is None)
    if corrected is not None:
        assert corrected.leads[0] == left
        (found,) = (f for f in corrected.findings["train"] if f.topic == "timing of w")
        assert "no effect of the machine" in found.words and "taken as a command that is held" in found.words
        held = log.inputs[10:-10]
        assert np.abs(corrected.log.inputs[10:-10] - held).max() < 0.05 * np.abs(held).max()


def test_a_lead_that_was_estimated_too_large_names_no_delay(tmp_path: Path) -> None:
    """The offset was named with a delay that cancels the lead of half a row, which a short log seemed to have."""
    log = log_of(stage("[{kind: offset, on: x, parameters: {f0: 0.8}}]"), tmp_path, "train.csv")
    too_early = patch.object(case_module, "input_leads", lambda problem, log: ({0: 0.5}, ()))
    with too_early, among("offset", "input_delay", "actuator_lag", "viscous"):
        found = diagnose.diagnose_log(stage(), system_of(stage()), log)[0]
    assert found.verdict == "effect" and [e.kind for e in found.effects] == ["offset"], found.sentence


def test_an_input_is_taken_earlier_by_rows_of_the_log_where_free_runs_take_several_a_step() -> None:
    """Four rows of the log are two of a record of every second row."""
    t = 1e-3 * np.arange(4000)
    columns = [np.sin(7 * t + k)[:, None] for k in range(4)]
    record = Record(*columns, 1e-3, np.ones(1), np.arange(200, 3000, 300, dtype=np.int32), 200)
    none: Any = None
    lead: Any = SimpleNamespace(rows=4.0)
    case: Any = SimpleNamespace(leads={})
    made = [
        late_inputs._with_earlier_inputs(case, Search(none, one, none), {0: lead}).record.commands
        for one in (record, record.thinned(2))
    ]
    inner = slice(100, -100)
    assert np.allclose(made[1][inner], record.with_inputs(made[0]).thinned(2).commands[inner], atol=1e-3)
    assert not np.allclose(made[1][inner], record.thinned(2).commands[inner], atol=1e-2)

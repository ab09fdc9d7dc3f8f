"""What a diagnosis makes of a spike, judged beside that of the log as it is."""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.rates import Rate
from benchmarks.real.spiked import Readable, RealSet, real_sets
from benchmarks.spikes import runs
from benchmarks.spikes.__main__ import codes_of, page, rates
from benchmarks.spikes.outcome import (
    DETECTED,
    EXTRA,
    PLAIN,
    TAKEN,
    WITH,
    WITHOUT,
    WRONG,
    Outcome,
    Spike,
    outcome_of,
    spike_of,
    totals,
)
from benchmarks.spikes.rows import Part, Row, merged, parts_in, text_of
from benchmarks.spikes.runs import SPIKE, _make, kinds_for
from tests.benchmarks.diagnoses import diagnosis, effect

COGGING = Spike("cogging", "amplitude", 10.0, frozenset({"cogging"}), own=1.0)
NOTHING = diagnosis("none")
WEAR = effect("viscous_asymmetry", "rail", d_b=-31.0)
WORN = diagnosis("effect", WEAR)


def wave(amplitude: float) -> dict[str, Any]:
    return effect("cogging", amplitude=amplitude)


@pytest.mark.parametrize(
    ("plain", "spiked", "expected"),
    [
        (NOTHING, diagnosis("effect", wave(11.0)), DETECTED),
        (WORN, diagnosis("effect", WEAR, wave(11.0)), DETECTED),
        (WORN, diagnosis("effect", wave(11.0)), DETECTED),
        (NOTHING, diagnosis("effect", effect("cogging_harmonics", a1=11.0)), DETECTED),
        (NOTHING, diagnosis("effect", wave(11.0), effect("spring", k=1.0)), EXTRA),
        (NOTHING, diagnosis("effect", effect("spring", k=1.0)), WRONG),
        (WORN, diagnosis("effect", WEAR, effect("spring", k=1.0)), WRONG),
        (WORN, WORN, PLAIN),
        (NOTHING, diagnosis("ambiguous", tied=["spring", "cogging"]), WITH),
        (NOTHING, diagnosis("ambiguous", tied=["spring", "offset", "cogging"]), WITHOUT),
        (NOTHING, diagnosis("unknown", tied=["cogging"]), "unknown"),
        (WORN, NOTHING, "none"),
    ],
)
def test_the_outcome_of_a_spike(plain: dict[str, Any], spiked: dict[str, Any], expected: str) -> None:
    assert outcome_of(COGGING, plain, spiked).outcome == expected


def test_rivals_are_those_that_the_separation_names() -> None:
    pairs = [{"first": {"kind": "spring"}, "other": {"kind": k}} for k in ("offset", "cogging")]
    tied = {**diagnosis("ambiguous", tied=["spring", "offset"]), "separation": {"pairs": pairs}}
    assert outcome_of(COGGING, NOTHING, tied) == Outcome(WITH, ("spring", "offset", "cogging"))


def test_rivals_of_records_at_one_speed_are_those_that_are_said_to_tie() -> None:
    """They have no motion that separates them, and candidates that were refused may stand above a rival."""
    said = {**diagnosis("ambiguous", tied=["spring", "cogging"]), "tied": [{"kind": "spring"}, {"kind": "stribeck"}]}
    assert outcome_of(COGGING, NOTHING, said) == Outcome(WITHOUT, ("spring", "stribeck"))


def test_a_name_that_the_plain_log_got_counts_only_where_its_parameter_moved_by_the_spike() -> None:
    plain = diagnosis("effect", wave(4.0))
    assert outcome_of(COGGING, plain, diagnosis("effect", wave(5.0))).outcome == PLAIN
    assert outcome_of(COGGING, plain, diagnosis("effect", wave(13.0))).outcome == DETECTED


@pytest.mark.parametrize(("found", "near"), [(11.0, True), (13.9, True), (8.1, True), (16.0, False), (7.0, False)])
def test_the_parameter_is_own_and_spike(found: float, near: bool) -> None:
    assert outcome_of(COGGING, NOTHING, diagnosis("effect", wave(found))).near is near


def test_an_interval_that_holds_it_is_enough() -> None:
    broad = {**wave(16.0), "intervals": {"amplitude": [10.5, 21.5]}}
    assert outcome_of(COGGING, NOTHING, diagnosis("effect", broad)).near is True


def test_a_gain_is_multiplied() -> None:
    gain = Spike("input_gain", "gain", 1.1, frozenset({"input_gain"}), own=1.0)
    assert (gain.expected, gain.strength) == (1.1, pytest.approx(0.1))
    spiked = [diagnosis("effect", effect("input_gain", "u", gain=g)) for g in (1.12, 1.0)]
    for said in spiked:
        said["effects"][0]["intervals"] = {}
    assert [outcome_of(gain, NOTHING, said).near for said in spiked] == [True, False]


@pytest.mark.parametrize(("sign", "moved", "outcome"), [("-", -5.0, TAKEN), ("", 5.0, TAKEN), ("", -5.0, "none")])
def test_what_a_parameter_with_a_tolerance_takes_needs_no_name(sign: str, moved: float, outcome: str) -> None:
    truth = {
        "effects": [{"kind": "offset", "on": "x", "parameters": {"f0": 5.5}}],
        "equivalents": [[{"kind": "coulomb_asymmetry", "on": "rail", "parameters": {"d": -5.5}}]],
    }
    spike = spike_of(truth, {"own": 3.0}, f"{sign}offset")
    assert (spike.accepted, spike.own, spike.expected) == ({"offset", "coulomb_asymmetry"}, None, 5.5)
    plain, spiked = diagnosis("none", offset=-3.0), diagnosis("none", offset=-3.0 + moved)
    assert outcome_of(spike, plain, spiked).outcome == outcome
    wrong = diagnosis("effect", effect("spring", k=1.0), offset=-3.0 + moved)
    assert outcome_of(spike, plain, wrong).outcome == WRONG


@pytest.mark.parametrize(("moved", "outcome"), [(1 / 1.1, TAKEN), (1.1, "unknown"), (1.0, "unknown")])
def test_a_gain_divides_the_inertia_that_takes_its_place(moved: float, outcome: str) -> None:
    gain = Spike("input_gain", "gain", 1.1, frozenset({"input_gain"}), refitted="-J")
    plain, spiked = diagnosis("unknown", J=2e-4), diagnosis("unknown", J=2e-4 * moved)
    assert outcome_of(gain, plain, spiked).outcome == outcome


def test_a_twin_is_right_and_has_no_parameter_to_compare() -> None:
    spike = Spike("offset", "f0", 5.5, frozenset({"offset", "coulomb_asymmetry"}))
    said = diagnosis("effect", effect("coulomb_asymmetry", "rail", d=-5.5))
    assert outcome_of(spike, NOTHING, said) == Outcome(DETECTED, ("coulomb_asymmetry",), None, None)


@pytest.mark.parametrize(
    ("with_it", "share", "visible"), [({"residual_with_effect": 0.9}, 0.19, True), ({}, 0.0396, False)]
)
def test_what_least_squares_does_not_see_is_counted_apart(
    with_it: dict[str, float], share: float, visible: bool
) -> None:
    """A delay has no column: undone, it leaves what the log as it is left."""
    checked = {"own": 1.0, "residual_before": 0.98, "residual_after": 1.0, **with_it}
    truth = {"effects": [{"kind": "cogging", "on": "x", "parameters": {"amplitude": 10.0}}], "equivalents": [[]]}
    spike = spike_of(truth, checked, "")
    assert spike.visible == pytest.approx(share) and spike.is_visible is visible and spike.own == 1.0
    rows = [Row("cogging", 10.0, one, Outcome(DETECTED, ()), "abc") for one in (spike, COGGING)]
    assert rates(rows)["detected, of those that least squares sees"] == Rate(1 + visible, 1 + visible)


@pytest.mark.parametrize(("deviations", "told"), [(5.0, True), (1.5, False)])
def test_what_least_squares_tells_from_zero_is_counted_apart(deviations: float, told: bool) -> None:
    truth = {"effects": [{"kind": "cogging", "on": "x", "parameters": {"amplitude": 10.0}}], "equivalents": [[]]}
    spike = spike_of(truth, {"own": 1.0, "deviations": deviations}, "")
    found = rates([Row("cogging", 10.0, one, Outcome(DETECTED, ()), "abc") for one in (spike, COGGING)])
    assert spike.is_told is told
    assert found["told from zero by least squares"] == Rate(1 + told, 2)
    assert found["detected, of those that least squares tells from zero"] == Rate(1 + told, 1 + told)


@pytest.mark.parametrize(
    ("spike", "whole", "refitted", "told"),
    [(5.0, 4.0, "", True), (5.0, 3.0, "", False), (3.0, 9.0, "", False), (5.0, 0.1, "b", True)],
)
def test_what_least_squares_tells_among_all_candidates_is_counted_apart(
    spike: float, whole: float, refitted: str, told: bool
) -> None:
    """Also own + spike must be there, unless the spec declares the force: then least squares knows no own."""
    truth = {"effects": [{"kind": "cogging", "on": "x", "parameters": {"amplitude": 10.0}}], "equivalents": [[]]}
    one = spike_of(truth, {"own": 1.0, "deviations": spike, "found_deviations": whole}, refitted)
    assert one.is_told_among_all is told
    found = rates([Row("cogging", 10.0, one, Outcome(DETECTED, ()), "abc")])
    assert found["detected, of those that least squares tells among all candidates"] == Rate(told, told)


def test_the_jackknife_agrees_with_the_textbook_error_and_knows_no_spanned_column(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "spike", SimpleNamespace())
    jackknife = importlib.import_module("benchmarks.spikes.significance").jackknife
    rng = np.random.default_rng(3)
    columns = rng.standard_normal((9600, 3)) * [1.0, 20.0, 0.3]
    drive = columns @ [2.0, -1.0, 5.0] + 0.7 * rng.standard_normal(9600)
    found, error = jackknife(columns, drive, [2400, 7200], 48)
    exact = 0.7 * np.sqrt(np.linalg.inv(columns.T @ columns)[2, 2])
    assert found == pytest.approx(5.0, abs=4 * exact) and error == pytest.approx(exact, rel=0.3)
    angle = rng.uniform(-1, 1, 9600)
    spanned = np.column_stack([np.sin(angle), np.cos(angle), np.sin(angle + 0.4)])
    assert jackknife(spanned, drive, [9600], 48)[1] == np.inf


@pytest.fixture
def significance(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The script beside the shared spike.py."""
    if not SPIKE.is_file():
        pytest.skip("../shared/practice is not here")
    monkeypatch.syspath_prepend(str(SPIKE.parent))
    monkeypatch.delitem(sys.modules, "benchmarks.spikes.significance", raising=False)
    if importlib.util.find_spec("yaml") is None:
        monkeypatch.setitem(sys.modules, "yaml", SimpleNamespace())
    return importlib.import_module("benchmarks.spikes.significance")


ASKED = {"position": ("x", "x"), "input": ("w", "w"), "time": "t", "time_scale": 1.0, "gain": 1.0, "gravity": False}
LEAST_SQUARES = argparse.Namespace(still=None, cutoff=40.0, **ASKED)


WAVES = ((0.2, 2.5), (0.07, 6.9), (0.02, 17.0))


def measured(log: Path, waves: Sequence[tuple[float, float]] = WAVES, k: float = 0.0, k3: float = 200.0) -> Path:
    """A log of a machine with a spring k x + k3 x³; its motion is a sum of waves (m, rad/s)."""
    t = np.arange(0, 20, 2e-3)
    x, v, a = np.zeros((3, len(t)))
    for size, w in waves:
        x, v, a = x + size * np.sin(w * t), v + size * w * np.cos(w * t), a - size * w**2 * np.sin(w * t)
    force = 2 * a + 6 * v + 4 * np.sign(v) + k * x + k3 * x**3
    force += 0.3 * np.random.default_rng(1).standard_normal(len(t))
    np.savetxt(log, np.column_stack([t, x, force]), delimiter=",", header="t,x,w", comments="")
    return log


@pytest.mark.parametrize(("acting", "put_in"), [("hardening_spring", True), ("spring", False)])
def test_least_squares_prefers_the_law_that_acts(acting: str, put_in: bool, tmp_path: Path, significance: Any) -> None:
    """A machine with a cubic spring, which is preferred where it was put in, and also where a linear one was."""
    log = measured(tmp_path / "log.csv")
    experiment = significance.Experiment(acting, {"k": 10.0, "k3": 200.0}, LEAST_SQUARES, [log])
    other, nats = experiment.best_other(["spring", "hardening_spring"])
    assert other == ("spring" if put_in else "hardening_spring")
    assert nats > 10 if put_in else nats < -10


def test_least_squares_takes_all_training_records(tmp_path: Path, significance: Any) -> None:
    """In a record of one frequency the force of inertia is that of a spring, a = −w² x; two frequencies tell them."""
    plain, spiked = ([measured(tmp_path / f"{w}_{k}.csv", [(0.2, w)], k, 0.0) for w in (2.5, 7.0)] for k in (5.0, 15.0))
    both = [significance.Experiment("spring", {"k": 10.0}, LEAST_SQUARES, logs) for logs in (plain, spiked)]
    found = significance.sizes(*both)
    assert found["own"] == pytest.approx(5.0, abs=0.1)
    assert found["residual_after"] > 2 * found["residual_before"] > 4 * found["residual_with_effect"]
    deviations, whole = both[1].deviations(48)
    assert whole == pytest.approx(1.5 * deviations, rel=0.02)
    alone = significance.Experiment("spring", {"k": 10.0}, LEAST_SQUARES, spiked[:1])
    assert deviations > 5 * alone.deviations(48)[0]


@pytest.mark.parametrize(("waves", "told"), [([(0.2, 0.5)], False), (WAVES, True)])
def test_a_drive_force_along_the_motion_is_no_friction_in_proportion_to_it(
    waves: Sequence[tuple[float, float]], told: bool, tmp_path: Path, significance: Any
) -> None:
    """At 0.5 rad/s friction is all of the drive force: abs(F) sgn v = F has the coefficient one without any load."""
    log = measured(tmp_path / "log.csv", waves, 0.0, 0.0)
    experiment = significance.Experiment("load_dependent_friction", {"mu": 0.1}, LEAST_SQUARES, [log])
    found = significance.sizes(experiment, experiment)
    deviations, whole = experiment.deviations(48)
    assert (deviations > 3.5) == told and whole < 3.5
    assert found["residual_with_effect"] == pytest.approx(found["residual_after"], rel=0.02)
    assert found["own"] == pytest.approx(0.0, abs=0.02) or not told


@pytest.fixture
def spike_script(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The shared spike.py runs in our Python. It imports PyYAML, but uses it for ``--spec`` alone, and an environment
    that has it takes 18 s to make.
    """
    if not SPIKE.is_file():
        pytest.skip("../shared/practice is not here")
    if importlib.util.find_spec("yaml") is None:
        (tmp_path / "yaml.py").touch()
        python = tmp_path / "python"
        python.write_text(f'#!/bin/sh\nPYTHONPATH="$PYTHONPATH:{tmp_path}" exec "{sys.executable}" "$@"\n')
        python.chmod(0o755)
        monkeypatch.setattr(runs, "environment", lambda out: python)


@pytest.mark.usefixtures("spike_script")
@pytest.mark.parametrize("kind", ["spring", "load_dependent_friction", "input_gain"])
def test_a_spike_has_its_share_over_all_training_records(kind: str, tmp_path: Path) -> None:
    """A spring of the strength that the first record asks for would be 4 % of the drive force of both."""
    train = [measured(tmp_path / f"{w}.csv", [(0.2, w)], 5.0, 0.0) for w in (2.5, 7.0)]
    columns = ("t", "t"), ("x", "x"), ("w", "w")
    one = RealSet("", [], [], {}, {}, {}, "contact")
    _make(one, Readable(SPIKE, train, [], *columns, 1.0, None), tmp_path / "case", kind, 10.0, tmp_path)
    plain, spiked = (
        np.concatenate([np.loadtxt(file, delimiter=",", skiprows=1)[:, 2] for file in files])
        for files in (train, [tmp_path / "case" / name for name in ("train.csv", "test.csv")])
    )
    assert np.sqrt(np.mean((spiked - plain) ** 2) / np.mean(plain**2)) == pytest.approx(0.1, rel=0.01)


@pytest.mark.usefixtures("spike_script")
def test_records_at_one_speed_get_the_effects_that_a_speed_shows(tmp_path: Path) -> None:
    ladder = real_sets(["screw_drive_1"])["screw_drive_1"]
    assert set(kinds_for(ladder, tmp_path)) == set(ladder.steady)
    moving = replace(ladder, steady=[])
    assert "cogging" in kinds_for(moving, tmp_path) and "friction_drift" not in kinds_for(moving, tmp_path)
    assert "friction_drift" in kinds_for(replace(moving, train=moving.train[:1]), tmp_path)


def test_what_least_squares_prefers_to_other_laws_is_counted_apart() -> None:
    truth = {"effects": [{"kind": "cogging", "on": "x", "parameters": {"amplitude": 10.0}}], "equivalents": [[]]}
    checked = {"own": 1.0, "deviations": 9.0, "found_deviations": 9.0, "other": "spring"}
    spikes = [spike_of(truth, {**checked, "nats": nats}, "") for nats in (3.1, 2.9, -5.0)]
    rows = [Row("cogging", 10.0, one, Outcome(DETECTED, ()), "abc") for one in spikes]
    assert rates(rows)["detected, of those that it also prefers to every other law"] == Rate(1, 1)


def test_totals_count_detections_and_false_names_apart() -> None:
    found = [Outcome(o, (), 1.0 if near is not None else None, near) for o, near in OUTCOMES_SEEN]
    assert totals(found) == {
        "detected": Rate(4, 8),
        "with the parameter own + spike": Rate(2, 3),
        "ambiguous with it": Rate(1, 8),
        "wrong names": Rate(2, 8),
    }
    rows = tuple(Row("cogging", 10.0, COGGING, one, "abc") for one in found)
    text = page([Part("rig", "none", (), rows, "abc")], (10.0,), ["elsewhere"], ["cogging", "spring"])
    assert "| spring | not run | " in text and f"| cogging | {found[0].outcome} |" in text
    assert "| detected | 10 % | 4 of 8: 50 % (22 … 78) | ≥ 80 % | **missed** |" in text
    assert "| wrong names | 10 % | 2 of 8: 25 % (7 … 59) | ≤ 5 % | **missed** |" in text
    assert "| cogging | 4 of 8 | " in text
    assert "| cogging, 10 % | – | – | – | detected | – | amplitude | 1, off | 11 = 1 + 10 | abc |" in text
    assert "Not here or not run, so not in these tables: elsewhere." in text


def test_a_row_that_was_not_run_again_is_kept_with_its_code(tmp_path: Path) -> None:
    def row(kind: str, outcome: str, code: str) -> Row:
        return Row(kind, 10.0, replace(COGGING, kind=kind), Outcome(outcome, ("cogging",), 1.5, True), code)

    old = Part("rig", "none", (), (row("cogging", "unknown", "old"), row("spring", DETECTED, "old")), "old")
    arm = Part("arm", "effect", ("viscous",), (row("cogging", PLAIN, "old"),), "old")
    new = Part("rig", "unknown", (), (row("cogging", DETECTED, "new"),), "new")
    file = tmp_path / "rows.json"
    assert parts_in(file) == []
    file.write_text(text_of([old, arm]))
    assert parts_in(file) == [old, arm]
    rig = replace(new, rows=(new.rows[0], old.rows[1]))
    assert merged([new], parts_in(file)) == [rig, arm]
    assert merged([new], []) == [new]
    assert codes_of([rig, arm]) == [("old", 2), ("new", 1)]


OUTCOMES_SEEN = (
    (DETECTED, True),
    (DETECTED, False),
    (EXTRA, True),
    (TAKEN, None),
    (WRONG, None),
    (WITH, None),
    (PLAIN, None),
    ("none", None),
)


def test_the_sets_are_data_and_an_unknown_name_is_refused() -> None:
    emps = real_sets(["emps"])["emps"]
    assert (emps.input, emps.gain, emps.contact, emps.cutoff_hz) == ({"u": "vir"}, 35.1507, "rail", 20.0)
    with pytest.raises(KeyError):
        real_sets(["nowhere"])

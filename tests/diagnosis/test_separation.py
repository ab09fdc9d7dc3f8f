"""Two effects that a log cannot tell apart: how alike, and a motion that does tell when the machine really does it."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import stiction
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.acceptance import Evidence
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection.candidate_fits import fit_candidates
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.ranking import Ranked
from codegen.diagnosis.verdict import separation
from codegen.diagnosis.verdict.separation import Reach, library, reach_of, separate, tied_fits
from codegen.effects import CATALOGUE
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import STAGE, log_of, stage, system_of

SLOW = "0.2*sin(2*pi*0.4*t)"
TRUTHS = {
    "input_delay": "[{kind: input_delay, on: w, parameters: {T: 0.004}}]",
    "actuator_lag": "[{kind: actuator_lag, on: w, parameters: {tau: 0.004}}]",
}


def coarse(effects: str, reference: str = SLOW, duration: float = 14.0, step: str = "3e-4") -> Spec:
    """The stage with an encoder of 0.3 mm, on which 4 ms of delay or lag are much the same in slow motion."""
    text = STAGE.replace("2e-6", step)
    text = text.format(effects=effects, level=4.5, reference=reference, duration=duration, noise=0)
    return parse_spec(text, Path("stage.yaml"))


@pytest.mark.slow
@pytest.mark.parametrize("truth", ["input_delay", pytest.param("actuator_lag", marks=pytest.mark.slow)])
def test_the_excitation_tells_delay_from_lag(truth: str, tmp_path: Path) -> None:
    plant = TRUTHS[truth]
    log_of(coarse(plant), tmp_path, "slow.csv")
    (tmp_path / "stage.yaml").write_text(stage().text)
    result = stiction.diagnose(tmp_path / "stage.yaml", tmp_path / "slow.csv", out=tmp_path / "out")
    said = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert said["verdict"] == "ambiguous"
    (pair,) = said["separation"]["pairs"]
    assert {pair["first"]["kind"], pair["other"]["kind"]} == set(TRUTHS)
    # A lag is a delay of the same length to first order: on a slow motion they are a degree or so apart.
    assert pair["angle_deg"] < 3
    motion = said["separation"]["motion"]
    assert motion["separation"] >= said["separation"]["separation_needed"]
    assert "excitation.csv" in result.files
    assert motion["name"] in (tmp_path / "out" / "report.html").read_text()

    with (tmp_path / "out" / "excitation.csv").open() as file:
        rows = list(csv.DictReader(file))
    first = np.loadtxt(tmp_path / "slow.csv", delimiter=",", skiprows=1)
    assert list(rows[0]) == ["t", "x_reference", "w"]
    assert max(abs(float(r["w"])) for r in rows) <= np.abs(first[:, 2]).max() * (1 + 1e-6)
    assert max(abs(float(r["x_reference"])) for r in rows) <= np.abs(first[:, 1]).max()

    # The machine follows it: its own loop, its true effect. Alone named is what is true.
    moved = coarse(plant, motion["reference"]["x"], motion["duration_s"])
    again = log_of(moved, tmp_path, "again.csv")
    spec = stage()
    diagnosis, _ = diagnose_log(spec, system_of(spec), again)
    assert diagnosis.verdict == "effect", diagnosis.sentence
    assert [e.kind for e in diagnosis.effects] == [truth]
    assert diagnosis.separation is None


@pytest.mark.slow
def test_the_proposed_motion_leaves_one_of_every_look_alike(tmp_path: Path) -> None:
    """On moves with rests a lag of 11 ms is apart from a gain, and would be called a delay."""
    plant = "[{kind: actuator_lag, on: w, parameters: {tau: 0.011}}]"
    spec = stage()
    slow = log_of(coarse(plant, step="1e-3"), tmp_path, "slow.csv")
    first, _ = diagnose_log(spec, system_of(spec), slow)
    assert first.verdict == "ambiguous"
    told = first.separation
    assert told is not None
    assert told.chosen is not None
    assert all("actuator_lag" in {pair.first[0], pair.other[0]} for pair in told.pairs)
    again = log_of(coarse(plant, told.references["x"], told.chosen.duration_s, "1e-3"), tmp_path, "again.csv")
    second, _ = diagnose_log(spec, system_of(spec), again)
    assert [e.kind for e in second.effects] == ["actuator_lag"]


def test_motions_stay_within_the_reach(tmp_path: Path) -> None:
    motion = smooth_motion(log_of(stage(), tmp_path, "log.csv"))
    reach = Reach(np.array([0.3, 0.0]), np.array([0.2, 5.0]), np.array([0.9, 7.0]), np.array([10.0]))
    moves = library(reach, motion)
    assert [m.duration for m in moves] == sorted(m.duration for m in moves)
    for move in moves:
        time = np.linspace(0, move.duration, 20001)
        x, v = move.at(time)
        assert (np.abs(x - reach.centre) <= reach.half * 1.001).all(), move.name
        assert (np.abs(np.diff(x, axis=0)) <= 1.01 * reach.speed * time[1]).all(), move.name
        slope = (x[2:] - x[:-2]) / (2 * time[1])
        assert np.abs(v[1:-1] - slope).max() <= 1e-3 * np.abs(slope).max(), move.name


def test_a_coordinate_that_must_not_move_does_not(tmp_path: Path) -> None:
    motion = smooth_motion(log_of(stage(), tmp_path, "log.csv"))
    reach = Reach(np.array([0.3]), np.zeros(1), np.zeros(1), np.ones(1))
    for move in library(reach, motion):
        assert (move.at(motion.time)[0] == 0.3).all()


@pytest.mark.slow
def test_no_motion_tells_exact_twins_apart(tmp_path: Path) -> None:
    log = log_of(stage("[{kind: offset, on: x, parameters: {f0: 1.2}}]"), tmp_path, "train.csv")
    system, motion = system_of(stage()), smooth_motion(log)
    search = search_on(Problem(system, motion, {}), lambda share: record_of(motion, log, share))
    base = search.refit()
    parts = [part_of(CATALOGUE[kind], 0, system) for kind in ("offset", "coulomb_asymmetry")]
    one, two = fit_candidates(search, base, parts)
    ranked = Ranked(two, Evidence(0.0, 0.0, 0.0, 0, 0), 1.0, 1.0, "")
    outcome = Outcome(base, one, (), (ranked,), 1.0)
    told, excitation = separate(search, outcome, tied_fits(search, outcome), log, {})
    assert told.chosen is None
    assert excitation is None
    assert told.pairs[0].angle_deg < 2  # two fits of noisy positions stop a degree apart
    assert len(told.tried) == len(library(reach_of(system, motion, {}), motion))
    assert max(m.separation for m in told.tried) < 2


@pytest.mark.parametrize(("coordinates", "expected"), [(1, [3.0, 6.0]), (5, [3.0]), (9, [])])
def test_an_arm_tries_fewer_motions(coordinates: int, expected: list[float], monkeypatch: pytest.MonkeyPatch) -> None:
    """At 1 kHz one motion of 3 s is 3000 samples, times 125 for five coordinates and 729 for nine."""
    made = [SimpleNamespace(duration=d) for d in (3.0, 3.0, 6.0)]
    run = SimpleNamespace(inputs=np.zeros(1))
    monkeypatch.setattr(separation, "library", lambda reach, motion: made)
    monkeypatch.setattr(separation, "MOST_SIMULATED", 1_200_000)
    monkeypatch.setattr(separation, "_simulated", lambda *_: run)
    search: Any = SimpleNamespace(motion=None, system=SimpleNamespace(degrees_of_freedom=coordinates))
    tried = [motion.duration for motion, _ in separation._cheapest_first(search, None, None, 1e-3)]  # type: ignore[arg-type]
    assert sorted(set(tried)) == expected

"""Logs that move one way only: what they cannot show is not claimed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.base.arrays import Array
from codegen.diagnosis.case import not_refitted, unseen_inertias
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.evidence.reservations import takes_the_level
from codegen.diagnosis.fit.output_error import Fit, shooting_fit
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import Trial, part_of, with_values
from codegen.diagnosis.selection import force_selection
from codegen.diagnosis.selection.force_fits import ForceFits
from codegen.diagnosis.selection.force_selection import force_round
from codegen.diagnosis.selection.refusals import is_possible
from codegen.effects import CATALOGUE
from codegen.logs import Log, read_log
from codegen.mechanics.system import System
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import TRAIN, among, log_of, stage, system_of
from tests.diagnosis.test_adoption import loose
from tests.diagnosis.test_force_led import searched

RAIL = "rail_a"


def one_way(folder: Path, turns: bool) -> Problem:
    """A stage that runs at 0.1 m/s with a wave of its speed, or the same there and back."""
    t = np.arange(6000) / 1000
    v = (np.sign(np.sin(t)) if turns else 1.0) * 0.1 * (1 + 0.02 * np.sin(20 * t))
    x = np.cumsum(v) / 1000
    path = folder / f"{turns}.csv"
    rows = (f"{a:.4f},{b:.9g},{c:.9g}" for a, b, c in zip(t, x, 5 + np.sin(20 * t), strict=True))
    path.write_text("\n".join(["t,x,w", *rows]) + "\n")
    return Problem(system_of(stage()), smooth_motion(read_log(path, stage())), {})


def with_level(system: System, level: float) -> System:
    return with_values(system, {RAIL: level})


@pytest.mark.parametrize("turns", [False, True])
def test_a_level_is_not_taken_to_zero_where_nothing_reverses(tmp_path: Path, turns: bool) -> None:
    """A gantry at constant speed: a drive gain of 0.12 and no friction at all were named at 0.93."""
    problem = one_way(tmp_path, turns)
    declared, none = problem.system, with_level(problem.system, 0.0)
    objection = takes_the_level(problem, declared, none)
    assert bool(objection) is not turns
    assert turns or RAIL in objection
    assert takes_the_level(problem, declared, declared) == ""
    assert takes_the_level(problem, none, none) == ""  # the refit has it too, so the effects do not take it


def test_friction_is_not_lost_to_an_actuator(tmp_path: Path) -> None:
    """A cable on a turntable was named a dead zone of 2.7 A, with no friction left of the declared 8.6 N m."""
    problem = one_way(tmp_path, turns=True)
    declared, none = problem.system, with_level(problem.system, 0.0)
    assert RAIL in takes_the_level(problem, declared, none, with_friction=False)
    assert takes_the_level(problem, declared, declared, with_friction=False) == ""
    assert takes_the_level(problem, none, none, with_friction=False) == ""


def test_a_start_that_leaves_no_drive_is_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its residual was divided by that share: a division by zero that was told as a fault of the spec."""
    search = searched(log_of(stage(duration=5.0), tmp_path, "train.csv"))
    fits = ForceFits(search, search.refit())
    before = force_selection.drive_kept

    def kept(fits: ForceFits, plain: Fit, trial: Trial, theta: Array) -> float:
        none = trial.parts[-1].kind == "input_gain"
        return 0.0 if none else before(fits, plain, trial, theta)

    monkeypatch.setattr(force_selection, "drive_kept", kept)
    monkeypatch.setattr(force_selection, "FITTED", 1)
    kinds = {r.found.part.kind for r in force_round(fits, fits.plain, None)}
    assert "input_gain" not in kinds


def steady(tmp_path: Path) -> tuple[Spec, Log]:
    """A spec of the stage with 2 ± 0.2 kg, and its log at constant speed with cogging; w is logged with noise."""
    spec = parse_spec(loose(share="10%").text.replace(TRAIN, "0.06*t"), Path("stage.yaml"))
    cogging = "effects: [{kind: cogging, on: x, parameters: {amplitude: 0.6, period: 0.02, phase: 0.9}}]"
    plant = parse_spec(spec.text.replace("effects: []", cogging), Path("stage.yaml"))
    log = log_of(plant, tmp_path, "steady.csv")
    log.inputs[:, 0] += 1.5 * np.random.default_rng(1).standard_normal(log.size)
    return spec, log


def test_an_inertia_is_unseen_at_constant_speed_and_damping_is_not_asked(tmp_path: Path) -> None:
    still, moving = steady(tmp_path), (loose(share="10%"), log_of(loose(share="10%"), tmp_path, "log.csv"))
    for (spec, log), unseen in ((still, ["m"]), (moving, [])):
        motion = smooth_motion(log)
        shares = {spec.symbol(p.name): 0.1 * float(p.value) for p in spec.parameters}
        assert [s.name for s in unseen_inertias(Problem(system_of(spec), motion, shares))] == unseen
        problem = Problem(system_of(spec), motion, {spec.symbol("b"): 0.3})
        assert unseen_inertias(problem) == []
        for names, words in (("m", "m, which acts "), ("mb", "m and b, which act ")):
            (told,) = not_refitted(problem, [spec.symbol(name) for name in names])
            assert f"hardly shows {words}" in told.words


@pytest.mark.slow  # in make test it is told which inertia is unseen
def test_a_log_at_constant_speed_keeps_the_declared_mass(tmp_path: Path) -> None:
    """The noise of w moves a heavier model less: 3.8 kg were written, and of a gantry 15 kg where 12 are true."""
    spec, log = steady(tmp_path)
    with among("cogging", "input_gain"):
        found, models = diagnose_log(spec, system_of(spec), log)
    assert "m" not in found.refitted and "m: {value: 2.0, unit: kg, tolerance: 10%}" in models.spec_text
    (told,) = (words for words in found.findings["train"] if "The diagnosis keeps m at 2 kg" in words)
    assert told.startswith("warning: The motion of this log hardly shows m")
    # At constant speed the drive force is nearly constant, and so are cogging and a ripple in proportion to it alike.
    (reason,) = found.statement.of("not accepted")
    assert found.verdict == "unknown" and reason.startswith("cogging on x, the best candidate: a force in")


def test_an_effect_that_takes_the_level_is_no_candidate(tmp_path: Path) -> None:
    """The check was of the declared levels: a gain of 0.12 with no friction at all was named at 0.93."""
    search = searched(log_of(parse_spec(stage().text.replace(TRAIN, "0.06*t"), Path("s.yaml")), tmp_path, "s.csv"))
    base = search.refit()
    trial = base.trial.with_part(part_of(CATALOGUE["input_gain"], 0, search.system))
    (runner,) = search.runners([trial])
    for level, possible in ((2.0, True), (0.0, False)):
        theta = trial.theta(np.array([level]), [{"gain": 0.12}])
        fit = shooting_fit(runner, theta, base.offsets, search.prior(trial, theta), 0)
        assert is_possible(search, fit) is possible

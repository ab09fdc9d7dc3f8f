"""No spec is written whose model is worse on held-out data than the declared one, by force residual or by free runs."""

from __future__ import annotations

from dataclasses import replace
from math import nan
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from sympy import Float, Symbol

from codegen.base.significant import in_percent
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.measure import WHOLE, force_errors, measure
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import with_values
from codegen.diagnosis.results import ErrorFigures, Fact, FoundEffect, Remainder
from codegen.diagnosis.verdict import admission
from codegen.diagnosis.verdict.admission import admitted, reference_of
from codegen.diagnosis.verdict.answer import Answer, explains_material_force, unknown_above_drive
from codegen.diagnosis.verdict.held_out import FinalCheck, HeldOut
from codegen.mechanics.system import System
from codegen.spec import parse_spec
from tests.diagnosis.stage import CROSS, STAGE, TEST, among, log_of, stage, system_of

MATERIAL = 0.02
SPRING = "[{kind: spring, on: x, parameters: {k: 18}}]"


def held_out_on(
    truth: str, folder: Path, noise: float = 0.0, cutoff_hz: float = 0.0, level: float = 4.0, declared: float = 4.0
) -> HeldOut:
    """A log of the stage with these effects and level, against a spec without effects and the ``declared`` level."""
    spec, text = (
        stage(level=declared),
        STAGE.format(effects=truth, level=level, reference=TEST, duration=10, noise=noise),
    )
    if cutoff_hz:
        text += f"log: {{cutoff_hz: {cutoff_hz}}}\n"
    log = log_of(parse_spec(text, Path("stage.yaml")), folder, "test.csv")
    motion = smooth_motion(log)
    problem = Problem(system_of(spec), motion, {})
    return HeldOut(problem, lambda model: measure(model, motion, problem.used, WHOLE))


def with_effect(data: HeldOut, model: System) -> Answer:
    """An answer that names an effect, with this model as the one to be written."""
    declared = data.measured(data.problem.system)
    found = FoundEffect("saturation", "w", {}, {})
    return Answer("effect", (found,), data.problem.system, model, (declared, declared, data.measured(model)))


def crude(effects: str, level: float) -> System:
    return with_values(system_of(stage(effects)), {"rail_a": level})


def relative_force(data: HeldOut, model: System) -> float:
    return force_errors(model, data.problem.motion, data.problem.used)[2]


def test_a_model_with_a_smaller_drive_force_is_judged_in_proportion_to_it(tmp_path: Path) -> None:
    """Friction is 60 N and declared with half of that; a saturation at a fraction of the input takes its place.

    All forces of that model are small, its residual too, so the comparison of residuals admits it.
    """
    data = held_out_on("[]", tmp_path, level=60.0, declared=30.0)
    system = data.problem.system
    wrong = crude("[{kind: saturation, on: w, parameters: {limit: 4}}]", 0.0)
    answer = with_effect(data, wrong)
    declared, _, figures = answer.figures
    assert figures.force_rms < declared.force_rms
    assert relative_force(data, wrong) > 2 * relative_force(data, system)
    by_force_alone = [replace(f, free_run_rmse_rows=(1.0,), free_run_parts=()) for f in (declared, figures)]
    plain = replace(answer, figures=(by_force_alone[0],) * 3)
    reference = reference_of(wrong, plain, data.problem)
    assert admitted([("the effect", wrong)], lambda model: by_force_alone[1], reference).option is not None

    last = FinalCheck(data, False, MATERIAL)
    assert "of the drive force" in last._worse_by_force(wrong)
    found = last.passed(answer)
    assert (found.verdict, found.adopted) == ("unknown", system)
    assert found.figures[2] == declared and "on held-out data" in found.against[0].words


@pytest.mark.parametrize(
    ("truth", "noise"),
    [
        ("[{kind: saturation, on: w, parameters: {limit: 4.5}}]", 0.0),
        ("[{kind: dead_zone, on: w, parameters: {width: 0.3}}]", 2e-5),
        ("[{kind: input_gain, on: w, parameters: {gain: 0.9}}]", 2e-5),
        ("[{kind: compliance, on: x, parameters: {k: 4e4, c: 30, load_fraction: 0.4}}]", 2e-6),
    ],
)
@pytest.mark.parametrize("near", [True, False])
def test_a_true_effect_is_no_worse(truth: str, noise: float, near: bool, tmp_path: Path) -> None:
    data = held_out_on(truth, tmp_path, noise)
    model = system_of(stage(truth))
    answer = with_effect(data, model)
    assert FinalCheck(data, near, MATERIAL).passed(answer) is answer


def test_a_true_peak_that_the_filter_blurs_is_no_worse_at_the_noise(tmp_path: Path) -> None:
    """The residual is larger with the true peak (``test_settled``), by an immaterial share of the drive force."""
    truth = "[{kind: stribeck, on: rail, parameters: {delta: 3, v_s: 0.01}}]"
    data = held_out_on(truth, tmp_path, noise=1e-6, cutoff_hz=8)
    model = system_of(stage(truth))
    assert relative_force(data, model) > relative_force(data, data.problem.system)
    answer = with_effect(data, model)
    assert FinalCheck(data, True, MATERIAL).passed(answer) is answer


@pytest.mark.parametrize("near", [True, False])
def test_free_runs_at_the_noise_do_not_excuse_a_material_force(near: bool, tmp_path: Path) -> None:
    """A spring that is not in the held-out log; by free runs alone it is judged elsewhere."""
    data = held_out_on("[]", tmp_path, noise=1e-6)
    last, model = FinalCheck(data, near, MATERIAL), system_of(stage(SPRING))
    assert last._worse_by_force(model)
    assert FinalCheck(data, near, 10.0)._worse_by_force(model) == ""  # immaterial by that measure
    assert last._worse_by_force(data.problem.system) == ""


EVENLY = (0.9, 1.1, 0.9, 1.1, 0.9, 1.1, 0.9, 1.1)
"""Errors of the parts of held-out data, over their mean."""


def worse_in_free_runs(system: System, *models: tuple[float, ...], spread: tuple[float, ...] = EVENLY) -> str:
    """What the check says of the errors of each coordinate with a model, and as declared; ``spread``: of the model."""

    def figures(errors: tuple[float, ...], spread: tuple[float, ...]) -> ErrorFigures:
        parts = tuple(tuple((e * s) ** 2 for e in errors) for s in spread)
        return ErrorFigures(1.0, (1.0,) * len(errors), 1.0, 1.0, errors, parts)

    data = SimpleNamespace(problem=SimpleNamespace(system=system))
    with patch.object(FinalCheck, "_worse_by_force", lambda *_: ""):
        check = FinalCheck(data, False, MATERIAL)  # type: ignore[arg-type]
        return check.worse(system, figures(models[0], spread), figures(models[1], EVENLY))


@pytest.mark.parametrize(("second", "on"), [(1.3, "of y on held-out data"), (1.04, "")])
def test_no_coordinate_is_worse_in_free_runs(second: float, on: str) -> None:
    """The first coordinate improves tenfold, so that the RMS over both falls, though the second is 1.3 times as far."""
    system = system_of(parse_spec(CROSS, Path("cross.yaml")))
    words = worse_in_free_runs(system, (0.1, second), (1.0, 1.0))
    assert (on in words) if on else words == ""
    assert f"{second:.3g} times as large" in words or not on


def test_the_only_coordinate_is_no_worse_in_free_runs() -> None:
    assert "1.3 times as large" in worse_in_free_runs(system_of(stage()), (1.3,), (1.0,))
    assert worse_in_free_runs(system_of(stage()), (1.04,), (1.0,)) == ""


def test_a_coordinate_that_one_part_of_the_data_makes_worse_is_no_objection() -> None:
    """In seven of eight parts the second one is nearer."""
    system, spread = system_of(parse_spec(CROSS, Path("cross.yaml"))), (0.5, 0.5, 0.5, 2.4, 0.5, 0.5, 0.5, 0.5)
    assert worse_in_free_runs(system, (0.1, 1.3), (1.0, 1.0), spread=spread) == ""


def test_a_model_that_leaves_more_than_the_drive_force_explains_nothing(tmp_path: Path) -> None:
    """A motor with a mass declared 20 times too large was fine: its free runs ended at the noise of a short log."""
    data = held_out_on("[]", tmp_path)
    right = data.problem.system
    heavy = replace(right, values={**right.values, Symbol("m", real=True): Float(40)})
    few, many = (Remainder(nan, nan, 0.0),), (Remainder(1.0, 4.0, 0.0),)
    assert relative_force(data, heavy) > 1 > relative_force(data, right)

    def judged(model: System, left: tuple[Remainder, ...]) -> Answer:
        figures = (data.measured(model),) * 3
        return unknown_above_drive(Answer("none", (), model, model, figures), left, data.problem)

    found = judged(heavy, few)
    assert found.verdict == "unknown" and found.remarks[-1].topic == "unexplained"
    assert in_percent(relative_force(data, heavy)) in found.remarks[-1].words
    assert judged(heavy, many).verdict == "none"  # by_remainder decides
    assert judged(right, few).verdict == "none"
    motion = data.problem.motion
    coasting = replace(data.problem, motion=replace(motion, inputs=np.zeros_like(motion.inputs)))
    figures = (data.measured(right),) * 3
    undriven = unknown_above_drive(Answer("none", (), right, right, figures), few, coasting)
    assert undriven.verdict == "unknown"  # driven motion in a log whose input is zero: shares are of M a
    assert "inf" not in undriven.remarks[-1].words


@pytest.mark.parametrize("verdict", ["none", "ambiguous"])
def test_refitted_values_that_are_worse_are_not_written(verdict: str, tmp_path: Path) -> None:
    data = held_out_on("[]", tmp_path)
    system, refit = data.problem.system, crude("[]", 7.0)
    declared, figures = data.measured(system), data.measured(refit)
    answer = Answer("none" if verdict == "none" else "ambiguous", (), refit, refit, (declared, figures, figures))
    found = FinalCheck(data, False, MATERIAL).passed(answer)
    assert (found.verdict, found.adopted) == (verdict, system)
    assert found.remarks[-2].words.startswith("Refitted values are not written: with them the ")
    assert found.remarks[-1].words == "Refused: rail_a = 7 N (declared 4)"
    assert found.figures[1] == declared


def test_whatever_the_other_checks_admit_is_compared_before_it_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The spring is in the training log only, and no other check on held-out data refuses anything."""
    monkeypatch.setattr(admission, "refusal", lambda *_: None)
    train = log_of(stage(SPRING, 4.5), tmp_path, "train.csv")
    test = log_of(stage("[]", 4.0, TEST, 10.0), tmp_path, "test.csv")
    with among("spring", "offset"):
        found, models = diagnose_log(stage(), system_of(stage()), train, test)
    assert found.verdict == "unknown" and found.effects == (), found.sentence
    (why, *_) = found.statement.of("not accepted")
    assert why.startswith("spring on x") and "on held-out data is" in why
    assert models.spec_text == stage().text


def test_facts_on_an_effect_are_not_told_once_it_is_refused() -> None:
    """Of effects that were not accepted it said "The residual force shows it" and what of their period is covered."""
    told = [
        Fact("values", "The log covers only a part."),
        Fact("evidence", "The force shows it."),
        Fact("note", "Late."),
    ]
    none: Any = None
    named = Answer("effect", (), none, none, (none, none, none), remarks=tuple(told))
    assert named.refused("a smooth curve explains more").remarks == (told[2],)


@pytest.mark.parametrize("besides", [0.0, 5.0])
@pytest.mark.parametrize(("k", "material"), [(0.3, False), (3.0, True)])
def test_what_no_second_log_shows_must_be_material_in_the_training_log(
    k: float, material: bool, besides: float, tmp_path: Path
) -> None:
    """A spring of k N/m: its share of the drive force is RMS(k x)/RMS(w) of the log, also beside a larger cogging."""
    spring = f"{{kind: spring, on: x, parameters: {{k: {k}}}}}"
    cogging = f"{{kind: cogging, on: x, parameters: {{amplitude: {besides}, period: 0.01, phase: 0}}}}"
    problem = held_out_on(f"[{spring}, {cogging}]" if besides else f"[{spring}]", tmp_path).problem
    x, w = problem.motion.positions[:, 0], problem.motion.inputs[:, 0]
    share = k * np.std(x) / np.sqrt(np.mean(w**2))
    assert share > 1.5 * MATERIAL if material else 1e-3 < share < MATERIAL / 1.5
    sprung = system_of(stage(f"[{spring}]"))
    assert explains_material_force(problem, problem.system, sprung) is material
    assert not explains_material_force(problem, sprung, problem.system)

"""An arm joint by joint: each joint's free run with the others as measured, against the arm's own simulation."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import casadi
import numpy as np
import pytest
from mechanics.robots import TWO_LINKS

from codegen.diagnosis.case import uncertain_values
from codegen.diagnosis.evidence.force_gain import ForceCriterion
from codegen.diagnosis.fit import drive, residual
from codegen.diagnosis.fit.acceptance import near_noise, noise_ratio
from codegen.diagnosis.fit.drive import drive_shares, residual_at_drive
from codegen.diagnosis.fit.joints import JointShooter, MotionTerms, RigidTerms, is_separable
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.record import Record, record_of
from codegen.diagnosis.fit.residual import (
    Problem,
    ResidualAlong,
    evaluate_forces,
    force_function,
    inverse_dynamics_residual,
    unfiltered_residual,
)
from codegen.diagnosis.fit.search import Search, search_on
from codegen.diagnosis.fit.shooting import FreeRun, Values
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import Part, model_of, part_of
from codegen.diagnosis.selection import forward_selection, parsimony
from codegen.diagnosis.selection.candidate_fits import CandidateFits, every_part
from codegen.diagnosis.selection.force_fits import ForceFits
from codegen.diagnosis.selection.refusals import contradicted_by_force
from codegen.effects import CATALOGUE
from codegen.logs import Log
from codegen.mechanics.casadi_form import over_rows
from codegen.mechanics.system import Matrix
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import log_of, stage, system_of

ARM = """name: arm
urdf: {file: arm.urdf%s}
friction:
  contacts:
    - {name: q_1, law: coulomb, a: 0.4, unit: N*m}
    - {name: q_2, law: coulomb, a: 0.7, unit: N*m}
"""
MOVING = """effects: [%s]
simulation:
  duration: 16
  sample_time: 0.004
  reference: {q_1: "0.9*sin(1.3*t) - 1.2", q_2: "0.8*sin(2.1*t) + 0.3*sin(5*t)"}
  position_gain: {w_q_1: 300, w_q_2: 120}
  velocity_gain: {w_q_1: 40, w_q_2: 12}
  position_noise: {q_1: 2e-5, q_2: 2e-5}
"""
SENSOR = "encoder_eccentricity"
DRAG = "{kind: viscous, on: [q_2], parameters: {b: 0.4}}"
HEAVIER = re.sub(r'mass value="([^"]+)"', lambda m: f'mass value="{1.2 * float(m[1]):g}"', TWO_LINKS)


def logged(folder: Path, effect: str = "", urdf: str = TWO_LINKS) -> Log:
    (folder / "arm.urdf").write_text(urdf)
    return log_of(parse_spec(ARM % "" + MOVING % effect, folder / "plant.yaml"), folder, "log.csv")


def search_of(spec: Spec, log: Log) -> Search:
    motion = smooth_motion(log)
    system, deviations, _ = uncertain_values(spec, system_of(spec), log)
    return search_on(Problem(system, motion, deviations), lambda share: record_of(motion, log, share))


def arm(folder: Path, more: str = "") -> Spec:
    return parse_spec(ARM % more, folder / "arm.yaml")


Searches = Callable[..., tuple[Search, Fit, ForceFits]]


@pytest.fixture(scope="module")
def searches(tmp_path_factory: pytest.TempPathFactory) -> Searches:
    """By the effects that the spec lacks, and what it has more: the search on their log, its refit, and fits by the
    force residual.
    """

    @cache
    def of(missing: str, more: str = "") -> tuple[Search, Fit, ForceFits]:
        folder = tmp_path_factory.mktemp("joints")
        log = logged(folder, missing)
        search = search_of(arm(folder, more), log)
        base = search.refit()
        return search, base, ForceFits(search, base)

    return of


def by_joint(search: Search) -> np.ndarray:
    """(2,) RMS of measured less predicted over the noise, of each joint, with the values of the spec."""
    runner = search.runners([search.declared_trial])[0]
    error = (search.record.targets - runner.run(search.declared, search.record.at_rest))[..., 0]
    return np.sqrt((error**2).reshape(len(search.record.start), 2, -1).mean(axis=(0, 2))) / search.record.noise


def test_a_joint_alone_moves_as_in_the_whole_arm(tmp_path: Path) -> None:
    """A run is ten times the noise off, since starts are smoothed: with the true values as the whole arm's is."""
    log = logged(tmp_path)
    search = search_of(arm(tmp_path), log)
    assert search.rigid is not None
    alone = by_joint(search)
    together = replace(search, rigid=None, record=replace(search.record, joints=None))
    runner = together.runners([together.declared_trial])[0]
    error = together.record.targets - runner.run(together.declared, together.record.at_rest)
    whole = np.sqrt((error**2).mean(axis=(0, 1))) / together.record.noise
    assert (alone < 2 * whole).all(), (alone, whole)


def test_equations_are_compiled_once_and_apart_for_joints_and_for_the_whole_arm(tmp_path: Path) -> None:
    log = logged(tmp_path)
    search = search_of(arm(tmp_path), log)
    together = replace(search, rigid=None, record=replace(search.record, joints=None))
    trial = search.declared_trial
    drag = trial.with_part(next(p for p in every_part(search, []) if p.kind == "quadratic_drag"))
    first, again, (bare, richer) = search.runners([trial]), search.runners([trial]), search.runners([trial, drag])
    assert again[0].shooter is first[0].shooter is bare.shooter and bare.model == first[0].model
    assert richer.shooter is not bare.shooter
    assert together.runners([trial])[0].shooter is not bare.shooter


def test_models_with_other_imposed_signals_share_nothing_that_depends_on_them(tmp_path: Path) -> None:
    """A spring between two joints needs the other joint's position; a model without it was given the same columns."""
    log = logged(tmp_path)
    search, alone = (search_of(arm(tmp_path), log) for _ in range(2))
    parts = every_part(search, [])
    spring = next(p for p in parts if p.effect.sits_on == "two coordinates")
    drag = next(p for p in parts if p.kind == "quadratic_drag")
    beside = search.runners([search.declared_trial.with_part(p) for p in (drag, spring)])[0]
    beside.run(np.append(search.declared, np.zeros(len(drag.names))), search.record.at_rest)
    plain, expected = (s.runners([s.declared_trial])[0].run(s.declared, s.record.at_rest) for s in (search, alone))
    np.testing.assert_array_equal(plain, expected)


def test_rigid_terms_are_computed_once_where_bristles_follow_a_motion_without_sensor_errors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They were computed along the corrected motion, for each value of the error: 10 s of a round of six joints.

    Its own runs with the terms along the corrected motion differ by far less than the noise of 2e-5 rad.
    """
    log = logged(tmp_path)
    search = search_of(arm(tmp_path), log)
    parts = {p.kind: p for p in every_part(search, []) if p.on == "q_2" and p.kind in ("presliding", SENSOR)}
    trial = search.declared_trial.with_part(parts["presliding"]).with_part(parts[SENSOR])
    runner, at_rest = search.runners([trial])[0], search.record.at_rest
    computed, along, run_of = list[int](), RigidTerms.along, JointShooter.run_of

    def counted(terms: RigidTerms, positions: np.ndarray, *others: Any) -> MotionTerms:
        computed.append(id(positions))
        return along(terms, positions, *others)

    def along_corrected(
        shooter: JointShooter, model: int, values: Values, record: Record, substeps: int, measured: Record
    ) -> FreeRun:
        return run_of(shooter, model, values, record, substeps, record)

    monkeypatch.setattr(RigidTerms, "along", counted)
    values = [{"amplitude": amplitude, "period": 0.7, "phase": 0.3} for amplitude in (1e-3, 2e-3)]
    thetas = [trial.theta(search.declared, [{"sigma": 2e4}, one]) for one in values]
    runs = [runner.run(theta, at_rest) for theta in thetas]
    assert set(computed) == {id(search.record.positions)}
    assert np.abs(runs[1] - runs[0]).max() > 5e-4
    monkeypatch.setattr(JointShooter, "run_of", along_corrected)
    expected = [runner.run(theta, at_rest) for theta in thetas]
    assert len(set(computed)) == 3
    np.testing.assert_allclose([run[1::2] for run in runs], [run[1::2] for run in expected], rtol=0, atol=2e-6)
    np.testing.assert_array_equal(runs[0][::2], runs[1][::2], "the error of joint 2 moves it alone")


def test_only_parameters_of_links_that_a_joint_moves_change_its_runs(tmp_path: Path) -> None:
    """The free runs of joint 2 alone do not depend on what moves with joint 1 only; each parameter is changed."""
    log = logged(tmp_path)
    search = search_of(arm(tmp_path, ", tolerance: {mass: 20 %, inertia: 30 %}"), log)
    record = replace(search.record, joints=(1,))
    runner = replace(search.runners([search.declared_trial])[0], record=record)
    plain, felt = runner.run(search.declared, record.at_rest), []
    for k, declared in enumerate(search.declared):
        theta = search.declared.copy()
        theta[k] += 1e-2 * max(abs(declared), 1.0)
        felt.append(not np.array_equal(runner.run(theta, record.at_rest), plain))
    assert [runner.depends_on(k) for k in range(len(felt))] == [k == 0 or own for k, own in enumerate(felt)]
    assert any(felt[2:]) and not all(felt[2:])  # the first two are the friction levels of the joints
    slopes = search.refit().of_joint(1).slopes
    assert [bool(slope.any()) for slope in slopes] == felt


def test_what_a_joint_lacks_shows_at_that_joint(tmp_path: Path, searches: Searches) -> None:
    log = logged(tmp_path)
    right = by_joint(search_of(arm(tmp_path), log))
    lacking = by_joint(searches(DRAG)[0])
    assert lacking[1] > 10 * right[1]
    assert lacking[0] < 1.5 * right[0]


def test_only_joints_with_something_left_are_tried(searches: Searches) -> None:
    search, base, _ = searches(DRAG)
    tried = CandidateFits(search, base, tuple(every_part(search, ())))
    assert {p.effect.coordinate(search.system, p.place) for p in tried.parts} == {1}
    k = next(k for k, p in enumerate(tried.parts) if p.kind == "viscous")
    found = tried.fitted(tried.screened([k]))[0]
    assert found.parameters["b"] == pytest.approx(0.4, rel=0.02)
    assert len(found.residual) == len(base.residual)
    assert found.cost < 0.7 * base.cost


def test_a_joint_that_stands_still_does_not_hide_what_another_one_lacks(tmp_path: Path) -> None:
    """Three of five joints stood still. The median over all joints was zero, and the log counted as near the noise."""
    log = logged(tmp_path, DRAG)
    log.positions[:, 0] = -1.2
    search = search_of(arm(tmp_path), log)
    base = search.refit()
    alone = (base.residual.reshape(len(search.record.start), -1) ** 2).mean(axis=1)
    assert noise_ratio(base) == pytest.approx(np.sqrt(np.median(alone)))
    assert not near_noise(base)
    assert {p.on for p in every_part(search, ())} == {"q_2", "w_q_2"}


def test_each_joint_has_the_noise_floor_of_its_own_misfit(
    searches: Searches,
) -> None:
    """A joint far off with a quiet neighbour had no floor, since the median over both joints is near the noise."""
    search, base, _ = searches(DRAG)
    louder, _ = search.with_noise_floor(base, 2.0)
    squares = (base.residual**2).mean(axis=1).reshape(-1, 2)  # a row for each joint of a segment
    ratio = np.sqrt(np.median(squares, axis=0)) / 2
    assert ratio[0] < 1 < 5 < ratio[1]
    np.testing.assert_allclose(louder.record.noise / search.record.noise, [1, ratio[1]], rtol=1e-9)


def test_masses_within_their_tolerance_are_refitted(tmp_path: Path) -> None:
    """The log is of links a fifth heavier than the spec's file says."""
    log = logged(tmp_path, urdf=HEAVIER)
    (tmp_path / "arm.urdf").write_text(TWO_LINKS)
    held = search_of(arm(tmp_path), log)
    free = search_of(arm(tmp_path, ", tolerance: {mass: 20 %, inertia: 20 %}"), log)
    assert len(free.refitted_symbols) > len(held.refitted_symbols)
    one, other = held.refit(), free.refit()
    assert other.cost < 0.2 * one.cost
    assert noise_ratio(other) < 3


def test_a_spec_without_a_robot_file_is_run_as_a_whole() -> None:
    assert not is_separable(system_of(stage()))


def test_a_parameter_that_changes_nothing_stays(searches: Searches) -> None:
    """A joint's candidate is fitted on that joint's rows, on which the other joints' levels have no slope at all."""
    search, base, _ = searches(DRAG)
    parts = [p for p in every_part(search, ()) if (p.kind, p.on) == ("stribeck", "q_2")]
    tried = CandidateFits(search, base, tuple(parts))
    (screened,) = tried.screened([0])
    index = [s.name for s in search.refitted_symbols].index("q_1_a")
    assert screened.theta[index] == base.theta[index]


def test_a_value_felt_at_another_joint_is_no_evidence_against_an_effect(tmp_path: Path) -> None:
    """Joint 2 lacks friction; the step that fits it also moves an inertia that is felt at joint 1 alone.

    The squared force residual of joint 1 is many times as large as before; at joint 2 most of it is gone.
    """
    log = logged(tmp_path, DRAG)
    search = search_of(arm(tmp_path, ", tolerance: {mass: 10 %}"), log)
    base = search.refit()
    part = next(p for p in every_part(search, []) if (p.kind, p.on, p.names) == ("viscous", "q_2", ("b",)))
    trial, theta = base.runner.trial.with_part(part), np.append(base.theta, 0.2)
    theta[[s.name for s in search.refitted_symbols].index("q_1_zz")] *= 1.5
    found = replace(base, runner=replace(base.runner, trial=trial), theta=theta)
    before, after = ForceCriterion(search, base), ForceCriterion(search, found)
    used = search.problem.used
    squares = [np.where(used, criterion.without_levels, 0.0) ** 2 for criterion in (before, after)]
    first, second = squares[1].sum(axis=0) / squares[0].sum(axis=0)
    assert first > 5 > 1 / second > 2
    assert after.over(before).left == pytest.approx(second)
    assert after.added_to(before).p_added(1) < 1e-6
    assert contradicted_by_force(before, after) == ""


def test_effects_on_a_joint_are_tried_in_pairs_for_what_is_left_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Joint 2 lacks friction and nothing else. The input of joint 1 is noisy: its free runs stay far from the data."""
    log = logged(tmp_path, DRAG)
    noisy = log.inputs.copy()
    noisy[:, 0] += 0.5 * np.random.default_rng(1).standard_normal(len(noisy))
    search = search_of(arm(tmp_path), replace(log, inputs=noisy))
    kinds = ("viscous", "quadratic_drag", "offset")

    def few(search: Search, taken: Sequence[Part]) -> list[Part]:
        return [p for p in every_part(search, taken) if p.kind in kinds]

    def no_pair(*_: object) -> None:
        raise AssertionError("effects were tried in pairs")

    for asking in (forward_selection, parsimony):
        monkeypatch.setattr(asking, "every_part", few)
    monkeypatch.setattr(forward_selection, "second_rounds", no_pair)
    outcome = forward_selection.find_effects(search, search.refit(), lambda turn, share: None)
    assert ("viscous", "q_2") in [(p.kind, p.on) for p in outcome.parts]
    assert near_noise(outcome.final.of_joint(1))
    assert not near_noise(outcome.final.of_joint(0))


def test_slopes_of_the_force_by_links_are_computed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are those of inverse dynamics by differences; a fit with an effect computes residuals for that alone."""
    log = logged(tmp_path, DRAG)
    search = search_of(arm(tmp_path, ", tolerance: {mass: 20 %, inertia: 30 %}"), log)
    base = search.refit()
    fits = ForceFits(search, base)
    at = base.theta.copy()
    before = inverse_dynamics_residual(model_of(base.trial, at), search.motion)
    assert {search.refitted_symbols[k].name for k in fits.by_links} == {s.name for s in search.refitted_symbols[2:]}
    for k, slope in fits.by_links.items():
        moved = at.copy()
        moved[k] += 0.1
        change = inverse_dynamics_residual(model_of(base.trial, moved), search.motion) - before
        np.testing.assert_allclose(slope, change / 0.1, rtol=1e-6, atol=1e-9 * np.abs(change).max())
    part = next(p for p in every_part(search, []) if (p.kind, p.on, p.names) == ("viscous", "q_2", ("b",)))
    start = np.append(fits.plain.theta, 0.2)
    plain, tried = ResidualAlong.several, list[np.ndarray]()

    def several(along: ResidualAlong, thetas: Sequence[np.ndarray], every: int = 1) -> Iterator[np.ndarray]:
        tried.extend(thetas)
        return plain(along, thetas, every)

    monkeypatch.setattr(ResidualAlong, "several", several)
    found = fits.fit(base.trial.with_part(part), start)
    assert found.parameters["b"] == pytest.approx(0.4, rel=0.02)
    start[list(fits.by_links)] = search.declared[list(fits.by_links)]  # the bodies are evaluated there
    alone = [changed[0] for theta in tried if len(changed := np.flatnonzero(theta != start)) == 1]
    assert alone == [len(search.refitted_symbols)]  # b, which is no slope of the declared model


def test_forces_of_the_bodies_are_evaluated_once_for_all_fits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are linear in the values of the links, and took most of the time of an arm's diagnosis."""
    log = logged(tmp_path, DRAG)
    search = search_of(arm(tmp_path, ", tolerance: {mass: 20 %, inertia: 30 %}"), log)
    fits = ForceFits(search, search.refit())
    start, _ = np.append(fits.plain.theta, 0.2), fits.by_links
    whole = force_function(search.system, [Matrix(search.system.equation_error)]).n_instructions()
    evaluated, tried, rows, at = list[bool](), list[np.ndarray](), over_rows, ResidualAlong.several

    def over(function: casadi.Function, *given: np.ndarray) -> np.ndarray:
        evaluated.append(2 * function.n_instructions() > whole)
        return rows(function, *given)

    def several(along: ResidualAlong, thetas: Sequence[np.ndarray], every: int = 1) -> Iterator[np.ndarray]:
        tried.extend(thetas)
        return at(along, thetas, every)

    for module in (drive, residual):
        monkeypatch.setattr(module, "over_rows", over)
    monkeypatch.setattr(ResidualAlong, "several", several)
    for name in ("viscous", "coulomb_asymmetry"):
        part = next(p for p in every_part(search, []) if (p.kind, p.on, len(p.names)) == (name, "q_2", 1))
        fits.fit(search.declared_trial.with_part(part), start)
    assert len(tried) > 8
    assert sum(evaluated) <= 1


@pytest.mark.parametrize(
    "kind", ["inertia_error", "viscous", "load_dependent_friction", "input_delay", "dead_zone", "compliance"]
)
def test_the_force_at_other_values_of_the_links_is_that_of_their_model(searches: Searches, kind: str) -> None:
    search, _, fits = searches(DRAG, ", tolerance: {mass: 20 %, inertia: 30 %}")
    assert len(fits.by_links) > 3
    part = part_of(CATALOGUE[kind], 0, search.system)
    trial, rng = search.declared_trial.with_part(part), np.random.default_rng(1)
    for _ in range(2):
        theta = trial.theta(
            search.declared * rng.uniform(0.8, 1.2, len(search.refitted_symbols)), [dict.fromkeys(part.names, 0.01)]
        )
        model = residual_at_drive(model_of(trial, theta), search.motion)
        close = 1e-6 if kind == "compliance" else 1e-9  # its states are simulated
        expected = fits._scaled(model)
        np.testing.assert_allclose(
            fits._residual(trial, theta), expected, rtol=close, atol=close * np.abs(expected).max()
        )


def test_a_residual_by_bodies_and_others_is_that_of_the_whole_arm(tmp_path: Path) -> None:
    log = logged(tmp_path, DRAG)
    search = search_of(arm(tmp_path, ", tolerance: {mass: 20 %, inertia: 30 %}"), log)
    effects, motion = ("inertia_error", "load_dependent_friction", "viscous", "presliding"), search.motion
    rng = np.random.default_rng(3)
    for kind in effects:
        part = next(p for p in every_part(search, []) if (p.kind, p.on) == (kind, "q_2"))
        trial = search.declared_trial.with_part(part)
        along, given = ResidualAlong(trial, motion), dict.fromkeys(part.names, 0.2)
        levels = search.declared * np.where(np.arange(len(search.refitted_symbols)) < 2, 1.3, 1.0)
        others = search.declared * rng.uniform(0.9, 1.1, len(search.refitted_symbols))
        for refitted_values in (search.declared, levels, others, levels):
            theta = trial.theta(refitted_values, [given])
            model = model_of(trial, theta)
            whole = evaluate_forces(model, [Matrix(model.equation_error)], motion)[0]
            if kind == "presliding":  # of a state of its own in place of the level's friction
                whole = unfiltered_residual(model, motion)
            size = np.abs(whole).max()
            np.testing.assert_allclose(along.at(theta), whole, rtol=1e-12, atol=1e-12 * size, err_msg=kind)
            np.testing.assert_allclose(along.at(theta, 3), whole[::3], rtol=1e-12, atol=1e-12 * size, err_msg=kind)


def test_what_the_inputs_change_of_an_arm_is_the_difference_of_its_residuals(tmp_path: Path) -> None:
    log = logged(tmp_path)
    search = search_of(arm(tmp_path), log)
    part = next(p for p in every_part(search, []) if (p.kind, p.on) == ("load_dependent_friction", "q_2"))
    trial, motion = search.declared_trial.with_part(part), search.motion
    model, plain = (model_of(trial, trial.theta(search.declared, [{"mu": mu}])) for mu in (0.2, 0.0))
    changes = []
    for one in (model, plain):
        error = [Matrix(one.equation_error)]
        changes.append(evaluate_forces(one, error, motion) - evaluate_forces(one, error, motion, 0 * motion.inputs))
    own, its = (np.sqrt((change[0][motion.usable] ** 2).mean(axis=0)) for change in changes)
    shares = drive_shares(model, plain, motion, np.zeros_like(motion.positions, dtype=bool))
    np.testing.assert_allclose(shares, own / its, rtol=1e-9)
    assert shares[1] != pytest.approx(1, abs=0.01)

"""A toleranced constant of the drive: a weaker drive with all forces smaller alike is the same motion, and no gain."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.evidence.adoption import CrossValidation, adopt_values
from codegen.diagnosis.evidence.estimate import estimate, named_effects
from codegen.diagnosis.fit.drive import DriveLeft, drive_gain, residual_at_drive
from codegen.diagnosis.fit.force_rows import force_rows, relative_force_rows
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import Search, search_on
from codegen.diagnosis.fit.signals import low_pass, smooth_motion
from codegen.diagnosis.fit.trial import model_of, part_of, with_effects, with_values
from codegen.diagnosis.selection.force_fits import ForceFits
from codegen.effects import CATALOGUE
from codegen.mechanics.system import System
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import log_of, stage, system_of

RIPPLE = "[{kind: cogging, on: x, parameters: {amplitude: 2.0, period: 0.013, phase: 0.3}}]"
"""Which no parameter explains: what is left of it falls with the drive."""


def driven(effects: str = "[]") -> Spec:
    """The stage with a motor constant kt of 1 N/N."""
    text = stage(effects).text.replace("force: [w - b*v]", "force: [kt*w - b*v]")
    return parse_spec(text.replace("parameters:\n", "parameters:\n  kt: {value: 1, unit: 1}\n", 1), Path("stage.yaml"))


@pytest.fixture(scope="module")
def search(tmp_path_factory: pytest.TempPathFactory) -> Search:
    log, system = log_of(stage(RIPPLE), tmp_path_factory.mktemp("ripple"), "train.csv"), system_of(driven())
    motion = smooth_motion(log)
    problem = Problem(system, motion, {s: {"kt": 0.1, "m": 0.2, "b": 0.6}[s.name] for s in named(system)})
    return search_on(problem, lambda share: record_of(motion, log, share))


@pytest.fixture(scope="module")
def fits(search: Search) -> ForceFits:
    return ForceFits(search, search.refit())


def named(system: System) -> list:
    return [s for name in ("kt", "m", "b") for s in system.values if s.name == name]


@pytest.mark.parametrize(
    ("kind", "place", "known"),
    [
        ("cogging", 0, {"m", "b", "rail_a"}),
        ("saturation", 0, {"m", "b", "rail_a"}),
        ("input_gain", 0, {"m", "b", "rail_a"}),
        ("position_dependent_friction", 0, {"m", "b", "rail_a"}),
        ("load_dependent_friction", 0, set()),  # over the drive that friction leaves at each sample
        ("presliding", 0, set()),  # with a bristle that follows the level
        ("compliance", 0, set()),
    ],
)
def test_slopes_of_a_fit_to_the_force_are_those_of_its_models(
    search: Search, fits: ForceFits, kind: str, place: int, known: set[str]
) -> None:
    """By central differences of the residual of whole models. Those by values in which forces are linear are taken
    from the declared model, since each difference evaluates the whole log.
    """
    system, motion = search.system, search.motion
    part = part_of(CATALOGUE[kind], place, system)
    trial = search.declared_trial.with_part(part)
    sizes = {"limit": 9.0, "k": 4e3, "c": 5.0, "sigma": 5e4, "period": 0.03, "gain": 1.1}
    values = {name: sizes.get(name, 0.3) for name in part.names}
    theta = trial.theta(1.05 * search.declared, [values])
    found = fits._slopes(trial, theta, fits._residual(trial, theta), search.prior(trial, theta).size)
    assert {search.refitted_symbols[k].name for k in fits._known(trial)} == known

    def scaled(theta: np.ndarray) -> np.ndarray:
        model = model_of(trial, theta)
        return fits._scaled(residual_at_drive(model, motion) / drive_gain(model, system, motion))

    for k, slope in enumerate(found):
        step = np.zeros(len(theta))
        step[k] = 1e-4 * max(abs(theta[k]), 1e-3)
        expected = (scaled(theta - step) - scaled(theta + step)) / (2 * step[k])
        error = np.sqrt(np.mean((slope - expected) ** 2) / np.mean(expected**2))
        assert error < (1e-5 if k in fits._known(trial) else 1e-2), trial.symbols[k]  # one-sided, of kinks too


def test_slopes_are_those_of_the_residual_over_the_drive(search: Search) -> None:
    """By central differences of r/gain; along kt, m, b and the level together it does not change at all."""
    problem = search.problem
    system, symbols = problem.system, [*named(problem.system), *problem.levels]
    (rows,) = relative_force_rows(system, problem, symbols, {s: float(system.values[s]) for s in symbols})

    def relative(values: dict[str, float]) -> np.ndarray:
        other = with_values(system, values)
        (at,) = force_rows(other, problem, symbols)
        return at.residual / drive_gain(other, system, problem.motion)[0]

    for k, s in enumerate(symbols):
        value, step = float(system.values[s]), 1e-4 * float(system.values[s])
        found = (relative({s.name: value + step}) - relative({s.name: value - step})) / (2 * step)
        assert rows.slopes[:, k] == pytest.approx(found, abs=1e-5 * np.abs(found).max())
    together = sum(rows.slopes[:, k] * float(system.values[s]) for k, s in enumerate(symbols))
    assert np.abs(together).max() < 1e-9 * np.abs(rows.residual).max()


def test_a_residual_that_nothing_explains_makes_no_drive_weaker(search: Search) -> None:
    base = search.refit()
    refit = adopt_values(search, base, search.system).mapping()
    assert refit["kt"] == pytest.approx(1.0, abs=0.02)
    fits = ForceFits(search, base)
    by_force = dict(zip((s.name for s in search.refitted_symbols), fits.plain.theta, strict=True))
    assert by_force["kt"] == pytest.approx(1.0, abs=0.02)


def test_a_drive_that_is_weaker_by_thirty_percent_is_estimated_as_that(tmp_path: Path) -> None:
    """One linear step from 1 would give 2 − 1/0.7 = 0.57."""
    plant = parse_spec(driven().text.replace("kt: {value: 1,", "kt: {value: 0.7,"), Path("stage.yaml"))
    log, system = log_of(plant, tmp_path, "train.csv"), system_of(driven())
    motion = smooth_motion(log)
    problem = Problem(system, motion, {s: 0.5 for s in system.values if s.name == "kt"})
    search = search_on(problem, lambda share: record_of(motion, log, share))
    judge = CrossValidation(search, search.refit(), system)
    found = judge.map_estimate(judge._by_force, np.ones(judge.count, dtype=bool))
    values = dict(zip((s.name for s in search.refitted_symbols), found.values, strict=True))
    assert values["kt"] == pytest.approx(0.7, abs=0.01)


def test_rows_are_linearised_about_a_change_of_the_values(search: Search) -> None:
    """Their residual is that of the changed system over its drive gain; their slopes are its central differences."""
    problem = search.problem
    system, symbols = problem.system, [*named(problem.system), *problem.levels]
    (rows,) = relative_force_rows(system, problem, symbols, {s: float(system.values[s]) for s in symbols})
    change = np.array([-0.2, 0.3, 1.0, 0.4])
    other = with_values(system, {s.name: float(system.values[s]) + d for s, d in zip(symbols, change, strict=True)})
    (there,) = force_rows(other, problem, symbols)
    expected = there.residual / drive_gain(other, system, problem.motion)[0]
    about = rows.about(change)
    assert about.residual == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    for k in range(len(symbols)):
        step = 1e-5 * np.eye(len(symbols))[k]
        found = (rows.about(change + step).residual - rows.about(change - step).residual) / 2e-5
        assert about.slopes[:, k] == pytest.approx(found, abs=1e-6 * np.abs(found).max())


def test_a_bristle_does_not_tell_the_scale_of_all_forces(tmp_path: Path) -> None:
    """The declared level is 15 % too large. With the residual linearised about it, kt and m became 15 % larger."""
    bristle = "[{kind: presliding, on: rail, parameters: {sigma: 20000}}]"
    log = log_of(parse_spec(driven(bristle).text, Path("stage.yaml")), tmp_path, "train.csv")
    declared = parse_spec(driven().text.replace("law: coulomb, a: 4.0", "law: coulomb, a: 4.6"), Path("stage.yaml"))
    system, motion = system_of(declared), smooth_motion(log)
    assert [float(system.values[s]) for s in system.values if s.name == "rail_a"] == [4.6]
    shares = {"kt": 0.03, "m": 0.03, "b": 0.2}
    tolerances = {s: shares[s.name] * float(system.values[s]) for s in named(system)}
    search = search_on(Problem(system, motion, tolerances), lambda share: record_of(motion, log, share))
    part = part_of(CATALOGUE["presliding"], 0, system)
    base = search.refit()
    fit = search.with_parts(base, base.values[0], [part], [{"sigma": 20000.0}])
    found = named_effects(fit.trial.parts, estimate(fit), system)
    judge = CrossValidation(search, fit, with_effects(system, found))
    for values in (judge.map_estimate(source, judge.is_excited).values for source in judge._sources):
        by_name = dict(zip((s.name for s in search.refitted_symbols), values, strict=True))
        assert by_name["kt"] == pytest.approx(1.0, abs=0.03)
        assert by_name["m"] / by_name["kt"] == pytest.approx(2.0, rel=0.01)
        assert by_name["rail_a"] / by_name["kt"] == pytest.approx(4.0, rel=0.01)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_scale_of_all_forces_is_that_of_the_tolerances(tmp_path: Path, seed: int) -> None:
    """No data tell it, so a common factor on all values must not make the prior density larger: θ'P(θ − declared) = 0.

    The null directions of the two criteria differ where a force is left, and a sum of both took that for a smaller
    scale: the values of these logs were 0.15 to 1.1 % smaller than the tolerances say, those of a voice coil 4 %.
    """
    log = log_of(parse_spec(driven().text, Path("stage.yaml")), tmp_path, "train.csv")
    noise = np.random.default_rng(seed).standard_normal(log.size)
    log.inputs[:, 0] += 1.5 * low_pass(noise, 3.0, log.sample_time) / 0.1
    system, motion = system_of(driven()), smooth_motion(log)
    shares = {"kt": 0.05, "m": 0.05, "b": 0.2}
    problem = Problem(system, motion, {s: shares[s.name] * float(system.values[s]) for s in named(system)})
    search = search_on(problem, lambda share: record_of(motion, log, share))
    judge = CrossValidation(search, search.refit(), system)
    for one in judge._of_all:
        pull = one.values @ problem.prior_information @ (one.values - search.declared)
        assert abs(pull) < 1e-3 * (one.values @ problem.prior_information @ one.values)


@pytest.mark.parametrize(("kind", "values"), [("input_gain", (0.8, 0.9)), ("load_dependent_friction", (0.1, 0.2))])
def test_the_drive_that_is_left_is_computed_once_for_values_that_do_not_act_on_it(
    kind: str, values: tuple[float, float], search: Search, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside a gain a mass and a level do not. For other values that act it is what a new one finds."""
    part = part_of(CATALOGUE[kind], 0, search.system)
    trial, asked, along = search.declared_trial.with_part(part), [], DriveLeft._along
    monkeypatch.setattr(DriveLeft, "_along", lambda self, theta: asked.append(theta) or along(self, theta))

    def theta(value: float, **moved: float) -> np.ndarray:
        declared = dict(zip((s.name for s in search.refitted_symbols), search.declared, strict=True))
        return np.append(list((declared | moved).values()), part.inward({part.names[0]: value}))

    one, levels = DriveLeft(trial, search.motion), [s.name for s in search.problem.levels]
    first = one.at(theta(values[0]))
    again = one.at(theta(values[0], m=2.5, **dict.fromkeys(levels, 3.0)))
    assert kind != "input_gain" or (again is first and len(asked) == 1)
    for other in (theta(values[1]), theta(values[0], kt=1.2)):
        assert np.array_equal(one.at(other), DriveLeft(trial, search.motion).at(other))
    assert not np.array_equal(one.at(theta(values[1])), first)

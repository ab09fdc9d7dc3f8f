"""Starts by least squares on the force residual, against the values that made the log."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import sympy
from scipy.optimize import lsq_linear

from codegen.diagnosis.fit.output_error import Prior
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import Search, search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.starting_values import ForceStart, distributed
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection.candidate_fits import CandidateFits
from codegen.effects import CATALOGUE
from codegen.logs import Log
from tests.diagnosis.stage import log_of, stage, system_of

LACKING = {
    "dead_zone": {"width": 2.5},
    "saturation": {"limit": 12.0},
    "input_gain": {"gain": 0.7},
    "input_delay": {"T": 0.02},
    "actuator_lag": {"tau": 0.03},
}
WEIGHTED = {"offset": {"f0": 2.5}, "spring": {"k": 30.0}, "stribeck": {"delta": 3.0, "v_s": 0.05}}
SLOWER = ("saturation", "input_gain", "input_delay", "actuator_lag")


@pytest.mark.parametrize("kind", ["dead_zone", *(pytest.param(k, marks=pytest.mark.slow) for k in SLOWER), *WEIGHTED])
def test_the_effect_and_the_levels_are_those_of_the_plant(tmp_path: Path, kind: str) -> None:
    """The log was made with the effect and a level of 5.5 N; declared are 4 N and no effect."""
    lacking = (LACKING | WEIGHTED)[kind]
    words = ", ".join(f"{name}: {value}" for name, value in lacking.items())
    on = {"offset": "x", "spring": "x", "stribeck": "rail"}.get(kind, "w")
    log = log_of(stage(f"[{{kind: {kind}, on: {on}, parameters: {{{words}}}}}]", 5.5), tmp_path, "train.csv")
    search = search_in(log)
    base, part = search.refit(), part_of(CATALOGUE[kind], 0, search.system)
    trial = base.runner.trial.with_part(part)
    covered = CandidateFits(search, base, (part,)).covered(part)
    found = ForceStart(search.problem, base).best(trial, covered)
    assert found is not None
    refitted_values, (parameters,) = trial.split(found[1])
    near = 0.1 if kind != "stribeck" else 0.5  # its speed is taken from a coarse grid
    assert parameters == pytest.approx(lacking, rel=near)
    assert refitted_values[0] == pytest.approx(5.5, rel=0.05)


def test_a_force_with_a_curve_of_speed_is_finite_far_above_its_speed(tmp_path: Path) -> None:
    """exp(−(v/v_s)²) at v = 27 v_s is below the range of a double, and in a denominator it is above it.

    A log of two links with a Stribeck curve of 0.09 rad/s, moved at 2.5 rad/s, was refused as out of range.
    """
    with_curve = "[{kind: stribeck, on: rail, parameters: {delta: 1.0, v_s: 0.01}}]"
    system = system_of(stage(with_curve))
    changed = CATALOGUE["load_dependent_friction"].forms[-1].add(system, 0, {"mu_load": sympy.Symbol("s", real=True)})
    (force,) = changed.equation_error - system.equation_error
    values = dict.fromkeys(force.free_symbols, 2.0) | dict(system.values) | {sympy.Symbol("s", real=True): 1e-3}
    values[system.velocities[0]] = 0.271
    functions = {"Magnitude": np.abs, "Sgn": np.sign, "exp": np.exp}
    found = sympy.lambdify(list(values), distributed(force), [functions, "numpy"])(*map(float, values.values()))
    assert found == pytest.approx(float(force.subs(values)))


def test_a_fit_that_diverged_gives_no_start(tmp_path: Path) -> None:
    """An effect was tried beside a load with k = 1e130 N/m, and LAPACK's error ended the diagnosis as bad input."""
    search = search_in(log_of(stage(), tmp_path, "train.csv"))
    base, spring = search.refit(), part_of(CATALOGUE["spring"], 0, search.system)
    load, offset = (part_of(CATALOGUE[kind], 0, search.system) for kind in ("compliance", "offset"))
    spring_of_load = {"k": 900.0, "c": 10.0, "load_fraction": 0.5}
    fit = search.with_parts(base, base.values[0], [load, offset], [spring_of_load, {"f0": 0.5}])
    stiff = load.inward({"k": 1e130, "c": 1e-300, "load_fraction": 1e-130})
    diverged = replace(fit, theta=np.concatenate([fit.theta[:-4], stiff, [0.5]]))
    covered = CandidateFits(search, fit, (spring,)).covered(spring)
    trial = fit.trial.with_part(spring)
    assert ForceStart(search.problem, fit).best(trial, covered) is not None
    assert ForceStart(search.problem, diverged).best(trial, covered) is None


def test_what_was_refitted_in_its_place_follows(tmp_path: Path) -> None:
    """The refitted mass has taken part of a spring's force; it gives that back, or the spring starts too weak."""
    log = log_of(stage("[{kind: spring, on: x, parameters: {k: 30}}]", 5.5), tmp_path, "train.csv")
    system = system_of(stage())
    problem = Problem(system, smooth_motion(log), {s: 0.4 for s in system.values if s.name == "m"})
    search = search_on(problem, partial(record_of, problem.motion, log))
    base, part = search.refit(), part_of(CATALOGUE["spring"], 0, search.system)
    covered = CandidateFits(search, base, (part,)).covered(part)
    trial = base.trial.with_part(part)
    off = {}
    for whole in (False, True):
        found = ForceStart(search.problem, base, whole).best(trial, covered)
        assert found is not None
        off[whole] = abs(trial.split(found[1])[1][0]["k"] / 30 - 1)
    assert off[True] < 0.05 < off[False]


def test_only_the_tolerance_divides_an_effect_from_a_parameter_that_acts_alike(tmp_path: Path) -> None:
    """Viscous friction beside a declared coefficient b of 6 N·s/m that may be off by 100 %; the machine lacks a spring.

    Least squares without the tolerance moves b as far as it may go, to -12, and the effect the other way, for nothing.
    """
    system = system_of(stage())
    log = log_of(stage("[{kind: spring, on: x, parameters: {k: 30}}]", 5.5), tmp_path, "train.csv")
    problem = Problem(system, smooth_motion(log), {s: 6.0 for s in system.values if s.name == "b"})
    search = search_on(problem, partial(record_of, problem.motion, log))
    base, part = search.refit(), part_of(CATALOGUE["viscous"], 0, search.system)
    covered = CandidateFits(search, base, (part,)).covered(part)
    found = ForceStart(search.problem, base, True).best(base.trial.with_part(part), covered)
    assert found is not None
    refitted_values, (values,) = base.trial.with_part(part).split(found[1])
    b = dict(zip((s.name for s in search.refitted_symbols), refitted_values, strict=True))["b"]
    assert b == pytest.approx(6.0, abs=0.6)
    assert abs(values["b"]) < 6


def test_beside_a_value_at_its_limit_the_others_are_the_best() -> None:
    """Four values that act alike, one of which may move by 0.5 and would move by 2: as by scipy's bounded solver."""
    rng, theta, free = np.random.default_rng(1), np.array([7.1, 1.9, 6.9, 0.3]), np.full(4, np.inf)
    columns = rng.standard_normal((60, 4)) + rng.standard_normal((60, 1))
    residual = columns @ np.array([0.3, -0.2, -2.0, 0.1]) + 0.1 * rng.standard_normal(60)
    deviation = np.array([np.inf, np.inf, 0.5, np.inf])
    prior = Prior(np.zeros((4, 4)), deviation, theta, np.ones(4), free, -free, within=1.0)
    base: Any = SimpleNamespace(theta=theta, prior=prior)
    start = ForceStart(cast(Any, None), base, True)
    start.__dict__["_slopes"] = columns  # only their number is used
    step, _ = start._steps(columns, residual, 0)
    assert step == pytest.approx(lsq_linear(columns, -residual, (-deviation, deviation), tol=1e-14).x, rel=1e-6)
    assert step[2] == pytest.approx(0.5)


def test_what_adds_states_or_is_no_force_has_no_such_start(tmp_path: Path) -> None:
    search = search_in(log_of(stage(), tmp_path, "train.csv"))
    base = search.refit()
    for kind in ("compliance", "encoder_eccentricity"):
        part = part_of(CATALOGUE[kind], 0, search.system)
        covered = CandidateFits(search, base, (part,)).covered(part)
        assert ForceStart(search.problem, base).best(base.runner.trial.with_part(part), covered) is None


@pytest.mark.parametrize("whole", [False, True])
def test_an_effect_without_starting_values_has_no_such_start(tmp_path: Path, whole: bool) -> None:
    """A residual without a period over position ended the diagnosis of a belt drive in numpy's words."""
    search = search_in(log_of(stage(), tmp_path, "train.csv"))
    base, part = search.refit(), part_of(CATALOGUE["cogging"], 0, search.system)
    covered = CandidateFits(search, base, (part,)).covered(part)
    none = replace(covered, periods=lambda *_: [])
    assert ForceStart(search.problem, base, whole).best(base.runner.trial.with_part(part), none) is None


def search_in(log: Log) -> Search:
    problem = Problem(system_of(stage()), smooth_motion(log), {})
    return search_on(problem, partial(record_of, problem.motion, log))

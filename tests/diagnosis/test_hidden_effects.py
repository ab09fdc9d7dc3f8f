"""What a log cannot show, since parameters with a tolerance exert the same force."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import sympy

from codegen.diagnosis.evidence.adoption import adopt_values
from codegen.diagnosis.fit.force_rows import ForceRows, independent_samples
from codegen.diagnosis.fit.trial import with_values
from codegen.diagnosis.results import Fact
from codegen.diagnosis.verdict.hidden_effects import _hidden, hidden_effects
from codegen.logs import Log
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import STAGE, TRAIN, log_of, stage
from tests.diagnosis.test_adoption import search_of

GAIN = "[{kind: input_gain, on: w, parameters: {gain: 1.06}}]"


def declared(mass: str, damping: str, force: str = "w - b*v") -> Spec:
    """The stage with tolerances on its mass and its damping; ``force``: as in a spec."""
    text = STAGE.format(effects="[]", level=4, reference=TRAIN, duration=14, noise=0).replace("w - b*v", force)
    text = text.replace("2, unit: kg}", f"2, unit: kg{mass}}}").replace(
        "N*s/m}", f"N*s/m{damping}}}\n  k: {{value: 60, unit: N/m}}"
    )
    return parse_spec(text, Path("stage.yaml"))


def notes(spec: Spec, log: Log) -> list[Fact]:
    """The facts on a gain of the drive after the refit by the tolerances of a spec."""
    search = search_of(spec, log)
    values = adopt_values(search, search.refit(), search.system)
    facts = hidden_effects(search, with_values(search.system, values.mapping()), 0.02)
    return [fact for fact in facts if fact.words.startswith("input_gain on w, an error of up to ")]


def test_a_gain_is_hidden_by_mass_damping_and_level(tmp_path: Path) -> None:
    """The motion with m, b and a over 1.06 is that of the gain, which is within the interval that is stated."""
    (fact,) = notes(declared(", tolerance: 5%", ", tolerance: 30%"), log_of(stage(GAIN), tmp_path, "train.csv"))
    assert " errors of m and b in " in fact.words
    low, high = map(float, re.findall(r"\d+\.\d+", fact.detail))
    assert low < 1.0 < 1.06 < high < 1.3


@pytest.mark.parametrize(("mass", "damping"), [("", ", tolerance: 30%"), ("", "")])
def test_a_known_mass_shows_it(mass: str, damping: str, tmp_path: Path) -> None:
    assert notes(declared(mass, damping), log_of(stage(), tmp_path, "train.csv")) == []


def test_a_known_force_shows_it(tmp_path: Path) -> None:
    """Half of the drive's force is that of a spring of known stiffness: the gain is that of force over position."""
    spring = "[{kind: spring, on: x, parameters: {k: 60}}]"
    log = log_of(stage(spring), tmp_path, "train.csv")
    assert notes(declared(", tolerance: 5%", ", tolerance: 30%", "w - b*v - k*x"), log) == []


SLOPES = np.random.default_rng(3).standard_normal((400, 2))
GAIN_SLOPE = SLOPES @ [1.0, 0.5] + 0.05 * np.random.default_rng(4).standard_normal(400)
PRIOR = np.diag([4.0, 9.0])


def hidden(*coordinates: tuple[Any, Any, Any]) -> tuple[float, float, list[str]] | None:
    """``_hidden`` for values a and b, of a residual, slopes and the slope of an effect for each coordinate."""
    a, b = symbols = sympy.symbols("a b")
    rows = [ForceRows(np.arange(400), residual, slopes, np.zeros(2)) for residual, slopes, _ in coordinates]
    refit: Any = SimpleNamespace(values={a: 1.1, b: 2.2})
    used, declared = np.ones((400, len(rows)), dtype=bool), SimpleNamespace(values={a: 1.0, b: 2.0})
    problem: Any = SimpleNamespace(used=used, uncertain=[a, b], moved=symbols, prior_information=PRIOR, system=declared)
    return _hidden(problem, refit, rows, np.column_stack([d for *_, d in coordinates]), 3.0, 0.2)


def test_interval_and_best_change_are_those_of_the_normal_equations() -> None:
    residual = 0.5 * np.random.default_rng(5).standard_normal(400)
    all_slopes = np.column_stack([SLOPES, GAIN_SLOPE])
    weight = independent_samples(residual) / 400 / np.mean(residual**2)
    matrix = weight * all_slopes.T @ all_slopes + np.diag([4.0, 9.0, 0.0])
    right = -weight * all_slopes.T @ residual + [4.0 * (1.0 - 1.1), 9.0 * (2.0 - 2.2), 0.0]
    covariance = np.linalg.inv(matrix)
    expected = np.linalg.solve(matrix, right)[2], 3.0 * np.sqrt(covariance[2, 2])
    at_rest = np.zeros(400), np.zeros((400, 2)), np.zeros(400)
    for found in (hidden((residual, SLOPES, GAIN_SLOPE)), hidden((residual, SLOPES, GAIN_SLOPE), at_rest)):
        assert found is not None
        assert found[:2] == pytest.approx(expected)


def test_without_noise_nothing_is_hidden() -> None:
    """The information is then infinite; it was computed as 0/0, and the diagnosis ended in a LinAlgError."""
    assert hidden((np.zeros(400), SLOPES, GAIN_SLOPE)) is None

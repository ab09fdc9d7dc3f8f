"""A credited gain of an input is named with the scale of the position as its alternative where both fit the log."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.results import Fact
from codegen.diagnosis.verdict import wrong_values
from codegen.diagnosis.verdict.wrong_values import scaled_position
from codegen.effects import CATALOGUE
from codegen.logs import Log
from codegen.spec import parse_spec
from tests.diagnosis.stage import STAGE, TRAIN, log_of, system_of
from tests.machines import one_mass


def _remarks(kind: str, monkeypatch: pytest.MonkeyPatch, scale_fits: bool = True) -> list[Fact]:
    spec, system = one_mass(a=50)
    found = SimpleNamespace(kind=kind, on="u", parameters={"value": 5.0})
    answer = SimpleNamespace(verdict="effect", effects=(found,), refit=system, augmented=system)
    monkeypatch.setattr(wrong_values, "_as_well_by_scale", lambda problem, written, gain: scale_fits)
    none = np.zeros((2, 1))
    log = Log(Path("a.csv"), "a", none[:, 0], none, None, none, 1e-3, None, None, None, ())
    return scaled_position(answer, log, spec, None)  # type: ignore[arg-type]


def test_gain_of_five_is_a_position_five_times_too_large(monkeypatch: pytest.MonkeyPatch) -> None:
    (fact,) = _remarks("input_gain", monkeypatch)
    assert fact.topic == "next" and "`scale: {x: 0.2}`" in fact.words
    assert "10 N in place of 50 N" in fact.detail  # 50 N/5: friction does not grow with the position


@pytest.mark.parametrize("kind", sorted(set(CATALOGUE) - {"input_gain"}))
def test_no_other_effect_is_a_scale(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert _remarks(kind, monkeypatch) == []


def test_a_scale_that_does_not_fit_is_not_named(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _remarks("input_gain", monkeypatch, scale_fits=False) == []


@pytest.mark.parametrize(("weight", "fits"), [(0, True), (20, False)])
def test_a_scale_fits_where_no_constant_force_acts(weight: int, fits: bool, tmp_path: Path) -> None:
    """A drive twice as strong, from x/2: M a, b v and the level are halved by both, a weight by the gain alone."""

    def spec(effects: str):
        text = STAGE.format(effects=effects, level=4, reference=TRAIN, duration=8.0, noise=0)
        text = text.replace("  b: {value", f"  c: {{value: {weight}, unit: N}}\n  b: {{value")
        return parse_spec(text.replace("w - b*v", "w - b*v - c"), Path("stage.yaml"))

    strong = spec("[{kind: input_gain, on: w, parameters: {gain: 2}}]")
    log = log_of(strong, tmp_path, "train.csv")
    problem = Problem(system_of(spec("[]")), smooth_motion(log), {})
    assert wrong_values._as_well_by_scale(problem, system_of(strong), 2.0) is fits

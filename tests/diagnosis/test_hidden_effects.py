"""What a log cannot show, since parameters with a tolerance exert the same force."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from codegen.diagnosis.fit.trial import with_values
from codegen.diagnosis.results import Fact
from codegen.diagnosis.verdict.adoption import adopt_values
from codegen.diagnosis.verdict.hidden_effects import hidden_effects
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
    search, problem = search_of(spec, log)
    values = adopt_values(search, search.refit(), problem, search.system)
    facts = hidden_effects(search, with_values(search.system, values.mapping()), problem, 0.02)
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

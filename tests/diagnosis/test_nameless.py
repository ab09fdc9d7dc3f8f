"""Forces over position that no effect describes: a torque ripple that grows with the current is no friction."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.results import Diagnosis
from codegen.effects import CATALOGUE
from codegen.effects.nameless import NAMELESS, effect_called
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import TEST, TRAIN, among, log_of, stage, system_of

LEVEL, PERIOD = 25.0, 0.06
"""Friction takes most of the drive force: the inertia takes 6 N at most, the damping 5 N."""
WAVE = f"{{amplitude: 5.0, period: {PERIOD}, phase: 0.4}}"
OF_POSITION = ("position_dependent_friction", "cogging", "offset")


def machine(effects: str = "", share: float = 0.0, reference: str = TRAIN, duration: float = 14.0) -> Spec:
    """The stage with a motor whose force is 1 + share·sin(2π x/period) times the commanded one."""
    text = stage(f"[{effects}]", LEVEL, reference, duration).text
    text = text.replace("  b: {", f"  p: {{value: {PERIOD}, unit: m}}\n  b: {{")
    return parse_spec(text.replace("[w - b*v]", f"[w*(1 + {share}*sin(2*pi*x/p)) - b*v]"), Path("stage.yaml"))


def diagnosed(folder: Path, effects: str = "", share: float = 0.0, reference: str = TRAIN) -> Diagnosis:
    train = log_of(machine(effects, share, reference), folder, "train.csv")
    test = log_of(machine(effects, share, TEST if reference == TRAIN else reference, 10.0), folder, "test.csv")
    spec = stage(level=LEVEL)
    with among(*OF_POSITION):
        return diagnose_log(spec, system_of(spec), train, test)[0]


def test_a_ripple_in_proportion_to_the_drive_force_is_not_named_as_friction(tmp_path: Path) -> None:
    diagnosis = diagnosed(tmp_path, share=0.2)
    assert diagnosis.verdict == "unknown" and not diagnosis.effects
    (reason,) = diagnosis.statement.of("not credited")
    assert "in proportion to the drive force and periodic in position (amplitude 20" in reason
    assert f"period {PERIOD:.3g} m)" in reason
    assert "better than position_dependent_friction on rail" in reason
    assert any("under another load" in words for words in diagnosis.statement.of("next"))


@pytest.mark.parametrize(("kind", "on"), [("position_dependent_friction", "rail"), ("cogging", "x")])
def test_a_true_effect_over_position_keeps_its_name(kind: str, on: str, tmp_path: Path) -> None:
    diagnosis = diagnosed(tmp_path, f"{{kind: {kind}, on: {on}, parameters: {WAVE}}}")
    assert diagnosis.verdict == "effect" and [e.kind for e in diagnosis.effects] == [kind]


def test_no_spec_can_declare_a_force_without_a_name() -> None:
    assert not NAMELESS.keys() & CATALOGUE.keys()
    assert all(effect_called(kind) is effect for kind, effect in (NAMELESS | CATALOGUE).items())
    named = {kind for effect in CATALOGUE.values() for kind in effect.nameless}
    assert named == NAMELESS.keys() and not any(effect.nameless for effect in NAMELESS.values())

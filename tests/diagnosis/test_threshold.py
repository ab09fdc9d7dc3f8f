"""A drive that ignores commands below a threshold, on an axis that holds a weight: few commands are that small."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.diagnose import diagnose_log
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import STAGE, TEST, TRAIN, among, log_of, system_of


def lift(effects: str = "[]", reference: str = TRAIN, duration: float = 14.0) -> Spec:
    """The stage upright, held against 20 N."""
    text = STAGE.format(effects=effects, level=4, reference=reference, duration=duration, noise=0)
    text = text.replace("force: [w - b*v]", "force: [w - b*v - W]")
    text = text.replace("parameters:\n", "parameters:\n  W: {value: 20, unit: N}\n", 1)
    return parse_spec(text, Path("lift.yaml"))


FEW = ("dead_zone", "saturation", "input_gain", "offset", "viscous")


@pytest.mark.slow  # in make test a threshold is found where it is small: tests/effects/test_actuator_forms.py
@pytest.mark.parametrize("kinds", [(), FEW])
def test_a_threshold_near_the_smallest_commands_is_found(tmp_path: Path, kinds: tuple[str, ...]) -> None:
    """It is more than a fifth of the largest command, and few commands are below it."""
    effects = "[{kind: dead_zone, on: w, parameters: {threshold: 15}}]"
    train = log_of(lift(effects), tmp_path, "train.csv")
    test = log_of(lift(effects, TEST, 10.0), tmp_path, "test.csv")
    small = np.abs(train.inputs[:, 0]) < 15
    assert 0.02 < small.mean() < 0.25
    spec = lift()
    with among(*kinds):
        found, _ = diagnose_log(spec, system_of(spec), train, test)
    assert [(e.kind, e.on) for e in found.effects] == [("dead_zone", "w")]
    assert found.effects[0].parameters["threshold"] == pytest.approx(15, rel=0.005)

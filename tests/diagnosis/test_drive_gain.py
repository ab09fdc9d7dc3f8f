"""The drive gain of a fit's models is evaluated once for all values on which the drive force does not depend."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from codegen.diagnosis.fit.drive import drive_gain
from codegen.diagnosis.fit.residual import moves_sensors
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import Trial, model_of, part_of
from codegen.diagnosis.selection import force_fits
from codegen.diagnosis.selection.force_fits import DriveGain
from codegen.effects import CATALOGUE
from codegen.spec import parse_spec
from tests.diagnosis.stage import log_of, stage, system_of

KINDS = "input_gain", "cogging", "load_dependent_friction", "encoder_eccentricity", "saturation"


@pytest.mark.parametrize("kind", KINDS)
def test_the_drive_gain_of_a_trial_is_that_of_its_models(kind: str, tmp_path: Path) -> None:
    text = stage().text.replace("w - b*v", "k*w - b*v").replace("  b: {value", "  k: {value: 1, unit: 1}\n  b: {value")
    spec = parse_spec(text, Path("stage.yaml"))
    system, motion = system_of(spec), smooth_motion(log_of(stage(), tmp_path, "train.csv"))
    moved = tuple(s for s in system.values if s.name in ("rail_a", "k", "m"))
    trial = Trial(system, (part_of(CATALOGUE[kind], 0, system), part_of(CATALOGUE["offset"], 0, system)), moved)
    start = [float(system.values[s]) for s in moved] + [0.3 + 0.1 * k for k in range(len(trial.symbols) - len(moved))]
    other = system_of(stage())
    kept = DriveGain(trial, other, motion)
    calls: list[object] = []

    def counted(*given: object) -> object:
        calls.append(given)
        return drive_gain(*given)  # type: ignore[arg-type]

    with patch.object(force_fits, "drive_gain", counted):
        for k in [None, *range(len(start))]:
            theta = np.array(start)
            if k is not None:
                theta[k] *= 1.1
            np.testing.assert_array_equal(kept.at(theta), drive_gain(model_of(trial, theta), other, motion))
    assert len(calls) < len(start) or moves_sensors(trial)  # a sensor's error moves all of the motion

"""What the test log shows and the training log does not is said, whatever the verdict on the training log is."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.results import Diagnosis
from tests.diagnosis.stage import among, competing, log_of, stage, system_of

LIMIT = "[{kind: saturation, on: w, parameters: {limit: 16}}]"
"""The slow motion takes up to 15 N once it has begun, and the fast one 20 N."""
SLOW, FAST = "0.2*sin(2*pi*0.4*t) + 0.06*sin(2*pi*0.9*t)", "0.2*sin(2*pi*0.4*t) + 0.06*sin(2*pi*1.3*t)"


def diagnosis(tmp_path: Path, test: str, kinds: tuple[str, ...] = ()) -> Diagnosis:
    train, held_out = (
        log_of(stage(LIMIT, reference=motion), tmp_path, name) for motion, name in ((SLOW, "a.csv"), (test, "b.csv"))
    )
    with among(*kinds):
        return diagnose_log(stage(), system_of(stage()), train, held_out)[0]


@competing("saturation", "input_gain", "viscous")
def test_an_effect_that_acts_in_the_test_log_alone_is_said_to_be_there(tmp_path: Path, kinds: tuple[str, ...]) -> None:
    found = diagnosis(tmp_path, FAST, kinds)
    (words,) = [f.words for f in found.statement.facts if f.words.startswith("On the test log")]
    assert not found.effects and found.augmented.relative_force > 0.05
    assert f"{100 * found.augmented.relative_force:.2g} % of the drive force" in words and "both together" in words


@pytest.mark.slow
def test_the_same_motion_again_gets_no_such_sentence(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, SLOW)
    assert not found.effects and not [f for f in found.statement.facts if "test log" in f.words]

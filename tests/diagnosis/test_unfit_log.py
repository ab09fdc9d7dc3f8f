"""A log that fits its spec so little that nothing can be fitted: the preflight's words, not a singular matrix."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from codegen.base.resources import resource_folder
from codegen.diagnosis.diagnose import diagnose_log
from codegen.effects.declare import system_of
from codegen.spec import parse_spec
from tests.diagnosis.stage import log_of, stage
from tests.expected_errors import refused


def test_a_time_in_milliseconds_is_told_for_an_arm(tmp_path: Path) -> None:
    text = (resource_folder("specs") / "two_link_arm.yaml").read_text(encoding="utf-8")
    spec = parse_spec(text, tmp_path / "arm.yaml")
    plant = parse_spec(text.replace("m1: {value: 0.7718", "m1: {value: 1.00334"), tmp_path / "plant.yaml")
    log = log_of(plant, tmp_path, "log.csv", fine=True)  # the fit must have no finite numbers: there this is told
    slow = replace(log, time=1000 * log.time, sample_time=1000 * log.sample_time)
    with refused("LOG012"):
        diagnose_log(spec, system_of(spec), slow)


def test_a_wrong_sign_is_told_before_few_stretches_in_motion(tmp_path: Path) -> None:
    """A short log with a low cutoff was refused for its length, though more of it would have been unfit too."""
    log = replace(log_of(stage(duration=8.0), tmp_path, "log.csv"), cutoff_hz=2.5)
    with refused("LOG009 at least 12"):
        diagnose_log(stage(), system_of(stage()), log)
    with refused("LOG012 sign `scale: {w: -1}` corrects"):  # the remedy is not cut off
        diagnose_log(stage(), system_of(stage()), replace(log, inputs=-log.inputs))

"""A seven-joint arm from its robot file, 25 s at 200 Hz: the effect that one joint lacks, in three minutes of CPU."""

from __future__ import annotations

import resource
from pathlib import Path

import pytest

import stiction
from benchmarks.diagnosis_time.__main__ import simulated_arm

LONGEST_S = 180


def _cpu() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


@pytest.mark.slow
def test_the_joint_that_lacks_an_effect_is_found_in_three_minutes(tmp_path: Path) -> None:
    spec, log = simulated_arm(tmp_path)
    told: list[tuple[str, float]] = []
    before = _cpu()
    result = stiction.diagnose(
        spec,
        log,
        out=tmp_path / "out",
        progress=lambda station, share: told.append((station, share)),
    )
    assert _cpu() - before < LONGEST_S
    (effect,) = result.diagnosis.effects
    assert (effect.kind, effect.on) == ("cogging", "elbow_pitch")
    assert effect.parameters["amplitude"] == pytest.approx(2.0, rel=0.02)
    assert effect.parameters["period"] == pytest.approx(0.35, rel=0.002)
    assert len(told) > 50

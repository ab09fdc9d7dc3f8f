"""Starts of a compliance, against the load behind a spring that made the log."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnosis.coverage import survey
from codegen.diagnosis.signals import smooth_motion
from codegen.diagnosis.trial import part_of
from codegen.effects import CATALOGUE
from tests.diagnosis.stage import log_of, stage, system_of


@pytest.mark.parametrize(
    ("k", "c", "share"),
    [(2500.0, 4.0, 0.3), *(pytest.param(*p, marks=pytest.mark.slow) for p in ((300.0, 3.0, 0.5), (1000.0, 8.0, 0.8)))],
)
def test_the_residual_tells_frequency_and_share_of_a_load(tmp_path: Path, k: float, c: float, share: float) -> None:
    """ω = √(k/(ρM)) of the load against a held motor; grid points are a tenth apart."""
    lacking = f"[{{kind: compliance, on: x, parameters: {{k: {k}, c: {c}, load_fraction: {share}}}}}]"
    log = log_of(stage(lacking), tmp_path, "train.csv")
    system = system_of(stage())
    part = part_of(CATALOGUE["compliance"], 0, system)
    motion = smooth_motion(log)
    best = survey(system, motion).covered(part, [4.0], motion.measured.std(axis=0)).resonances()[0]
    found = best["k"] / best["load_fraction"]
    assert found**0.5 == pytest.approx((k / share) ** 0.5, rel=0.08)
    assert best["load_fraction"] == pytest.approx(share, abs=0.12)

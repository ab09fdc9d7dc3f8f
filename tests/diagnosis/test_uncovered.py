"""A wave of which the log covers less than a period: it is not credited, and neither is anything in its place."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import patch

import pytest

from codegen.diagnosis import free_runs
from codegen.diagnosis.verdict import uncovered
from tests.diagnosis.stage import diagnosed

OF_POSITION = ("cogging", "spring", "hardening_spring", "offset", "position_dependent_friction")
"""The stage moves over 0.517 m."""


def wave(period: float, phase: float = 0.3, kind: str = "cogging", on: str = "x") -> str:
    return f"[{{kind: {kind}, on: {on}, parameters: {{amplitude: 1.5, period: {period:g}, phase: {phase:g}}}}}]"


@pytest.mark.parametrize(("period", "phase", "sum_named"), [(0.553, 0.3, True), (0.6, 0.3, True), (0.553, 1.6, False)])
def test_no_sum_of_other_effects_is_named_in_place_of_a_long_wave(
    period: float, phase: float, sum_named: bool, tmp_path: Path
) -> None:
    """A spring of -13 N/m and a hardening spring were named, or no effect at all."""
    diagnosis, _ = diagnosed(wave(period, phase), tmp_path, kinds=OF_POSITION)
    said = diagnosis.statement
    assert diagnosis.verdict == "unknown" and diagnosis.effects == ()
    assert said.headline == "Something is missing, perhaps cogging on x, but the log covers only part of its period."
    reason, *less = said.of("not credited")
    assert f"covers only 0.51{8 if period > 0.553 else 7} m of the period of cogging, {period:g} m" in reason
    words = "It explains more than spring on x and hardening_spring on x together."
    assert less == ([words] if sum_named else [])
    assert said.of("next") == (f"Log a motion over at least {period:g} m on x, and diagnose again.",)


def test_a_long_wave_is_not_nothing(tmp_path: Path) -> None:
    """Of 2.1 % of the drive force the refitted level took so much that 1.9 % were left: "nothing to correct"."""
    of_friction = wave(0.553, kind="position_dependent_friction", on="rail")
    with patch.object(free_runs, "is_small", return_value=True):
        diagnosis, _ = diagnosed(of_friction, tmp_path, kinds=("position_dependent_friction", "offset"))
    assert diagnosis.verdict == "unknown"
    assert "perhaps position_dependent_friction on rail" in diagnosis.statement.headline


def test_a_true_sum_is_named_beside_a_long_wave(tmp_path: Path) -> None:
    plant = "[{kind: spring, on: x, parameters: {k: -13}}, {kind: hardening_spring, on: x, parameters: {k3: 160}}]"
    diagnosis, _ = diagnosed(plant, tmp_path, kinds=OF_POSITION)
    assert any("nothing shows that it repeats" in c.why_not for c in diagnosis.candidates)
    assert diagnosis.verdict == "effect" and {e.kind for e in diagnosis.effects} == {"spring", "hardening_spring"}


def test_a_wave_that_the_log_covers_is_named(tmp_path: Path) -> None:
    diagnosis, _ = diagnosed(wave(0.49), tmp_path, kinds=OF_POSITION)
    assert diagnosis.verdict == "effect" and [e.kind for e in diagnosis.effects] == ["cogging"]


def test_a_wave_whose_period_is_unsure_refuses_no_other_effect(tmp_path: Path) -> None:
    """Waves that imitate a spring within their period had intervals of 8 to 780 % of it: no stroke can be stated."""
    with patch.object(uncovered, "SURE", 1e-9):
        diagnosis, _ = diagnosed(wave(0.57), tmp_path, kinds=OF_POSITION)
    assert diagnosis.verdict == "effect" and {e.kind for e in diagnosis.effects} == {"spring", "hardening_spring"}

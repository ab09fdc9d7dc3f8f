"""A credited gain of an input is named with the scale of the position as its alternative where both fit the log."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from codegen.diagnosis import wrong_values
from codegen.diagnosis.wrong_values import scaled_position
from codegen.effects import CATALOGUE
from codegen.logs.description import SAYS_NOTHING
from tests.machines import one_mass


def _remarks(kind: str, monkeypatch: pytest.MonkeyPatch, scale_fits: bool = True) -> list[str]:
    spec, system = one_mass(a=50)
    found = SimpleNamespace(kind=kind, on="u", parameters={"value": 5.0})
    answer = SimpleNamespace(verdict="effect", effects=(found,), refit=system, augmented=system)
    monkeypatch.setattr(wrong_values, "_as_well_by_scale", lambda problem, written, gain: scale_fits)
    return scaled_position(answer, SimpleNamespace(description=SAYS_NOTHING), spec, None)  # type: ignore[arg-type]


def test_gain_of_five_is_a_position_five_times_too_large(monkeypatch: pytest.MonkeyPatch) -> None:
    (words,) = _remarks("input_gain", monkeypatch)
    assert "`scale: {x: 0.2}`" in words
    assert "10 N in place of 50 N" in words  # 50 N/5: friction does not grow with the position


@pytest.mark.parametrize("kind", sorted(set(CATALOGUE) - {"input_gain"}))
def test_no_other_effect_is_a_scale(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert _remarks(kind, monkeypatch) == []


def test_a_scale_that_does_not_fit_is_not_named(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _remarks("input_gain", monkeypatch, scale_fits=False) == []

"""A credited gain of an input is named with the scale of the position as its alternative; another effect is not."""

from types import SimpleNamespace

import pytest

from codegen.diagnosis.wrong_values import scaled_position
from codegen.effects import CATALOGUE
from codegen.logs.description import SAYS_NOTHING
from tests.machines import one_mass


def _remarks(kind, value):
    spec, system = one_mass(a=50)
    found = SimpleNamespace(kind=kind, on="u", parameters={"value": value})
    answer = SimpleNamespace(verdict="effect", effects=(found,), refit=system, augmented=system)
    return scaled_position(answer, SimpleNamespace(description=SAYS_NOTHING), spec)


def test_gain_of_five_is_a_position_five_times_too_large():
    (words,) = _remarks("input_gain", 5.0)
    assert "`scale: {x: 0.2}`" in words
    assert "10 N in place of 50 N" in words  # (50 N)/5: friction does not grow with the position


@pytest.mark.parametrize("kind", sorted(set(CATALOGUE) - {"input_gain"}))
def test_no_other_effect_is_a_scale(kind):
    assert _remarks(kind, 5.0) == []

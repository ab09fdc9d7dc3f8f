"""A constant force larger than the friction level is no asymmetry of friction: friction does not push."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.effects import CATALOGUE
from tests.diagnosis.stage import among, diagnosed, stage, system_of

FEW = ("offset", "coulomb_asymmetry", "viscous")


@pytest.mark.parametrize(("d", "physical"), [(3.9, True), (-3.9, True), (4.1, False), (-4.1, False)])
def test_neither_level_is_negative(d: float, physical: bool) -> None:
    assert CATALOGUE["coulomb_asymmetry"].admissible(system_of(stage()), 0, {"d": d}) == physical


@pytest.mark.slow  # in make test it is the level that is not admissible
@pytest.mark.parametrize("kinds", [(), FEW])
def test_a_force_above_the_level_is_an_offset(tmp_path: Path, kinds: tuple[str, ...]) -> None:
    """A payload on a vertical axis was named an asymmetry of 43 N on friction of 29 N."""
    with among(*kinds):
        found, _ = diagnosed("[{kind: offset, on: x, parameters: {f0: 7}}]", tmp_path)
    (effect,) = found.effects
    assert (effect.kind, effect.on) == ("offset", "x")
    assert effect.parameters["f0"] == pytest.approx(7, rel=0.01)

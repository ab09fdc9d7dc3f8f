"""An eigenvalue that no gain moves: the condition 0 > 0 is said, not left out as if it held."""

from __future__ import annotations

from pathlib import Path

from codegen.analysis.analysis import analyse
from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.spec import parse_spec
from tests.machines import TWO_MASS


def test_a_gain_on_the_other_mass_leaves_an_impossible_condition() -> None:
    """K_2 feeds back the first mass, the contact acts on the second: Ψ = 0, which once had no condition at all."""
    text = TWO_MASS.replace("[[1, 0], [-1, 1]]", "[[0], [1]]").replace(
        "    - {name: between, law: coulomb, a: 10, unit: N}\n", ""
    )
    text += "observer: {kind: mgto, velocity: measured, gains: {K_1: [[0, 0]], K_2: [[-5, 0]]}, sample_time: 0.001}\n"
    spec = parse_spec(text, Path("two_mass.yaml"))
    found = analyse(spec, build_observer(spec, build_system(spec)))
    assert found.spectral_abscissa == 0
    assert [c.expression for c in found.routh] == [0]
    assert not any(c.holds for c in found.routh)

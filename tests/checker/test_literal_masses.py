"""A mass matrix of plain numbers: constants of the C are exact quotients, of which the proof holds as of parameters."""

from fractions import Fraction
from pathlib import Path

import pytest

import stiction
from codegen.program.graph import Graph
from codegen.program.lower import lower
from codegen.program.simplify import constant_product
from tests.app.command import stiction as command

ONE_MASS = (Path(__file__).parents[2] / "specs" / "one_mass.yaml").read_text("utf-8")
THREE_MASSES = """
name: masses
coordinates:
  x1: {velocity: v1, unit: m}
  x2: {velocity: v2, unit: m}
  x3: {velocity: v3, unit: m}
inputs:
  w: {unit: N}
mass_matrix: [[3, 1, 0], [1, 4, -1], [0, -1, 2]]
force: [w, 0, 0]
friction:
  distribution: [[1], [-1], [0]]
  contacts:
    - {name: rail, law: coulomb, a: 12, unit: N}
observer:
  kind: gcfo
  velocity: estimated
  gains: {K_F: [20], K_v: [60, 60, 60]}
  sample_time: 0.004
envelope:
  v1: [-5, 5]
  v2: [-5, 5]
  v3: [-5, 5]
"""


def of_mass(mass: str) -> str:
    assert ONE_MASS.count("  - [m]\n") == 1
    return ONE_MASS.replace("  - [m]\n", f"  - [{mass}]\n")


@pytest.mark.parametrize(
    "text", [of_mass("3"), of_mass("0.3"), of_mass("m/3"), THREE_MASSES], ids=["3", "0.3", "m/3", "three masses"]
)
def test_a_certificate_is_bound_to_the_c(text: str, tmp_path: Path) -> None:
    """1/3 was a rounded decimal in the C, so the proof of a mass of 3 kg was none of it: status 5."""
    (tmp_path / "s.yaml").write_text(text)
    made = command("generate", tmp_path / "s.yaml", "-o", tmp_path / "made")
    assert made.code == 0 and "not proved" not in made.out + made.err
    assert command("verify", tmp_path / "made" / "certificate.json").code == 0


def test_constants_are_the_nearest_doubles_of_the_exact_quotients(tmp_path: Path) -> None:
    """LDLᵀ by hand has the pivots 3, 11/3 and 19/11, and 11/19 · 3/11; 0.27272727272727276 was in the C for 3/11."""
    (tmp_path / "s.yaml").write_text(THREE_MASSES)
    code = lower(stiction.load(tmp_path / "s.yaml").program)
    found = dict(zip((a.name for a in code.derived), code.derived_values, strict=True))
    assert {float(Fraction(*one)) for one in ((1, 3), (3, 11), (3, 19))} <= {abs(v) for v in found.values()}


def test_a_constant_beyond_a_double_is_an_arithmetic_error() -> None:
    """A verb tells it as a spec whose numbers are too large; Fraction would raise a ValueError."""
    graph = Graph()
    large, third = graph.number(1e200), graph.quotient(graph.number(1.0), graph.number(3.0))
    with pytest.raises(ArithmeticError, match="range of a double"):
        constant_product([large, large, third], graph)

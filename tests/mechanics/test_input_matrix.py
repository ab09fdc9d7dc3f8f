"""B where g is linear in w, and the entry that shows that it is not."""

from __future__ import annotations

import pytest
import sympy

from codegen.mechanics.system import NonlinearInput

from .forms import CART_CONSTRAINTS, SPECS, read

ARM = (SPECS / "two_link_arm.yaml").read_text()


def test_b_of_the_arm_and_of_the_two_masses() -> None:
    assert read(ARM)[1].input_matrix == sympy.eye(2)
    assert read((SPECS / "two_mass.yaml").read_text())[1].input_matrix == sympy.Matrix([0, 1])
    assert read(CART_CONSTRAINTS)[1].input_matrix == sympy.Matrix([1, 0])


@pytest.mark.parametrize(
    ("force", "entry"),
    [
        ("w1*cos(theta2)*(1 + omega1**2/(gravity/l1)) - w2/3", [[1, -1], [0, 1]]),
        ("(w1 + w2)**2/(2*w2 + 2*w1)", [[1, 1], [0, 1]]),
    ],
)
def test_b_may_depend_on_the_state(force: str, entry: list[list[int]]) -> None:
    """B against differences of g over steps of 1 in w, which are exact where g is linear."""
    system = read(ARM.replace("  - w1\n", f"  - {force}\n"))[1]
    found = system.input_matrix
    assert isinstance(found, sympy.MatrixBase)
    w1, w2 = system.inputs
    for j, step in enumerate([{w1: 4, w2: 7}, {w1: 3, w2: 8}]):
        change = system.force.subs(step) - system.force.subs({w1: 3, w2: 7})
        assert sympy.simplify(change - found[:, j]) == sympy.zeros(2, 1)
        assert [bool(e) for e in found[:, j]] == [bool(row[j]) for row in entry]


@pytest.mark.parametrize(
    ("force", "entry", "slope"),
    [
        ("w1*w2/(l1*m1*gravity)", "w1", "w2"),
        ("l1*m1*gravity*tanh(w2/(l1*m1*gravity))", "w2", "tanh"),
        ("l1*m1*gravity*sgn(w2)", "w2", "0"),
        ("abs(w1)", "w1", "sgn(w1)"),
    ],
)
def test_a_nonlinear_input_is_told(force: str, entry: str, slope: str) -> None:
    found = read(ARM.replace("  - w1\n", f"  - {force}\n"))[1].input_matrix
    assert isinstance(found, NonlinearInput)
    assert found.coordinate == "theta1" and found.input == entry and slope in str(found.slope)
    assert f"the force on theta1 is not linear in {entry}" in found.reason

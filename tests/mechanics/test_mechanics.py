"""The System's matrices, its numbers through CasADi, and M a = r without an inverse."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import casadi
import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.base.errors import BadInput, Place
from codegen.mechanics import build_system
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.solve import factorised
from codegen.spec import parse_spec
from codegen.spec.expression import parse_expression
from codegen.spec.model import symbol
from tests.expected_errors import matches
from tests.machines import bare_machine
from tests.observers.by_hand import BY_HAND, magnitude
from tests.slow_cases import examples


def evaluate(expression: Any, values: dict[Any, float]) -> Any:
    names = {s: casadi.SX(v) for s, v in values.items()}
    return np.array(casadi.DM(casadi.densify(to_casadi(expression, names))))


@pytest.mark.parametrize("effects", [False, True])
@pytest.mark.parametrize("name", BY_HAND)
def test_the_equation_of_motion_is_the_one_written_by_hand(name: str, effects: bool) -> None:
    """g − M a − U λ at random motions; rounding of some dozens of operations on numbers up to 1e3."""
    system, hand = bare_machine(name, effects), BY_HAND[name]
    generator, n = np.random.default_rng(3), system.degrees_of_freedom
    levels = [system.values[c.law_parameters["a"]] for c in system.contacts]
    for _ in range(20):
        x, v, a, w = (generator.normal(size=k) for k in (n, n, n, hand.inputs))
        values = {s: float(value) for s, value in system.values.items()}
        values |= dict(zip((*system.positions, *system.velocities, *system.inputs), (*x, *v, *w), strict=True))
        values |= dict(zip(system.accelerations, a, strict=True))
        u = hand.distribution(x).T @ v
        friction = np.sign(u) * np.array(levels, dtype=float) + hand.known_friction(u, effects)
        right = hand.total_force(x, v, w, effects) - hand.mass(x) @ a - hand.distribution(x) @ friction
        np.testing.assert_allclose(evaluate(system.equation_error, values).ravel(), right, rtol=1e-11, atol=1e-11)
        kept = hand.total_force(x, v, w, effects) - hand.distribution(x) @ hand.known_friction(u, effects)
        np.testing.assert_allclose(
            evaluate(system.force - system.distribution * system.known_friction(system.slip_velocity), values).ravel(),
            kept,
            rtol=1e-11,
            atol=1e-11,
        )


FORMS = {
    "x - 2*v": lambda x, v: x - 2 * v,
    "-x - v": lambda x, v: -x - v,
    "-(x*v)/3": lambda x, v: -x * v / 3,
    "x**7": lambda x, v: x**7,
    "x**-3": lambda x, v: 1 / (x * x * x),
    "(2 + x**2)**(1/2)": lambda x, v: np.sqrt(2 + x * x),
    "(2 + x**2)**(-1/2)": lambda x, v: 1 / np.sqrt(2 + x * x),
    "(2 + x**2)**0.7": lambda x, v: (2 + x * x) ** 0.7,
    "exp(-x)*exp(2*v)": lambda x, v: np.exp(2 * v - x),
    "x/v/7*2/5": lambda x, v: x * 2 / (35 * v),
    "-x/(-v)": lambda x, v: x / v,
    "sgn(v)*abs(x)": lambda x, v: np.sign(v) * np.abs(x),
    "v*abs(v)": lambda x, v: v * np.abs(v),
    "tanh(x) + tan(v/3) - log(4 + x*v)": lambda x, v: np.tanh(x) + np.tan(v / 3) - np.log(4 + x * v),
    "pi*x": lambda x, v: np.pi * x,
    "sqrt(v**2)": lambda x, v: np.abs(v),
    "0*x": lambda x, v: 0 * x,
}


@pytest.mark.parametrize("words", FORMS)
def test_casadi_gives_what_numpy_gives(words: str) -> None:
    names = {"x": symbol("x"), "v": symbol("v")}
    expression = parse_expression(words, Place("t")).symbolic(names)
    for x, v in np.random.default_rng(5).uniform(-1.5, 1.5, (40, 2)):
        found = float(evaluate(expression, {names["x"]: x, names["v"]: v}).item())
        assert found == pytest.approx(FORMS[words](x, v), rel=1e-13, abs=1e-15)  # a few roundings


@settings(max_examples=examples(60), deadline=None)
@given(st.integers(1, 7), st.integers(0, 2**32 - 1), st.floats(0.0, 0.8))
def test_the_unrolled_solve_is_the_solve(n: int, seed: int, sparsity: float) -> None:
    """Random positive definite M, with structural zeros, against LAPACK: to 1e-15 times condition number times n."""
    generator = np.random.default_rng(seed)
    root = generator.normal(size=(n, n)) * (generator.uniform(size=(n, n)) > sparsity)
    mass = root @ root.T + 0.5 * np.eye(n)
    right = generator.normal(size=(n, 3))
    symbols = casadi.SX.sym("m", n, n)
    pattern = casadi.SX(n, n)
    for i, j in zip(*np.nonzero(mass), strict=True):
        pattern[int(i), int(j)] = symbols[int(max(i, j)), int(min(i, j))]
    exact = np.linalg.solve(mass, right)
    near = 1e-15 * n * np.linalg.cond(mass) * np.abs(exact).max()
    for symmetric in (pattern, casadi.SX(casadi.sparsify(mass))):  # pivots that vary, and constant ones
        for reciprocals in (True, False):
            columns = factorised(symmetric, reciprocals).solve_columns(casadi.SX(right))
            found = np.array(casadi.Function("solve", [symbols], [columns])(mass))
            np.testing.assert_allclose(found, exact, rtol=0, atol=near)
    alone = casadi.Function("solve", [symbols], [factorised(pattern).solve(casadi.SX(right[:, 0]))])
    np.testing.assert_allclose(np.array(alone(mass)).ravel(), exact[:, 0], rtol=0, atol=near)


PENDULUM = """
name: p
coordinates: {{q: {{velocity: om, unit: rad}}, r: {{velocity: v, unit: rad}}}}
parameters: {{J: {{value: 2, unit: kg*m^2}}}}
mass_matrix: [[J, "{off}"], ["{mirror}", "{last}"]]
force: [0, 0]
friction:
  distribution: [[1], [0]]
  contacts: [{{name: hinge, law: coulomb, a: 1, unit: N*m}}]
envelope: {{q: [-2, {high}]}}
"""


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"off": "J*sin(q)/2", "mirror": "J*cos(q)/2"}, "SPEC017 [1][0]"),
        ({"off": "J*q/3", "mirror": "J*q/3 + J*1e-9"}, "SPEC017 [1][0]"),
        ({"off": "J*q/2.2", "mirror": "J*q/2.2", "high": "2.5"}, "SPEC017 -0.2727 2.5"),
        ({"last": "J*(2 - q)", "high": "2.001"}, "SPEC017 -0.002 2.001"),
        ({"last": "J*log(q)"}, "SPEC012 -2"),
        ({"last": "J/q", "high": "2"}, "SPEC017 -2"),
    ],
)
def test_a_mass_matrix_that_fails_in_the_envelope(change: dict[str, str], words: str) -> None:
    filled = {"off": "0", "mirror": "0", "last": "J", "high": "1"} | change
    with pytest.raises(BadInput) as told:
        build_system(parse_spec(PENDULUM.format(**filled), Path("p.yaml")))
    assert matches(told.value, words)


@pytest.mark.parametrize(
    "change",
    [
        {"off": "J*sin(q)**2/2", "mirror": "J*(1 - cos(q)**2)/2"},  # symmetric, though not written so
        {"off": "J*q/3", "mirror": "J*q/3"},
        {"last": "J*(2 - q)", "high": "1.999"},
    ],
)
def test_a_mass_matrix_that_holds_in_the_envelope(change: dict[str, str]) -> None:
    filled = {"off": "0", "mirror": "0", "last": "J", "high": "1"} | change
    system = build_system(parse_spec(PENDULUM.format(**filled), Path("p.yaml")))
    assert system.mass_matrix.has(sympy.Symbol("q", real=True))


def test_the_tool_magnitude() -> None:
    assert magnitude(-3.0) == 3 and magnitude(2.0) == 2

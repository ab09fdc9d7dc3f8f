"""The implicit step against backward Euler's equations written by hand, and how many Newton steps it makes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import root

from codegen.emit.package import emit_sources, make_header
from codegen.observers import Observer, build_observer
from codegen.program import Program, build_program
from codegen.program.implicit_step import solved_by_one_step
from tests.machines import machine
from tests.observers.cases import SPEED, seeded, write_observer
from tests.observers.reference import Reference
from tests.twin import load_twin

from .test_program_build import program_of

LINEAR = [
    ("one_mass", "cfo", "estimated", 1.0),
    ("one_mass", "to", "estimated", 1.0),
    ("one_mass", "cfo", "measured", 1.5),
    ("two_mass", "gcfo", "estimated", 1.0),
    ("two_mass", "mgto", "estimated", 1.0),
]
NONLINEAR = [
    ("one_mass", "cfo", "estimated", 1.5),
    ("one_mass", "cfo", "estimated", 2.0),
    ("two_mass", "gcfo", "estimated", 2.0),
    ("arm", "gcfo", "estimated", 1.0),
    ("arm", "gto", "estimated", 1.0),
    ("cart", "gcfo", "estimated", 1.5),
]
ROUNDING, LEFT = 1e-12, 1e-6
"""Largest error of a state against its size: of a solution, and of two Newton steps at ``PERIOD``.

One Newton step leaves 1e-4 to 3e-3.
"""
PERIOD = 0.001
THESIS = Path(__file__).parents[2] / "specs/thesis"


def implicit(name: str, kind: str, velocity: str, exponent: float) -> tuple[Observer, Program, Reference]:
    """An observer with random gains, its program, and the same by hand."""
    dice = seeded("implicit", name, kind, velocity)
    section, hand = write_observer(name, kind, velocity, dice, exponent=exponent, h=PERIOD)
    spec, system = machine(name, section.replace("{kind", "{integration: implicit, kind"))
    observer = build_observer(spec, system)
    return observer, build_program(observer), hand


def twin_of(program: Program) -> Any:
    text = emit_sources(program, make_header("m.yaml", "0" * 64, ""))["__init__.py"]
    return load_twin(text, f"twin_{program.name}")


def newton_steps(program: Program) -> list[str]:
    """What the comments of the state's blocks say."""
    return [b.source.rsplit(", ", 1)[1] for b in program.blocks if b.name == "state_now"]


def errors(program: Program, hand: Reference, name: str) -> list[float]:
    """Of steps that end at random states: the largest error of a state, against the size of the states.

    The states before the step follow from those after it by z[k−1] = z[k] − h f(z[k]), so that nothing is solved.
    Points are left out at which a slip reverses between Newton's start and the solution.
    """
    twin, dice, found = twin_of(program), seeded("points", name), []
    n, levels = len(hand.hand.distribution(np.zeros(20))), hand.levels
    for _ in range(40):
        x, v = dice.uniform(-1, 1, n), dice.uniform(0.2, 1, n) * dice.choice([-1, 1], n) * SPEED[name]
        w = dice.uniform(-5, 5, hand.hand.inputs)
        friction = dice.uniform(1, 3, hand.first.shape[0]) * (
            1 if levels else dice.choice([-1, 1], hand.first.shape[0])
        )
        after = hand.states(x, v, friction)
        before = after - PERIOD * hand.rates(x, v, w, after)
        if not keeps_its_signs(hand, x, v, before):
            continue
        state = twin.State(*before, *w)
        measured = [*x, *(v if not hand.estimated else ())]
        out = twin.step(state, twin.Parameters(), twin.Inputs(*measured, *w))
        assert out.fault == 0
        made = np.array([getattr(state, f.name) for f in program.states[: len(after)]])
        found.append(float(np.abs(made - after).max() / np.abs(after).max()))
    return found


def keeps_its_signs(hand: Reference, x: Any, v: Any, before: Any) -> bool:
    """Whether the slips at Newton's start, (I + hK_v) v̂ = z_v + K_v x, have the signs of those at v."""
    n = len(x)
    if not hand.estimated or not hand.levels:
        return True
    start = np.linalg.solve(np.eye(n) + PERIOD * hand.velocity, before[:n] + hand.velocity @ x)
    slips = hand.hand.distribution(x).T @ np.array([start, v]).T
    return bool((np.sign(slips[:, 0]) == np.sign(slips[:, 1])).all())


@pytest.mark.parametrize(("name", "kind", "velocity", "exponent"), LINEAR)
def test_one_newton_step_solves_linear_equations(name: str, kind: str, velocity: str, exponent: float) -> None:
    observer, program, hand = implicit(name, kind, velocity, exponent)
    assert newton_steps(program) == ["one Newton step"] and solved_by_one_step(observer)
    assert max(errors(program, hand, name)) < ROUNDING


@pytest.mark.parametrize(("name", "kind", "velocity", "exponent"), NONLINEAR)
def test_two_newton_steps_nearly_solve_others(name: str, kind: str, velocity: str, exponent: float) -> None:
    observer, program, hand = implicit(name, kind, velocity, exponent)
    assert newton_steps(program) == ["first Newton step", "second Newton step"] and not solved_by_one_step(observer)
    assert max(errors(program, hand, name)) < LEFT


@pytest.mark.parametrize("name", ["one_mass_dfo", "two_mass_gdfo"])
def test_a_dynamic_friction_observer_makes_two(name: str) -> None:
    text = (THESIS / f"{name}.yaml").read_text(encoding="utf-8")
    program = program_of(text.replace("\nenvelope:", "\n  integration: implicit\nenvelope:"))
    assert newton_steps(program) == ["first Newton step", "second Newton step"]


def test_the_equations_keep_their_signs_between_the_two_steps() -> None:
    """One mass whose estimate reverses within the sample: the state is the solution with the sign of Newton's start."""
    _, program, hand = implicit("one_mass", "cfo", "estimated", 1.5)
    k_v, k_f, h, w = hand.velocity[0, 0], hand.first[0, 0], PERIOD, -1.0
    start, level = 1e-3, 2.0
    before = np.array([start * (1 + h * k_v), level])  # v̂ = start for zero acceleration, at x = 0

    def residual(y: Any) -> Any:
        v, a = y[0], y[2]
        force = w - 0.4 * v - (y[1] - k_f * abs(v) ** 1.5)
        return [v - before[0] - h * (a - k_v * v), y[1] - level - h * k_f * 1.5 * abs(v) ** 0.5 * a, 1.7 * a - force]

    solution = root(residual, [start, level, 0], tol=1e-14).x
    assert solution[0] < -0.5 * start
    twin = twin_of(program)
    state = twin.State(*before, w)
    twin.step(state, twin.Parameters(), twin.Inputs(0.0, w))
    names = [f.name for f in program.states]
    found = np.array([getattr(state, name) for name in names[:2]])
    assert np.abs(found - solution[:2]).max() < 1e-8

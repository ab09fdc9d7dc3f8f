"""Whether what is left of a friction may push: the verdict against motions that are tried."""

from __future__ import annotations

import numpy as np
import pytest

import stiction
from codegen.base.text import render
from codegen.cancellation import make_plan, reach
from codegen.cancellation.plan import remaining_friction
from codegen.mechanics.build import build_system
from codegen.spec.model import CancellationChoice
from tests.machines import machine_text, read
from tests.slow_cases import slow_except

from .equations import random_mass, random_matrix
from .test_best_input import costs, numbers

DIAGONAL = [[1, 0], [0, 1]]
COUPLED = [["1", "sin(x1)/2"], ["sin(x1)/2", "1"]]


def left_of(M, B, U, envelope="", **choice):
    spec = read(machine_text(M, B, U, "{}", envelope=envelope))
    found = reach(spec, build_system(spec), choice.get("weight", "mass_inverse"))
    plan = make_plan(spec, CancellationChoice(**choice), found)
    return remaining_friction(found, plan), found, plan


def feeds(rest, direction, generator) -> bool:
    """Whether some motion that slips forward gets power from the rest of this contact's friction."""
    tried = generator.normal(size=(4000, len(rest)))
    across = tried - np.outer(tried @ direction, direction) / (direction @ direction)
    motions = across + 1e-6 * direction
    return bool(np.any(motions @ rest > 1e-8))


@pytest.mark.parametrize("seed", slow_except(range(30), range(10)))
def test_it_may_push_where_some_motion_gets_power_from_it(seed):
    generator = np.random.default_rng(seed)
    n, r, p = generator.integers(2, 5), generator.integers(1, 4), generator.integers(1, 4)
    B = random_matrix(generator, n, r, generator.integers(1, min(n, r) + 1))
    U = generator.integers(-1, 2, (n, p))
    U[0, np.all(U == 0, axis=0)] = 1
    M = np.array(random_mass(generator, n), dtype=float)
    for weight in ("mass_inverse", "identity"):
        root = np.linalg.cholesky(costs(weight, M)).T
        rest = B @ np.linalg.lstsq(root @ B, root @ U, rcond=1e-10)[0] - U
        feeding = {f"c{j + 1}" for j in range(p) if feeds(rest[:, j], U[:, j].astype(float), generator)}
        assert set(left_of(M.astype(int).tolist(), B.tolist(), U.tolist(), weight=weight)[0].may_feed_energy) == feeding


def test_a_rest_that_pushes_at_the_side_of_the_envelope_only():
    left, _, _ = left_of(COUPLED, [[1], [0]], [[0], [1]], "x1: [-1, 1]")
    assert left.gains == pytest.approx(0) and left.may_feed_energy == ("c1",)
    M, B, d = numbers(COUPLED, {"x1": 1.0}), np.array([[1.0], [0.0]]), np.array([0.0, 1.0])
    u = np.linalg.solve(B.T @ np.linalg.solve(M, B), B.T @ np.linalg.solve(M, d))
    assert u == pytest.approx(-np.sin(1) / 2)
    assert feeds(B @ u - d, d, np.random.default_rng(0))


def test_damping_bends_what_is_left_of_a_friction_in_reach():
    left, found, plan = left_of(DIAGONAL, [["1", "0"], ["0", "0.1"]], [[1], [1]], damping=0.01)
    assert left.force[:, 0] == pytest.approx([-1 / 10001, -1 / 101])
    assert found.cancellable == left.may_feed_energy == ("c1",) and plan.damping == pytest.approx(1e-4)
    straight, _, _ = left_of(DIAGONAL, [["1", "0"], ["0", "0.1"]], DIAGONAL, damping=0.01)
    assert straight.may_feed_energy == ()


@pytest.mark.parametrize(
    ("B", "U", "damping", "told", "not_told"),
    [
        ([[0], [1]], [[1, 0], [-1, 1]], 0, "cancels c2 only and leaves", "caused by the damping"),
        ([["1", "0"], ["0", "0.1"]], [[1], [1]], 0.01, "of c1 is caused by the damping", "`contacts: cancellable`"),
        ([[1], [1]], DIAGONAL, 0, "No contact can be cancelled perfectly by itself", "`contacts: cancellable`"),
    ],
)
def test_what_helps_is_told(tmp_path, B, U, damping, told, not_told):
    path = tmp_path / "spec.yaml"
    path.write_text(machine_text(DIAGONAL, B, U, f"{{damping: {damping}}}"), encoding="utf-8")
    words = render("text/cancel.txt.j2", **stiction.cancel(path).view)
    assert told in words and not_told not in words

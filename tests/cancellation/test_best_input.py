"""The generated input against NumPy's least squares and SciPy's minimiser, on random B, U and M of every rank."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from scipy import linalg, optimize

from tests.machines import machine_text
from tests.slow_cases import slow_except

from .equations import Machine, cancelling_input, random_mass, random_matrix

SHAPES = [
    (n, r, k)
    for n in range(1, 6)
    for r in range(1, 6)
    for k in range(1, min(n, r) + 1)
    if n + r <= 7 and not (n == 5 and k == 2 < r)
]


def costs(weight: str, M: np.ndarray) -> np.ndarray:
    return {"identity": np.eye(len(M)), "acceleration": linalg.inv(M) @ linalg.inv(M)}.get(weight, linalg.inv(M))


def smallest_best(B: np.ndarray, M: np.ndarray, force: np.ndarray, weight: str) -> np.ndarray:
    root = linalg.sqrtm(costs(weight, M)).real
    return np.linalg.lstsq(root @ B, root @ force, rcond=1e-10)[0]


@pytest.mark.parametrize("shape", slow_except(SHAPES, SHAPES[::3]), ids=lambda s: "-".join(map(str, s)))
def test_it_is_the_smallest_of_the_least_squares_inputs(shape):
    n, r, k = shape
    generator = np.random.default_rng(100 * n + 10 * r + k)
    for weight in ("mass_inverse", "acceleration", "identity"):
        B, M = random_matrix(generator, n, r, k), np.array(random_mass(generator, n))
        U = random_matrix(generator, n, min(n, 2), min(n, 2))
        friction = generator.normal(size=U.shape[1])
        text = machine_text(M.tolist(), B.tolist(), U.tolist(), f"{{weight: {weight}}}")
        found = cancelling_input(text, {f"F_hat_c{j + 1}": f for j, f in enumerate(friction)})
        assert found == pytest.approx(smallest_best(B, M, U @ friction, weight), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("shape", SHAPES[::3], ids=lambda s: "-".join(map(str, s)))
def test_a_minimiser_that_knows_no_algebra_finds_nothing_better(shape):
    n, r, k = shape
    generator = np.random.default_rng(7 * n + r + k)
    B, M = random_matrix(generator, n, r, k), np.array(random_mass(generator, n))
    U, friction = np.eye(n, dtype=int), generator.normal(size=n)
    text = machine_text(M.tolist(), B.tolist(), U.tolist(), kind="gto")
    found = cancelling_input(text, {f"F_hat_on_x{j + 1}": f for j, f in enumerate(friction)})

    def energy(u: np.ndarray) -> float:
        rest = B @ u - U @ friction
        return float(rest @ np.linalg.solve(M, rest))

    best = optimize.minimize(energy, generator.normal(size=r), method="BFGS", options={"gtol": 1e-9})
    assert energy(found) <= best.fun + 1e-9
    # among those equally good it is the smallest: no step along the null space of B shortens it
    assert linalg.null_space(B).T @ found == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("shape", SHAPES[::2], ids=lambda s: "-".join(map(str, s)))
def test_appendix_b_is_as_good_with_as_many_inputs_as_the_rank(shape):
    n, r, k = shape
    generator = np.random.default_rng(n + 10 * r + 100 * k)
    B, M = random_matrix(generator, n, r, k), np.array(random_mass(generator, n))
    U, friction = np.eye(n, dtype=int), generator.normal(size=n)
    text = machine_text(M.tolist(), B.tolist(), U.tolist(), "{method: appendix_b}", kind="gto")
    found = cancelling_input(text, {f"F_hat_on_x{j + 1}": f for j, f in enumerate(friction)})
    best = smallest_best(B, M, U @ friction, "mass_inverse")
    assert np.count_nonzero(found) <= k
    assert B @ found == pytest.approx(B @ best, rel=1e-9, abs=1e-9)
    assert np.linalg.norm(found) >= np.linalg.norm(best) - 1e-9


MASS_OF_X = [["2 + sin(x2)**2", "0.4*cos(x1)", "0"], ["0.4*cos(x1)", "1.5", "0.2"], ["0", "0.2", "1"]]
INPUTS_OF_X = {
    "tall": [["cos(x1)", "0.2"], ["0.3", "2 + sin(x2)"], ["1", "sin(x1)"]],
    "one": [["1 + sin(x1)**2"], ["sin(x1)"], ["sin(x2)"]],
    "wide": [["2", "sin(x1)", "0", "1"], ["sin(x2)", "3", "0.5", "0"], ["0", "sin(x1)", "2", "cos(x2)"]],
    "square": [["2", "tan(x1)", "0"], ["sin(x2)", "3", "0.5"], ["0", "sin(x1)", "2"]],
    "dependent": [
        ["cos(x1)", "0.2", "cos(x1) + 0.4"],
        ["0.3", "2 + sin(x2)", "4.3 + 2*sin(x2)"],
        ["1", "sin(x1)", "1 + 2*sin(x1)"],
    ],
}
ENVELOPE = "x1: [-0.5, 0.5], x2: [-0.5, 0.5]"


@pytest.mark.parametrize("weight", slow_except(["mass_inverse", "acceleration"], ["mass_inverse"]))
@pytest.mark.parametrize("name", INPUTS_OF_X)
def test_inputs_that_depend_on_the_position(name, weight):
    U = [["1", "0"], ["-cos(x2)", "1"], ["0", "sin(x1)"]]
    machine = Machine(machine_text(MASS_OF_X, INPUTS_OF_X[name], U, f"{{weight: {weight}}}", "mgto", ENVELOPE))
    generator = np.random.default_rng(3)
    for _ in range(4):
        at = dict(zip(("x1", "x2"), generator.uniform(-0.5, 0.5, 2), strict=True))
        M, B, D = (numbers(m, at) for m in (MASS_OF_X, INPUTS_OF_X[name], U))
        friction = generator.normal(size=2)
        forces = {f"F_hat_c{j + 1}": f for j, f in enumerate(friction)}
        forces |= {f"F_hat_on_x{i + 1}": f for i, f in enumerate(D @ friction)}
        found = machine.input(forces, at)
        assert found == pytest.approx(smallest_best(B, M, D @ friction, weight), rel=1e-8, abs=1e-9)


@pytest.mark.parametrize(
    "B",
    [
        [["cos(x1)", "sin(x1)"], ["0", "0"]],
        [["cos(x1)", "sin(x1)"], ["cos(x1)*sin(x2)", "sin(x1)*sin(x2)"]],
        [["cos(x1)", "sin(x1)", "0"], ["0", "0", "1 + x2**2"], ["2*cos(x1)", "2*sin(x1)", "x2"]],
    ],
)
def test_a_rank_that_stays_though_each_column_loses_it(B):
    n = len(B)
    M = [row[:n] for row in MASS_OF_X[:n]]
    U = np.eye(n, dtype=int).tolist()
    machine = Machine(machine_text(M, B, U, "{}", "gto", "x1: [-3, 3], x2: [-3, 3]"))
    generator = np.random.default_rng(5)
    for x1 in (-np.pi / 2, 0.0, np.pi / 2, 2.5):
        at = {"x1": x1, "x2": float(generator.uniform(-3, 3))}
        force = generator.normal(size=n)
        found = machine.input({f"F_hat_on_x{i + 1}": f for i, f in enumerate(force)}, at)
        expected = smallest_best(numbers(B, at), numbers(M, at), force, "mass_inverse")
        assert found == pytest.approx(expected, rel=1e-8, abs=1e-9)


def test_damping_bounds_the_input_where_the_rank_falls():
    B, M = [["cos(x1)", "0"], ["0", "1"]], [[2, 1], [1, 3]]
    text = machine_text(M, B, [[1, 0], [0, 1]], "{damping: 0.1}", "mgto", "x1: [-2, 2]")
    forces = {"F_hat_c1": 1.0, "F_hat_c2": 0.5}
    sizes = [np.linalg.norm(Machine(text).input(forces, {"x1": x})) for x in (0.0, 1.5, np.pi / 2, 1.6)]
    assert max(sizes) < 20
    near = Machine(text.replace("0.1}", "1e-5}")).input(forces, {"x1": 0.3})
    assert near == pytest.approx([1 / np.cos(0.3), 0.5], rel=1e-6)


def test_the_gain_scales_the_input_and_chosen_contacts_leave_the_others():
    M, B, U = [[10, 0], [0, 50]], [[0], [1]], [[1, 0], [-1, 1]]
    forces = {"F_hat_c1": 3.0, "F_hat_c2": 8.0}
    assert cancelling_input(machine_text(M, B, U, "{gain: 0.5}"), forces) == pytest.approx([0.5 * (8 - 3)])
    for chosen in ("cancellable", "[c2]"):
        assert cancelling_input(machine_text(M, B, U, f"{{contacts: {chosen}}}"), forces) == pytest.approx([8.0])


def numbers(matrix, at: dict[str, float]) -> np.ndarray:
    return np.array([[float(sympy.sympify(e).subs(at)) for e in row] for row in matrix])

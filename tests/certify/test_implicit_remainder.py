"""What one Newton step of a backward Euler step leaves: ``one_mass_dfo_implicit``, by a solver written by hand.

The certificate is about the solution of the equations; the code makes one Newton step towards it.
docs/certificate_theory.md states what that costs, and these tests compute it.
"""

from __future__ import annotations

import itertools
import json
import re
import runpy
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "generated/one_mass_dfo_implicit"
H, M, C, D1, D2, K_A, K_F1, K_V = 1e-3, 1.0, 100.0, 1000.0, 1e-4, -10.0, -0.01, 100.0
"""Of specs/thesis/one_mass_dfo_implicit.yaml, typed again."""
MOVED = np.array([1e-4, 1e-6, 1e-3])
CONVERGED = 30
GRID = {"a_rail": 3, "v": 14, "v_dot": 3, "f_rail_dot": 3}
"""Points of the grid along each variable, ends included; f follows from v and f'."""
TWIN = SimpleNamespace(**runpy.run_path(str(FOLDER / "__init__.py")))


def certificate() -> dict[str, Any]:
    found: dict[str, Any] = json.loads((FOLDER / "certificate.json").read_text("utf-8"))
    return found


def residual(y: Any, before: Any, x: float, w: float) -> Any:
    """z − z[k] − h f(z) and m v̂' − w + â f̂ at y = (z_v, z_f, z_a, v̂'), beyond the kink of the law at |f| = 1."""
    v, f = y[0] + K_V * x, y[1] + K_F1 * x
    a = y[2] + K_A * v * f
    xi = C * (v - D2 * f - (D1 - D2) * (f - 1))
    rates = np.array([y[3] - K_V * v, xi - K_F1 * v, -K_A * (y[3] * f + v * xi)])
    return np.array([*(y[:3] - before - H * rates), M * y[3] - w + a * f])


def newton(before: Any, x: float, w: float, steps: int) -> Any:
    """The estimates after so many Newton steps, from the velocity of zero acceleration and the states as they are."""
    y = np.array([before[0] - H * K_V / (1 + H * K_V) * (before[0] + K_V * x), before[1], before[2], 0.0])
    for _ in range(steps):
        slope = np.array([residual(y + 1e-30j * e, before, x, w).imag / 1e-30 for e in np.eye(4)]).T
        y = y - np.linalg.solve(slope, residual(y, before, x, w))
    v, f = y[0] + K_V * x, y[1] + K_F1 * x
    return np.array([v, f, y[2] + K_A * v * f])


def by_twin(before: Any, x: float, w: float) -> Any:
    """The same by the committed twin."""
    state = TWIN.State(*[float(z) for z in before], w)
    out = TWIN.step(state, TWIN.Parameters(), TWIN.Inputs(x, w))
    assert out.fault == 0
    return np.array([out.v_hat, out.f_hat_rail, out.a_hat_rail])


def points() -> list[tuple[float, ...]]:
    """(a, v, v', f') of the certificate's region in which f, which the law then gives, is in its range too."""
    box = {name: [float(Fraction(x)) for x in ends] for name, ends in certificate()["variables"].items()}
    axes = [np.linspace(*box[name], count) for name, count in GRID.items()]
    low, high = box["f_rail"]
    return [p for p in itertools.product(*axes) if low <= friction_state(p[1], p[3]) <= high]


def friction_state(v: float, rate: float) -> float:
    """f at which the law gives this rate: ξ = c (u − D2 f − (D1 − D2)(f − 1))."""
    return (v + D1 - D2 - rate / C) / D1


def transition(step: Any, point: tuple[float, ...]) -> tuple[Any, Any]:
    """(Φ by central differences, the error that is left where there was none) of a sample that ends at a point."""
    a, v, acceleration, rate = point
    f = friction_state(v, rate)
    before, after = np.array([v - H * acceleration, f - H * rate, a]), np.array([v, f, a])
    x, w = 0.3, M * acceleration + a * f

    def error(e: Any) -> Any:
        v0, f0, a0 = before - e
        states = np.array([v0 - K_V * x, f0 - K_F1 * x, a0 - K_A * v0 * f0])
        return after - step(states, x + H * v, w)

    sides = [(error(d * e), error(-d * e)) for d, e in zip(MOVED, np.eye(3), strict=True)]
    return np.array([(p - m) / (2 * d) for (p, m), d in zip(sides, MOVED, strict=True)]).T, error(np.zeros(3))


def worst(step: Any) -> tuple[float, float]:
    """(the largest factor of V = e'Pe in a sample, the largest error of the level that is left of none, N)."""
    p = np.array([[float(Fraction(x)) for x in row] for row in certificate()["lyapunov_matrix"]])
    root = np.linalg.inv(np.linalg.cholesky(p))
    found = [transition(step, point) for point in points()]
    factor = max(float(np.linalg.eigvalsh(root @ phi.T @ p @ phi @ root.T)[-1]) for phi, _ in found)
    return factor, max(abs(float(left[2])) for _, left in found)


def certified() -> float:
    """1/(1 + αh)²."""
    return float(1 / (1 + Fraction(certificate()["decay_rate"]) * Fraction(1, 1000)) ** 2)


def stated() -> dict[str, float]:
    """The figures of docs/certificate_theory.md."""
    text = " ".join((ROOT / "docs/certificate_theory.md").read_text("utf-8").split())
    names = {
        "one step": r"V falls by the factor (0\.\d+) at the worst",
        "certified": r"where (0\.\d+) is certified of the equations",
        "two steps": r"after two Newton steps it would be (0\.\d+)",
        "level": r"the level moves by up to (0\.\d+) N in a sample",
        "points": r"at (\d+) points of a grid",
    }
    return {name: float(re.findall(pattern, text)[0]) for name, pattern in names.items()}


def test_the_twin_makes_one_newton_step() -> None:
    for point in points()[::17]:
        (own, left), (hand, rest) = transition(by_twin, point), transition(lambda *s: newton(*s, 1), point)
        assert np.abs((own - hand) * MOVED / MOVED[:, None]).max() < 1e-6
        assert np.abs(left - rest).max() < 1e-9


def test_what_it_leaves_is_what_the_page_states() -> None:
    said = stated()
    factor, level = worst(by_twin)
    assert len(points()) == said["points"]
    assert factor == pytest.approx(said["one step"], abs=6e-5)
    assert level == pytest.approx(said["level"], abs=6e-4)
    assert certified() == pytest.approx(said["certified"], abs=6e-6)
    assert certified() < factor < 1


def test_the_solution_of_the_equations_is_what_is_certified_and_two_steps_would_do() -> None:
    solved, left = worst(lambda *s: newton(*s, CONVERGED))
    assert left == pytest.approx(H * H * abs(K_A) * 100 * 0.1, rel=1e-2)  # h² K_a v' f', of backward Euler itself
    assert certified() - 5e-4 < solved <= certified()
    twice, rest = worst(lambda *s: newton(*s, 2))
    assert twice == pytest.approx(stated()["two steps"], abs=6e-6) and twice <= certified()
    assert rest == pytest.approx(left, rel=1e-2)

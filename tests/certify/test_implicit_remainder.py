"""What two Newton steps of a backward Euler step leave: ``one_mass_dfo_implicit``, by a solver written by hand.

The certificate is about the solution of the equations; the code makes two Newton steps towards it.
docs/certificate_kernel.md states what that costs, and these tests compute it.
"""

from __future__ import annotations

import ctypes
import itertools
import json
import re
import runpy
from collections.abc import Callable
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from codegen.app.certify import certify
from codegen.certify.remedies import sample_times
from tests.compiled.build import Built, compile_shared

ROOT = Path(__file__).parents[2]
NAME = "one_mass_dfo_implicit"
FOLDER = ROOT / "generated" / NAME
SPEC = ROOT / f"specs/thesis/{NAME}.yaml"
H, M, C, D1, D2, K_A, K_F1, K_V = 1e-3, 1.0, 100.0, 1000.0, 1e-4, -10.0, -0.01, 100.0
"""Of ``SPEC``, typed again."""
MOVED = np.array([1e-4, 1e-6, 1e-3])
CONVERGED = 30
"""Newton steps at most; none follows one below rounding."""
GRID = {"a_rail": 3, "v": 14, "v_dot": 3, "f_rail_dot": 3}
"""Points of the grid along each variable, ends included; f follows from v and f'."""
COARSE = (2, 6, 2, 3)
"""Points of the grid where two steps are compared: the solver by hand takes ten times as long as the twin."""
TWIN = SimpleNamespace(**runpy.run_path(str(FOLDER / "__init__.py")))

Step = Callable[[Any, float, float], Any]
"""States before, x and w → estimates after."""


def magnitude(z: Any) -> Any:
    """|z|, continued to complex numbers."""
    return z * np.sign(np.real(z))


def certificate() -> dict[str, Any]:
    found: dict[str, Any] = json.loads((FOLDER / "certificate.json").read_text("utf-8"))
    return found


def residual(y: Any, before: Any, x: float, w: float, h: float) -> Any:
    """z − z[k] − h f(z) and m v̂' − w + â f̂ at y = (z_v, z_f, z_a, v̂'), or at each column of y."""
    v, f = y[0] + K_V * x, y[1] + K_F1 * x
    a = y[2] + K_A * v * f
    beyond = f + magnitude(f - 1) / 2 - magnitude(f + 1) / 2
    xi = C * (v - D2 * f - (D1 - D2) * beyond)
    rates = np.array([y[3] - K_V * v, xi - K_F1 * v, -K_A * (y[3] * f + v * xi)])
    return np.array([*(y[:3] - before - h * rates), M * y[3] - w + a * f])


def newton(steps: int, h: float = H) -> Step:
    """So many Newton steps, from the velocity of zero acceleration and the states as they are."""

    def step(before: Any, x: float, w: float) -> Any:
        y = np.array([before[0] - h * K_V / (1 + h * K_V) * (before[0] + K_V * x), before[1], before[2], 0.0])
        for _ in range(steps):
            slope = residual(y[:, None] + 1e-30j * np.eye(4), before[:, None], x, w, h).imag / 1e-30
            move = np.linalg.solve(slope, residual(y, before, x, w, h))
            y = y - move
            if (np.abs(move) <= 1e-15 * np.abs(y)).all():
                break
        v, f = y[0] + K_V * x, y[1] + K_F1 * x
        return np.array([v, f, y[2] + K_A * v * f])

    return step


def by_twin(h: float = H) -> Step:
    """The committed twin."""
    parameters = TWIN.Parameters()
    parameters.sample_time = h
    TWIN.prepare(parameters)

    def step(before: Any, x: float, w: float) -> Any:
        out = TWIN.step(TWIN.State(*[float(z) for z in before], w), parameters, TWIN.Inputs(x, w))
        assert out.fault == 0
        return np.array([out.v_hat, out.f_hat_rail, out.a_hat_rail])

    return step


def by_c(folder: Path) -> Step:
    """The committed C, compiled."""
    for file in (f"{NAME}.c", f"{NAME}.h"):
        (folder / file).write_text((FOLDER / file).read_text("utf-8"), "utf-8")
    called = getattr(ctypes.CDLL(str(compile_shared(folder, f"{NAME}.c"))), f"{NAME}_step")
    called.restype = None
    built = Built(folder, SPEC.read_text("utf-8"))
    parameters, inputs, state, outputs = (struct() for struct in built.structs)
    for field, _ in parameters._fields_:
        setattr(parameters, field, getattr(TWIN.Parameters(), field))

    def step(before: Any, x: float, w: float) -> Any:
        state.z_v, state.z_f_rail, state.z_a_rail, state.w_held = *map(float, before), w
        inputs.x, inputs.w = x, w
        called(*(ctypes.byref(part) for part in (state, parameters, inputs, outputs)))
        assert outputs.fault == 0
        return np.array([outputs.v_hat, outputs.f_hat_rail, outputs.a_hat_rail])

    return step


@cache
def points(grid: tuple[int, ...] = tuple(GRID.values())) -> list[tuple[float, ...]]:
    """(a, v, v', f') of the certificate's region in which f, which the law then gives, is in its range too."""
    box = {name: [float(Fraction(x)) for x in ends] for name, ends in certificate()["variables"].items()}
    axes = [np.linspace(*box[name], count) for name, count in zip(GRID, grid, strict=True)]
    low, high = box["f_rail"]
    return [p for p in itertools.product(*axes) if low <= friction_state(p[1], p[3]) <= high]


def friction_state(v: float, rate: float) -> float:
    """f at which the law gives this rate: ξ = c (u − D2 f − (D1 − D2)(f − 1))."""
    return (v + D1 - D2 - rate / C) / D1


def transition(step: Step, point: tuple[float, ...], h: float = H) -> tuple[Any, Any]:
    """(Φ by central differences, the error that is left where there was none) of a sample that ends at a point."""
    a, v, acceleration, rate = point
    f = friction_state(v, rate)
    before, after = np.array([v - h * acceleration, f - h * rate, a]), np.array([v, f, a])
    x, w = 0.3, M * acceleration + a * f

    def error(e: Any) -> Any:
        v0, f0, a0 = before - e
        states = np.array([v0 - K_V * x, f0 - K_F1 * x, a0 - K_A * v0 * f0])
        return after - step(states, x + h * v, w)

    sides = [(error(d * e), error(-d * e)) for d, e in zip(MOVED, np.eye(3), strict=True)]
    return np.array([(p - m) / (2 * d) for (p, m), d in zip(sides, MOVED, strict=True)]).T, error(np.zeros(3))


def worst(step: Step, h: float = H, grid: tuple[int, ...] = tuple(GRID.values())) -> tuple[float, float]:
    """(the largest factor of V = e'Pe in a sample, the largest error of the level that is left of none, N)."""
    p = np.array([[float(Fraction(x)) for x in row] for row in certificate()["lyapunov_matrix"]])
    root = np.linalg.inv(np.linalg.cholesky(p))
    found = [transition(step, point, h) for point in points(grid)]
    factor = max(float(np.linalg.eigvalsh(root @ phi.T @ p @ phi @ root.T)[-1]) for phi, _ in found)
    return factor, max(abs(float(left[2])) for _, left in found)


def certified(h: float = H) -> float:
    """1/(1 + αh)²; P does not depend on h."""
    return float(1 / (1 + Fraction(certificate()["decay_rate"]) * Fraction(str(h))) ** 2)


def stated() -> dict[str, float]:
    """The figures of docs/certificate_kernel.md."""
    text = " ".join((ROOT / "docs/certificate_kernel.md").read_text("utf-8").split())
    names = {
        "points": r"at (\d+) points of a grid",
        "code": r"V falls by the factor (0\.\d+) at the worst",
        "certified": r"where (0\.\d+) is certified of the equations",
        "one step": r"one Newton step would give (0\.\d+)",
        "level": r"the level moves by up to (0\.\d+) N in a sample",
        "level of one step": r"after one Newton step by up to (0\.\d+) N",
        "at 4 ms": r"at 4 ms by (0\.\d+), where",
        "certified at 4 ms": r"at 4 ms by 0\.\d+, where (0\.\d+) is certified",
        "at 5 ms": r"at 5 ms V grows (1\.\d+)-fold",
    }
    return {name: float(re.findall(pattern, text)[0]) for name, pattern in names.items()}


def test_the_twin_and_the_c_make_two_newton_steps(tmp_path: Path) -> None:
    compiled = by_c(tmp_path)
    for point in points()[::17]:
        (own, left), (hand, rest) = transition(by_twin(), point), transition(newton(2), point)
        assert np.abs((own - hand) * MOVED / MOVED[:, None]).max() < 1e-6
        assert np.abs(left - rest).max() < 1e-9
        same, also = transition(compiled, point)
        assert (same == own).all() and (also == left).all()


def test_the_code_has_the_certified_rate_to_first_order(tmp_path: Path) -> None:
    said = stated()
    assert len(points()) == said["points"]
    for step in (by_twin(), by_c(tmp_path)):
        factor, level = worst(step)
        assert factor <= certified()
        assert factor == pytest.approx(said["code"], abs=6e-6)
        assert level == pytest.approx(said["level"], abs=6e-6)
    assert certified() == pytest.approx(said["certified"], abs=6e-6)


def test_the_solution_of_the_equations_is_what_is_certified() -> None:
    solved, left = worst(newton(CONVERGED), grid=COARSE)
    assert left == pytest.approx(H * H * abs(K_A) * 100 * 0.1, rel=1e-2)  # h² K_a v' f', of backward Euler itself
    assert certified() - 5e-4 < solved <= certified()
    twice, rest = worst(by_twin(), grid=COARSE)
    assert twice == pytest.approx(solved, abs=1e-8) and rest == pytest.approx(left, rel=1e-5)


def test_one_newton_step_would_not_have_the_certified_rate() -> None:
    said = stated()
    factor, level = worst(newton(1))
    assert factor == pytest.approx(said["one step"], abs=6e-5)
    assert level == pytest.approx(said["level of one step"], abs=6e-5)
    assert certified() < factor < 1


def test_two_newton_steps_do_not_suffice_at_every_sample_time() -> None:
    said = stated()
    assert worst(by_twin(0.004), 0.004)[0] == pytest.approx(said["at 4 ms"], abs=6e-6)
    assert certified(0.004) == pytest.approx(said["certified at 4 ms"], abs=6e-6)
    assert said["at 4 ms"] < certified(0.004)
    assert worst(by_twin(0.005), 0.005)[0] == pytest.approx(said["at 5 ms"], abs=6e-3)
    assert worst(newton(3, 0.005), 0.005, COARSE)[0] <= certified(0.005)
    assert worst(newton(3, 0.03), 0.03, COARSE)[0] <= certified(0.03)


@pytest.mark.parametrize(("spec", "solved"), [(SPEC, False), (ROOT / "specs/one_mass.yaml", True)])
def test_a_largest_sample_time_of_equations_that_the_code_does_not_solve_is_said_to_be_one(
    spec: Path, solved: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sample_times, "INTEGRATIONS", ("implicit",))  # the others are not asked for
    found = certify(spec)
    assert "implicit" in found.sample_times and found.solved == solved
    assert ("the code solves by two Newton steps" in " ".join(found.text().split())) == (not solved)

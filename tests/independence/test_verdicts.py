"""Routh–Hurwitz and Jury verdicts against NumPy's eigenvalues, on random gains of both signs and many magnitudes.

A verdict is left out where rounding decides it: NumPy's eigenvalues are exact for a matrix within 1e-13 of the one
given (relative, after balancing), which moves an m-fold eigenvalue by the m-th root of that; so an eigenvalue is on the
boundary if it is closer than EDGE of the largest, and such draws are counted and must be few.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import casadi
import numpy as np
import pytest

from codegen.analysis.analysis import Analysis, analyse
from codegen.analysis.conditions import SYMBOLIC_ORDER
from codegen.analysis.operating_points import matrix_function
from codegen.mechanics.casadi_form import at_points, over_rows, to_casadi
from codegen.mechanics.solve import factorised
from codegen.spec.model import symbol

from .variants import SHIPPED, Variant, build, shape

EDGE = 1e-10
QUICK, MANY = 400, 10_000


def observers() -> list[Variant]:
    """Every shipped system with every observer kind; blocks above the fourth order have no conditions to test."""
    found = []
    for machine in SHIPPED:
        single = len(shape(machine)[0]) == 1
        for kind in ("cfo", "to", "mgto", "dfo") if single else ("gcfo", "gto", "mgto", "gdfo"):
            option = {"gcfo": "2", "cfo": "2", "dfo": "dahl", "gdfo": "dahl"}.get(kind, "")
            found += [Variant(machine, kind, velocity, option, False) for velocity in ("measured", "estimated")]
    return found


CASES = [pytest.param(v, id=v.name) for v in observers() if v.machine != "seven_joint_arm"]


@dataclass(frozen=True)
class Draws:
    """N random gain sets, operating points and sample times, and what is said of them."""

    hurwitz: Any
    schur: Any
    routh: Any
    jury: Any
    edge: Any
    step_edge: Any


def draw(analysis: Analysis, count: int, random: np.random.Generator) -> Draws:
    """Ψ and A as numbers and every condition's expression as a number, at each draw."""
    dynamics, observer = analysis.dynamics, analysis.dynamics.observer
    gains = list(observer.gains)
    size = np.abs(np.array([float(v) for v in observer.gains.values()])) + 1e-3
    size = size * 10 ** random.uniform(-2, 2, (count, 1)) * 10 ** random.uniform(-1, 1, (count, len(gains)))
    usual = np.sign([float(v) for v in observer.gains.values()])
    signs = np.where(random.random((count, len(gains))) < 0.2, -1, 1) * np.where(usual == 0, 1, usual)
    values = analysis.points.values[random.integers(len(analysis.points.values), size=count)]
    periods = 10 ** random.uniform(-5, 0, (count, 1))
    open_values = np.hstack([size * signs, periods])
    psi, step = (
        at_points(matrix_function(dynamics, m, analysis.points.variables, gains), np.hstack([values, open_values]))
        for m in (dynamics.in_force(dynamics.jacobian), dynamics.in_force(dynamics.sampled))
    )
    continuous, sampled = np.linalg.eigvals(psi), np.linalg.eigvals(step)
    largest = np.abs(continuous).max(axis=1)
    beyond = np.abs(1 + periods * sampled).max(axis=1) - 1
    routh, jury = (_verdicts(analysis, gains, values, open_values, later) for later in (False, True))
    return Draws(
        hurwitz=continuous.real.max(axis=1) < 0,
        schur=beyond < 0,
        routh=routh,
        jury=jury,
        edge=np.abs(continuous.real).min(axis=1) < EDGE * largest,
        step_edge=np.abs(beyond) < EDGE * (1 + periods[:, 0] * np.abs(sampled).max(axis=1)),
    )


def _verdicts(analysis: Analysis, gains: list[Any], values: Any, open_values: Any, later: bool) -> Any:
    """Whether every printed condition holds, block by block; c0, c1 … of a condition are the block's coefficients."""
    held = np.ones(len(values), dtype=bool)
    dynamics = analysis.dynamics
    for factor in analysis.blocks:
        assert factor.polynomial is not None
        block = [dynamics.errors.index(e) for e in factor.errors]
        told = [(factor.routh, dynamics.jacobian)] + ([(factor.jury, dynamics.sampled)] if later else [])
        for conditions, matrix in told:
            expressions = [c.expression for c in conditions]
            numbers = _numbers(
                analysis, gains, dynamics.in_force(matrix)[block, block], expressions, values, open_values
            )
            held &= (numbers > 0).all(axis=1)
    return held


def _numbers(analysis: Analysis, gains: list[Any], block: Any, expressions: list[Any], values: Any, opened: Any) -> Any:
    """Expressions over gains, points, M⁻¹, h, laws' slopes and coefficients of |sI − block|."""
    if not expressions:
        return np.ones((len(values), 1))
    dynamics, variables = analysis.dynamics, analysis.points.variables
    at, free = casadi.SX.sym("p", len(variables)), casadi.SX.sym("k", len(gains) + 1)
    names: dict[Any, Any] = {s: casadi.SX(float(v)) for s, v in dynamics.observer.values.items()}
    names |= {s: free[k] for k, s in enumerate((*gains, symbol("h")))}
    names |= {s: at[k] for k, s in enumerate(variables)}
    names |= {s: to_casadi(e, names) for s, e in dynamics.slopes.items()}
    if dynamics.inverse_mass:
        mass = to_casadi(dynamics.observer.system.mass_matrix, names)
        inverse = factorised(mass).solve_columns(casadi.SX.eye(mass.shape[0]))
        names |= {s: inverse[i, j] for s, (i, j) in dynamics.inverse_mass.items()}
    numeric = casadi.densify(to_casadi(block, names))
    names |= {symbol(f"c{k}"): c for k, c in enumerate(reversed(_coefficients(numeric)))}
    column = casadi.vertcat(*[to_casadi(e, names) for e in expressions])
    return over_rows(casadi.Function("conditions", [casadi.vertcat(at, free)], [column]), np.hstack([values, opened]))


def _coefficients(matrix: Any) -> list[Any]:
    """c of sᵐ + c_{m−1} sᵐ⁻¹ + … + c₀, highest first, as sums of principal minors."""
    m = matrix.shape[0]
    found = []
    for order in range(1, m + 1):
        total = casadi.SX(0)
        for rows in _subsets(m, order):
            total += _determinant([[matrix[i, j] for j in rows] for i in rows])
        found.append((-1) ** order * total)
    return found


def _subsets(m: int, order: int) -> list[list[int]]:
    return [[i for i in range(m) if mask >> i & 1] for mask in range(2**m) if mask.bit_count() == order]


def _determinant(rows: list[list[Any]]) -> Any:
    """By the first row: m ≤ 4."""
    if len(rows) == 1:
        return rows[0][0]
    minors = [[row[:j] + row[j + 1 :] for row in rows[1:]] for j in range(len(rows))]
    return sum((-1) ** j * rows[0][j] * _determinant(minor) for j, minor in enumerate(minors))


def check(variant: Variant, count: int) -> tuple[int, int, int, int]:
    """(draws, left out, stable, disagreements)."""
    spec, observer = build(variant)
    analysis = analyse(spec, observer)
    without = [f for f in analysis.blocks if f.polynomial is None]
    assert all(len(f.errors) > SYMBOLIC_ORDER for f in without), "conditions are due up to the fourth order"
    if without:
        pytest.skip("a block above the fourth order: no conditions are given")
    by_blocks = replace(analysis)
    vars(by_blocks)["modes"] = None  # the conditions of the blocks, not of the modes
    draws = draw(by_blocks, count, variant.generator("gains"))
    wrong = (draws.routh != draws.hurwitz) & ~draws.edge
    also = (draws.jury != (draws.schur & draws.hurwitz)) & ~draws.step_edge & ~draws.edge
    left_out = int((draws.edge | draws.step_edge).sum())
    assert not wrong.any(), f"{wrong.sum()} of {count} Routh–Hurwitz verdicts, {left_out} left out"
    assert not also.any(), f"{also.sum()} of {count} Jury verdicts, {left_out} left out"
    return count, left_out, int(draws.hurwitz.sum()), int(draws.schur.sum())


@pytest.mark.parametrize(
    "variant",
    [
        v
        for v in observers()
        if v.machine == "rig" or (v.machine, v.kind, v.velocity) == ("two_mass", "gto", "measured")
    ],
    ids=lambda v: v.name,
)
def test_verdicts_on_some_hundred_gain_sets(variant: Variant) -> None:
    count, left_out, _, _ = check(variant, QUICK)
    assert left_out < 0.8 * count  # Dahl's slope c|u| vanishes at standstill, and with it an eigenvalue


@pytest.mark.slow
@pytest.mark.parametrize("variant", CASES)
def test_verdicts_on_ten_thousand_gain_sets(variant: Variant) -> None:
    count, left_out, _, _ = check(variant, MANY)
    assert left_out < 0.8 * count  # Dahl's slope c|u| vanishes at standstill, and with it an eigenvalue

"""Printed stability conditions compared with eigenvalues: a search for points where they disagree."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy

from codegen.analysis.conditions import reduce_conditions
from codegen.analysis.polynomials import characteristic_polynomial, routh_hurwitz
from codegen.thesis.audit.claim import Claim
from codegen.thesis.audit.equality import plain_number
from codegen.thesis.audit.finding import Finding, Verdict
from codegen.thesis.audit.formula import inequalities
from codegen.thesis.audit.points import exactly, numeric, order, points
from codegen.thesis.audit.world import Derived, World, tidy

TRIALS = 2000
NOT_SO = "not so at the counterexample"
VIOLATED: dict[str, Verdict] = {"inequality": "wrong", "implies": "insufficient"}
CLEAR = 1e-3


def judge_conditions(claim: Claim, world: World, derived: Derived) -> Finding:
    """``insufficient`` with an unstable point that satisfies them, ``unnecessary`` with a stable one that does not."""
    matrix = derived.value
    if claim.test == "negative_definite":
        matrix = (matrix + matrix.T) / 2
    printed = [pair for text in claim.entry.printed for pair in inequalities(text, world.names, claim.place)]
    given = [pair for text in claim.entry.given for pair in inequalities(text, world.names, claim.place)]
    symbols = order({s for e in [matrix, *(e for e, _ in printed + given)] for s in e.free_symbols})
    right = "; ".join(_right_conditions(matrix, world, given))
    growth = numeric(matrix, symbols)

    for point in points(symbols, world, given + printed, seed=2, count=TRIALS):
        if _largest(growth, point) > CLEAR and _exactly_unstable(matrix.xreplace(point)):
            return Finding(claim, "insufficient", right, _numbers(point, _largest(growth, point)))
    for point in points(symbols, world, given, seed=3, count=TRIALS):
        if not _met(printed, point) and _largest(growth, point) < -CLEAR and _exactly_stable(matrix.xreplace(point)):
            return Finding(claim, "unnecessary", right, _numbers(point, _largest(growth, point)))
    return Finding(claim, "holds", right)


def judge_inequality(claim: Claim, world: World) -> Finding:
    """A point at which a printed inequality is violated though what is given holds: ``wrong``, or ``insufficient``
    where the claim is that the given conditions imply it."""
    printed = [pair for text in claim.entry.printed for pair in inequalities(text, world.names, claim.place)]
    given = [pair for text in claim.entry.given for pair in inequalities(text, world.names, claim.place)]
    symbols = order({s for e, _ in printed + given for s in e.free_symbols})
    quick = numeric([e for e, _ in printed], symbols)
    for point in points(symbols, world, given, seed=4, count=TRIALS // 4):
        sizes = quick(*[float(x) for x in point.values()])
        for (expression, strict), size in zip(printed, sizes, strict=True):
            if size > CLEAR:
                continue
            value = exactly(expression, point)
            if value < 0 or (strict and value == 0):
                numbers = {s.name: plain_number(x) for s, x in point.items()}
                return Finding(claim, VIOLATED[claim.test], NOT_SO, {**numbers, "eigenvalue": None})
    return Finding(claim, "holds", "; ".join(claim.entry.printed))


def _met(conditions: list[tuple[Any, bool]], point: Mapping[Any, Any]) -> bool:
    values = [(exactly(expression, point), strict) for expression, strict in conditions]
    return all(value > 0 or (not strict and value == 0) for value, strict in values)


def _largest(growth: Any, point: Mapping[Any, Any]) -> float:
    values = growth(*[float(x) for x in point.values()])
    return float(np.linalg.eigvals(np.array(values, dtype=float)).real.max())


def _exactly_unstable(matrix: Any) -> bool:
    """A negative coefficient or Hurwitz determinant, in exact arithmetic, proves a root with positive real part."""
    return any(value < 0 for _, value in routh_hurwitz(characteristic_polynomial(matrix)))


def _exactly_stable(matrix: Any) -> bool:
    return all(value > 0 for _, value in routh_hurwitz(characteristic_polynomial(matrix)))


def _right_conditions(matrix: Any, world: World, given: list[tuple[Any, bool]]) -> list[str]:
    if matrix.shape == (1, 1):
        return [f"{tidy(-matrix[0])} > 0"]
    raw = routh_hurwitz(characteristic_polynomial(matrix))
    known = {e for e, strict in given if strict and e.is_Symbol} | set(world.positive)
    reduced = [e for _, e in reduce_conditions(raw, known)]
    return ["never"] if any(e.is_number for e in reduced) else [f"{sympy.factor(e)} > 0" for e in reduced]


def _numbers(point: Mapping[Any, Any], eigenvalue: float) -> dict[str, Any]:
    return {**{s.name: plain_number(x) for s, x in point.items()}, "eigenvalue": float(f"{eigenvalue:.6g}")}

"""A P that follows a slow position: V falls along motions of it, and what is changed so that it does not is refused."""

from __future__ import annotations

import copy
import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy

from codegen.checker import verify
from codegen.stability.enclosure import enclose_family
from codegen.stability.family import Family
from codegen.stability.lyapunov import common_lyapunov
from codegen.stability.slow import following

from .certified import fall, step_matrix

ARM = json.loads((Path(__file__).parents[2] / "generated/two_link_arm/certificate.json").read_text("utf-8"))
SLOW = ARM["slow"][0]
ROUNDING = 1e-9


def number(text: str) -> float:
    return float(Fraction(text))


def lyapunov_at(content: Any, x: float) -> Any:
    """P(x) by NumPy's interpolation, entry by entry."""
    slow = content["slow"][0]
    at = [number(b) for b in content["splits"][slow["variable"]]]
    values = np.array([[number(e) for row in m for e in row] for m in slow["matrices"]])
    size = len(slow["matrices"][0])
    return np.array([np.interp(x, at, column) for column in values.T]).reshape(size, size)


def largest_ratio(inner: Any, outer: Any) -> float:
    root = np.linalg.inv(np.linalg.cholesky(outer))
    return float(np.linalg.eigvalsh(root @ inner @ root.T)[-1])


def test_v_falls_along_motions_of_the_arm() -> None:
    """Whatever e is: the elbow runs, stands and turns as it may, and the shoulder's speed and the signs jump."""
    dice, h = np.random.default_rng(7), number(ARM["sample_time"])
    low, high = (number(x) for x in ARM["variables"]["theta2"])
    worst = 0.0
    for start in np.linspace(low, high, 40):
        theta = float(start)
        for _ in range(6):
            at = {n: dice.choice([number(a), number(b), dice.uniform(number(a), number(b))]) for n, (a, b) in ENDS}
            moved = float(np.clip(theta + h * at["omega2"], low, high))
            step = step_matrix(ARM, at | {"theta2": theta})
            worst = max(worst, largest_ratio(step.T @ lyapunov_at(ARM, moved) @ step, lyapunov_at(ARM, theta)))
            theta = moved
    assert 1 - 1.5 * (1 - fall(ARM)) < worst <= fall(ARM) + ROUNDING


ENDS = [(n, ends) for n, ends in ARM["variables"].items() if n != "theta2"]


def test_the_rate_comes_near_that_of_the_slowest_point() -> None:
    limit = json.loads((Path(__file__).parents[2] / "generated/two_link_arm/limit.json").read_text("utf-8"))
    verify.check(json.dumps(limit))
    assert number(ARM["decay_rate"]) > 0.85 * number(limit["decay_rate"])


def changed(**fields: Any) -> Any:
    content = copy.deepcopy(ARM)
    for path, new in fields.items():
        *keys, last = path.split("__")
        node = content
        for key in keys:
            node = node[int(key) if key.isdigit() else key]
        node[int(last) if last.isdigit() else last] = new
    return content


def negated(k: int, i: int, j: int) -> Any:
    """One entry of P, and its mirror image, with the other sign."""
    entry = (
        SLOW["matrices"][k][i][j].lstrip("-")
        if SLOW["matrices"][k][i][j][0] == "-"
        else f"-{SLOW['matrices'][k][i][j]}"
    )
    return changed(**{f"slow__0__matrices__{k}__{i}__{j}": entry, f"slow__0__matrices__{k}__{j}__{i}": entry})


MIDDLE = len(SLOW["matrices"]) // 2
FALSE = {
    "a sign": negated(MIDDLE, 0, 2),
    "a sign at the end": negated(0, 1, 3),
    "a faster elbow": changed(variables__omega2=["-3", "3"]),
    "a faster rate": changed(decay_rate="26/100"),
    "a matrix of another place": changed(slow__0__matrices=SLOW["matrices"][1:] + SLOW["matrices"][:1]),
    "a matrix less": changed(slow__0__matrices=SLOW["matrices"][:-1]),
    "a cell less": changed(splits__theta2=ARM["splits"]["theta2"][:9] + ARM["splits"]["theta2"][10:]),
    "cells that end early": changed(
        splits__theta2=ARM["splits"]["theta2"][:-1], slow__0__matrices=SLOW["matrices"][:-1]
    ),
    "wide cells": changed(splits__theta2=ARM["splits"]["theta2"][::2], slow__0__matrices=SLOW["matrices"][::2]),
    "another velocity": changed(slow__0__velocity="s_elbow"),
}


@pytest.mark.parametrize("case", FALSE)
def test_a_false_claim_is_refused(case: str) -> None:
    with pytest.raises(verify.Refused):
        verify.check(json.dumps(FALSE[case]))


def rotating(speed: str) -> Family:
    """-I + 5/2 u(q) w(q)' with u = (cos q, sin q) and w across it: every pole is -1, and V = e'e grows somewhere."""
    q, v = sympy.symbols("q v", real=True)
    cc, ss, cs = sympy.symbols("cc ss cs", real=True)
    bounds = {q: (sympy.Rational(-2), sympy.Rational(2)), v: (-sympy.Rational(speed), sympy.Rational(speed))}
    size = sympy.Rational(5, 2)
    matrix = sympy.Matrix([[-1 - size * cs, size * cc], [-size * ss, -1 + size * cs]])
    shape = {cc: sympy.cos(q) ** 2, ss: sympy.sin(q) ** 2, cs: sympy.sin(q) * sympy.cos(q)}
    return Family(bounds, shape, matrix)


def test_where_one_p_does_not_serve_a_slow_one_does() -> None:
    family = rotating("1/100")
    q, v = family.variables
    assert common_lyapunov(enclose_family(family, 2).matrices, 0.01) is None
    found = following(family, q, v, 0.01)
    assert found is not None and 0.3 < found.alpha < 1 and found.breaks[0] == -2 and found.breaks[-1] == 2
    at = [float(x) for x in found.nodes]
    columns = np.array([p.ravel() for p in found.matrices]).T
    for x in np.linspace(-2, 2, 300):
        u, w = np.array([np.cos(x), np.sin(x)]), np.array([-np.sin(x), np.cos(x)])
        step = np.eye(2) + 0.01 * (2.5 * np.outer(u, w) - np.eye(2))
        here, there = (
            np.array([np.interp(y, at, c) for c in columns]).reshape(2, 2) for y in (x, min(max(x + 1e-4, -2), 2))
        )
        assert largest_ratio(step.T @ there @ step, here) <= 1 - 2 * found.alpha * 0.01 + ROUNDING


def test_what_turns_too_fast_is_not_followed() -> None:
    """As fast as the error falls, the motion itself pumps it up; no P is found, rather than a wrong one."""
    family = rotating("4")
    found = following(family, *family.variables, 0.001)
    assert found is None or found.alpha < 0.2

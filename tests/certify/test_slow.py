"""A P that follows a slow position: V falls along motions of it, and what is changed so that it does not is refused."""

from __future__ import annotations

import copy
import json
import random
from fractions import Fraction
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from codegen.certify.enclosure import enclose_family
from codegen.certify.family import Family
from codegen.certify.lyapunov import common_lyapunov
from codegen.certify.prefix import to_prefix
from codegen.certify.slow import following
from codegen.checker import verify

from .certified import fall, step_matrix
from .test_refute import spectral

ARM = json.loads((Path(__file__).parents[2] / "generated/two_link_arm/certificate.json").read_text("utf-8"))
SLOW = ARM["slow"][0]
ROUNDING = 1e-9


def number(text: str) -> float:
    return float(Fraction(text))


def lyapunov_at(content: Any, x: float, sign: int) -> Any:
    """P(x) for that product of the signs by NumPy's interpolation, entry by entry."""
    slow, size = content["slow"][0], len(content["error"])
    at = [number(b) for b in content["splits"][slow["variable"]]]
    columns = zip(*[[e for row in m for e in row] for m in slow["matrices"][int(sign < 0)]], strict=True)
    return np.array([np.interp(x, at, numbers(column)) for column in columns]).reshape(size, size)


@cache
def numbers(column: tuple[str, ...]) -> list[float]:
    return [number(e) for e in column]


def largest_ratio(inner: Any, outer: Any) -> float:
    root = np.linalg.inv(np.linalg.cholesky(outer))
    return float(np.linalg.eigvalsh(root @ inner @ root.T)[-1])


SPEEDS = {n: [number(x) for x in ARM["variables"][n]] for n in ("omega1", "omega2")}


def worst_along_motions(content: Any, astray: float, starts: int) -> float:
    """The largest V(e[k+1])/V(e[k]) of any e: speeds jump, the elbow's mean one is at most so far astray."""
    dice, h = np.random.default_rng(7), number(content["sample_time"])
    low, high = (number(x) for x in content["variables"]["theta2"])
    worst = 0.0
    for start in np.linspace(low, high, starts):
        theta, (s1, s2) = float(start), dice.choice([-1, 1], 2)
        for _ in range(6):
            at = {n: dice.choice([*ends, dice.uniform(*ends)]) for n, ends in SPEEDS.items()}
            moved = theta + h * (at["omega2"] + dice.choice([-1, 1]) * astray)
            moved = float(np.clip(moved, low, high))
            step = step_matrix(content, at | {"theta2": theta, "s_elbow": s1, "s_shoulder": s2})
            later, now = (lyapunov_at(content, x, s1 * s2) for x in (moved, theta))
            worst = max(worst, largest_ratio(step.T @ later @ step, now))
            theta = moved
    return worst


def test_v_falls_along_motions_of_the_arm_and_hardly_faster_than_stated() -> None:
    worst = worst_along_motions(ARM, number(SLOW["stray"]), 300)
    assert 1 - 1.02 * (1 - fall(ARM)) < worst <= fall(ARM) + ROUNDING


def test_how_far_astray_matters() -> None:
    """An elbow whose speed in a sample has nothing to do with that at its start: V then falls less."""
    assert worst_along_motions(ARM, 0.3, 300) > fall(ARM) + ROUNDING


def test_v_grows_no_more_than_stated_where_a_contact_turns() -> None:
    low, high = (number(x) for x in ARM["variables"]["theta2"])
    for entry in ARM["reversals"]:
        turn = np.diag([-1.0 if i in entry["flips"] else 1.0 for i in range(4)])
        grown = [
            largest_ratio(turn @ lyapunov_at(ARM, x, -s) @ turn, lyapunov_at(ARM, x, s))
            for x in np.linspace(low, high, 60)
            for s in (-1, 1)
        ]
        assert 0.6 * number(entry["growth"]) < max(grown) <= number(entry["growth"])


def test_proved_and_refuted_rate_are_within_a_hundredth() -> None:
    limit = json.loads((Path(__file__).parents[2] / "generated/two_link_arm/limit.json").read_text("utf-8"))
    verify.check(json.dumps(limit))
    assert number(ARM["decay_rate"]) > 0.99 * number(limit["decay_rate"])


def test_the_refuted_point_is_as_slow_as_stated_and_hardly_any_is_slower() -> None:
    """By NumPy's eigenvalues: at the point of the refutation, and on a grid of corners along the elbow's range."""
    limit = json.loads((Path(__file__).parents[2] / "generated/two_link_arm/limit.json").read_text("utf-8"))
    stated = number(limit["decay_rate"])
    assert spectral(limit) < stated < 1.002 * spectral(limit)
    low, high = (number(x) for x in ARM["variables"]["theta2"])
    corners = list(product(*([-0.3, 0.3], [-0.3, 0.3], [1], [-1, 1])))
    for x in np.linspace(low, high, 200):
        for w1, w2, s1, s2 in corners:
            point = {"theta2": x, "omega1": w1, "omega2": w2, "s_elbow": s1, "s_shoulder": s2}
            radius = np.abs(np.linalg.eigvals(step_matrix(ARM, point))).max()
            assert (1 - radius**2) / 2 / number(ARM["sample_time"]) > 0.999 * spectral(limit)
    for rate in (0.999 * spectral(limit), 0.9 * stated):
        with pytest.raises(verify.Refused):
            verify.check(json.dumps(limit | {"decay_rate": str(Fraction(f"{rate:.6f}"))}))


def changed(**fields: Any) -> Any:
    content = copy.deepcopy(ARM)
    for path, new in fields.items():
        *keys, last = path.split("__")
        node = content
        for key in keys:
            node = node[int(key) if key.isdigit() else key]
        node[int(last) if last.isdigit() else last] = new
    return content


def negated(sign: int, k: int, i: int, j: int) -> Any:
    """One entry of P, and its mirror image, with the other sign."""
    entry = str(-Fraction(SLOW["matrices"][sign][k][i][j]))
    at = f"slow__0__matrices__{sign}__{k}"
    return changed(**{f"{at}__{i}__{j}": entry, f"{at}__{j}__{i}": entry})


def at_breaks(pick: Any) -> dict[str, Any]:
    """Other breakpoints, with their matrices."""
    matrices = [pick(each) for each in SLOW["matrices"]]
    return {"splits__theta2": pick(ARM["splits"]["theta2"]), "slow__0__matrices": matrices}


MIDDLE = len(SLOW["matrices"][0]) // 2
FALSE = {
    "a sign": negated(0, MIDDLE, 0, 2),
    "a sign at the end": negated(1, 0, 1, 3),
    "a faster elbow": changed(variables__omega2=["-3", "3"]),
    "a faster shoulder": changed(variables__omega1=["-3", "3"]),
    "a mean velocity far astray": changed(slow__0__stray="6/10"),
    "a rate above the limit": changed(decay_rate="2553/10000"),
    "a matrix of another place": changed(slow__0__matrices=[m[1:] + m[:1] for m in SLOW["matrices"]]),
    "the matrices of the other sign": changed(slow__0__matrices=SLOW["matrices"][::-1]),
    "one P for both signs": changed(slow__0__signs=[], slow__0__matrices=SLOW["matrices"][:1]),
    "one sign of the two": changed(slow__0__signs=["s_elbow"]),
    "a sign twice": changed(slow__0__signs=["s_elbow", "s_elbow"]),
    "a matrix less": changed(slow__0__matrices=[m[:-1] for m in SLOW["matrices"]]),
    "a cell less": changed(splits__theta2=ARM["splits"]["theta2"][:9] + ARM["splits"]["theta2"][10:]),
    "cells that end early": changed(**at_breaks(lambda x: x[:-1])),
    "wide cells": changed(**at_breaks(lambda x: x[::2] if len(x) % 2 else [*x[:-1:2], x[-1]])),
    "another velocity": changed(slow__0__velocity="s_elbow"),
    "a velocity that is not of it": changed(slow__0__velocity="omega1"),
    "a velocity within a parameter": changed(
        parameters=[
            p | {"expression": ["*", "2", "omega2"]} if p["expression"] == "omega2" else p for p in ARM["parameters"]
        ]
    ),
    "a product of two that follow": changed(matrix__0__0=["+", ARM["matrix"][0][0], ["*", "theta2_1", "theta2_2"]]),
    "a split of another": changed(splits__omega1=["-3/10", "0", "3/10"]),
    "a growth too small": changed(reversals__0__growth=str(Fraction(ARM["reversals"][0]["growth"]) * 99 / 100)),
}


@pytest.mark.parametrize("case", FALSE)
def test_a_false_claim_is_refused(case: str) -> None:
    with pytest.raises(verify.Refused):
        verify.check(json.dumps(FALSE[case]))


def test_a_rate_is_refused_a_little_above_what_the_motions_show() -> None:
    """The checker's enclosure costs less than two thousandths of the rate."""
    fastest = (1 - worst_along_motions(ARM, number(SLOW["stray"]), 300)) / 2 / number(ARM["sample_time"])
    assert number(ARM["decay_rate"]) > 0.98 * fastest


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 10**6))
def test_second_derivatives_are_those_of_sympy(seed: int) -> None:
    dice = random.Random(seed)
    x = sympy.Symbol("x", real=True)

    def drawn(depth: int) -> Any:
        if depth == 0 or dice.random() < 0.2:
            return dice.choice([x, x, sympy.Rational(dice.randrange(1, 9), 4)])
        one, two = drawn(depth - 1), drawn(depth - 1)
        return dice.choice(
            [
                one + two,
                one * two,
                -one,
                sympy.sin(one),
                sympy.cos(one),
                one**3,
                1 / (4 + one**2),
                sympy.sqrt(3 + sympy.sin(one)),
                sympy.exp(sympy.cos(one)),
            ]
        )

    e = drawn(3)
    assume(all(power.exp in (sympy.Rational(1, 2), power.exp.round()) for power in e.atoms(sympy.Pow)))
    low = Fraction(dice.randrange(-8, 8), 8)
    high = low + Fraction(dice.choice([0, 1, 4]), 8)
    ends = verify.enclosure.jet(to_prefix(e), "x", (low, high), {})
    for k, (least, most) in enumerate(ends):
        slope = sympy.lambdify(x, sympy.diff(e, x, k), "math")
        for at in np.linspace(float(low), float(high), 7):
            size = 1e-9 * (1 + abs(slope(at)))
            assert float(least) - size <= slope(at) <= float(most) + size


@pytest.mark.parametrize("word", ["sin", "cos", "exp", "sqrt", "/", "^"])
def test_second_derivatives_are_tight(word: str) -> None:
    raw = {"/": ["/", "1", "x"], "^": ["^", "x", "5"]}.get(word, [word, "x"])
    x, at = sympy.Symbol("x"), Fraction(3, 4)
    e = {"/": 1 / x, "^": x**5}.get(word) or getattr(sympy, word)(x)
    low, high = verify.enclosure.jet(raw, "x", (at, at), {})[2]
    assert low <= high <= low + Fraction(1, 10**6)
    assert abs(float(low) - float(sympy.diff(e, x, 2).subs(x, sympy.Rational(3, 4)))) < 1e-6
    wide = verify.enclosure.jet(raw, "x", (at, at + Fraction(1, 100)), {})[2]
    assert float(wide[1] - wide[0]) < 0.2 * abs(float(low))


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
    columns = np.array([np.array(p, dtype=float).ravel() for p in found.matrices[0]]).T
    for x in np.linspace(-2, 2, 300):
        u, w = np.array([np.cos(x), np.sin(x)]), np.array([-np.sin(x), np.cos(x)])
        step = np.eye(2) + 0.01 * (2.5 * np.outer(u, w) - np.eye(2))
        here, there = (
            np.array([np.interp(y, at, c) for c in columns]).reshape(2, 2) for y in (x, min(max(x + 1e-4, -2), 2))
        )
        assert largest_ratio(step.T @ there @ step, here) <= 1 - 2 * float(found.alpha) * 0.01 + ROUNDING


def test_what_turns_too_fast_is_not_followed() -> None:
    """As fast as the error falls, the motion itself pumps it up; no P is found, rather than a wrong one."""
    family = rotating("4")
    found = following(family, *family.variables, 0.001)
    assert found is None or found.alpha < 0.2

"""Covers by cells of angles and curved variables: what is proposed falls along motions, and a rate above is refused."""

from __future__ import annotations

import json
import math
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy

from codegen.certify.certificate_text import to_prefix
from codegen.certify.content import Found
from codegen.certify.cover import LESS, by_cover, with_cover
from codegen.certify.enclosure import enclose_family
from codegen.certify.family import Family
from codegen.checker import decay, kernel, verify
from tests.checker.test_verify import certificate
from tests.slow_cases import drawn, slow_except

from .certified import fall, step_matrix
from .test_refute import spectral

HERE = Path(__file__).parents[2] / "generated/two_link_arm"
ARM = json.loads((HERE / "certificate.json").read_text("utf-8"))
LIMIT = json.loads((HERE / "limit.json").read_text("utf-8"))
P = np.array([[float(Fraction(x)) for x in row] for row in ARM["lyapunov_matrix"]])
ROUNDING = 1e-9


def largest_ratio(step: Any, p: Any) -> float:
    root = np.linalg.inv(np.linalg.cholesky(p))
    return float(np.linalg.eigvalsh(root @ step.T @ p @ step @ root.T)[-1])


@drawn(120, 720)
def test_v_of_the_arm_falls_at_every_point_and_hardly_faster_than_stated(draws: int) -> None:
    """On a dense grid of the elbow's angle, at every end of the speeds and signs."""
    worst = 0.0
    for theta in np.linspace(-math.pi, math.pi, draws):
        for k in range(16):
            w1, w2, s1, s2 = (1 if k >> i & 1 else -1 for i in range(4))
            at = {"omega1": 0.3 * w1, "omega2": 0.3 * w2, "s_elbow": s1, "s_shoulder": s2, "theta2": theta}
            worst = max(worst, largest_ratio(step_matrix(ARM, at), P))
    assert 1 - 1.02 * (1 - fall(ARM)) < worst <= fall(ARM) + ROUNDING


def test_the_refuted_rate_is_that_of_its_point_and_above_the_certified_one() -> None:
    verify.check(json.dumps(LIMIT))
    stated = float(Fraction(LIMIT["decay_rate"]))
    assert spectral(LIMIT) < stated < 1.002 * spectral(LIMIT)
    assert 0.6 * stated < float(Fraction(ARM["decay_rate"])) < stated


@pytest.mark.parametrize("share", ["102/100", "2"])
def test_a_faster_rate_of_the_same_p_is_refused(share: str) -> None:
    rate = str(Fraction(ARM["decay_rate"]) * Fraction(share))
    with pytest.raises(verify.Refused, match="V may not fall"):
        verify.check(json.dumps(ARM | {"decay_rate": rate}))


def rotating(size: Any) -> Family:
    """A = −1 + size·u w', with u, w the first and second axis of a frame that turns by q."""
    q = sympy.Symbol("q", real=True)
    a, b, c = sympy.symbols("a b c", real=True)
    matrix = sympy.Matrix([[-1 - size * c, size * a], [-size * b, -1 + size * c]])
    shape = {a: sympy.cos(q) ** 2, b: sympy.sin(q) ** 2, c: sympy.sin(q) * sympy.cos(q)}
    return Family({q: (sympy.Rational(-2), sympy.Rational(2))}, shape, matrix)


def test_a_frame_that_turns_is_proposed_up_to_where_no_common_p_is() -> None:
    """By symmetry P = I serves if any does: the rate is 1 − size/2, less what is of the order of h."""
    found = by_cover(rotating(sympy.Rational(1)), sympy.Rational(1, 100))
    assert found is not None and 0.44 < found.rate < 0.5
    assert by_cover(rotating(sympy.Rational(5, 2)), sympy.Rational(1, 100)) is None


@pytest.mark.parametrize("turned", [False, True])
def test_where_there_is_no_cover_few_cells_are_tried(turned: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """All five shares were tried, on twice as many cells where a slip turns within a sample: sin(q + h w)."""
    family, tried, decreases = rotating(sympy.Rational(1)), list[Any](), decay.decreases
    if turned:
        (q,), w = family.variables, sympy.Symbol("w", real=True)
        sine = {e: v.subs(q, q + w / 2000) if v.has(sympy.cos) else v for e, v in family.parameters.items()}
        family = Family({**family.variables, w: (sympy.Rational(-1), sympy.Rational(1))}, sine, family.matrix)
    monkeypatch.setattr(decay, "decreases", lambda *given: tried.append(given) or decreases(*given))
    h = sympy.Rational(1, 100)
    assert with_cover(Found(family, np.eye(2), 5.0), h) is None and len(tried) <= 14


@pytest.mark.parametrize("share", LESS)
def test_the_largest_share_that_has_a_cover_is_proposed(share: float) -> None:
    """V = e'e of the turning frame falls at 0.4976 1/s."""
    found = with_cover(Found(rotating(sympy.Rational(1)), np.eye(2), 0.496 / share), sympy.Rational(1, 100))
    assert found is not None and found.rate == pytest.approx(0.496 * 0.999)


@pytest.mark.parametrize("seed", slow_except(range(12), range(4)))
def test_a_random_quotient_is_accepted_just_when_samples_show_it(seed: int) -> None:
    """Two angles' and a variable's quotient: a little below the best rate of its P, and never above."""
    dice = np.random.default_rng(seed)

    def short(low: float, high: float) -> Any:
        return sympy.Rational(round(float(dice.uniform(low, high)) * 1000), 1000)

    q, w = sympy.symbols("q w", real=True)
    bottom = 2 + short(-1, 1) * sympy.cos(q) + short(-0.9, 0.9) * sympy.sin(q) * sympy.cos(q) + short(-0.2, 0.2) * w
    theta = sympy.symbols("r x y", real=True)
    shape = dict(zip(theta, (1 / bottom, sympy.cos(q) / bottom, w * sympy.sin(q)), strict=True))
    rows = [
        [-2, short(-1, 1) * theta[1]],
        [short(-1, 1) * theta[0] + short(-1, 1) * theta[2], -2 + short(-1, 1) * theta[1]],
    ]
    matrix, h = sympy.Matrix(rows), sympy.Rational(1, 100)
    function = sympy.lambdify((q, w), matrix.xreplace(shape), "numpy")
    p = np.array([[1, 0.2], [0.2, 1.5]])
    worst = max(
        largest_ratio(np.eye(2) + 0.01 * np.array(function(x, y), dtype=float), p)
        for x in np.linspace(-math.pi, math.pi, 500)
        for y in np.linspace(-1, 1, 5)
    )
    best = (1 - worst) / 0.02
    tree: Any = ""
    for k in range(15, 0, -1):
        tree = ["q t", f"{k}/16", "", tree]
    stated = certificate(
        2,
        sample_time="1/100",
        variables={"q": ["-4", "4"], "w": ["-1", "1"]},
        parameters=[{"name": s.name, "expression": to_prefix(e)} for s, e in shape.items()],
        matrix=[[to_prefix(e) for e in matrix.row(i)] for i in range(2)],
        lyapunov_matrix=[["1", "1/5"], ["1/5", "3/2"]],
        cover=[tree],
    )
    assert h > 0
    verify.check(json.dumps(stated | {"decay_rate": str(Fraction(f"{0.97 * best:.6f}"))}))
    with pytest.raises(verify.Refused, match="V may not fall"):
        verify.check(json.dumps(stated | {"decay_rate": str(Fraction(f"{1.001 * best:.6f}"))}))


@pytest.mark.parametrize("seed", range(20))
def test_angles_and_reciprocals_are_what_they_stand_for(seed: int) -> None:
    """A random quotient, at a random angle: with the tangent and the signs put in, and cleared of its divisors."""
    dice = np.random.default_rng(seed)
    x = float(dice.uniform(-7, 7))
    known: dict[Any, Any] = {}
    c, s = (kernel.function(name, kernel.term(1, "x"), known) for name in ("cos", "sin"))
    d = kernel.term(3) + c * s + kernel.term(Fraction(1, 2)) * s
    r = kernel.function("1/", d, known)
    e = kernel.function("1/", kernel.term(2) + r * c, known)
    made = r * e * s + kernel.term(2) * c * r * r + c * c + s * s
    number, t = math.cos(x) * math.sin(x) + 3 + math.sin(x) / 2, math.tan(abs(math.asin(abs(math.sin(x)))) / 2)
    values = {"x t": t, "sign.cos x": math.copysign(1, math.cos(x)), "sign.sin x": math.copysign(1, math.sin(x))}
    wanted = math.sin(x) / number / (2 + math.cos(x) / number) + 2 * math.cos(x) / number**2 + 1
    both = kernel.cleared(kernel.joined([[made], [kernel.term(1)]]), known)

    def at(place: str) -> float:
        return sum(float(a) * math.prod(values[y] for y in m) for (where, *m), a in both.items() if where == place)

    assert math.isclose(at("#0 0") / at("#1 0"), wanted, rel_tol=1e-9)
    assert both.names() <= {*values, "#0 0", "#1 0"}


def test_an_equation_of_a_reciprocal_is_used_and_no_other() -> None:
    known: dict[Any, Any] = {}
    d = kernel.term(2) + kernel.term(1, "y")
    r = kernel.function("1/", d, known)
    one = kernel.term(1)
    assert not kernel.cleared(r * d - one, known)
    for other in (r * d + one, r * r * d - one, r * kernel.term(2) - one, r - one):
        assert kernel.cleared(other, known)
    box = {"y": (Fraction(-1), Fraction(1))}
    kernel.semidefinite([[d]], box, "", {}, kernel.LEAST)
    with pytest.raises(ValueError, match="not positive semidefinite"):
        kernel.semidefinite([[d]], {"y": (Fraction(-2), Fraction(1))}, "", {}, kernel.LEAST)
    for low in ("-3/2", "-19999/10000"):  # y r = 1 - 2 r, and not any product of their ranges
        contracted = [[kernel.term(1, "y") * r]]
        size = abs(Fraction(low) / (2 + Fraction(low)))
        cell = {"y": (Fraction(low), Fraction(1))}
        kernel.contracts(contracted, [[one]], size**2, cell, "", known)
        with pytest.raises(ValueError, match="V may not fall"):
            kernel.contracts(contracted, [[one]], size**2 * Fraction(99, 100), cell, "", known)


def test_the_sum_of_squares_of_a_sine_and_a_cosine_is_one() -> None:
    known: dict[Any, Any] = {}
    c, s = (kernel.function(name, kernel.term(1, "x"), known) for name in ("cos", "sin"))
    other = kernel.function("cos", kernel.term(1, "y"), known)
    assert not kernel.cleared(c * c + s * s - kernel.term(1), known)
    for wrong in (c * c - s * s - kernel.term(1), c * c + other * other - kernel.term(1), c - s, c - other):
        assert kernel.cleared(wrong, known)


def test_what_is_covered_is_one_quotient_and_no_box_of_functions() -> None:
    assert decay.leaves(ARM["cover"][0]) <= 8


def ball_on_beam() -> Family:
    """A = −2 + r w/(1 + r²) in one entry: affine in w, and curved in r."""
    r, w, theta = sympy.symbols("r w theta", real=True)
    ends = sympy.Rational(1, 2)
    return Family({r: (-ends, ends), w: (-ends, ends)}, {theta: r * w / (1 + r**2)}, sympy.Matrix([[theta - 2]]))


def test_a_variable_in_which_a_is_curved_is_cut() -> None:
    """The largest entry is −2 + 1/5 at a corner, so that α = 1.8 − 1.8²h/2."""
    h = sympy.Rational(1, 100)
    found = by_cover(ball_on_beam(), h)
    assert found is not None and 0.95 * 1.7838 < found.rate < 1.7838
    assert json.dumps(found.cover).count('"w"') == 0


def test_cells_are_cut_along_the_curved_variable_first() -> None:
    """By intervals r w/(1 + r²) is up to 1/4 in place of 1/5; cells of w would not change that."""
    cells = enclose_family(ball_on_beam())
    sizes = {v.name: len(breaks) - 1 for v, breaks in cells.splits.items()}
    assert sizes["r"] > 3 * sizes.get("w", 1)
    assert 0.2 <= cells.matrices.max() + 2 < 0.203

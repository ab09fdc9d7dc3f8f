"""Routh–Hurwitz and Jury conditions against NumPy's roots, and the conditions of the thesis that come out of them."""

from __future__ import annotations

import random
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy

from codegen.analysis.analysis import Analysis, analyse
from codegen.analysis.conditions import written_conditions
from codegen.analysis.operating_points import evaluate
from codegen.analysis.polynomials import (
    bilinear,
    characteristic_polynomial,
    expand_products,
    hurwitz_determinant,
    jury,
    routh_hurwitz,
)
from codegen.app.derive import analysis_json
from codegen.mechanics import build_system
from codegen.mechanics.sparse import jacobian
from codegen.observers import build_observer
from codegen.spec import parse_spec, read_spec
from codegen.spec.functions import Magnitude
from tests.expected_errors import refused
from tests.machines import ONE_MASS, machine
from tests.slow_cases import drawn, slow_except

H = sympy.Symbol("h", positive=True)
# A root this close to the boundary (relative to the largest) is decided by rounding of the roots, which NumPy finds to
# about 1e-16**(1/order): such draws are left out, and counted.
EDGE = 1e-3


def compiled(order: int) -> tuple[Any, Any]:
    c = sympy.symbols(f"k0:{order}", real=True)
    full = [sympy.Integer(1), *c]
    routh = sympy.lambdify(c, [e for _, e in routh_hurwitz(full)])
    step = sympy.lambdify([*c, H], [e for _, e in jury(full, H)])
    return routh, step


def random_roots(order: int, generator: np.random.Generator) -> Any:
    """Real and conjugate roots, half of the sets stable."""
    roots: list[complex] = []
    shift = generator.choice([-1.2, 0.0])
    while len(roots) < order:
        re, im = generator.normal() + shift, generator.normal() * 2
        roots += [complex(re, im), complex(re, -im)] if order - len(roots) > 1 and generator.random() < 0.5 else [re]
    return np.array(roots)


@pytest.mark.parametrize("order", slow_except(range(1, 7), range(1, 6)))
def test_routh_and_jury_agree_with_the_roots(order: int) -> None:
    """400 random polynomials each, 2400 in all, with no disagreement outside rounding."""
    routh, step = compiled(order)
    generator = np.random.default_rng(order)
    used, stable = 0, 0
    for _ in range(450):
        roots = random_roots(order, generator)
        h = float(generator.uniform(0.1, 1.5))
        c = np.real(np.poly(roots))[1:]
        if np.abs(roots.real).min() > EDGE:
            assert all(value > 0 for value in routh(*c)) == (roots.real < 0).all()
        radius = np.abs(1 + h * roots)
        if np.abs(radius - 1).min() > EDGE and np.abs(roots.real).min() > EDGE:
            assert all(value > 0 for value in step(*c, h)) == (radius < 1).all()
            used, stable = used + 1, stable + int((radius < 1).all())
    assert used >= 400
    assert stable >= 5


def printed(order: int) -> tuple[Any, Any]:
    """The lines that are printed, in continuous and in sampled time, over free coefficients."""
    c = sympy.symbols(f"k0:{order}", real=True)
    full = [sympy.Integer(1), *c]
    routh = written_conditions(routh_hurwitz(full), full, full, set())
    step = written_conditions(jury(full, H), full, full, {H})
    return sympy.lambdify(c, [e for _, e in routh]), sympy.lambdify([*c, H], [e for _, e in step])


@pytest.mark.parametrize("orders", [(1,), (2,), (3,), (4,), (5,), (1, 2), (2, 2), (1, 1, 3)])
def test_the_lines_printed_hold_just_where_the_roots_say_so(orders: tuple[int, ...]) -> None:
    """Each list by itself, for polynomials of one and of several factors; the roots by NumPy of their product."""
    lines = [printed(order) for order in orders]
    generator = np.random.default_rng(list(orders))
    counts = {True: 0, False: 0}
    for _ in range(300):
        h = float(generator.uniform(0.1, 1.5))
        parts = [np.real(np.poly(random_roots(order, generator) * generator.choice([0.4, 1]))) for order in orders]
        whole = np.array([1.0])
        for part in parts:
            whole = np.polymul(whole, part)
        roots = np.roots(whole)
        radius = np.abs(1 + h * roots)
        if np.abs(roots.real).min() < EDGE or np.abs(radius - 1).min() < EDGE:
            continue
        routh = all(value > 0 for (left, _), part in zip(lines, parts, strict=True) for value in left(*part[1:]))
        step = all(value > 0 for (_, right), part in zip(lines, parts, strict=True) for value in right(*part[1:], h))
        assert routh == (roots.real < 0).all()
        assert step == (radius < 1).all()
        counts[step] += 1
    assert min(counts.values()) >= 5 and sum(counts.values()) >= 250


@pytest.mark.parametrize("name", ["one_mass_dfo", "rig_dfob"])
def test_the_value_of_a_condition_is_exact_beside_a_fast_rate(name: str) -> None:
    """c0 = -det of Psi by Leibniz in fractions; in doubles one_mass_dfo had -2.2e-11 where f = 0 makes it zero."""
    spec = read_spec(Path(__file__).parents[2] / "specs" / "thesis" / f"{name}.yaml")
    found = analyse(spec, build_observer(spec, build_system(spec)))
    exact = []
    for matrix in evaluate(found.dynamics, found.dynamics.in_force(found.dynamics.jacobian), found.points):
        (a, b, c), (d, e, f), (g, h, i) = ([Fraction(float(x)) for x in row] for row in matrix)
        exact.append(-(a * e * i + b * f * g + c * d * h - c * e * g - b * d * i - a * f * h))
    printed = {c.label: c.value for c in found.routh}
    assert printed["c0"] == float(min(exact)) == 0
    assert sum(0 < x < Fraction(1, 10**6) for x in exact) > 3


TRACKERS = {
    ("one_mass", "to"): "{{K_1: {2}, K_2: {4}, K_v: {0}}}",
    ("two_mass", "gto"): "{{K_1: [{2}, {3}], K_2: [[{4}, {3}], [{2}, {5}]], K_v: [{0}, {1}]}}",
}


STEPPED = [
    *[("one_mass", "to", step) for step in ("euler", "semi_implicit", "exponential")],
    ("two_mass", "gto", "euler"),
]


@pytest.mark.parametrize(("name", "kind", "integration"), slow_except(STEPPED, STEPPED[:3], several=True))
def test_jury_s_lines_alone_say_whether_a_machine_s_step_is_stable(name: str, kind: str, integration: str) -> None:
    """Gains K_2 of either sign: where only the sign of a gain is wrong, one of Jury's own lines fails."""
    generator = np.random.default_rng(list(f"{name}{kind}{integration}".encode()))
    seen = set()
    for sign in (-1, -1, 1):
        values = [*generator.uniform(1, 60, 2), *generator.uniform(-9, 9, 2), *sign * generator.uniform(1, 60, 2)]
        gains = TRACKERS[name, kind].format(*[f"{v:.4f}" for v in values])
        section = (
            f"{{kind: {kind}, velocity: estimated, gains: {gains}, sample_time: 0.003, integration: {integration}}}"
        )
        spec, system = machine(name, section)
        found = analyse(spec, build_observer(spec, system))
        radius = max(
            np.abs(np.linalg.eigvals(np.eye(len(a)) + 0.003 * a)).max() for a in _numbers(found, found.dynamics.sampled)
        )
        assert all(c.holds for c in found.jury) == (radius < 1), (values, radius)
        at = {**found.dynamics.observer.values, sympy.Symbol("h", real=True): sympy.Rational(3, 1000)}
        lines = [c.expression.subs(at) for c in found.jury]
        if all(line.is_number for line in lines):
            assert all(line > 0 for line in lines) == (radius < 1)
        seen.add(bool(radius < 1))
    assert False in seen


def test_a_positive_gain_of_a_tracker_fails_one_of_jury_s_lines() -> None:
    """rig_to with K_2 = +10 grows by 1.085 a sample; every one of the Jury lines that were printed used to hold."""
    path = Path(__file__).parents[2] / "specs" / "thesis" / "rig_to.yaml"
    text = path.read_text("utf-8")
    assert "K_2: -10" in text
    for gain, stable in (("-10", True), ("10", False)):
        spec = parse_spec(text.replace("K_2: -10", f"K_2: {gain}"), path)
        found = analyse(spec, build_observer(spec, build_system(spec)))
        assert (found.spectral_radius < 1) == stable == all(c.holds for c in found.jury)
        shown = analysis_json(found)["jury"]
        assert all(line["holds"] for line in shown) == stable
    assert [line["greater_than_zero"] for line in shown if not line["holds"]] == ["-K_1 - K_2*K_v"]


@pytest.mark.parametrize("n", range(1, 6))
def test_characteristic_polynomial(n: int) -> None:
    matrix = sympy.Matrix(n, n, lambda i, j: sympy.Rational((3 * i + 7 * j * j - 5) % 11, 3))
    s = sympy.Symbol("s")
    assert characteristic_polynomial(matrix) == sympy.Poly((s * sympy.eye(n) - matrix).det(), s).all_coeffs()


def test_the_bilinear_map_is_that_of_the_docstring() -> None:
    """p(δ) with δ = s/(1 − sh/2), times (1 − sh/2)ⁿ, at numbers."""
    c, h = [1, 4, 7, 3], sympy.Rational(1, 5)
    for s in (sympy.Rational(3, 7), sympy.Rational(-2, 3)):
        delta = s / (1 - s * h / 2)
        right = sum(k * delta ** (3 - i) for i, k in enumerate(c)) * (1 - s * h / 2) ** 3
        assert sum(k * s ** (3 - i) for i, k in enumerate(bilinear(c, h))) == right


def test_hurwitz_determinants_of_a_cubic() -> None:
    """Known by hand: D1 = a, D2 = ab − c, D3 = c(ab − c) for s³ + a s² + b s + c."""
    a, b, c = sympy.symbols("a b c")
    found = [hurwitz_determinant([1, a, b, c], k) for k in (1, 2, 3)]
    assert [sympy.expand(f - r) for f, r in zip(found, [a, a * b - c, c * (a * b - c)], strict=True)] == [0, 0, 0]


def analysis_of(kind: str, gains: str, name: str, h: float) -> Analysis:
    section = f"{{kind: {kind}, velocity: estimated, gains: {gains}, sample_time: {h}}}"
    spec, system = machine(name, section)
    return analyse(spec, build_observer(spec, system))


@drawn(120, 500)
def test_the_thesis_conditions_of_the_cfo(draws: int) -> None:
    """(3.19): on a mass without other forces Ψ is stable just when k_v > 0 and k_F > 0."""
    text = ONE_MASS.replace("w - b*v - k*x", "w") + (
        "observer: {kind: cfo, velocity: estimated, gains: {K_F: 10, K_v: 100}, sample_time: 0.001}\n"
    )
    spec = parse_spec(text, Path("one_mass.yaml"))
    found = analyse(spec, build_observer(spec, build_system(spec)))
    k_f, k_v, m = sympy.symbols("K_F K_v m", real=True)
    assert [c.expression for c in found.routh] == [k_v, k_f]
    assert found.polynomial == (1, k_v, k_f * k_v / m)  # s² + k_v s + k_F k_v of section 3.4.1, with its unit mass as m
    # and the sampled conditions are those of |z² − (2 − h k_v) z + 1 − h k_v + h² k_F k_v/m|, by Jury's own table
    h = 0.001
    for k_f_value, k_v_value in np.random.default_rng(0).uniform([-500, -500], [3e6, 4500], (draws, 2)):
        b, c = -(2 - h * k_v_value), 1 - h * k_v_value + h * h * k_f_value * k_v_value / 1.7
        by_table = 1 + b + c > 0 and 1 - b + c > 0 and c < 1
        at = {k_f: k_f_value, k_v: k_v_value, m: 1.7, sympy.Symbol("h", real=True): h}
        held = all(float(x.expression.subs(at)) > 0 for x in (*found.routh, *found.jury))
        assert held == by_table


GAINS = {
    ("one_mass", "cfo"): "{{K_F: {0}, K_v: {1}}}",
    ("one_mass", "to"): "{{K_1: {2}, K_2: -{0}, K_v: {1}}}",
    ("two_mass", "gcfo"): "{{K_F: [[{0}, {2}], [{3}, {1}]], K_v: [{1}, {0}]}}",
    ("two_mass", "gto"): "{{K_1: [{2}, {3}], K_2: [[-{0}, {3}], [{2}, -{1}]], K_v: [{1}, {0}]}}",
}


@pytest.mark.parametrize(
    ("name", "kind"), slow_except(list(GAINS), [g for g in GAINS if g != ("two_mass", "gcfo")], several=True)
)
def test_conditions_and_largest_sample_time_against_eigenvalues(name: str, kind: str) -> None:
    """Random gains through the whole analysis: conditions hold just where eigenvalues say so; the largest sample time
    is where bisection on the spectral radius of I + hΨ finds it, to 1e-6 (the bisection stops at 1e-9)."""
    generator = np.random.default_rng(list(f"{name}{kind}".encode()))
    for _ in range(6):
        values = [*generator.uniform(1, 60, 2), *generator.uniform(-60, 60, 2)]
        h = float(generator.choice([0.001, 0.03]))
        found = analysis_of(kind, GAINS[name, kind].format(*[f"{v:.4f}" for v in values]), name, h)
        psi = _numbers(found, found.dynamics.jacobian)
        step = _numbers(found, found.dynamics.sampled)
        hurwitz = max(np.linalg.eigvals(m).real.max() for m in psi)
        radius = max(np.abs(np.linalg.eigvals(np.eye(len(m)) + h * m)).max() for m in step)
        assert found.spectral_abscissa == pytest.approx(hurwitz, rel=1e-6, abs=1e-9)
        assert found.spectral_radius == pytest.approx(radius, rel=1e-9)
        assert all(c.holds for c in found.routh) == (hurwitz < 0)
        assert all(c.holds for c in (*found.routh, *found.jury)) == (hurwitz < 0 and radius < 1)
        if hurwitz >= 0:
            assert found.largest_sample_time == 0
            continue
        low, high = 0.0, 1e4
        for _ in range(100):
            middle = (low + high) / 2
            bad = any(np.abs(np.linalg.eigvals(np.eye(len(m)) + middle * m)).max() >= 1 for m in psi)
            low, high = (low, middle) if bad else (middle, high)
        assert found.largest_sample_time == pytest.approx(low, rel=1e-6)


def _numbers(found: Analysis, matrix: Any) -> list[Any]:
    """The matrix at every point of the analysis, by SymPy's own substitution in force form."""
    exact = found.dynamics.in_force(matrix).subs(found.dynamics.observer.values)
    exact = exact.subs(sympy.Symbol("h", real=True), found.dynamics.observer.sample_time)
    variables = sorted(exact.free_symbols, key=str)
    columns = [list(found.points.variables).index(s) for s in variables]
    function = sympy.lambdify(variables, exact, [{"Sgn": np.sign, "Magnitude": np.abs}, "numpy"])
    rows = found.points.values[:, columns] if columns else np.zeros((1, 0))
    return [np.array(function(*row), dtype=float) for row in np.unique(rows, axis=0)]


def test_an_envelope_where_the_slopes_are_infinite_is_told() -> None:
    text = ONE_MASS.replace("w - b*v - k*x", "w - b*v*sqrt(x/r)").replace(" b:", " r: {value: 1, unit: m}\n  b:")
    text += "observer: {kind: cfo, velocity: estimated, gains: {K_F: 10, K_v: 100}, sample_time: 0.001}\n"
    spec = parse_spec(text + "envelope: {x: [-1, 1]}\n", Path("one_mass.yaml"))
    with refused("SPEC033 envelope: s_rail -1"):
        analyse(spec, build_observer(spec, build_system(spec)))


@pytest.mark.parametrize("h", [0.01, 0.19, 0.21, 0.25])
def test_a_motion_without_contact_limits_the_sample_time(h: float) -> None:
    """Three masses, two contacts, K_v = k_v I: beside the modes of λ there is a factor s + k_v, stable for h < 2/k_v;
    at λ = 3 and 3.5 with k_v = 10 that is 0.2 s, where 1/λ alone would allow 0.286 s."""
    text = (
        "name: three\n"
        "coordinates: {x: {velocity: u, unit: m}, y: {velocity: v, unit: m}, z: {velocity: r, unit: m}}\n"
        "inputs: {w: {unit: N}}\n"
        "parameters: {m: {value: 10, unit: kg}}\n"
        "mass_matrix: [[m, 0, 0], [0, m, 0], [0, 0, m]]\n"
        "force: [w, w, w]\n"
        "friction:\n"
        "  distribution: [[1, 0], [0, 1], [0, 0]]\n"
        "  contacts: [{name: one, law: coulomb, a: 5, unit: N}, {name: two, law: coulomb, a: 5, unit: N}]\n"
        f"observer: {{kind: gcfo, velocity: estimated, gains: {{K_F: [30, 35], K_v: 10}}, sample_time: {h}}}\n"
    )
    spec = parse_spec(text, Path("three.yaml"))
    found = analyse(spec, build_observer(spec, build_system(spec)))
    assert found.modes is not None and found.modes.frictionless == 1
    assert found.modes.sample_time == pytest.approx(0.2) == found.largest_sample_time
    assert all(c.holds for c in found.routh)
    assert all(c.holds for c in found.jury) == (found.spectral_radius < 1) == (h < 0.2)


@pytest.mark.parametrize("exponent", [1, 2, 3, 5])
def test_a_square_that_may_be_zero_stays_in_a_condition(exponent: int) -> None:
    """h = s^μ has no slope at u = 0 for μ > 1: there the error does not decay, and the conditions as written say so."""
    text = ONE_MASS.replace("w - b*v - k*x", "w") + (
        f"observer: {{kind: cfo, velocity: measured, exponent: {exponent}, gains: {{K_F: 10}}, sample_time: 0.001}}\n"
        "envelope: {v: [-2, 2]}\n"
    )
    spec = parse_spec(text, Path("one_mass.yaml"))
    found = analyse(spec, build_observer(spec, build_system(spec)))
    v = sympy.Symbol("v", real=True)
    for conditions in (found.routh, found.jury):
        values = [c.expression.subs(found.dynamics.observer.values) for c in conditions]
        values = [value.subs(found.dynamics.observer.signs[0], sympy.sign(v)).subs(v, 0) for value in values]
        values = [value.subs(sympy.Symbol("h", real=True), found.dynamics.observer.sample_time) for value in values]
        written = all(float(value.replace(Magnitude, sympy.Abs).doit()) > 0 for value in values)
        assert written == (exponent == 1) == all(c.holds for c in conditions)


def nested(dice: random.Random, symbols: tuple[Any, ...], depth: int) -> Any:
    """A random expression of sums, products, whole and half powers, and functions."""
    if depth == 0:
        return dice.choice([*symbols, sympy.Rational(dice.randrange(-5, 6), 3)])
    parts = [nested(dice, symbols, depth - 1) for _ in range(3)]
    kind = dice.randrange(6)
    if kind < 2:
        return sympy.Add(*parts)
    if kind < 4:
        return sympy.Mul(*parts)
    if kind == 4:
        return (parts[0] ** 2 + 1) ** dice.choice([2, -1, sympy.Rational(1, 2)])
    return dice.choice([sympy.sin, Magnitude])(parts[0])


def test_slopes_and_products_are_those_of_sympy() -> None:
    dice, symbols = random.Random(5), sympy.symbols("a b c", real=True)
    for _ in range(60):
        e = nested(dice, symbols, 3)
        slopes = jacobian([e], symbols)
        points = [{x: sympy.Rational(dice.randrange(1, 99), 50) for x in symbols} for _ in range(2)]
        for x, slope in zip(symbols, slopes, strict=True):
            assert all(abs(sympy.N((slope - sympy.diff(e, x)).subs(p))) < 1e-9 for p in points)
        functions = {f: sympy.Dummy(real=True) for f in e.atoms(sympy.Function)}
        if all(not g.has(f) for f in functions for g in functions if f != g):
            masked = sympy.expand(e.xreplace(functions)).xreplace({d: f for f, d in functions.items()})
            assert expand_products(e) == masked


def test_slopes_at_a_point_are_the_slopes_with_its_values_inserted() -> None:
    dice, symbols = random.Random(6), sympy.symbols("a b c", real=True)
    for _ in range(60):
        e = nested(dice, symbols, 3)
        at, c = {x: sympy.Rational(dice.randrange(1, 99), 50) for x in symbols[:2]}, sympy.Rational(7, 5)
        for x, slope in zip(symbols, jacobian([e], symbols, at), strict=True):
            assert not slope.free_symbols & at.keys()
            assert abs(sympy.N(slope.subs(symbols[2], c) - sympy.diff(e, x).subs({**at, symbols[2]: c}))) < 1e-9

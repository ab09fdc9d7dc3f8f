"""Sines and cosines of many multiples of one angle, built from one of each by the addition theorem."""

from __future__ import annotations

import casadi
import numpy as np
import pytest
import sympy

from codegen.mechanics import casadi_form
from codegen.mechanics.casadi_form import over_rows, to_casadi

x, period = sympy.symbols("x period", positive=True)


def sines_in(expression: casadi.SX) -> int:
    function = casadi.Function("f", casadi.symvar(expression), [expression])
    codes = [function.instruction_id(k) for k in range(function.n_instructions())]
    return sum(code in (casadi.OP_SIN, casadi.OP_COS) for code in codes)


def test_many_waves_take_one_sine_and_one_cosine_and_are_the_same_sum() -> None:
    orders, rng = (1, 2, 5, 18, 72, 119), np.random.default_rng(0)
    weights = rng.standard_normal((len(orders), 2))
    turn = 2 * sympy.pi * x / period
    waves = [a * sympy.sin(k * turn) + b * sympy.cos(k * turn) for k, (a, b) in zip(orders, weights, strict=True)]
    names = {x: casadi.SX.sym("x"), period: casadi.SX.sym("period")}
    fast = to_casadi(sympy.Add(*waves), names, by_angle=True)
    assert sines_in(fast) == 2 and sines_in(to_casadi(sympy.Add(*waves), names)) == 12
    function = casadi.Function("f", list(names.values()), [fast])
    at = rng.uniform(-7, 70, 200)
    angle = 2 * np.pi * at[:, None] * orders / 6.2
    expected = np.sin(angle) @ weights[:, 0] + np.cos(angle) @ weights[:, 1]
    assert np.array([float(function(p, 6.2)) for p in at]) == pytest.approx(expected, abs=1e-10)


def test_a_lone_wave_and_other_angles_stay_as_they_are() -> None:
    names = {x: casadi.SX.sym("x")}
    for lone in (sympy.sin(2 * x), sympy.sin(x) + sympy.cos(sympy.sqrt(2) * x) + sympy.sin(3 * x**2)):
        assert sines_in(to_casadi(lone, names, by_angle=True)) == len(lone.atoms(sympy.sin, sympy.cos))


def test_a_function_written_out_for_several_points_has_the_same_bits() -> None:
    at, rng = casadi.SX.sym("at", 3), np.random.default_rng(1)
    force = 2.1 * at[0] - 0.3 * casadi.sign(at[1]) + casadi.sin(at[2]) / (1 + at[0] ** 2)
    function = casadi.Function("f", [at], [casadi.vertcat(force, casadi.exp(-at[1]) * at[2])])
    rows = rng.standard_normal((casadi_form._MANY + 37, 3))
    apart = np.concatenate([over_rows(function, part) for part in np.array_split(rows, 3)])
    assert np.array_equal(over_rows(function, rows), apart)
    short, long = (casadi_form._mapped(function, casadi_form._ROWS, often) for often in (False, True))
    assert long.size_in(0) == short.size_in(0)
    assert np.array_equal(apart[5], np.array(function(rows[5])).ravel())

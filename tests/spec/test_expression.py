"""Expressions against exact arithmetic of our own on the same syntax trees, and what the parser must not read."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.base.errors import BadInput, Place
from codegen.spec.expression import exact_number, parse_expression
from codegen.spec.model import symbol
from tests.expected_errors import matches, refused
from tests.slow_cases import examples

PLACE = Place("machine.yaml", 7, "force[0]")
KNOWN = {name: symbol(name) for name in ("mass", "stiffness", "x1", "v1")}


def exact(text: str) -> Any:
    return parse_expression(text, PLACE).symbolic(KNOWN)


# Our own trees: a decimal literal, ("-", a), or (op, a, b). Each has its text, with as few parentheses as precedence
# allows, and its exact value; the value is worked out here, on fractions, and never from the text.
LITERALS = st.sampled_from(["0", "1", "2", "7", "0.1", "2.50", "1e-3", "3E2", "0.125", ".5", "4.", "123456789012345"])
TREES = st.recursive(
    LITERALS,
    lambda inner: st.one_of(
        st.tuples(st.just("neg"), inner),
        st.tuples(st.sampled_from(["+", "-", "*", "/"]), inner, inner),
        st.tuples(st.just("**"), inner, st.sampled_from(["0", "1", "2", "3", ("neg", "1"), ("neg", "2")])),
    ),
    max_leaves=12,
)
STRENGTH = {"+": 1, "-": 1, "*": 2, "/": 2, "neg": 3, "**": 4}


def value(tree: Any) -> Fraction | None:
    """The exact value; None where something is divided by zero."""
    if isinstance(tree, str):
        return Fraction(tree.rstrip(".") if tree.endswith(".") else tree)
    parts = [value(t) for t in tree[1:]]
    if None in parts:
        return None
    a, b = parts[0], parts[-1]
    match tree[0]:
        case "neg":
            return -a
        case "+":
            return a + b
        case "-":
            return a - b
        case "*":
            return a * b
        case "/":
            return None if b == 0 else a / b
    return None if a == 0 and b < 0 else a ** int(b)


def text_of(tree: Any, least: int = 0) -> str:
    """Text that Python's precedence reads as this tree; ``least`` is the strength that needs no parentheses."""
    if isinstance(tree, str):
        return tree
    own = STRENGTH[tree[0]]
    match tree[0]:
        case "neg":
            words = f"-{text_of(tree[1], own)}"
        case "**":  # binds its left tighter than a minus, its right looser: -2**2 is -(2**2), 2**-1 is 1/2
            words = f"{text_of(tree[1], own + 1)}**{text_of(tree[2], STRENGTH['neg'])}"
        case op:
            words = f"{text_of(tree[1], own)} {op} {text_of(tree[2], own + 1)}"
    return f"({words})" if own < least else words


@settings(max_examples=examples(400), deadline=None)
@given(TREES)
def test_arithmetic_is_exact_and_binds_as_in_python(tree: Any) -> None:
    right, words = value(tree), text_of(tree)
    if right is None:
        with refused("SPEC012"):
            exact(words)
    elif max(abs(right.numerator), right.denominator).bit_length() < 4000:
        assert exact(words) == sympy.Rational(right.numerator, right.denominator)


@pytest.mark.parametrize(
    ("words", "right"),
    [
        ("0.1", Fraction(1, 10)),
        ("0.1 + 0.2", Fraction(3, 10)),
        ("-2**2", Fraction(-4)),
        ("2**-1", Fraction(1, 2)),
        ("2**3**2", Fraction(512)),
        ("-2**-2", Fraction(-1, 4)),
        ("7/2/2", Fraction(7, 4)),
        ("1 - 2 - 3", Fraction(-4)),
        ("--3", Fraction(3)),
        ("+-+3", Fraction(-3)),
        ("2*-3", Fraction(-6)),
        ("1e-9 * 1e9", Fraction(1)),
        (0.1, Fraction(1, 10)),
        (3, Fraction(3)),
    ],
)
def test_known_values(words: Any, right: Fraction) -> None:
    assert exact(words) == sympy.Rational(right.numerator, right.denominator)


FUNCTIONS = {
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "exp": math.exp,
    "log": math.log,
    "sqrt": math.sqrt,
    "tanh": math.tanh,
    "abs": abs,
    "sgn": lambda z: math.copysign(1, z),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_are_those_of_the_standard_library(name: str) -> None:
    for at in (0.3, 1.7, 2.9) + ((-0.8, -2.2) if name not in ("log", "sqrt") else ()):
        found = exact(f"{name}(x1*1.25)").subs(KNOWN["x1"], sympy.Rational(str(at)))
        assert float(found) == pytest.approx(FUNCTIONS[name](1.25 * at), rel=1e-14)


def test_sgn_is_zero_at_zero_and_is_the_slope_of_abs() -> None:
    u = KNOWN["v1"]
    assert exact("sgn(0)") == 0
    assert exact("abs(v1)*v1").diff(u).subs(u, -3) == 6  # d(v|v|)/dv = 2|v|
    assert exact("sgn(v1)").diff(u) == 0


def test_a_root_of_a_square_is_a_magnitude() -> None:
    """SymPy's own Abs, of which no printer knows, must not come out."""
    assert exact("sqrt(v1**2)") == exact("abs(v1)")


def test_pi_is_the_circle_number() -> None:
    assert np.cos(float(exact("pi"))) == -1


def test_text_over_several_lines_is_one_expression() -> None:
    assert exact("1 +\n  2\n * 3") == 7


REFUSED = {
    "exp(" * 20 + "1" + ")" * 20: "SPEC011 exp",
    "exp(-" * 38 + "1" + ")" * 38: "SPEC011 exp",
    "__import__('os')": "SPEC008 `__import__`",
    "__import__('os').system('true')": "SPEC011",
    "x1.real": "SPEC011 x1.real",
    "x1[0]": "SPEC011 x1[0]",
    "lambda: 1": "SPEC011",
    "x1 < v1": "SPEC011 x1 v1",
    "x1 == v1": "SPEC011 x1 v1",
    "x1 if v1 else mass": "SPEC011 x1 v1",
    "'text'": "SPEC011",
    "f'{x1}'": "SPEC011 x1",
    "b'1'": "SPEC011 b'1'",
    "1j": "SPEC011 1j",
    "True": "SPEC011",
    "None": "SPEC011",
    "...": "SPEC006",
    "x1 and v1": "SPEC011 x1 v1",
    "not x1": "SPEC011 x1",
    "~1": "SPEC011 ~1",
    "x1 % 2": "SPEC011",
    "x1 // 2": "SPEC011",
    "x1 @ v1": "SPEC011",
    "1 << 3": "SPEC011",
    "[1, 2]": "SPEC011 [1 2]",
    "(1, 2)": "SPEC011 (1 2)",
    "{1: 2}": "SPEC011 {1 2}",
    "[x1 for x1 in v1]": "SPEC011",
    "(y := 1)": "SPEC011",
    "eval(x1)": "SPEC008",
    "sin": "SPEC008",
    "sin()": "SPEC011",
    "sin(x1, v1)": "SPEC011 sin(x1 v1)",
    "sin(x1, y=1)": "SPEC011 sin(x1 y=1)",
    "sin(*x1)": "SPEC011 *x1",
    "sin(x1)(v1)": "SPEC011 sin(x1)(v1)",
    "_hidden": "SPEC009 _hidden",
    "": "SPEC010",
    "   ": "SPEC010",
    "x1 +": "SPEC010",
    "2 x1": "SPEC010",
    "60 mm*sin(x1)": "SPEC010 without units",
    "x1; v1": "SPEC010",
    "x1 = 2": "SPEC010",
    "2if x1 else v1": "SPEC010 2if",
    "await x1": "SPEC011",
    "1e999": "SPEC007 1e999",
    "1e300": "SPEC007 below 1e300",  # it was to be between 1e-300 and 1e300
    "1e-999": "SPEC007 1e-999",
    "1e-999999999": "SPEC007 1e-999999999",
    "nan": "SPEC008",
    "inf": "SPEC008",
    "0x10": "SPEC006 0x10",
    "1/0": "SPEC012",
    "x1/(2 - 2)": "SPEC012",
    "x1/(x1 - x1)": "SPEC012",
    "0**-1": "SPEC012",
    "log(0)": "SPEC012",
    "sqrt(-1)": "SPEC012",
    "(-8)**(1/3)": "SPEC012",
    "2**1000": "SPEC011 2**1000",
    "2**-65": "SPEC011 2**-65",
    "x1**v1": "SPEC011 x1**v1",
    "x1**(0*log(0))": "SPEC011 x1**(0*log(0))",
    "(((9**64)**64)**64)**64": "SPEC011",
    "((1 + x1)**64)**64": "SPEC011",
    "(" * 60 + "1" + ")" * 60: "SPEC010",
    "-" * 900 + "x1": "SPEC010",
    "1" + "+1" * 980: "SPEC010",
    "1" + "+1" * 9000: "SPEC010",
    "1" * 20_001: "SPEC011 20001",
    "x1\x00": "",
    "х1": "SPEC010 х1",  # the first letter is Cyrillic
    "x１": "SPEC010",  # a full-width digit
    "ｓｉｎ(x1)": "",  # full-width letters, which Python itself would read as sin
    "2×3": "SPEC010 × '*'?",
    "x1·v1": "SPEC010 · '*'?",
    "x1−v1": "SPEC010 − '-'?",  # a minus sign that is no hyphen
    "x1²": "SPEC010 ² '**2'?",
    "sin(12°)": "SPEC010 ° deg",
    "2*|v1|*v1": "SPEC010 abs(v)",
}


@pytest.mark.parametrize("words", REFUSED, ids=lambda w: ascii(w)[:40])
def test_refused_with_file_and_line(words: str) -> None:
    with pytest.raises(BadInput) as told:
        exact(words)
    message = str(told.value)
    assert message.startswith("machine.yaml:7: force[0]: ")
    assert "; expected " in message
    assert matches(told.value, REFUSED[words])


def test_a_power_has_either_sign_as_in_units() -> None:
    assert exact("x1^2") == exact("x1**2")
    assert exact("-2^2") == -4 and exact("2^3^2") == 512


@pytest.mark.parametrize(
    ("wrong", "right"), [("stifness*x1", "stiffness"), ("Mass", "mass"), ("x", "x1"), ("v_1", "v1")]
)
def test_an_unknown_name_brings_the_nearest_known(wrong: str, right: str) -> None:
    with refused(f"SPEC008 `{wrong}`") as told:
        exact(wrong)
    assert told.value.nearest == right


def test_an_unknown_function_brings_the_nearest_known() -> None:
    with refused("SPEC008 `sine`") as told:
        exact("sine(x1)")
    assert told.value.nearest == "sin"


@pytest.mark.parametrize("words", ["1e999", "nan", "-inf", "1e-400", "1e-999999999", "twelve", "1/3", "", "0x10"])
def test_exact_number_refuses(words: str) -> None:
    with pytest.raises(BadInput):
        exact_number(words, PLACE)


@given(st.integers(-(10**15), 10**15), st.integers(-200, 200))
def test_a_number_of_up_to_fifteen_digits_is_the_decimal(digits: int, power: int) -> None:
    assert exact_number(f"{digits}e{power}", PLACE) == digits * sympy.Integer(10) ** power


@given(st.decimals(allow_nan=False, allow_infinity=False, min_value=-(10**20), max_value=10**20, places=12))
def test_a_longer_number_is_what_the_nearest_double_prints(number: Any) -> None:
    """The decimal that stands in the generated code, which the checker reads there."""
    found, double = exact_number(str(number), PLACE), int(number * 10**12) / 10**12
    assert Fraction(int(found.p), int(found.q)) == Fraction(repr(double))


@settings(max_examples=examples(300), deadline=None)
@given(st.text(alphabet="x1v+-*/().,^e 0123456789_[]{}:='\"\\\n√π²sincoqrt", max_size=40))
def test_any_text_is_an_expression_or_bad_input(words: str) -> None:
    try:
        exact(words)
    except BadInput as told:
        assert str(told).startswith("machine.yaml:7: ")

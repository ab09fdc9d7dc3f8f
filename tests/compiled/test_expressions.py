"""Printed expressions, compiled and in Python, against each other to the bit and against CasADi's own evaluation."""

from __future__ import annotations

import ctypes
import math
from contextlib import suppress
from pathlib import Path

import casadi
import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from codegen.base.errors import BadInput
from codegen.emit.c import FUNCTIONS
from codegen.emit.expression import Expressions, Language
from codegen.program.graph import Graph, Node, to_graph
from codegen.program.simplify import normalise
from tests.expected_errors import refused
from tests.slow_cases import examples

from .build import compile_shared

NAMES = ("x", "y", "z")
SYMBOLS = {name: casadi.SX.sym(name) for name in NAMES}
C_CALLS = {name: name for name in FUNCTIONS} | {"abs": "fabs", "sign": "signum"}
C = Language(C_CALLS)
PYTHON = Language({n: f"math.{n}" for n in FUNCTIONS} | {"abs": "abs", "sign": "_sign"})
SIGNUM = "static double signum(double u) { return u > 0.0 ? 1.0 : (u < 0.0 ? -1.0 : 0.0); }\n"


def sign(u: float) -> float:
    return 1.0 if u > 0.0 else (-1.0 if u < 0.0 else 0.0)


def printed(expression: casadi.SX, language: Language, factoring: bool = True) -> str:
    """The expression in its short form."""
    graph = Graph()
    root = to_graph(expression, {n: graph.symbol(n, False) for n in NAMES}, graph)
    short = normalise(root, [], graph, factoring)
    return Expressions(language, {n: n for n in NAMES}, {}).text(short[root[0]])


def in_python(expression: casadi.SX, at: tuple[float, ...]) -> float:
    names = dict(zip(NAMES, at, strict=True)) | {"math": math, "_sign": sign}
    return eval(printed(expression, PYTHON), names)


def in_c(folder: Path, expressions: list[casadi.SX]) -> list[ctypes._CFuncPtr]:
    """All expressions in one library."""
    lines = ["#include <math.h>", SIGNUM]
    for k, expression in enumerate(expressions):
        lines += [
            f"double f{k}(double x, double y, double z);",
            f"double f{k}(double x, double y, double z) {{",
            "(void)x; (void)y; (void)z; (void)signum;",
            f"return {printed(expression, C)}; }}",
        ]
    (folder / "expressions.c").write_text("\n".join(lines) + "\n")
    library = ctypes.CDLL(str(compile_shared(folder, "expressions.c")))
    functions = [getattr(library, f"f{k}") for k in range(len(expressions))]
    for f in functions:
        f.restype, f.argtypes = ctypes.c_double, [ctypes.c_double] * 3
    return functions


def in_casadi(expression: casadi.SX, at: tuple[float, ...]) -> float:
    return float(casadi.Function("f", list(SYMBOLS.values()), [expression])(*at))


x, y, z = SYMBOLS.values()
shared = casadi.sin(x) * y + z
OPERATIONS = {
    "sum": x + y + z,
    "difference": x - (y - z),
    "difference of sum": x - (y + z),
    "negative sum": -(x + y),
    "negative product": -(x * y) * z,
    "negative of negative": -(-x - y),
    "minus a negative constant": x - casadi.SX(-2.5) * y,
    "quotient of product": x / (y * z),
    "quotient of quotient": x / (y / z),
    "product of quotient": x * (y / z),
    "product of sum": (x + y) * (y - z),
    "square of negative": (-x) ** 2,
    "square of sum": (x - y) ** 2 - z**2,
    "divided by a square": x / y**2,
    "square of a square": (x**2) ** 2,
    "twice": 2 * (x + y) - 2 * z,
    "inverse": 1 / (x + y * y) + 1 / z,
    "inverse of inverse": 1 / (1 / x + 1 / y),
    "sin": casadi.sin(x - y),
    "cos": casadi.cos(x * y),
    "tan": casadi.tan(z / 3),
    "exp": casadi.exp(-(x**2)),
    "log": casadi.log(x**2 + 0.1),
    "sqrt": casadi.sqrt(y**2 + 1e-3),
    "tanh": casadi.tanh(x / 0.1),
    "abs": casadi.fabs(x - y) - casadi.fabs(-z),
    "sign": casadi.sign(x - y) * z - casadi.sign(casadi.SX(0) * x),
    "power": (x**2 + 1) ** y,
    "constant power": casadi.power(x**2 + 1, 1.7) - casadi.power(y**2 + 1, -0.3),
    "tiny constant": x * 1e-300 + y,
    "tiny alone": x * 1e-300,
    "huge constant": x * 1e22 - 1e22 * y,
    "huge whole constant": x + 123456789012345678,
    "long constant": x * 0.1 + y * (1 / 3) - math.pi,
    "negative constant": -1.5 * x + (-3 + y),
    "constant alone": casadi.SX(-7.25),
    "zero": casadi.SX(1, 1),
    "name alone": x,
    "shared": shared * shared + casadi.cos(shared) - 1 / shared,
    "shared in shared": (shared + x) * casadi.exp(-((shared + x) ** 2)) + shared,
}
ALL = casadi.sum1(casadi.vertcat(*OPERATIONS.values()))


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    everything = [*OPERATIONS.values(), ALL]
    return dict(zip([*OPERATIONS, "all"], in_c(tmp_path_factory.mktemp("c"), everything), strict=True))


@pytest.mark.parametrize("name", [*OPERATIONS, "all"])
def test_each_operation(compiled, name):
    expression = OPERATIONS.get(name, ALL)
    random = np.random.default_rng(3)
    points = [tuple(p) for p in random.normal(size=(60, 3)).tolist()]
    for at in [*points, (0.5, 0.5, 0.5), (-0.25, -0.25, 2.0), (-1.0, 0.75, -0.125)]:
        value = in_python(expression, at)
        assert compiled[name](*at).hex() == value.hex()
        assert value == pytest.approx(in_casadi(expression, at), rel=1e-10 if name == "all" else 2e-13, abs=1e-14)


def test_an_operation_without_a_printer_is_an_error():
    with pytest.raises(TypeError, match="no output language has CasADi operation"):
        printed(casadi.atan2(x, y), C)


def test_a_constant_beyond_doubles_is_an_error():
    with refused("SPEC028 inf"):
        printed(x * casadi.SX(1e300) * casadi.SX(1e300) + casadi.SX(math.inf), C)


def trees() -> st.SearchStrategy[casadi.SX]:
    constants = st.sampled_from([0.1, -0.1, 3.0, -2.0, 1.0, -1.0, 0.5, 1e-300, 1e22, -7e5]).map(casadi.SX)
    leaves = st.sampled_from([x, y, z, -x, shared]) | constants

    def grow(inner: st.SearchStrategy[casadi.SX]) -> st.SearchStrategy[casadi.SX]:
        pairs = st.tuples(inner, inner)
        return st.one_of(
            pairs.map(lambda p: p[0] + p[1]),
            pairs.map(lambda p: p[0] - p[1]),
            pairs.map(lambda p: p[0] * p[1]),
            pairs.map(lambda p: p[0] / p[1]),
            pairs.map(lambda p: p[0] - (p[1] + p[0])),
            inner.map(lambda e: -e),
            inner.map(lambda e: e * e),
            inner.map(lambda e: 2 * e),
            inner.map(lambda e: 1 / e),
            inner.map(casadi.fabs),
            inner.map(casadi.sign),
            inner.map(casadi.cos),
            inner.map(casadi.tanh),
            inner.map(lambda e: casadi.sqrt(casadi.fabs(e))),
        )

    return st.recursive(leaves, grow, max_leaves=14)


POINTS = [(0.7, -1.3, 2.1), (-0.2, 0.9, -3.3), (1.1, 1.1, 0.4), (-0.0, 1e-200, -1e150)]


def largest_part(tree: casadi.SX, at: tuple[float, ...]) -> float:
    """The largest magnitude among an expression's parts and the divisors' inverses; regrouping rounds by its share."""
    f = casadi.Function("f", list(SYMBOLS.values()), [tree])
    held: dict[int, float] = {}
    largest = 0.0
    for k in range(f.n_instructions()):
        operation, out, into = f.instruction_id(k), f.instruction_output(k), f.instruction_input(k)
        if operation == casadi.OP_OUTPUT:
            continue
        if operation == casadi.OP_INPUT:
            held[out[0]] = at[into[0]]
        elif operation == casadi.OP_CONST:
            held[out[0]] = f.instruction_constant(k)
        else:
            arguments = [held[r] for r in into]
            if operation in (casadi.OP_DIV, casadi.OP_INV):
                largest = max(largest, 1 / abs(arguments[-1]) if arguments[-1] else math.inf)
            parts = [casadi.SX.sym("a"), casadi.SX.sym("b")]
            whole = casadi.SX.binary(operation, *parts) if len(into) > 1 else casadi.SX.unary(operation, parts[0])
            held[out[0]] = float(casadi.Function("o", parts, [whole])(arguments[0], arguments[-1]))
        largest = max(largest, abs(held[out[0]])) if not math.isnan(held[out[0]]) else math.inf
    return largest


def test_random_trees(tmp_path):
    found: list[casadi.SX] = []
    count = examples(400)

    @settings(max_examples=count, deadline=None, derandomize=True, phases=[Phase.generate])
    @given(trees())
    def collect(tree: casadi.SX) -> None:
        with suppress(BadInput):  # CasADi folded two constants into an infinity
            printed(tree, C)
            found.append(tree)

    collect()
    compared = 0
    for tree, function in zip(found, in_c(tmp_path, found), strict=True):
        for at in POINTS:
            try:
                value = in_python(tree, at)
            except (ZeroDivisionError, OverflowError, ValueError):
                continue  # where C goes on with an infinity
            expected = in_casadi(tree, at)
            assert function(*at).hex() == value.hex() or (math.isnan(value) and math.isnan(function(*at)))
            if largest_part(tree, at) < 1e5:
                assert value == pytest.approx(expected, rel=1e-9, abs=1e-9), printed(tree, PYTHON)
                compared += 1
    assert len(found) >= 0.75 * count and compared > count


@pytest.mark.parametrize("first", ["number", "negative"])
def test_a_sum_that_begins_with_less_a_negative_operand_has_parentheses(first: str) -> None:
    """In C ``--2.0`` is no number, and ``--y`` counts down."""
    x, y = Node("symbol", name="x"), Node("symbol", name="y")
    operand = Node("number", value=-2.0) if first == "number" else Node("negative", (y,))
    text = Expressions(C, {n: n for n in NAMES}, {}).text(Node("sum", (operand, x), (-1, 1)))
    assert text == ("-(-2.0) + x" if first == "number" else "-(-y) + x")

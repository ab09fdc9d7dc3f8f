"""Program → Code: what is shared, what becomes a constant, what an input that is not finite can reach."""

from __future__ import annotations

from pathlib import Path

import casadi
import pytest

from codegen.observers import observer_of
from codegen.program import Program, build_program, lower
from codegen.program.graph import Graph, Node, reachable, to_graph
from codegen.program.naming import Names, constant_name
from codegen.program.simplify import normalise
from codegen.spec.reader import parse_spec, read_spec

from .test_program_build import TWO, program_of

SPECS = Path(__file__).parents[2] / "specs"
a, b, x, y, z = (casadi.SX.sym(n) for n in "abxyz")


def cost(expression: casadi.SX, *more: casadi.SX) -> tuple[int, int, int]:
    """(additions, products, divisions) left in a step; a and b are parameters."""
    graph = Graph()
    names = {n: graph.symbol(n, n in "ab") for n in "abxyz"}
    roots = to_graph(casadi.vertcat(expression, *more), names, graph)
    short = normalise(roots, [], graph, factoring=True)
    nodes = [n for n in reachable(short[r] for r in roots) if not n.constant]
    count = {k: sum(len(n.arguments) - 1 for n in nodes if n.kind == k) for k in ("sum", "product", "quotient")}
    return count["sum"], count["product"], count["quotient"]


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        (x / a, (0, 1, 0)),
        (x / (a * y), (0, 1, 1)),
        (a * (b * x), (0, 1, 0)),
        (a * (b * x + 3 * y), (1, 2, 0)),
        (a * x + b * x, (0, 1, 0)),
        (x + y - x, (0, 0, 0)),
        (x * y + x * z, (1, 1, 0)),
        (-(x - y), (1, 0, 0)),
        (2 * x * 3 * a, (0, 1, 0)),
        (a * b / (a + 1), (0, 0, 0)),
        (x - -(a * y), (1, 1, 0)),
    ],
)
def test_what_is_left_to_do_in_a_step(expression, expected):
    assert cost(expression) == expected


def test_the_angle_of_a_sum_uses_those_of_its_terms():
    graph = Graph()
    roots = to_graph(
        casadi.vertcat(casadi.cos(x), casadi.sin(y), casadi.sin(x + y)),
        {n: graph.symbol(n, False) for n in "xy"},
        graph,
    )
    short = normalise(roots, [], graph, factoring=False)
    calls = [n for n in reachable(short[r] for r in roots) if n.kind == "call"]
    assert sorted((n.name, n.arguments[0].name) for n in calls) == [
        ("cos", "x"),
        ("cos", "y"),
        ("sin", "x"),
        ("sin", "y"),
    ]


def test_two_masses_need_no_division_and_few_constants():
    code = lower(program_of(TWO))
    assert [d.name for d in code.derived] == [
        "eta2_plus_eta3",
        "eta1_plus_eta3",
        "one_over_m1",
        "one_over_m2",
        "h_K_F_between",
        "h_K_F_ground",
    ]
    assert code.derived_values[2:4] == (0.1, 0.02)
    count = code.operations()
    assert (count.additions, count.products, count.divisions) == (18, 20, 0)


def test_inputs_that_a_state_does_not_show():
    text = TWO.replace("20*x1", "20*tanh(x1)")
    assert lower(program_of(TWO)).unseen(["x1", "x2", "w"]) == ()
    assert lower(program_of(text)).unseen(["x1", "x2", "w", "nothing"]) == ("nothing",)


def test_every_local_is_assigned_before_it_is_used():
    for path in sorted(SPECS.glob("*.yaml")):
        assignments = lower(program_of_spec(path)).step
        named = {a.value for a in assignments}
        known: set[Node] = set()
        for assignment in assignments:
            below = set(reachable([assignment.value])) - {assignment.value}
            assert below & named <= known, assignment.name
            known.add(assignment.value)


def program_of_spec(path: Path) -> Program:
    return build_program(observer_of(read_spec(path)))


def test_names_are_handed_out_once_whatever_their_case():
    names = Names({"Sin_x", "step"})
    assert [names.take("sin_x"), names.take("sin_x"), names.numbered("Step")] == ["sin_x_2", "sin_x_3", "Step_1"]


def test_a_name_that_gets_too_long_is_none():
    graph = Graph()
    assert constant_name(graph.product([graph.symbol(f"parameter_{k}", True) for k in range(9)])) is None


def test_spec_parses_the_code_section():
    spec = parse_spec(TWO + "code: {precision: single, fault: none}\n", Path("m.yaml"))
    assert (spec.code.precision, spec.code.fault) == ("single", "none")

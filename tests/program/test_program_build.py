"""Observer → Program: what blocks, fields and states there are, in what order, under what names."""

from __future__ import annotations

from pathlib import Path

import casadi
import pytest

from codegen.effects.declare import add_declared_effects
from codegen.mechanics.build import build_system
from codegen.observers import build_observer
from codegen.program import Program, build_program
from codegen.spec.reader import parse_spec
from tests.expected_errors import refused

SPECS = Path(__file__).parents[2] / "specs"
ONE, TWO = ((SPECS / f"{name}.yaml").read_text(encoding="utf-8") for name in ("one_mass", "two_mass"))


def program_of(text: str) -> Program:
    spec = parse_spec(text, Path("machine.yaml"))
    return build_program(build_observer(spec, add_declared_effects(build_system(spec), spec)))


def delayed(seconds: object) -> str:
    return ONE.replace("effects: []", f"effects: [{{kind: input_delay, on: w, parameters: {{T: {seconds}}}}}]")


@pytest.mark.parametrize("text", [ONE, TWO, delayed(0.0025)], ids=["one", "two", "delayed"])
def test_every_symbol_is_known_when_it_is_used(text):
    program = program_of(text)
    known = {f.name for f in (*program.parameters, *program.states, *program.inputs)}
    for block in program.blocks:
        assert {s.name() for s in casadi.symvar(block.expression)} <= known
        assert len(block.elements) == len(block.units) == block.symbols.shape[0] == block.expression.shape[0]
        known |= set(block.elements)
    for value in program.next_state:
        assert {s.name() for s in casadi.symvar(casadi.SX(value))} <= known
    assert len(program.next_state) == len(program.initial_state) == len(program.states)


@pytest.mark.parametrize("text", [ONE, TWO, delayed(0.0025)], ids=["one", "two", "delayed"])
def test_everything_is_used_or_handed_out(text):
    program = program_of(text)
    expressions = [b.expression for b in program.blocks] + [casadi.SX(e) for e in program.next_state]
    used = {s.name() for e in expressions for s in casadi.symvar(e)}
    starting = {s.name() for e in program.initial_state for s in casadi.symvar(casadi.SX(e))}
    assert {e for b in program.blocks if not b.output for e in b.elements} <= used
    assert {p.name for p in program.parameters} <= used | starting
    assert {s.name for s in program.states} <= used


def test_fields_of_two_masses():
    program = program_of(TWO)
    assert [f.name for f in program.inputs] == ["x1", "x2", "w"]
    assert [(f.name, f.unit) for f in program.states] == [
        ("z_v1", "m/s"),
        ("z_v2", "m/s"),
        ("z_between", "N"),
        ("z_ground", "N"),
    ]
    assert program.parameters[-1].name == "sample_time" and program.parameters[-1].value == 0.001
    assert {p.name: p.value for p in program.parameters}["K_F_ground"] == 700
    assert [o[0] for o in program.outputs][:4] == ["v1_hat", "v2_hat", "a_hat_between", "a_hat_ground"]


def test_parameters_are_in_si():
    program = program_of(TWO.replace("{value: 100, unit: N/m}", "{value: 0.1, unit: N/mm}"))
    assert {p.name: p.value for p in program.parameters}["eta1"] == 100


@pytest.mark.parametrize(
    ("seconds", "count"), [(0.0005, 1), (0.001, 1), (0.0011, 2), (0.007, 7), ("1e-9", 1), (1, 1000)]
)
def test_a_delay_keeps_the_samples_it_needs(seconds, count):
    program = program_of(delayed(seconds))
    past = [f for f in program.states if f.name.startswith("w_past_")]
    assert [f.name for f in past] == [f"w_past_{k}" for k in range(1, count + 1)]
    assert {f.unit for f in past} == {"N"}


def test_a_delay_too_long():
    with refused("SPEC007 1001 1000"):
        program_of(delayed(1.001))


def test_one_name_for_two_quantities():
    with refused("SPEC009 `v_hat`"):
        program_of(ONE.replace("  m: {", "  v_hat: {").replace("[m]", "[v_hat]"))
    with refused("SPEC009 `F_hat_on_x`"):
        program_of(ONE.replace("name: rail", "name: on_x"))

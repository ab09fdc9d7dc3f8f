"""Loops over arrays: the twin of rolled code against CasADi's value of the Program, for every shape of chain."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import casadi
import numpy as np
import pytest

from codegen.effects.declare import add_declared_effects
from codegen.emit.package import emit_sources, make_header
from codegen.mechanics.build import build_system
from codegen.observers import build_observer
from codegen.program import Program, build_program, lower
from codegen.spec.reader import parse_spec
from tests.machines import chain, coupled
from tests.twin import load_twin

TO = "{K_2: -40, K_v: 30}"
VISCOUS = "effects:\n  - {kind: viscous, on: ground1..20, parameters: {b: 0.3}}\n"
CASES = {
    "springs": chain(20, damped=False),
    "dampers": chain(40),
    "viscous": chain(20, more=VISCOUS),
    "forces on coordinates": chain(20, kind="gto", gains=TO),
    "constant tridiagonal M": coupled(18),
    "tridiagonal M of x": coupled(18, "(j + q*x1..17**2)"),
}


def built(text: str) -> Program:
    spec = parse_spec(text, Path("chain.yaml"))
    return build_program(build_observer(spec, add_declared_effects(build_system(spec), spec)))


def reference(program: Program) -> casadi.Function:
    """(states, inputs) → (next states, outputs) by CasADi, straight from the blocks."""
    states, inputs = (casadi.vertcat(*[f.symbol for f in fields]) for fields in (program.states, program.inputs))
    known = {f.symbol.name(): casadi.SX(f.value) for f in program.parameters}
    outputs = []
    for block in program.blocks:
        here = _substituted(block.expression, known)
        known |= dict(zip(block.elements, casadi.vertsplit(here), strict=True))
        outputs += [known[e] for e in block.elements] if block.output else []
    results = [_substituted(casadi.vertcat(*program.next_state), known), casadi.vertcat(*outputs)]
    return casadi.Function("step", [states, inputs], results)


def _substituted(expression: casadi.SX, known: dict[str, casadi.SX]) -> casadi.SX:
    names = [s for s in casadi.symvar(casadi.SX(expression)) if s.name() in known]
    values = casadi.vertcat(*[known[s.name()] for s in names])
    return casadi.substitute(casadi.SX(expression), casadi.vertcat(*names), values) if names else expression


FLAGS = ("fault", "mode", "invalid_samples")


def flat(struct: Any) -> list[float]:
    row: list[float] = []
    for name in struct.__slots__:
        value = getattr(struct, name)
        row += value if isinstance(value, list) else [value] if name not in FLAGS else []
    return row


def filled(struct: Any, row: list[float]) -> Any:
    rest = iter(row)
    for name in (n for n in struct.__slots__ if n not in FLAGS):
        value = getattr(struct, name)
        setattr(struct, name, [next(rest) for _ in value] if isinstance(value, list) else next(rest))
    return struct


@pytest.mark.parametrize("case", CASES)
def test_loops_compute_what_the_blocks_say(case):
    program = built(CASES[case])
    twin = load_twin(emit_sources(program, make_header("m.yaml", "0" * 64, ""))["__init__.py"], "chain")
    expected = reference(program)
    random = np.random.default_rng(3)
    for _ in range(5):
        z, u = random.normal(size=len(program.states)), random.normal(size=len(program.inputs))
        state, parameters = filled(twin.State(), z.tolist()), twin.Parameters()
        twin.prepare(parameters)
        outputs = twin.step(state, parameters, filled(twin.Inputs(), u.tolist()))
        following, estimates = (np.asarray(r).ravel() for r in expected(z, u))
        np.testing.assert_allclose(flat(state), following, rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(flat(outputs), estimates, rtol=1e-11, atol=1e-11)


def test_the_comparison_notices_a_spring_that_is_left_out():
    wrong, right = reference(built(chain(20))), reference(built(chain(20).replace("k*(x19 - x20) +", "")))
    assert [f.name for f in built(chain(20)).inputs][-2:] == ["x20", "w"]
    z, u = np.ones(40), np.arange(21.0)
    assert not np.allclose(np.asarray(wrong(z, u)[0]), np.asarray(right(z, u)[0]), rtol=1e-11)


@pytest.mark.parametrize("make", [chain, coupled])
def test_code_does_not_grow_with_the_chain(make):
    sizes = []
    for n in (18, 27):
        rolled = lower(built(make(n))).rolled
        settings = [s for part in (rolled.initial, rolled.predicted, rolled.resumed) for s in part.stretches]
        parts = [*rolled.prepare, *rolled.step, *rolled.outputs, *rolled.following, *settings]
        sizes.append(sum(len(part.lines) for stretch in parts for part in stretch.parts))
    assert sizes[0] == sizes[1]


def test_fifteen_are_written_out():
    def looped(n: int) -> bool:
        return any(stretch.loop for stretch in lower(built(chain(n))).rolled.step)

    assert not looped(15) and looped(16)


def test_every_value_is_computed_before_it_is_needed():
    """The loop over a damped chain needs both neighbours' velocities: it cannot be the one that estimates them."""
    rolled = lower(built(chain(20))).rolled
    loops = [s for s in rolled.step if s.loop]
    titles = [{part.title for part in s.parts} for s in loops]
    assert not any({"velocity estimate", "acceleration"} <= t for t in titles)

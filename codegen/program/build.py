"""From Observer to Program: each equation becomes a block, M a = r is solved by structure, the states are stepped."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import casadi
import sympy

from codegen.base.errors import BadInput
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import TIME
from codegen.observers.equations import Observer
from codegen.observers.velocity import INTEGRATIONS, SAMPLE_TIME
from codegen.program.arrays import Element, elements, gathered
from codegen.program.domain import Guard
from codegen.program.implicit_step import implicit_blocks
from codegen.program.lost_sample import carried_states, most_lost, resumed_states
from codegen.program.mass_solve import MassSolve
from codegen.program.model import Block, Field, Program, State
from codegen.program.naming import WORDS, Names
from codegen.program.signals import effective_input, held_input, true_positions
from codegen.spec.model import CodeChoice

EXAMPLE = "example_main"


def build_program(observer: Observer, choice: CodeChoice | None = None) -> Program:
    """The program of an observer with the step of its ``integration``.

    Args:
        choice: precision and fault handling; double and ``hold`` by default.

    Raises:
        BadInput: if two quantities would have one name in the generated code, or a delay is longer than 1000 samples.
    """
    system = observer.system
    names: dict[sympy.Symbol, Any] = {}
    parameters = _parameters(observer, names)
    period = Field("sample_time", "s", "sample time", float(observer.sample_time))
    measured = list(zip(system.positions, system.position_units, strict=True))
    inputs = [_field(names, x, unit, "measured position") for x, unit in measured]
    if observer.velocity == "measured":
        inputs += [
            _field(names, v, f"{unit}/s", "measured velocity")
            for v, unit in zip(system.velocities, system.position_units, strict=True)
        ]
    commands = [_field(names, w, unit, "input") for w, unit in zip(system.inputs, system.input_units, strict=True)]
    own = [
        _field(names, z, unit, "observer state") for z, unit in zip(observer.states, observer.state_units, strict=True)
    ]

    blocks: list[Block] = true_positions(system, names)
    corrected = [(block.symbols, block.expression) for block in blocks]
    clock = _field(names, TIME, "s", "time since the first sample")
    signals: list[State] = []
    for k, command in enumerate(commands):
        chain, behind = effective_input(observer, k, command, period, names)
        blocks, signals = blocks + chain, signals + behind
    taken = {s.name for s in names} | {s.name for e in observer.equations for s in e.symbols}
    names[SAMPLE_TIME] = period.symbol
    following: list[Any] = []
    if observer.integration == "implicit":
        signals += [held_input(observer, k, f, names) for k, f in enumerate(commands)]
        blocks += implicit_blocks(observer, names, own, period.symbol, taken)
        following = casadi.vertsplit(blocks[-1].symbols)
        names.update(zip(observer.states, following, strict=True))
    guard = Guard(observer, observer.domain, names) if observer.domain is not None else None
    for equation in observer.equations:
        if guard is not None and equation.name == "friction_level":
            blocks += guard.level(equation)
            continue
        expression = to_casadi(equation.expression, names)
        if equation.form == "mass_solve":
            solve = MassSolve(taken, equation.source)
            expression = solve.solve(to_casadi(system.mass_matrix, names), expression)
            blocks += solve.blocks
        elements = tuple(s.name for s in equation.symbols)
        blocks.append(Block(equation.name, elements, expression, equation.units, equation.source, equation.output))
        names.update(zip(equation.symbols, casadi.vertsplit(blocks[-1].symbols), strict=True))

    rates = to_casadi(observer.rates, names)
    following = following or [field.symbol + period.symbol * rates[i] for i, field in enumerate(own)]
    initial = casadi.vertsplit(to_casadi(observer.initial, names))
    most, resumed = most_lost(observer), resumed_states(observer, names, period.symbol)
    change = carried_states(observer, names, period.symbol) if most > 1 and observer.velocity == "estimated" else {}
    states = [
        State(field, following[i], initial[i], field.symbol + change.get(z, 0), resumed[z])
        for i, (z, field) in enumerate(zip(observer.states, own, strict=True))
    ]
    if guard is not None:
        blocks += guard.verdict(period)
        level = next(e for e in observer.equations if e.name == "friction_level")
        assert level.state is not None
        at = list(observer.states).index(level.state[0])
        states[at] = replace(
            states[at], following=guard.next_level(level, rates[at], period), resumed=guard.resumed_level(level)
        )
        parameters += guard.parameters
        states += guard.states
    states = [_written_out(state, corrected) for state in states] + signals
    blocks = _needed(blocks, [s.following for s in states])
    if clock.name in _used(blocks, [s.following for s in states]):
        later = clock.symbol + period.symbol
        states.append(State(clock, later, casadi.SX(0), later, later))
    used = _used(blocks, [s.following for s in states], [s.initial for s in states])
    choice = choice or CodeChoice()
    kept = [p for p in parameters if p.name in used]
    fields = [s.field for s in states]
    arrays = _arrays(kept, fields, [*inputs, *commands], blocks)
    order = {name: k for k, name in enumerate(gathered([p.name for p in kept], arrays))}
    kept.sort(key=lambda p: order[p.name])
    program = Program(
        name=system.name,
        kind=observer.kind,
        velocity=observer.velocity,
        parameters=(*kept, period),
        states=tuple(fields),
        inputs=(*inputs, *commands),
        blocks=tuple(blocks),
        next_state=tuple(s.following for s in states),
        initial_state=tuple(s.initial for s in states),
        carried_state=tuple(s.carried for s in states),
        resumed_state=tuple(s.initial if s.resumed is None else s.resumed for s in states),
        most_lost=most,
        precision=choice.precision,
        fault=choice.fault,
        integration=INTEGRATIONS[observer.integration],
        arrays=arrays,
    )
    _refuse_shared_names(program)
    return program


def _field(
    names: dict[sympy.Symbol, Any], s: sympy.Symbol, unit: str, meaning: str, value: float | None = None
) -> Field:
    field = Field(s.name, unit, meaning, value)
    names[s] = field.symbol
    return field


def _parameters(observer: Observer, names: dict[sympy.Symbol, Any]) -> list[Field]:
    system = observer.system
    fields = [_field(names, s, system.units[s], "model parameter", float(value)) for s, value in system.values.items()]
    fields += [
        _field(names, s, observer.assumed_units[s], "assumed by the observer", float(value))
        for s, value in observer.assumed.items()
    ]
    gains = observer.gains.items()
    return fields + [_field(names, s, observer.gain_units[s], "observer gain", float(value)) for s, value in gains]


def _written_out(state: State, blocks: list[tuple[Any, Any]]) -> State:
    """A state with the true positions inserted where no block has been computed: at a first or resumed sample."""
    initial, resumed = state.initial, state.resumed
    for symbols, meaning in blocks:
        initial, resumed = casadi.substitute([initial, resumed], [symbols], [meaning])
    return replace(state, initial=initial, resumed=resumed)


def _needed(blocks: list[Block], next_state: list[Any]) -> list[Block]:
    """The blocks without elements that nothing uses; outputs stay."""
    kept: list[Block] = []
    used = _used([], next_state)
    for block in reversed(blocks):
        at = [i for i, element in enumerate(block.elements) if block.output or element in used]
        if at:
            elements, units = tuple(block.elements[i] for i in at), tuple(block.units[i] for i in at)
            kept.append(
                replace(
                    block, elements=elements, symbols=block.symbols[at], expression=block.expression[at], units=units
                )
            )
            used |= _used(kept[-1:])
    return kept[::-1]


def _used(blocks: list[Block], *more: list[Any]) -> set[str]:
    expressions = [*(b.expression for b in blocks), *(casadi.vertcat(*part) for part in more)]
    return {s.name() for e in expressions for s in casadi.symvar(casadi.SX(e))}


def _arrays(
    parameters: list[Field], states: list[Field], inputs: list[Field], blocks: list[Block]
) -> dict[str, Element]:
    """Places of the numbered fields and of the numbered elements of each block."""
    fields = [[f.name for f in group] for group in (parameters, states, inputs)]
    together: dict[str, list[str]] = {}
    for block in blocks:
        together.setdefault(block.name, []).extend(block.elements)
    groups = [*fields, *together.values()]
    taken = Names({name for group in groups for name in group} | WORDS)
    places: dict[str, Element] = {}
    visible = {f.name for group in (states, inputs) for f in group} | {
        e for b in blocks if b.output for e in b.elements
    }
    for group in groups:
        found = elements(group, taken)
        if not visible.issuperset(group) or gathered(group, found) == group:
            places |= found
    return places


def _refuse_shared_names(program: Program) -> None:
    if program.name == EXAMPLE:
        expected = "a name other than that of the generated example"
        raise BadInput(f"spec {EXAMPLE}", f"the name `{EXAMPLE}`", expected, about="", code="SPEC009")
    fields = [f.name for f in (*program.parameters, *program.states, *program.inputs)]
    counts: Mapping[str, int] = Counter([*fields, *(e for b in program.blocks for e in b.elements)])
    for name, count in counts.items():
        if count > 1:
            found = f"two quantities called `{name}` in the generated code"
            raise BadInput(f"spec {program.name}", found, "another name in the spec", about=name, code="SPEC009")

"""Observer → Program: a block for each equation, M a = r solved by its sparsity, and the integration of the states."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import repeat
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
from codegen.program.invalid_samples import most_lost, predicted_changes, resumed_states
from codegen.program.mass_solve import MassSolve
from codegen.program.model import Block, Field, Program, State
from codegen.program.naming import RESERVED, Names
from codegen.program.signals import effective_input, held_input, true_positions
from codegen.spec.schema import CodeChoice

EXAMPLE = "example_main"


def build_program(observer: Observer, choice: CodeChoice | None = None) -> Program:
    """The program of an observer, integrated by the method of its ``integration``.

    ``choice``: precision and handling of invalid samples; double and ``hold`` by default. Raises BadInput if two
    quantities would have one name in the generated code, or a delay is longer than 1000 samples.
    """
    step = _Step(observer)
    step.take_signals()
    if observer.integration == "implicit":
        step.integrate_implicitly()
    step.compute_equations()
    step.advance_states()
    return step.program(choice or CodeChoice())


class _Step:
    """Builder of a program: the SX of every symbol so far, and its fields, blocks and states."""

    def __init__(self, observer: Observer) -> None:
        self.observer, self.system = observer, observer.system
        self.names: dict[sympy.Symbol, Any] = {}
        self.blocks: list[Block] = []
        self.states: list[State] = []
        self.signals: list[State] = []
        self.following: list[Any] = []
        """The observer's states at this sample, where an implicit step has computed them."""
        self.parameters = self._parameters()
        self.period = Field("sample_time", "s", "sample time", float(observer.sample_time))
        units = self.system.position_units
        self.inputs = self._fields(self.system.positions, units, "measured position")
        if observer.velocity == "measured":
            rates = [f"{unit}/s" for unit in units]
            self.inputs += self._fields(self.system.velocities, rates, "measured velocity")
        self.commands = self._fields(self.system.inputs, self.system.input_units, "input")
        self.own = self._fields(observer.states, observer.state_units, "observer state")

    def take_signals(self) -> None:
        """Add the true positions (without the sensor errors) and the effective inputs (after the actuators)."""
        self.blocks = true_positions(self.system, self.names)
        self.corrected = [(block.symbols, block.expression) for block in self.blocks]
        self.clock = self._fields([TIME], ["s"], "time since the first sample")[0]
        for k, command in enumerate(self.commands):
            chain, behind = effective_input(self.observer, k, command, self.period, self.names)
            self.blocks, self.signals = self.blocks + chain, self.signals + behind
        self.taken = {s.name for s in self.names} | {s.name for e in self.observer.equations for s in e.symbols}
        self.names[SAMPLE_TIME] = self.period.symbol

    def integrate_implicitly(self) -> None:
        """The observer's states at this sample by backward Euler, with the inputs held since the last one."""
        self.signals += [held_input(self.observer, k, f, self.names) for k, f in enumerate(self.commands)]
        self.blocks += implicit_blocks(self.observer, self.names, self.own, self.period.symbol, self.taken)
        self.following = casadi.vertsplit(self.blocks[-1].symbols)
        self.names.update(zip(self.observer.states, self.following, strict=True))

    def compute_equations(self) -> None:
        """A block for each equation of the observer; M a = r becomes the blocks of its solution."""
        domain = self.observer.domain
        self.guard = None if domain is None else Guard(self.observer, domain, self.names)
        for equation in self.observer.equations:
            if self.guard is not None and equation.name == "friction_level":
                self.blocks += self.guard.level(equation)
                continue
            expression = to_casadi(equation.expression, self.names)
            if equation.form != "algebra":
                own = equation.form == "solve"
                matrix = to_casadi(equation.matrix if own else self.system.mass_matrix, self.names)
                solve = MassSolve(self.taken, equation.source, f"{equation.name}_" if own else "")
                expression = solve.solve(matrix, expression)
                self.blocks += solve.blocks
            elements = tuple(s.name for s in equation.symbols)
            block = Block(equation.name, elements, expression, equation.units, equation.source, equation.output)
            self.blocks.append(block)
            self.names.update(zip(equation.symbols, casadi.vertsplit(block.symbols), strict=True))

    def advance_states(self) -> None:
        """Set the values of the states at the next sample, at the first, and around invalid samples."""
        observer, names, h = self.observer, self.names, self.period.symbol
        rates = to_casadi(observer.rates, names)
        following = self.following or [field.symbol + h * rates[i] for i, field in enumerate(self.own)]
        initial = casadi.vertsplit(to_casadi(observer.initial, names))
        self.most_lost, resumed = most_lost(observer), resumed_states(observer, names, h)
        predicted = self.most_lost > 1 and observer.velocity == "estimated"
        change = predicted_changes(observer, names, h) if predicted else {}
        self.states = [
            State(field, following[i], initial[i], field.symbol + change.get(z, 0), resumed[z])
            for i, (z, field) in enumerate(zip(observer.states, self.own, strict=True))
        ]
        if self.guard is not None:
            self.blocks += self.guard.verdict(self.period)
            self.parameters += self.guard.parameters
            self.states = self.guard.guarded(self.states, rates, self.period)
        self.states = [_written_out(state, self.corrected) for state in self.states] + self.signals
        self.blocks = _needed(self.blocks, [s.following for s in self.states])
        if self.clock.name in _used(self.blocks, [s.following for s in self.states]):
            later = self.clock.symbol + h
            self.states.append(State(self.clock, later, casadi.SX(0), later, later))

    def program(self, choice: CodeChoice) -> Program:
        """The finished program: the parameters that are used, states and blocks; numbered quantities in arrays."""
        states, inputs = self.states, (*self.inputs, *self.commands)
        used = _used(self.blocks, [s.following for s in states], [s.initial for s in states])
        kept = [p for p in self.parameters if p.name in used]
        fields = tuple(s.field for s in states)
        arrays = _arrays([[f.name for f in group] for group in (kept, fields, inputs)], self.blocks)
        order = {name: k for k, name in enumerate(gathered([p.name for p in kept], arrays))}
        kept.sort(key=lambda p: order[p.name])
        program = Program(
            name=self.system.name,
            kind=self.observer.kind,
            velocity=self.observer.velocity,
            parameters=(*kept, self.period),
            states=fields,
            inputs=inputs,
            blocks=tuple(self.blocks),
            next_state=tuple(s.following for s in states),
            initial_state=tuple(s.initial for s in states),
            predicted_state=tuple(s.predicted for s in states),
            resumed_state=tuple(s.initial if s.resumed is None else s.resumed for s in states),
            most_lost=self.most_lost,
            precision=choice.precision,
            fault=choice.fault,
            integration=INTEGRATIONS[self.observer.integration],
            arrays=arrays,
        )
        _refuse_shared_names(program)
        return program

    def _fields(
        self, symbols: Iterable[sympy.Symbol], units: Iterable[str], meaning: str, values: Iterable[Any] | None = None
    ) -> list[Field]:
        """A field for each symbol; its SX is added to ``names``."""
        numbers = repeat(None) if values is None else map(float, values)
        fields = [Field(s.name, u, meaning, v) for s, u, v in zip(symbols, units, numbers, strict=False)]
        self.names.update({s: f.symbol for s, f in zip(symbols, fields, strict=True)})
        return fields

    def _parameters(self) -> list[Field]:
        observer, system = self.observer, self.system
        groups = (
            (system.values, system.units, "model parameter"),
            (observer.assumed, observer.assumed_units, "assumed by the observer"),
            (observer.gains, observer.gain_units, "observer gain"),
        )
        return [
            field
            for values, units, meaning in groups
            for field in self._fields(values, [units[s] for s in values], meaning, values.values())
        ]


def _written_out(state: State, blocks: list[tuple[Any, Any]]) -> State:
    """A state whose initial and resumed values contain no true position: its expression over the reading is inserted.

    These values are computed outside the step, where the blocks of the true positions are not available.
    """
    initial, resumed = state.initial, state.resumed
    for symbols, meaning in blocks:
        initial, resumed = casadi.substitute([initial, resumed], [symbols], [meaning])
    return replace(state, initial=initial, resumed=resumed)


def _needed(blocks: list[Block], next_state: list[Any]) -> list[Block]:
    """The blocks without unused elements (dead code elimination); outputs stay."""
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


def _arrays(fields: list[list[str]], blocks: list[Block]) -> dict[str, Element]:
    """Array elements of the numbered fields, and of the numbered elements of each block.

    ``fields``: names of the parameters, of the states and of the inputs.
    """
    together: dict[str, list[str]] = {}
    for block in blocks:
        together.setdefault(block.name, []).extend(block.elements)
    groups = [*fields, *together.values()]
    taken = Names({name for group in groups for name in group} | RESERVED)
    places: dict[str, Element] = {}
    visible = {*fields[1], *fields[2], *(e for b in blocks if b.output for e in b.elements)}
    for group in groups:
        found = elements(group, taken)
        if not visible.issuperset(group) or gathered(group, found) == group:
            places |= found
    return places


def _refuse_shared_names(program: Program) -> None:
    """Raise BadInput if two quantities have one name in the generated code, or a file name is taken twice."""
    if program.name == EXAMPLE:
        expected = "a name other than that of the generated example"
        raise BadInput(f"spec {EXAMPLE}", f"the name `{EXAMPLE}`", expected, about="", code="SPEC009")
    fields = [f.name for f in (*program.parameters, *program.states, *program.inputs)]
    counts: Mapping[str, int] = Counter([*fields, *(e for b in program.blocks for e in b.elements)])
    for name, count in counts.items():
        if count > 1:
            found = f"two quantities called `{name}` in the generated code"
            raise BadInput(f"spec {program.name}", found, "another name in the spec", about=name, code="SPEC009")

"""Code → what the templates of a language need: for each group its comment and lines, every value as text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from codegen.emit.expression import Expressions, wrapped
from codegen.emit.language import Language
from codegen.emit.loops import LoopStyle, LoopView, loop_view
from codegen.program import Code, Program
from codegen.program.code import Assignment, Operations
from codegen.program.graph import Node, reachable


@dataclass(frozen=True)
class Style:
    """How a language writes the fields of the structs: formats with {name}; ``declared`` is before a local's value.

    ``indent`` is of the lines after the first of an expression; ``loops`` is the style of code over arrays.
    """

    language: Language
    parameter: str
    state: str
    entry: str
    declared: str
    indent: int = 8
    loops: LoopStyle | None = None


@dataclass(frozen=True)
class Line:
    """One assignment: a local or field name, its expression, its unit."""

    name: str
    value: str
    unit: str


@dataclass(frozen=True)
class Lines:
    """Lines under one comment."""

    title: str
    source: str
    lines: tuple[Line, ...]


@dataclass(frozen=True)
class Constant:
    """A derived constant: its value as a literal, its formula over the parameters' names, and as an expression."""

    name: str
    value: str
    formula: str
    expression: str


@dataclass(frozen=True)
class CodeView:
    """A program in one language.

    Attributes:
        initial: the first state; ``start_uses_inputs`` says whether it depends on any.
        check: the sum of the next states, and of the inputs and outputs that may be infinite or NaN while they are not;
            ``begun`` that of the inputs and the first state, ``given`` that of the inputs.
    """

    derived: tuple[Constant, ...]
    step: tuple[Lines, ...]
    next_state: tuple[Line, ...]
    outputs: tuple[Line, ...]
    initial: tuple[Line, ...]
    initial_parts: tuple[Line, ...]
    check: str
    begun: str
    given: str
    start_uses_inputs: bool
    start_uses_parameters: bool
    step_uses_parameters: bool
    functions: frozenset[str]
    divides: bool
    operations: Operations
    loops: LoopView | None = None


def view(program: Program, code: Code, style: Style) -> CodeView:
    """Print every expression."""
    language = style.language
    if code.rolled is not None:
        return _over_arrays(program, code, style)
    parameters = {f.name: style.parameter.format(name=f.name) for f in program.parameters}
    fields = {f.name: style.state.format(name=f.name) for f in program.states}
    fields |= {f.name: style.entry.format(name=f.name) for f in program.inputs}
    constants = {n: style.parameter.format(name=name) for n, name in code.constants.items()}
    step = Expressions(language, parameters | fields, constants | code.names)
    start = Expressions(language, parameters | fields, code.initial_names)
    plain = Expressions(language, {f.name: f.name for f in program.parameters}, code.constants)
    prepare = Expressions(language, parameters, constants)

    def lines(assignments: Sequence[Assignment], printer: Expressions, head: str = "") -> list[Line]:
        """Definitions of locals, or with ``head`` assignments to fields from them."""
        result = []
        for a in assignments:
            start = len(head or style.declared) - len("{name}") + len(a.name) + (0 if head else len(a.unit))
            result.append(
                Line(a.name, wrapped(printer.text(a.value, whole=not head), start, language, style.indent), a.unit)
            )
        return result

    derived = tuple(
        Constant(
            a.name,
            language.literal(value),
            plain.text(a.value, whole=True),
            wrapped(prepare.text(a.value, whole=True), len(f"    {constants[a.value]} = "), language, style.indent),
        )
        for a, value in zip(code.derived, code.derived_values, strict=True)
    )
    used = reachable(a.value for a in (*code.initial_parts, *code.initial))
    unseen = [fields[name] for name in code.unseen(f.name for f in program.inputs)]
    following = [f"{f.name}_next" for f in program.states]
    products = [step.text(node) for node in code.unseen_outputs()]
    needed = _constants_used(code)
    return CodeView(
        derived=derived,
        step=tuple(Lines(g.title, g.source, tuple(lines(g.assignments, step))) for g in code.step),
        next_state=tuple(lines(code.next_state, step, style.declared.replace("{name}", "{name}_next"))),
        outputs=tuple(lines(code.outputs, step, "        outputs->{name} = ")),
        initial=tuple(lines(code.initial, start, "    state->{name} = ")),
        initial_parts=tuple(lines(code.initial_parts, start)),
        check=wrapped(" + ".join([*unseen, *following, *products]), 25, language, style.indent),
        begun=wrapped(
            " + ".join(fields[f.name] for f in (*program.inputs, *program.states)), 25, language, style.indent
        ),
        given=wrapped(" + ".join(fields[f.name] for f in program.inputs), 29, language, style.indent + 4),
        start_uses_inputs=any(n.kind == "symbol" and not n.constant for n in used),
        start_uses_parameters=any(n.kind == "symbol" and n.constant for n in used),
        step_uses_parameters=needed,
        functions=code.functions,
        divides=code.divides,
        operations=code.operations(),
    )


def _over_arrays(program: Program, code: Code, style: Style) -> CodeView:
    """The view of rolled code: its lines are in ``loops``."""
    assert style.loops is not None
    used = reachable(a.value for a in (*code.initial_parts, *code.initial))
    return CodeView(
        derived=(),
        step=(),
        next_state=(),
        outputs=(),
        initial=(),
        initial_parts=(),
        check="",
        begun="",
        given="",
        start_uses_inputs=any(n.kind == "symbol" and not n.constant for n in used),
        start_uses_parameters=any(n.kind == "symbol" and n.constant for n in used),
        step_uses_parameters=_constants_used(code),
        functions=code.functions,
        divides=code.divides,
        operations=code.operations(),
        loops=loop_view(program, code, style.language, style.loops),
    )


def _constants_used(code: Code) -> bool:
    assigned = [a.value for g in code.step for a in g.assignments]
    nodes: list[Node] = reachable([*assigned, *(a.value for a in (*code.next_state, *code.outputs))])
    return any(n.kind == "symbol" and n.constant for n in nodes)

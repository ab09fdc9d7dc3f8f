"""Code → what the templates of a language need: for each group its comment and lines, every value as text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from codegen.emit.expression import Expressions, wrapped
from codegen.emit.language import Language
from codegen.emit.loops import LoopStyle, LoopView, PrintedSetting, loop_view
from codegen.program import Code, Program
from codegen.program.code import Assignment, Operations, Setting
from codegen.program.graph import Node, reachable
from codegen.program.model import HELD


@dataclass(frozen=True)
class Style:
    """How a language writes the fields of the structs: formats with {name}; ``declared`` is before a local's value.

    ``indent`` is of the lines after the first of an expression; ``loops`` is the style of code over arrays.
    """

    language: Language
    parameter: str
    state: str
    entry: str
    output: str
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
class SettingView:
    """What sets the states: ``parts`` and ``states`` as lines, or ``loops``; ``uses`` are the structs that it reads."""

    parts: tuple[Line, ...]
    states: tuple[Line, ...]
    uses: frozenset[str]
    loops: PrintedSetting | None = None


@dataclass(frozen=True)
class CodeView:
    """A program in one language.

    Attributes:
        initial, carried, resumed: as in Code.
        check: the sum of the next states, and of the inputs and outputs that may be infinite or NaN while they are not;
            ``begun`` that of the inputs and the first state, ``given`` that of the inputs.
    """

    derived: tuple[Constant, ...]
    step: tuple[Lines, ...]
    next_state: tuple[Line, ...]
    outputs: tuple[Line, ...]
    initial: SettingView
    carried: SettingView
    resumed: SettingView
    check: str
    begun: str
    given: str
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
    held = {HELD + a.name: style.output.format(name=a.name) for a in code.outputs}
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

    def setting(values: Setting) -> SettingView:
        printer = Expressions(language, parameters | fields | held, constants | values.names)
        states = tuple(lines(values.states, printer, "    state->{name} = "))
        return SettingView(tuple(lines(values.parts, printer)), states, _structs_used(program, values))

    unseen = [fields[name] for name in code.unseen(f.name for f in program.inputs)]
    following = [f"{f.name}_next" for f in program.states]
    products = [step.text(node) for node in code.unseen_outputs()]
    needed = _constants_used(code)
    return CodeView(
        derived=derived,
        step=tuple(Lines(g.title, g.source, tuple(lines(g.assignments, step))) for g in code.step),
        next_state=tuple(lines(code.next_state, step, style.declared.replace("{name}", "{name}_next"))),
        outputs=tuple(lines(code.outputs, step, "        outputs->{name} = ")),
        initial=setting(code.initial),
        carried=setting(code.carried),
        resumed=setting(code.resumed),
        check=wrapped(" + ".join([*unseen, *following, *products]), 25, language, style.indent),
        begun=wrapped(
            " + ".join(fields[f.name] for f in (*program.inputs, *program.states)), 25, language, style.indent
        ),
        given=wrapped(" + ".join(fields[f.name] for f in program.inputs), 25, language, style.indent),
        step_uses_parameters=needed,
        functions=code.functions,
        divides=code.divides,
        operations=code.operations(),
    )


def _over_arrays(program: Program, code: Code, style: Style) -> CodeView:
    """The view of rolled code: its lines are in ``loops``."""
    assert style.loops is not None
    loops = loop_view(program, code, style.language, style.loops)

    def setting(values: Setting, printed: PrintedSetting) -> SettingView:
        return SettingView((), (), _structs_used(program, values), printed)

    return CodeView(
        derived=(),
        step=(),
        next_state=(),
        outputs=(),
        initial=setting(code.initial, loops.initial),
        carried=setting(code.carried, loops.carried),
        resumed=setting(code.resumed, loops.resumed),
        check="",
        begun="",
        given="",
        step_uses_parameters=_constants_used(code),
        functions=code.functions,
        divides=code.divides,
        operations=code.operations(),
        loops=loops,
    )


def _structs_used(program: Program, values: Setting) -> frozenset[str]:
    states, inputs = ({f.name for f in fields} for fields in (program.states, program.inputs))
    symbols = [n for n in reachable(values.nodes) if n.kind == "symbol"]
    used = {"parameters": any(n.constant for n in symbols), "outputs": any(n.name.startswith(HELD) for n in symbols)}
    used |= {"state": any(n.name in states for n in symbols), "inputs": any(n.name in inputs for n in symbols)}
    return frozenset(struct for struct, read in used.items() if read)


def _constants_used(code: Code) -> bool:
    assigned = [a.value for g in code.step for a in g.assignments]
    nodes: list[Node] = reachable([*assigned, *(a.value for a in (*code.next_state, *code.outputs))])
    return any(n.kind == "symbol" and n.constant for n in nodes)

"""Code → what the templates of a language need: stretches with their lines as text, sums, arrays to declare."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from codegen.emit.expression import Expressions, wrapped
from codegen.emit.language import Language
from codegen.program import Code, Program
from codegen.program.code import Operations, Setting
from codegen.program.graph import Node, reachable
from codegen.program.model import HELD
from codegen.program.stretch import Line, RolledSetting, Stretch, Sum

INDEX = "i"
_SUM_STARTS = 25
"""Column at which the value of a sum starts, for its wrapping."""


@dataclass(frozen=True)
class Style:
    """How a language writes fields of structs and locals: formats with {name}, which may have an index behind it.

    Attributes:
        structs: struct → format; ``local`` of arrays and of locals of the function, ``inner`` of those of a loop.
        declared: before a local that is declared where it gets its value; ``declares`` whether one of the function is.
        indent: of a line of a straight stretch; that of a loop is four deeper.
    """

    language: Language
    structs: Mapping[str, str]
    local: str
    inner: str
    declared: str
    declares: bool
    indent: int


@dataclass(frozen=True)
class PrintedLine:
    """``target`` with its declaration where it has one, and the value; ``name`` alone, and whether of a field."""

    target: str
    value: str
    unit: str
    name: str
    field: bool


@dataclass(frozen=True)
class PrintedPart:
    title: str
    source: str
    lines: tuple[PrintedLine, ...]


@dataclass(frozen=True)
class PrintedStretch:
    """A loop if ``stop`` is above ``first``."""

    first: int
    stop: int
    backward: bool
    parts: tuple[PrintedPart, ...]


@dataclass(frozen=True)
class PrintedSum:
    first: int
    stop: int
    value: str
    backward: bool = False


@dataclass(frozen=True)
class LocalArray:
    name: str
    count: int


@dataclass(frozen=True)
class PrintedSetting:
    """``scalars`` and ``arrays`` are its locals; ``uses`` the structs that it reads."""

    stretches: tuple[PrintedStretch, ...]
    scalars: tuple[str, ...]
    arrays: tuple[LocalArray, ...]
    uses: frozenset[str]

    @property
    def locals(self) -> list[PrintedLine]:
        """The lines of its locals, in straight code."""
        return [line for s in self.stretches for part in s.parts for line in part.lines if not line.field]

    @property
    def states(self) -> list[PrintedLine]:
        """The lines of the states, in straight code."""
        return [line for s in self.stretches for part in s.parts for line in part.lines if line.field]


@dataclass(frozen=True)
class DerivedEntry:
    """A derived constant, or an array of them; ``count`` is 0 for a scalar, ``formula`` that of the first."""

    name: str
    count: int
    values: tuple[float, ...]
    formula: str


@dataclass(frozen=True)
class CodeView:
    """A program in one language; the names are those of ``Rolled`` and ``Code``.

    Attributes:
        straight: whether it has no arrays, and so no loops.
    """

    straight: bool
    arrays: tuple[LocalArray, ...]
    scalars: tuple[str, ...]
    derived: tuple[DerivedEntry, ...]
    prepare: tuple[PrintedStretch, ...]
    step: tuple[PrintedStretch, ...]
    outputs: tuple[PrintedStretch, ...]
    following: tuple[PrintedStretch, ...]
    initial: PrintedSetting
    carried: PrintedSetting
    resumed: PrintedSetting
    check: tuple[PrintedSum, ...]
    begun: tuple[PrintedSum, ...]
    given: tuple[PrintedSum, ...]
    step_uses_parameters: bool
    functions: frozenset[str]
    divides: bool
    operations: Operations


def view(program: Program, code: Code, style: Style) -> CodeView:
    """Print every stretch of ``code.rolled``.

    Raises:
        BadInput: for a number that the language has no literal for.
    """
    rolled = code.rolled
    printer = _Printer(program, code, style)
    settings = (code.initial, rolled.initial), (code.carried, rolled.carried), (code.resumed, rolled.resumed)
    initial, carried, resumed = (printer.setting(r, _structs_used(program, s)) for s, r in settings)
    return CodeView(
        straight=printer.straight,
        arrays=printer.arrays(rolled.arrays),
        scalars=rolled.scalars,
        derived=_derived(program, code, style.language),
        prepare=printer.stretches(rolled.prepare),
        step=printer.stretches(rolled.step),
        outputs=printer.stretches(rolled.outputs),
        following=printer.stretches(rolled.following),
        initial=initial,
        carried=carried,
        resumed=resumed,
        check=printer.sums(rolled.check),
        begun=printer.sums(rolled.begun),
        given=printer.sums(rolled.given),
        step_uses_parameters=_constants_used(code),
        functions=code.functions,
        divides=code.divides,
        operations=code.operations(),
    )


def _derived(program: Program, code: Code, language: Language) -> tuple[DerivedEntry, ...]:
    """Scalars and arrays in the order in which their first element is computed."""
    rolled = code.rolled
    constants = {
        a.value: "{}[{}]".format(*rolled.constants[a.name]) for a in code.derived if a.name in rolled.constants
    }
    names = {f.name: program.reference(f.name) for f in program.parameters}
    plain = Expressions(language, names, {a.value: a.name for a in code.derived} | constants)
    values: dict[str, dict[int, float]] = {}
    formulas: dict[str, str] = {}
    for a, value in zip(code.derived, code.derived_values, strict=True):
        array, at = rolled.constants.get(a.name, (a.name, 0))
        values.setdefault(array, {})[at] = value
        formulas.setdefault(array, plain.text(a.value, whole=True))
    scalars = {a.name for a in code.derived} - set(rolled.constants)
    return tuple(
        DerivedEntry(
            name,
            0 if name in scalars else rolled.lengths[name],
            tuple(known.get(k, 0.0) for k in range(1 if name in scalars else rolled.lengths[name])),
            formulas[name],
        )
        for name, known in values.items()
    )


class _Printer:
    def __init__(self, program: Program, code: Code, style: Style) -> None:
        self.rolled, self.language, self.style = code.rolled, style.language, style
        self.straight = not program.arrays
        groups = {"parameters": program.parameters, "state": program.states, "inputs": program.inputs}
        struct = {f.name: kind for kind, fields in groups.items() for f in fields}
        struct |= {a.name: "parameters" for a in code.derived}
        struct |= {HELD + a.name: "outputs" for a in code.outputs}
        self.words = {name: style.structs[kind].format(name=name.removeprefix(HELD)) for name, kind in struct.items()}
        self.expressions = Expressions(self.language, self.words, {}, self.place)

    def setting(self, setting: RolledSetting, uses: frozenset[str]) -> PrintedSetting:
        return PrintedSetting(self.stretches(setting.stretches), setting.scalars, self.arrays(setting.arrays), uses)

    def arrays(self, names: Sequence[str]) -> tuple[LocalArray, ...]:
        return tuple(LocalArray(name, self.rolled.lengths[name]) for name in names)

    def stretches(self, stretches: Sequence[Stretch]) -> tuple[PrintedStretch, ...]:
        return tuple(
            PrintedStretch(
                s.first,
                s.stop,
                s.backward,
                tuple(PrintedPart(p.title, p.source, tuple(self.line(a, s.loop) for a in p.lines)) for p in s.parts),
            )
            for s in stretches
        )

    def line(self, line: Line, loop: bool) -> PrintedLine:
        target = self.target(line)
        local = line.target.kind == "local" and (loop or self.style.declares)
        text = self.style.declared.format(name=target) if local else target
        indent = self.style.indent + (4 if loop else 0)
        value = self.expressions.text(line.value)
        behind = len(line.unit) if self.straight and not line.field else 0
        start = indent + len(text) + 3 + behind
        value = wrapped(value, start, self.language, indent + 4)
        return PrintedLine(text, value, line.unit, line.target.name, bool(line.field))

    def target(self, line: Line) -> str:
        if not line.field:
            return self.place(line.target)
        node = line.target
        name = f"{node.name}[{self.index(node)}]" if node.kind == "element" else node.name
        return self.style.structs[line.field].format(name=name)

    def place(self, node: Node) -> str:
        """An element or a local."""
        if node.kind == "local":
            return (self.style.inner if node.signs else self.style.local).format(name=node.name)
        kind = self.rolled.storage[node.name]
        written = self.style.local if kind == "local" else self.style.structs[kind]
        return written.format(name=f"{node.name.removeprefix(HELD)}[{self.index(node)}]")

    @staticmethod
    def index(node: Node) -> str:
        at = int(node.value)
        if not node.signs:
            return str(at)
        return INDEX if at == 0 else f"{INDEX} + {at}" if at > 0 else f"{INDEX} - {-at}"

    def sums(self, sums: Sequence[Sum]) -> tuple[PrintedSum, ...]:
        indent = self.style.indent + 4
        added = [" + ".join(self.expressions.text(t) for t in s.terms) for s in sums]
        lines = [wrapped(text, _SUM_STARTS, self.language, indent) for text in added]
        return tuple(PrintedSum(s.first, s.stop, text) for s, text in zip(sums, lines, strict=True))


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

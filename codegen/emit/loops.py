"""Rolled code → what the templates of a language need: stretches with their lines as text, sums, arrays to declare."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from codegen.emit.expression import Expressions, wrapped
from codegen.emit.language import Language
from codegen.program import Code, Program
from codegen.program.graph import Node
from codegen.program.model import HELD
from codegen.program.stretch import Line, Rolled, RolledSetting, Stretch, Sum

INDEX = "i"


@dataclass(frozen=True)
class LoopStyle:
    """How a language writes what stands in structs and locals: formats with {name}, which may have an index behind it.

    Attributes:
        structs: struct → format; ``local`` of arrays and of locals of the function, ``inner`` of those of a loop.
        declared: before a local that is declared where it gets its value; ``declares`` whether one of the function is.
        indent: of a line of a straight stretch; that of a loop is four deeper.
    """

    structs: Mapping[str, str]
    local: str
    inner: str
    declared: str
    declares: bool
    indent: int


@dataclass(frozen=True)
class PrintedLine:
    """``target`` with its declaration where it has one, and the value."""

    target: str
    value: str
    unit: str


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
    """``scalars`` and ``arrays`` are its locals."""

    stretches: tuple[PrintedStretch, ...]
    scalars: tuple[str, ...]
    arrays: tuple[LocalArray, ...]


@dataclass(frozen=True)
class DerivedEntry:
    """A derived constant, or an array of them; ``count`` is 0 for a scalar, ``formula`` that of the first."""

    name: str
    count: int
    values: tuple[float, ...]
    formula: str


@dataclass(frozen=True)
class LoopView:
    """A rolled program in one language; the names are those of ``Rolled``."""

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


def loop_view(program: Program, code: Code, language: Language, style: LoopStyle) -> LoopView:
    """Print every stretch of ``code.rolled``."""
    rolled = code.rolled
    assert rolled is not None
    printer = _Printer(program, code, rolled, language, style)
    return LoopView(
        arrays=printer.arrays(rolled.arrays),
        scalars=rolled.scalars,
        derived=_derived(program, code, rolled, language),
        prepare=printer.stretches(rolled.prepare),
        step=printer.stretches(rolled.step),
        outputs=printer.stretches(rolled.outputs),
        following=printer.stretches(rolled.following),
        initial=printer.setting(rolled.initial),
        carried=printer.setting(rolled.carried),
        resumed=printer.setting(rolled.resumed),
        check=printer.sums(rolled.check),
        begun=printer.sums(rolled.begun),
        given=printer.sums(rolled.given),
    )


def _derived(program: Program, code: Code, rolled: Rolled, language: Language) -> tuple[DerivedEntry, ...]:
    """Scalars and arrays in the order in which their first element is computed."""
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
    def __init__(self, program: Program, code: Code, rolled: Rolled, language: Language, style: LoopStyle) -> None:
        self.rolled, self.language, self.style = rolled, language, style
        groups = {"parameters": program.parameters, "state": program.states, "inputs": program.inputs}
        struct = {f.name: kind for kind, fields in groups.items() for f in fields}
        struct |= {a.name: "parameters" for a in code.derived}
        struct |= {HELD + a.name: "outputs" for a in code.outputs}
        self.words = {name: style.structs[kind].format(name=name.removeprefix(HELD)) for name, kind in struct.items()}
        self.expressions = Expressions(language, self.words, {}, self.place)

    def setting(self, setting: RolledSetting) -> PrintedSetting:
        return PrintedSetting(self.stretches(setting.stretches), setting.scalars, self.arrays(setting.arrays))

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
        start = indent + len(text) + 3
        return PrintedLine(text, wrapped(value, start, self.language, indent + 4), line.unit)

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
        return tuple(PrintedSum(s.first, s.stop, " + ".join(self.expressions.text(t) for t in s.terms)) for s in sums)

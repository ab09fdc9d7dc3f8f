"""Printing of assignments, sums and derived constants of a Code; the templates of every language call it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from codegen.emit.expression import Expressions, Language, wrapped
from codegen.emit.header import Header
from codegen.program import Code, Program
from codegen.program.code import Line, Stretch, Sum
from codegen.program.graph import Node, reachable
from codegen.program.model import HELD, LARGEST

INDEX = "i"
_SUM_STARTS = 25
"""Column from which the terms of a sum are wrapped."""


@dataclass(frozen=True)
class Style:
    """Syntax of struct fields and local variables in a language: formats with {name}, which may end with an index.

    Attributes:
        structs: struct → format of its fields.
        local, inner: format of a local of the function, and of a local of a loop body.
        declaration: format of a local that is declared where it is assigned, as are those of a loop body.
        declares_locals: whether locals of the function are declared where they are assigned too.
        indent: of a line outside loops; a loop body is indented by four more.
    """

    language: Language
    structs: Mapping[str, str]
    local: str
    inner: str
    declaration: str
    declares_locals: bool
    indent: int


@dataclass(frozen=True)
class Entry:
    """A struct field as declared: a scalar, or an array of numbered quantities.

    Attributes:
        count: length of an array; 0 for a scalar.
        unit, meaning: for the comment; the meaning of an array names its first and last element.
        values: one for each element.
    """

    name: str
    count: int
    unit: str
    meaning: str
    values: tuple[float, ...]

    @property
    def declared(self) -> str:
        """The declarator: x, or x[16]."""
        return f"{self.name}[{self.count}]" if self.count else self.name


Row = tuple[str, str, str, float]
"""Name, unit, meaning and value of a scalar."""


def entries(program: Program, struct: str) -> tuple[Entry, ...]:
    """The entries of ``parameters``, ``states``, ``inputs`` or ``outputs``; neighbours of an array are one entry."""
    if struct == "outputs":
        rows = [(name, unit, meaning, 0.0) for name, unit, meaning in program.outputs]
    else:
        rows = [(f.name, f.unit, f.meaning, f.value or 0.0) for f in getattr(program, struct)]
    groups: list[list[Row]] = []
    for row in rows:
        place = program.arrays.get(row[0])
        before = program.arrays.get(groups[-1][-1][0]) if groups else None
        if place is not None and before is not None and before.array == place.array:
            groups[-1].append(row)
        else:
            groups.append([row])
    return tuple(_entry(program, group) for group in groups)


def _entry(program: Program, group: Sequence[Row]) -> Entry:
    name, unit, meaning, _ = group[0]
    values = tuple(value for _, _, _, value in group)
    place = program.arrays.get(name)
    if place is None:
        return Entry(name, 0, unit, meaning, values)
    units = "; ".join(dict.fromkeys(row[1] for row in group))
    return Entry(place.array, len(group), units, f"{name} to {group[-1][0]}, {meaning}", values)


@dataclass(frozen=True)
class DerivedEntry:
    """A derived constant, or an array of them; ``count`` is 0 for a scalar, ``formula`` that of the first."""

    name: str
    count: int
    values: tuple[float, ...]
    formula: str


class Writer:
    """Printer of a program's code in one style.

    Its methods raise BadInput for a number that no literal of the language expresses.
    """

    def __init__(self, program: Program, code: Code, style: Style) -> None:
        self.code, self.language, self.style = code, style.language, style
        self._loops = bool(program.arrays)
        self._parameters = {f.name: program.reference(f.name) for f in program.parameters}
        groups = {"parameters": program.parameters, "state": program.states, "inputs": program.inputs}
        self._struct = {f.name: kind for kind, fields in groups.items() for f in fields}
        self._struct |= {a.name: "parameters" for a in code.derived}
        self._struct |= {HELD + a.name: "outputs" for a in code.outputs}
        words = {name: style.structs[kind].format(name=name.removeprefix(HELD)) for name, kind in self._struct.items()}
        self._expressions = Expressions(self.language, words, {}, self._place)

    def target(self, line: Line, stretch: Stretch) -> str:
        """The left-hand side of an assignment, with the declaration of a local where it is declared here."""
        if line.field:
            node = line.target
            name = f"{node.name}[{_index(node)}]" if node.kind == "element" else node.name
            return self.style.structs[line.field].format(name=name)
        name = self._place(line.target)
        declares = line.target.kind == "local" and (stretch.loop or self.style.declares_locals)
        return self.style.declaration.format(name=name) if declares else name

    def value(self, line: Line, stretch: Stretch) -> str:
        """The right-hand side of an assignment, wrapped."""
        indent = self.style.indent + (4 if stretch.loop else 0)
        comment = 0 if self._loops or line.field else len(line.unit)
        start = indent + len(self.target(line, stretch)) + 3 + comment
        return wrapped(self._expressions.text(line.value), start, self.language, indent + 4)

    def terms(self, added: Sum) -> str:
        """The terms of a sum, wrapped; empty where there are none."""
        text = " + ".join(self._expressions.text(term) for term in added.terms)
        return wrapped(text, _SUM_STARTS, self.language, self.style.indent + 4)

    def reads(self, nodes: Iterable[Node]) -> frozenset[str]:
        """The structs whose fields the expressions use."""
        return frozenset(self._struct[n.name] for n in reachable(nodes) if n.kind == "symbol")

    @property
    def derived(self) -> tuple[DerivedEntry, ...]:
        """Derived constants, scalars and arrays, in the order in which their first element is computed."""
        code, rolled = self.code, self.code.rolled
        names = {name: f"{array}[{at}]" for name, (array, at) in rolled.constants.items()}
        plain = Expressions(self.language, self._parameters, {a.value: names.get(a.name, a.name) for a in code.derived})
        values: dict[str, dict[int, float]] = {}
        formulas: dict[str, str] = {}
        for a, value in zip(code.derived, code.derived_values, strict=True):
            array, at = rolled.constants.get(a.name, (a.name, 0))
            values.setdefault(array, {})[at] = value
            formulas.setdefault(array, plain.text(a.value, whole=True))
        counts = {array: rolled.lengths[array] for array, _ in rolled.constants.values()}
        return tuple(
            DerivedEntry(
                name,
                counts.get(name, 0),
                tuple(known.get(k, 0.0) for k in range(counts.get(name, 1))),
                formulas[name],
            )
            for name, known in values.items()
        )

    def _place(self, node: Node) -> str:
        """The text of an array element or a local."""
        if node.kind == "local":
            return (self.style.inner if node.signs else self.style.local).format(name=node.name)
        kind = self.code.rolled.storage[node.name]
        written = self.style.local if kind == "local" else self.style.structs[kind]
        return written.format(name=f"{node.name.removeprefix(HELD)}[{_index(node)}]")


def template_words(program: Program, code: Code, header: Header, style: Style, real: str) -> dict[str, Any]:
    """The variables that the templates of every language use; ``real`` is the type of a number."""
    literal, largest = style.language.literal, LARGEST[program.precision]
    return {
        "program": program,
        "code": code,
        "header": header,
        "text": Writer(program, code, style),
        "literal": literal,
        "real": real,
        "largest": literal(largest),
        "largest_shown": f"{largest:.0e}",
        **{struct: entries(program, struct) for struct in ("parameters", "states", "inputs", "outputs")},
    }


def _index(element: Node) -> str:
    at = int(element.value)
    if not element.signs:
        return str(at)
    return INDEX if at == 0 else f"{INDEX} + {at}" if at > 0 else f"{INDEX} - {-at}"

"""Printing of assignments, sums and derived constants of a Code; the templates of every language call it."""

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
"""Loop variable of the printed code."""
_SUM_STARTS = 25
"""Column at which the terms of a sum start in the templates."""


@dataclass(frozen=True)
class Style:
    """Syntax of struct fields and local variables in a language.

    The formats contain {name}, for which a name with or without an index is inserted, such as x or x[3].

    Attributes:
        structs: struct → format of its fields, such as ``s->{name}``.
        local: format of a local variable of the function.
        inner: format of a local variable of a loop body.
        declaration: format of a local variable in the assignment that also declares it.
        declares_locals: whether the assignment declares a local variable of the function; it always declares one of a
            loop body.
        indent: columns before a line outside loops; a loop body has four more.
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
    """A field of a struct: a scalar, or an array of numbered quantities such as x1, x2, ….

    Attributes:
        count: length of an array; 0 for a scalar.
        unit, meaning: for the comment; the meaning of an array names its first and last quantity.
        values: initial or declared value of each element; zeros if there are none.
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
    """The fields of a struct, in order; successive quantities of one array make one field.

    ``struct``: ``parameters``, ``states``, ``inputs`` or ``outputs``.
    """
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
    """The field of the quantities in ``group``: one scalar, or all elements of one array."""
    name, unit, meaning, _ = group[0]
    values = tuple(value for _, _, _, value in group)
    place = program.arrays.get(name)
    if place is None:
        return Entry(name, 0, unit, meaning, values)
    units = "; ".join(dict.fromkeys(row[1] for row in group))
    return Entry(place.array, len(group), units, f"{name} to {group[-1][0]}, {meaning}", values)


@dataclass(frozen=True)
class DerivedEntry:
    """A constant that is computed from parameters, or an array of such constants.

    Attributes:
        count: length of an array; 0 for a scalar.
        values: at the parameters of the spec, one for each element.
        formula: of the first element.
    """

    name: str
    count: int
    values: tuple[float, ...]
    formula: str


class Writer:
    """Printer of the assignments in a program's code; the templates call it for each line.

    A line belongs to a stretch: a straight sequence of assignments, or the body of a loop.

    Raises:
        BadInput: by its methods, for a number that no literal of the language can express.
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
        """The left-hand side of an assignment, with the type of a local variable if this assignment declares it."""
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
        """The terms of a sum, joined by + and wrapped; an empty text for a sum without terms."""
        text = " + ".join(self._expressions.text(term) for term in added.terms)
        return wrapped(text, _SUM_STARTS, self.language, self.style.indent + 4)

    def reads(self, nodes: Iterable[Node]) -> frozenset[str]:
        """The structs whose fields the expressions use."""
        return frozenset(self._struct[n.name] for n in reachable(nodes) if n.kind == "symbol")

    @property
    def derived(self) -> tuple[DerivedEntry, ...]:
        """The derived constants, scalars and arrays, in the order in which their first elements are computed."""
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
                name, counts.get(name, 0), tuple(known.get(k, 0.0) for k in range(counts.get(name, 1))), formulas[name]
            )
            for name, known in values.items()
        )

    def _place(self, node: Node) -> str:
        """The text of an array element or a local variable."""
        if node.kind == "local":
            return (self.style.inner if node.varies_in_loop else self.style.local).format(name=node.name)
        kind = self.code.rolled.storage[node.name]
        written = self.style.local if kind == "local" else self.style.structs[kind]
        return written.format(name=f"{node.name.removeprefix(HELD)}[{_index(node)}]")


def template_words(program: Program, code: Code, header: Header, style: Style, real: str) -> dict[str, Any]:
    """The variables of the templates that are common to all languages.

    ``real``: the type of a number in the language, such as ``double``.
    """
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
    """The index of an array element: 3, or relative to the loop variable: i, i + 3, i - 3."""
    at = int(element.value)
    if not element.varies_in_loop:
        return str(at)
    return INDEX if at == 0 else f"{INDEX} + {at}" if at > 0 else f"{INDEX} - {-at}"

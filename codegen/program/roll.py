"""Loop rerolling, Code → Rolled: numbered quantities are stored in arrays, isomorphic computations on them are loops.

Example: slip_1 = v1 to slip_16 = v16 become ``for i in 0..15: slip[i] = v[i]``.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from itertools import groupby

from codegen.program.arrays import Element, elements
from codegen.program.code import Code, Line, Part, Rolled, RolledSetting, Setting, Stretch, Sum
from codegen.program.graph import Graph, Node
from codegen.program.model import HELD, Program
from codegen.program.naming import Names
from codegen.program.schedule import Run, Value, schedule

FEWEST = 8
"""Smallest number of isomorphic intermediate results that are stored in an array."""


def roll(program: Program, code: Code, names: Names) -> Rolled:
    """The printed form: with arrays and loops for a program with numbered quantities, else without loops."""
    return _Rolling(program, names).rolled(code)


class _Rolling:
    """Rerolling of one program; its state is the values of the function being rolled.

    Attributes:
        places: field, output or block element → its array element.
        defined: node → the value that computes it.
        run_of: value → the loop that computes it, or its run of one.
        storage, lengths, scalars: as in ``Rolled``.
    """

    def __init__(self, program: Program, names: Names) -> None:
        self.program, self.names = program, names
        kept = [name for name, _, _ in program.outputs if name in program.arrays]
        outputs = {HELD + name: program.arrays[name] for name in kept}
        self.places = {**program.arrays, **{name: Element(HELD + p.array, p.at) for name, p in outputs.items()}}
        self.graph = Graph()
        self.defined: dict[Node, Value] = {}
        self.run_of: dict[Value, Run] = {}
        self.storage: dict[str, str] = {}
        self.lengths: dict[str, int] = {}
        self.scalars: list[str] = []
        groups = {"parameters": program.parameters, "state": program.states, "inputs": program.inputs}
        for kind, fields in groups.items():
            for place in (self.places[f.name] for f in fields if f.name in self.places):
                self._record_array(place, kind)
        for name in outputs:
            self._record_array(self.places[name], "outputs")

    def rolled(self, code: Code) -> Rolled:
        constants = self._constants(code)
        prepare = self._stretches(constants)
        step = [
            Value(a.value, a.name, self.places.get(a.name), title=a.title, source=a.source, unit=a.unit)
            for a in code.step
        ]
        self._place(step)
        outputs = [self._field(a.name, a.value, "outputs") for a in code.outputs]
        for v in (u for output in outputs for u in self._values_in(output.node)):
            v.stored = v.place is not None
        following, markers = self._following(code)
        body = self._stretches([*step, *following])
        scalars = tuple(self.scalars)
        unseen = code.unseen(f.name for f in self.program.inputs)
        written = self._stretches(outputs, join=False)
        states = [self._field(a.name, m, "state") for a, m in zip(code.next_state, markers, strict=True)]
        committed = self._stretches(states, join=False)
        inputs, before = (
            [Node("symbol", name=f.name) for f in fields] for fields in (self.program.inputs, self.program.states)
        )
        check = self._sums([*(node for node in inputs if node.name in unseen), *markers, *code.unseen_outputs()])
        # Outside the normal step, magnitudes: of two inputs that are too large, and cancel, neither is used.
        input_check, initial_check = self._sums(inputs, _magnitude), self._sums([*inputs, *before], _magnitude)
        arrays = self._local_arrays()
        return Rolled(
            storage=self.storage,
            lengths=self.lengths,
            constants={v.name: (v.place.array, v.place.at) for v in constants if v.place is not None},
            scalars=scalars,
            arrays=arrays,
            prepare=prepare,
            step=body,
            initial=self._setting(constants, code.initial),
            predicted=self._setting(constants, code.predicted),
            resumed=self._setting(constants, code.resumed),
            outputs=written,
            following=committed,
            check=check,
            initial_check=initial_check,
            input_check=input_check,
        )

    # Values to compute.

    def _setting(self, constants: list[Value], setting: Setting) -> RolledSetting:
        before, self.scalars = self._local_arrays(), []
        parts = [Value(a.value, a.name) for a in setting.parts]
        self.defined = {v.node: v for v in constants}
        self._place(parts)
        stretches = self._stretches([*parts, *(self._field(a.name, a.value, "state") for a in setting.states)])
        return RolledSetting(stretches, tuple(self.scalars), self._local_arrays()[len(before) :])

    def _local_arrays(self) -> tuple[str, ...]:
        return tuple(array for array, kind in self.storage.items() if kind == "local")

    def _constants(self, code: Code) -> list[Value]:
        """Derived constants; numbered names are stored in arrays, and isomorphic formulas of the others too."""
        named = [a.name for a in code.derived if not re.fullmatch(r"constant_\d+", a.name)]
        places = elements(named, self.names) if self.program.arrays else {}
        values = [Value(a.value, a.name, places.get(a.name), "parameters", True) for a in code.derived]
        self._place(values)
        return values

    def _field(self, name: str, node: Node, field: str) -> Value:
        """A value that is stored in a struct."""
        return Value(node, name, self.places.get(name), field, True)

    def _following(self, code: Code) -> tuple[list[Value], list[Node]]:
        """The values of the next states, and a symbol for each, to refer to it."""
        arrays: dict[str, str] = {}
        values, markers = [], []
        for a in code.next_state:
            place = self.places.get(a.name)
            if place is not None:
                if place.array not in arrays:
                    arrays[place.array] = self.names.take(f"{place.array}_next")
                place = Element(arrays[place.array], place.at)
            title = f"states one sample later ({self.program.integration})"
            unit = "" if place is None else a.unit  # a scalar's is in the state's declaration
            values.append(Value(a.value, f"{a.name}_next", place, stored=place is not None, title=title, unit=unit))
            markers.append(Node("symbol", name=f"{a.name}_next"))
            self.defined[markers[-1]] = values[-1]
        return values, markers

    def _place(self, values: Sequence[Value]) -> None:
        """Register values; enough isomorphic computations that are in no array get one."""
        classes: dict[object, int] = {}
        members: dict[int, list[Value]] = {}
        for v in values:
            if v.place is None:
                at = self._first_place(v.node)
                if at is not None:
                    kind = classes.setdefault(self._isomorphism_key(v.node, at, True), len(classes))
                    members.setdefault(kind, []).append(v)
                    v.place = Element(f"{kind}", at)
            self.defined[v.node] = v
        for several in members.values():
            ats = [v.at for v in several]
            array = None
            if len(several) >= FEWEST and len(set(ats)) == len(ats):
                array = self.names.take(re.sub(r"_*\d+", "", several[0].name) or "part")
            for v in several:
                v.place = None if array is None else Element(array, v.at)

    # Expressions, down to named nodes.

    def _place_of(self, node: Node) -> Element | None:
        value = self.defined.get(node)
        return value.place if value is not None else self.places.get(node.name) if node.kind == "symbol" else None

    def _first_place(self, node: Node) -> int | None:
        """Index of the first array element below a node, depth first."""
        for a in node.arguments:
            place = self._place_of(a)
            at = place.at if place else None if a in self.defined else self._first_place(a)
            if at is not None:
                return at
        return None

    def _values_in(self, node: Node, whole: bool = False) -> Iterable[Value]:
        """The values on which an expression depends directly; ``whole`` looks inside a node that is a value itself."""
        if not whole and node in self.defined:
            yield self.defined[node]
            return
        for a in node.arguments:
            yield from self._values_in(a)

    def _isomorphism_key(self, node: Node, at: int, whole: bool = False) -> object:
        """A key that is equal for isomorphic expressions: those that differ only by the array index ``at``."""
        if not whole:
            place = self._place_of(node)
            if place is not None:
                return place.array, place.at - at
            if node in self.defined:
                return self.defined[node].name
        if node.kind in ("number", "symbol"):
            return node.kind, node.value, node.name
        return node.kind, node.signs, node.name, *(self._isomorphism_key(a, at) for a in node.arguments)

    def _computes_its_node(self, v: Value) -> bool:
        """Whether a value computes its node, and is not a copy of another value."""
        return self.defined.get(v.node) is v

    def _written(self, node: Node, run: Run, whole: bool = False) -> Node:
        """The expression as printed in a run, with array elements and locals; indices relative to i in a loop."""
        if not whole:
            if node in self.defined:
                return self._name(self.defined[node], run)
            place = self.places.get(node.name) if node.kind == "symbol" else None
            if place is not None:
                return self._element(place, run)
        return self.graph.like(node, [self._written(a, run) for a in node.arguments])

    def _element(self, place: Element, run: Run) -> Node:
        constant = self.storage.get(place.array) == "parameters"
        return self.graph.element(place.array, place.at - run.first if run.loop else place.at, run.loop, constant)

    def _name(self, v: Value, run: Run) -> Node:
        """The node by which code in ``run`` refers to a value."""
        if v.stored and v.place is not None:
            return self._element(v.place, run)
        if v.field:
            return self.graph.symbol(v.name, v.field == "parameters")
        own = self.run_of[v]
        if own is run and run.loop and v.place is not None:
            array = v.place.array
            return self.graph.local(f"{array}_here" if array in self.lengths else array, True)
        return self.graph.local(v.name, False)

    # Stretches.

    def _stretches(self, values: Sequence[Value], join: bool = True) -> tuple[Stretch, ...]:
        """The printed code of values, scheduled; ``join`` allows loop fusion."""
        own = set(values)
        for k, v in enumerate(values):
            v.order = k
            whole = self._computes_its_node(v)
            v.key = None if v.place is None else self._isomorphism_key(v.node, v.at, whole)
            v.uses = [u for u in self._values_in(v.node, whole) if u in own]
        runs = schedule(values, join)
        self.run_of |= {v: run for run in runs for v in run.values}
        self._decide_stored(values, runs)
        for v in values:
            if v.stored and v.place is not None and v.field != "outputs":
                self._record_array(v.place, v.field or "local")
            elif not v.field and not self.run_of[v].loop:
                self.scalars.append(v.name)
        result: list[Stretch] = []
        for run in runs:
            parts = self._parts(run)
            if result and not run.loop and not result[-1].loop:
                parts = [*result.pop().parts, *parts]
            groups = groupby(parts, key=lambda part: (part.title, part.source))  # neighbours with the same comment
            merged = (Part(*comment, tuple(line for p in some for line in p.lines)) for comment, some in groups)
            result.append(Stretch(tuple(merged), run.first, run.stop, run.backward))
        return tuple(result)

    def _decide_stored(self, values: Sequence[Value], runs: Sequence[Run]) -> None:
        """Mark the values that are stored in their array, because another iteration or code after the loop uses them.

        The others are locals of the loop's body. All values that a line of a loop assigns are stored alike.
        """
        for v in values:
            for u in v.uses:
                run, other = self.run_of[v], self.run_of[u]
                together = run is other and u.place is not None and v.place is not None and u.at == v.at
                if u.place is not None and not together and (run.loop or other.loop):
                    u.stored = True
        for column in (c for run in runs if run.loop for c in run.members):
            if any(v.stored for v in column):
                for v in column:
                    v.stored = True

    def _parts(self, run: Run) -> list[Part]:
        parts = []
        for column in run.members:
            v = column[0]
            line = Line(self._name(v, run), self._written(v.node, run, self._computes_its_node(v)), v.unit, v.field)
            parts.append(Part(v.title, v.source, (line,)))
        return parts

    def _record_array(self, place: Element, kind: str) -> None:
        """Record where an array is stored, and its length."""
        self.storage[place.array] = kind
        self.lengths[place.array] = max(self.lengths.get(place.array, 0), place.at + 1)

    def _sums(self, nodes: Sequence[Node], of: Callable[[Node], Node] = lambda node: node) -> tuple[Sum, ...]:
        """The sum of nodes, or ``of`` nodes: single terms first, then arrays, grouped by their range of indices."""
        single: list[Node] = []
        ranges: dict[str, list[int]] = {}
        for node in nodes:
            place = self._place_of(node)
            if place is None:
                single.append(of(self._written(node, Run([]))))
            else:
                ranges.setdefault(place.array, []).append(place.at)
        together: dict[tuple[int, int], list[Node]] = {}
        for array, ats in ranges.items():
            together.setdefault((min(ats), max(ats) + 1), []).append(of(self.graph.element(array, 0, True)))
        return Sum(tuple(single)), *(Sum(tuple(terms), *range_) for range_, terms in together.items())


def _magnitude(node: Node) -> Node:
    return Node("call", (node,), name="abs")

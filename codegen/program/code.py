"""Lowered form of a program: assignments in order, derived constants apart; and the same with arrays and loops."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

from codegen.program.graph import Node, reachable

LIMITS = ("exp", "tanh", "sign", "pow")
"""Functions that may return a finite value for a non-finite argument."""


@dataclass(frozen=True)
class Assignment:
    """An assignment NAME = value; ``unit`` is empty for an intermediate result.

    ``title`` and ``source``, the equation's number, are of the comment above it in a step.
    """

    name: str
    value: Node
    unit: str = ""
    title: str = ""
    source: str = ""


class Operations(NamedTuple):
    """Operation counts of a step; ``additions`` include subtractions, ``selections`` are signs and magnitudes."""

    additions: int
    products: int
    divisions: int
    calls: int
    selections: int


@dataclass(frozen=True)
class Setting:
    """Assignments of states outside the normal step: intermediate results ``parts``, then ``states``."""

    states: tuple[Assignment, ...]
    parts: tuple[Assignment, ...]

    @property
    def nodes(self) -> list[Node]:
        """All expressions assigned."""
        return [a.value for a in (*self.parts, *self.states)]


@dataclass(frozen=True)
class Line:
    """A printed assignment to an array element or a local, or to a field of the struct ``field`` where that is set."""

    target: Node
    value: Node
    unit: str = ""
    field: str = ""


@dataclass(frozen=True)
class Part:
    """Printed lines under one comment."""

    title: str
    source: str
    lines: tuple[Line, ...]


@dataclass(frozen=True)
class Stretch:
    """Straight-line code, or a loop over i in [first, stop), downwards if ``backward``."""

    parts: tuple[Part, ...]
    first: int = 0
    stop: int = 0
    backward: bool = False

    @property
    def loop(self) -> bool:
        return self.stop > self.first

    @property
    def lines(self) -> tuple[Line, ...]:
        """The lines of all parts."""
        return tuple(line for part in self.parts for line in part.lines)


@dataclass(frozen=True)
class Sum:
    """A sum of terms, or of the terms for every i in [first, stop)."""

    terms: tuple[Node, ...]
    first: int = 0
    stop: int = 0
    backward: ClassVar[bool] = False


@dataclass(frozen=True)
class RolledSetting:
    """Printed form of a Setting; ``scalars`` and ``arrays`` are its locals, with lengths in ``Rolled``."""

    stretches: tuple[Stretch, ...] = ()
    scalars: tuple[str, ...] = ()
    arrays: tuple[str, ...] = ()


@dataclass(frozen=True)
class Rolled:
    """Printed form of a program, with arrays and loops: the operations of its Code in the same order.

    Attributes:
        storage: array → the struct that has it (parameters, state, inputs or outputs), or ``local``.
        lengths: of every array.
        constants: derived constant → (array, index), for those in an array.
        scalars, arrays: locals of the step.
        prepare, step, outputs, following: bodies of the functions; ``following`` assigns the next state.
        initial, predicted, resumed: as in Code.
        check: the sum that is finite if a sample is valid and the next state finite; taken at the end of a step.
        initial_check: the sum of the magnitudes of the inputs and the initial state.
        input_check: the sum of the magnitudes of the inputs.
    """

    storage: Mapping[str, str] = field(default_factory=dict)
    lengths: Mapping[str, int] = field(default_factory=dict)
    constants: Mapping[str, tuple[str, int]] = field(default_factory=dict)
    scalars: tuple[str, ...] = ()
    arrays: tuple[str, ...] = ()
    prepare: tuple[Stretch, ...] = ()
    step: tuple[Stretch, ...] = ()
    outputs: tuple[Stretch, ...] = ()
    following: tuple[Stretch, ...] = ()
    initial: RolledSetting = RolledSetting()
    predicted: RolledSetting = RolledSetting()
    resumed: RolledSetting = RolledSetting()
    check: tuple[Sum, ...] = ()
    initial_check: tuple[Sum, ...] = ()
    input_check: tuple[Sum, ...] = ()


@dataclass(frozen=True)
class Code:
    """A lowered program.

    Attributes:
        derived: constants computed from the parameters, in the order of ``prepare``.
        derived_values: their values, by the same operations.
        step: assignments in order; ``next_state`` and ``outputs`` use them.
        initial: the state at the first sample, over parameters and inputs.
        predicted: the states that change at an invalid sample; empty if invalid samples are not handled.
        resumed: the states set by the first valid sample after many invalid ones; empty likewise.
        rolled: the printed form, with loops where the program has arrays; ``lower`` adds it last.
    """

    derived: tuple[Assignment, ...]
    derived_values: tuple[float, ...]
    step: tuple[Assignment, ...]
    next_state: tuple[Assignment, ...]
    outputs: tuple[Assignment, ...]
    initial: Setting
    predicted: Setting
    resumed: Setting
    rolled: Rolled = field(default_factory=Rolled)

    def unseen(self, inputs: Iterable[str]) -> tuple[str, ...]:
        """Inputs that may be NaN or infinite while every next state is finite."""
        seen = {node.name for node in _propagating(a.value for a in self.next_state) if node.kind == "symbol"}
        return tuple(name for name in inputs if name not in seen)

    def unseen_outputs(self) -> tuple[Node, ...]:
        """Outputs with a product or quotient that may overflow while every next state is finite, each node once."""
        seen = _propagating([a.value for a in self.next_state])
        found = [
            output.value
            for output in self.outputs
            if any(_may_overflow(node) and node not in seen for node in _propagating([output.value]))
        ]
        return tuple(dict.fromkeys(found))

    @property
    def step_nodes(self) -> list[Node]:
        """All expressions of a normal step."""
        return [a.value for a in (*self.step, *self.next_state, *self.outputs)]

    @property
    def nodes(self) -> list[Node]:
        """Every node of every expression."""
        settings = [*self.initial.nodes, *self.predicted.nodes, *self.resumed.nodes]
        return reachable([*(a.value for a in self.derived), *self.step_nodes, *settings])

    @property
    def functions(self) -> frozenset[str]:
        """Names of the functions called in any expression."""
        return frozenset(node.name for node in self.nodes if node.kind == "call")

    @property
    def divides(self) -> bool:
        """Whether there is a division by a variable."""
        return any(node.kind == "quotient" and not node.constant for node in self.nodes)

    def operations(self) -> Operations:
        """Operation counts as printed: a named node counts once."""
        nodes = [n for n in reachable(a.value for a in (*self.step, *self.next_state)) if not n.constant]
        calls = [n.name for n in nodes if n.kind == "call"]
        return Operations(
            additions=sum(len(n.arguments) - 1 for n in nodes if n.kind == "sum"),
            products=sum(len(n.arguments) - 1 for n in nodes if n.kind == "product"),
            divisions=sum(n.kind == "quotient" for n in nodes),
            calls=len(calls) - calls.count("sign") - calls.count("abs"),
            selections=calls.count("sign") + calls.count("abs"),
        )


def _propagating(roots: Iterable[Node]) -> set[Node]:
    """Nodes below the roots whose infinite or NaN value propagates to a root."""
    found: set[Node] = set()
    waiting = list(roots)
    while waiting:
        node = waiting.pop()
        if node not in found:
            found.add(node)
            if node.name not in LIMITS:
                waiting.extend(node.arguments[:1] if node.kind == "quotient" else node.arguments)
    return found


def _may_overflow(node: Node) -> bool:
    """Whether finite arguments may give a non-finite result: a variable divisor, or a product of variables."""
    varying = [a for a in node.arguments if not a.constant]
    return (node.kind == "quotient" and not node.constant) or (node.kind == "product" and len(varying) > 1)

"""Elements of rerolled code: stretches of assignments, straight-line or in a loop, and sums over arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from codegen.program.graph import Node


@dataclass(frozen=True)
class Line:
    """An assignment; ``target`` is an array element or a local, with ``field`` a field of that struct."""

    target: Node
    value: Node
    unit: str = ""
    field: str = ""


@dataclass(frozen=True)
class Part:
    """Lines under one comment."""

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
    """Terms added up once, or for every i of [first, stop)."""

    terms: tuple[Node, ...]
    first: int = 0
    stop: int = 0
    backward: ClassVar[bool] = False


@dataclass(frozen=True)
class RolledSetting:
    """A Setting with arrays; ``scalars`` and ``arrays`` are its locals, lengths in ``Rolled``."""

    stretches: tuple[Stretch, ...] = ()
    scalars: tuple[str, ...] = ()
    arrays: tuple[str, ...] = ()


@dataclass(frozen=True)
class Rolled:
    """A program in its printed form: the same operations in the same order as the assignments of its Code.

    Attributes:
        storage: array → parameters, state, inputs, outputs or local; ``lengths`` of every array.
        arrays: those that are local to the step.
        constants: derived constant → array element, for those in an array.
        scalars: locals of the whole step.
        prepare, step, outputs, following: bodies of the functions; ``following`` assigns the next state.
        initial, carried, resumed: as in Code.
        check, begun, given: sums that must be finite after a step, at the start, and of the inputs.
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
    carried: RolledSetting = RolledSetting()
    resumed: RolledSetting = RolledSetting()
    check: tuple[Sum, ...] = ()
    begun: tuple[Sum, ...] = ()
    given: tuple[Sum, ...] = ()

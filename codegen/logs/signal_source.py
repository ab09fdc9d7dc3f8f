"""A log of signals that have times of their own, of a format whose library gives them one by one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from codegen.base.errors import BadInput, Place
from codegen.logs.description import LogDescription
from codegen.logs.library import reading
from codegen.logs.log import Array
from codegen.logs.series import TIME, check_held, joined, together
from codegen.logs.source import Allowance, Columns

Signal = tuple[str, Array, Array]
"""Name of what it is from (a topic, a group), (N,) times in s, (N,) values."""


@dataclass(eq=False)
class SignalSource:
    """An opened file.

    Attributes:
        expected: what the file should be, for messages.
        columns: name → how many values it has. units: name → unit that the file states.
        unread: part of the file → why it is no column.
        signal: reads one; what it raises is a damaged file's.
        notes: what was done, complete once ``load`` has run.
    """

    path: Path
    expected: str
    columns: Mapping[str, int]
    units: Mapping[str, str]
    unread: Mapping[str, str]
    signal: Callable[[str], Signal]
    description: LogDescription
    allowance: Allowance
    notes: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        if not self.columns:
            raise BadInput(self.place, "no signal of numbers", self.expected, code="LOG001")
        check_held(self.description, self.columns)

    @property
    def names(self) -> tuple[str, ...]:
        return (TIME, *(name for name in self.columns if name != TIME))

    @property
    def place(self) -> Place:
        return Place(str(self.path))

    def load(self, wanted: Sequence[str]) -> Columns:
        """The wanted signals at common times; see ``series.joined``.

        Raises:
            BadInput: for a damaged file, or too many numbers.
        """
        names = [name for name in wanted if name != TIME]
        self.allowance.take(self.path, 16 * sum(self.columns[name] for name in names), self.expected)
        with reading(self.path, self.expected):
            signals = {name: self.signal(name) for name in names}
        columns, words = joined(str(self.path), together(signals), wanted, self.description)
        self.notes += words
        return columns

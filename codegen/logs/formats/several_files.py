"""Logs in several files, for example one for each signal, joined by row number or by time."""

from collections.abc import Mapping, Sequence

import numpy as np

from codegen.base.errors import BadInput, Place
from codegen.logs.description import LogDescription
from codegen.logs.formats.series import Signal, joined
from codegen.logs.formats.source import Columns, LogFile


class SeveralFiles(LogFile):
    """A log whose other files add columns: row k of each belongs to row k of the log, or rows are matched by time.

    A column of another file is called NAME.COLUMN. ``times``: name → (time column of the log, time column of that
    file), both of the same clock; only for the files that are matched by time.
    """

    def __init__(
        self,
        log: LogFile,
        others: Mapping[str, LogFile],
        times: Mapping[str, tuple[str, str]],
        description: LogDescription,
    ) -> None:
        super().__init__(log.path, None, description)
        self.log, self.others, self.times = log, others, times
        self.unread, self.commands = log.unread, log.commands
        self.names = (*log.names, *(f"{name}.{c}" for name, other in others.items() for c in other.names))
        self.units = {
            **{f"{name}.{c}": unit for name, other in others.items() for c, unit in other.units.items()},
            **log.units,
        }

    @property
    def place(self) -> Place:
        return self.log.place

    @property
    def notes(self) -> Sequence[str]:
        added = [f"file `{name}`: {note}" for name, other in self.others.items() for note in other.notes]
        return (*self.log.notes, *added, *self.own_notes)

    def load(self, wanted: Sequence[str]) -> Columns:
        owners = {column: self._owner(column) for column in wanted}
        timed = [name for name in self.times if name in owners.values()]
        numbered = [column for column in wanted if owners[column] not in timed]
        if not timed:
            return self._by_number(numbered, owners)
        needed = dict.fromkeys([*numbered, *(self.times[name][0] for name in timed)])
        own = self._by_number(list(needed), owners)
        clock = own.values[:, own.names.index(self.times[timed[0]][0])]
        signals = {c: Signal(self.log.path.name, clock, own.values[:, k]) for k, c in enumerate(own.names)}
        for name in timed:
            columns = [column for column in wanted if owners[column] == name]
            part = self.others[name].load([self.times[name][1], *(c.removeprefix(f"{name}.") for c in columns)])
            signals |= {c: Signal(name, part.values[:, 0], part.values[:, k + 1]) for k, c in enumerate(columns)}
        return joined(self, signals, wanted, in_seconds=False)

    def _by_number(self, wanted: Sequence[str], owners: Mapping[str, str | None]) -> Columns:
        """The wanted columns of files that are joined by row number; ``owners``: column → its file."""
        own = [column for column in wanted if owners.get(column) is None]
        parts = [self.log.load(own)] if own else []
        for name, other in self.others.items():
            columns = [c.removeprefix(f"{name}.") for c in wanted if owners.get(c) == name]
            if columns:
                part = other.load(columns)
                parts.append(Columns(part.file, tuple(f"{name}.{c}" for c in columns), part.values, part.lines))
        first = parts[0]
        for part in parts[1:]:
            if len(part.values) != len(first.values):
                rows = f"{len(first.values)} rows, as in {first.file}: its rows belong to those of the log by number"
                expected = f"{rows}; or `time: COLUMN` next to its `file:`, if it has times of its own"
                raise BadInput(Place(part.file), f"{len(part.values)} rows", expected, code="LOG011")
        found = {name: part.values[:, k] for part in parts for k, name in enumerate(part.names)}
        return Columns(first.file, tuple(wanted), np.column_stack([found[name] for name in wanted]), first.lines)

    def _owner(self, column: str) -> str | None:
        """The name of the other file that a column is from; None for the log itself."""
        if column in self.log.names:
            return None
        return next((name for name in self.others if column.startswith(f"{name}.")), None)

"""A long table: a row for each value, with its time and the name of its signal."""

from __future__ import annotations

from collections.abc import Sequence

from codegen.base.errors import Place
from codegen.logs.binding import column_of, time_of
from codegen.logs.csv_file import CsvSource
from codegen.logs.description import LogDescription
from codegen.logs.series import Signal, joined, together
from codegen.logs.source import Columns, LogFile
from codegen.logs.table import fields


class LongTable(LogFile):
    """The signals that a column of a text table names, joined at common times.

    Args:
        table: with a row for each value.
        description: whose ``long`` names the columns of names and values.

    Raises:
        BadInput: for a column that is not there, or rows that cannot be split.
    """

    def __init__(self, table: CsvSource, description: LogDescription) -> None:
        super().__init__(table.path, None, description)
        self.table = table
        self._time = time_of(table, description)
        long = description.long
        assert long is not None
        self._value = column_of(table, long.value, description.place("long.value"))
        named = column_of(table, long.name, description.place("long.name"))
        index = table.names.index(named)
        self._rows: dict[str, list[int]] = {}
        for i, line in enumerate(table.lines):
            if i >= table.first and line not in table.layout.head and table.layout.is_row(line):
                texts = fields(line, table.layout.delimiter, table.place)
                self._rows.setdefault(texts[index].strip() if index < len(texts) else "", []).append(i)
        self.names = (self._time, *self._rows)
        self.units = {self._time: table.units.get(self._time, "")}
        self.said = list(table.notes)

    @property
    def place(self) -> Place:
        return self.table.place

    def load(self, wanted: Sequence[str]) -> Columns:
        signals = {name: self._signal(name) for name in wanted if name != self._time}
        return joined(self, together(signals), wanted, self._time, in_seconds=False)

    def _signal(self, name: str) -> Signal:
        """The rows of a signal; the other lines are blank, so that an error names the right line."""
        lines = [""] * len(self.table.lines)
        for i in self._rows[name]:
            lines[i] = self.table.lines[i]
        part = CsvSource(self.table.file, self.table.layout, lines, self.table.first)
        values = part.load([self._time, self._value]).values
        return Signal(name, values[:, 0], values[:, 1])

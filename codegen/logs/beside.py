"""Files side by side: the rows of several files that belong together one by one, as one table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from codegen.base.errors import BadInput, Place
from codegen.logs.source import Columns, Source


@dataclass(frozen=True)
class SideBySide:
    """A log and the files beside it; a column of one of these is called NAME.COLUMN.

    Attributes:
        log: the file that was named as the log. others: name → file, as a description gives them.
    """

    log: Source
    others: Mapping[str, Source]

    @property
    def names(self) -> tuple[str, ...]:
        return (*self.log.names, *(f"{name}.{c}" for name, other in self.others.items() for c in other.names))

    @property
    def place(self) -> Place:
        return self.log.place

    @property
    def units(self) -> Mapping[str, str]:
        beside = {f"{name}.{c}": u for name, other in self.others.items() for c, u in other.units.items()}
        return {**beside, **self.log.units}

    @property
    def notes(self) -> Sequence[str]:
        beside = [f"beside it as {name}: {note}" for name, other in self.others.items() for note in other.notes]
        return (*self.log.notes, *beside)

    @property
    def unread(self) -> Mapping[str, str]:
        """Of the log itself, where its format says so."""
        unread: Mapping[str, str] = getattr(self.log, "unread", {})
        return unread

    @property
    def asked(self) -> Mapping[str, str]:
        """Of the log itself, where its format says so."""
        asked: Mapping[str, str] = getattr(self.log, "asked", {})
        return asked

    def load(self, wanted: Sequence[str]) -> Columns:
        """The wanted columns of all files.

        Raises:
            BadInput: as the files' own ``load``, or if two of them have not equally many rows.
        """
        own = [name for name in wanted if self._owner(name) is None]
        parts = [self.log.load(own)] if own else []
        for name, other in self.others.items():
            columns = [c.removeprefix(f"{name}.") for c in wanted if self._owner(c) == name]
            if columns:
                part = other.load(columns)
                parts.append(Columns(part.file, tuple(f"{name}.{c}" for c in columns), part.values, part.lines))
        for part in parts[1:]:
            if len(part.values) != len(parts[0].values):
                expected = (
                    f"{len(parts[0].values)} rows, as in {parts[0].file}: its rows belong to those of the log by number"
                )
                raise BadInput(Place(part.file), f"{len(part.values)} rows", expected, code="LOG011")
        where = {name: (part, k) for part in parts for k, name in enumerate(part.names)}
        values = np.column_stack([where[name][0].values[:, where[name][1]] for name in wanted])
        return Columns(parts[0].file, tuple(wanted), values, parts[0].lines)

    def _owner(self, column: str) -> str | None:
        """The name of the file beside the log that a column is from; None for the log's own."""
        if column in self.log.names:
            return None
        return next((name for name in self.others if column.startswith(f"{name}.")), None)

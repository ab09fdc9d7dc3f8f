"""Recognition of a log's columns as coordinates, velocities and inputs of a robot, by names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from codegen.base.user_text import shown
from codegen.logs.binding import time_columns
from codegen.logs.column_names import COMMANDED, is_in_counts, words_for, words_of
from codegen.logs.formats.series import TIME
from codegen.logs.formats.source import listing
from codegen.logs.term import identifier

OF_A_JOINT = {
    "position": words_for("position", "length", "angle"),
    "velocity": words_for("velocity"),
    "effort": words_for("effort", "force", "torque"),
    "current": words_for("current"),
}
"""What a robot's joint has → usual words of its columns."""


@dataclass(frozen=True)
class Guess:
    """Columns recognised by their names.

    Attributes:
        columns: symbol → column.
        remarks: on variables without a column, and on columns that were not taken.
    """

    columns: Mapping[str, str]
    remarks: tuple[str, ...]


def guess_columns(names: Sequence[str], joints: Mapping[str, str]) -> Guess:
    """Match columns by the joint's name and a word for position, velocity or effort.

    Of several columns, that of the topic with the most columns is taken.

    Args:
        names: of the log's columns.
        joints: coordinate → the joint's own name.
    """
    recognised = _recognised(names, joints)
    columns, remarks = _time_column(names)
    currents: dict[str, str] = {}
    for joint, label in joints.items():
        for quantity, symbol in (("position", joint), ("velocity", f"v_{joint}"), ("effort", f"w_{joint}")):
            found = recognised.columns_of(quantity, joint, symbol)
            if found:
                columns[symbol] = found[0]
                remarks += _of_equals(symbol, found[1:]) if recognised.is_doubtful(found) else []
            elif quantity == "effort" and (current := recognised.by_use.get(("current", joint))):
                currents[symbol] = current[0]
            else:
                remarks.append(f"{symbol}: no column of {quantity} with the name {shown(label)}")
    remarks += _of_currents(currents)
    remarks += _of_counts(columns)
    remarks += _of_commands(recognised.commanded, [f"w_{joint}" for joint in joints if f"w_{joint}" not in columns])
    return Guess(columns, tuple(remarks))


@dataclass(frozen=True)
class _Recognised:
    """What the names of a log's columns say.

    Attributes:
        names: of all columns.
        by_use: (quantity, joint) → columns, in the order of the file.
        commanded: columns of commands.
    """

    names: Sequence[str]
    by_use: Mapping[tuple[str, str], Sequence[str]]
    commanded: Sequence[str]

    @cached_property
    def size(self) -> Counter[str]:
        """Topic → number of recognised columns."""
        return Counter(_topic(name) for each in self.by_use.values() for name in each)

    def columns_of(self, quantity: str, joint: str, symbol: str) -> list[str]:
        """The columns of a quantity, those of the largest topic first; one that is called like the symbol alone."""
        found = [symbol] if symbol in self.names else self.by_use.get((quantity, joint), [])
        return sorted(found, key=lambda name: -self.size[_topic(name)])

    def is_doubtful(self, found: Sequence[str]) -> bool:
        """Whether the second of sorted columns is of as large a topic as the first."""
        return len(found) > 1 and self.size[_topic(found[0])] == self.size[_topic(found[1])]


def _recognised(names: Sequence[str], joints: Mapping[str, str]) -> _Recognised:
    """Columns by quantity and joint, and those of commands."""
    by_use: dict[tuple[str, str], list[str]] = {}
    commanded: list[str] = []
    for name in names:
        words = words_of(name)
        joint = _joint(words, joints)
        rest = {word for word in words if joint is None or word not in words_of(joints[joint])}
        if COMMANDED & rest:
            commanded.append(name)
        elif joint is not None:
            quantity = next((quantity for quantity, known in OF_A_JOINT.items() if known & rest), None)
            if quantity is not None:
                by_use.setdefault((quantity, joint), []).append(name)
    return _Recognised(names, by_use, commanded)


def _time_column(names: Sequence[str]) -> tuple[dict[str, str], list[str]]:
    """The column of the time, if it is not called ``TIME``; and a remark where there is none."""
    time = TIME if TIME in names else next(iter(time_columns(names)), None)
    if time is None:
        return {}, ["no column of time: `t: COLUMN`, or `sample_time` in meta.yaml beside the log"]
    return ({} if time == TIME else {TIME: time}), []


def _of_equals(symbol: str, others: Sequence[str]) -> list[str]:
    """A remark on columns that were not taken, of as large a topic as the one that was."""
    return [f"{symbol}: {listing([f'`{name}`' for name in others], 4)} would do as well"]


def _of_currents(currents: Mapping[str, str]) -> list[str]:
    """Remarks on inputs without a column of effort, but one of current; ``currents``: input → this column."""
    return [
        f"{symbol}: `{shown(name, 80)}` is a current; as `{identifier(name)}*K`, K the torque it makes"
        for symbol, name in currents.items()
    ]


def _of_counts(columns: Mapping[str, str]) -> list[str]:
    """Remarks on columns that hold encoder counts; ``columns``: symbol → column."""
    return [
        f"{symbol}: `{shown(name, 80)}` holds counts by its name: say their size here, such as "
        f"`scale: {{{symbol}: 2*pi/4096}}` for 4096 counts a turn"
        for symbol, name in columns.items()
        if symbol != TIME and is_in_counts(name)
    ]


def _of_commands(commanded: Sequence[str], without: Sequence[str]) -> list[str]:
    """Remarks on columns of commands; ``without``: the inputs without a column."""
    if not commanded:
        return []
    remarks = [f"{listing([f'`{shown(name, 60)}`' for name in commanded], 4)}: commanded, not measured; not taken"]
    if without:
        law = f"{without[0]}: 25*({identifier(commanded[0])} - POSITION)"
        remarks.append(f"a commanded position is no torque: the servo's own law makes one of it, such as `{law}`")
    return remarks


def _joint(words: Sequence[str], joints: Mapping[str, str]) -> str | None:
    """The joint whose name occurs in the words; of several, that with the longest name."""
    there = [joint for joint, label in joints.items() if _within(words_of(label), words)]
    return max(there, key=lambda joint: len(words_of(joints[joint])), default=None)


def _within(part: Sequence[str], words: Sequence[str]) -> bool:
    """Whether the words of ``part`` occur one after the other."""
    spots = range(len(words) - len(part) + 1)
    return bool(part) and any(list(words[k : k + len(part)]) == list(part) for k in spots)


def _topic(name: str) -> str:
    return name.partition(".")[0]

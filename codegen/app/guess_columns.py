"""Recognition of a log's columns as coordinates, velocities and inputs of a robot, by names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

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


class Guess(NamedTuple):
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
    by_use, commanded = _recognised(names, joints)
    topics = Counter(_topic(name) for each in by_use.values() for name in each)
    columns: dict[str, str] = {}
    remarks: list[str] = []
    time = TIME if TIME in names else next(iter(time_columns(names)), None)
    if time is None:
        remarks.append("no column of time: `t: COLUMN`, or `sample_time` in meta.yaml beside the log")
    elif time != TIME:
        columns[TIME] = time
    for joint, label in joints.items():
        for quantity, symbol in (("position", joint), ("velocity", f"v_{joint}"), ("effort", f"w_{joint}")):
            found = [symbol] if symbol in names else by_use.get((quantity, joint), [])
            if found:
                found = sorted(found, key=lambda name: -topics[_topic(name)])
                columns[symbol], *others = found
                if others and topics[_topic(found[0])] == topics[_topic(found[1])]:
                    remarks.append(f"{symbol}: {_quoted(others, 40)} would do as well")
            elif quantity == "effort" and (current := by_use.get(("current", joint))):
                as_torque = f"as `{identifier(current[0])}*K`, K the torque it makes"
                remarks.append(f"{symbol}: {_quoted(current[:1], 80)} is a current; {as_torque}")
            else:
                remarks.append(f"{symbol}: no column of {quantity} with the name {shown(label)}")
    remarks += [
        f"{symbol}: {_quoted([name], 80)} holds counts by its name: say their size here, such as "
        f"`scale: {{{symbol}: 2*pi/4096}}` for 4096 counts a turn"
        for symbol, name in columns.items()
        if symbol != TIME and is_in_counts(name)
    ]
    if commanded:
        without = [f"w_{joint}" for joint in joints if f"w_{joint}" not in columns]
        remarks += _of_commands(commanded, without)
    return Guess(columns, tuple(remarks))


def _recognised(
    names: Sequence[str], joints: Mapping[str, str]
) -> tuple[Mapping[tuple[str, str], Sequence[str]], Sequence[str]]:
    """Columns by (quantity, joint), in the order of the file, and the columns of commands."""
    by_use: dict[tuple[str, str], list[str]] = {}
    commanded: list[str] = []
    for name in names:
        words = words_of(name)
        joint = _joint(words, joints)
        rest = {word for word in words if joint is None or word not in words_of(joints[joint])}
        quantity = next((quantity for quantity, known in OF_A_JOINT.items() if known & rest), None)
        if COMMANDED & rest:
            commanded.append(name)
        elif joint is not None and quantity is not None:
            by_use.setdefault((quantity, joint), []).append(name)
    return by_use, commanded


def _of_commands(commanded: Sequence[str], without: Sequence[str]) -> Iterator[str]:
    """Remarks on columns of commands; ``without``: the inputs without a column."""
    yield f"{_quoted(commanded, 60)}: commanded, not measured; not taken"
    if without:
        law = f"{without[0]}: 25*({identifier(commanded[0])} - POSITION)"
        yield f"a commanded position is no torque: the servo's own law makes one of it, such as `{law}`"


def _quoted(names: Sequence[str], longest: int) -> str:
    """The first names, as messages quote them."""
    return listing([f"`{shown(name, longest)}`" for name in names], 4)


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

"""Recognition of the columns of a robot's log: positions, velocities and efforts of its joints, by their names."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from codegen.base.user_text import brief
from codegen.logs.binding import time_columns, time_in_two
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
"""Quantity of a joint → usual words in the names of its columns."""


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

    Of several columns, that of the topic with the most columns is taken. A quantity that no joint's name leads to is
    taken by number, in the order of the robot file, where the log has as many numbered columns of it as joints.

    Args:
        names: of the log's columns.
        joints: coordinate → the joint's own name.
    """
    by_use, commanded = _by_joint_name(names, joints)
    numbered = {
        quantity: series
        for quantity in OF_A_JOINT
        if not any((quantity, joint) in by_use for joint in joints)
        and (series := _numbered(names, quantity, len(joints)))
    }
    has_list = any(re.fullmatch(r"(.*\.)?name\[\d+\]", name) for name in names)  # of the joints' names
    if not has_list:  # else the order of the columns is that of the list, which may not be the robot file's
        by_number = {(q, joint): [name] for q in numbered for joint, name in zip(joints, numbered[q], strict=True)}
        by_use = {**by_use, **by_number}
    topics = Counter(_topic(name) for each in by_use.values() for name in each)
    columns, remarks = _time_column(names)
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
                remarks.append(f"{symbol}: no column of {quantity} with the name {brief(label)}")
    remarks += _remarks_on_counts(columns)
    remarks += _remarks_on_numbers(numbered, columns, has_list)
    remarks += _remarks_on_commands(commanded, [f"w_{joint}" for joint in joints if f"w_{joint}" not in columns])
    return Guess(columns, tuple(remarks))


def _time_column(names: Sequence[str]) -> tuple[dict[str, str], list[str]]:
    """The column of time, if it has another name than the spec's, and a remark if there is none."""
    time = TIME if TIME in names else next(iter([*time_columns(names), *time_in_two(names)]), None)
    if time is None:
        return {}, ["no column of time: `t: COLUMN`, or `sample_time` in meta.yaml beside the log"]
    return ({} if time == TIME else {TIME: time}), []


def _remarks_on_counts(columns: Mapping[str, str]) -> list[str]:
    """On columns whose names say that they hold counts of an encoder."""
    return [
        f"{symbol}: {_quoted([name], 80)} holds counts by its name: say their size here, such as "
        f"`scale: {{{symbol}: 2*pi/4096}}` for 4096 counts a turn"
        for symbol, name in columns.items()
        if symbol != TIME and is_in_counts(name)
    ]


def _remarks_on_numbers(numbered: Mapping[str, Sequence[str]], columns: Mapping[str, str], has_list: bool) -> list[str]:
    """On columns that differ in a number alone; ``has_list``: whether the log lists the names of its joints."""
    if has_list:
        return [
            f"{_quoted(series, 40)}: {quantity} by number; assign them in the order of the log's list of names"
            for quantity, series in numbered.items()
        ]
    used = [name for series in numbered.values() for name in series if name in columns.values()]
    if not used:
        return []
    return [f"{_quoted(used, 40)}: by number; see that the joints of the log are in the robot file's order"]


def _remarks_on_commands(commanded: Sequence[str], without: Sequence[str]) -> list[str]:
    """On columns of commands, which are not taken; ``without``: the inputs for which no column was found."""
    if not commanded:
        return []
    remarks = [f"{_quoted(commanded, 60)}: commanded, not measured; not taken"]
    if without:
        law = f"{without[0]}: 25*({identifier(commanded[0])} - POSITION)"
        remarks.append(f"a commanded position is no torque: compute one by the servo's control law, such as `{law}`")
    return remarks


def _by_joint_name(
    names: Sequence[str], joints: Mapping[str, str]
) -> tuple[Mapping[tuple[str, str], Sequence[str]], Sequence[str]]:
    """Columns by (quantity, joint), in the order of the file, and the columns of commands."""
    by_use: dict[tuple[str, str], list[str]] = {}
    commanded: list[str] = []
    for name in names:
        words = words_of(name)
        joint = _joint(words, joints)
        others = {word for word in words if joint is None or word not in words_of(joints[joint])}
        quantity = next((quantity for quantity, known in OF_A_JOINT.items() if known & others), None)
        if COMMANDED & others:
            commanded.append(name)
        elif joint is not None and quantity is not None:
            by_use.setdefault((quantity, joint), []).append(name)
    return by_use, commanded


def _numbered(names: Sequence[str], quantity: str, joints: int) -> list[str]:
    """Columns that differ in one number alone, from 0 or 1 up, as many as joints; [] for none or several such.

    A column is of the quantity if a word of its name is one for it, as in ``position[0]``, ``q1`` or ``tau_meas_1``.
    """
    series: dict[tuple[str, str], dict[int, str]] = {}
    for name in names:
        if digits := re.fullmatch(r"(.*?)(\d{1,3})(\D*)", name):
            before, number, after = digits.groups()
            words = set(words_of(f"{before}_{after}"))
            kind = next((kind for kind, known in OF_A_JOINT.items() if known & words), None)
            if kind == quantity and not COMMANDED & words:
                series.setdefault((before, after), {})[int(number)] = name
    complete = [each for each in series.values() if sorted(each) in (list(range(joints)), list(range(1, joints + 1)))]
    return [complete[0][k] for k in sorted(complete[0])] if len(complete) == 1 else []


def _quoted(names: Sequence[str], longest: int) -> str:
    """The first names, as messages quote them."""
    return listing([f"`{brief(name, longest)}`" for name in names], 4)


def _joint(words: Sequence[str], joints: Mapping[str, str]) -> str | None:
    """The joint whose name occurs in the words; of several, that with the longest name."""
    text = f" {' '.join(words)} "
    occurring = [
        joint for joint, label in joints.items() if words_of(label) and f" {' '.join(words_of(label))} " in text
    ]
    return max(occurring, key=lambda joint: len(words_of(joints[joint])), default=None)


def _topic(name: str) -> str:
    """The topic of a column of a bag, such as ``joint_states`` of ``joint_states.position[0]``."""
    return name.partition(".")[0]

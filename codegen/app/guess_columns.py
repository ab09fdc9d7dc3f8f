"""Recognition of a log's columns as coordinates, velocities and inputs of a robot, by names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from codegen.base.user_text import shown
from codegen.logs.binding import time_columns
from codegen.logs.column_names import COMMANDED, is_in_counts, words_of
from codegen.logs.formats.series import TIME
from codegen.logs.formats.source import listing
from codegen.logs.term import identifier

QUANTITIES: Mapping[str, frozenset[str]] = {
    "position": frozenset({"position", "positions", "pos", "q", "qpos", "angle", "theta", "x"}),
    "velocity": frozenset({"velocity", "velocities", "vel", "qd", "dq", "qvel", "speed", "v"}),
    "effort": frozenset({"effort", "efforts", "torque", "torques", "tau", "trq", "force", "w"}),
    "current": frozenset({"current", "currents", "amps", "iq", "cur"}),
}


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
    found: dict[str, list[str]] = {}
    commanded: list[str] = []
    for name in names:
        words = words_of(name)
        joint = _joint(words, joints)
        if joint is None:
            commanded += [name] * bool(COMMANDED & set(words))
            continue
        rest = [word for word in words if word not in words_of(joints[joint])]
        if COMMANDED & set(rest):
            commanded.append(name)
            continue
        for quantity, known in QUANTITIES.items():
            if known & set(rest):
                found.setdefault(f"{quantity} {joint}", []).append(name)
                break
    common = Counter(_topic(name) for each in found.values() for name in each)
    columns: dict[str, str] = {}
    remarks: list[str] = []
    time = TIME if TIME in names else next(iter(time_columns(names)), None)
    if time is None:
        remarks.append("no column of time: `t: COLUMN`, or `sample_time` in meta.yaml beside the log")
    elif time != TIME:
        columns[TIME] = time
    currents = []
    for joint in joints:
        for quantity, symbol in (("position", joint), ("velocity", f"v_{joint}"), ("effort", f"w_{joint}")):
            there = [symbol] if symbol in names else found.get(f"{quantity} {joint}", [])
            best = sorted(there, key=lambda name: (-common[_topic(name)], there.index(name)))
            if best:
                columns[symbol] = best[0]
            if len(best) > 1 and common[_topic(best[0])] == common[_topic(best[1])]:
                remarks.append(f"{symbol}: {listing([f'`{name}`' for name in best[1:]], 4)} would do as well")
            if not best:
                current = found.get(f"current {joint}", [])
                currents += [(symbol, name) for name in current[:1] if quantity == "effort"]
                if not (current and quantity == "effort"):
                    remarks.append(f"{symbol}: no column of {quantity} with the name {shown(joints[joint])}")
    for symbol, name in currents:
        remarks.append(f"{symbol}: `{shown(name, 80)}` is a current; as `{identifier(name)}*K`, K the torque it makes")
    for symbol, name in columns.items():
        if symbol != TIME and is_in_counts(name):
            line = f"`scale: {{{symbol}: 2*pi/4096}}` for 4096 counts a turn"
            remarks.append(
                f"{symbol}: `{shown(name, 80)}` holds counts by its name: say their size here, such as {line}"
            )
    remarks += _of_commands(commanded, [f"w_{joint}" for joint in joints if f"w_{joint}" not in columns])
    return Guess(columns, tuple(remarks))


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

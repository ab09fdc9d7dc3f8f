"""The numeric fields of a decoded ROS 2 message, each by its path: ``effort[shoulder]``, ``header.stamp.sec``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

LONGEST = 256
"""Entries of a list beyond which it is a picture or a cloud, and no signal."""


def numeric_fields(message: Any, path: str) -> Iterator[tuple[str, float]]:
    """(path, value) of each number.

    An entry of a list goes by its name, where a list of as many names stands beside the list or around it (``name``,
    ``joint_names`` …), else by its number counted from 0.

    Args:
        message: with its fields in ``__slots__``.
        path: of the message itself, such as a topic.
    """
    yield from _fields(message, path, [])


def header_stamp(message: Any) -> int | None:
    """The stamp of a message with a header, in ns; None for one without."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    if stamp is None or not hasattr(stamp, "sec") or not hasattr(stamp, "nanosec"):
        return None
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def _fields(message: Any, path: str, outer: list[list[str]]) -> Iterator[tuple[str, float]]:
    slots = message.__slots__
    labels = [
        value for slot in slots if slot.endswith(("name", "names")) and _are_names(value := getattr(message, slot))
    ]
    for slot in slots:
        if slot == "header" and header_stamp(message) is not None:
            continue  # the time of the others
        yield from _values(getattr(message, slot), f"{path}.{slot}", labels + outer)


def _values(value: Any, path: str, labels: list[list[str]]) -> Iterator[tuple[str, float]]:
    if isinstance(value, (bool, int, float)):
        yield path, float(value)
    elif isinstance(value, (list, bytes)):
        if not 0 < len(value) <= LONGEST:
            return
        named = next((names for names in labels if len(names) == len(value)), None)
        for k, entry in enumerate(value):
            yield from _values(entry, f"{path}[{named[k] if named else k}]", labels)
    elif hasattr(value, "__slots__"):
        yield from _fields(value, path, labels)


def _are_names(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], str) and len(set(value)) == len(value)

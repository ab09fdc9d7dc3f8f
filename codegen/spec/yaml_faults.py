"""Faults of YAML syntax in a user's terms: what stood there, and what to write in its place.

A parser reports where it could not go on, in terms of its own, and mostly that is behind the slip of writing that
caused it. ``yaml_slips.yaml`` and the functions below find such slips from the parser's message and the lines there.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError

from codegen.base.errors import BadInput, Place


class Fault(NamedTuple):
    """A line, counted from 0, what was found there, and what was expected."""

    line: int
    found: str
    expected: str


class Reported(NamedTuple):
    """What the parser reports: its message, the line and column where it stopped, and the text's lines.

    Attributes:
        begun: the line at which the construct begins that could not be read; None where the parser does not say.
    """

    problem: str
    lines: Sequence[str]
    line: int
    column: int
    begun: int | None

    @property
    def at(self) -> str:
        """The line where the parser stopped."""
        return self.lines[self.line] if self.line < len(self.lines) else ""

    @property
    def above(self) -> int | None:
        """The nearest line above that is neither empty nor a comment, if it is indented like the line at the mark."""
        before = range(min(self.line, len(self.lines)) - 1, -1, -1)
        line = next((k for k in before if self.lines[k].strip() and not self.lines[k].lstrip().startswith("#")), None)
        return line if line is not None and _indent(self.lines[line]) == _indent(self.at) else None


class Slip(NamedTuple):
    """A slip of writing that a line shows; attributes as ``yaml_slips.yaml`` says."""

    problems: Sequence[str]
    where: Literal["at", "above", "begun"]
    line: str
    found: str
    expected: str


@cache
def _table() -> Any:
    """The content of ``yaml_slips.yaml``."""
    return YAML(typ="safe").load(Path(__file__).with_name("yaml_slips.yaml"))


def refused(error: MarkedYAMLError, file: str, text: str) -> BadInput:
    """The BadInput for an error of the YAML parser, at the line of the fault."""
    problem, mark, begun = " ".join((error.problem or "malformed YAML").split()), error.problem_mark, error.context_mark
    if mark:
        reported = Reported(problem, text.splitlines(), mark.line, mark.column, begun.line if begun else None)
        for rule in RULES:
            if fault := rule(reported):
                return BadInput(Place(file, fault.line + 1), fault.found, fault.expected, code="SPEC001")
    found, expected, where_it_begins = problem, "YAML 1.2", False
    for start, plain in _table()["otherwise"].items():
        if problem.startswith(start):
            found, expected, where_it_begins = plain
    place = next((m for m in ((begun, mark) if where_it_begins else (mark, begun)) if m), None)
    return BadInput(Place(file, place.line + 1 if place else None), found, expected, code="SPEC001")


def _slip(r: Reported) -> Fault | None:
    """The first slip of the table that a line shows."""
    lines = {"at": r.line, "above": r.above, "begun": r.begun}
    for slip in (Slip(**row) for row in _table()["slips"]):
        line = lines[slip.where]
        if line is None or line >= len(r.lines) or not r.problem.startswith(tuple(slip.problems)):
            continue
        if match := re.fullmatch(slip.line, r.lines[line]):
            words = [group.strip() for group in match.groups()]
            return Fault(line, slip.found.format(*words), slip.expected.format(*words))
    return None


def _foreign_space(r: Reported) -> Fault | None:
    """A line that is indented with a space which YAML takes for a letter.

    Pages of the web and word processors write no-break spaces.
    """
    for k in range(min(r.line, len(r.lines) - 1), -1, -1):
        if indent := _INDENTATION.match(r.lines[k]):
            found = f"the space U+{ord(indent[1]):04X} in the indentation"
            return Fault(k, found, "plain spaces (U+0020) for indentation")
    return None


_INDENTATION = re.compile(r" *([^\S \t\r\n])")


def _dedented(r: Reported) -> Fault | None:
    """The first key of a mapping, if it alone is indented less than the two or more keys below it.

    YAML takes the key below it for one that is indented too far, as it is where a later key is indented like the first.
    """
    lines = [(k, line) for k, line in enumerate(r.lines) if line.strip() and not line.lstrip().startswith("#")]
    before = [(k, line) for k, line in lines if k < r.line][-2:]
    found = _ENTRY.match(before[1][1]) if len(before) == 2 else None
    if found is None or not _indent(before[0][1]) < _indent(before[1][1]) < _indent(r.at):
        return None
    below = [_indent(line) for k, line in lines if k > r.line]
    shallower = next((i for i in below if i < _indent(r.at)), 0)
    if shallower == _indent(before[1][1]) or below[:1] != [_indent(r.at)]:
        return None
    words = f"`{found[1]}:` indented less than the keys below it"
    return Fault(before[1][0], words, "one indentation for all keys of a mapping")


_ENTRY = re.compile(r"\s*(\w+):\s+[^\s#]")


def _behind_a_closed_value(r: Reported) -> Fault | None:
    """Text behind a closing bracket or quote, ``[1, 2]]`` or ``'it's'``, where the line must end."""
    before, rest = r.at[: r.column].rstrip(), r.at[r.column :].strip()
    if not r.problem.startswith("expected <block end>") or not rest or not before or before[-1] not in "]}\"'":
        return None
    expected = "as many opening as closing brackets"
    if before[-1] in "\"'":
        expected = "one pair of quotes around the whole text, of the kind that is not in it"
    return Fault(r.line, f"`{rest}` behind the closing `{before[-1]}`", expected)


def _bracket_in_value(r: Reported) -> Fault | None:
    """A bracket in an unquoted value within brackets, ``{q: axes[0].pos}``, before which YAML ends the value."""
    bracket = r.at[r.column : r.column + 1]
    if bracket not in ("[", "{"):
        return None
    for value in _WITH_BRACKETS.finditer(r.at):
        if value.start("value") < r.column < value.end():
            key, word = value["key"], value["value"].strip()
            quoted = f'`{key}: "{word}"`' if key else f'`"{word}"`'
            found = f"`{word}` with `{bracket}` inside brackets, without quotes"
            return Fault(r.line, found, f"quotes around it: {quoted}")
    return None


_WITH_BRACKETS = re.compile(
    r"(?:(?P<key>\w+)\s*:\s+)?(?P<value>[^\s,{}\[\]:\"'][^,{}\[\]:]*(?:\[[^,{}\[\]]*\][^,{}\[\]:]*|\{[^,{}\[\]]*\}[^,{}\[\]:]*)+)"
)


def _reserved_beginning(r: Reported) -> Fault | None:
    """A text that begins with ``@``, ``%`` or a backquote, which YAML reserves, or with ``*`` as an alias does."""
    alias = r.problem.startswith(("sequence entries are not allowed", "found undefined alias", "expected alphabetic"))
    start = _WORD.match(r.at, r.column) if "that cannot start any token" in r.problem else None
    found = _ALIAS.search(r.at) if alias else start
    if found is None:
        return None
    word = found[1].rstrip()
    quoted = f'"{word}"'.replace("`", "'")  # a backquote cannot be quoted between backquotes
    shown = "a backquote" if word[0] == "`" else f"`{word}`"
    meaning = "which is an alias in YAML" if alias else "with which no text may begin in YAML"
    return Fault(r.line, f"{shown}, {meaning}", f"quotes around a text that begins so: `{quoted}`")


_ALIAS, _WORD = re.compile(r"(?:^|[-:,\[{]\s+|[\[{])(\*[^,{}\[\]#]*)"), re.compile(r"([^\s,{}\[\]#][^,{}\[\]#]*)")


def _indent(line: str) -> int:
    """The number of blanks before a line's text."""
    return len(line) - len(line.lstrip())


RULES: tuple[Callable[[Reported], Fault | None], ...] = (
    _foreign_space,
    _slip,
    _dedented,
    _behind_a_closed_value,
    _bracket_in_value,
    _reserved_beginning,
)
"""In order: a later rule may assume that the slips of the earlier ones are not there."""

"""Faults of YAML syntax in a user's terms: what stood there, and what to write in its place.

A parser reports where it could not go on, in terms of its own, and mostly that is behind the slip of writing that
caused it. ``yaml_slips.yaml`` and the functions below find such slips from the parser's message and the lines there.
"""

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError

from codegen.base.errors import BadInput, Place

LONGEST = 2000
"""Characters of a line in which a slip is sought, since some patterns take their square."""


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
    where: Literal["at", "above", "begun", "mark"]
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
        if fault := _foreign_space(reported) or _slip(reported):
            return BadInput(Place(file, fault.line + 1), fault.found, fault.expected, code="SPEC001")
    found, expected, where_it_begins = problem, "YAML 1.2", False
    for start, plain in _table()["otherwise"].items():
        if problem.startswith(start):
            found, expected, where_it_begins = plain
    place = next((m for m in ((begun, mark) if where_it_begins else (mark, begun)) if m), None)
    return BadInput(Place(file, place.line + 1 if place else None), found, expected, code="SPEC001")


def _slip(r: Reported) -> Fault | None:
    """The first slip of the table that a line shows."""
    lines = {"at": r.line, "above": r.above, "begun": r.begun, "mark": r.line}
    for slip in (Slip(**row) for row in _table()["slips"]):
        line = lines[slip.where]
        if line is None or line >= len(r.lines) or len(r.lines[line]) > LONGEST:
            continue
        if not r.problem.startswith(tuple(slip.problems)):
            continue
        text = f"{r.at[: r.column]}\0{r.at[r.column :]}" if slip.where == "mark" else r.lines[line]
        if match := re.fullmatch(slip.line, text):
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


def _indent(line: str) -> int:
    """The number of blanks before a line's text."""
    return len(line) - len(line.lstrip())

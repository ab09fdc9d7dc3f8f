"""Faults of YAML syntax in a user's terms: what stood there, and what to write in its place.

A parser reports where it could not go on, in terms of its own, and mostly that is behind the slip of writing that
caused it. Each rule below finds one such slip from the parser's message and the lines at its mark.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

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
        """The nearest line above that is neither empty nor a comment."""
        before = range(min(self.line, len(self.lines)) - 1, -1, -1)
        return next((k for k in before if self.lines[k].strip() and not self.lines[k].lstrip().startswith("#")), None)


COLON, NO_COLON, NO_END = "mapping values are not allowed", "could not find expected ':'", "expected <block end>"
NO_TOKEN, NO_ENTRY = "that cannot start any token", "sequence entries are not allowed"
PLAIN = {
    NO_COLON: ("a key without `:`", "`key: value`", True),
    NO_END: ("indented unlike the lines above", "one indentation for all keys of a mapping", False),
    "expected ',' or '}'": ("`{` that is not closed", "`}`", True),
    "expected ',' or ']'": ("`[` that is not closed", "`]`", True),
    "expected the node content, but found ']'": ("`]` without a `[` before it", "a value", False),
    "expected the node content, but found '}'": ("`}` without a `{` before it", "a value", False),
    "found unexpected end of stream": ("a quote that is not closed", "the same quote at its end", True),
    "found unknown escape character": ("a backslash in double quotes", "single quotes around such a text", False),
    "expected a comment or a line break": ("text behind `|` or `>`", "quotes around text that begins so", False),
    "but found another document": ("a second document, behind `---`", "one document in a file", False),
    "expected '<document start>'": ("less indented than the first key", "one indentation for all keys", False),
    "found character '\\t'": ("a tab", "spaces for indentation", False),
    COLON: (
        "a `:` in a value, or a key that is indented too far",
        'quotes around a value that holds `: `, as in "a: b"',
        False,
    ),
}
"""Beginning of the parser's message → what was found, what was expected, and whether the fault is reported at the
beginning of the construct, else where the parser noticed it. For what no rule finds."""


def refused(error: MarkedYAMLError, file: str, text: str) -> BadInput:
    """The BadInput for an error of the YAML parser, at the line of the fault."""
    problem, mark, begun = " ".join((error.problem or "malformed YAML").split()), error.problem_mark, error.context_mark
    if mark:
        reported = Reported(problem, text.splitlines(), mark.line, mark.column, begun.line if begun else None)
        for rule in RULES:
            if fault := rule(reported):
                return BadInput(Place(file, fault.line + 1), fault.found, fault.expected, code="SPEC001")
    found, expected, where_it_begins = problem, "YAML 1.2", False
    for start, plain in PLAIN.items():
        if problem.startswith(start):
            found, expected, where_it_begins = plain
    place = next((m for m in ((begun, mark) if where_it_begins else (mark, begun)) if m), None)
    return BadInput(Place(file, place.line + 1 if place else None), found, expected, code="SPEC001")


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


def _key_without_colon(r: Reported) -> Fault | None:
    """A key without a colon, as ``kind gcfo``, ``kind:gcfo`` or ``kind = gcfo``.

    Words without a colon are a text that continues on the next lines, so that the key below them is read as the last
    word of this text, and the parser stops at its colon. A word before ``{`` has the same consequence on one line.
    """
    if not r.problem.startswith((COLON, NO_END)):
        return None
    if found := _BARE_MAPPING.fullmatch(r.at):
        return Fault(r.line, f"the key `{found[1]}` without `:`", f"`{found[1]}: {found[2].strip()}`")
    if r.above is None or _indent(r.lines[r.above]) != _indent(r.at):
        return None
    line = r.lines[r.above]
    if found := _NO_BLANK.fullmatch(line):
        key, value = found[1], found[2].strip()
        return Fault(r.above, f"`{key}:{value}` without a blank behind the colon", f"`{key}: {value}`")
    if found := _BARE_KEY.fullmatch(line):
        return Fault(r.above, f"the key `{found[1]}` without `:`", f"`{found[1]}: {found[2].strip()}`")
    return None


_BARE_KEY = re.compile(r"\s*(\w+)(?:\s+|\s*=\s*)([^\s:#=][^:#]*)(#.*)?")
_BARE_MAPPING = re.compile(r"\s*(\w+)\s+([{\[].*)")
_NO_BLANK = re.compile(r"\s*(\w+):([^\s:#{\[][^:#]*)(#.*)?")


def _line_without_colon(r: Reported) -> Fault | None:
    """A line of another kind among keys, such as the marks of a version control system in a file with conflicts."""
    line = r.above if r.problem.startswith(COLON) else r.begun if r.problem.startswith(NO_COLON) else None
    if line is None or line >= len(r.lines) or ":" in r.lines[line]:
        return None
    return Fault(line, f"`{r.lines[line].strip()}`, a line without `: `", "`key: value`")


def _no_blank_before_bracket(r: Reported) -> Fault | None:
    """``phi:{velocity: om, …``, whose key YAML takes to be ``phi:{velocity``."""
    if not r.problem.startswith(COLON) or not (key := _BRACKET_AT_COLON.fullmatch(r.at)):
        return None
    return Fault(r.line, f"`{key[1]}:{key[2][0]}` without a blank behind the colon", f"`{key[1]}: {key[2].rstrip()}`")


_BRACKET_AT_COLON = re.compile(r"\s*(?:-\s+)?(\w+):([{\[].*)")


def _entries_without_braces(r: Reported) -> Fault | None:
    """``phi: velocity: om, unit: rad``: a mapping without braces, or a text without quotes."""
    if not r.problem.startswith(COLON) or not (bare := _BARE_ENTRIES.fullmatch(r.at)):
        return None
    key, entries = bare["key"], bare["entries"]
    braces, quotes = f"`{key}: {{{entries}}}`", f'`{key}: "{entries}"`'
    expected = f"braces around entries, {braces}; or quotes around text, {quotes}"
    return Fault(r.line, f"`{entries}` behind `{key}:` on its line", expected)


_BARE_ENTRIES = re.compile(r"\s*(?:-\s+)?(?P<key>\w+):\s+(?P<entries>\w+:\s[^#{}\[\]\"']*?)\s*(?:#.*)?")


def _indented_too_far(r: Reported) -> Fault | None:
    """A key that is indented further than a key with a value above it, and so is read as a part of that value."""
    if not r.problem.startswith(COLON) or r.above is None:
        return None
    key, above = _KEY.match(r.at), _KEY_AND_VALUE.match(r.lines[r.above])
    if not key or not above or _indent(r.at) <= _indent(r.lines[r.above]):
        return None
    found = f"`{key[1]}:` indented further than `{above[1]}:` above, which has a value"
    return Fault(r.line, found, f"the same indentation, or entries below `{above[1]}:` in place of its value")


_KEY, _KEY_AND_VALUE = re.compile(r"\s*(\w+):(?:\s|$)"), re.compile(r"\s*(\w+):\s+[^\s#]")


def _dash_without_blank(r: Reported) -> Fault | None:
    """An entry of a list whose dash has no blank behind it, so that it is a part of the text above."""
    dashed = _DASH.fullmatch(r.lines[r.begun]) if r.begun is not None and r.begun < len(r.lines) else None
    if r.begun is None or not dashed:
        return None
    return Fault(r.begun, f"`-{dashed[1]}` without a blank behind the dash", f"`- {dashed[1]}`")


_DASH = re.compile(r"\s*-([^\s-][^:#]*?)\s*(?:#.*)?")


def _no_comma(r: Reported) -> Fault | None:
    """``{velocity: om unit: rad}``, at whose second colon the parser stops."""
    pair = _PAIR_WITHOUT_COMMA.search(r.at[: r.column])
    before = "\n".join([*r.lines[: r.line], r.at[: r.column]])
    outside = before.count("{") <= before.count("}")  # a text that holds a colon
    if r.at[r.column : r.column + 1] != ":" or pair is None or outside:
        return None
    entry = pair[1].rstrip("; ")
    return Fault(r.line, f"no comma between `{entry}` and `{pair[2]}:`", f"`{entry}, {pair[2]}: …`")


_PAIR_WITHOUT_COMMA = re.compile(r"(?:^|[{,])\s*(\w+:\s[^{}\[\],:]*[^{}\[\],:\s])\s+(\w+)$")


def _closed_too_early(r: Reported) -> Fault | None:
    """Entries of a mapping behind its closing brace, ``{name: drum}, law: a``."""
    ended = _ENDED_MAPPING.match(r.at)
    if not r.problem.startswith(NO_END) or ended is None or r.column != ended.end("inside") + 1:
        return None
    inside, rest = ended["inside"].strip(), ended["rest"].rstrip(" }")
    found = f"`{{{inside}}}` closed before `, {rest}`"
    return Fault(r.line, found, f"one pair of braces around all entries: `{{{inside}, {rest}}}`")


_ENDED_MAPPING = re.compile(r"\s*(?:-\s+)?(?:\w+:\s+)?\{(?P<inside>[^{}]*)\},\s*(?P<rest>\w+:\s[^#]*)")


def _behind_a_closed_value(r: Reported) -> Fault | None:
    """Text behind a closing bracket or quote, ``[1, 2]]`` or ``'it's'``, where the line must end."""
    before, rest = r.at[: r.column].rstrip(), r.at[r.column :].strip()
    if not r.problem.startswith(NO_END) or not rest or not before or before[-1] not in "]}\"'":
        return None
    expected = "as many opening as closing brackets"
    if before[-1] in "\"'":
        expected = "one pair of quotes around the whole text, of the kind that is not in it"
    return Fault(r.line, f"`{rest}` behind the closing `{before[-1]}`", expected)


def _list_and_keys(r: Reported) -> Fault | None:
    """An entry of a list, ``- a``, among keys of the same indentation, or a key among such entries."""
    if not r.problem.startswith(NO_END) or r.begun is None or r.begun >= len(r.lines):
        return None
    both = r.at, r.lines[r.begun]
    dash = next((line for line in both if line.lstrip().startswith("- ")), None)
    key = next((line for line in both if _KEY.match(line)), None)
    if dash is None or key is None or _indent(dash) != _indent(key):
        return None
    return Fault(
        r.line, f"`{r.at.strip()}` beside `{r.lines[r.begun].strip()}`", "only keys, or only entries of a list"
    )


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
    alias = r.problem.startswith((NO_ENTRY, "found undefined alias", "expected alphabetic"))
    found = _ALIAS.search(r.at) if alias else _WORD.match(r.at, r.column) if NO_TOKEN in r.problem else None
    if found is None:
        return None
    word = found[1].rstrip()
    quoted = f'"{word}"'.replace("`", "'")  # a backquote cannot be quoted between backquotes
    shown = "a backquote" if word[0] == "`" else f"`{word}`"
    meaning = "which is an alias in YAML" if alias else "with which no text may begin in YAML"
    return Fault(r.line, f"{shown}, {meaning}", f"quotes around a text that begins so: `{quoted}`")


_ALIAS, _WORD = re.compile(r"(?:^|[-:,\[{]\s+|[\[{])(\*[^,{}\[\]#]*)"), re.compile(r"([^\s,{}\[\]#][^,{}\[\]#]*)")


def _list_behind_key(r: Reported) -> Fault | None:
    """``force: - u``: an entry of a list on the line of its key."""
    entry = _ENTRY_BEHIND_KEY.fullmatch(r.at)
    if not r.problem.startswith(NO_ENTRY) or entry is None:
        return None
    key, value = entry[1], entry[2].rstrip()
    return Fault(r.line, f"`- {value}` on the line of `{key}:`", f"`- {value}` on the next line, or `{key}: [{value}]`")


_ENTRY_BEHIND_KEY = re.compile(r"\s*(?:-\s+)?(\w+):\s+-\s+([^#]*)(?:#.*)?")


def _indent(line: str) -> int:
    """The number of blanks before a line's text."""
    return len(line) - len(line.lstrip())


RULES: tuple[Callable[[Reported], Fault | None], ...] = (
    _foreign_space,
    _key_without_colon,
    _no_blank_before_bracket,
    _entries_without_braces,
    _dash_without_blank,
    _no_comma,
    _indented_too_far,
    _line_without_colon,
    _closed_too_early,
    _list_and_keys,
    _behind_a_closed_value,
    _bracket_in_value,
    _list_behind_key,
    _reserved_beginning,
)
"""In order: a later rule may assume that the slips of the earlier ones are not there."""

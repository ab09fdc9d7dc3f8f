"""YAML 1.2 by ruamel.yaml: loading with the places of keys, and writing that keeps the author's comments."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from difflib import SequenceMatcher
from functools import lru_cache, partial
from io import StringIO
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.constructor import RoundTripConstructor
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.parser import RoundTripParser
from ruamel.yaml.reader import ReaderError

from codegen.base.errors import BadInput, Place
from codegen.spec.decimal_comma import DECIMAL_COMMA, comma_at_joint, with_point
from codegen.spec.ranges import MARK, expanded
from codegen.spec.yaml_limits import Limits

SPEC_FIRST = "; is this the log? A command takes the spec first, then the log"
UNEXPECTED_COLON, NO_END = "mapping values are not allowed", "expected <block end>"
FAULTS = {
    "could not find expected ':'": ("a key without `:`", "`key: value`", True),
    NO_END: ("indented unlike the lines above", "one indentation for all keys of a mapping", False),
    "expected ',' or '}'": ("`{` that is not closed", "`}`", True),
    "expected ',' or ']'": ("`[` that is not closed", "`]`", True),
    "found unexpected end of stream": ("a quote that is not closed", "the same quote at its end", True),
    "but found another document": ("a second document, behind `---`", "one document in a file", False),
    "found character '\\t'": ("a tab", "spaces for indentation", False),
    UNEXPECTED_COLON: (
        "a `:` in a value, or a key that is indented too far",
        'quotes around a value that holds `: `, as in "a: b"',
        False,
    ),
}
"""Beginning of the parser's message → what was found, what was expected, and whether the fault is reported at the
beginning of the construct, else where the parser noticed it."""


class _Constructor(RoundTripConstructor):
    """ruamel.yaml's constructor, with dates as text, as in the core schema of YAML 1.2."""


_Constructor.add_constructor("tag:yaml.org,2002:timestamp", _Constructor.construct_scalar)


class _Parser(RoundTripParser):
    """ruamel.yaml's parser, with every event checked by ``Limits``."""

    def __init__(self, loader: Any, limits: Limits) -> None:
        super().__init__(loader)
        self._limits = limits

    def peek_event(self) -> Any:
        if self.current_event is None and self.state:
            self.current_event = self.state()
            self._limits.check(self.current_event)
        return self.current_event

    def check_event(self, *choices: Any) -> bool:
        event = self.peek_event()
        return isinstance(event, choices) if choices else event is not None

    def get_event(self) -> Any:
        self.peek_event()
        return super().get_event()


def round_trip_yaml() -> YAML:
    """A YAML loader and dumper that keeps comments, quotes and order, and creates no Python objects from tags."""
    yaml = YAML(typ="rt")
    yaml.Constructor = _Constructor
    yaml.width = 110
    yaml.preserve_quotes = True
    yaml.indent(mapping=2, sequence=4, offset=2)
    return yaml


def load_mapping(text: str, file: str, example: str = "name: one_mass") -> tuple[CommentedMap, dict[str, Place]]:
    """A YAML mapping from its text.

    Args:
        example: of an entry, for the message on a text that is no mapping.

    Returns:
        The round-trip document, and key → place, with keys such as ``friction.contacts[0].law``.

    Raises:
        BadInput: for YAML that cannot be read or is not a mapping.
    """
    yaml, limits = round_trip_yaml(), Limits(file)
    yaml.Parser = partial(_Parser, limits=limits)
    try:
        document = yaml.load(text)
    except MarkedYAMLError as error:
        raise _refused(error, file, text) from None
    except ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        words = f"the control character U+{error.character:04X}"
        raise BadInput(Place(file, line), words, "YAML 1.2", code="SPEC001") from None
    except (YAMLError, ValueError, TypeError, AttributeError, LookupError, ArithmeticError, AssertionError) as error:
        words = f"malformed YAML ({' '.join(str(error).split())[:120]})"
        raise BadInput(Place(file, limits.line), words, "YAML 1.2", code="SPEC001") from None
    if not isinstance(document, CommentedMap):
        found = "nothing" if document is None else "a list" if isinstance(document, CommentedSeq) else "plain text"
        expected = f"a mapping such as `{example}`"
        if found == "plain text" and not file.lower().endswith((".yaml", ".yml")):
            expected += SPEC_FIRST
        raise BadInput(Place(file, 1), found, expected, code="SPEC006")
    places: dict[str, Place] = {}
    if MARK in text:
        document = expanded(document, file)
    _collect(document, "", file, places, text.splitlines())
    return document, places


@lru_cache(maxsize=64)
def load_plain(text: str, file: str, example: str = "name: one_mass") -> tuple[Any, Mapping[str, Place]]:
    """As ``load_mapping``, with the document as ``plain``, which must not be changed; cached, since parsing is slow."""
    document, places = load_mapping(text, file, example)
    return plain(document), places


def _refused(error: MarkedYAMLError, file: str, text: str) -> BadInput:
    """The BadInput for an error of the YAML parser, in the user's terms, at the line of the fault."""
    problem = " ".join((error.problem or "malformed YAML").split())
    if error.problem_mark and (line := _foreign_space(text.splitlines(), error.problem_mark.line)) is not None:
        indent = _INDENTATION.match(text.splitlines()[line])
        assert indent is not None
        found = f"the space U+{ord(indent[1]):04X} in the indentation"
        return BadInput(Place(file, line + 1), found, "plain spaces (U+0020) for indentation", code="SPEC001")
    if problem.startswith((UNEXPECTED_COLON, NO_END)) and error.problem_mark:
        bare = _key_without_colon(text.splitlines(), error.problem_mark.line)
        if bare is not None:
            line, key, value = bare
            return BadInput(Place(file, line + 1), f"the key `{key}` without `:`", f"`{key}: {value}`", code="SPEC001")
    if problem.startswith(UNEXPECTED_COLON) and error.problem_mark:
        line = text.splitlines()[error.problem_mark.line]
        if unlike := _no_blank_before_bracket(line) or _entries_without_braces(line):
            return BadInput(Place(file, error.problem_mark.line + 1), *unlike, code="SPEC001")
    begun = text.splitlines()[error.context_mark.line :][:1] if error.context_mark else []
    if begun and (dashed := _DASH.fullmatch(begun[0])):
        words = f"`-{dashed[1]}` without a blank behind the dash", f"`- {dashed[1]}`"
        return BadInput(Place(file, error.context_mark.line + 1), *words, code="SPEC001")
    if error.problem_mark and (apart := _no_comma(text.splitlines(), error.problem_mark)):
        return BadInput(Place(file, error.problem_mark.line + 1), *apart, code="SPEC001")
    if problem.startswith(NO_END) and error.problem_mark and (shut := _closed_too_early(text, error.problem_mark)):
        return BadInput(Place(file, error.problem_mark.line + 1), *shut, code="SPEC001")
    if error.problem_mark and (bracket := _bracket_in_value(text.splitlines(), error.problem_mark)):
        return BadInput(Place(file, error.problem_mark.line + 1), *bracket, code="SPEC001")
    found, expected, where_it_begins = problem, "YAML 1.2", False
    for start, plain in FAULTS.items():
        if problem.startswith(start):
            found, expected, where_it_begins = plain
    marks = (error.context_mark, error.problem_mark)
    mark = next((m for m in (marks if where_it_begins else marks[::-1]) if m), None)
    return BadInput(Place(file, mark.line + 1 if mark else None), found, expected, code="SPEC001")


def _foreign_space(lines: Sequence[str], at: int) -> int | None:
    """The last line up to ``at`` that is indented with a space which YAML takes for a letter; None for none.

    Pages of the web and word processors write no-break spaces.
    """
    return next((k for k in range(min(at, len(lines) - 1), -1, -1) if _INDENTATION.match(lines[k])), None)


_DASH = re.compile(r"\s*-([^\s-][^:#]*?)\s*(?:#.*)?")
"""An entry of a list whose dash has no blank behind it, so that it is a part of the text above."""
_INDENTATION = re.compile(r" *([^\S \t\r\n])")

_BARE_KEY = re.compile(r"\s*(\w+)\s+([^\s:#][^:#]*)(#.*)?")
_BARE_MAPPING = re.compile(r"\s*(\w+)\s+([{\[].*)")


_WITH_BRACKETS = re.compile(
    r"(?:(?P<key>\w+)\s*:\s+)?(?P<value>[^\s,{}\[\]:\"'][^,{}\[\]:]*(?:\[[^,{}\[\]]*\][^,{}\[\]:]*|\{[^,{}\[\]]*\}[^,{}\[\]:]*)+)"
)


def _bracket_in_value(lines: Sequence[str], mark: Any) -> tuple[str, str] | None:
    """(found, expected) for a bracket in an unquoted value within brackets, ``{q: axes[0].pos}``; None otherwise.

    Within brackets an unquoted value ends before a bracket, so the parser expects a comma there.
    """
    line = lines[mark.line] if mark.line < len(lines) else ""
    bracket = line[mark.column : mark.column + 1]
    if bracket not in ("[", "{"):
        return None
    for value in _WITH_BRACKETS.finditer(line):
        if value.start("value") < mark.column < value.end():
            key, word = value["key"], value["value"].strip()
            quoted = f'`{key}: "{word}"`' if key else f'`"{word}"`'
            return f"`{word}` with `{bracket}` inside brackets, without quotes", f"quotes around it: {quoted}"
    return None


def _closed_too_early(text: str, mark: Any) -> tuple[str, str] | None:
    """(found, expected) for entries of a mapping behind its closing brace, ``{name: drum}, law: a``; None otherwise."""
    line = text.splitlines()[mark.line]
    ended = _ENDED_MAPPING.match(line)
    if ended is None or mark.column != ended.end("inside") + 1:
        return None
    inside, rest = ended["inside"].strip(), ended["rest"].rstrip(" }")
    found = f"`{{{inside}}}` closed before `, {rest}`"
    return found, f"one pair of braces around all entries: `{{{inside}, {rest}}}`"


_ENDED_MAPPING = re.compile(r"\s*(?:-\s+)?(?:\w+:\s+)?\{(?P<inside>[^{}]*)\},\s*(?P<rest>\w+:\s[^#]*)")


def _no_blank_before_bracket(line: str) -> tuple[str, str] | None:
    """(found, expected) for ``phi:{velocity: om, …``, whose key YAML takes to be ``phi:{velocity``; None otherwise."""
    key = _BRACKET_AT_COLON.fullmatch(line)
    if key is None:
        return None
    return f"`{key[1]}:{key[2][0]}` without a blank behind the colon", f"`{key[1]}: {key[2].rstrip()}`"


def _entries_without_braces(line: str) -> tuple[str, str] | None:
    """(found, expected) for ``phi: velocity: om, unit: rad``: a mapping without braces, or a text without quotes."""
    bare = _BARE_ENTRIES.fullmatch(line)
    if bare is None:
        return None
    key, entries = bare["key"], bare["entries"]
    braces, quotes = f"`{key}: {{{entries}}}`", f'`{key}: "{entries}"`'
    return (
        f"`{entries}` behind `{key}:` on its line",
        f"braces around entries, {braces}; or quotes around text, {quotes}",
    )


def _no_comma(lines: Sequence[str], mark: Any) -> tuple[str, str] | None:
    """(found, expected) for ``{velocity: om unit: rad}``, at whose second colon the parser stops; None otherwise."""
    line = lines[mark.line] if mark.line < len(lines) else ""
    pair = _PAIR_WITHOUT_COMMA.search(line[: mark.column])
    before = "\n".join([*lines[: mark.line], line[: mark.column]])
    outside = before.count("{") <= before.count("}")  # a text that holds a colon
    if line[mark.column : mark.column + 1] != ":" or pair is None or outside:
        return None
    return f"no comma between `{pair[1]}` and `{pair[2]}:`", f"`{pair[1]}, {pair[2]}: …`"


_BRACKET_AT_COLON = re.compile(r"\s*(?:-\s+)?(\w+):([{\[].*)")
_BARE_ENTRIES = re.compile(r"\s*(?:-\s+)?(?P<key>\w+):\s+(?P<entries>\w+:\s[^#{}\[\]\"']*?)\s*(?:#.*)?")
_PAIR_WITHOUT_COMMA = re.compile(r"(?:^|[{,])\s*(\w+:\s[^{}\[\],:]*[^{}\[\],:\s])\s+(\w+)$")


def _key_without_colon(lines: Sequence[str], at: int) -> tuple[int, str, str] | None:
    """(line, key, value) of a key without a colon, if the parser reports the colon of the line ``at``; else None.

    Words without a colon are a text that continues on the next lines, so that the key below ``kind gcfo`` is read as
    the last word of this text. A word before ``{`` has the same consequence on one line.
    """
    if at < len(lines) and (found := _BARE_MAPPING.fullmatch(lines[at])):
        return at, found[1], found[2].strip()
    before = [k for k in range(min(at, len(lines))) if lines[k].strip() and not lines[k].lstrip().startswith("#")]
    if before and (found := _BARE_KEY.fullmatch(lines[before[-1]])):
        indents = [len(lines[k]) - len(lines[k].lstrip()) for k in (before[-1], at)]
        if indents[0] == indents[1]:
            return before[-1], found[1], found[2].strip()
    return None


def _key(name: object) -> str:
    """A key as YAML writes it; ``true``, ``false`` and ``null`` are not loaded as text."""
    return {True: "true", False: "false"}[name] if isinstance(name, bool) else "null" if name is None else str(name)


def _collect(node: Any, key: str, file: str, places: dict[str, Place], lines: Sequence[str]) -> None:
    """Add the places of all keys and list entries in a node to ``places``.

    Raises:
        BadInput: for a decimal comma in a mapping, ``{value: 24,5}``, at which YAML ends the value.

    Args:
        lines: of the text, from which such a number is quoted, since the node of ``05`` is 5.
    """
    listed = isinstance(node, CommentedSeq)
    entries = enumerate(node) if listed else node.items() if isinstance(node, CommentedMap) else ()
    before: Any = None
    for name, value in entries:
        inner = f"{key}[{name}]" if listed else f"{key}.{_key(name)}" if key else _key(name)
        position = (node.lc.data or {}).get(name)
        places[inner] = Place(file, position[0] + 1 if position else None, inner)
        written = _entry_at(lines, position) or _key(name)
        if not listed and value is None and comma_at_joint(before, written):
            number = f"{before},{written}"
            found, expected = f"`{number}` with {DECIMAL_COMMA}", f"a decimal point: {with_point(number)}"
            raise BadInput(Place(file, position[0] + 1 if position else None, key), found, expected, code="SPEC001")
        before = value
        _collect(value, inner, file, places, lines)


def _entry_at(lines: Sequence[str], position: Sequence[int] | None) -> str:
    """The text of an entry in braces, from its position to the next comma or brace; "" if the position is unknown."""
    if position is None or position[0] >= len(lines):
        return ""
    entry = _ENTRY.match(lines[position[0]], position[1])
    return entry[0].strip() if entry else ""


_ENTRY = re.compile(r"[^,{}\[\]]*")


def dump(document: Any) -> str:
    """The document as YAML text, comments kept."""
    stream = StringIO()
    round_trip_yaml().dump(document, stream)
    return stream.getvalue()


_NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])")

_COMMENT = re.compile(r"(\s*)(?:\S.*?\s)?(#.*\S)")
"""The indentation of a line, and its comment."""


def changed_text(before: str, document: Any) -> str:
    """A changed document as YAML text, with every unchanged line as the author wrote it.

    The dumper changes spacing and the form of numbers: -0.5e-6 becomes -5.0e-7. Comments that it drops, such as those
    inside brackets, are written above the lines that replace theirs.

    Args:
        before: the text from which the document was loaded.
    """
    after = dump(document)
    old, new = ([line.rstrip("\r") for line in text.split("\n")] for text in (before, after))
    one, other = ([_content(line) for line in lines] for lines in (old, new))
    lines = []
    for tag, start, stop, first, end in SequenceMatcher(None, one, other, autojunk=False).get_opcodes():
        if tag == "equal":
            lines += old[start:stop]
        else:
            comments = [found for line in old[start:stop] if (found := _COMMENT.match(line))]
            lines += [f"{found[1]}{found[2]}" for found in comments if found[2] not in after]
            lines += new[first:end]
    text = "\n".join(lines)
    return text if load_mapping(text, "")[0] == load_mapping(after, "")[0] else after


def _content(line: str) -> str:
    """A line in normalised form, without differences that the dumper makes: spaces within it, and forms of numbers."""
    words = _NUMBER.sub(lambda number: repr(float(number[0])), " ".join(line.split()))
    return f"{len(line) - len(line.lstrip())} {words}"


def plain(node: Any) -> Any:
    """The document as plain dicts, lists and scalars, for pydantic; numbers keep their written digits."""
    if isinstance(node, CommentedMap):
        return {_key(k): plain(v) for k, v in node.items()}
    if isinstance(node, CommentedSeq):
        return [plain(v) for v in node]
    if isinstance(node, bool) or node is None:
        return node
    if isinstance(node, int):
        return int(node)
    if isinstance(node, float):
        return float(node)
    return node if isinstance(node, str) else repr(node)

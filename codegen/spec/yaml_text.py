"""YAML 1.2 by ruamel.yaml: loading with the places of keys, and writing that keeps the author's comments."""

import re
from collections.abc import Mapping
from difflib import SequenceMatcher
from functools import lru_cache, partial
from io import StringIO
from math import isinf
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.constructor import ConstructorError, RoundTripConstructor
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode
from ruamel.yaml.parser import RoundTripParser
from ruamel.yaml.reader import ReaderError

from codegen.base.errors import BadInput, Place
from codegen.spec.ranges import expanded
from codegen.spec.yaml_faults import refused
from codegen.spec.yaml_limits import Limits

SPEC_FIRST = "; is this the log? A command takes the spec first, then the log"


class _Constructor(RoundTripConstructor):
    """ruamel.yaml's constructor, with ranges of names expanded, and dates as text, as in YAML 1.2.

    Refuses numbers that a double cannot hold. ``file``: the file's name, for messages.
    """

    def __init__(self, file: str = "", **options: Any) -> None:
        super().__init__(**options)
        self._file = file

    def construct_document(self, node: Any) -> Any:
        return super().construct_document(expanded(node, self._file) if isinstance(node, MappingNode) else node)

    def construct_yaml_float(self, node: Any) -> Any:
        value = super().construct_yaml_float(node)
        if value == 0 and re.search("[1-9]", node.value.lower().partition("e")[0]):
            raise ConstructorError(None, None, "underflow", node.start_mark)
        if isinf(value) and "inf" not in node.value.lower():
            raise ConstructorError(None, None, "overflow", node.start_mark)
        return value


_Constructor.add_constructor("tag:yaml.org,2002:float", _Constructor.construct_yaml_float)

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
    yaml.Constructor = partial(_Constructor, file=file)
    try:
        document = yaml.load(text)
    except MarkedYAMLError as error:
        raise refused(error, file, text) from None
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
    _collect(document, "", file, places)
    return document, places


@lru_cache(maxsize=64)
def load_plain(text: str, file: str, example: str = "name: one_mass") -> tuple[Any, Mapping[str, Place]]:
    """As ``load_mapping``, with the document as ``plain``, which must not be changed; cached, since parsing is slow."""
    document, places = load_mapping(text, file, example)
    return plain(document), places


def _key(name: object) -> str:
    """A key as YAML writes it; ``true``, ``false`` and ``null`` are not loaded as text."""
    return {True: "true", False: "false"}[name] if isinstance(name, bool) else "null" if name is None else str(name)


def _collect(node: Any, key: str, file: str, places: dict[str, Place]) -> None:
    """Add the places of all keys and list entries in a node to ``places``."""
    listed = isinstance(node, CommentedSeq)
    entries = enumerate(node) if listed else node.items() if isinstance(node, CommentedMap) else ()
    for name, value in entries:
        inner = f"{key}[{name}]" if listed else f"{key}.{_key(name)}" if key else _key(name)
        position = (node.lc.data or {}).get(name)
        places[inner] = Place(file, position[0] + 1 if position else None, inner)
        _collect(value, inner, file, places)


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
    inside brackets, are written above the lines that replace theirs. ``before``: the text from which the document was
    loaded.
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

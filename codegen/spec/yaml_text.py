"""YAML 1.2 through ruamel.yaml: load with places, dump with the author's comments kept."""

from __future__ import annotations

from functools import partial
from io import StringIO
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.constructor import DuplicateKeyError, RoundTripConstructor
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.parser import RoundTripParser

from codegen.base.errors import BadInput, Place
from codegen.spec.ranges import MARK, expanded
from codegen.spec.yaml_limits import Limits

FAULTS = {
    "could not find expected ':'": ("a key without `:`", "`key: value`", True),
    "expected <block end>": ("indented unlike the lines above", "one indentation for all keys of a mapping", False),
    "expected ',' or '}'": ("`{` that is not closed", "`}`", True),
    "expected ',' or ']'": ("`[` that is not closed", "`]`", True),
    "found unexpected end of stream": ("a quote that is not closed", "the same quote at its end", True),
    "found character '\\t'": ("a tab", "spaces for indentation", False),
    "mapping values are not allowed": (
        "a `:` in a value, or a key that is indented too far",
        'quotes around a value that holds `: `, as in "a: b"',
        False,
    ),
}
"""Start of the parser's message → what stands there, what was expected, and whether the fault is where the construct
begins; else where the parser noticed it."""


class _Constructor(RoundTripConstructor):
    """The loader's own, which quotes both values of a duplicate key however long they are."""

    def check_mapping_key(self, node: Any, key_node: Any, mapping: Any, key: Any, value: Any) -> bool:
        if key in mapping:
            raise DuplicateKeyError(None, None, f"duplicate key `{key_node.value}`", key_node.start_mark)
        return True


class _Parser(RoundTripParser):
    """The loader's own, each event of which is counted before the tree takes it."""

    def __init__(self, loader: Any, limits: Limits) -> None:
        super().__init__(loader)
        self._limits = limits

    def peek_event(self) -> Any:
        if self.current_event is None and self.state:
            self.current_event = self.state()
            self._limits.meet(self.current_event)
        return self.current_event

    def check_event(self, *choices: Any) -> bool:
        event = self.peek_event()
        return isinstance(event, choices) if choices else event is not None

    def get_event(self) -> Any:
        self.peek_event()
        return super().get_event()


def round_trip_yaml() -> YAML:
    """A loader and dumper that keeps comments, quotes and order, and never builds objects."""
    yaml = YAML(typ="rt")
    yaml.Constructor = _Constructor
    yaml.width = 110
    yaml.preserve_quotes = True
    yaml.indent(mapping=2, sequence=4, offset=2)
    return yaml


def load_mapping(text: str, file: str, example: str = "name: one_mass") -> tuple[CommentedMap, dict[str, Place]]:
    """Parse a YAML mapping.

    Args:
        example: of what it may hold, for the message where it is none.

    Returns:
        The round-trip document and the place of every key, named like ``friction.contacts[0].law``.

    Raises:
        BadInput: on YAML that cannot be read or is not a mapping.
    """
    try:
        yaml = round_trip_yaml()
        yaml.Parser = partial(_Parser, limits=Limits(file))
        document = yaml.load(text)
    except MarkedYAMLError as error:
        raise _refused(error, file) from None
    except (YAMLError, ValueError, TypeError, AttributeError, LookupError, ArithmeticError, AssertionError) as error:
        raise BadInput(
            Place(file), f"malformed YAML ({' '.join(str(error).split())[:120]})", "YAML 1.2", code="SPEC001"
        ) from None
    if not isinstance(document, CommentedMap):
        found = "nothing" if document is None else "a list" if isinstance(document, CommentedSeq) else "plain text"
        raise BadInput(Place(file, 1), found, f"a mapping such as `{example}`", code="SPEC006")
    places: dict[str, Place] = {}
    if MARK in text:
        document = expanded(document, file)
    _collect(document, "", file, places)
    return document, places


def _refused(error: MarkedYAMLError, file: str) -> BadInput:
    """The error of the YAML parser in words of the file, at the line on which the fault is."""
    problem = " ".join((error.problem or "malformed YAML").split())
    found, expected, where_it_begins = problem, "YAML 1.2", False
    for start, plain in FAULTS.items():
        if problem.startswith(start):
            found, expected, where_it_begins = plain
    marks = (error.context_mark, error.problem_mark)
    mark = next((m for m in (marks if where_it_begins else marks[::-1]) if m), None)
    return BadInput(Place(file, mark.line + 1 if mark else None), found, expected, code="SPEC001")


def _key(name: object) -> str:
    """A key as YAML writes it; some words of its own are no text."""
    return {True: "true", False: "false"}[name] if isinstance(name, bool) else "null" if name is None else str(name)


def _collect(node: Any, key: str, file: str, places: dict[str, Place]) -> None:
    if isinstance(node, CommentedMap):
        for name, value in node.items():
            inner = f"{key}.{_key(name)}" if key else _key(name)
            position = (node.lc.data or {}).get(name)
            places[inner] = Place(file, position[0] + 1 if position else None, inner)
            _collect(value, inner, file, places)
    elif isinstance(node, CommentedSeq):
        for index, value in enumerate(node):
            inner = f"{key}[{index}]"
            position = (node.lc.data or {}).get(index)
            places[inner] = Place(file, position[0] + 1 if position else None, inner)
            _collect(value, inner, file, places)


def dump(document: Any) -> str:
    """The document as YAML text, comments kept."""
    stream = StringIO()
    round_trip_yaml().dump(document, stream)
    return stream.getvalue()


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

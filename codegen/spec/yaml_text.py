"""YAML 1.2 through ruamel.yaml: load with places, dump with the author's comments kept."""

from __future__ import annotations

import re
from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from codegen.errors import BadInput, Place
from codegen.spec.ranges import MARK, expanded

LARGEST = 2_000_000
MOST_NODES = 100_000
DEEPEST = 100
LONGEST_NUMBER = 4000
_BESIDE = re.compile(r""""[^"]*"|'[^']*'|(?:^|\s)#.*""")
"""What stands in quotes or a comment on a line."""


def round_trip_yaml() -> YAML:
    """A loader and dumper that keeps comments, quotes and order, and never builds objects."""
    yaml = YAML(typ="rt")
    yaml.width = 110
    yaml.preserve_quotes = True
    yaml.indent(mapping=2, sequence=4, offset=2)
    return yaml


def read_text(path: Path, what: str) -> str:
    """The text of a user's file.

    Raises:
        BadInput: if it is absent, a folder, not UTF-8 or larger than 2 MB.
    """
    place = Place(str(path))
    if not path.is_file():
        state = "a folder" if path.is_dir() else "a device or a pipe" if path.exists() else "no such file"
        raise BadInput(place, state, what)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise BadInput(place, f"unreadable ({error.strerror})", what) from None
    if len(data) > LARGEST:
        raise BadInput(place, f"{len(data)} bytes", f"{what} of at most {LARGEST} bytes")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise BadInput(place, f"byte {error.start} is not UTF-8", what) from None


def load_mapping(text: str, file: str, example: str = "name: one_mass") -> tuple[CommentedMap, dict[str, Place]]:
    """Parse a YAML mapping.

    Args:
        example: of what it may hold, for the message where it is none.

    Returns:
        The round-trip document and the place of every key, named like ``friction.contacts[0].law``.

    Raises:
        BadInput: on YAML that cannot be read or is not a mapping.
    """
    _refuse_monsters(text, file)
    try:
        document = round_trip_yaml().load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark else None
        found = " ".join((error.problem or "malformed YAML").split())
        raise BadInput(Place(file, line), found, "YAML 1.2") from None
    except RecursionError:
        indents = [len(line) - len(line.lstrip(" -?")) for line in text.splitlines()]
        where = Place(file, indents.index(max(indents)) + 1)
        raise BadInput(where, "entries nested too deep to be read", "a spec, whose entries lie six deep") from None
    except (YAMLError, ValueError, TypeError, AttributeError, LookupError) as error:
        raise BadInput(Place(file), f"malformed YAML ({' '.join(str(error).split())[:120]})", "YAML 1.2") from None
    if not isinstance(document, CommentedMap):
        found = "nothing" if document is None else "a list" if isinstance(document, CommentedSeq) else "plain text"
        raise BadInput(Place(file, 1), found, f"a mapping such as `{example}`")
    places: dict[str, Place] = {}
    try:
        _collect(document, "", file, places)
        if MARK in text:
            document = expanded(document, file)
            places.clear()
            _collect(document, "", file, places)
    except RecursionError:
        raise BadInput(Place(file), "a node that contains itself", "plain YAML without recursive aliases") from None
    return document, places


def _refuse_monsters(text: str, file: str) -> None:
    """Raise BadInput for what the YAML reader takes minutes over, or cannot hold: deep brackets, endless numbers."""
    depth = 0
    for number, line in enumerate(text.splitlines(), 1):
        if re.search(rf"\d{{{LONGEST_NUMBER},}}", line):
            raise BadInput(Place(file, number), "a number of thousands of digits", f"at most {LONGEST_NUMBER} digits")
        for bracket in re.findall(r"[\[\]{}]", _BESIDE.sub("", line)):
            depth = depth + 1 if bracket in "[{" else max(depth - 1, 0)
            if depth > DEEPEST:
                found = f"more than {DEEPEST} brackets in one another"
                raise BadInput(Place(file, number), found, "a spec, whose matrices need three")


def _key(name: object) -> str:
    """A key as YAML writes it; some words of its own are no text."""
    return {True: "true", False: "false"}[name] if isinstance(name, bool) else "null" if name is None else str(name)


def _collect(node: Any, key: str, file: str, places: dict[str, Place]) -> None:
    if len(places) > MOST_NODES:
        raise BadInput(Place(file), "aliases that stand for too many nodes", f"a file of at most {MOST_NODES} values")
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

"""Editing of attributes in a user's XML file; everything else is unchanged byte for byte."""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

from codegen.base.errors import BadInput

_TAG = re.compile(rb"""(?:"[^"]*"|'[^']*'|[^>"'])*>""")
"""A tag to its end; a ``>`` within a quoted value is skipped."""


def edited(
    content: bytes,
    path: Path,
    what: str,
    expected: str,
    changed: Callable[[Sequence[str], Mapping[str, str]], Mapping[str, str]],
    added: Callable[[Sequence[str]], str] = lambda _: "",
) -> str:
    """The text with changed attributes and added elements.

    Args:
        what: the kind of file in a few words, for messages.
        expected: the same for the message on a file that is no XML.
        changed: function (open tags, attributes of the last) → its attributes with new values.
        added: function (open tags) → text that is inserted before the end of the last.

    Raises:
        BadInput: for a text that is not UTF-8 or no XML, or has a document type declaration.
    """
    changes: list[tuple[int, int, bytes]] = []
    opened: list[str] = []
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        opened.append(tag)
        new = changed(opened, attributes)
        if new:
            first = parser.CurrentByteIndex
            tag_text = _TAG.match(content, first)
            last = tag_text.end() if tag_text is not None else len(content)
            changes.append((first, last, _with_attributes(content[first:last].decode("utf-8"), new).encode()))

    def end(_: str) -> None:
        more = added(opened)
        if more:
            changes.append((parser.CurrentByteIndex, parser.CurrentByteIndex, more.encode()))
        opened.pop()

    def refuse(*_: object) -> None:
        raise BadInput(str(path), "a document type declaration", f"{what} without one", code="SPEC030")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.StartDoctypeDeclHandler = refuse
    try:
        content.decode("utf-8")
        parser.Parse(content, True)
    except UnicodeDecodeError:
        raise BadInput(str(path), "text that is not UTF-8", f"{what} in UTF-8, to be edited", code="FILE006") from None
    except expat.ExpatError as error:
        raise BadInput(str(path), str(error), expected, code="SPEC030") from None
    for first, last, text in reversed(changes):
        content = content[:first] + text + content[last:]
    return content.decode("utf-8")


def _with_attributes(tag: str, values: Mapping[str, str]) -> str:
    """A start tag with new values of some attributes; the rest of its text is unchanged."""
    for name, value in values.items():
        written = quoteattr(value)
        there = re.search(rf"\s{name}\s*=\s*(\"[^\"]*\"|'[^']*')", tag)
        if there is not None:
            tag = tag[: there.start(1)] + written + tag[there.end(1) :]
            continue
        end = len(tag) - (2 if tag.endswith("/>") else 1)
        body = tag[:end].rstrip()
        tag = f"{body} {name}={written}{tag[len(body) :]}"
    return tag

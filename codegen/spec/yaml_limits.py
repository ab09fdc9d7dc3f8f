"""Limits on the size and nesting of a YAML file, checked on the parser's events before the document is built.

Without limits a small file can take unbounded time or memory: the loader's time is exponential in the depth of mappings
as keys, and nested aliases (``a: &a [*b, *b]``, ``b: &b [*c, *c]``, …) expand to exponentially many values.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from ruamel.yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)

from codegen.base.errors import BadInput, Place

MOST_NODES = 50_000
"""Values in a file with aliases expanded; the loader takes about 0.1 ms for each, 5 s in total."""
DEEPEST = 20
"""Nesting of lists and mappings."""
MOST_MERGES = 100
"""Keys `<<`; the loader's time is quadratic in their number."""
LONGEST_KEY = 100
"""Characters of a key."""
LONGEST_NUMBER = 3000
"""Digits of a number, hexadecimal ones too, of which 3000 make 3613 decimal ones. Python converts at most 4300."""
_LONG_NUMBER = re.compile(rf"\d[\da-fA-F_xo]{{{LONGEST_NUMBER},}}")
VERSION = (1, 2)
"""Version of YAML that a file may state; in 1.1, 017 is fifteen, 1:30 is ninety and `no` is false."""


@dataclass
class _Open:
    """A mapping or list whose end has not been reached.

    Attributes:
        anchor: its name for aliases, or None.
        keys: keys of a mapping so far; None for a list.
        key_next: whether the next node is a key; keys and values of a mapping alternate.
        nodes: number of nodes in it so far, itself included and aliases expanded.
    """

    anchor: str | None
    keys: set[str] | None
    key_next: bool
    nodes: int = 1


class Limits:
    """Checker of one file, whose parser events are passed to ``check`` in order.

    Attributes:
        line: of the last event.
    """

    def __init__(self, file: str) -> None:
        self._file, self.line = file, 1
        self._nodes_of: dict[str, int] = {}
        """Anchor → number of nodes in its value."""
        self._merges = 0
        self._stack = [_Open(None, None, False)]
        """The document and the open mappings and lists, the innermost last."""

    def check(self, event: Any) -> None:
        """Count the next event.

        Raises:
            BadInput: at the line, for keys that are no plain words, duplicate keys, tags, another version of YAML, and
                values that are too many or too deeply nested.
        """
        self.line = event.start_mark.line + 1
        self._refuse_tag(event)
        match event:
            case DocumentStartEvent():
                self._begin_document(event)
            case MappingStartEvent() | SequenceStartEvent():
                self._open(event)
            case ScalarEvent():
                self._count_scalar(event)
                self._node_ended()
            case AliasEvent():
                self._count_alias(event)
                self._node_ended()
            case MappingEndEvent() | SequenceEndEvent():
                self._close()
                self._node_ended()

    def _refuse_tag(self, event: Any) -> None:
        if getattr(event, "tag", None) is not None:
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            raise self._fault(f"the tag `{tag}`", "a value without a tag")

    def _begin_document(self, event: DocumentStartEvent) -> None:
        self._nodes_of.clear()  # anchors hold within a document
        if event.version not in (None, VERSION):
            raise self._fault(f"YAML {'.'.join(map(str, event.version))}", "YAML 1.2", code="SPEC001")

    def _open(self, event: Any) -> None:
        """Begin a mapping or a list."""
        is_mapping = isinstance(event, MappingStartEvent)
        if self._stack[-1].key_next:
            kind = "mapping" if is_mapping else "list"
            raise self._fault(f"a {kind} as a key", "a word before the colon", code="SPEC006")
        if len(self._stack) > DEEPEST:
            found = f"more than {DEEPEST} lists and mappings inside each other"
            raise self._fault(found, "at most six levels, as in a spec")
        self._stack.append(_Open(event.anchor, set() if is_mapping else None, is_mapping))

    def _close(self) -> None:
        """End the innermost mapping or list; its nodes count in the one around it."""
        ended = self._stack.pop()
        if ended.anchor:
            self._nodes_of[ended.anchor] = ended.nodes
        self._stack[-1].nodes += ended.nodes

    def _count_scalar(self, event: ScalarEvent) -> None:
        """Refuse a number of too many digits, and a key that is too long, appears twice or is one merge too many."""
        inner, text = self._stack[-1], event.value
        if text == "<<" and inner.key_next:
            self._merges += 1
            if self._merges > MOST_MERGES:
                raise self._fault(f"more than {MOST_MERGES} keys `<<`", "the values written out")
        if _LONG_NUMBER.search(text):
            raise self._fault("a number of thousands of digits", f"at most {LONGEST_NUMBER} digits")
        if inner.key_next and inner.keys is not None:
            if len(text) > LONGEST_KEY:
                raise self._fault(f"a key of {len(text)} characters", f"at most {LONGEST_KEY}")
            if text in inner.keys:
                raise self._fault(f"duplicate key `{text}`", "each key once", code="SPEC005")
            inner.keys.add(text)
        if event.anchor:
            self._nodes_of[event.anchor] = 1
        inner.nodes += 1

    def _count_alias(self, event: AliasEvent) -> None:
        inner = self._stack[-1]
        if inner.key_next:
            raise self._fault(f"the alias `*{event.anchor}` as a key", "a word")
        if any(event.anchor == node.anchor for node in self._stack):
            found = f"the alias `*{event.anchor}` within its own anchor: a node that contains itself"
            raise self._fault(found, "plain YAML without recursive aliases")
        inner.nodes += self._nodes_of.get(event.anchor, 1)  # an unknown anchor is refused by the loader

    def _node_ended(self) -> None:
        """Alternate key and value in the mapping around a complete node; refuse too many nodes."""
        inner = self._stack[-1]
        inner.key_next = inner.keys is not None and not inner.key_next
        if inner.nodes > MOST_NODES:
            raise self._fault("too many values once its aliases are expanded", f"at most {MOST_NODES} in a file")

    def _fault(self, found: str, expected: str, code: str = "SPEC002") -> BadInput:
        """The error at the line of the last event."""
        return BadInput(Place(self._file, self.line), found, expected, code=code)

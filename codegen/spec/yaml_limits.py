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
    """Checker of one file, whose parser events are passed to ``meet`` in order.

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

    def meet(self, event: Any) -> None:
        """Count the next event.

        Raises:
            BadInput: at the line, for keys that are no plain words, duplicate keys, tags, another version of YAML, and
                values that are too many or too deeply nested.
        """
        file, line, nodes_of, stack = self._file, event.start_mark.line + 1, self._nodes_of, self._stack
        inner = stack[-1]
        self.line = line
        if getattr(event, "tag", None) is not None:
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            raise BadInput(Place(file, line), f"the tag `{tag}`", "a value without a tag", code="SPEC002")
        match event:
            case DocumentStartEvent():
                nodes_of.clear()  # anchors hold within a document
                if event.version not in (None, VERSION):
                    version = ".".join(map(str, event.version))
                    raise BadInput(Place(file, line), f"YAML {version}", "YAML 1.2", code="SPEC001")
            case ScalarEvent():
                if event.value == "<<" and inner.key_next:
                    self._merges += 1
                if self._merges > MOST_MERGES:
                    words = f"more than {MOST_MERGES} keys `<<`"
                    raise BadInput(Place(file, line), words, "the values written out", code="SPEC002")
                _check_scalar(event, inner, Place(file, line))
                if event.anchor:
                    nodes_of[event.anchor] = 1
                inner.nodes += 1
            case AliasEvent():
                if inner.key_next:
                    raise BadInput(Place(file, line), f"the alias `*{event.anchor}` as a key", "a word", code="SPEC002")
                if any(event.anchor == node.anchor for node in stack):
                    found = f"the alias `*{event.anchor}` within its own anchor: a node that contains itself"
                    raise BadInput(Place(file, line), found, "plain YAML without recursive aliases", code="SPEC002")
                inner.nodes += nodes_of.get(event.anchor, 1)  # one that is not known is the loader's to refuse
            case MappingStartEvent() | SequenceStartEvent():
                if inner.key_next:
                    kind = "mapping" if isinstance(event, MappingStartEvent) else "list"
                    raise BadInput(Place(file, line), f"a {kind} as a key", "a word before the colon", code="SPEC006")
                if len(stack) > DEEPEST:
                    found = f"more than {DEEPEST} lists and mappings inside each other"
                    raise BadInput(Place(file, line), found, "at most six levels, as in a spec", code="SPEC002")
                mapping = isinstance(event, MappingStartEvent)
                stack.append(_Open(event.anchor, set() if mapping else None, mapping))
                return
            case MappingEndEvent() | SequenceEndEvent():
                stack.pop()
                if inner.anchor:
                    nodes_of[inner.anchor] = inner.nodes
                stack[-1].nodes += inner.nodes
            case _:
                return
        # A node has ended: in a mapping, a value follows a key and a key follows a value.
        parent = stack[-1]
        parent.key_next = parent.keys is not None and not parent.key_next
        if parent.nodes > MOST_NODES:
            words = "too many values once its aliases are expanded"
            raise BadInput(Place(file, line), words, f"at most {MOST_NODES} in a file", code="SPEC002")


def _check_scalar(event: Any, inner: _Open, place: Place) -> None:
    """Refuse a number of too many digits, and a key that is too long or appears twice."""
    text = event.value
    if _LONG_NUMBER.search(text):
        raise BadInput(place, "a number of thousands of digits", f"at most {LONGEST_NUMBER} digits", code="SPEC002")
    if inner.key_next and inner.keys is not None:
        if len(text) > LONGEST_KEY:
            raise BadInput(place, f"a key of {len(text)} characters", f"at most {LONGEST_KEY}", code="SPEC002")
        if text in inner.keys:
            raise BadInput(place, f"duplicate key `{text}`", "each key once", code="SPEC005")
        inner.keys.add(text)

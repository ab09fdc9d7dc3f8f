"""Limits on the size and nesting of a YAML file, checked on the parser's events before the document is built.

Without limits a small file can take unbounded time or memory: the loader's time is exponential in the depth of mappings
as keys. Merge keys, and anchors and aliases, which can expand to exponentially many values, are refused; ranges of
names repeat entries (``ranges``).
"""

import re
from dataclasses import dataclass
from typing import Any

from ruamel.yaml import events

from codegen.base.errors import BadInput, Place

MOST_NODES = 50_000
"""Values in a file; the loader takes about 0.1 ms for each, 5 s in total."""
DEEPEST = 20
"""Nesting of lists and mappings."""
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
        keys: keys of a mapping so far; None for a list.
        key_next: whether the next node is a key; keys and values of a mapping alternate.
    """

    keys: set[str] | None
    key_next: bool


class Limits:
    """Checker of one file, whose parser events are passed to ``check`` in order.

    Attributes:
        line: of the last event.
    """

    def __init__(self, file: str) -> None:
        self._file, self.line = file, 1
        self._nodes = 0
        self._stack = [_Open(None, False)]
        """The document and the open mappings and lists, the innermost last."""

    def check(self, event: Any) -> None:
        """Count the next event.

        Raises:
            BadInput: at the line, for keys that are no plain words, duplicate and merge keys, tags, anchors, aliases,
                another version of YAML, and values that are too many or too deeply nested.
        """
        self.line = event.start_mark.line + 1
        if getattr(event, "tag", None) is not None:
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            raise self._fault(f"the tag `{tag}`", "a value without a tag")
        if getattr(event, "anchor", None) is not None:
            sign = "*" if isinstance(event, events.AliasEvent) else "&"
            if sign == "*" and "*" in event.anchor:  # as Markdown writes emphasis
                found = f"`*{event.anchor}`, a text that begins with `*` as an alias of YAML does"
                raise self._fault(found, f'quotes around the text: `"*{event.anchor}…"`')
            expected = f'the value itself; or quotes around a text that begins so: `"{sign}{event.anchor}…"`'
            raise self._fault(f"`{sign}{event.anchor}`, an anchor or alias of YAML", expected)
        match event:
            case events.DocumentStartEvent() if event.version not in (None, VERSION):
                raise self._fault(f"YAML {'.'.join(map(str, event.version))}", "YAML 1.2", code="SPEC001")
            case events.MappingStartEvent() | events.SequenceStartEvent():
                self._open(isinstance(event, events.MappingStartEvent))
            case events.ScalarEvent():
                self._check_scalar(event.value)
                self._node_ended()
            case events.MappingEndEvent() | events.SequenceEndEvent():
                self._stack.pop()
                self._node_ended()

    def _open(self, is_mapping: bool) -> None:
        """Begin a mapping or a list."""
        if self._stack[-1].key_next:
            kind = "mapping" if is_mapping else "list"
            raise self._fault(f"a {kind} as a key", "a word before the colon", code="SPEC006")
        if len(self._stack) > DEEPEST:
            found = f"more than {DEEPEST} lists and mappings inside each other"
            raise self._fault(found, "at most six levels, as in a spec")
        self._stack.append(_Open(set() if is_mapping else None, is_mapping))

    def _check_scalar(self, text: str) -> None:
        """Refuse a number of too many digits, and a key that is too long or appears twice."""
        inner = self._stack[-1]
        if _LONG_NUMBER.search(text):
            raise self._fault("a number of thousands of digits", f"at most {LONGEST_NUMBER} digits")
        if inner.key_next and inner.keys is not None:
            if text == "<<":  # the loader's time is quadratic in their number
                raise self._fault("`<<`, a merge key of YAML", "the entries themselves")
            if len(text) > LONGEST_KEY:
                raise self._fault(f"a key of {len(text)} characters", f"at most {LONGEST_KEY}")
            if text in inner.keys:
                raise self._fault(f"duplicate key `{text}`", "each key once", code="SPEC005")
            inner.keys.add(text)

    def _node_ended(self) -> None:
        """Count a complete node; keys and values of the mapping around it alternate."""
        self._nodes += 1
        if self._nodes > MOST_NODES:
            raise self._fault("too many values", f"at most {MOST_NODES} in a file")
        inner = self._stack[-1]
        inner.key_next = inner.keys is not None and not inner.key_next

    def _fault(self, found: str, expected: str, code: str = "SPEC002") -> BadInput:
        """The error at the line of the last event."""
        return BadInput(Place(self._file, self.line), found, expected, code=code)

"""Expansion of ranges of numbered names: ``x1..16`` stands for the sixteen names x1 to x16.

``x1..16_noise`` gives x1_noise to x16_noise. An entry of a mapping is repeated for each number if its key has a range,
an item of a list if any text in it has one. All ranges in one entry or item are counted together:
``k*(x1..15 - x2..16)`` as an item of a list gives the forces of fifteen springs.
"""

import re
from collections.abc import Iterator
from copy import copy
from typing import Any

from ruamel.yaml.nodes import MappingNode, SequenceNode

from codegen.base.errors import BadInput, Place
from codegen.spec.yaml_limits import MOST_NODES

LONGEST = 10_000
"""Most names of one range."""
_RANGE = re.compile(r"\b([A-Za-z]\w*?)(\d+)\.\.(\d+)((?:_[A-Za-z]\w*)?)\b")


def expanded(node: Any, file: str) -> Any:
    """The parser's node tree of a document, in which every range is expanded.

    Raises BadInput for a descending or too long range, ranges of different lengths in one entry or item, and more
    values than a file may have.
    """
    return _expanded(node, file, [0])


def _expanded(node: Any, file: str, made: list[int]) -> Any:
    """``expanded`` for one node; ``made[0]`` counts the values made so far. Of equal keys the last one wins."""
    if isinstance(node, MappingNode):
        entries: dict[str, tuple[Any, Any]] = {}
        for key, value in node.value:
            pairs = [(key, value)]
            if _RANGE.search(key.value):
                copies = range(_count([key.value, *_texts(value)], key, value, file, made))
                pairs = [(_shifted(key, k), _shifted(value, k)) for k in copies]
            else:
                _expanded(value, file, made)
            entries |= {own.value: (own, of) for own, of in pairs}
        node.value = list(entries.values())
    elif isinstance(node, SequenceNode):
        items: list[Any] = []
        for item in node.value:
            texts = list(_texts(item))
            if any(map(_RANGE.search, texts)):
                items += [_shifted(item, k) for k in range(_count(texts, item, item, file, made))]
            else:
                items.append(item)
        node.value = items
    return node


def _inner(node: Any) -> list[Any]:
    """The keys and values in a mapping, or the items of a list."""
    if isinstance(node, MappingNode):
        return [inner for entry in node.value for inner in entry]
    return node.value if isinstance(node, SequenceNode) else []


def _texts(node: Any) -> Iterator[str]:
    """The texts of all scalars in a node, keys included."""
    if isinstance(node, MappingNode | SequenceNode):
        for inner in _inner(node):
            yield from _texts(inner)
    else:
        yield node.value


def _size(node: Any) -> int:
    """The number of values in a node, itself included."""
    values = [value for _, value in node.value] if isinstance(node, MappingNode) else _inner(node)
    return 1 + sum(map(_size, values))


def _count(texts: list[str], at: Any, value: Any, file: str, made: list[int]) -> int:
    """The number of copies given by the ranges in the texts; the values of these copies are added to ``made[0]``.

    ``at``: the node whose line the messages name.
    """
    place = Place(file, at.start_mark.line + 1)
    found = [m for text in texts for m in _RANGE.finditer(text)]
    first = found[0]
    for m in found:
        count, expected = int(m[3]) - int(m[2]) + 1, int(first[3]) - int(first[2]) + 1
        if not 1 <= count <= LONGEST:
            wanted = f"a rising range of at most {LONGEST} names"
            raise BadInput(place, f"the range `{m[0]}`", wanted, code="SPEC016")
        if count != expected:
            what = f"`{first[0]}` of {expected} names with `{m[0]}` of {count}"
            raise BadInput(place, what, "ranges of one length, since they run together", code="SPEC016")
    copies = int(first[3]) - int(first[2]) + 1
    made[0] += copies * _size(value)
    if made[0] > MOST_NODES:
        words = "too many values once its ranges are expanded"
        raise BadInput(place, words, f"at most {MOST_NODES} in a file", code="SPEC002")
    return copies


def _shifted(node: Any, k: int) -> Any:
    """Copy k = 0, 1, ... of a node, with k added to the first number of each range; copy 0 keeps the comments."""
    made = copy(node)
    if k:
        made.comment = None
    if isinstance(node, MappingNode):
        made.value = [(_shifted(key, k), _shifted(value, k)) for key, value in node.value]
    elif isinstance(node, SequenceNode):
        made.value = [_shifted(value, k) for value in node.value]
    else:
        made.value = _RANGE.sub(lambda m: f"{m[1]}{int(m[2]) + k}{m[4]}", node.value)
    return made

"""Expansion of ranges of numbered names: ``x1..16`` stands for the sixteen names x1 to x16.

``x1..16_noise`` gives x1_noise to x16_noise. An entry of a mapping is repeated for each number if its key has a range,
an item of a list if any text in it has one. All ranges in one entry or item are counted together:
``k*(x1..15 - x2..16)`` as an item of a list gives the forces of fifteen springs.
"""

import re
from collections.abc import Iterator
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq

from codegen.base.errors import BadInput, Place
from codegen.spec.yaml_limits import MOST_NODES

MARK = ".."
LONGEST = 10_000
"""Most names of one range."""
_RANGE = re.compile(r"\b([A-Za-z]\w*?)(\d+)\.\.(\d+)((?:_[A-Za-z]\w*)?)\b")


def expanded(node: Any, file: str) -> Any:
    """The document with every range expanded; a node without a range is returned as the same object.

    Raises BadInput for a descending or too long range, ranges of different lengths in one entry or item, and more
    values than a file may have.
    """
    return _expanded(node, file, None, [0])


def _expanded(node: Any, file: str, line: int | None, made: list[int]) -> Any:
    """``expanded`` for one node, on a line of the file; ``made[0]`` counts the values made so far."""
    if isinstance(node, CommentedMap):
        result = CommentedMap()
        for key, value in list(node.items()):
            position = (node.lc.data or {}).get(key)
            at = position[0] + 1 if position else line
            if isinstance(key, str) and _RANGE.search(key):
                for k in range(_count([key, *_texts(value)], value, file, at, made)):
                    _put(result, _shifted(key, k), _shifted(value, k), position)
                if key in node.ca.items:
                    result.ca.items[_shifted(key, 0)] = node.ca.items[key]
            else:
                _put(result, key, _expanded(value, file, at, made), position)
        changed = list(node) != list(result) or any(node[key] is not result[key] for key in result)
        return _same_style(node, result) if changed else node
    if isinstance(node, CommentedSeq):
        items = CommentedSeq()
        for index, value in enumerate(node):
            position = (node.lc.data or {}).get(index)
            at = position[0] + 1 if position else line
            repeated = any(_RANGE.search(text) for text in _texts(value))
            copies = range(_count(list(_texts(value)), value, file, at, made)) if repeated else ()
            for copy in [_shifted(value, k) for k in copies] if repeated else [value]:
                items.append(copy)
                if position:
                    items.lc.add_idx_line_col(len(items) - 1, position)
        same = len(items) == len(node) and all(old is new for old, new in zip(node, items, strict=True))
        return node if same else _same_style(node, items)
    return node


def _put(mapping: CommentedMap, key: Any, value: Any, position: Any) -> None:
    mapping[key] = value
    if position:
        mapping.lc.add_kv_line_col(key, position)


def _same_style(old: Any, new: Any, comments: bool = True) -> Any:
    """The new node in the style (flow or block) of the old one; with ``comments``, also its comments."""
    if old.fa.flow_style():
        new.fa.set_flow_style()
    else:
        new.fa.set_block_style()
    if not comments:
        return new
    new.ca.comment = old.ca.comment
    if isinstance(old, CommentedMap):
        new.ca.items.update({key: comment for key, comment in old.ca.items.items() if key in new})
    return new


def _texts(node: Any) -> Iterator[str]:
    """All strings in a node, keys included."""
    if isinstance(node, CommentedMap):
        for key, value in node.items():
            yield from _texts(key)
            yield from _texts(value)
    elif isinstance(node, CommentedSeq):
        for value in node:
            yield from _texts(value)
    elif isinstance(node, str):
        yield node


def _size(node: Any) -> int:
    """The number of values in a node, itself included."""
    if isinstance(node, CommentedMap):
        return 1 + sum(map(_size, node.values()))
    return 1 + sum(map(_size, node)) if isinstance(node, CommentedSeq) else 1


def _count(texts: list[str], value: Any, file: str, line: int | None, made: list[int]) -> int:
    """The number of copies given by the ranges in the texts; the values of these copies are added to ``made[0]``."""
    found = [m for text in texts for m in _RANGE.finditer(text)]
    first = found[0]
    for m in found:
        count, expected = int(m[3]) - int(m[2]) + 1, int(first[3]) - int(first[2]) + 1
        if not 1 <= count <= LONGEST:
            wanted = f"a rising range of at most {LONGEST} names"
            raise BadInput(Place(file, line), f"the range `{m[0]}`", wanted, code="SPEC016")
        if count != expected:
            what = f"`{first[0]}` of {expected} names with `{m[0]}` of {count}"
            raise BadInput(Place(file, line), what, "ranges of one length, since they run together", code="SPEC016")
    copies = int(first[3]) - int(first[2]) + 1
    made[0] += copies * _size(value)
    if made[0] > MOST_NODES:
        words = "too many values once its ranges are expanded"
        raise BadInput(Place(file, line), words, f"at most {MOST_NODES} in a file", code="SPEC002")
    return copies


def _shifted(node: Any, k: int) -> Any:
    """Copy k = 0, 1, ... of a node, with k added to the first number of each range; copy 0 keeps the comments."""
    if isinstance(node, CommentedMap):
        mapping = CommentedMap()
        for key, value in node.items():
            _put(mapping, _shifted(key, k), _shifted(value, k), (node.lc.data or {}).get(key))
        return _same_style(node, mapping, k == 0)
    if isinstance(node, CommentedSeq):
        return _same_style(node, CommentedSeq([_shifted(value, k) for value in node]), k == 0)
    if isinstance(node, str):
        return _RANGE.sub(lambda m: f"{m[1]}{int(m[2]) + k}{m[4]}", node)
    return node

"""A YAML document as a tree whose scalars are text as written, and back; a mapping may hold a key twice."""

from __future__ import annotations

import json
import random
import re
from dataclasses import dataclass
from typing import Any

from ruamel.yaml import YAML


@dataclass
class Mapping:
    """Keys and values in order."""

    pairs: list[tuple[str, Any]]


@dataclass(frozen=True)
class Raw:
    """Text that is written as it stands, YAML or not."""

    text: str


Node = Any  # Mapping, list, str, Raw
PLAIN = re.compile(r"[A-Za-z0-9_.+\-(][A-Za-z0-9_.+\-*/()^%ψλ ]*")


def parse(text: str) -> Node:
    """The tree of a document without oddities."""
    return _node(YAML(typ="base", pure=True).load(text))


def _node(raw: Any) -> Node:
    if isinstance(raw, dict):
        return Mapping([(str(key), _node(value)) for key, value in raw.items()])
    if isinstance(raw, list):
        return [_node(value) for value in raw]
    return "null" if raw is None else str(raw)


def copied(node: Node) -> Node:
    if isinstance(node, Mapping):
        return Mapping([(key, copied(value)) for key, value in node.pairs])
    return [copied(value) for value in node] if isinstance(node, list) else node


def written(node: Node, dice: random.Random) -> str:
    """The document as text; the top in block style, what lies deeper in block or flow style."""
    if not isinstance(node, Mapping):
        return _flow(node) + "\n"
    lines = []
    for key, value in node.pairs:
        name = key if PLAIN.fullmatch(key) or key == "<<" else json.dumps(key)
        if isinstance(value, Mapping) and value.pairs and dice.random() < 0.7:
            lines += [f"{name}:"] + [f"  {_key(inner)}: {_flow(rest)}" for inner, rest in value.pairs]
        elif isinstance(value, list) and value and dice.random() < 0.7:
            lines += [f"{name}:"] + [f"  - {_flow(rest)}" for rest in value]
        else:
            lines.append(f"{name}: {_flow(value)}")
    return "\n".join(lines) + "\n"


def _key(text: str) -> str:
    return text if PLAIN.fullmatch(text) or text == "<<" else json.dumps(text)


def _flow(node: Node) -> str:
    if isinstance(node, Raw):
        return node.text
    if isinstance(node, Mapping):
        return "{" + ", ".join(f"{_key(key)}: {_flow(value)}" for key, value in node.pairs) + "}"
    if isinstance(node, list):
        return "[" + ", ".join(map(_flow, node)) + "]"
    return node if PLAIN.fullmatch(node) else json.dumps(node, ensure_ascii=False)


def places(node: Node, path: tuple[int, ...] = ()) -> list[tuple[int, ...]]:
    """The path of every node, the document itself first; steps are places among the pairs or items."""
    found = [path]
    inner = [value for _, value in node.pairs] if isinstance(node, Mapping) else node if isinstance(node, list) else []
    for k, value in enumerate(inner):
        found += places(value, (*path, k))
    return found


def at(node: Node, path: tuple[int, ...]) -> Node:
    for k in path:
        node = node.pairs[k][1] if isinstance(node, Mapping) else node[k]
    return node


def put(node: Node, path: tuple[int, ...], value: Node) -> Node:
    """The tree with that node replaced, in place."""
    if not path:
        return value
    holder = at(node, path[:-1])
    if isinstance(holder, Mapping):
        holder.pairs[path[-1]] = (holder.pairs[path[-1]][0], value)
    else:
        holder[path[-1]] = value
    return node

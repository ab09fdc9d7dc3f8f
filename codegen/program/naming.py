"""Variable names for quantities that a spec does not name: derived constants and intermediate results."""

import re
from collections.abc import Mapping

from codegen.program.graph import Node

LONGEST = 40
"""Most characters of a name that is derived from a formula."""
DEEPEST = 8
"""Most nested operations in a formula from which a name is derived."""
_RESERVED = """
state parameters inputs outputs check given fresh faults missed valid mode invalid_samples first lane i
field dataclass math
"""
RESERVED = set(re.findall(r"\w+", _RESERVED))
"""Names that the templates of the generated code use themselves."""


class Names:
    """Provider of unique names; names that differ only by case count as equal. ``taken``: names in use."""

    def __init__(self, taken: set[str]) -> None:
        self._taken = {name.lower() for name in taken}
        self._counts: dict[str, int] = {}

    def take(self, wish: str) -> str:
        """The wished name, with a number appended if it is taken."""
        name = wish
        while name.lower() in self._taken:
            self._counts[wish] = self._counts.get(wish, 1) + 1
            name = f"{wish}_{self._counts[wish]}"
        self._taken.add(name.lower())
        return name

    def numbered(self, stem: str) -> str:
        """The first of stem_1, stem_2, … that is free."""
        while True:
            self._counts[stem] = self._counts.get(stem, 0) + 1
            name = f"{stem}_{self._counts[stem]}"
            if name.lower() not in self._taken:
                self._taken.add(name.lower())
                return name


def constant_name(node: Node) -> str | None:
    """A name from a constant's formula: h_K_F_rail, one_over_m1, eta2_plus_eta3; None where it would be too long."""
    words = _words(node, DEEPEST)
    return words if words is not None and len(words) <= LONGEST else None


def _words(node: Node, deep: int) -> str | None:
    """A formula spelled as an identifier; None if it has no such form, or more than ``deep`` nested operations."""
    if deep == 0:
        return None
    match node.kind:
        case "number":
            return {1.0: "one", 2.0: "twice"}.get(node.value) or (f"{node.value:g}" if node.value % 1 == 0 else None)
        case "symbol":
            return "h" if node.name == "sample_time" else node.name
        case "call":
            inner = _words(node.arguments[0], deep - 1)
            return None if inner is None or len(node.arguments) > 1 else f"{node.name}_{inner}"
        case "negative":
            inner = _words(node.arguments[0], deep - 1)
            return None if inner is None else f"minus_{inner}"
    parts = [_words(a, deep - 1) for a in node.arguments]
    if None in parts or any(a.kind == "sum" for a in node.arguments):
        return None
    text = [p for p in parts if p is not None]
    if node.kind == "product":
        lead = sorted(text, key=lambda word: word != "h" and word != "twice")
        name = "_".join(_powers(lead))
    elif node.kind == "quotient":
        name = "_over_".join(text)
    else:
        signs = ("minus" if sign < 0 else "plus" for sign in node.signs[1:])
        name = text[0] + "".join(f"_{sign}_{word}" for sign, word in zip(signs, text[1:], strict=True))
    return name if re.fullmatch(r"[A-Za-z]\w*", name) else None


def _powers(words: list[str]) -> list[str]:
    """The factors of a product, two equal ones written as x_squared."""
    squared = [f"{word}_squared" if words.count(word) == 2 else word for word in words]
    return list(dict.fromkeys(squared)) if all(words.count(w) <= 2 for w in words) else words


def partial_name(node: Node, known: Mapping[Node, str]) -> str | None:
    """A name for one operation on a named node, such as sin_x, omega_squared or one_over_d; None for another node."""
    inner = [known.get(a) or (a.name if a.kind == "symbol" else None) for a in node.arguments]
    if None in inner[:1] and not (node.kind == "quotient" and inner[-1]):
        return None
    if node.kind == "call" and len(inner) == 1:
        return f"{node.name}_{inner[0]}"
    if node.kind == "product" and len(inner) == 2 and node.arguments[0] is node.arguments[1]:
        return f"{inner[0]}_squared"
    if node.kind == "quotient" and node.arguments[0].is_number(1.0):
        return f"one_over_{inner[1]}"
    return None

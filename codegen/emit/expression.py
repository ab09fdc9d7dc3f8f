"""Printing of expression nodes as source text; the only place where code is assembled from strings."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from codegen.program.graph import Node, out_of_range

ATOM, UNARY, PRODUCT, SUM = 4, 3, 2, 1
"""Precedence of the outermost operator of a printed expression, from strongest to weakest."""
WIDTH = 112
"""Longest line of a wrapped expression, in characters."""
DEEPEST_BREAK = 6
"""Lines are broken at operators that are inside fewer parentheses than this."""


@dataclass(frozen=True)
class Language:
    """Expression syntax of an output language at one precision.

    Attributes:
        calls: function → its name in the language. With a function for ``quotient``, a quotient of
            variables is printed as a call of it, since the divisor may be zero.
        single: whether numbers are single precision.
        number: format of a literal, such as ``{digits}f``.
        opening, closing: parentheses around an expression that takes several lines.
    """

    calls: Mapping[str, str]
    single: bool = False
    number: str = "{digits}"
    opening: str = ""
    closing: str = ""

    def literal(self, value: float) -> str:
        """The literal of a number: the shortest decimal that rounds to it, with a point or an exponent.

        Of a number that is not one of single precision, all digits of the double are printed: it is rounded when the
        code is read, as 0.45359237f, and the checker reads the same decimal as in the certificate. Raises BadInput for
        a number that is not finite, or that underflows to zero or overflows in single precision.
        """
        with np.errstate(over="ignore", under="ignore"):
            rounded = np.float32(value) if self.single else np.float64(value)
        if not math.isfinite(rounded) or (value != 0) != (rounded != 0):
            raise out_of_range(f"the constant {value}", "single" if self.single else "double")
        digits = repr(float(value))
        if self.single and (float(rounded) == value or not _rounds_to(digits, rounded)):
            digits = str(rounded)
        return self.number.format(digits=digits)


def _rounds_to(digits: str, number: np.floating) -> bool:
    """Whether a decimal is nearer to this number of single precision than to others; its double may be a tie."""
    off = Fraction(digits) - Fraction(float(number))
    with np.errstate(over="ignore"):
        neighbour = np.nextafter(number, np.float32(math.copysign(math.inf, off)))
    return not math.isfinite(neighbour) or 2 * abs(off) < abs(Fraction(float(neighbour)) - Fraction(float(number)))


class Expressions:
    """Printer of expressions in a language, with the parentheses that operator precedence requires.

    Sums and products are left-associative in every language: the first operand may have the same precedence as the
    operator, the others need a higher one, as in a − (b − c) and a / (b * c).

    Args:
        words: name of a symbol → its text.
        names: node → name of the variable that stores its value; the name is printed in place of the expression.
        place: function that prints an array element or a local variable.
    """

    def __init__(
        self,
        language: Language,
        words: Mapping[str, str],
        names: Mapping[Node, str],
        place: Callable[[Node], str] | None = None,
    ) -> None:
        self.language, self.words, self.names, self.place = language, words, names, place

    def text(self, node: Node, whole: bool = False) -> str:
        """The text of a node; with ``whole`` that of its definition, also where a variable stores the value."""
        return self._write(node, whole)[0]

    def _write(self, node: Node, whole: bool = False) -> tuple[str, int]:
        """The text of a node and the precedence of its outermost operator."""
        if not whole and node in self.names:
            return self.names[node], ATOM
        arguments = node.arguments
        match node.kind:
            case "number":
                return self.language.literal(node.value), ATOM if node.value >= 0 else UNARY
            case "symbol":
                return self.words[node.name], ATOM
            case "element" | "local" if self.place is not None:
                return self.place(node), ATOM
            case "negative":
                return f"-{self._operand(arguments[0], ATOM)}", UNARY
            case "call":
                inside = ", ".join(self.text(a) for a in arguments)
                return f"{self.language.calls[node.name]}({inside})", ATOM
            case "quotient" if not node.constant and "quotient" in self.language.calls:
                above, below = (self.text(a) for a in arguments)
                return f"{self.language.calls['quotient']}({above}, {below})", ATOM
            case "quotient":
                return f"{self._operand(arguments[0], PRODUCT)} / {self._operand(arguments[1], UNARY)}", PRODUCT
            case "product":
                first, *rest = arguments
                return " * ".join([self._operand(first, PRODUCT), *(self._operand(a, UNARY) for a in rest)]), PRODUCT
        parts = [self._operand(arguments[0], SUM if node.signs[0] > 0 else ATOM)]  # -(-2.0): --2.0 is a decrement in C
        parts[0] = parts[0] if node.signs[0] > 0 else f"-{parts[0]}"
        for sign, term in zip(node.signs[1:], arguments[1:], strict=True):
            parts.append(f"{'+' if sign > 0 else '-'} {self._operand(term, PRODUCT)}")
        return " ".join(parts), SUM

    def _operand(self, node: Node, least: int) -> str:
        """The text of an operand, in parentheses where its precedence is below ``least``."""
        text, precedence = self._write(node)
        return text if precedence >= least else f"({text})"


def wrapped(text: str, start: int, language: Language, indent: int = 8) -> str:
    """An expression broken before binary operators into lines of at most ``WIDTH`` characters.

    Args:
        start: column at which the first line starts.
        indent: of the further lines.
    """
    if start + len(text) <= WIDTH:
        return text
    lines = [""]
    for piece, depth in _pieces(text):
        used = len(lines[-1]) + (start if len(lines) == 1 and not language.opening else indent)
        if lines[-1] and used + len(piece) > WIDTH and depth < DEEPEST_BREAK:
            lines.append("")
        lines[-1] += piece
    inner = ("\n" + " " * indent).join(line.strip() for line in lines)
    if language.opening:
        return f"{language.opening}\n{' ' * indent}{inner}\n{' ' * (indent - 4)}{language.closing}"
    return inner


def _pieces(text: str) -> list[tuple[str, int]]:
    """The text split before its binary operators: (piece, depth of parentheses at its beginning)."""
    pieces: list[tuple[str, int]] = []
    depth = begin = depth_at_begin = 0
    for k, c in enumerate(text):
        if c == " " and text[k + 1 : k + 3] in {"+ ", "- ", "* ", "/ "}:
            pieces.append((text[begin:k], depth_at_begin))
            begin, depth_at_begin = k, depth
        depth += (c == "(") - (c == ")")
    return [*pieces, (text[begin:], depth_at_begin)]

"""Parser of expressions, text → SymPy, without evaluation of the text.

Python's parser gives a syntax tree, without executing it. Every node that is not a number, a known name, an operator of
+ - * / ** or a call of a listed function is an error that quotes it.

A number is rounded once to a double, and represented by the shortest decimal that denotes this double. C and the Python
twin print this decimal, and the checker reads it in the C, so equations, certificate and code use the same number. A
decimal of up to 15 digits is not changed: 0.1 is 1/10.
"""

import ast
import math
import operator
import re
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import sympy

from codegen.base.errors import BadInput, Place, nearest_name
from codegen.base.user_text import foreign_letter
from codegen.spec.functions import CONSTANTS, FUNCTIONS, OTHER_NAMES, Magnitude, Sgn

RANGE = "a finite number above 1e-300 and below 1e300 in size"
"""What is expected of a number, for messages."""
TYPESET = {"·": "*", "⋅": "*", "×": "*", "−": "-", "–": "-", "÷": "/", "²": "**2", "³": "**3", "π": "pi"}
"""Sign as papers and data sheets print it → the sign to use in an expression; messages suggest it."""
LONGEST = 20_000
"""Most characters of an expression."""
DEEPEST = 600
"""Most levels of its syntax tree."""
MOST_PARENTHESES = 40
"""Most parentheses inside each other."""
LONGEST_NUMBER = 8192
"""Most bits of a rational number, numerator and denominator together."""
DECIMAL_COMMA = "a decimal comma"
"""What is wrong with `0,05`, for messages."""
_WITH_COMMA = r"\d+,\d+(?:[eE][-+]?\d+)?"
_COMMA_VALUE = re.compile(rf"\s*[-+]?{_WITH_COMMA}(?:\s*(?:%|[^\W\d_].*|1/.*))?\s*")
_COMMA_INSIDE = re.compile(rf"(?<![\w.,]){_WITH_COMMA}(?!,)")
_CALL = re.compile(r"([A-Za-z]\w*)\([^()]*$")
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")
_OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}


def decimal_of(double: float) -> sympy.Rational:
    """The shortest decimal that rounds to a finite double, as an exact rational."""
    return sympy.Rational(repr(double))


def in_range(double: float) -> bool:
    """Whether the magnitude of a nonzero number is within the range that a spec may use."""
    return 1e-300 < abs(double) < 1e300


def printed(value: Any, place: Place, found: str) -> sympy.Rational:
    """A rational number rounded once to a double, as the exact value of the decimal that generated code prints.

    ``found``: the text of the number in the spec, for the message. Raises BadInput for a nonzero number whose magnitude
    is not above 1e-300 and below 1e300.
    """
    try:
        double = int(value.p) / int(value.q)  # Python rounds a quotient of integers correctly
    except OverflowError:
        double = math.inf
    if value != 0 and not in_range(double):
        raise BadInput(place, found, RANGE, code="SPEC007")
    return decimal_of(double)


@dataclass(frozen=True)
class Expression:
    """A parsed expression.

    Attributes:
        text: as written by the author, on one line.
        tree: syntax tree, which contains arithmetic only. Its positions refer to the text with ``**`` for ``^``.
    """

    text: str
    tree: ast.expr
    place: Place

    def symbolic(self, symbols: Mapping[str, sympy.Symbol], hint: str = "") -> sympy.Expr:
        """The SymPy form over the given symbols, with numbers as exact rationals.

        ``hint``: added to the message on an unknown name. Raises BadInput for a name that is not in ``symbols``, a
        division by zero, or a number out of range.
        """
        value = evaluate_tree(self.tree, self, _numbers_of(symbols, hint))
        value = value.replace(sympy.Abs, Magnitude).replace(sympy.sign, Sgn)  # sqrt(x**2) gives SymPy's own
        if value.has(sympy.zoo, sympy.nan, sympy.oo, sympy.I) or value.is_real is False:
            found = f"`{self.text}` is not a finite real number"
            raise BadInput(self.place, found, "a finite real expression", code="SPEC012")
        return value

    def source(self, node: ast.expr) -> str:
        """The text of one node of the tree, as written by the author."""
        return _written(node, self.text)


def _written(node: ast.expr, text: str) -> str:
    """The part of a text, possibly with ``^``, to which a node of its tree belongs."""
    if node.end_col_offset is None:
        return text
    places = _places(text)
    return text[places[node.col_offset] : places[node.end_col_offset - 1] + 1]


def _places(text: str) -> list[int]:
    """For each character of the text with ``**`` for ``^``, its position in the text itself."""
    return [k for k, letter in enumerate(text) for _ in range(1 + (letter == "^"))]


def exact_number(text: str, place: Place) -> sympy.Rational:
    """The rational number that a decimal literal denotes: ``0.1`` is 1/10, as code prints it (see ``printed``)."""
    try:
        size = float(text.encode("ascii"))  # of text it reads the digits of every script
    except ValueError:
        if comma_in_value(text):
            expected = f"a decimal point: {with_point(text)}"
            raise BadInput(place, f"`{text}` with {DECIMAL_COMMA}", expected, code="SPEC006") from None
        raise BadInput(place, f"`{text}`{foreign_letter(text)} is not a number", "a number", code="SPEC006") from None
    zero = not re.search("[1-9]", re.split("[eE]", text)[0])  # 1e-999 is not zero, though its double is
    if not math.isfinite(size) or not (zero or in_range(size)):
        raise BadInput(place, f"the number {text}", RANGE, code="SPEC007")
    return sympy.Integer(0) if zero else decimal_of(size)


def parse_expression(text: str | int | float, place: Place) -> Expression:
    """Read one expression.

    ``text``: the expression, or a bare number as YAML gives it. Raises BadInput if the text is not an expression of
    numbers, names, + - * / ** (or ^) and the listed functions.
    """
    words = " ".join(str(text).split())
    if not words:
        raise BadInput(place, "an empty expression", "an expression such as `m*g*sin(q)`", code="SPEC010")
    if not words.isascii():  # Python would read a full-width x as x
        foreign = next(c for c in words if not c.isascii())
        expected = "letters a to z, digits and + - * / ** ( ) only"
        if foreign == "°":
            expected += "; an angle in degrees is a parameter with `unit: deg`"
        found = f"`{foreign}` in `{words}`{foreign_letter(foreign)}"
        raise BadInput(place, found, expected, TYPESET.get(foreign), code="SPEC010")
    if len(words) > LONGEST:
        raise BadInput(place, f"an expression of {len(words)} characters", f"at most {LONGEST}", code="SPEC011")
    if comma := _comma_in_expression(words):
        expected = f"a decimal point: {with_point(comma)}"
        raise BadInput(place, f"`{comma}` with {DECIMAL_COMMA} in `{words}`", expected, code="SPEC010")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # Python only warns of `2if`, which is no expression
            tree = ast.parse(words.replace("^", "**"), mode="eval").body
        if max(accumulate((c == "(") - (c == ")") for c in words)) > MOST_PARENTHESES:
            raise RecursionError
        _check(tree, words, place)
    except SyntaxError as error:
        places = _places(words)[max(0, (error.offset or 1) - 1) :]
        near = words[places[0] :][:20] if places else "the end"
        found = f"`{words}` cannot be read at `{near}`"
        if unclosed := words.count("(") - words.count(")"):
            found += f": {abs(unclosed)} `{'(' if unclosed > 0 else ')'}` more than `{')' if unclosed > 0 else '('}`"
        expected = "an expression such as `-k*x + w`, `*` in every product, its numbers in SI and without units"
        if "|" in words:
            expected += "; a magnitude |v| is written abs(v)"
        raise BadInput(place, found, expected, code="SPEC010") from None
    except (RecursionError, MemoryError, ValueError):
        found = "an expression nested too deeply or with control characters"
        raise BadInput(place, found, "a simpler expression", code="SPEC010") from None
    return Expression(words, tree, place)


def _check(node: ast.expr, text: str, place: Place, depth: int = 1) -> None:
    """Raise BadInput for a node that is no arithmetic, RecursionError for a tree that is too deep."""
    if depth > DEEPEST:
        raise RecursionError
    what = _written(node, text)
    match node:
        case ast.Constant(value=bool() | None | str() | bytes()) | ast.Constant(value=complex()):
            raise BadInput(place, f"`{what}`", "a number, a name or an operation", code="SPEC011")
        case ast.Constant():
            exact_number(what, place)
        case ast.Name(id=name):
            if not NAME.match(name):
                expected = "letters, digits and _, starting with a letter"
                raise BadInput(place, f"the name `{name}`", expected, code="SPEC009")
        case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=operand):
            _check(operand, text, place, depth + 1)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            _check(left, text, place, depth + 1)
            _check(right, text, place, depth + 1)
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in FUNCTIONS:
            _check(argument, text, place, depth + 1)
        case ast.Call(func=ast.Name(id=name)) if name in FUNCTIONS:
            raise BadInput(place, f"`{what}`", f"one argument for {name}", code="SPEC011")
        case ast.Call(func=ast.Name(id=name)):
            expected = f"one of {', '.join(FUNCTIONS)}"
            nearest = OTHER_NAMES.get(name) or nearest_name(name, FUNCTIONS)
            raise BadInput(place, f"a call of `{name}`", expected, nearest, code="SPEC008")
        case _:
            raise BadInput(place, f"`{what}`", "numbers, names, + - * / ** and " + ", ".join(FUNCTIONS), code="SPEC011")


@dataclass(frozen=True)
class Algebra:
    """Interpretation of an expression's tree: the values of names, calls and operators.

    Attributes:
        names: name → value.
        expected: what is expected instead of an unknown name, for the message.
        call: function (name, argument, expression, node) → value.
        combine: function (operator, left, right, expression, node) → value.
    """

    names: Mapping[str, Any]
    expected: str
    call: Callable[[str, Any, Expression, ast.Call], Any]
    combine: Callable[[ast.operator, Any, Any, Expression, ast.BinOp], Any]


def evaluate_tree(node: ast.expr, whole: Expression, algebra: Algebra) -> Any:
    """The value of a node of an expression's tree in an algebra; numbers are exact rationals.

    Raises BadInput for an unknown name, and what ``algebra`` raises.
    """
    match node:
        case ast.Constant():
            return exact_number(whole.source(node), whole.place)
        case ast.Name(id=name) if name in algebra.names:
            return algebra.names[name]
        case ast.Name(id=name) if name in CONSTANTS:
            return CONSTANTS[name]
        case ast.Name(id=name):
            found = f"unknown name `{name}` in `{whole.text}`"
            expected = algebra.expected
            nearest = nearest_name(name, sorted(algebra.names))
            raise BadInput(whole.place, found, expected, nearest, code="SPEC008")
        case ast.UnaryOp(op=op, operand=operand):
            value = evaluate_tree(operand, whole, algebra)
            return -value if isinstance(op, ast.USub) else value
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            return algebra.call(name, evaluate_tree(argument, whole, algebra), whole, node)
        case ast.BinOp(left=left, op=op, right=right):
            sides = evaluate_tree(left, whole, algebra), evaluate_tree(right, whole, algebra)
            return algebra.combine(op, *sides, whole, node)
    raise BadInput(whole.place, f"`{whole.source(node)}`", "an arithmetic expression", code="SPEC011")


def _numbers_of(symbols: Mapping[str, sympy.Symbol], hint: str) -> Algebra:
    expected = f"one of {', '.join(sorted(symbols))}" if 0 < len(symbols) <= 40 else "a declared name"
    expected += f"; {hint}" if hint else ""
    return Algebra(symbols, expected, _called, combine_numbers)


def _called(name: str, argument: Any, whole: Expression, node: ast.expr) -> Any:
    """The SymPy value of a function.

    Raises BadInput for a constant with exp in the exponent of exp, since SymPy's time is exponential in their nesting.
    """
    if name == "exp" and argument.is_number and argument.has(sympy.exp):
        found = f"`{whole.source(node)}`, a constant with exp in exp"
        raise BadInput(whole.place, found, "the number itself", code="SPEC011")
    return FUNCTIONS[name](argument)


def combine_numbers(op: ast.operator, a: Any, b: Any, whole: Expression, node: ast.expr) -> Any:
    """The SymPy value of a binary operation; BadInput if it is too large or divides by zero."""

    def refused(why: str, expected: str, code: str) -> BadInput:
        return BadInput(whole.place, f"`{whole.source(node)}`{why}", expected, code=code)

    if isinstance(op, ast.Div) and b.is_zero:
        raise refused(" divides by zero", "a divisor that is not zero", "SPEC012")
    if isinstance(op, ast.Pow):
        if not (b.is_number and b.is_real) or abs(b) > 64:
            raise refused("", "a power whose exponent is a number up to 64", "SPEC011")
        if a.is_zero and b.is_negative:
            raise refused(" divides by zero", "a base that is not zero", "SPEC012")
    value = _OPERATORS[type(op)](a, b)
    too_long = value.is_Rational and value.p.bit_length() + value.q.bit_length() > LONGEST_NUMBER
    if too_long or (value.is_Pow and value.exp.is_number and abs(value.exp) > 64):
        raise refused(", too large", "powers up to 64 and smaller numbers", "SPEC011")
    return value


def comma_in_value(text: str) -> bool:
    """Whether a value is a number with a decimal comma, possibly followed by a unit or a per cent sign."""
    return _COMMA_VALUE.fullmatch(text) is not None


def _comma_in_expression(text: str) -> str | None:
    """The first number with a decimal comma in an expression; None if there is none.

    The comma of ``max(1,5)`` separates arguments; all of ``FUNCTIONS`` have one.
    """
    for found in _COMMA_INSIDE.finditer(text):
        call = _CALL.search(text[: found.start()])
        if call is None or call[1] in FUNCTIONS:
            return found[0]
    return None


def with_point(text: str) -> str:
    """The number with a point, ``0.05``; for ``1,000``, where the comma may separate thousands, both forms."""
    point = text.strip().replace(",", ".", 1)
    grouped = re.match(r"[-+]?[1-9]\d{0,2},\d{3}(?!\d)", text.strip())
    return f"`{point}`, or `{text.strip().replace(',', '', 1)}` without a separator" if grouped else f"`{point}`"

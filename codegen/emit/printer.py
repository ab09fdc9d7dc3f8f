"""SX → text: the one place where code is made of strings, and only for expressions.

An SX expression is taken apart into CasADi's own instruction list, in its order; what is used once is written in
place, what is used more often gets a local name. Each language is a table of words.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi

from codegen.errors import BadInput

ATOM, UNARY, PRODUCT, SUM = 4, 3, 2, 1


@dataclass(frozen=True)
class Language:
    """Words of a language for the operations; infix + − * / and parentheses are common to all.

    Attributes:
        calls: CasADi operation → function name.
        literal: how a number is written.
        declaration: format of a local definition, with {name} and {value}.
    """

    calls: Mapping[int, str]
    declaration: str

    def literal(self, value: float) -> str:
        """The shortest decimal that is this double, with a point so that C takes it for a double.

        Raises:
            BadInput: for a number that no literal can say.
        """
        if not math.isfinite(value):
            raise BadInput("generated code", f"the constant {value}", "numbers whose products a double can hold")
        return repr(float(value))


_CALLS = {
    casadi.OP_SIN: "sin",
    casadi.OP_COS: "cos",
    casadi.OP_TAN: "tan",
    casadi.OP_EXP: "exp",
    casadi.OP_LOG: "log",
    casadi.OP_SQRT: "sqrt",
    casadi.OP_TANH: "tanh",
    casadi.OP_POW: "pow",
    casadi.OP_CONSTPOW: "pow",
}
C = Language({**_CALLS, casadi.OP_FABS: "fabs", casadi.OP_SIGN: "signum"}, "const double {name} = {value};")
PYTHON = Language(
    {op: f"math.{name}" for op, name in _CALLS.items()} | {casadi.OP_FABS: "abs", casadi.OP_SIGN: "_sign"},
    "{name} = {value}",
)

_INFIX = {
    casadi.OP_ADD: (SUM, "+"),
    casadi.OP_SUB: (SUM, "-"),
    casadi.OP_MUL: (PRODUCT, "*"),
    casadi.OP_DIV: (PRODUCT, "/"),
}


@dataclass
class _Node:
    operation: int
    arguments: tuple[_Node, ...]
    text: str = ""
    uses: int = 0
    name: str = ""


@dataclass(frozen=True)
class Printed:
    """Lines of local definitions, and one expression for each output element."""

    definitions: tuple[str, ...]
    values: tuple[str, ...]
    operations: int
    calls: frozenset[int]


def print_expression(expression: Any, words: Mapping[str, str], language: Language, prefix: str) -> Printed:
    """Write an SX column in a language.

    Args:
        expression: k by 1 SX.
        words: name of every SX symbol in it → how the language refers to it.
        prefix: of the names of local definitions.

    Raises:
        TypeError: for a CasADi operation without a word.
        BadInput: for a constant that is not finite.
    """
    symbols = casadi.symvar(casadi.SX(expression))
    function = casadi.Function(
        "block", symbols, [casadi.cse(casadi.densify(casadi.SX(expression)))], {"allow_free": False}
    )
    outputs, order = _graph(function, [words[s.name()] for s in symbols], language)
    definitions: list[str] = []
    calls: set[int] = set()
    operations = 0
    for node in order:
        operations += node.operation not in (casadi.OP_INPUT, casadi.OP_CONST)
        calls.add(node.operation)
        if node.arguments and node.uses > 1:
            value, _ = _write(node, language, top=True)
            node.name = f"{prefix}_{len(definitions) + 1}"
            definitions.append(language.declaration.format(name=node.name, value=value))
    values = tuple(_write(outputs[k], language)[0] for k in range(len(outputs)))
    return Printed(tuple(definitions), values, operations, frozenset(calls))


def _graph(function: Any, inputs: Sequence[str], language: Language) -> tuple[dict[int, _Node], list[_Node]]:
    """The instruction list as nodes: registers are followed to what they hold at that moment."""
    register: dict[int, _Node] = {}
    outputs: dict[int, _Node] = {}
    order: list[_Node] = []
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        target, source = function.instruction_output(k), function.instruction_input(k)
        if operation == casadi.OP_OUTPUT:
            node = register[source[0]]
            node.uses += 1
            outputs[target[1]] = node
            continue
        if operation == casadi.OP_INPUT:
            node = _Node(operation, (), inputs[source[0]])
        elif operation == casadi.OP_CONST:
            node = _Node(operation, (), language.literal(function.instruction_constant(k)))
        else:
            node = _Node(operation, tuple(register[r] for r in source))
            for argument in node.arguments:
                argument.uses += 2 if operation == casadi.OP_SQ else 1
        register[target[0]] = node
        order.append(node)
    return outputs, order


def _write(node: _Node, language: Language, top: bool = False) -> tuple[str, int]:
    """(text, binding strength) of a node."""
    if node.name and not top:
        return node.name, ATOM
    if not node.arguments:
        return node.text, UNARY if node.text.startswith("-") else ATOM
    first = node.arguments[0]
    match node.operation:
        case casadi.OP_NEG:
            return f"-{_bound(first, language, UNARY + 1)}", UNARY
        case casadi.OP_SQ:
            text = _bound(first, language, UNARY + 1)
            return f"{text} * {text}", PRODUCT
        case casadi.OP_TWICE:
            return f"{language.literal(2.0)} * {_bound(first, language, PRODUCT + 1)}", PRODUCT
        case casadi.OP_INV:
            return f"{language.literal(1.0)} / {_bound(first, language, PRODUCT + 1)}", PRODUCT
        case operation if operation in _INFIX:
            strength, sign = _INFIX[operation]
            left = _bound(first, language, strength)
            right = _bound(node.arguments[1], language, strength + 1)
            return f"{left} {sign} {right}", strength
        case operation if operation in language.calls:
            arguments = ", ".join(_write(a, language)[0] for a in node.arguments)
            return f"{language.calls[operation]}({arguments})", ATOM
    raise TypeError(f"no word for CasADi operation {node.operation}")


def _bound(node: _Node, language: Language, least: int) -> str:
    text, strength = _write(node, language)
    return text if strength >= least else f"({text})"

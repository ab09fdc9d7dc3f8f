"""CasADi SX expressions as a graph, instruction by instruction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi

from codegen.base.errors import BadInput
from codegen.program.graph import Graph, Node

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
    casadi.OP_FABS: "abs",
    casadi.OP_SIGN: "sign",
}


def to_graph(expression: Any, names: Mapping[str, Node], graph: Graph) -> list[Node]:
    """The nodes of an SX column.

    Args:
        expression: k by 1 SX.
        names: the node of every SX symbol in it, by its name.

    Raises:
        TypeError: for a CasADi operation that no output language has.
        BadInput: for a constant that is not finite.
    """
    symbols = casadi.symvar(casadi.SX(expression))
    function = casadi.Function("block", symbols, [casadi.densify(casadi.SX(expression))], {"allow_free": False})
    register: dict[int, Node] = {}
    results: dict[int, Node] = {}
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        target, source = function.instruction_output(k), function.instruction_input(k)
        if operation == casadi.OP_OUTPUT:
            results[target[1]] = register[source[0]]
        elif operation == casadi.OP_INPUT:
            register[target[0]] = names[symbols[source[0]].name()]
        elif operation == casadi.OP_CONST:
            register[target[0]] = graph.number(_finite(function.instruction_constant(k)))
        else:
            register[target[0]] = _operation(operation, [register[r] for r in source], graph)
    return [results[k] for k in range(len(results))]


def _operation(operation: int, arguments: list[Node], graph: Graph) -> Node:
    a, b = arguments[0], arguments[-1]
    match operation:
        case casadi.OP_ADD:
            return graph.sum([(1, a), (1, b)])
        case casadi.OP_SUB:
            return graph.sum([(1, a), (-1, b)])
        case casadi.OP_MUL:
            return graph.product([a, b])
        case casadi.OP_DIV:
            return graph.quotient(a, b)
        case casadi.OP_NEG:
            return graph.negative(a)
        case casadi.OP_SQ:
            return graph.product([a, a])
        case casadi.OP_TWICE:
            return graph.product([graph.number(2.0), a])
        case casadi.OP_INV:
            return graph.quotient(graph.number(1.0), a)
        case operation if operation in _CALLS:
            return graph.call(_CALLS[operation], arguments)
    raise TypeError(f"no word for CasADi operation {operation}")


def _finite(value: float) -> float:
    if value - value != 0:
        raise BadInput(
            "generated code",
            f"the constant {value}",
            "parameters and gains whose products are within the range of a double",
            code="SPEC028",
        )
    return value

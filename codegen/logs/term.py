"""Terms: the value of a spec's variable as a column of the log or an expression of columns.

An expression is parsed by the parser of specs, and never evaluated as Python.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy

from codegen.base.errors import BadInput, Place
from codegen.logs.formats.source import Columns
from codegen.mechanics.casadi_form import at_points, function_of
from codegen.spec.expression import Expression, parse_expression

OPERATORS = set("+-*/(")


@dataclass(frozen=True)
class Term:
    """A column or an expression of columns.

    Attributes:
        columns: the file's columns that are needed.
        expression: None for an unchanged column.
        symbols: a symbol of the expression for each of ``columns``.
    """

    text: str
    columns: tuple[str, ...]
    expression: sympy.Expr | None = None
    symbols: tuple[sympy.Symbol, ...] = ()


def find_term(text: str, names: Sequence[str], place: Place) -> Term | None:
    """The term of a text: a column's name, its number counted from 1, or an expression of columns.

    In an expression, a character of a column's name that is no letter, digit or _ is written _, and a name that begins
    with a digit has a ``c`` before it.

    Returns:
        None for a text that is neither a column nor an expression of names.
    """
    if text in names:
        return Term(text, (text,))
    if text.isascii() and text.isdigit() and 1 <= int(text[:9]) <= len(names):
        name = names[int(text) - 1]
        return Term(text, (name if names.count(name) == 1 else text,))
    if not OPERATORS & set(text):
        return None
    try:
        parsed = parse_expression(text, place)
    except BadInput:
        return None
    return _expression(parsed, names, place)


def _expression(parsed: Expression, names: Sequence[str], place: Place) -> Term | None:
    used = set(re.findall(r"[A-Za-z_][A-Za-z0-9_]*", parsed.text))
    known: dict[str, str] = {}
    for name in names:
        called = identifier(name)
        if called in used and called in known:
            found = f"`{called}` in `{parsed.text}`, which stands for two columns"
            raise BadInput(place, found, "columns whose names differ in letters and digits", code="LOG004")
        known[called] = name
    symbols = {called: sympy.Symbol(called, real=True) for called in known}
    value = parsed.symbolic(symbols)
    free = sorted(value.free_symbols, key=str)
    if not free:
        return None
    return Term(parsed.text, tuple(known[s.name] for s in free), value, tuple(free))


def identifier(name: str) -> str:
    """The name of a column in an expression."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return plain if re.match(r"[A-Za-z]", plain) else f"c{plain}"


def columns_of(terms: Mapping[str, Term]) -> list[str]:
    """The file's columns that terms need, each once."""
    return list(dict.fromkeys(name for term in terms.values() for name in term.columns))


def compute(raw: Columns, terms: Mapping[str, Term]) -> Columns:
    """The values of terms, one column for each, in their order.

    ``raw``: at least the columns that ``columns_of`` names.
    """
    where = {name: k for k, name in enumerate(raw.names)}
    values = np.empty((len(raw.values), len(terms)))
    for j, term in enumerate(terms.values()):
        if term.expression is None:
            values[:, j] = raw.values[:, where[term.columns[0]]]
            continue
        rows = raw.values[:, [where[name] for name in term.columns]]
        values[:, j] = at_points(function_of(term.expression, term.symbols), rows).ravel()
    return Columns(raw.file, tuple(t.text for t in terms.values()), values, raw.lines)

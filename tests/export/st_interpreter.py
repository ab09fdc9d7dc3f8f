"""An interpreter of the subset of Structured Text (IEC 61131-3) that our function blocks are written in.

By the standard's grammar and precedence, on IEEE doubles: every LREAL operation is one of Python's floats, from left to
right where two bind alike. A division by zero, or the root or logarithm of what has none, raises, as a PLC stops there.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

TOKEN = re.compile(
    r"\s+|(?P<comment>\(\*.*?\*\))|(?P<number>LREAL#-?\d+\.\d+(?:E-?\d+)?|INT#\d+)|(?P<name>[A-Za-z]\w*)"
    r"|(?P<sign>:=|<=|>=|<>|[-+*/()<>=:;,])",
    re.DOTALL,
)
STANDARD: dict[str, Callable[..., float]] = {
    "SIN": math.sin,
    "COS": math.cos,
    "TAN": math.tan,
    "EXP": math.exp,
    "LN": math.log,
    "SQRT": math.sqrt,
    "ABS": abs,
    "EXPT": math.pow,
}


def tokens(text: str) -> list[str]:
    """Names in capitals, since Structured Text tells none apart; without comments."""
    found, at = [], 0
    while at < len(text):
        match = TOKEN.match(text, at)
        assert match is not None, f"no token at {text[at : at + 40]!r}"
        if match["name"] or match["number"] or match["sign"]:
            found.append(match[0].upper())
        at = match.end()
    return [*found, ""]


@dataclass
class Unit:
    """A function or function block: its variables with their first values, and what it does."""

    name: str
    inputs: list[str] = field(default_factory=list)
    variables: dict[str, Any] = field(default_factory=dict)
    body: list[tuple[Any, ...]] = field(default_factory=list)


class Parser:
    def __init__(self, text: str) -> None:
        self.given, self.at = tokens(text), 0

    def take(self, *wanted: str) -> str:
        token = self.given[self.at]
        assert not wanted or token in wanted, f"{token}, not {wanted}, after {self.given[self.at - 8 : self.at]}"
        self.at += 1
        return token

    def sees(self, *wanted: str) -> bool:
        return self.given[self.at] in wanted

    def units(self) -> dict[str, Unit]:
        found = {}
        while not self.sees(""):
            kind = self.take("FUNCTION", "FUNCTION_BLOCK")
            unit = Unit(self.take())
            if kind == "FUNCTION":
                self.take(":")
                self.take("LREAL")
                unit.variables[unit.name] = 0.0
            while self.sees("VAR", "VAR_INPUT", "VAR_OUTPUT"):
                self.declarations(unit)
            unit.body = self.statements()
            self.take(f"END_{kind}")
            found[unit.name] = unit
        return found

    def declarations(self, unit: Unit) -> None:
        section = self.take()
        if self.sees("CONSTANT"):
            self.take()
        while not self.sees("END_VAR"):
            name = self.take()
            assert name not in unit.variables, f"{name} twice"
            self.take(":")
            value: Any = {"LREAL": 0.0, "BOOL": False, "INT": 0}[self.take("LREAL", "BOOL", "INT")]
            if self.sees(":="):
                self.take()
                value = self.constant(self.take())
            self.take(";")
            unit.variables[name] = value
            if section == "VAR_INPUT":
                unit.inputs.append(name)
        self.take("END_VAR")

    def constant(self, token: str) -> Any:
        if token.startswith("INT#"):
            return int(token.removeprefix("INT#"))
        return token == "TRUE" if token in ("TRUE", "FALSE") else float(token.removeprefix("LREAL#"))

    def statements(self) -> list[tuple[Any, ...]]:
        found: list[tuple[Any, ...]] = []
        while not self.sees("END_IF", "ELSE", "ELSIF", "END_FUNCTION", "END_FUNCTION_BLOCK"):
            if self.sees("IF"):
                found.append(self.choice())
            else:
                name = self.take()
                self.take(":=")
                found.append(("set", name, self.expression()))
            self.take(";")
        return found

    def choice(self) -> tuple[Any, ...]:
        cases = []
        while self.sees("IF", "ELSIF"):
            self.take()
            condition = self.expression()
            self.take("THEN")
            cases.append((condition, self.statements()))
        otherwise = []
        if self.sees("ELSE"):
            self.take()
            otherwise = self.statements()
        self.take("END_IF")
        return "if", cases, otherwise

    def expression(self, level: int = 0) -> Any:
        """OR, then = and <>, then comparisons, then + and -, then * and /; each from left to right."""
        levels = (("OR",), ("=", "<>"), ("<", ">", "<=", ">="), ("+", "-"), ("*", "/"))
        if level == len(levels):
            return self.unary()
        left = self.expression(level + 1)
        while self.sees(*levels[level]):
            left = (self.take(), left, self.expression(level + 1))
        return left

    def unary(self) -> Any:
        if self.sees("NOT", "-"):
            return "not" if self.take() == "NOT" else "negative", self.unary()
        token = self.take()
        if token == "(":
            inner = self.expression()
            self.take(")")
            return inner
        if token.startswith(("LREAL#", "INT#")) or token in ("TRUE", "FALSE"):
            return "constant", self.constant(token)
        assert token[0].isalpha(), token
        if not self.sees("("):
            return "variable", token
        self.take("(")
        arguments = [self.expression()]
        while self.sees(","):
            self.take()
            arguments.append(self.expression())
        self.take(")")
        return "call", token, arguments


class Block:
    """An instance of a function block; ``call`` is one sample."""

    def __init__(self, text: str, name: str) -> None:
        self.units = Parser(text).units()
        self.unit = self.units[name.upper()]
        self.variables = dict(self.unit.variables)

    def call(self, **inputs: float) -> dict[str, Any]:
        self.variables |= {name.upper(): value for name, value in inputs.items()}
        self._run(self.unit.body, self.variables)
        return self.variables

    def _run(self, body: list[tuple[Any, ...]], at: dict[str, Any]) -> None:
        for kind, *parts in body:
            if kind == "set":
                assert parts[0] in at, f"{parts[0]} is not declared"
                new = self._value(parts[1], at)
                assert type(new) is type(at[parts[0]]), f"{parts[0]} is of another type"
                at[parts[0]] = new
                continue
            cases, otherwise = parts
            self._run(next((do for condition, do in cases if self._value(condition, at) is True), otherwise), at)

    def _value(self, e: Any, at: dict[str, Any]) -> Any:
        match e:
            case ("constant", value):
                return value
            case ("variable", name):
                return at[name]
            case ("not", inner):
                return not self._value(inner, at)
            case ("negative", inner):
                return -self._value(inner, at)
            case ("call", name, arguments):
                return self._called(name, [self._value(a, at) for a in arguments])
            case (sign, left, right):
                return self._binary(sign, self._value(left, at), self._value(right, at))
        raise AssertionError(e)

    def _called(self, name: str, values: list[float]) -> float:
        if name in STANDARD:
            finite = all(map(math.isfinite, values))
            return STANDARD[name](*values) if finite or name == "ABS" else math.nan
        unit = self.units[name]
        inner = dict(unit.variables) | dict(zip(unit.inputs, values, strict=True))
        self._run(unit.body, inner)
        return float(inner[name])

    def _binary(self, sign: str, a: Any, b: Any) -> Any:
        match sign:
            case "OR":
                return a or b
            case "+":
                return a + b
            case "-":
                return a - b
            case "*":
                return a * b
            case "/":
                return a / b
            case "=":
                return a == b
            case "<>":
                return a != b
            case "<":
                return a < b
            case ">":
                return a > b
            case "<=":
                return a <= b
        return a >= b

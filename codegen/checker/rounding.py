"""Refuses sums in the C that suffer from catastrophic cancellation.

Standard library only; part of the checker (verify.py), which hands ``frame`` and ``kernel`` in. The kernel's theorem is
in exact arithmetic. In doubles each parameter, number and exp has a relative rounding error of at most 2^-50, which a
large factor can amplify: 1e14 * (0.1 + 0.2 - 0.3) is 0 in exact arithmetic and 0.006 in doubles. So this ratio is
bounded by `cancelled` for each value assigned in a sample and each argument of a function or a quotient: the sum of
the absolute terms as written in the C, over the sum of the absolute coefficients of the polynomial that they add up to,
with all variables equal to 1. In the shipped code the ratio is at most 600 000.

So the size of a value times the rounding error of one number bounds the error of the value, to first order. A quotient
a/b and a function pass on the errors of their arguments: its size is |a| size(b)/b^2 and at most |f| size(argument). A
parameter that `prepare` computes has the size of its formula wherever it occurs, and is bounded there alone: of a load
equal to its counterweight nothing is left, but its rounding is small compared with the forces to which it is added.
How far its decimal in the header may be from its formula is bounded in errors.py.
"""

import ast
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import frame, kernel

EXP, NAME = r"\bexp *\(", r"[A-Za-z_][\w.]*(?:\[[\d.]+\])?"


def require(proof: dict[str, Any], shown: dict[str, Any]) -> None:
    """Raises ValueError if a sum in a function of the C, or in a formula of the proof with exp, may cancel too much.

    Args:
        shown: what errors.prove returned for the proof.
    """
    c, names, known = shown["c"], shown["names"], dict(shown["known"])  # of its reciprocals nothing is shown
    values = {x: names[x] for x in c.values}
    made = Sized({x: p for x, p in values.items() if x not in dict(c.prepare)}, known, c.precision)
    made.run(c.prepare, [*values])
    prepared = {x: size for x, size in made.sizes.items() if x in values}
    before = {x: p for x, p in names.items() if x not in c.outputs} | shown["before"]
    text = Sized(before, known, c.precision, prepared)
    text.run(c.step, [])
    text.run(c.commit, c.states + c.outputs)
    said = Sized(names, known, c.precision, prepared)
    rounded = of_exp(c.prepare)
    for formula in {*texts(proof)}:
        if re.search(EXP, formula) or rounded.intersection(re.findall(NAME, formula)):
            said.value(formula)
    free = values | {x: kernel.term(1, x) for x in (*c.inputs, *c.states, *c.outputs)}
    for program in (c.init, c.reset, c.predict, c.resume):
        Sized(free, {}, c.precision, prepared).run(program, c.states)


def texts(part: Any) -> Iterator[str]:
    """All texts in a JSON value but the names of its fields."""
    if isinstance(part, str):
        yield part
    elif part:
        for inner in part.values() if isinstance(part, dict) else part:
            yield from texts(inner)


def of_exp(prepare: list[tuple[str, str]]) -> set[str]:
    """Parameters that `prepare` computes from an exp, which the kernel evaluates to 50 digits, directly or not."""
    found: set[str] = set()
    for name, text in prepare:
        found |= {name} if re.search(EXP, text) or found.intersection(re.findall(NAME, text)) else set()
    return found


class Sized(kernel.Text):
    """Symbolic evaluation that also computes the size of every assigned value (module docstring).

    Args:
        sizes: size of names that are already set; for others it is the sum of the magnitudes of their coefficients.
            None for `prepare`, whose values may cancel.
    """

    def __init__(
        self, names: dict[str, Any], known: Any, precision: Any, sizes: dict[str, float] | None = None
    ) -> None:
        super().__init__(names, known, precision)
        self.sizes, self.latest, self.may_cancel = dict(sizes or {}), 0.0, sizes is None

    def run(self, assignments: list[tuple[str, str]], writable: list[str]) -> dict[str, Any]:
        for name, value in assignments:
            super().run([(name, value)], writable)
            self.sizes[name] = self.latest
        return self.names

    def value(self, text: str) -> Any:
        """The polynomial of an expression; the attribute ``latest`` is then its size."""
        p = super().value(text := text.strip(" "))
        self.latest = self.size(kernel.TREES[len(text) > 200](text, mode="eval").body, text)
        if not self.may_cancel:
            self.left(p, self.latest)
        return p

    def left(self, p: Any, size: float) -> float:
        """Returns the size; ValueError if the terms cancel so far that p is mostly rounding error."""
        frame.demand(size <= total(p) * self.precision.cancelled, "what is left of a sum is its rounding")
        return size

    def size(self, node: ast.expr, text: str) -> float:
        """The sum of the magnitudes of an expression's terms as written, with all variables equal to 1."""
        match node:
            case ast.UnaryOp(_, operand):
                return self.size(operand, text)
            case ast.Call(ast.Name(name), [argument], []):
                size = self.left(p := self.of(argument, text), self.size(argument, text))
                if name in ("fabs", "sgn"):
                    return size if name == "fabs" else 1.0
                value = kernel.function(name, p, self.known)
                return (1.0 if value.names() else total(value)) * max(1.0, size)
            case ast.BinOp(left, operator, right):
                a, b = self.size(left, text), self.size(right, text)
                if isinstance(operator, ast.Div):
                    self.left(p := self.of(right, text), b)
                    return a * b / total(p) ** 2
                return a * b if isinstance(operator, ast.Mult) else a + b
        here = text[node.col_offset : node.end_col_offset]
        return self.sizes[here] if here in self.sizes else total(self.of(node, text))


def total(p: Any) -> float:
    """The sum of the magnitudes of a polynomial's coefficients."""
    return float(sum(map(abs, p.values())))

"""Program → what the templates of a language need: fields, and for each block its comment and lines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi

from codegen.emit.printer import Language, Printed, print_expression
from codegen.program import Block, Field, Program


@dataclass(frozen=True)
class Line:
    """One assignment: a local or field name, its expression, its unit."""

    name: str
    value: str
    unit: str


@dataclass(frozen=True)
class BlockView:
    """A block in one language."""

    title: str
    source: str
    definitions: tuple[str, ...]
    lines: tuple[Line, ...]


@dataclass(frozen=True)
class ProgramView:
    """A program in one language."""

    blocks: tuple[BlockView, ...]
    next_state: BlockView
    initial_state: BlockView
    uses_sign: bool
    operations: int


def view(program: Program, language: Language, parameter: str, state: str, entry: str) -> ProgramView:
    """Print every block.

    Args:
        parameter, state, entry: formats with {name} that say how a struct's field is written.
    """
    words = _words(program.parameters, parameter) | _words(program.states, state) | _words(program.inputs, entry)
    words |= {element: element for block in program.blocks for element in block.elements}
    printed: list[Printed] = []

    def block_view(block: Block) -> BlockView:
        result = print_expression(block.expression, words, language, f"part_of_{block.name}")
        printed.append(result)
        lines = tuple(Line(n, v, u) for n, v, u in zip(block.elements, result.values, block.units, strict=True))
        return BlockView(block.name.replace("_", " "), block.source, result.definitions, lines)

    def fields_view(title: str, prefix: str, values: tuple[Any, ...]) -> BlockView:
        result = print_expression(casadi.vertcat(*values), words, language, f"part_of_{prefix}")
        printed.append(result)
        lines = tuple(Line(f.name, v, f.unit) for f, v in zip(program.states, result.values, strict=True))
        return BlockView(title, "", result.definitions, lines)

    blocks = tuple(block_view(block) for block in program.blocks)
    following = fields_view("states one sample later (explicit Euler)", "step", program.next_state)
    operations = sum(p.operations for p in printed)
    initial = fields_view("states at the first sample", "initial", program.initial_state)
    uses_sign = any(casadi.OP_SIGN in p.calls for p in printed)
    return ProgramView(blocks, following, initial, uses_sign, operations)


def _words(fields: tuple[Field, ...], pattern: str) -> dict[str, str]:
    return {f.name: pattern.format(name=f.name) for f in fields}

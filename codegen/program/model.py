"""The intermediate form: an ordered list of named blocks with shapes, units and sources, over CasADi SX.

Every language prints from this one list in this one order, so that two languages compute the same bits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from codegen.program.arrays import Element

PRECISIONS = ("double", "single")
FAULTS = ("hold", "none")
LARGEST = {"double": 1e150, "single": 1e18}
"""What a step holds is refused beyond this: a product of two such quantities does not overflow."""
HELD = "outputs."
"""Before the name of an output as the last good sample left it, as a symbol."""


@dataclass(frozen=True)
class Field:
    """A scalar of a struct: a parameter, state, input or output.

    Attributes:
        name: as in the spec where it has one there.
        unit, meaning: for the comment.
        value: the spec's value, or None.
        symbol: its SX symbol.
    """

    name: str
    unit: str
    meaning: str
    symbol: Any
    value: float | None = None


@dataclass(frozen=True)
class Block:
    """A named vector quantity.

    Attributes:
        name: what it is (``friction_level``).
        elements: a local name for each element (``a_hat_rail``).
        symbols: SX symbols that later blocks use for the elements, k by 1.
        expression: SX over fields and earlier blocks, k by 1.
        units: one per element.
        source: equation number.
        output: whether the elements are outputs.
        inner: whether an element is written under its name only where it is used more than once.
    """

    name: str
    elements: tuple[str, ...]
    symbols: Any
    expression: Any
    units: tuple[str, ...]
    source: str
    output: bool = False
    inner: bool = False


@dataclass(frozen=True)
class Program:
    """One observer, ready to print.

    Attributes:
        name: prefix of every symbol in C, package name in Python.
        kind, velocity: of the observer, for comments.
        parameters, states, inputs: struct fields in order.
        blocks: computed in order in a step.
        next_state: SX of each state one sample later, over fields and blocks.
        initial_state: SX of each state at the first sample, over parameters and inputs.
        carried_state: SX of each state after a sample that is lost, over parameters, states and held outputs;
            of ``most_lost`` in a row the next good sample has to set them.
        resumed_state: SX of each state as a good sample sets it so that the held estimates go on, over inputs too.
        precision: of the arithmetic, ``double`` or ``single``.
        fault: what a step does with samples that are not finite: ``hold`` the last estimate, or ``none``.
        integration: how the states are stepped, in words.
        arrays: the place of every field or element that is kept in an array; members stand side by side, in order.
    """

    name: str
    kind: str
    velocity: str
    parameters: tuple[Field, ...]
    states: tuple[Field, ...]
    inputs: tuple[Field, ...]
    blocks: tuple[Block, ...]
    next_state: tuple[Any, ...]
    initial_state: tuple[Any, ...]
    carried_state: tuple[Any, ...]
    resumed_state: tuple[Any, ...]
    most_lost: int = 1
    precision: str = "double"
    fault: str = "hold"
    integration: str = "explicit Euler"
    arrays: Mapping[str, Element] = field(default_factory=dict)

    def reference(self, name: str) -> str:
        """A field as every language writes it behind its struct: m, or x[3] of an array."""
        place = self.arrays.get(name)
        return name if place is None else f"{place.array}[{place.at}]"

    @property
    def places(self) -> dict[str, str]:
        """Parameter, state, input or output → its place in the structs: parameters.m, outputs.v_hat[3]."""
        structs = {"parameters": self.parameters, "state": self.states, "inputs": self.inputs}
        names = [(struct, f.name) for struct, fields in structs.items() for f in fields]
        names += [("outputs", name) for name, _, _ in self.outputs]
        return {name: f"{struct}.{self.reference(name)}" for struct, name in names}

    @property
    def outputs(self) -> tuple[tuple[str, str, str], ...]:
        """(name, unit, meaning) of every output in order."""
        return tuple(
            (element, unit, f"{block.name.replace('_', ' ')}, {block.source}")
            for block in self.blocks
            if block.output
            for element, unit in zip(block.elements, block.units, strict=True)
        )

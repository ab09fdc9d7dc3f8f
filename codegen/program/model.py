"""Intermediate representation of an observer: an ordered list of named blocks with units and sources, over CasADi SX.

Every language is printed from this list in this order, so that all of them compute the same bits.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import casadi

from codegen.program.arrays import Element

PRECISIONS = ("double", "single")
FAULTS = ("hold", "none")
LARGEST = {"double": 1e150, "single": 1e18}
"""Precision → largest accepted sum of a step's states; a product of two such quantities does not overflow."""
HELD = "outputs."
"""Prefix of the SX symbols of the last valid sample's outputs."""


@dataclass(frozen=True)
class Field:
    """A scalar field of a generated struct: a parameter, state or input.

    Attributes:
        value: the spec's value, or None.
        symbol: its SX symbol, made of the name.
    """

    name: str
    unit: str
    meaning: str
    value: float | None = None
    symbol: Any = None

    def __post_init__(self) -> None:
        if self.symbol is None:
            object.__setattr__(self, "symbol", casadi.SX.sym(self.name))


@dataclass(frozen=True)
class State:
    """A state, with the SX of its value at the next sample in each case.

    Attributes:
        following: after a valid sample, over fields and blocks.
        initial: at the first sample, over parameters and inputs.
        predicted: after an invalid sample, over parameters, states and held outputs.
        resumed: set by the first valid sample after many invalid ones, so that the estimates equal the held ones; None:
            as initial.
    """

    field: Field
    following: Any
    initial: Any
    predicted: Any
    resumed: Any = None


@dataclass(frozen=True)
class Block:
    """A named vector quantity.

    Attributes:
        name: a textbook term (``friction_level``).
        elements: a variable name for each element (``a_hat_rail``).
        expression: SX over fields and earlier blocks, k by 1.
        source: equation number.
        output: whether the elements are outputs.
        inner: whether an element is stored in a variable only if it is used more than once.
        symbols: SX symbols that later blocks use for the elements, k by 1, named like them.
    """

    name: str
    elements: tuple[str, ...]
    expression: Any
    units: tuple[str, ...]
    source: str
    output: bool = False
    inner: bool = False
    symbols: Any = None

    def __post_init__(self) -> None:
        if self.symbols is None:
            object.__setattr__(self, "symbols", casadi.vertcat(*[casadi.SX.sym(e) for e in self.elements]))


@dataclass(frozen=True, eq=False)
class Program:
    """Intermediate representation of one observer, from which every language is printed.

    Attributes:
        name: prefix of every symbol in C, package name in Python.
        kind, velocity: of the observer (``gcfo``; ``measured`` or ``estimated``), for comments.
        parameters, states, inputs: struct fields in order.
        blocks: computed in order in a step.
        next_state, initial_state, predicted_state, resumed_state: SX of each state in the four cases of ``State``.
        most_lost: number of consecutive invalid samples up to which the states are predicted; after more they are
            resumed.
        precision: of the arithmetic, ``double`` or ``single``.
        fault: handling of invalid samples: ``hold`` the last estimates, or ``none``.
        integration: method of the step, in words.
        arrays: name → array element, for fields and block elements in arrays; those of one array are adjacent, in
            order.
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
    predicted_state: tuple[Any, ...]
    resumed_state: tuple[Any, ...]
    most_lost: int = 1
    precision: str = "double"
    fault: str = "hold"
    integration: str = "explicit Euler"
    arrays: Mapping[str, Element] = field(default_factory=dict)

    @property
    def holds(self) -> bool:
        """Whether the generated step holds its estimates at an invalid sample, and sets the output ``fault``."""
        return self.fault == "hold"

    @property
    def real(self) -> str:
        """The C type of its numbers."""
        return "float" if self.precision == "single" else "double"

    def reference(self, name: str) -> str:
        """A field as written within its struct in every language: m, or x[3] of an array."""
        place = self.arrays.get(name)
        return name if place is None else f"{place.array}[{place.at}]"

    @property
    def places(self) -> dict[str, str]:
        """Name of a parameter, state, input or output → its place in the structs: parameters.m, outputs.v_hat[3]."""
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

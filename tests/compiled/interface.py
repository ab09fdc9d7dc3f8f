"""What a generated header declares: the four structs field by field, read from its text, so no emitter is trusted."""

from __future__ import annotations

import re
from dataclasses import dataclass

_STRUCT = re.compile(r"typedef struct \{(?P<body>[^}]*)\} (?P<name>\w+);")
_FIELD = re.compile(
    r"^\s*(?P<type>\w[\w ]*?) (?P<name>\w+)(?:\[(?P<count>\d+)\])?;(?:\s*/\*\s*(?P<comment>.*?)\s*\*/)?", re.MULTILINE
)
REALS = ("double", "float")


@dataclass(frozen=True)
class Member:
    """A field of a struct; ``count`` is 0 for a scalar, the length of an array otherwise."""

    type: str
    name: str
    count: int
    comment: str

    @property
    def elements(self) -> tuple[str, ...]:
        """How C writes each element."""
        return tuple(f"{self.name}[{k}]" for k in range(self.count)) if self.count else (self.name,)


@dataclass(frozen=True)
class Interface:
    """Attributes:
    real: ``double`` or ``float``.
    prepares: whether there is a NAME_prepare.
    """

    name: str
    real: str
    parameters: tuple[Member, ...]
    state: tuple[Member, ...]
    inputs: tuple[Member, ...]
    outputs: tuple[Member, ...]
    prepares: bool

    def elements(self, struct: str) -> tuple[str, ...]:
        return tuple(e for member in getattr(self, struct) for e in member.elements)

    @property
    def input_comments(self) -> tuple[str, ...]:
        """The comment of every input element."""
        return tuple(member.comment for member in self.inputs for _ in member.elements)

    @property
    def flags(self) -> tuple[int, ...]:
        """Places of the outputs that are no reals: the fault flag."""
        types = [member.type for member in self.outputs for _ in member.elements]
        return tuple(k for k, kind in enumerate(types) if kind not in REALS)


def read_interface(name: str, header: str) -> Interface:
    """Read NAME.h.

    Raises:
        KeyError: if one of the four structs is missing.
        ValueError: if a real is double in one place and float in another, or an input is no real.
    """
    found = {match["name"]: _members(match["body"]) for match in _STRUCT.finditer(header)}
    parameters, state, inputs, outputs = (
        found[f"{name}_{part}"] for part in ("parameters", "state", "inputs", "outputs")
    )
    reals = {m.type for members in (parameters, state, inputs, outputs) for m in members if m.type in REALS}
    if len(reals) != 1 or any(m.type not in REALS for m in inputs):
        raise ValueError(f"{name}.h: reals of type {sorted(reals)}, inputs {[m.type for m in inputs]}")
    return Interface(name, reals.pop(), parameters, state, inputs, outputs, f"{name}_prepare(" in header)


def _members(body: str) -> tuple[Member, ...]:
    return tuple(Member(m["type"], m["name"], int(m["count"] or 0), m["comment"] or "") for m in _FIELD.finditer(body))

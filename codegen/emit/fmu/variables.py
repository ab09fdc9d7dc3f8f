"""The variables of an FMU: what a Program's fields are to a simulator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from codegen.base.errors import BadInput, Place
from codegen.program import Program
from codegen.spec.units import base_units

PERIOD = "sample_time"
TIME, FAULT = "time", "fault"
_SI = {
    "kilogram": "kg",
    "meter": "m",
    "second": "s",
    "ampere": "A",
    "kelvin": "K",
    "mole": "mol",
    "candela": "cd",
    "radian": "rad",
}


@dataclass(frozen=True)
class Variable:
    """A scalar variable of an FMU.

    Attributes:
        reference: its value reference.
        name, unit, meaning: as in the Program; the unit is empty where it has none.
        role: ``time``, ``parameter``, ``constant``, ``input`` or ``output``.
        place: how the wrapper writes the struct's field.
        integer: whether it is an int in C.
        start: the value it begins with, as text; None where it is computed.
    """

    reference: int
    name: str
    unit: str
    meaning: str
    role: str
    place: str
    integer: bool = False
    start: str | None = None


@dataclass(frozen=True)
class Unit:
    """A unit by its exponents of SI base units; none are given where one is not a whole number."""

    name: str
    exponents: tuple[tuple[str, int], ...]


def variables_of(program: Program) -> tuple[Variable, ...]:
    """Time, parameters, inputs and outputs, numbered from 0 in this order.

    Raises:
        BadInput: for a name that FMI keeps for itself.
    """
    found = [Variable(0, TIME, "s", "time of the simulation", "time", "time")]

    def add(name: str, unit: str, meaning: str, role: str, struct: str, start: str | None = None) -> None:
        place = f"{struct}.{program.reference(name)}"
        unit = "" if unit == "1" else unit
        found.append(Variable(len(found), name, unit, meaning, role, place, start=start))

    for p in program.parameters:
        role = "constant" if p.name == PERIOD else "parameter"
        add(p.name, p.unit, p.meaning, role, "parameters", repr(float(p.value or 0.0)))
    for i in program.inputs:
        add(i.name, i.unit, i.meaning, "input", "inputs", "0.0")
    for name, unit, meaning in program.outputs:
        if name != FAULT:
            add(name, unit, meaning, "output", "outputs")
    if program.holds:
        meaning = "an input was not finite: the estimates are those of the sample before"
        found.append(Variable(len(found), FAULT, "", meaning, "output", f"outputs.{FAULT}", integer=True))
    taken = [variable.name for variable in found]
    for name in (TIME, FAULT):
        if taken.count(name) > 1:
            raise BadInput(
                f"spec {program.name}",
                f"a quantity called `{name}`",
                "another name, since every FMU has a variable of this one",
                code="SPEC009",
            )
    return tuple(found)


def units_of(variables: Sequence[Variable]) -> tuple[Unit, ...]:
    """Every unit in use once, in the order of its first use."""
    return tuple(_unit(name) for name in dict.fromkeys(v.unit for v in variables if v.unit))


def _unit(name: str) -> Unit:
    try:
        exponents = base_units(name, Place(name))
    except BadInput:
        return Unit(name, ())
    powers = {_SI.get(base, ""): power for base, power in exponents.items()}
    if "" in powers or any(float(p) != int(p) for p in powers.values()):
        return Unit(name, ())
    return Unit(name, tuple((base, int(powers[base])) for base in _SI.values() if powers.get(base)))

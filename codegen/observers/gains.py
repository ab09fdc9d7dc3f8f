"""Reading of gain matrices from a spec: a scalar, a list (diagonal) or rows, checked for shape and sign."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import sympy

from codegen.base.errors import BadInput, Faults, PlaceOf, nearest_name
from codegen.mechanics.sparse import diagonal
from codegen.mechanics.system import Matrix
from codegen.spec.expression import exact_number
from codegen.spec.model import ObserverChoice, Spec, symbol
from codegen.spec.motion_section import refuse_other_shape
from codegen.spec.schema import ObserverSection


@dataclass(frozen=True)
class GainMatrix:
    """A gain matrix of symbols, with their values.

    Attributes:
        matrix: symbols where the spec has a number, zeros elsewhere.
        values: symbol → exact value.
    """

    matrix: Matrix
    values: dict[sympy.Symbol, Any]

    def units(self, rows: Sequence[str], columns: Sequence[str]) -> dict[sympy.Symbol, str]:
        """Symbol → unit, that of its row times that of its column, which may differ from entry to entry."""
        return {
            self.matrix[i, j]: row + column
            for i, row in enumerate(rows)
            for j, column in enumerate(columns)
            if self.matrix[i, j] != 0
        }


def read_gain(
    spec: Spec,
    choice: ObserverChoice,
    name: str,
    rows: list[str],
    columns: list[str],
    sign: int = 0,
    optional: bool = False,
) -> GainMatrix:
    """The gain matrix ``name`` of a spec; BadInput for a missing gain, a wrong shape or a wrong sign.

    Args:
        rows, columns: names of contacts or coordinates, for the names of the symbols.
        sign: +1 or −1 if every entry of a diagonal gain must have this sign for stability, else 0.
        optional: whether the spec may omit the gain; it is then a structural zero, not a parameter.
    """
    raw = choice.gains.get(name)
    if raw is None and optional:
        return GainMatrix(Matrix(sympy.zeros(len(rows), len(columns))), {})
    if raw is None:
        found = f"gain `{name}` is missing (given: {', '.join(choice.gains) or 'none'})"
        raise BadInput(spec.place("observer.gains"), found, f"`{name}:` for {choice.kind}", code="SPEC003")
    place = spec.place(f"observer.gains.{name}")
    shape, square = f"{len(rows)} by {len(columns)}", len(rows) == len(columns)
    if not isinstance(raw, list):
        if not square:
            raise BadInput(place, f"{name}: {raw}", f"{shape} rows, since the matrix is not square", code="SPEC015")
        raw = [raw] * len(rows)
    elif all(isinstance(entry, list) for entry in raw):
        return _full(spec, name, raw, rows, columns)
    elif any(isinstance(entry, list) for entry in raw) or len(raw) != len(rows) or not square:
        expected = f"a scalar, {len(rows)} diagonal entries or {shape} rows"
        if not square:
            expected = f"{shape} rows, since the matrix is not square"
        elif len(rows) == 1:
            expected = "one number"
        raise BadInput(place, f"{name} of length {len(raw)}", expected, code="SPEC015")
    numbers = [exact_number(str(entry), place) for entry in raw]
    for label, number in zip(rows, numbers, strict=True):
        if sign and number * sign <= 0:
            found = f"{name} = {float(number):g}" + (f" on {label}" if len(rows) > 1 else "")
            raise BadInput(place, found, "a positive gain" if sign > 0 else "a negative gain", code="SPEC007")
    symbols = [symbol(name if len(rows) == 1 else f"{name}_{label}") for label in rows]
    return GainMatrix(diagonal(symbols), dict(zip(symbols, numbers, strict=True)))


def _full(spec: Spec, name: str, raw: Any, rows: list[str], columns: list[str]) -> GainMatrix:
    """A gain matrix that is given by rows; zeros off the diagonal are structural."""
    key = f"observer.gains.{name}"
    place = spec.place(key)
    refuse_other_shape(raw, (len(rows), len(columns)), key, spec.place, what=f"{name} of ")
    matrix, values = sympy.zeros(len(rows), len(columns)), {}
    for i, row in enumerate(rows):
        for j, column in enumerate(columns):
            number = exact_number(str(raw[i][j]), place)
            if number == 0 and i != j:
                continue
            s = symbol(name if len(rows) == len(columns) == 1 else f"{name}_{row}_{column}")
            matrix[i, j], values[s] = s, number
    return GainMatrix(Matrix(matrix), values)


def refuse_unknown_gains(choice: ObserverChoice | ObserverSection, place_of: PlaceOf, known: Sequence[str]) -> None:
    """Raise BadInput for gains that this observer does not have; ``place_of``: key → its file and line."""
    faults = Faults()
    for name in choice.gains:
        place = place_of(f"observer.gains.{name}")
        with faults.noting():
            if name == "K_v" and choice.velocity == "measured":
                expected = "no K_v with `velocity: measured`, since it is the gain of the velocity observer"
                raise BadInput(place, "a gain `K_v`", expected, "velocity: estimated", code="SPEC004")
            if name not in known:
                missing = [gain for gain in known if gain not in choice.gains]
                meant = nearest_name(name, missing or known) or (missing[0] if len(missing) == 1 else None)
                expected = f"{', '.join(known)} for {choice.kind}"
                raise BadInput(place, f"unknown gain `{name}`", expected, meant, code="SPEC008")
    faults.raise_noted()

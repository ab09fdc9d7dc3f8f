"""Checks of units in the equation of motion, in energies and of bodies.

A generalised force has the unit of an energy over that of its coordinate.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import sympy

from codegen.base.errors import BadInput, Faults, Place, PlaceOf
from codegen.spec.dimensions import dimension_of
from codegen.spec.expression import Expression, parse_expression
from codegen.spec.model import Coordinate, Input
from codegen.spec.motion import Body, position_name, rate_name
from codegen.spec.schema import SpecDocument
from codegen.spec.si_units import Dimension
from codegen.spec.units import describe, dimension, parse_unit

Entries = list[list[Expression]]
Term = tuple[str, Place, Any]
"""Name, place and dimension of a term; None for the dimension of a bare number."""


class Units:
    """Dimensions of all names of a spec, and checks of expressions against required dimensions.

    A bare number may have any unit, except inside a sum.
    """

    def __init__(
        self, document: SpecDocument, coordinates: Sequence[Coordinate], inputs: Sequence[Input], place: PlaceOf
    ) -> None:
        self.place = place
        self.second, self.metre, self.kilogram, self.energy, self.number = (
            dimension(parse_unit(text, place("name"))) for text in ("s", "m", "kg", "J", "1")
        )
        self.coordinates = [dimension(parse_unit(c.unit, place(f"coordinates.{c.name}.unit"))) for c in coordinates]
        self._velocities = [c.velocity for c in coordinates]
        self.names: dict[str, Dimension] = {}
        for c, of in zip(coordinates, self.coordinates, strict=True):
            self.names |= {c.name: of, c.velocity: of / self.second}
        for name, p in document.parameters.items():
            self.names[name] = dimension(parse_unit(p.unit, place(f"parameters.{name}.unit")))
        for i in inputs:
            self.names[i.name] = dimension(parse_unit(i.unit, place(f"inputs.{i.name}.unit")))
        self.contacts = [
            dimension(parse_unit(c.unit, place(f"friction.contacts[{k}].unit")))
            for k, c in enumerate(document.friction.contacts)
        ]

    def of_direction(self, direction: str) -> Dimension:
        """The dimension of a body's position: a length, or none for an angle."""
        return self.number if direction == "angle" else self.metre

    def with_bodies(self, bodies: Sequence[Body]) -> Mapping[str, Dimension]:
        """Name → dimension, with the bodies' positions and velocities added."""
        names = dict(self.names)
        for body in bodies:
            for direction in body.positions:
                of = self.of_direction(direction)
                names |= {position_name(body.name, direction): of, rate_name(body.name, direction): of / self.second}
        return names

    def check(
        self, expression: Expression, wanted: Dimension, what: str, names: Mapping[str, Dimension] | None = None
    ) -> None:
        """Raise BadInput if an expression does not have the dimension ``wanted``."""
        found = dimension_of(expression, names or self.names)
        if found is not None and found != wanted:
            words = f"{what} `{expression.text}` in {describe(found)}"
            raise BadInput(expression.place, words, describe(wanted), code="SPEC014")

    def read(
        self, text: str, key: str, symbols: Mapping[str, sympy.Symbol], wanted: Dimension, what: str
    ) -> sympy.Expr:
        """The expression at a key over some symbols; BadInput if it does not have the dimension ``wanted``."""
        expression = parse_expression(text, self.place(key))
        value = expression.symbolic(symbols)
        self.check(expression, wanted, what)
        return value

    def check_rows(self, force: Entries, distribution: Entries | None) -> None:
        """Raise BadInput unless each force, and each U_ik λ_k, has the unit of energy over that of its coordinate."""
        faults = Faults()
        for i, of in enumerate(self.coordinates):
            with faults.noting():
                self.check(force[i][0], self.energy / of, "force")
                for words, place, found in self._friction(distribution[i] if distribution is not None else ()):
                    if found != self.energy / of:
                        found_words = f"{words} gives {describe(found)}"
                        raise BadInput(place, found_words, describe(self.energy / of), code="SPEC014")
        faults.raise_noted()

    def check_equation(self, mass: Entries, force: Entries, distribution: Entries) -> None:
        """Raise BadInput at the first term of M v' = g − U λ whose dimension differs from that of its row.

        The faults of all rows are raised together.
        """
        faults = Faults()
        for i, row in enumerate(mass):
            with faults.noting():
                self._check_row(row, force[i][0], distribution[i])
        faults.raise_noted()

    def _check_row(self, mass: Sequence[Expression], g: Expression, distribution: Sequence[Expression]) -> None:
        terms: list[Term] = [(f"force `{g.text}`", g.place, dimension_of(g, self.names))]
        for m, velocity, of in zip(mass, self._velocities, self.coordinates, strict=True):
            found = dimension_of(m, self.names)
            rate = None if found is None else found * of / self.second**2
            terms.append((f"mass_matrix `{m.text}` times the rate of {velocity}", m.place, rate))
        known = [term for term in (*terms, *self._friction(distribution)) if term[2] is not None]
        for words, place, of in known:
            if of != known[0][2]:
                expected = f"{describe(known[0][2])}, the unit of {known[0][0]} in the same row"
                raise BadInput(place, f"{words} gives {describe(of)}", expected, code="SPEC014")

    def _friction(self, row: Sequence[Expression]) -> list[Term]:
        """U_ik λ_k of a row of U, without its zeros."""
        terms = list[Term]()
        for k, (u, force) in enumerate(zip(row, self.contacts, strict=False), 1):
            of = dimension_of(u, self.names)
            if u.text.strip() not in ("0", "0.0"):
                label = f"distribution `{u.text}` times the friction of contact {k}"
                terms.append((label, u.place, force if of is None else of * force))
        return terms

    def slip(self, along: Mapping[str, Expression]) -> Any:
        """The dimension of a contact's slip, Σ part · direction; None if bare numbers leave it open.

        ``along``: direction of a body's motion → its factor in the slip.
        """
        found: Any = None
        for direction, part in along.items():
            factor = dimension_of(part, self.names)
            of = self.of_direction(direction) if factor is None else factor * self.of_direction(direction)
            if found is not None and of != found:
                words = f"`{part.text}` times {direction} in {describe(of)}"
                raise BadInput(part.place, words, f"{describe(found)}, as the directions before it", code="SPEC014")
            found = of
        return found

    def check_contact(self, index: int, slip: Dimension) -> None:
        """Raise BadInput unless friction times slip velocity is a power."""
        wanted = self.energy / slip
        if self.contacts[index] != wanted:
            own, place = self.contacts[index], self.place(f"friction.contacts[{index}].unit")
            raise BadInput(place, f"friction in {describe(own)}", describe(wanted), code="SPEC014")

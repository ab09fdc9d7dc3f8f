"""Do the units of M v' = g − U λ fit together? Each row is a force, and each term in it must be that force."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from codegen.base.errors import BadInput, Place
from codegen.spec.expression import Expression
from codegen.spec.model import Coordinate, Input
from codegen.spec.schema import ContactSection, ParameterSection
from codegen.spec.units import describe, dimension, dimension_of, parse_unit

Entries = list[list[Expression]]


def check_dimensions(
    coordinates: Sequence[Coordinate],
    inputs: Sequence[Input],
    parameters: Mapping[str, ParameterSection],
    mass: Entries,
    force: Entries,
    distribution: Entries,
    contacts: Sequence[ContactSection],
    place: Callable[[str], Place],
) -> None:
    """Check every term of the equation of motion.

    A bare number may stand for any unit; inside a sum it may not.

    Raises:
        BadInput: at the first entry whose unit does not fit its row.
    """
    second = dimension(parse_unit("s", place("coordinates")))
    position = {c.name: dimension(parse_unit(c.unit, place(f"coordinates.{c.name}.unit"))) for c in coordinates}
    velocity = {c.velocity: position[c.name] / second for c in coordinates}
    constant = {n: dimension(parse_unit(p.unit, place(f"parameters.{n}.unit"))) for n, p in parameters.items()}
    entry = {i.name: dimension(parse_unit(i.unit, place(f"inputs.{i.name}.unit"))) for i in inputs}
    names = position | velocity | constant | entry
    friction = [dimension(parse_unit(c.unit, place(f"friction.contacts[{k}].unit"))) for k, c in enumerate(contacts)]

    for i in range(len(coordinates)):
        row: Any = None
        for term, of in _terms(i, coordinates, velocity, second, mass, force, distribution, friction, names):
            if of is None:
                continue
            if row is None:
                row = (term, of)
            elif row[1] != of:
                found = f"{term[0]} gives {describe(of)}"
                raise BadInput(
                    term[1], found, f"{describe(row[1])}, the unit of {row[0][0]} in the same row", code="SPEC014"
                )


def _terms(
    i: int,
    coordinates: Sequence[Coordinate],
    velocity: Mapping[str, Any],
    second: Any,
    mass: Entries,
    force: Entries,
    distribution: Entries,
    friction: Sequence[Any],
    names: Mapping[str, Any],
) -> list[tuple[tuple[str, Place], Any]]:
    """(what it is and where, its dimension) for each term of row i; None where a bare number leaves it open."""
    g = force[i][0]
    terms: list[tuple[tuple[str, Place], Any]] = [((f"force `{g.text}`", g.place), dimension_of(g, names))]
    for j, c in enumerate(coordinates):
        m = mass[i][j]
        of = dimension_of(m, names)
        label = f"mass_matrix `{m.text}` times the rate of {c.velocity}"
        terms.append(((label, m.place), None if of is None else of * velocity[c.velocity] / second))
    for k, force_dimension in enumerate(friction):
        u = distribution[i][k]
        of = dimension_of(u, names)
        if of is None and u.text.strip() in ("0", "0.0"):
            continue
        label = f"distribution `{u.text}` times the friction of contact {k + 1}"
        terms.append(((label, u.place), force_dimension if of is None else of * force_dimension))
    return terms

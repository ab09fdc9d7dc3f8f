"""Reading of the sections of a spec that give M(x) v' = g(x, v, w) − U(x) λ.

A spec has exactly one of these forms: M as expressions (``mass_matrix:``), bodies (``topology:``, ``constraints:``),
energies (``lagrangian:``) or a robot file (``urdf:``). g is in ``force:``, U in ``friction.distribution``.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import sympy

from codegen.base.errors import BadInput, Faults, PlaceOf, refuse_unknown
from codegen.spec.bodies_section import read_bodies, read_body_forces, read_equations, read_sliding
from codegen.spec.expression import Expression, parse_expression
from codegen.spec.model import NO_INPUTS, Coordinate, Input, symbol
from codegen.spec.motion import DIRECTIONS, Constraints, Form, KinematicTree, Lagrangian, Sliding, Topology
from codegen.spec.motion_units import Units
from codegen.spec.schema import SpecDocument

FORMS = ("mass_matrix", "topology", "constraints", "lagrangian", "urdf")
Rows = list[list[Expression]]
Symbols = dict[str, sympy.Symbol]


def refuse_no_form(keys: Iterable[str], place: PlaceOf) -> None:
    """Raise BadInput where none of the ``keys`` of a spec states its equation of motion."""
    if not {*FORMS} & {*keys}:
        expected = "`mass_matrix:` with `force:`, or one of `topology:`, `constraints:`, `lagrangian:` and `urdf:`"
        raise BadInput(place("mass_matrix"), "key `mass_matrix` is missing", expected, code="SPEC003")


@dataclass(frozen=True)
class Motion:
    """The equation of motion in the form of the spec; attributes as of ``Spec``, ``slidings`` one per contact."""

    mass_matrix: sympy.ImmutableMatrix | None
    force: sympy.ImmutableMatrix
    distribution: sympy.ImmutableMatrix | None
    form: Form | None
    slidings: tuple[Sliding | None, ...]


def read_motion(
    document: SpecDocument,
    coordinates: Sequence[Coordinate],
    inputs: Sequence[Input],
    place: PlaceOf,
    tree: KinematicTree | None,
) -> Motion:
    """The equation of motion from ``mass_matrix`` or the section that replaces it, ``force`` and ``friction``.

    ``tree``: kinematic tree of the robot file of ``urdf:``.
    """
    return _MotionReader(document, coordinates, inputs, place).motion(tree)


class _MotionReader:
    """Reader of one document; ``position``, ``velocity``, ``constant`` and ``input`` map names to symbols."""

    def __init__(
        self, document: SpecDocument, coordinates: Sequence[Coordinate], inputs: Sequence[Input], place: PlaceOf
    ) -> None:
        self.document, self.place, self.coordinates, self.inputs = document, place, coordinates, inputs
        self.position: Symbols = {c.name: symbol(c.name) for c in coordinates}
        self.velocity: Symbols = {c.velocity: symbol(c.velocity) for c in coordinates}
        self.constant: Symbols = {name: symbol(name) for name in document.parameters}
        self.input: Symbols = {i.name: symbol(i.name) for i in inputs}

    def motion(self, tree: KinematicTree | None) -> Motion:
        """The equation of motion."""
        d, n = self.document, len(self.coordinates)
        kind = self._form_kind()
        rows = d.force if d.force is not None else ["0"] * n
        faults, constant = Faults(), self.position | self.constant
        names = constant | self.velocity | self.input
        hint = "" if self.inputs else NO_INPUTS
        force, forces = self._matrix("force", [[row] for row in rows], (n, 1), names, faults, hint, column=True)
        distribution = matrix_u = mass = mass_matrix = None
        if d.friction.distribution is not None:
            shape = n, len(d.friction.contacts)
            distribution, matrix_u = self._matrix(
                "friction.distribution", d.friction.distribution, shape, constant, faults
            )
        if d.mass_matrix is not None:
            mass, mass_matrix = self._matrix("mass_matrix", d.mass_matrix, (n, n), constant, faults)
        faults.raise_noted()
        units = Units(d, self.coordinates, self.inputs, self.place)
        no_slidings = (None,) * len(d.friction.contacts)
        if kind == "mass_matrix":
            assert mass is not None and distribution is not None
            units.check_equation(mass, force, distribution)
            return Motion(mass_matrix, forces, matrix_u, None, no_slidings)
        units.check_rows(force, distribution)
        if kind == "urdf":
            return Motion(None, forces, matrix_u, tree, no_slidings)
        if kind == "lagrangian":
            return Motion(None, forces, matrix_u, self._lagrangian(units), no_slidings)
        form = self._topology(units) if kind == "topology" else self._constraints(units)
        slidings: list[Sliding | None] = []
        for k in range(len(d.friction.contacts)):
            with faults.noting():
                slidings.append(read_sliding(d, kind, form.bodies, k, constant, units))
        faults.raise_noted()
        return Motion(None, forces, matrix_u, form, tuple(slidings))

    def _form_kind(self) -> str:
        """The name in ``FORMS`` that the spec uses; BadInput for keys that are missing or not allowed with it."""
        d = self.document
        present = [name for name in FORMS if getattr(d, name) is not None]
        refuse_no_form(present, self.place)
        if len(present) > 1:
            first, second = sorted(present, key=lambda name: self.place(name).line or 0)[:2]
            found = f"both `{first}` and `{second}`"
            raise BadInput(self.place(second), found, "one way to state the equation of motion", code="SPEC005")
        (kind,) = present
        if d.force is None and kind in ("mass_matrix", "topology"):
            raise BadInput(self.place("force"), "key `force` is missing", "`force:`", code="SPEC003")
        if d.friction.distribution is None and kind in ("mass_matrix", "lagrangian"):
            key = "friction.distribution"
            wanted = "`distribution:`, coordinates by contacts"
            raise BadInput(self.place(key), f"key `{key}` is missing", wanted, code="SPEC003")
        for k, contact in enumerate(d.friction.contacts):
            for name in ("bodies", "along"):
                if getattr(contact, name) is not None and kind in ("mass_matrix", "lagrangian", "urdf"):
                    key = f"friction.contacts[{k}].{name}"
                    expected = f"`distribution:` alone with `{kind}:`; `bodies:` needs `topology:` or `constraints:`"
                    raise BadInput(self.place(key), f"`{name}` of contact {contact.name}", expected, code="SPEC004")
        return kind

    def _topology(self, units: Units) -> Topology:
        """Bodies whose positions are the coordinates, each that of exactly one body (A.1.1 of the thesis)."""
        section = self.document.topology
        assert section is not None
        used_by: dict[str, str] = {}
        for body, directions in section.bodies.items():
            for key in (direction for direction in DIRECTIONS if getattr(directions, direction) is not None):
                name, where = str(getattr(directions, key)).strip(), f"topology.bodies.{body}.{key}"
                functions = "positions that are functions belong to `constraints:`"
                expected = f"a coordinate ({', '.join(self.position)}); {functions}"
                refuse_unknown(name, self.position, self.place(where), "position", expected, code="SPEC008")
                if name in used_by:
                    found = f"`{name}`, which {used_by[name]} uses already"
                    expected = "a coordinate for each body; bodies that move together belong to `constraints:`"
                    raise BadInput(self.place(where), found, expected, code="SPEC009")
                used_by[name] = where
        bodies = read_bodies("topology", section.bodies, self.position, units, self.constant)
        for name in self.position:
            if name not in used_by:
                found = f"coordinate {name}, which is not the position of any body"
                raise BadInput(self.place("topology.bodies"), found, f"a body with `{name}`", code="SPEC003")
        return Topology(bodies)

    def _constraints(self, units: Units) -> Constraints:
        section = self.document.constraints
        assert section is not None
        bodies = read_bodies("constraints", section.bodies, self.position | self.constant, units, self.constant)
        names = self.position | self.velocity | self.constant | self.input
        forces = read_body_forces(section.force, bodies, names, units)
        return Constraints(bodies, forces, read_equations(section.equations, bodies, self.constant, units))

    def _lagrangian(self, units: Units) -> Lagrangian:
        section = self.document.lagrangian
        assert section is not None
        names, faults = self.position | self.constant, Faults()
        kinetic = self._energy("kinetic", section.kinetic, names | self.velocity, units, faults)
        potential = self._energy("potential", section.potential, names, units, faults)
        faults.raise_noted()
        return Lagrangian(kinetic, potential)

    def _energy(self, name: str, terms: list[str], names: Symbols, units: Units, faults: Faults) -> sympy.Expr:
        total: sympy.Expr = sympy.S.Zero
        for k, text in enumerate(terms):
            with faults.noting():
                total += units.read(text, f"lagrangian.{name}[{k}]", names, units.energy, f"{name} energy")
        return total

    def _matrix(
        self,
        key: str,
        rows: list[list[str]],
        shape: tuple[int, int],
        names: Symbols,
        faults: Faults,
        hint: str = "",
        column: bool = False,
    ) -> tuple[Rows, sympy.ImmutableMatrix]:
        """The parsed entries of a matrix, and their symbolic form over ``names``; faults of each entry are noted.

        Where a fault was noted, the parsed entries are incomplete and the symbolic form is empty.
        """
        before, parsed, values = len(faults.noted), list[list[Expression]](), list[list[sympy.Expr]]()
        with faults.noting():
            if column and len(rows) != shape[0]:
                found, expected = (f"{n} entr{'y' if n == 1 else 'ies'}" for n in (len(rows), shape[0]))
                raise BadInput(self.place(key), found, f"{expected}, one a coordinate", code="SPEC015")
            meaning = " (coordinates by contacts)" if key == "friction.distribution" else ""
            refuse_other_shape(rows, shape, key, self.place, meaning=meaning)
        for i, row in enumerate(rows):
            parsed.append([])
            values.append([])
            for j, text in enumerate(row):
                with faults.noting():
                    entry = parse_expression(text, self.place(f"{key}[{i}]" if column else f"{key}[{i}][{j}]"))
                    values[-1].append(entry.symbolic(names, hint))
                    parsed[-1].append(entry)
        return parsed, sympy.ImmutableMatrix([] if len(faults.noted) > before else values)


def refuse_other_shape(
    rows: Sequence[Sequence[Any]], shape: tuple[int, int], key: str, place: PlaceOf, what: str = "", meaning: str = ""
) -> None:
    """Raise BadInput if a matrix does not have ``shape``, at the first row that is too short or too long.

    Args:
        what: text of the message before the rows, such as ``K_F of ``.
        meaning: text after the shape.
    """
    odd = [i for i, row in enumerate(rows) if len(row) != shape[1]]
    if len(rows) == shape[0] and not odd:
        return
    at = place(key)
    if len({len(row) for row in rows}) > 1:
        found = f"{len(rows)} rows, of which " + ", ".join(f"row {i + 1} has {len(rows[i])} entries" for i in odd)
        at = replace(at, line=place(f"{key}[{odd[0]}]").line)
    else:
        found = f"{len(rows)} row{'s' * (len(rows) != 1)} of {len(rows[0]) if rows else 0}"
    expected = f"{shape[0]} by {shape[1]}{meaning}"
    raise BadInput(at, what + found.replace(" 1 entries", " 1 entry"), expected, code="SPEC015")

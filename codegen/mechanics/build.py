"""Construction of the ``System`` of a spec: M, g, U, contacts and parameter values, with a check of M(x).

M(x) must be symmetric and positive definite at sampled points of the envelope.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy

from codegen.base.errors import BadInput, Faults
from codegen.mechanics.base_parameters import LinkParameter
from codegen.mechanics.contacts import build_contacts
from codegen.mechanics.motion import equation_of_motion, form_key
from codegen.mechanics.sampling import numbers_over, position_range
from codegen.mechanics.system import Matrix, System
from codegen.spec.expression import decimal_of
from codegen.spec.model import Spec, symbol
from codegen.spec.numerics import numerical
from codegen.spec.units import coherent_name, dimension, parse_unit

SAMPLES = 400
"""Random points of the envelope at which M(x) is checked."""
CORNERED = 6
"""Number of coordinates of which all vertices and mid-points of the ranges are checked, 3⁶ points; the others are at
mid-range."""
SYMMETRY = 1e-12
"""Tolerance of the symmetry of M, relative to its largest entry: M_ij and M_ji may be written in different forms."""
MOST_VALUES = 4
"""Largest number of parameters whose values a message shows."""
PI = symbol("pi")
"""Parameter in place of π in M, g and U; its value is the double, as that of a lead in mm/rev is rounded to one.

So a certificate, its bounds and the proof of the C have rational numbers."""
MASSES = {"kg": "mass", "kg*m^2": "moment of inertia"}
"""Unit → kind of a parameter that must not be negative."""


@numerical("the mass matrix, the force and where friction acts")
def build_system(spec: Spec, free: Sequence[LinkParameter] = ()) -> System:
    """The system that a spec declares, without its ``effects``.

    ``free``: base parameters of the robot file that become symbols of the system, for a fit; the others are numbers.
    Raises BadInput for an unknown law, for a law parameter that is missing, unknown or out of range, for a mass matrix
    that is not symmetric, or not positive definite somewhere in the envelope, and as ``equation_of_motion``.
    """
    values: dict[sympy.Symbol, Any] = {symbol(p.name): p.value for p in spec.parameters}
    units = {symbol(p.name): coherent_name(p.unit, spec.place(f"parameters.{p.name}.unit")) for p in spec.parameters}
    values |= {symbol(p.name): decimal_of(float(p.value)) for p in free}
    units |= {symbol(p.name): p.unit for p in free}
    mass_matrix, force, distribution = (m.xreplace({sympy.pi: PI}) for m in equation_of_motion(spec, free))
    if any(m.has(PI) for m in (mass_matrix, force, distribution)):
        values[PI], units[PI] = decimal_of(math.pi), "1"
    contacts, law_values, law_units = build_contacts(spec, distribution)
    for name in law_values:
        if name in values:
            contact = next(c for c in contacts if name in c.law_parameters.values())
            key = f"friction.contacts[{contacts.index(contact)}]"
            found = f"the name `{name}`, which the generated code uses for a parameter of {spec.place(key)}"
            raise BadInput(spec.place(f"parameters.{name}"), found, "two different names", code="SPEC009")
    system = System(
        name=spec.name,
        positions=tuple(symbol(c.name) for c in spec.coordinates),
        velocities=tuple(symbol(c.velocity) for c in spec.coordinates),
        inputs=tuple(symbol(i.name) for i in spec.inputs),
        position_units=tuple(c.unit for c in spec.coordinates),
        input_units=tuple(i.unit for i in spec.inputs),
        mass_matrix=_as_printed(mass_matrix),
        force=_as_printed(force),
        distribution=_as_printed(distribution),
        contacts=contacts,
        values=values | law_values,
        units=units | law_units,
    )
    check_mass_matrix(system, spec)
    return system


def _as_printed(matrix: Matrix) -> Matrix:
    """The matrix with each fraction replaced by the decimal that the code prints: 1/3 becomes 0.3333333333333333.

    So equations, certificate and code have the same numbers.
    """
    fractions = {r for r in matrix.atoms(sympy.Rational) if not r.is_Integer}
    rounded = {r: decimal_of(int(r.p) / int(r.q)) for r in fractions}
    return Matrix(matrix.xreplace({r: d for r, d in rounded.items() if r != d}))


def check_mass_matrix(system: System, spec: Spec) -> None:
    """Refuse an M(x) that is not symmetric, or not positive definite at some sampled point of the envelope.

    Raises:
        BadInput: it names the parameter, or the entry with its values, or the point with the smallest eigenvalue there.
    """
    _refuse_negative_masses(system, spec)
    varies = any(x in system.mass_matrix.free_symbols for x in system.positions)
    points = _points(system, spec) if varies else np.zeros((1, system.degrees_of_freedom))
    entries = numbers_over(system.mass_matrix, system.values, system.positions, points)
    _refuse_asymmetry(system, spec, entries[np.isfinite(entries).all(axis=(1, 2))])
    _refuse_indefinite(system, spec, points, entries)


def _refuse_asymmetry(system: System, spec: Spec, entries: Any) -> None:
    """Refuse entries M_ij and M_ji that differ at some point; ``entries``: (points, n, n), finite."""
    M, key = system.mass_matrix, form_key(spec)
    largest = float(np.abs(entries).max(initial=0.0))
    for i in range(system.degrees_of_freedom):
        for j in range(i):
            difference = np.abs(entries[:, i, j] - entries[:, j, i]).max(initial=0.0)
            if M[i, j] != M[j, i] and difference > SYMMETRY * largest:
                found = f"entry [{i}][{j}] `{M[i, j]}` and [{j}][{i}] `{M[j, i]}`"
                raise BadInput(spec.place(f"{key}[{i}][{j}]"), found, "a symmetric mass matrix", code="SPEC017")


def _refuse_indefinite(system: System, spec: Spec, points: Any, entries: Any) -> None:
    """Refuse an M(x) that is not real and positive definite at each of the points, (points, n); it names the first."""
    key, finite = form_key(spec), np.isfinite(entries).all(axis=(1, 2))
    smallest = np.full(len(points), np.nan)
    smallest[finite] = np.linalg.eigvalsh(entries[finite])[:, 0]
    bad = ~(smallest > 0)  # true for NaN as well
    if not bad.any():
        return
    first = int(bad.argmax())
    at = dict(zip(system.positions, points[first], strict=True))
    varying = [x for x in system.positions if x in system.mass_matrix.free_symbols]
    where = ", ".join(f"{x} = {at[x]:.4g}" for x in varying) or "every point"
    if not finite[first]:
        i, j = map(int, np.argwhere(~np.isfinite(entries[first]))[0])
        entry = system.mass_matrix[i, j]
        found = f"entry [{i}][{j}] `{entry}` is no real number at {where}" + _values_in(system, entry)
        expected = "real entries in the whole envelope"
        raise BadInput(spec.place(f"{key}[{i}][{j}]"), found, expected, code="SPEC012")
    expected = "a mass matrix that is positive definite in the whole envelope"
    i = int(np.argmin(np.diag(entries[first])))
    if entries[first][i, i] <= 0:
        found = f"entry [{i}][{i}] `{system.mass_matrix[i, i]}` is {entries[first][i, i]:.4g} at {where}"
        values = _values_in(system, system.mass_matrix[i, i])
        raise BadInput(spec.place(f"{key}[{i}][{i}]"), found + values, expected, code="SPEC017")
    found = f"its smallest eigenvalue is {smallest[first]:.4g} at {where}, though every diagonal entry is positive"
    raise BadInput(spec.place(key), found, expected, code="SPEC017")


def _values_in(system: System, entry: sympy.Expr) -> str:
    """The parameters in an entry of M with their values, as text for a message."""
    named = sorted(entry.free_symbols & system.values.keys(), key=str)[:MOST_VALUES]
    texts = [f"{s} = {float(system.values[s]):.4g} {system.units[s]}".removesuffix(" 1") for s in named]
    return f", with {', '.join(texts)}" if texts else ""


def _refuse_negative_masses(system: System, spec: Spec) -> None:
    """Refuse each negative mass or moment of inertia among the parameters of M, even if M is positive definite.

    A parameter in kg m² may also be a product of inertia, which may be negative. It is taken for a moment of inertia
    only if a diagonal entry of M provably grows with it.
    """
    faults = Faults()
    for p in spec.parameters:
        place, s = spec.place(f"parameters.{p.name}"), symbol(p.name)
        if not p.value < 0 or s not in system.mass_matrix.free_symbols:
            continue
        of = dimension(parse_unit(p.unit, place))
        kind = next((word for unit, word in MASSES.items() if of == dimension(parse_unit(unit, place))), "")
        diagonal = system.mass_matrix.diagonal()
        if kind == "mass" or (kind and any(sympy.diff(entry, s).is_positive for entry in diagonal)):
            words = f"a {kind} of {float(p.declared):g} {p.unit}"
            expected = f"a positive one; what is taken away from another is subtracted there: `- {p.name}`"
            faults.noted.append(BadInput(place, words, expected, code="SPEC007"))
    faults.raise_noted()


def _points(system: System, spec: Spec) -> Any:
    """Corners, mid-points and random points of the positions' ranges, (points, n)."""
    n = system.degrees_of_freedom
    units = zip(system.positions, system.position_units, strict=True)
    ranges = np.array([position_range(spec, x.name, unit) for x, unit in units])
    levels = [(low, (low + high) / 2, high) for low, high in ranges[:CORNERED]]
    corners = np.array(np.meshgrid(*levels)).reshape(len(levels), -1).T
    corners = np.hstack([corners, np.tile(ranges[CORNERED:].mean(axis=1), (len(corners), 1))])
    return np.vstack([corners, np.random.default_rng(0).uniform(ranges[:, 0], ranges[:, 1], (SAMPLES, n))])

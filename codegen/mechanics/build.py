"""Spec → System: symbols named, and M(x) checked over the envelope."""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy

from codegen.errors import BadInput
from codegen.mechanics.contact_rank import refuse_dependent_contacts
from codegen.mechanics.contacts import build_contacts
from codegen.mechanics.motion import equation_of_motion, form_key
from codegen.mechanics.sampling import position_range
from codegen.mechanics.system import System
from codegen.spec.model import Spec, symbol
from codegen.spec.units import coherent_name

SAMPLES = 400


def build_system(spec: Spec) -> System:
    """The system that a spec declares, without its ``effects``.

    Raises:
        BadInput: for an unknown law, a law parameter missing, unknown or out of range, or a mass matrix that is not
            symmetric, or not positive definite somewhere in the envelope; contacts that slide dependently under an
            observer of each of them; and what ``equation_of_motion`` refuses.
    """
    values: dict[sympy.Symbol, Any] = {symbol(p.name): p.value for p in spec.parameters}
    units = {symbol(p.name): coherent_name(p.unit, spec.place(f"parameters.{p.name}.unit")) for p in spec.parameters}
    motion = equation_of_motion(spec)
    contacts, law_values, law_units = build_contacts(spec, motion.distribution)
    for name in law_values:
        if name in values:
            contact = next(c for c in contacts if name in c.law_parameters.values())
            found, expected = f"parameter `{name}`", f"a name that contact {contact.name} does not use"
            raise BadInput(spec.place(f"parameters.{name}"), found, expected)
    system = System(
        name=spec.name,
        positions=tuple(symbol(c.name) for c in spec.coordinates),
        velocities=tuple(symbol(c.velocity) for c in spec.coordinates),
        inputs=tuple(symbol(i.name) for i in spec.inputs),
        position_units=tuple(c.unit for c in spec.coordinates),
        input_units=tuple(i.unit for i in spec.inputs),
        mass_matrix=motion.mass_matrix,
        force=motion.force,
        distribution=motion.distribution,
        contacts=contacts,
        values=values | law_values,
        units=units | law_units,
    )
    check_mass_matrix(system, spec)
    refuse_dependent_contacts(spec, system.distribution)
    return system


def position_ranges(system: System, spec: Spec) -> dict[sympy.Symbol, tuple[float, float]]:
    """The range of every position: the envelope's, or one metre or one half turn to each side where it says none."""
    units = zip(system.positions, system.position_units, strict=True)
    return {x: position_range(spec, x.name, unit) for x, unit in units}


def check_mass_matrix(system: System, spec: Spec) -> None:
    """Is M(x) symmetric, and positive definite at every sampled point of the envelope?

    Raises:
        BadInput: with the entry, or the point and its smallest eigenvalue.
    """
    mass, key = system.mass_matrix.subs(system.values), form_key(spec)
    n = system.degrees_of_freedom
    ranges = position_ranges(system, spec)
    generator = np.random.default_rng(0)
    corners = (
        np.array(np.meshgrid(*[(lo, (lo + hi) / 2, hi) for lo, hi in list(ranges.values())[:6]]))
        .reshape(min(n, 6), -1)
        .T
    )
    corners = np.hstack([corners, np.zeros((len(corners), n - corners.shape[1]))])
    low, high = np.array(list(ranges.values())).T
    points = np.vstack([corners, generator.uniform(low, high, (SAMPLES, n))]) if mass.free_symbols else corners[:1]
    for i in range(n):
        for j in range(i):
            if sympy.expand(mass[i, j] - mass[j, i]) != 0 and _differs(
                mass[i, j] - mass[j, i], system.positions, points
            ):
                found = f"entry [{i}][{j}] `{system.mass_matrix[i, j]}` and [{j}][{i}] `{system.mass_matrix[j, i]}`"
                raise BadInput(spec.place(f"{key}[{i}][{j}]"), found, "a symmetric mass matrix")
    for point in points:
        at = dict(zip(system.positions, point, strict=True))
        entries = mass.subs(at).evalf()
        if not all(e.is_real and e.is_finite for e in entries):
            where = ", ".join(f"{x} = {value:.4g}" for x, value in at.items() if x in mass.free_symbols)
            expected = "real entries in the whole envelope"
            raise BadInput(spec.place(key), f"no real number at {where}", expected)
        smallest = np.linalg.eigvalsh(np.array(entries, dtype=float))[0]
        if not smallest > 0:
            where = (
                ", ".join(f"{x} = {value:.4g}" for x, value in at.items() if x in mass.free_symbols) or "every point"
            )
            found = f"its smallest eigenvalue is {smallest:.4g} at {where}"
            raise BadInput(spec.place(key), found, "a mass matrix that is positive definite in the whole envelope")


def _differs(difference: sympy.Expr, positions: tuple[sympy.Symbol, ...], points: Any) -> bool:
    values = [abs(complex(difference.subs(dict(zip(positions, p, strict=True))).evalf())) for p in points[:20]]
    return max(values) > 1e-12

"""Force expressions of a System evaluated on a Motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.diagnosis.recent import OF_MODELS, recent
from codegen.diagnosis.signals import Motion, central_difference
from codegen.mechanics.casadi_form import over_rows, to_casadi
from codegen.mechanics.system import TIME, Matrix, System
from codegen.simulate.sensor_error import SensorError

Array = NDArray[np.float64]


def evaluate_forces(
    system: System,
    columns: Sequence[Matrix],
    motion: Motion,
    inputs: Array | None = None,
    values: Mapping[Any, float] | None = None,
) -> Array:
    """Generalised forces at every sample, unfiltered, along the motion without the declared sensor errors.

    Args:
        columns: n by 1 matrices over x, v, w, accelerations and parameters.
        inputs: (N, m) in place of the motion's inputs.
        values: numbers for symbols that the system does not know (shape parameters).

    Returns:
        (len(columns), N, n).
    """
    n, m = system.degrees_of_freedom, len(system.inputs)
    point = casadi.SX.sym("point", 3 * n + m + 1)
    symbols = [*system.positions, *system.velocities, *system.accelerations, *system.inputs, TIME]
    names: dict[sympy.Symbol, Any] = {s: point[k] for k, s in enumerate(symbols)}
    names |= {s: casadi.SX(float(v)) for s, v in {**system.values, **(values or {})}.items()}
    stacked = casadi.vertcat(*[casadi.densify(to_casadi(column, names)) for column in columns])
    function = casadi.Function("forces", [point], [stacked])
    w = motion.inputs if inputs is None else inputs
    since = (motion.time - motion.time[0])[:, None]
    at = np.hstack([*true_motion(system, motion), w, since])
    return np.ascontiguousarray(over_rows(function, at).reshape(len(at), len(columns), n).transpose(1, 0, 2))


@recent(OF_MODELS)
def true_motion(system: System, motion: Motion) -> tuple[Array, Array, Array]:
    """True positions, velocities and accelerations, from the readings."""
    if not system.sensor_errors:
        return motion.positions, motion.velocities, motion.accelerations
    sensor = SensorError(system)
    positions = sensor.true(motion.positions)
    velocities = sensor.true_velocities(positions, motion.velocities)
    return positions, velocities, central_difference(velocities, motion.sample_time)


def level_parameters(system: System) -> list[sympy.Symbol]:
    """The friction parameters in which the laws are linear; a refit estimates them."""
    found: list[sympy.Symbol] = []
    for contact in system.contacts:
        for s in contact.law_parameters.values():
            slope = contact.law_level.diff(s)
            if slope != 0 and not slope.has(s) and not any(slope.has(q) for q in found):
                found.append(s)
    return found


@recent(OF_MODELS)
def slip_velocities(system: System, motion: Motion) -> Array:
    """(N, contacts)."""
    contacts = len(system.contacts)
    rows = []
    for c in range(contacts):
        column = sympy.zeros(system.degrees_of_freedom, 1)
        column[0] = system.slip_velocity[c]
        rows.append(Matrix(column))
    return np.ascontiguousarray(evaluate_forces(system, rows, motion)[:, :, 0].T)

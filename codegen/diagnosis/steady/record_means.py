"""Records at one steady speed each: their mean speeds and inputs, and the mean forces of a model there.

    r_k = g(v_k, w_k) − U λ(v_k, w_k),  k = 1 … R records,

with v and w the means of speed and input over the record. Most of a model's residual within such a record is ripple
over a turn, whose mean vanishes. So each record is one observation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.fit.linear import rms
from codegen.diagnosis.fit.shooting import hidden_states
from codegen.diagnosis.fit.signals import Motion
from codegen.diagnosis.results import ErrorFigures, Remainder
from codegen.logs import Log
from codegen.logs.motion import MOSTLY, measured_motion, steady_segments
from codegen.mechanics.casadi_form import in_place, to_casadi
from codegen.mechanics.system import TIME, System

LEAST_RUNS = 8
"""Least number of records."""
SETTLING = 0.1
"""Share of each record that is left out at its start."""


@dataclass(frozen=True, eq=False)
class Means:
    """Means of R steady records: speeds (R, n) and inputs (R, m), SI; ``left_out``: names of the other records."""

    speeds: Array
    inputs: Array
    left_out: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.speeds)

    def of(self, chosen: NDArray[np.bool_]) -> Means:
        return replace(self, speeds=self.speeds[chosen], inputs=self.inputs[chosen])


def means_of(log: Log) -> Means | None:
    """The means of the steady records of an experiment; None if they are few, or hold less than ``MOSTLY`` of its rows.

    A start, a stop or a reversal among many steady records is left out: free runs and force residual of all samples
    show ripple over a turn and not its mean.
    """
    if len(log.records) < LEAST_RUNS:
        return None
    steady = _steady_records(log)
    kept = [one for one, is_steady in zip(log.records, steady, strict=True) if is_steady]
    if len(kept) < LEAST_RUNS or sum(one.size for one in kept) < MOSTLY * sum(one.size for one in log.records):
        return None
    speeds, inputs = [], []
    for one in kept:
        first = round(SETTLING * one.size)
        way = one.positions[-1] - one.positions[first]
        speeds.append(way / (one.time[-1] - one.time[first]))
        inputs.append(one.inputs[first:].mean(axis=0))
    left_out = (one.path.name for one, is_steady in zip(log.records, steady, strict=True) if not is_steady)
    return Means(np.array(speeds), np.array(inputs), tuple(left_out))


def _steady_records(log: Log) -> NDArray[np.bool_]:
    """(records,) whether every coordinate runs at one speed, in all segments of a record."""
    motion = measured_motion(log)
    segments = steady_segments(log, motion.velocities, motion.usable)
    steady = np.ones(len(log.records), dtype=bool)
    np.logical_and.at(steady, _record_of(log), segments)
    return steady


def _record_of(log: Log) -> NDArray[np.intp]:
    """(segments,) index of the record to which each belongs."""
    return np.searchsorted([stop for _, stop in log.joints], [start for start, _ in log.segments], side="right")


def with_mean_inputs(motion: Motion, log: Log) -> Motion:
    """The motion of steady records with the mean input of each record throughout it, for free runs.

    The input of a record balances ripple over a turn, a force that the model lacks. Between two restarts a free run
    integrates it: a light rotor stops and starts, by an amount that says nothing of the friction at the mean speed. By
    the mean input the run settles at the speed at which the model's friction is the mean force. Records that are not
    steady keep their inputs.
    """
    commands, steady = motion.commands.copy(), _steady_records(log)
    for (start, stop), record in zip(log.segments, _record_of(log), strict=True):
        if steady[record]:
            commands[start:stop] = commands[start + round(SETTLING * (stop - start)) : stop].mean(axis=0)
    return replace(motion, commands=commands)


def is_static(system: System) -> bool:
    """Whether the mean force is a function of mean speeds and inputs: no dependence on position, time or history."""
    away = {*system.positions, TIME}
    moving = any(chain.has_memory for chain in system.actuators.values()) or bool(system.sensor_errors)
    bristles = any(c.law.bristle_stiffness(c.law_parameters) != 0 for c in system.contacts)
    return not moving and not bristles and hidden_states(system) == 0 and not away & system.equation_error.free_symbols


def mean_forces(system: System, means: Means) -> tuple[Array, Array]:
    """(R, n) force residual, and force of the inputs, of a system at mean speeds."""
    return forces_of(system, (), means)(np.zeros(0))


def forces_of(system: System, symbols: Sequence[sympy.Symbol], means: Means) -> Callable[[Array], tuple[Array, Array]]:
    """The function ``mean_forces`` of the values of these symbols."""
    n, m, count = system.degrees_of_freedom, len(system.inputs), len(means)
    point, moved = casadi.SX.sym("point", n + m), casadi.SX.sym("moved", len(symbols))
    names = {s: casadi.SX(float(v)) for s, v in system.values.items()}
    names |= {s: moved[k] for k, s in enumerate(symbols)}
    names |= dict.fromkeys([*system.positions, *system.accelerations, TIME], casadi.SX(0.0))
    names |= {s: point[k] for k, s in enumerate((*system.velocities, *system.inputs))}
    outputs = [casadi.densify(to_casadi(term, names)) for term in (system.equation_error, system.drive_force)]
    function = casadi.Function("means", [point, moved], outputs).map(count)
    at, numbers = np.hstack([means.speeds, means.inputs]), np.zeros((count, len(symbols)))
    residual, drive = np.zeros((count, n)), np.zeros((count, n))
    given = [at, numbers] if symbols else [at]  # CasADi takes no empty memory
    buffer, evaluate = in_place(function, given, [residual, drive])

    def forces(values: Array, _kept: Any = buffer) -> tuple[Array, Array]:
        numbers[:] = values
        evaluate()
        return residual.copy(), drive.copy()

    return forces


def figures_of(system: System, means: Means, measured: ErrorFigures) -> ErrorFigures:
    """Force errors of the means in place of the measured ones; free-run errors as measured."""
    residual, drive = mean_forces(system, means)
    rows = tuple(float(v) for v in np.sqrt(np.mean(residual**2, axis=0)))
    relative = float(np.linalg.norm(residual) / max(float(np.linalg.norm(drive)), 1e-300))
    return replace(measured, force_rms=rms(residual), force_rms_rows=rows, relative_force=relative, free_run_parts=())


def by_force_alone(figures: ErrorFigures) -> ErrorFigures:
    """The errors of steady records with which models are compared: those of the mean force, free runs as not measured.

    A free run by a mean input moves off by r/F'(v), with r the residual force and F' the slope of friction over speed.
    It shows the same residual, weighted by the slope; where friction falls with speed it grows without limit from any
    residual, which says that the motion is unstable and not which model is right.
    """
    return replace(figures, free_run_rmse_rows=(float("nan"),) * len(figures.free_run_rmse_rows))


def remainders_of(system: System, means: Means) -> tuple[Remainder, ...]:
    """The remainder of a model on the means; its structured share is what linear interpolation over speed predicts."""
    residual, drive = mean_forces(system, means)
    found = []
    for i in range(residual.shape[1]):
        speed, r = means.speeds[:, i], residual[:, i]
        before = after = 0.0
        for way in (-1, 1):
            chosen = np.flatnonzero(way * speed > 0)
            order = chosen[np.argsort(speed[chosen])]
            for k in range(1, len(order) - 1):
                low, here, high = order[k - 1 : k + 2]
                predicted = np.interp(speed[here], speed[[low, high]], r[[low, high]])
                before, after = before + r[here] ** 2, after + (r[here] - predicted) ** 2
        share = max(0.0, 1 - after / before) if before > 0 else 0.0
        left, driven = rms(r), rms(drive[:, i])
        found.append(Remainder(left, left / driven if driven > 0 else float("inf"), share, {"speed": share}))
    return tuple(found)

"""Starting values of a candidate's fit by least squares on the force residual of the measured motion.

They are needed where the free-run simulation of the base leaves the measured motion. The force residual r = g − M a − U
λ is linear in an effect's weights and in the friction levels, which are solved for together for each of the effect's
shapes. A stage of an actuator (delay, lag, limit, dead zone, gain) has no weight; it changes r through the effective
input w alone, r + (∂g/∂w) (w' − w), and its one parameter is found by a bounded search.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from codegen.diagnosis.balance import evaluate_forces, true_motion
from codegen.diagnosis.force_fit import force_rows
from codegen.diagnosis.models import model_of
from codegen.diagnosis.output_error import Fit
from codegen.diagnosis.problem import Problem
from codegen.diagnosis.residual import effective_inputs, inverse_dynamics_residual
from codegen.diagnosis.signals import low_pass
from codegen.diagnosis.trial import Trial
from codegen.effects.start import Covered
from codegen.mechanics.casadi_form import over_rows, to_casadi
from codegen.mechanics.system import TIME, Matrix, System

Array = NDArray[np.float64]

DENSE = 10.0
"""Samples in a period of the cutoff: the residual has nothing above it, and a starting value needs no more."""
SEARCHED, REACH = 16, 2.0
"""Of the bounded search: most evaluations, and half its width about the best of the grid, in the fit's coordinate."""


@dataclass(frozen=True, eq=False)
class ForceStart:
    """Starting values of candidates in addition to one fit.

    Attributes:
        problem: of the declared system on the log's motion. base: the fit without the candidate.
    """

    problem: Problem
    base: Fit

    def best(self, trial: Trial, covered: Covered) -> tuple[float, Array] | None:
        """(squared force residual that remains, theta) of the trial with starting values of its last part and levels.

        None where the part adds states, or is neither a force with a weight nor an actuator stage with one parameter.
        """
        part = trial.parts[-1]
        if trial.adds_states or self.base.runner.trial.adds_states:
            return None
        if part.effect.scaling:
            return self._weighted(trial, covered) if set(part.symbols) <= set(trial.free) else None
        if len(part.names) != 1 or set(part.symbols) & set(trial.free):
            return None
        grid = [float(part.inward(shape)[0]) for shape in part.effect.starts(covered)]
        tried = {inner: self._left(trial, inner) for inner in grid}
        centre = min(tried, key=lambda inner: tried[inner][0])

        def of(inner: float) -> float:
            tried[inner] = self._left(trial, inner)
            return tried[inner][0]

        bounds = _about(centre, grid) if part.effect.rough else (centre - REACH, centre + REACH)
        minimize_scalar(of, bounds=bounds, method="bounded", options={"maxiter": SEARCHED, "xatol": 0.01})
        inner = min(tried, key=lambda inner: tried[inner][0])
        theta = np.append(self.base.theta, inner)
        theta[self._places] += tried[inner][1]
        return (tried[inner][0], theta) if np.isfinite(theta).all() else None

    def _weighted(self, trial: Trial, covered: Covered) -> tuple[float, Array] | None:
        """The best of an effect's shapes, with its weights and the levels by linear least squares."""
        part, effect = trial.parts[-1], trial.parts[-1].effect
        shapes = effect.starts(covered)
        probes = [effect.probes(shape, covered) for shape in shapes]
        changes = iter(self._changes(trial, [values for one in probes for values, _ in one]))
        found: list[tuple[float, Array]] = []
        residual = self._rows(self._residual[:: self._every])
        for shape, one in zip(shapes, probes, strict=True):
            columns = np.column_stack([*(next(changes) / size for _, size in one), self._levels])
            scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
            step = np.asarray(np.linalg.lstsq(columns / scale, -residual, rcond=1e-9)[0], dtype=float) / scale
            rest = residual + columns @ step
            theta = np.append(self.base.theta, part.inward(effect.weighted(shape, step[: len(one)].tolist())))
            theta[self._places] += step[len(one) :]
            if np.isfinite(theta).all():
                found.append((float(rest @ rest), theta))
        return min(found, key=lambda pair: pair[0], default=None)

    def _changes(self, trial: Trial, probes: Sequence[Mapping[str, float]]) -> Iterator[Array]:
        """(R,) changes of the residual by the last part, for each of these values."""
        part, motion, at = trial.parts[-1], self.problem.motion, self._points
        function = self._error(trial.changed, part.symbols)
        for values in probes:
            numbers = np.array([values[name] for name in part.names])
            change = over_rows(function, np.hstack([at, np.tile(numbers, (len(at), 1))])) - self._forces
            yield self._rows(low_pass(change, motion.cutoff_hz, self._every * motion.sample_time))

    def _error(self, system: System, symbols: Sequence[sympy.Symbol] = ()) -> casadi.Function:
        """g − M a − U λ of a system as a function of a point of the motion and of these symbols."""
        own = dict(zip(self.base.runner.trial.symbols, self.base.runner.trial.numbers(self.base.theta), strict=True))
        variables = [*system.positions, *system.velocities, *system.accelerations, *system.inputs, TIME, *symbols]
        point = casadi.SX.sym("point", len(variables))
        names = {s: casadi.SX(float(v)) for s, v in {**system.values, **own}.items()}
        names |= {s: point[k] for k, s in enumerate(variables)}
        return casadi.Function("force", [point], [casadi.densify(to_casadi(system.equation_error, names))])

    def _left(self, trial: Trial, inner: float) -> tuple[float, Array]:
        """(squared residual that remains, steps of the levels) with the part's parameter at this value."""
        change = self._acting(trial, np.append(self.base.theta, inner)) - self._own
        force = np.einsum("jni,nj->ni", self._by_input, change)
        residual = self._rows((self._residual + self.problem.motion.low_pass(force))[:: self._every])
        step = np.asarray(np.linalg.lstsq(self._levels, -residual, rcond=1e-9)[0], dtype=float)
        rest = residual + self._levels @ step
        return float(rest @ rest), step

    def _acting(self, trial: Trial, theta: Array) -> Array:
        """(N, m) effective inputs at each sample: the mean of those before and after it."""
        motion = self.problem.motion
        after = trial.chains.act(motion.commands, trial.numbers(theta), motion.sample_time, 1)
        return 0.5 * (after + np.vstack([after[:1], after[:-1]]))

    def _rows(self, forces: Array) -> Array:
        """(R,) forces at the points of all coordinates, away from standstill, over the RMS residual of the base."""
        used = self.problem.masks.rows[:: self._every].T
        return np.concatenate([f[u] / s for f, u, s in zip(forces.T, used, self._sizes, strict=True) if u.any()])

    @cached_property
    def _every(self) -> int:
        """Distance of the samples that are used."""
        return self.problem.motion.step(DENSE)

    @cached_property
    def _points(self) -> Array:
        """(M, 3n + m + 1) the motion, its effective inputs and time, at every so many samples."""
        motion = self.problem.motion
        since = (motion.time - motion.time[0])[:, None]
        rows = *true_motion(self._system, motion), effective_inputs(self._system, motion), since
        return np.hstack([values[:: self._every] for values in rows])

    @cached_property
    def _forces(self) -> Array:
        """(M, n) g − M a − U λ of the base at these points, unfiltered."""
        return over_rows(self._error(self.base.runner.trial.changed), self._points)

    @cached_property
    def _system(self) -> System:
        return model_of(self.base.runner.trial, self.base.theta)

    @cached_property
    def _residual(self) -> Array:
        return inverse_dynamics_residual(self._system, self.problem.motion)

    @cached_property
    def _sizes(self) -> list[float]:
        """RMS of the base's residual on each coordinate."""
        used = self.problem.masks.rows.T
        squares = [float(np.mean(r[u] ** 2)) if u.any() else 1.0 for r, u in zip(self._residual.T, used, strict=True)]
        return [max(square, 1e-300) ** 0.5 for square in squares]

    @cached_property
    def _own(self) -> Array:
        return self._acting(self.base.runner.trial, self.base.theta)

    @cached_property
    def _by_input(self) -> Array:
        """(m, N, n) slopes of g by each effective input."""
        columns = [Matrix(self._system.force.diff(w)) for w in self._system.inputs]
        return evaluate_forces(self._system, columns, self.problem.motion)

    @cached_property
    def _places(self) -> list[int]:
        """Indices of the friction levels among the refitted values."""
        return [k for k, s in enumerate(self.base.runner.trial.moved) if s in self.problem.levels]

    @cached_property
    def _levels(self) -> Array:
        """(R, levels) slopes of the residual by the friction levels."""
        symbols = [self.base.runner.trial.moved[k] for k in self._places]
        rows = force_rows(self._system, self.problem, symbols)
        sizes = [s for s, u in zip(self._sizes, self.problem.masks.rows.T, strict=True) if u.any()]
        used = [r.slopes[r.sample % self._every == 0] for r in rows]
        return np.concatenate([slopes / s for slopes, s in zip(used, sizes, strict=True)])


def _about(centre: float, grid: Sequence[float]) -> tuple[float, float]:
    """The neighbours of a value of the grid, between which a step of the loss is sought."""
    below, above = [g for g in grid if g < centre], [g for g in grid if g > centre]
    return max(below, default=centre - REACH), min(above, default=centre + REACH)

"""Where the fit of a candidate starts: by least squares on the force residual of the measured motion.

A free run that has left the measured motion says little of what is lacking. The force residual r = g − M a − U λ is
linear in an effect's weights and in the friction levels, which it gives together, for each of the effect's shapes. A
stage of an actuator (a delay, a lag, a limit, a dead zone, a gain) has no such weight; r follows it through the
effective input w alone, r + (∂g/∂w) (w' − w), over a bounded search of its one parameter.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from codegen.diagnosis.balance import evaluate_forces, true_motion
from codegen.diagnosis.force_fit import force_rows
from codegen.diagnosis.models import model_of
from codegen.diagnosis.output_error import Shot
from codegen.diagnosis.problem import Problem
from codegen.diagnosis.residual import effective_inputs, inverse_dynamics_residual
from codegen.diagnosis.trial import Trial
from codegen.effects.start import Covered
from codegen.mechanics.casadi_form import over_rows, to_casadi
from codegen.mechanics.system import TIME, Matrix, System

Array = NDArray[np.float64]

SEARCHED, REACH = 16, 2.0
"""Of the bounded search: values at most, and how far from the best of the grid, in the coordinate of the fit."""


@dataclass(frozen=True, eq=False)
class ForceStart:
    """Starts of candidates beside one fit.

    Attributes:
        problem: of the declared system on the log's motion. base: the fit without the candidate.
    """

    problem: Problem
    base: Shot

    def best(self, trial: Trial, covered: Covered) -> tuple[float, Array] | None:
        """What is left of the force residual, squared, and the trial's vector with its last part and the levels.

        None where the part adds states, or is neither a force with a weight nor a stage of an actuator with one
        parameter.
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

        bounds = centre - REACH, centre + REACH
        minimize_scalar(of, bounds=bounds, method="bounded", options={"maxiter": SEARCHED, "xatol": 0.01})
        inner = min(tried, key=lambda inner: tried[inner][0])
        theta = np.append(self.base.theta, inner)
        theta[self._places] += tried[inner][1]
        return (tried[inner][0], theta) if np.isfinite(theta).all() else None

    def _weighted(self, trial: Trial, covered: Covered) -> tuple[float, Array] | None:
        """The best of an effect's shapes, its weights and the levels by linear least squares."""
        part, effect = trial.parts[-1], trial.parts[-1].effect
        shapes = effect.starts(covered)
        probes = [effect.probes(shape, covered) for shape in shapes]
        changes = iter(self._changes(trial, [values for one in probes for values, _ in one]))
        found: list[tuple[float, Array]] = []
        residual = self._rows(self._residual)
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
        """(R,) by which the last part, with each of these values, changes the residual."""
        system, motion, part = trial.changed, self.problem.motion, trial.parts[-1]
        own = dict(zip(self.base.runner.trial.symbols, self.base.runner.trial.numbers(self.base.theta), strict=True))
        variables = [*system.positions, *system.velocities, *system.accelerations, *system.inputs, TIME, *part.symbols]
        point = casadi.SX.sym("point", len(variables))
        names = {s: casadi.SX(float(v)) for s, v in {**system.values, **own}.items()}
        names |= {s: point[k] for k, s in enumerate(variables)}
        error = casadi.densify(to_casadi(system.equation_error, names))
        function = casadi.Function("force", [point], [error])
        since = (motion.time - motion.time[0])[:, None]
        at = np.hstack([*true_motion(self._system, motion), effective_inputs(self._system, motion), since])
        for values in probes:
            numbers = np.array([values[name] for name in part.names])
            force = over_rows(function, np.hstack([at, np.tile(numbers, (len(at), 1))]))
            yield self._rows(motion.low_pass(force) - self._residual)

    def _left(self, trial: Trial, inner: float) -> tuple[float, Array]:
        """(squared residual that is left, steps of the levels) with the part at this value."""
        change = self._acting(trial, np.append(self.base.theta, inner)) - self._own
        force = np.einsum("jni,nj->ni", self._by_input, change)
        residual = self._rows(self._residual + self.problem.motion.low_pass(force))
        step = np.asarray(np.linalg.lstsq(self._levels, -residual, rcond=1e-9)[0], dtype=float)
        rest = residual + self._levels @ step
        return float(rest @ rest), step

    def _acting(self, trial: Trial, theta: Array) -> Array:
        """(N, m) effective inputs about each sample: the mean of what acts before and behind it."""
        motion = self.problem.motion
        after = trial.chains.act(motion.commands, trial.numbers(theta), motion.sample_time, 1)
        return 0.5 * (after + np.vstack([after[:1], after[:-1]]))

    def _rows(self, forces: Array) -> Array:
        """(R,) forces (N, n) of all coordinates away from standstill, each over what the base leaves there."""
        used = self.problem.masks.rows.T
        return np.concatenate([f[u] / s for f, u, s in zip(forces.T, used, self._sizes, strict=True) if u.any()])

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
        """Of the friction levels among what every fit moves."""
        return [k for k, s in enumerate(self.base.runner.trial.moved) if s in self.problem.levels]

    @cached_property
    def _levels(self) -> Array:
        """(R, levels) slopes of the residual by the friction levels."""
        symbols = [self.base.runner.trial.moved[k] for k in self._places]
        rows = force_rows(self._system, self.problem, symbols)
        sizes = [s for s, u in zip(self._sizes, self.problem.masks.rows.T, strict=True) if u.any()]
        return np.concatenate([r.slopes / s for r, s in zip(rows, sizes, strict=True)])

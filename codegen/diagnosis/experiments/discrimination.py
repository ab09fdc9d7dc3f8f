"""Discriminating experiments: the change of the machine that separates two tied models most (T-optimality).

Model A follows the log's path in simulation after a change of the machine. Model B is fitted to this log and the
simulated one together, and what remains is the separation:

    d² = min over θ_B of  Σ_logs Σ w (r_B(θ_B) − r_A)² + (θ_B − θ̂_B)′ P (θ_B − θ̂_B)

with r the low-passed force residual, w the share of independent samples over the variance of A's residual on this log,
and P the prior precision of the tolerances. The smaller value of both orders (A, B) and (B, A) counts. After Atkinson
and Fedorov, with the present log as data.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.diagnosis.evidence.acting_joint import joint_of
from codegen.diagnosis.evidence.residual_regression import acting_force
from codegen.diagnosis.experiments.follow import follow, logged
from codegen.diagnosis.experiments.setups import Setup, setups
from codegen.diagnosis.fit.force_rows import independent_samples
from codegen.diagnosis.fit.linear import rms, solved
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.shooting import hidden_states
from codegen.diagnosis.fit.signals import Motion, smooth_motion
from codegen.diagnosis.fit.trial import Trial, with_effects, with_values
from codegen.diagnosis.results import FoundEffect, SetupTried
from codegen.logs import Log
from codegen.mechanics.system import System

STEP = 1e-4
"""Relative step of a parameter, for its slope."""
ROUNDS = 2
"""Gauss–Newton steps of a fit to both logs."""
MOST_SAMPLES = 6_000
"""Most samples of the log's path that are simulated again."""
LONGEST_SUBSTEP = 5e-4
"""Longest step of the plant, s; at 10 Hz its relative force error is (ω h)²/12 = 8e-5, far below ``FLOOR``."""
UNCHANGED = Setup("none", "as it was logged")
FLOOR = 1e-3
"""Noise floor over the RMS drive force, since a simulated log has no noise."""


@dataclass(frozen=True, eq=False)
class Model:
    """A fitted model as a function of its parameters (p,): refitted values, then the effects' own, in SI."""

    trial: Trial
    theta: Array
    prior_precision: Array

    def system(self, theta: Array, setup: Setup, factor: float = 1.0) -> System:
        """The machine after a change; ``factor``: on the friction, if the change affects it."""
        k, effects = len(self.trial.moved), []
        values = {s.name: float(v) for s, v in zip(self.trial.moved, theta[:k], strict=True)}
        if setup.friction is not None:
            levels = {s.name for c in self.trial.system.contacts for s in c.law_parameters.values()}
            values = {name: factor * v if name in levels else v for name, v in values.items()}
        for part in self.trial.parts:
            own = dict(zip(part.names, map(float, theta[k : k + len(part.names)]), strict=True))
            effects.append(FoundEffect(part.kind, part.on, setup.values(part, own, factor), {}))
            k += len(part.names)
        return with_effects(with_values(setup.base(self.trial.system), values), effects)


@dataclass(frozen=True, eq=False)
class Weighed:
    """A log of the machine after a change, and the weights (n,) of its force residual's samples."""

    setup: Setup
    problem: Problem
    weights: Array

    def residual(self, model: Model, theta: Array) -> Array:
        """(R,) weighted low-passed force residual on all coordinates; theta may end with the friction factor."""
        numbers, factor = (theta, 1.0) if self.setup.friction is None else (theta[:-1], float(theta[-1]))
        left = inverse_dynamics_residual(model.system(numbers, self.setup, factor), self.problem.motion)
        rows = self.problem.used
        return np.concatenate([np.sqrt(w) * left[rows[:, i], i] for i, w in enumerate(self.weights)])

    def slopes(self, model: Model, theta: Array, at: Array) -> Array:
        """(R, p) slopes of the residual, by forward differences from ``at``, the residual at theta."""
        columns = []
        for k in range(len(theta)):
            step = STEP * max(abs(float(theta[k])), 1e-6)
            moved = theta.copy()
            moved[k] += step
            columns.append((self.residual(model, moved) - at) / step)
        return np.column_stack(columns)


@dataclass(frozen=True, eq=False)
class Discrimination:
    """Separation of tied fits, the best first, by changes of the machine."""

    search: Search
    log: Log
    models: Sequence[Model]

    def tried(self, progress: Callable[[str, float], None] | None = None) -> list[SetupTried]:
        """Every change with its smallest separation over the pairs with the best model, largest first."""
        parts = [p for model in self.models for p in model.trial.parts]
        if any(_keeps_states(model.trial.changed) for model in self.models):
            return []
        found = []
        acting = {joint for part in parts if (joint := joint_of(self.search, part)) is not None}
        loaded = acting or range(self.search.system.degrees_of_freedom)
        every = list(setups(self.search.system, self.search.motion, parts, loaded))
        for k, setup in enumerate(every):
            if progress is not None:
                progress(f"change {k + 1} of {len(every)} of the machine", k / len(every))
            separation = self._separation(setup)
            if separation is not None:
                found.append(SetupTried(setup.kind, setup.words, *separation))
        return sorted(found, key=lambda tried: -tried.separation)

    def _separation(self, setup: Setup) -> tuple[float, float] | None:
        """(smallest separation over the pairs, largest input); None if the path cannot be followed."""
        least, most = float("inf"), 0.0
        followed: dict[int, tuple[Motion, float] | None] = {}
        for one, rival in (pair for k in range(1, len(self.models)) for pair in ((0, k), (k, 0))):
            if one not in followed:
                followed[one] = self._follow(self.models[one], setup)
            path = followed[one]
            if path is None:
                return None
            least = min(least, self._distance(self.models[one], self.models[rival], setup, path[0]))
            most = max(most, path[1])
        return least, most

    def _distance(self, truth: Model, rival: Model, setup: Setup, motion: Motion) -> float:
        """The separation d of a rival from the true model, by Gauss–Newton steps of the rival on both logs."""
        again = Problem(self.search.system, motion, {})
        weights = self._weights(truth)
        logs = [Weighed(UNCHANGED, self.search.problem, weights), Weighed(setup, again, weights)]
        extra = [] if setup.friction is None else [setup.friction]
        targets = [log.residual(truth, np.append(truth.theta, extra if log.setup is setup else [])) for log in logs]
        theta, best = np.append(rival.theta, extra), float("inf")
        centre, prior_precision = theta.copy(), np.append(rival.prior_precision, np.zeros(len(extra)))
        count = len(rival.theta)
        for turn in range(ROUNDS + 1):
            matrix, vector = np.diag(prior_precision), prior_precision * (centre - theta)
            cost = float(prior_precision @ (theta - centre) ** 2)
            for log, target in zip(logs, targets, strict=True):
                own = theta if log.setup.friction is not None else theta[:count]
                at = log.residual(rival, own)
                if not np.isfinite(at).all():
                    return float(np.sqrt(best)) if np.isfinite(best) else 0.0
                error = at - target
                cost += float(error @ error)
                if turn < ROUNDS:
                    slopes = log.slopes(rival, own, at)
                    matrix[: len(own), : len(own)] += slopes.T @ slopes
                    vector[: len(own)] -= slopes.T @ error
            best = min(best, cost)
            if turn < ROUNDS:
                theta = theta + solved(matrix, vector)
        return float(np.sqrt(best))

    def _weights(self, truth: Model) -> Array:
        """(n,) weights of the samples of each coordinate."""
        motion, rows = self.search.problem.motion, self.search.problem.used
        system = truth.system(truth.theta, UNCHANGED)
        left = inverse_dynamics_residual(system, motion)
        acting = acting_force(system, motion)
        weights = np.zeros(left.shape[1])
        for i in range(left.shape[1]):
            own = left[rows[:, i], i]
            if len(own):
                floor = FLOOR * rms(acting[rows[:, i], i])
                power = float(np.mean(own**2)) + floor**2
                weights[i] = independent_samples(own) / len(own) / max(power, 1e-300)
        return weights

    def _follow(self, truth: Model, setup: Setup) -> tuple[Motion, float] | None:
        """The motion of a model's machine along the log's path after a change, and the largest input, or None."""
        motion, h = self.search.motion, self.search.motion.sample_time
        samples = min(len(motion.time), MOST_SAMPLES)
        at = np.linspace(0, samples - 1, round(samples / setup.pace))
        path = np.column_stack([np.interp(at, np.arange(samples), x[:samples]) for x in motion.positions.T])
        rate = np.gradient(path, h, axis=0)
        machine = truth.system(truth.theta, setup, setup.friction or 1.0)
        substeps = ceil(h / LONGEST_SUBSTEP)
        run = follow(self.search, machine, path, rate, path.mean(axis=0), h, substeps=substeps)
        if run is None:
            return None
        try:
            made = smooth_motion(logged(self.log, run.positions, run.inputs), motion.cutoff_hz)
            return made, float(np.abs(run.inputs).max())
        except BadInput:
            return None


def _keeps_states(system: System) -> bool:
    """Whether the force residual of a system needs states that are not logged, so that no separation is computed."""
    bristles = (c.law.bristle_stiffness(c.law_parameters) for c in system.contacts)
    return hidden_states(system) > 0 or any(stiffness != 0 for stiffness in bristles)

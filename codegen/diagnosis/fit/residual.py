"""Force residual of a model on a log, g − M a − U λ, by inverse dynamics with zero-phase filters."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, binary_opening, maximum_filter1d

from codegen.base.arrays import Array
from codegen.diagnosis.fit.identity_cache import OF_MODELS, identity_cache
from codegen.diagnosis.fit.record import Record, substeps_of
from codegen.diagnosis.fit.shooting import LANES, all_law_terms, owners
from codegen.diagnosis.fit.signals import Motion, central_difference, derivative_noise, white_noise
from codegen.diagnosis.fit.trial import Runner, Trial, runner_of
from codegen.diagnosis.results import MATERIAL
from codegen.mechanics.casadi_form import function_of, over_rows, symbol_values, to_casadi
from codegen.mechanics.computed import by_computed
from codegen.mechanics.numpy_form import numpy_function
from codegen.mechanics.system import TIME, Matrix, System, with_loads
from codegen.simulate.dynamic_contact import DIRECTION, STANDSTILL, LawTerms
from codegen.simulate.sensors import SensorError
from codegen.spec.functions import Sgn


def evaluate_forces(system: System, columns: Sequence[Matrix], motion: Motion, inputs: Array | None = None) -> Array:
    """(columns, N, n) forces by n by 1 matrices, unfiltered, along the motion corrected for declared sensor errors."""
    at = points(system, motion, motion.inputs if inputs is None else inputs)
    found = over_rows(force_function(system, columns), at).reshape(len(at), len(columns), -1)
    return np.ascontiguousarray(found.transpose(1, 0, 2))


def points(system: System, motion: Motion, inputs: Array, every: int = 1) -> Array:
    """(N, 3n + m + 1) true motion, inputs and time, the arguments of a ``force_function``, at every so many samples."""
    return _points(*true_motion(system, motion), inputs, motion.time, every)


@identity_cache(OF_MODELS)
def _points(x: Array, v: Array, a: Array, inputs: Array, time: Array, every: int) -> Array:
    """``points`` of a motion; models and their values without effect on it have the same."""
    return np.hstack([values[::every] for values in (x, v, a, inputs, (time - time[0])[:, None])])


def force_function(
    system: System,
    columns: Sequence[Matrix],
    symbols: Sequence[sympy.Symbol] = (),
    values: Mapping[sympy.Symbol, float] | None = None,
    slopes: bool = False,
) -> casadi.Function:
    """Forces, or their ``slopes`` by symbols, as a function of a point of the motion followed by the symbols."""
    variables = [*system.positions, *system.velocities, *system.accelerations, *system.inputs, TIME]
    point, more = casadi.SX.sym("point", len(variables)), casadi.SX.sym("more", len(symbols))
    names = symbol_values({**system.values, **(values or {})}, (variables, point), (symbols, more))
    forces = casadi.vertcat(*[casadi.densify(to_casadi(column, names)) for column in columns])
    found = casadi.vec(casadi.densify(casadi.jacobian(forces, more))) if slopes else forces
    return casadi.Function("forces", [casadi.vertcat(point, more)], [found])


@identity_cache(OF_MODELS)
def true_motion(system: System, motion: Motion) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations corrected for the declared sensor errors."""
    if not system.sensor_errors:
        return motion.positions, motion.velocities, motion.accelerations
    sensor = SensorError(system)
    positions = sensor.true(motion.positions)
    velocities = sensor.true_velocities(positions, motion.velocities)
    return positions, velocities, central_difference(velocities, motion.sample_time)


def level_parameters(system: System) -> list[sympy.Symbol]:
    """The friction levels: the parameters in which the friction laws are linear. A refit estimates them."""
    found: list[sympy.Symbol] = []
    for contact in system.contacts:
        for s in contact.law_parameters.values():
            slope = contact.law_level.diff(s)
            if slope != 0 and not slope.has(s) and not any(slope.has(q) for q in found):
                found.append(s)
    return found


@identity_cache(OF_MODELS)
def slip_velocities(system: System, motion: Motion) -> Array:
    """Slip velocity of each contact, (N, contacts)."""
    rest = [0] * (system.degrees_of_freedom - 1)
    rows = [Matrix([speed, *rest]) for speed in system.slip_velocity]
    return np.ascontiguousarray(evaluate_forces(system, rows, motion)[:, :, 0].T)


INDEPENDENT = 0.01
"""Share of the variance of a link's parameter that is not correlated with others."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A declared System, the Motion on which it is judged, and standard deviations of its uncertain values, in SI.

    Attributes:
        changes: of the links' parameters by the uncertain numbers of a robot file, which correlate them, (links, k).
        material: share of the RMS of the drive force from which on a force matters.
    """

    system: System
    motion: Motion
    deviation: Mapping[sympy.Symbol, float]
    changes: Mapping[sympy.Symbol, Array] = field(default_factory=dict)
    material: float = MATERIAL

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        """(N, n) samples at which the force balance of each coordinate can be used."""
        return used_samples(self.system, self.motion, self.noise_speed)

    @cached_property
    def noise_speed(self) -> Array:
        """(n,) three standard deviations of the velocity noise after the fine filter."""
        motion = self.motion
        above = white_noise(motion.measured, motion.positions, 0.0, motion.sample_time)
        speeds = derivative_noise(above, motion.fine_hz, motion.sample_time, 1)
        if any(motion.integrated):
            speeds = np.where(motion.integrated, motion.noise_after(motion.fine_hz, 1), speeds)
        return np.asarray(3 * speeds)

    @cached_property
    def levels(self) -> list[sympy.Symbol]:
        """The friction levels that every fit re-estimates."""
        return level_parameters(self.system)

    @cached_property
    def uncertain(self) -> list[sympy.Symbol]:
        """Parameters with a tolerance that a fit may change, other than friction levels."""
        error = self.system.equation_error
        return [s for s, size in self.deviation.items() if size > 0 and error.has(s) and s not in self.levels]

    @cached_property
    def refitted_symbols(self) -> tuple[sympy.Symbol, ...]:
        """θ, the symbols that every fit estimates: levels, and uncertain parameters with their deviations as prior."""
        return (*self.levels, *self.uncertain)

    @cached_property
    def declared(self) -> Array:
        """(p,) values of ``refitted_symbols`` in the spec."""
        return np.array([float(self.system.values[s]) for s in self.refitted_symbols])

    @cached_property
    def prior_precision(self) -> Array:
        """(p,) inverse variances of ``refitted_symbols``; 0 for a level."""
        return np.array([0.0] * len(self.levels) + [self.deviation[s] ** -2.0 for s in self.uncertain])

    @cached_property
    def prior_information(self) -> Array:
        """(p, p) inverse covariance of ``refitted_symbols`` by the tolerances; 0 for a level."""
        return self.prior_information_without(None)

    def prior_information_without(self, index: int | None) -> Array:
        """``prior_information`` without the tolerance of one value.

        A number of a robot file, such as a link's mass, changes several parameters. So these are correlated: if one is
        far from its declared value, others must follow, or M(x) is not positive definite though each is within its
        tolerance. ``INDEPENDENT`` of each variance is uncorrelated, since the propagation is linear.
        """
        kept = np.array([k != index for k in range(len(self.refitted_symbols))], dtype=bool)
        matrix = np.diag(self.prior_precision * kept)
        links = [k for k, s in enumerate(self.refitted_symbols) if kept[k] and s in self.changes]
        if links:
            changes = np.array([self.changes[self.refitted_symbols[k]].ravel() for k in links])
            size = np.linalg.norm(changes, axis=1)
            unit = changes / size[:, None]
            correlation = (1 - INDEPENDENT) * unit @ unit.T + INDEPENDENT * np.eye(len(links))
            matrix[np.ix_(links, links)] = np.linalg.inv(correlation) / np.outer(size, size)
        return matrix


STICK_SHARE = 0.004
"""A contact is at standstill if its slip is slower than this fraction of the 95 % quantile of its speed."""
LONGEST_CROSSING_S = 0.03
"""Longest time for which a reversal is at standstill; a longer standstill is stick."""
BODIES = 4
"""Forces of an arm's bodies that are kept for all models: fits run one after another."""


@identity_cache(OF_MODELS)
def effective_inputs(system: System, motion: Motion) -> Array:
    """Outputs of the declared actuators for the motion's inputs, (N, m), the inputs of ``System.equation_error``."""
    return _mean_inputs(Trial(system, (), ()), motion, np.zeros(0))


def used_samples(system: System, motion: Motion, noise_speed: Array | float = 0.0) -> NDArray[np.bool_]:
    """(N, n) samples to use for the force balance of each coordinate: away from ends, gaps and standstill.

    At standstill friction may have any value up to its level, so samples within the filter's width of a standstill are
    left out; quick zero crossings are kept. In creep as slow as the noise of the speed, the sign of slip is noise, so a
    short excursion above the threshold ends no standstill. On a finer grid than the log's, only as many samples are
    used as were logged.

    Args:
        noise_speed: noise of each velocity, (n,); a slip has that of the velocities in it, which may have other units
            than the rest.
    """
    slip = slip_velocities(system, motion)
    noise = np.broadcast_to(noise_speed, (system.degrees_of_freedom,))
    slopes = [Matrix([u.diff(v) for v in system.velocities]) for u in system.slip_velocity]
    by_speeds = evaluate_forces(system, slopes, motion)
    reach = max(1, round(0.35 / (motion.cutoff_hz * motion.sample_time)))
    longest = max(2, round(LONGEST_CROSSING_S / motion.sample_time))
    rows = np.repeat(motion.usable[:, None], system.degrees_of_freedom, axis=1)
    for c in range(slip.shape[1]):
        of_slip = float(np.sqrt(np.mean(by_speeds[c] ** 2, axis=0) @ noise**2))
        threshold = max(STICK_SHARE * float(np.quantile(np.abs(slip[:, c]), 0.95)), of_slip)
        slow = binary_closing(np.abs(slip[:, c]) <= threshold, np.ones(longest + 1))
        still = binary_opening(slow, np.ones(longest + 1))
        widened = maximum_filter1d(still, 2 * reach + 1, mode="constant")
        for i in range(system.degrees_of_freedom):
            if system.distribution[i, c] != 0:
                rows[:, i] &= ~widened
    if motion.counted is not None:
        rows &= motion.counted[:, None]
    return rows


@identity_cache(OF_MODELS)
def inverse_dynamics_residual(system: System, motion: Motion) -> Array:
    """Low-passed force residual g − M a − U λ at every sample, (N, n), with the system's friction levels."""
    return motion.low_pass(unfiltered_residual(system, motion))


def contacts_on(system: System, i: int) -> list[int]:
    """Contacts whose friction acts on a coordinate."""
    return [c for c in range(system.distribution.shape[1]) if system.distribution[i, c] != 0]


def level_columns(system: System, motion: Motion, i: int) -> Array:
    """(N, contacts) low-passed signs of slip of the contacts on a coordinate, one for each level's friction."""
    return motion.low_pass(np.sign(slip_velocities(system, motion)[:, contacts_on(system, i)]))


def without_levels(system: System, motion: Motion, used: NDArray[np.bool_], residual: Array, i: int) -> Array:
    """The residual of one coordinate, (N,), less the least-squares contribution of its friction levels.

    The part that a level explains is no evidence for an effect. Free runs weigh samples differently and may give
    other levels.
    """
    if not contacts_on(system, i) or not used.any():
        return residual
    columns = level_columns(system, motion, i)
    weights = np.linalg.lstsq(columns[used], residual[used], rcond=None)[0]
    return np.asarray(residual - columns @ weights)


def arguments_of(trial: Trial, columns: Sequence[Matrix]) -> list[int]:
    """Indices of the trial's symbols on which forces depend; an arm has dozens that act on its bodies alone."""
    within = set().union(*(column.free_symbols for column in columns))
    return [k for k, s in enumerate(trial.symbols) if s in within]


def inputs_at(trial: Trial, motion: Motion, numbers: Array) -> Array:
    """``effective_inputs`` of a trial's system with these values of its symbols."""
    if trial.symbols_of_chains.isdisjoint(trial.symbols):
        return effective_inputs(trial.changed, motion)
    return _mean_inputs(trial, motion, numbers)


def _mean_inputs(trial: Trial, motion: Motion, numbers: Array) -> Array:
    inputs = motion.inputs.copy()
    for k, mean in trial.mean_inputs.items():
        inputs[:, k] = mean.at(motion.commands[:, k], motion.sample_time, numbers)
    return inputs


def by_bodies(system: System) -> tuple[Matrix, Matrix]:
    """The equation error g − M a − U λ as a sum: terms of an arm's bodies, which are slow, and all others."""
    error = system.equation_error
    bodies, others = (Matrix(part) for part in zip(*map(by_computed, error), strict=True))
    if bodies.free_symbols <= {*system.positions, *system.velocities, *system.accelerations, *system.values}:
        return bodies, others
    return Matrix.zeros(*error.shape), Matrix(error)


@lru_cache(maxsize=BODIES)
def _bodies_function(terms: tuple[sympy.Expr, ...], symbols: tuple[sympy.Symbol, ...]) -> Any:
    """The compiled terms of the bodies, which all models of an arm have in common."""
    return function_of(Matrix(terms), symbols)


@identity_cache(BODIES)
def _bodies_along(function: casadi.Function, motion: Motion, every: int, *numbers: float) -> Array:
    """(M, n) terms of the bodies at every so many samples of a motion, with these values of their parameters."""
    at = np.hstack([motion.positions, motion.velocities, motion.accelerations])[::every]
    return over_rows(function, at, numbers)


def unfiltered_residual(system: System, motion: Motion) -> Array:
    """Force residual g − M a − U λ, (N, n); states that are not logged are simulated along the measured motion."""
    return ResidualAlong(Trial(system, (), ()), motion).at(np.zeros(0))


class ResidualAlong:
    """The unfiltered force residual g − M a − U λ of a trial along a motion, for many values of its parameters."""

    def __init__(
        self, trial: Trial, motion: Motion, compiled: Runner | None = None, first: Array | tuple[()] = ()
    ) -> None:
        """``compiled``: free runs of the same system, whose first parameters have the values ``first``."""
        self._trial, self._motion, self._compiled, self._first = trial, motion, compiled, first
        system = trial.changed
        self._laws = dict(all_law_terms(system))
        stiffness = (contact.law.bristle_stiffness(contact.law_parameters) for contact in system.contacts)
        self._bristles = {k: found for k, found in enumerate(stiffness) if found != 0}
        whole = with_loads(system) if self._hides else system
        bodies, error = by_bodies(whole)
        if system.transmissions or system.sensor_errors:  # the bodies' motion is not the logged one
            bodies, error = Matrix([]), Matrix(whole.equation_error)
        moving = (*whole.positions, *whole.velocities, *whole.accelerations)
        self._links = sorted(bodies.free_symbols - set(moving), key=str)
        self._of_bodies = _bodies_function(tuple(bodies), (*moving, *self._links)) if any(bodies) else None
        columns = [error]
        if self._hides:
            for k in self._dynamic:
                c, slip = system.contacts[k], system.slip_velocity[k]
                by_level = c.force - c.extra_force if k in self._bristles else Sgn(c.slip) * c.law_level
                columns += [Matrix(whole.distribution[:, k] * by_level.subs(c.slip, slip))]
                columns += [Matrix(whole.distribution[:, k])]
        self._whole, self._columns, self._arguments = whole, len(columns), arguments_of(trial, columns)
        self._function = force_function(whole, columns, [trial.symbols[k] for k in self._arguments])

    @property
    def _dynamic(self) -> list[int]:
        """Contacts with bristles, then those with states of their own."""
        return [*self._bristles, *self._laws]

    @property
    def _hides(self) -> bool:
        """Whether there are states that are not logged."""
        return bool(self._dynamic or self._trial.changed.transmissions)

    def at(self, theta: Array, every: int = 1) -> Array:
        """(N, n) at a vector of the trial; or (M, n) at every so many samples."""
        return next(self.several([theta], every))

    def several(self, thetas: Sequence[Array], every: int = 1) -> Iterator[Array]:
        """``at`` for several vectors: states that are not logged are simulated for ``LANES`` of them in turn."""
        for k in range(0, len(thetas), LANES):
            some = thetas[k : k + LANES]
            hidden = np.zeros((len(some), len(self._motion.time), 0))
            if self._hides:
                hidden = self._runner.hidden(*(np.append(self._first, theta) for theta in some))
            yield from (self._with_states(theta, one, every) for theta, one in zip(some, hidden, strict=True))

    def _with_states(self, theta: Array, hidden: Array, every: int) -> Array:
        """``at`` with these states that are not logged, (N, …)."""
        trial, motion, system = self._trial, self._motion, self._trial.changed
        numbers, followed = trial.numbers(theta), self._with_loads(hidden) if self._hides else motion
        at, hidden = points(self._whole, followed, inputs_at(trial, motion, numbers), every), hidden[::every]
        forces = over_rows(self._function, at, numbers[self._arguments]).reshape(len(at), self._columns, -1)
        raw, *rest = np.ascontiguousarray(forces.transpose(1, 0, 2))
        values = {**system.values, **dict(zip(trial.symbols, map(float, numbers), strict=True))}
        if self._of_bodies is not None:
            raw = raw + _bodies_along(self._of_bodies, motion, every, *(float(values[s]) for s in self._links))
        slips = slip_velocities(system, motion)[::every] if self._laws else np.zeros(0)
        states = iter(hidden[:, len(system.contacts) :][:, : len(owners(system))].T)
        for k, by_level, direction in zip(self._dynamic, rest[::2], rest[1::2], strict=True):
            if k in self._bristles:
                force = float(self._bristles[k].subs(values)) * hidden[:, k]
            else:
                own = [next(states) for _ in self._laws[k].states]
                force = _law_force(self._laws[k], system.contacts[k].slip, slips[:, k], own, values)
            raw = raw + by_level - direction * force[:, None]
        return np.asarray(raw[:, : system.degrees_of_freedom])

    def _with_loads(self, hidden: Array) -> Motion:
        """The motion with the loads behind springs, the last of the hidden states, as further coordinates."""
        motion, loads = self._motion, len(self._trial.changed.transmissions)
        behind = hidden[:, hidden.shape[1] - 2 * loads :]
        return replace(
            motion,
            positions=np.hstack([motion.positions, behind[:, :loads]]),
            velocities=np.hstack([motion.velocities, behind[:, loads:]]),
            accelerations=np.hstack([motion.accelerations, np.zeros((len(behind), loads))]),
        )

    @cached_property
    def _runner(self) -> Runner:
        """Free runs that start at every sample, for the states along the motion."""
        motion, h, each = self._motion, self._motion.sample_time, np.arange(len(self._motion.time), dtype=np.int32)
        along = motion.measured, motion.positions, motion.velocities, motion.commands
        record = Record(*along, h, np.ones(self._trial.changed.degrees_of_freedom), each, 1)
        if self._compiled is not None:
            return replace(self._compiled, record=record)
        return runner_of(self._trial, record, substeps_of(h, motion.cutoff_hz))


def _law_force(
    terms: LawTerms, symbol: sympy.Symbol, slip: Array, states: Sequence[Array], values: Mapping[sympy.Symbol, Any]
) -> Array:
    """(M,) force of a law with states at slip velocities (M,); ``symbol`` is that of the slip in the law."""
    law = numpy_function([terms.force], (symbol, DIRECTION, *terms.states), values)
    (found,) = law(slip, np.clip(slip / STANDSTILL, -1.0, 1.0), *states)
    return np.broadcast_to(np.asarray(found, dtype=float), slip.shape)


def moves_sensors(trial: Trial) -> bool:
    """Whether a parameter of a trial is of a sensor error, which ``ResidualAlong`` cannot change."""
    errors = trial.changed.sensor_errors.values()
    return any(sympy.sympify(one).has(s) for one in errors for s in trial.symbols)


def friction_estimate(system: System, motion: Motion) -> Array:
    """Total generalised friction force g − M a by inverse dynamics, unfiltered, (N, n)."""
    bare = replace(
        system,
        contacts=tuple(replace(c, extra_level=sympy.Integer(0), extra_force=sympy.Integer(0)) for c in system.contacts),
    )
    force = Matrix(bare.commanded(bare.force - bare.mass_matrix * Matrix(list(bare.accelerations))))
    return np.asarray(evaluate_forces(bare, [force], motion, effective_inputs(system, motion))[0])

"""A model under test: the declared system with effects at their places, its parameters, and its free runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.diagnosis.fit.joints import JointShooter
from codegen.diagnosis.fit.record import Record
from codegen.diagnosis.fit.shooting import (
    LANES,
    FreeRun,
    Shooter,
    Structures,
    Values,
    hidden_states,
    term_symbols,
)
from codegen.diagnosis.results import AtPlace, FoundEffect
from codegen.effects import Effect
from codegen.effects.coordinate import Coordinate
from codegen.effects.declare import added, effect_symbols, places_of, unit_words
from codegen.effects.nameless import effect_called
from codegen.effects.register import is_own
from codegen.mechanics.numpy_form import numpy_function
from codegen.mechanics.system import System
from codegen.simulate.drive import Chains, MeanInput


@dataclass(frozen=True)
class Part(AtPlace):
    """One effect at one place, with the names, symbols and fit coordinates of its parameters."""

    kind: str
    place: int
    on: str
    names: tuple[str, ...]
    symbols: tuple[sympy.Symbol, ...]
    coordinates: tuple[Coordinate, ...]

    @cached_property
    def effect(self) -> Effect:
        return effect_called(self.kind).with_parameters(self.names)

    @property
    def form(self) -> str:
        """The parameters that the usual form of the effect does not have, as words."""
        kind = effect_called(self.kind)
        usual = {p.name for p in kind.forms[0].parameters}
        return ", ".join(name for name in self.names if name not in usual and len(kind.forms) > 1)

    def inward(self, values: Mapping[str, float]) -> Array:
        """Parameters → the unbounded coordinates of a fit."""
        return np.array([c.inward(values[name]) for name, c in zip(self.names, self.coordinates, strict=True)])

    def outward(self, inner: Array) -> dict[str, float]:
        """The inverse of ``inward``, in the effect's normal form."""
        named = zip(self.names, self.coordinates, inner, strict=True)
        return self.effect.normal_form({name: c.outward(float(q)) for name, c, q in named})


def part_of(effect: Effect, place: int, system: System) -> Part:
    """The part with an effect of the catalogue at a place of a system."""
    on = places_of(effect, system)[place]
    names = tuple(p.name for p in effect.parameters)
    symbols = effect_symbols(effect, on, system)
    coordinates = tuple(p.coordinate for p in effect.parameters)
    if is_own(effect.kind):
        added(effect, system, place, symbols, f"{effect.kind} on {on}")
    return Part(effect.kind, place, on, names, tuple(symbols[n] for n in names), coordinates)


@dataclass(frozen=True, eq=False)
class Trial:
    """A system with added effects, and the symbols that a fit of it estimates.

    Attributes:
        parts: the effects, in the order in which they were found.
        refitted_symbols: friction levels and parameters with a tolerance, which every fit estimates.
    """

    system: System
    parts: tuple[Part, ...]
    refitted_symbols: tuple[sympy.Symbol, ...]

    @cached_property
    def changed(self) -> System:
        """The system with all parts; their symbols have placeholder values."""
        system = self.system
        for part in self.parts:
            units = dict.fromkeys(part.symbols, "1")
            system = system.with_parameters({s: sympy.Integer(1) for s in part.symbols}, units)
            system = part.effect.add(system, part.place, dict(zip(part.names, part.symbols, strict=True)))
        return system

    @property
    def symbols(self) -> tuple[sympy.Symbol, ...]:
        """All estimated symbols: levels and toleranced parameters, then those of the parts."""
        return (*self.refitted_symbols, *(s for part in self.parts for s in part.symbols))

    @cached_property
    def free(self) -> tuple[sympy.Symbol, ...]:
        """The symbols that are arguments of the compiled terms."""
        within = term_symbols(self.changed, self.system)
        return (*self.refitted_symbols, *(s for part in self.parts for s in part.symbols if s in within))

    @cached_property
    def adds_states(self) -> bool:
        """Whether the last part adds states to the free run; its force then cannot be computed from the log alone."""
        return hidden_states(self.changed) > hidden_states(replace(self, parts=self.parts[:-1]).changed)

    @cached_property
    def has_hidden_states(self) -> bool:
        """Whether the free run has states besides positions and velocities."""
        return hidden_states(self.changed) > 0

    def with_part(self, part: Part) -> Trial:
        return replace(self, parts=(*self.parts, part))

    def without(self, theta: Array, index: int) -> tuple[Trial, Array]:
        """The trial without one of its parts, and its vector."""
        refitted_values, found = self.split(theta)
        kept = [k for k in range(len(found)) if k != index]
        trial = replace(self, parts=tuple(self.parts[k] for k in kept))
        return trial, trial.theta(refitted_values, [found[k] for k in kept])

    def split(self, theta: Array) -> tuple[Array, list[dict[str, float]]]:
        """(values of ``refitted_symbols``, parameters of each part) from a fit's vector."""
        k, found = len(self.refitted_symbols), []
        for part in self.parts:
            found.append(part.outward(theta[k : k + len(part.names)]))
            k += len(part.names)
        return theta[: len(self.refitted_symbols)], found

    def theta(self, refitted_values: Array, parameters: Sequence[Mapping[str, float]]) -> Array:
        """The inverse of ``split``."""
        return np.concatenate([refitted_values, *(p.inward(v) for p, v in zip(self.parts, parameters, strict=True))])

    def model(self, refitted_values: Array, found: Sequence[Mapping[str, float]]) -> System:
        values = dict(zip((s.name for s in self.refitted_symbols), map(float, refitted_values), strict=True))
        effects = [FoundEffect(p.kind, p.on, one, {}) for p, one in zip(self.parts, found, strict=True)]
        return with_effects(with_values(self.system, values), effects)

    def numbers(self, theta: Array) -> Array:
        """The values of ``symbols``."""
        refitted_values, found = self.split(theta)
        return np.concatenate(
            [refitted_values, *([v[n] for n in p.names] for p, v in zip(self.parts, found, strict=True))]
        )

    @cached_property
    def symbols_of_chains(self) -> set[sympy.Symbol]:
        """Symbols of the actuators, which change the input of a run."""
        chains = self.changed.actuators.values()
        return set().union(*(sympy.sympify(e).free_symbols for chain in chains for e in chain.numbers))

    @cached_property
    def chains(self) -> Chains:
        return Chains(self.changed, self.symbols)

    @cached_property
    def mean_inputs(self) -> dict[int, MeanInput]:
        """Index of an input with an actuator → its mean about samples."""
        system = self.changed
        return {k: MeanInput(system, k, self.symbols) for k, w in enumerate(system.inputs) if w in system.actuators}

    @cached_property
    def sensors(self) -> Sensors:
        return Sensors(self.changed, self.symbols)

    @cached_property
    def structures(self) -> Structures:
        return Structures(self.changed, self.symbols)


@dataclass(frozen=True, eq=False)
class Runner:
    """Free-run simulation of one trial, the ``model``-th of a shooter, on one record."""

    trial: Trial
    shooter: Shooter | JointShooter
    model: int
    record: Record
    substeps: int

    def run(self, theta: Array, offsets: Array, gain: float = 1.0) -> Array:
        """Predicted measurements (S, L, n); each segment starts ``offsets`` (S, 2n) from the smoothed state.

        Of a model with loads, from the state that an observer estimates (``observes``).
        Of an arm whose joints are compared one by one: (S joints, L, 1), with offsets (S joints, 2).
        """
        return self.at(theta, gain)(offsets)

    def at(self, theta: Array, gain: float = 1.0, smoothed: bool = False) -> FreeRun:
        """``run`` as a function of the offsets and of those of loads; everything else is computed once.

        Args:
            smoothed: whether the motor starts from the smoothed state also where it has a load.
        """
        (run,) = self.several([theta], gain, smoothed)
        return run

    def several(self, thetas: Sequence[Array], gain: float = 1.0, smoothed: bool = False) -> list[FreeRun]:
        """``at`` for several vectors; best for as many as ``at_once``."""
        if len(thetas) > self.at_once:
            return [self.at(theta, gain, smoothed) for theta in thetas]
        numbers = [self.trial.numbers(theta) for theta in thetas]
        followed = self._along_true_motion(numbers[0])
        values = [self._values(one, gain) for one in numbers]
        if isinstance(self.shooter, JointShooter):
            (one,) = values
            runs = [self.shooter.run_of(self.model, one, followed, self.substeps, self.record)]
        else:
            runs = self.shooter.runs(self.model, values, followed, self.substeps, self.observes and not smoothed)
        return [self._measured(run, n) for run, n in zip(runs, numbers, strict=True)]

    @property
    def at_once(self) -> int:
        """Most vectors whose free runs begin together; one without states to follow, or with motions of their own."""
        alone = isinstance(self.shooter, JointShooter) or self.trial.sensors.has_errors
        return LANES if self.trial.has_hidden_states and not alone else 1

    def _measured(self, free_run: FreeRun, numbers: Array) -> FreeRun:
        """A free run as readings, from the measured states and offsets of them."""
        trial, record = self.trial, self.record
        states = trial.sensors.true(record.states, numbers)

        def run(offsets: Array, loads: Array | None = None) -> Array:
            found = free_run(states + record.of_segments(offsets), loads)
            return record.by_row(trial.sensors.measured(found, numbers))

        return run

    @property
    def observes(self) -> bool:
        """Whether an observer estimates the start states: of models with loads, not of the joints of an arm."""
        return bool(self.trial.changed.transmissions) and isinstance(self.shooter, Shooter)

    def offsets_of(self, other: Runner, offsets: Array) -> Array:
        """The start-state offsets of another runner's fit; zero if they are from the other kind of start states."""
        return offsets if self.observes == other.observes else self.record.at_rest

    def depends_on(self, k: int) -> bool:
        """Whether the predicted measurements may depend on parameter ``k`` of the trial's vector."""
        if not isinstance(self.shooter, JointShooter) or k >= len(self.trial.refitted_symbols):
            return True
        if self.trial.symbols[k] in self.trial.symbols_of_chains:
            return True
        return self.shooter.depends_on(self.model, self._arguments.index(k), self.record)

    def hidden(self, *thetas: Array) -> Array:
        """(R, S, …) states that are not logged, with each of R vectors, as by ``Shooter.hidden``.

        The motion is corrected for sensor errors with the values of the first one.
        """
        numbers = [self.trial.numbers(theta) for theta in thetas]
        assert isinstance(self.shooter, Shooter)  # an arm is never separated here
        followed = self._along_true_motion(numbers[0])
        return self.shooter.hidden(self.model, [self._values(one) for one in numbers], followed, self.substeps)

    def _along_true_motion(self, numbers: Array) -> Record:
        """The record, its motion without the sensor errors of the trial, along which states that are not logged follow.

        The motor of a load moves by the true position, and the load's spring answers an error of a reading as a force.
        """
        trial, record = self.trial, self.record
        if not trial.sensors.has_errors or not trial.has_hidden_states:
            return record
        n = record.positions.shape[1]
        states = trial.sensors.true(np.hstack([record.positions, record.velocities]), numbers)
        return replace(record, positions=states[:, :n], velocities=states[:, n:])

    @cached_property
    def _arguments(self) -> list[int]:
        """Indices of the compiled code's arguments among the trial's symbols."""
        place = {s: k for k, s in enumerate(self.trial.symbols)}
        return [place[s] for s in self.trial.free]

    def _values(self, numbers: Array, gain: float = 1.0) -> Values:
        """The values of the compiled model, with its effective inputs times a gain."""
        record = self.record
        drive = self.trial.chains.act(record.commands, numbers, record.sample_time, self.substeps)
        drive = drive if gain == 1.0 else gain * drive  # the same array where it is the same: ``JointShooter`` asks
        return Values(numbers[self._arguments], self.trial.structures.at(numbers), drive)


ITERATIONS, POLISHES = 8, 3
LEAST_SLOPE = 0.2
"""Least slope of a reading over position; below it the reading does not determine the state and is not corrected."""


class Sensors:
    """The position sensors of a system with their declared errors; every method is given the values of ``symbols``."""

    def __init__(self, system: System, symbols: tuple[sympy.Symbol, ...]) -> None:
        positions = system.positions
        self._wrong = [i for i, x in enumerate(positions) if system.sensor_errors.get(x, 0) != 0]
        wrong = [(positions[i], system.sensor_errors[positions[i]]) for i in self._wrong]
        arguments = (*positions, *symbols)
        if wrong:
            self._errors = numpy_function([error for _, error in wrong], arguments, system.values)
            self._slopes = numpy_function([error.diff(x) for x, error in wrong], arguments, system.values)

    @property
    def has_errors(self) -> bool:
        return bool(self._wrong)

    def true(self, states: Array, numbers: Array) -> Array:
        """(S, 2n) true states for readings ``states``, by fixed-point iteration and then Newton's method."""
        if not self._wrong:
            return states
        n = states.shape[1] // 2
        read, states = states, states.copy()
        with np.errstate(invalid="ignore", over="ignore"):  # for too steep errors the reading is not invertible
            for turn in range(ITERATIONS + POLISHES):
                errors = _at(self._errors, states[:, :n], numbers)
                slopes = self._slopes_at(states, numbers) if turn >= ITERATIONS else [1.0] * len(errors)
                for i, error, slope in zip(self._wrong, errors, slopes, strict=True):
                    states[:, i] += (read[:, i] - states[:, i] - error) / slope
            for i, slope in zip(self._wrong, self._slopes_at(states, numbers), strict=True):
                states[:, n + i] /= slope
        return states

    def _slopes_at(self, states: Array, numbers: Array) -> list[Any]:
        """Slopes of the readings by position."""
        slopes = _at(self._slopes, states[:, : states.shape[1] // 2], numbers)
        return [np.where(np.abs(1 + slope) > LEAST_SLOPE, 1 + slope, 1.0) for slope in slopes]

    def measured(self, positions: Array, numbers: Array) -> Array:
        """Readings at positions (..., n)."""
        if not self._wrong:
            return positions
        read = positions.copy()
        with np.errstate(invalid="ignore", over="ignore"):  # mean_residuals handles diverged runs
            for i, error in zip(self._wrong, _at(self._errors, positions, numbers), strict=True):
                read[..., i] += error
        return read


def _at(function: Any, positions: Array, numbers: Array) -> list[Any]:
    return list(function(*np.moveaxis(positions, -1, 0), *numbers))


def runner_of(trial: Trial, record: Record, substeps: int) -> Runner:
    """A few free runs of one trial."""
    return Runner(trial, Shooter([trial.changed], [trial.free], seldom=True), 0, record, substeps)


def with_values(system: System, refitted: Mapping[str, float]) -> System:
    """The system with refitted values; a negative friction level becomes zero."""
    levels = {s.name for contact in system.contacts for s in contact.law_parameters.values()}
    new = {s: refitted[s.name] for s in system.values if s.name in refitted}
    return system.with_parameters({s: sympy.Float(max(v, 0.0) if s.name in levels else v) for s, v in new.items()}, {})


def with_effects(system: System, found: Sequence[FoundEffect]) -> System:
    """The system with fitted effects added to it."""
    for one in found:
        effect = effect_called(one.kind).with_parameters(list(one.parameters))
        place = places_of(effect, system).index(one.on)
        symbols = effect_symbols(effect, one.on, system)
        units = unit_words(effect, place, system)
        system = system.with_parameters(
            {s: sympy.Float(one.parameters[name]) for name, s in symbols.items()},
            {s: units[name] for name, s in symbols.items()},
        )
        system = effect.add(system, place, symbols)
    return system


def in_unit(system: System, symbol: sympy.Symbol) -> str:
    """The unit of a parameter after a space; empty for none."""
    unit = system.units.get(symbol, "1")
    return "" if unit == "1" else f" {unit}"


def model_of(trial: Trial, theta: Array) -> System:
    """The system with the values and effects of a trial's vector."""
    return trial.model(*trial.split(theta))

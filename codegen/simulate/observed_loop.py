"""Simulation of a closed loop: plant, sensors, sampled controller and observer, cancelling input, limits and delay."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import isfinite
from typing import Any, Protocol

import numpy as np

from codegen.base.arrays import Array
from codegen.mechanics.casadi_form import compiled_in_place, in_place
from codegen.mechanics.sampling import numbers_over
from codegen.mechanics.system import System
from codegen.replay.engine import Engine
from codegen.simulate.controller import Feedback, Sample
from codegen.simulate.drive import HeldInput
from codegen.simulate.loop_run import LoopRun
from codegen.simulate.plant import Plant, substeps_of
from codegen.simulate.sensors import Readings, Sensors

FRICTION = "F_hat_on_"
"""First part of the names of the outputs that are friction forces on coordinates."""


@dataclass(frozen=True)
class Cancellation:
    """The cancelling input ū = gain · F̂, added to the controller's command.

    Attributes:
        gain: 1 cancels the whole estimate.
        delay: samples of the observer between estimate and use. 0: the estimate of the same instant, which depends on
            measurements only, so it is computed before the command. 1: a program that computes and sends the command,
            and then calls the observer.
        outputs: names of the outputs F̂, one for each input; by default the friction force on each coordinate.
    """

    gain: float = 1.0
    delay: int = 0
    outputs: tuple[str, ...] = ()


class Estimator:
    """An observer during a run: its latest estimates, and the cancelling input computed from them.

    Args:
        every: the observer's sample time over the loop's, a whole number.

    Attributes:
        latest: (outputs,) the estimates of its last sample, NaN before the first.
        fault: 1 where it held its estimates, else 0.
    """

    def __init__(self, engine: Engine, every: int, system: System, cancellation: Cancellation | None) -> None:
        self._engine, self._every = engine, every
        names = [s.name for s in (*system.positions, *system.velocities, *system.inputs)]
        self._columns = [names.index(name) for name in self._engine.inputs]
        self._signals = np.zeros(len(names))  # positions, velocities, inputs
        self._inputs = self._signals[len(names) - len(system.inputs) :]
        self.latest = np.full(len(engine.outputs), np.nan)
        self.fault = 0
        self._cancellation, self._delay = cancellation, 0 if cancellation is None else cancellation.delay
        chosen = () if cancellation is None else cancellation.outputs
        if cancellation is not None and not chosen:
            chosen = tuple(name for name in engine.outputs if name.startswith(FRICTION))
        self._chosen = [engine.outputs.index(name) for name in chosen]
        self._older: deque[Array] = deque(maxlen=max(self._delay, 1))

    def measure(self, k: int, positions: Array, velocities: Array, sent: Array) -> None:
        """Set the measurements of the loop's sample k; ``sent`` is the command until now.

        The estimates depend on the measurements only, so without a delay they are computed now, before the command of
        this sample; the states can be updated only with it.
        """
        if k % self._every:
            return
        self._signals[:] = np.concatenate([positions, velocities, sent])
        if k == 0:
            self._engine.start(self._signals[self._columns])
        if self._delay == 0:
            self.latest = self._engine.trial_step(self._signals[None, self._columns])

    def step(self, k: int, sent: Array) -> None:
        """Step the observer with the measurements of the loop's sample k and its command."""
        if k % self._every:
            return
        self._inputs[:] = sent
        estimates, faults = self._engine.run(self._signals[None, self._columns])
        self.latest, self.fault = estimates[0], int(faults[0])
        self._older.append(self.latest)

    def cancelling(self) -> Array:
        """ū (m,); zero without a cancellation, and until an estimate of the age ``delay`` exists."""
        cancellation, late = self._cancellation, self._delay > 0
        if cancellation is None or (late and len(self._older) < self._delay):
            return np.zeros(len(self._inputs))
        estimate = self._older[0] if late else self.latest
        return np.asarray(cancellation.gain * estimate[self._chosen], dtype=float)


PARTS = 20
"""Number of progress reports in a run."""
PERFECT = Sensors()
WORTH_COMPILING = 100_000
"""Steps of a run from which on compiled C saves more time than its compilation takes, for plants of any size."""


class MovedPlant(Protocol):
    """Interface of a plant that is simulated sample by sample.

    Attributes:
        state: (2 n or more,) positions, velocities, then states of its own.
        positions, velocities: (n,) views of ``state``.
        forces: (contacts,) λ at the beginning of the last sample.
    """

    state: Array
    positions: Array
    velocities: Array
    forces: Array

    def move(self, time: float, command: Array) -> None:
        """Simulate one sample under a command held from ``time``."""


PlantMaker = Callable[[float, Array, Array], MovedPlant]
"""Function (sample time, initial positions, initial velocities) → plant."""


@dataclass(frozen=True)
class SampledLoop:
    """What is sampled around a plant: sensors, controller, observer, cancelling input, and limits of the inputs.

    Attributes:
        controller: called once a sample.
        observer: the compiled C, stepped once in ``every`` samples; may be of another system. None for none.
        cancellation: of the observer's estimates; None for none.
        sensors: perfect by default.
        seed: of the sensor noise.
        limit: (m,) of the magnitudes of the inputs; None for none.
    """

    controller: Feedback
    observer: Engine | None = None
    cancellation: Cancellation | None = None
    sensors: Sensors = PERFECT
    seed: int = 0
    limit: Array | None = None
    every: int = 1


def run_loop(
    system: System,
    loop: SampledLoop,
    period: float,
    samples: int,
    start: tuple[Array, Array] | None = None,
    substeps: int | None = None,
    progress: Callable[[float], None] | None = None,
    make_plant: PlantMaker | None = None,
) -> LoopRun:
    """Simulate a machine with a sampled controller and a sampled observer.

    At each sample, in this order: the sensors are read; the controller's command and the cancelling input are added,
    limited and sent; the observer makes a step with the measurement and the command sent; the plant is simulated under
    the held command. The controller has the estimates of the same instant, unless the cancellation has a delay. The
    friction is unloaded at the start, and there is no command before.

    Args:
        system: the plant, with its effects.
        period: sample time, s.
        start: positions and velocities (n,), zero by default.
        substeps: plant steps in a sample; by default those of ``substeps_of``.
        progress: called with the share that is done, from 0 to 1.
        make_plant: maker of another plant in place of the time stepper, such as one of another simulator.

    Returns:
        The run; NaN from the sample on at which the motion is not finite.

    Raises:
        ValueError: for an observer with inputs that the system does not have.
    """
    n, m, controller = system.degrees_of_freedom, len(system.inputs), loop.controller
    x, v = (np.zeros(n), np.zeros(n)) if start is None else (np.array(part, dtype=float) for part in start)
    plant = (make_plant or partial(_Plant, system, samples, substeps))(period, x, v)
    observer, outputs = loop.observer, () if loop.observer is None else loop.observer.outputs
    estimator = None if observer is None else Estimator(observer, loop.every, system, loop.cancellation)
    controller.start()
    readings = Readings(system, loop.sensors, samples, loop.seed, period)
    sent, cancelling, estimates = np.zeros(m), np.zeros(m), np.zeros(0)
    rows = _empty_run(system, period, samples, outputs)
    with np.errstate(all="ignore"):
        for k in range(samples):
            if not all(map(isfinite, plant.state.tolist())):  # an eighth of the time of NumPy's for a few numbers
                break
            measured, measured_velocity, for_control = readings.take(k, plant.positions, plant.velocities)
            if estimator is not None:
                estimator.measure(k, measured, measured_velocity, sent)
                estimates = estimator.latest
            sent = controller.command(Sample(k * period, measured, for_control, estimates, sent, period))
            if estimator is not None:
                cancelling = estimator.cancelling()
                sent = sent + cancelling
            if loop.limit is not None:
                sent = np.clip(sent, -loop.limit, loop.limit)
            if estimator is not None:
                estimator.step(k, sent)
                rows.estimates[k], rows.faults[k] = estimator.latest, estimator.fault
            rows.positions[k], rows.velocities[k] = measured, measured_velocity
            rows.inputs[k], rows.cancelling[k] = sent, cancelling
            rows.true_positions[k], rows.true_velocities[k] = plant.positions, plant.velocities
            plant.move(k * period, sent)
            rows.contact_forces[k] = plant.forces
            if progress is not None and (k + 1) * PARTS // samples > k * PARTS // samples:
                progress((k + 1) / samples)
    distribution = numbers_over(system.distribution, system.values, system.positions, rows.true_positions)
    return replace(rows, friction=np.einsum("kic,kc->ki", distribution, rows.contact_forces))


class _Plant:
    """The time stepper as a ``MovedPlant``, which reads and writes the arrays of this object in place.

    The steps of a long run are compiled.
    """

    def __init__(self, system: System, samples: int, substeps: int | None, period: float, x: Array, v: Array) -> None:
        substeps = substeps or substeps_of(system, period, x)
        plant, n = Plant(system, substeps), system.degrees_of_freedom
        self.state = plant.start(x, v)
        self.forces = np.zeros(len(system.contacts))
        self._next_state = np.empty_like(self.state)
        self._actuators = HeldInput(system, period, np.linspace(0, 1, substeps + 1))
        self._drive = np.zeros(2 + len(system.inputs) * substeps)  # t, h, w of each substep: see ``Plant.sample``
        self._drive[1] = period / substeps
        self._inputs = self._drive[2:].reshape(substeps, len(system.inputs))
        self.positions, self.velocities = self.state[:n], self.state[n : 2 * n]
        arguments, results = [self.state, self._drive], [self._next_state, self.forces]
        prepared = compiled_in_place if samples * substeps >= WORTH_COMPILING else in_place
        self._buffer, self._evaluate = prepared(plant.sample, arguments, results)

    def move(self, time: float, command: Array) -> None:
        """Simulate one sample under a command held from ``time``."""
        self._drive[0] = time
        self._inputs[:] = self._actuators.take(command)
        self._evaluate()
        self.state[:] = self._next_state  # in place: the stepper and the views hold this array


def _empty_run(system: System, period: float, samples: int, outputs: tuple[str, ...]) -> LoopRun:
    """A run to be filled: all signals NaN except time and faults."""
    n, m = system.degrees_of_freedom, len(system.inputs)
    widths = dict.fromkeys(("positions", "velocities", "true_positions", "true_velocities", "friction"), n)
    widths |= {"inputs": m, "cancelling": m, "contact_forces": len(system.contacts), "estimates": len(outputs)}
    signals: dict[str, Any] = {name: np.full((samples, width), np.nan) for name, width in widths.items()}
    time, faults = period * np.arange(samples, dtype=np.float64), np.zeros(samples, dtype=np.intc)
    return LoopRun(time=time, outputs=outputs, faults=faults, **signals)

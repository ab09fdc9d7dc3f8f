"""A generated observer in a simulated loop, and the input that cancels the estimated friction."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from codegen.base.arrays import Array
from codegen.mechanics.system import System
from codegen.observers import Observer
from codegen.replay.engine import Engine, engine_of
from codegen.spec.model import Spec

FRICTION = "F_hat_on_"
"""First part of the names of the outputs that are friction forces on coordinates."""


@dataclass(frozen=True)
class ObserverInLoop:
    """A generated observer, stepped once every ``every`` samples of the loop.

    Attributes:
        engine: the compiled C.
        every: the observer's sample time over the loop's, a whole number.
    """

    engine: Engine
    every: int = 1

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the observer's outputs."""
        return self.engine.outputs

    @property
    def friction(self) -> tuple[str, ...]:
        """Names of the outputs that are the friction force on a coordinate."""
        return tuple(name for name in self.outputs if name.startswith(FRICTION))


def generated_observer(spec: Spec, observer: Observer, every: int = 1) -> ObserverInLoop:
    """An observer's generated code, ready to run. Raises BadInput without a C compiler, or if it refuses the code."""
    return ObserverInLoop(engine_of(spec, observer, spec.code), every)


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

    Attributes:
        latest: (outputs,) the estimates of its last sample, NaN before the first.
        fault: 1 where it held its estimates, else 0.
    """

    def __init__(self, observer: ObserverInLoop, system: System, cancellation: Cancellation | None) -> None:
        self._engine, self._every = observer.engine, observer.every
        names = [s.name for s in (*system.positions, *system.velocities, *system.inputs)]
        self._columns = [names.index(name) for name in self._engine.inputs]
        self._signals = np.zeros(len(names))  # positions, velocities, inputs
        self._inputs = self._signals[len(names) - len(system.inputs) :]
        self.latest = np.full(len(observer.outputs), np.nan)
        self.fault = 0
        self._cancellation, self._delay = cancellation, 0 if cancellation is None else cancellation.delay
        chosen = () if cancellation is None else cancellation.outputs or observer.friction
        self._chosen = [observer.outputs.index(name) for name in chosen]
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

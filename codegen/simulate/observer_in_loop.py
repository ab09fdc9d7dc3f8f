"""The generated observer in simulation with a plant, and the input that cancels the estimated friction."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from codegen.base.arrays import Array
from codegen.emit.package import emit_sources, make_header
from codegen.mechanics.system import System
from codegen.observers import Observer
from codegen.program import Program, build_program
from codegen.replay.engine import Engine, TwinEngine, engine_for
from codegen.spec.model import Spec

FRICTION = "F_hat_on_"


@dataclass(frozen=True)
class ObserverInLoop:
    """A generated observer, stepped once every ``every`` samples of the loop.

    Attributes:
        program: for the names and order of inputs and outputs.
        engine: the compiled C or the Python twin.
        every: the observer's sample time over the loop's, a whole number.
    """

    program: Program
    engine: Engine
    every: int = 1

    @property
    def outputs(self) -> tuple[str, ...]:
        return tuple(name for name, _, _ in self.program.outputs)

    @property
    def friction(self) -> tuple[str, ...]:
        """The outputs that are the friction force on each coordinate."""
        return tuple(name for name in self.outputs if name.startswith(FRICTION))


def generated_observer(spec: Spec, observer: Observer, every: int = 1, twin: bool = False) -> ObserverInLoop:
    """The generated code of an observer, ready to step: compiled C, or the twin on demand or without a C compiler.

    Raises BadInput if the compiler refuses the code.
    """
    program = build_program(observer, spec.code)
    files = emit_sources(program, make_header(spec.path.name, spec.sha256, spec.source))
    return ObserverInLoop(program, (TwinEngine if twin else engine_for)(program, files), every)


@dataclass(frozen=True)
class Cancellation:
    """The cancelling input ū = gain · C · F̂, added to the controller's command.

    Attributes:
        matrix: C, (m, outputs chosen).
        gain: 1 cancels the whole estimate.
        delay: samples of the observer between estimate and use. 0 uses the estimate of the same instant: outputs need
            only what was measured by then, so that they are asked for first and the step is done once the command is
            known. 1 is a program that computes the command, sends it and then calls the observer.
        outputs: which of the observer's outputs C multiplies; the friction force on each coordinate by default.
    """

    matrix: Array
    gain: float = 1.0
    delay: int = 0
    outputs: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a delay below zero. Raises ValueError with the delay."""
        if self.delay < 0:
            raise ValueError(f"a delay of {self.delay} samples; expected 0 or more")


class Estimator:
    """An observer while a loop runs: its estimates so far, and the cancelling input from them."""

    def __init__(self, observer: ObserverInLoop, system: System, cancellation: Cancellation | None) -> None:
        """Match the observer's inputs with the system's; keep as many estimates as the cancellation looks back.

        Raises ValueError for an input of the observer that the system has not.
        """
        self.observer = observer
        names = [s.name for s in (*system.positions, *system.velocities)]
        inputs = [w.name for w in system.inputs]
        for field in observer.program.inputs:
            if field.name not in names + inputs:
                raise ValueError(f"an observer of `{field.name}`; expected one of {', '.join(names + inputs)}")
        fields = [f.name for f in observer.program.inputs]
        self._measured = [names.index(name) for name in fields if name in names]
        self._row = np.zeros((1, len(fields)))
        self._heads = [k for k, name in enumerate(fields) if name in names]
        self._tails = [k for k, name in enumerate(fields) if name in inputs]
        self._commanded = [inputs.index(name) for name in fields if name in inputs]
        self.latest = np.full(len(observer.outputs), np.nan)
        self.fault = 0
        self._started = False
        chosen = () if cancellation is None else cancellation.outputs or observer.friction
        self._chosen = [observer.outputs.index(name) for name in chosen]
        self._older: deque[Array] = deque(maxlen=1 if cancellation is None else max(cancellation.delay, 1))

    def measure(self, positions: Array, velocities: Array, sent: Array) -> None:
        """Take a sample's measurements; ``sent`` is the command that acts until now."""
        self._row[0, self._heads] = np.concatenate([positions, velocities])[self._measured]
        self._row[0, self._tails] = sent[self._commanded]
        if not self._started:
            self.observer.engine.start(self._row[0])
            self._started = True

    def foresee(self) -> None:
        """Estimates of the sample measured, before its command is known."""
        self.latest = self.observer.engine.peek(self._row)

    def step(self, sent: Array) -> None:
        """The observer's step over the sample measured, under its command."""
        self._row[0, self._tails] = sent[self._commanded]
        estimates, faults = self.observer.engine.run(self._row)
        self.latest, self.fault = estimates[0], int(faults[0])
        self._older.append(self.latest)

    def cancelling(self, cancellation: Cancellation) -> Array:
        """ū (m,), zero before there is an estimate old enough."""
        if cancellation.delay == 0:
            estimate = self.latest
        elif len(self._older) == cancellation.delay:
            estimate = self._older[0]
        else:
            return np.zeros(cancellation.matrix.shape[0])
        return np.asarray(cancellation.gain * (cancellation.matrix @ estimate[self._chosen]), dtype=float)

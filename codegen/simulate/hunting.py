"""Limit cycles: whether a motion ends in one, and up to which gain of the cancelling input a machine has none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.cancellation import cancelling_outputs
from codegen.mechanics.sampling import numbers_over
from codegen.mechanics.system import System
from codegen.simulate.closed_loop import declared_sensors, generated_in_loop
from codegen.simulate.controller import control_loops, declared_controller, input_limit
from codegen.simulate.observed_loop import run_loop
from codegen.simulate.observer_in_loop import Cancellation, ObserverInLoop
from codegen.simulate.simulable import refuse_unsimulable
from codegen.spec.model import CancellationChoice, Simulation, Spec
from codegen.spec.numerics import numerical

WINDOWS = 3
PERIODS = 2
KEEPS = 0.95
HYSTERESIS = 0.25


@dataclass(frozen=True)
class LimitCycle:
    """An oscillation of one coordinate at steady state.

    Attributes:
        coordinate: its index.
        amplitude: half of peak to peak in the last window; infinite where the motion left all bounds.
        period: s; NaN where the motion left all bounds.
    """

    coordinate: int
    amplitude: float
    period: float


def limit_cycle(time: Array, positions: Array, floor: Array) -> LimitCycle | None:
    """The limit cycle that a run ends in, or None.

    The second half of the run is cut into three windows. A coordinate is in a limit cycle if in each window it goes
    through at least two periods, and its amplitude is at least ``floor`` and does not decay: that of the last window is
    95 % or more of that of the first. A period ends where the motion passes the middle of its swing upwards, after it
    was a quarter of the amplitude below. A machine at rest, or one that creeps, is in none.

    Args:
        time: (N,) s, evenly spaced.
        positions: (N, n); NaN from where the motion is not finite, which counts as a limit cycle.
        floor: (n,) amplitudes below which nothing counts, such as a few encoder steps.
    """
    if not np.isfinite(positions).all():
        return LimitCycle(int(np.argmin(np.isfinite(positions).all(axis=0))), float("inf"), float("nan"))
    late = time >= (time[0] + time[-1]) / 2
    found = [_of_coordinate(time[late], positions[late, i], i, float(floor[i])) for i in range(positions.shape[1])]
    cycles = [c for c in found if c is not None]
    return max(cycles, key=lambda c: c.amplitude / max(float(floor[c.coordinate]), 1e-300), default=None)


def at_rest(positions: Array, floor: Array) -> bool:
    """Whether no coordinate moved by ``floor`` in the last sixth of a run."""
    late = positions[-max(2, len(positions) // (2 * WINDOWS)) :]
    return bool(np.isfinite(late).all() and np.all(np.ptp(late, axis=0) < 2 * floor))


def _of_coordinate(time: Array, x: Array, index: int, floor: float) -> LimitCycle | None:
    amplitudes, periods = [], []
    for part, at in zip(np.array_split(x, WINDOWS), np.array_split(time, WINDOWS), strict=True):
        amplitude = float(np.ptp(part)) / 2
        if amplitude < floor or amplitude == 0:
            return None
        passes = _upward_passes(part - (part.max() + part.min()) / 2, HYSTERESIS * amplitude)
        if len(passes) < PERIODS + 1:
            return None
        amplitudes.append(amplitude)
        periods.append(float(at[passes[-1]] - at[passes[0]]) / (len(passes) - 1))
    if amplitudes[-1] < KEEPS * amplitudes[0]:
        return None
    return LimitCycle(index, amplitudes[-1], periods[-1])


def _upward_passes(x: Array, band: float) -> list[int]:
    """Where x passes zero upwards, each time after it was below −band."""
    passes, below = [], False
    for k, value in enumerate(x.tolist()):
        if value < -band:
            below = True
        elif below and value >= 0:
            passes.append(k)
            below = False
    return passes


HALVINGS = 6
FLOOR = 1e-3
STEPS = 2
LONGER = 4


@dataclass(frozen=True)
class Trial:
    """One gain: the limit cycle from rest away from the reference, and from a push at the reference.

    ``decided`` says whether each run ended at rest or in a limit cycle, and not still creeping or dying out.
    """

    gain: float
    from_rest: LimitCycle | None
    from_push: LimitCycle | None
    decided: bool

    @property
    def cycle(self) -> LimitCycle | None:
        """That with the larger amplitude."""
        found = [c for c in (self.from_rest, self.from_push) if c is not None]
        return max(found, key=lambda c: c.amplitude, default=None)


@dataclass(frozen=True)
class Hunting:
    """The gains that were tried, and the largest without a limit cycle.

    Attributes:
        trials: by rising gain; without cancellation (0) and full cancellation (1) among them.
        largest: the largest gain up to 1 below which no trial hunted, to 1/64; None where the machine hunts without.
        away, push: (n,) initial distance from the reference, and initial velocity at it; SI.
        delay: samples of the observer between estimate and use.
        duration: s of each run.
    """

    trials: tuple[Trial, ...]
    largest: float | None
    away: Array
    push: Array
    delay: int
    duration: float


@numerical("the closed loop")
def hunting(spec: Spec, system: System, progress: Callable[[float], None] | None = None) -> Hunting:
    """Close the loop of the spec's controller and generated observer at several gains of the cancelling input.

    The reference stays at its first value; each gain is run from rest at half the reference's swing from it, and from
    the reference with the velocity that carries as much energy against the controller's spring. Encoders have their
    steps and no noise. Where full cancellation hunts, the gain is halved in between six times; every gain below the
    found one that was tried is then free of it, but a gain in between was not tried. A run that ends neither at rest
    nor in a limit cycle is run again four times as long.

    Args:
        progress: called with the share that is done, from 0 to 1.

    Raises:
        BadInput: for a spec without an observer or without a controller, or a machine that cannot be simulated or
            cancelled.
    """
    loop = Loop(spec, system)
    trials: dict[float, Trial] = {}
    total = 2 + HALVINGS + 2

    def hunts(gain: float) -> bool:
        trials[gain] = loop.trial(gain)
        if progress is not None:
            progress(min(len(trials) / total, 1.0))
        return trials[gain].cycle is not None

    largest = _searched(hunts)
    tried = tuple(trials[gain] for gain in sorted(trials))
    return Hunting(tried, largest, loop.away, loop.push, loop.simulation.cancel_delay, loop.simulation.duration)


def _searched(hunts: Callable[[float], bool]) -> float | None:
    """The largest gain up to 1 that does not hunt, to 1/64; None where the machine hunts without cancellation."""
    if hunts(0.0):
        hunts(1.0)
        return None
    if not hunts(1.0):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if hunts(middle) else (middle, high)
    return low


class Loop:
    """The closed loop about a constant reference; raises BadInput as ``hunting``."""

    def __init__(self, spec: Spec, system: System) -> None:
        simulation = spec.simulation
        if simulation is None or not simulation.reference:
            expected = "`simulation:` with a `reference:` and gains; hunting is a limit cycle of its controller"
            raise BadInput(spec.place("simulation"), "no controller", expected, code="SPEC025")
        refuse_unsimulable(spec, system)
        choice = replace(spec.cancellation or CancellationChoice(), gain=sympy.S.One)
        spec = replace(spec, cancellation=choice)
        self._spec, self._system = spec, system
        self._samples = round(simulation.duration / simulation.sample_time)
        moving = declared_controller(spec, simulation, self._samples)
        assert moving.reference is not None
        times = np.linspace(0, simulation.duration, 400, endpoint=False)
        course = np.array([moving.reference(float(t)) for t in times])
        self._at = course[0]
        self.away = _swing(spec, simulation, course)
        self.simulation = replace(
            simulation,
            inputs={},
            reference={name: _constant(f) for name, f in simulation.reference.items()},
            position_noise={},
            velocity_noise=dict.fromkeys(simulation.velocity_noise, 0.0),
            observer=True,
        )
        self.push = self.away * _stiffness_rate(spec, self.simulation, system, self._at)
        self._sensors = declared_sensors(spec, self.simulation)
        steps = np.array([simulation.encoder_step.get(x, 0.0) for x in spec.positions])
        self._floor = np.maximum(FLOOR * self.away.max(), STEPS * steps)
        self._observer: ObserverInLoop = generated_in_loop(spec, self.simulation)

    def trial(self, gain: float) -> Trial:
        still = np.zeros_like(self._at)
        rest, rested = self._run(gain, self._at + self.away, still)
        push, settled = self._run(gain, self._at, self.push)
        return Trial(gain, rest, push, rested and settled)

    def _run(self, gain: float, x: Array, v: Array) -> tuple[LimitCycle | None, bool]:
        cycle, decided = self._once(gain, x, v, self._samples)
        return (cycle, decided) if decided else self._once(gain, x, v, LONGER * self._samples)

    def _once(self, gain: float, x: Array, v: Array, samples: int) -> tuple[LimitCycle | None, bool]:
        simulation, system = self.simulation, self._system
        identity = np.eye(len(system.inputs))
        run = run_loop(
            system,
            simulation.sample_time,
            samples,
            declared_controller(self._spec, simulation, samples),
            self._observer,
            Cancellation(identity, gain, simulation.cancel_delay, cancelling_outputs(system)),
            self._sensors,
            input_limit(self._spec, simulation),
            (x, v),
        )
        cycle = limit_cycle(run.time, run.true_positions, self._floor)
        return cycle, cycle is not None or at_rest(run.true_positions, self._floor)


def _constant(reference: sympy.Expr) -> sympy.Expr:
    return sympy.Float(reference.subs(dict.fromkeys(reference.free_symbols, 0)))


def _swing(spec: Spec, simulation: Simulation, course: Array) -> Array:
    """(n,) half the swing of each reference; where all are constant, a tenth of them, or of a metre or radian."""
    swing = np.ptp(course, axis=0) / 2
    if not swing.any():
        moved = {loop.coordinate for loop in control_loops(spec, simulation).values()}
        for i in moved:
            swing[i] = 0.1 * (abs(course[0, i]) or 1.0)
    return np.asarray(swing, dtype=float)


def _stiffness_rate(spec: Spec, simulation: Simulation, system: System, at: Array) -> Array:
    """(n,) √(k_p B / M) of each controlled coordinate at the reference, 1/s; 1 where that is not positive."""
    rates = np.ones(len(at))
    B, M = (
        numbers_over(m, system.values, system.positions, at[None, :])[0]
        for m in (system.input_matrix, system.mass_matrix)
    )
    for j, loop in control_loops(spec, simulation).items():
        i = loop.coordinate
        stiffness = simulation.position_gain[system.inputs[j].name] * B[i, j] / M[i, i]
        if stiffness > 0:
            rates[i] = np.sqrt(stiffness)
    return rates

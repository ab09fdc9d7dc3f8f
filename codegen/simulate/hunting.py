"""Friction-induced limit cycles (hunting): detection, and the largest gain of the cancelling input without one."""

from bisect import bisect
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.mechanics.sampling import numbers_over
from codegen.mechanics.system import System
from codegen.simulate.closed_loop import declared_cancellation, declared_sensors, generated_in_loop
from codegen.simulate.controller import control_loops, declared_controller, input_limit
from codegen.simulate.observed_loop import SampledLoop, run_loop
from codegen.simulate.simulable import refuse_unsimulable
from codegen.spec.model import CancellationChoice, Simulation, Spec
from codegen.spec.numerics import numerical

WINDOWS = 3
"""Windows of the second half of a run, over which amplitudes are compared."""
PERIODS = 2
"""Least number of periods in a window."""
KEEPS = 0.95
"""Least ratio of the last window's amplitude to the first's."""
HYSTERESIS = 0.25
"""Share of the amplitude below the middle that begins a new period."""


@dataclass(frozen=True)
class LimitCycle:
    """An oscillation of one coordinate at steady state.

    Attributes:
        coordinate: its index.
        amplitude: half of peak to peak in the last window; infinite if the motion is unbounded.
        period: s; NaN if the motion is unbounded.
    """

    coordinate: int
    amplitude: float
    period: float


def limit_cycle(time: Array, positions: Array, floor: Array) -> LimitCycle | None:
    """The limit cycle at the end of a run, of the coordinate with the largest amplitude/floor; None if there is none.

    The second half of the run is divided into three windows. A coordinate is in a limit cycle if it has at least two
    periods in each window, and an amplitude of at least ``floor`` that does not decay: in the last window it is 95 % or
    more of that in the first. A period ends when the motion crosses its mid-range upwards, after it was a quarter of
    the amplitude below. A machine at rest or creeping has none.

    Args:
        time: (N,) s, evenly spaced.
        positions: (N, n); NaN from where the motion is not finite, which counts as a limit cycle.
        floor: (n,) smallest amplitudes that count, such as a few encoder steps.
    """
    if not np.isfinite(positions).all():
        return LimitCycle(int(np.argmin(np.isfinite(positions).all(axis=0))), float("inf"), float("nan"))
    late = time >= (time[0] + time[-1]) / 2
    found = [_of_coordinate(time[late], positions[late, i], i, float(floor[i])) for i in range(positions.shape[1])]
    cycles = [c for c in found if c is not None]
    return max(cycles, key=lambda c: c.amplitude / max(float(floor[c.coordinate]), 1e-300), default=None)


def at_rest(positions: Array, floor: Array) -> bool:
    """Whether no coordinate moved by ± ``floor`` or more in the last sixth of a run."""
    late = positions[-max(2, len(positions) // (2 * WINDOWS)) :]
    return bool(np.isfinite(late).all() and np.all(np.ptp(late, axis=0) < 2 * floor))


def _of_coordinate(time: Array, x: Array, index: int, floor: float) -> LimitCycle | None:
    """As ``limit_cycle``, for one coordinate over the second half of a run."""
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
    """Indices at which x crosses zero upwards, after it was below −band."""
    passes, below = [], False
    for k, value in enumerate(x.tolist()):
        if value < -band:
            below = True
        elif below and value >= 0:
            passes.append(k)
            below = False
    return passes


HALVINGS = 6
"""Bisections of the gain."""
FLOOR = 1e-3
"""Smallest amplitude that counts, as a share of the initial displacement."""
STEPS = 2
"""The same in encoder steps."""
LONGER = 4
"""Factor on the duration of a run that is repeated."""


@dataclass(frozen=True)
class Trial:
    """Two runs at one gain of the cancelling input.

    Attributes:
        from_rest: limit cycle of the run that starts at rest, displaced from the reference; None without one.
        from_push: that of the run that starts at the reference with a velocity.
        decided: whether both runs ended at rest or in a limit cycle, not creeping or decaying.
    """

    gain: float
    from_rest: LimitCycle | None
    from_push: LimitCycle | None
    decided: bool

    @property
    def cycle(self) -> LimitCycle | None:
        """The limit cycle of the larger amplitude; None if neither run has one."""
        found = [c for c in (self.from_rest, self.from_push) if c is not None]
        return max(found, key=lambda c: c.amplitude, default=None)


@dataclass(frozen=True)
class Hunting:
    """Trials at several gains of the cancelling input, and the largest gain without a limit cycle.

    Attributes:
        trials: in the order of the gain; no cancellation (0) and full cancellation (1) are among them.
        largest: largest gain up to 1, to 1/64, up to which no trial has a limit cycle; None if the machine has one
            without cancellation.
        away, push: (n,) initial displacement from the reference, and initial velocity at it; SI.
        delay: samples of the observer between estimate and use.
        duration: of each run, s.
    """

    trials: tuple[Trial, ...]
    largest: float | None
    away: Array
    push: Array
    delay: int
    duration: float


@numerical("the closed loop")
def hunting(spec: Spec, system: System, progress: Callable[[float], None] | None = None) -> Hunting:
    """The largest gain of the cancelling input without a limit cycle, by simulation of the closed loop.

    The reference is constant at its first value. Each gain is simulated twice: from rest, displaced by half the swing
    of the declared reference, and from the reference with a velocity of the same energy against the controller's
    stiffness. Encoders have their steps and no noise. If full cancellation has a limit cycle, the gain is bisected six
    times; gains between those tried are not examined. A run that ends neither at rest nor in a limit cycle is repeated
    four times as long. ``progress``: called with the share that is done, from 0 to 1. Raises BadInput for a spec
    without an observer or without a controller, or a machine that cannot be simulated or cancelled.
    """
    loop = RegulatorLoop(spec, system)
    trials: dict[float, Trial] = {}
    total = 2 + HALVINGS + 2

    def hunts(gain: float) -> bool:
        trials[gain] = loop.trial(gain)
        if progress is not None:
            progress(min(len(trials) / total, 1.0))
        return trials[gain].cycle is not None

    without, in_full = hunts(0.0), hunts(1.0)
    largest = None if without else 1.0
    if in_full and not without:
        parts = 1 << HALVINGS
        largest = bisect(range(1, parts), False, key=lambda k: hunts(k / parts)) / parts
    tried = tuple(trials[gain] for gain in sorted(trials))
    return Hunting(tried, largest, loop.away, loop.push, loop.simulation.cancel_delay, loop.simulation.duration)


class RegulatorLoop:
    """The closed loop of controller, observer and cancelling input at a constant reference.

    Raises BadInput as ``hunting``.
    """

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
        times = np.linspace(0, simulation.duration, 400, endpoint=False)
        course = np.array([moving.reference(float(t)) for t in times])
        self._at = course[0]
        self.away = _swing(spec, simulation, course)
        self.simulation = replace(
            simulation,
            inputs={},
            reference={
                name: sympy.Float(f.subs(dict.fromkeys(f.free_symbols, 0))) for name, f in simulation.reference.items()
            },
            position_noise={},
            velocity_noise=dict.fromkeys(simulation.velocity_noise, 0.0),
            observer=True,
        )
        self.push = self.away * _stiffness_rate(spec, self.simulation, system, self._at)
        self._sensors = declared_sensors(spec, self.simulation)
        steps = np.array([simulation.encoder_step.get(x, 0.0) for x in spec.positions])
        self._floor = np.maximum(FLOOR * self.away.max(), STEPS * steps)
        self._observer, self._every = generated_in_loop(spec, self.simulation)

    def trial(self, gain: float) -> Trial:
        """Both runs at one gain."""
        still = np.zeros_like(self._at)
        rest, rested = self._run(gain, self._at + self.away, still)
        push, settled = self._run(gain, self._at, self.push)
        return Trial(gain, rest, push, rested and settled)

    def _run(self, gain: float, x: Array, v: Array) -> tuple[LimitCycle | None, bool]:
        """(limit cycle, decided) of a run from x, v; an undecided run is repeated with a longer duration."""
        simulation, system = self.simulation, self._system
        for samples in (self._samples, LONGER * self._samples):
            loop = SampledLoop(
                declared_controller(self._spec, simulation, samples),
                self._observer,
                declared_cancellation(simulation, system, gain),
                self._sensors,
                limit=input_limit(self._spec, simulation),
                every=self._every,
            )
            run = run_loop(system, loop, simulation.sample_time, samples, (x, v))
            cycle = limit_cycle(run.time, run.true_positions, self._floor)
            decided = cycle is not None or at_rest(run.true_positions, self._floor)
            if decided:
                break
        return cycle, decided


def _swing(spec: Spec, simulation: Simulation, course: Array) -> Array:
    """Half of peak to peak of each reference, (n,); if all are constant, a tenth of their values, or 0.1 m or rad."""
    swing = np.ptp(course, axis=0) / 2
    if not swing.any():
        moved = {loop.coordinate for loop in control_loops(spec, simulation).values()}
        for i in moved:
            swing[i] = 0.1 * (abs(course[0, i]) or 1.0)
    return np.asarray(swing, dtype=float)


def _stiffness_rate(spec: Spec, simulation: Simulation, system: System, at: Array) -> Array:
    """√(k_p B / M) of each controlled coordinate at the reference, (n,) in 1/s; 1 where that is not positive."""
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

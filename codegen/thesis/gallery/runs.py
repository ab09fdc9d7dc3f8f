"""Runs of a figure's machine: an observer that only watches, or one whose estimate is cancelled in the closed loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize

from codegen.base.arrays import Array
from codegen.effects.declare import system_of
from codegen.mechanics import build_system
from codegen.mechanics.system import System
from codegen.observers import build_observer
from codegen.simulate.controller import Controller, Feedback, Sample, declared_controller, sampled
from codegen.simulate.loop_run import LoopRun
from codegen.simulate.observed_loop import run_loop
from codegen.simulate.observer_in_loop import Cancellation, ObserverInLoop, generated_observer
from codegen.spec.model import Spec
from codegen.thesis.gallery.measures import rms
from codegen.thesis.gallery.setting import Setting, from_zero, without_friction

Gains = tuple[float, float, float]
"""Of position, velocity and integral."""
STIFFNESSES = (1.0, 2.0, 4.0, 8.0)
"""Where the PID's tuning starts: natural frequency over that of the printed g₁ and g₂."""
DAMPINGS = (0.5, 1.0)
"""The same, damping over the printed one."""
INTEGRAL_SHARE = 0.3
"""The same, integral gain over the one at which a servo of unit mass is no longer stable."""
SPREAD = np.log(1.25)
"""Of the gains, on a log scale: an optimum has worse neighbours this far on either side of each."""
TUNING_ROUNDS = 10
RUNAWAY = 1e6
"""m or rad."""
TUNING_SEED = 1001


@dataclass
class Servo:
    """The control law of the thesis, u = −g₁(x − x_r) − g₂ v̂, (2.2) and (8.15)."""

    period: float
    reference: Array
    position_gain: float
    velocity_gain: float
    velocity: int | None

    def start(self) -> None:
        """Nothing is kept between samples."""

    def command(self, now: Sample) -> Array:
        """u, (1,); v̂ is the observer's output number ``velocity``, or what the sensors give."""
        known = self.velocity is not None and bool(np.isfinite(now.estimates[self.velocity]))
        v = now.estimates[self.velocity] if known else now.velocities[0]
        x_r = self.reference[round(now.time / self.period)]
        return np.array([-self.position_gain * (now.positions[0] - x_r) - self.velocity_gain * v])


def servo_run(
    spec: Spec,
    setting: Setting,
    cancel: float | None = 1.0,
    observed: Spec | None = None,
    plant: System | None = None,
    delay: int = 0,
    substeps: int | None = None,
) -> LoopRun:
    """A position servo on one coordinate, as its spec's simulation section says.

    Args:
        cancel: share of the friction estimate that is added to the command; None where no observer runs.
        observed: what the observer is made from; the spec itself, with levels of zero, if not given.
        plant: the machine, where it is not the spec's.
        delay: samples between estimate and use.
        substeps: of the plant in a sample, where the simulator's choice is finer than needed.
    """
    spec = setting.applied(spec)
    simulation = spec.required_simulation
    period, samples = simulation.sample_time, sample_count(spec)
    observer = None
    if cancel is not None:
        observer = observer_of(setting.applied(observed) if observed is not None else from_zero(spec))
    outputs = observer.outputs if observer is not None else ()
    estimate = next((k for k, name in enumerate(outputs) if name == f"{spec.velocities[0]}_hat"), None)
    gains = [next(iter(g.values())) for g in (simulation.position_gain, simulation.velocity_gain)]
    servo = Servo(period, reference_of(spec, samples), gains[0], gains[1], estimate)
    cancellation = None if cancel is None else Cancellation(np.eye(1), cancel, delay)
    return closed_loop(spec, setting, servo, observer, cancellation, plant, substeps=substeps)


def closed_loop(
    spec: Spec,
    setting: Setting,
    controller: Controller,
    observer: ObserverInLoop | None = None,
    cancellation: Cancellation | None = None,
    plant: System | None = None,
    **more: Any,
) -> LoopRun:
    """A run of an applied spec's machine, or of ``plant``, with the sensors and the noise of a setting.

    Args:
        more: of ``run_loop``.
    """
    simulation = spec.required_simulation
    given: dict[str, Any] = {"sensors": setting.sensors(spec, velocity_measured(spec)), **more}
    given.setdefault("seed", simulation.seed + setting.seed)
    machine = plant if plant is not None else system_of(spec)
    return run_loop(machine, simulation.sample_time, sample_count(spec), controller, observer, cancellation, **given)


def sample_count(spec: Spec) -> int:
    """Samples of a spec's simulation."""
    simulation = spec.required_simulation
    return round(simulation.duration / simulation.sample_time)


def observer_of(spec: Spec) -> ObserverInLoop:
    """The generated observer of a spec."""
    return generated_observer(spec, build_observer(spec, build_system(spec)))


def velocity_measured(spec: Spec) -> bool:
    """Whether the machine has a tachometer: where its observer takes one, or its simulation gives it a noise."""
    if spec.observer is not None:
        return spec.observer.velocity == "measured"
    return bool(spec.required_simulation.velocity_noise)


def reference_of(spec: Spec, samples: int) -> Array:
    """x_r at each sample, (N,)."""
    simulation = spec.required_simulation
    signal = declared_controller(spec, simulation, samples).reference
    if signal is None:
        raise ValueError(f"{spec.name} has no reference")
    return np.array([signal(k * simulation.sample_time)[0] for k in range(samples)])


def ideal_run(spec: Spec, setting: Setting) -> LoopRun:
    """The servo without friction and without noise."""
    return servo_run(without_friction(spec), replace(setting, noise=0.0), cancel=None)


def pid_run(
    spec: Spec,
    setting: Setting,
    ideal: LoopRun,
    gains: Gains,
    plant: System | None = None,
    seed: int | None = None,
    substeps: int | None = None,
) -> LoopRun:
    """The servo under the rival: the command of the ideal motion, plus PID on the distance to it.

    It is the strongest form of a PID here, since no step of the reference winds up its integral. Velocity is what the
    sensors give.
    """
    spec = setting.applied(spec)
    feed, position, velocity = (
        sampled(values, spec.required_simulation.sample_time)
        for values in (ideal.inputs, ideal.true_positions, ideal.true_velocities)
    )
    pid = Feedback(1, 1, feed, position, velocity, *(np.array([[gain]]) for gain in gains))
    noise: dict[str, Any] = {} if seed is None else {"seed": seed}
    return closed_loop(spec, setting, pid, plant=plant, substeps=substeps, **noise)


def tuned_pid(
    spec: Spec, setting: Setting, ideal: LoopRun, plant: System | None = None, substeps: int | None = None
) -> Gains:
    """The PID with the least RMS distance to the ideal: the best of a few starts, then Nelder and Mead's simplex.

    The distance is the larger of those with friction and without: else gains win that are unstable without friction,
    which damps them. The gains have no bounds and the command no limit; noise and sample time alone keep them finite.
    It is tuned under another noise than it is measured with.

    Raises:
        ValueError: if no optimum is found that has worse neighbours on either side of each gain.
    """
    simulation = spec.required_simulation
    g_1, g_2 = (next(iter(g.values())) for g in (simulation.position_gain, simulation.velocity_gain))

    def gains(logs: Array) -> Gains:
        stiffness, damping, share = (float(part) for part in np.exp(logs))
        return g_1 * stiffness**2, g_2 * stiffness * damping, share * g_1 * g_2 * damping * stiffness**3

    machines = (plant if plant is not None else system_of(spec), system_of(without_friction(spec)))

    def distance(logs: Array) -> float:
        runs = [pid_run(spec, setting, ideal, gains(logs), machine, TUNING_SEED, substeps) for machine in machines]
        # A loop that runs away is as bad as a distance of 10⁶; its square may not overflow.
        errors = [np.nan_to_num(np.abs(run.true_positions - ideal.true_positions), nan=RUNAWAY) for run in runs]
        return max(rms(np.minimum(error, RUNAWAY).ravel()) for error in errors)

    around = SPREAD * np.eye(3)
    best = min((np.log([s, d, INTEGRAL_SHARE]) for s in STIFFNESSES for d in DAMPINGS), key=distance)
    for _ in range(TUNING_ROUNDS):
        options = {
            "initial_simplex": np.vstack([best, best + 1.5 * around]),
            "xatol": SPREAD / 4,
            "fatol": distance(best) / 100,
        }
        found = minimize(distance, best, method="Nelder-Mead", options=options).x
        best = min((*(found + around), *(found - around)), key=distance)
        if distance(found) < distance(best):
            return gains(found)
    raise ValueError(f"no optimum of the PID's gains for {spec.name}")


def watch(spec: Spec, setting: Setting, observers: Mapping[str, Spec]) -> dict[str, LoopRun]:
    """One open-loop motion with its noise as ``motion``, and what each observer estimates from it."""
    spec = setting.applied(spec)
    seen = closed_loop(spec, setting, declared_controller(spec, spec.required_simulation, sample_count(spec)))
    runs = {"motion": seen}
    for name, observed in observers.items():
        observer = observer_of(from_zero(setting.applied(observed)))
        rows = np.hstack([seen.positions, seen.inputs])
        observer.engine.start(rows[0])
        estimates, faults = observer.engine.run(rows)
        runs[name] = replace(seen, outputs=observer.outputs, estimates=estimates, faults=faults)
    return runs


@dataclass(frozen=True)
class Runs:
    """What a figure is drawn from and measured on.

    Attributes:
        specs: of the figure, in the order of its claims entry.
        setting: what was taken of that which the text leaves open.
        loops: name → run.
        pid: gains of the tuned PID, where there is one; tuned once, as drawn.
        numbers: what else a measure needs.
    """

    specs: Sequence[Spec]
    setting: Setting
    loops: Mapping[str, LoopRun] = field(default_factory=dict)
    pid: Gains | None = None
    numbers: Mapping[str, float] = field(default_factory=dict)

    def __getitem__(self, name: str) -> LoopRun:
        return self.loops[name]

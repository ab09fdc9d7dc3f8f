"""Runs of a figure's machine, with observers in open loop, or with one whose estimate is cancelled in closed loop."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import minimize

from codegen.base.arrays import Array
from codegen.effects.declare import system_of
from codegen.mechanics import build_system
from codegen.mechanics.system import System
from codegen.observers import build_observer
from codegen.replay.engine import Engine, engine_of
from codegen.simulate.controller import Feedback, Sample, declared_controller, sampled
from codegen.simulate.loop_run import LoopRun
from codegen.simulate.observed_loop import Cancellation, SampledLoop, run_loop
from codegen.simulate.sensors import Sensors
from codegen.spec.model import Spec
from codegen.thesis.gallery.measures import rms
from codegen.thesis.gallery.setting import Setting, from_zero, without_friction

Gains = tuple[float, float, float]
"""PID gains of position, velocity and integral."""
STIFFNESSES = (1.0, 2.0, 4.0, 8.0)
"""Starting values of the PID's tuning: natural frequency over that of the printed g₁ and g₂."""
DAMPINGS = (0.5, 1.0)
"""Starting values: damping over the printed one."""
INTEGRAL_SHARE = 0.3
"""Starting value: integral gain over the stability limit of a servo of unit mass."""
SPREAD = np.log(1.25)
"""Step on the log scale of the gains at which an optimum has worse neighbours on either side."""
TUNING_ROUNDS = 10
RUNAWAY = 1e6
"""Distance in m or rad that a diverging loop counts as."""
TUNING_SEED = 1001


@dataclass
class Servo(Feedback):
    """The control law of the thesis, u = −g₁(x − x_r) − g₂ v̂, (2.2) and (8.15).

    Attributes:
        velocity: number of the observer's output v̂; the measured velocity is used without one, and until v̂ is known.
    """

    velocity: int | None = None

    def command(self, now: Sample) -> Array:
        estimate = now.velocities if self.velocity is None else now.estimates[[self.velocity]]
        return super().command(now._replace(velocities=estimate) if np.isfinite(estimate).all() else now)


def servo_run(
    spec: Spec,
    setting: Setting,
    cancel: float | None = 1.0,
    observed: Spec | None = None,
    plant: System | None = None,
    delay: int = 0,
    substeps: int | None = None,
) -> LoopRun:
    """Run a position servo on one coordinate, by its spec's ``simulation:``.

    Args:
        cancel: share of the friction estimate that is added to the command; None: no observer.
        observed: spec of the observer; by default the spec with levels of zero.
        plant: the machine; by default the spec's.
        delay: samples between an estimate and its use.
        substeps: of the plant in a sample; by default the simulator's choice.
    """
    spec = setting.applied(spec)
    declared = declared_controller(spec, spec.required_simulation, sample_count(spec))
    observer = None
    if cancel is not None:
        observer = observer_of(setting.applied(observed) if observed is not None else from_zero(spec))
    outputs = observer.outputs if observer is not None else ()
    estimate = next((k for k, name in enumerate(outputs) if name == f"{spec.velocities[0]}_hat"), None)
    servo = Servo(1, reference=declared.reference, velocity=estimate)
    servo.position_gain, servo.velocity_gain = declared.position_gain, declared.velocity_gain
    cancellation = None if cancel is None else Cancellation(cancel, delay)
    loop = SampledLoop(servo, observer, cancellation, *noise_of(spec, setting))
    return closed_loop(spec, loop, plant, substeps)


def noise_of(spec: Spec, setting: Setting) -> tuple[Sensors, int]:
    """The sensors of an applied spec in a setting, and the seed of their noise.

    The velocity is measured where the observer measures it, or without an observer where the simulation has its noise.
    """
    simulation, observer = spec.required_simulation, spec.observer
    measured = bool(simulation.velocity_noise) if observer is None else observer.velocity == "measured"
    return setting.sensors(spec, measured), simulation.seed + setting.seed


def closed_loop(
    spec: Spec,
    loop: SampledLoop,
    plant: System | None = None,
    substeps: int | None = None,
    start: tuple[Array, Array] | None = None,
) -> LoopRun:
    """Run the machine of an applied spec, or ``plant``; ``substeps`` and ``start`` as of ``run_loop``."""
    machine = plant if plant is not None else system_of(spec)
    return run_loop(machine, loop, spec.required_simulation.sample_time, sample_count(spec), start, substeps)


def sample_count(spec: Spec) -> int:
    """Number of samples of a spec's simulation."""
    simulation = spec.required_simulation
    return round(simulation.duration / simulation.sample_time)


def observer_of(spec: Spec) -> Engine:
    """The generated observer of a spec."""
    return engine_of(spec, build_observer(spec, build_system(spec)), spec.code)


def reference_of(spec: Spec, samples: int) -> Array:
    """x_r at each sample, (N,)."""
    simulation = spec.required_simulation
    signal = declared_controller(spec, simulation, samples).reference
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
    """Run the servo with the command of the ideal motion plus a PID on the distance from it.

    This is the best form of a PID here, since steps of the reference do not wind up its integral. The velocity is
    measured.
    """
    spec = setting.applied(spec)
    feed, position, velocity = (
        sampled(values, spec.required_simulation.sample_time)
        for values in (ideal.inputs, ideal.true_positions, ideal.true_velocities)
    )
    pid = Feedback(1, feed, position, velocity, *(np.array([[gain]]) for gain in gains))
    sensors, own = noise_of(spec, setting)
    return closed_loop(spec, SampledLoop(pid, sensors=sensors, seed=own if seed is None else seed), plant, substeps)


def tuned_pid(
    spec: Spec, setting: Setting, ideal: LoopRun, plant: System | None = None, substeps: int | None = None
) -> Gains:
    """The PID gains with the least RMS distance from the ideal motion, by the simplex of Nelder and Mead.

    The distance is the larger of those with and without friction, since friction stabilises gains that are unstable
    without it. Gains and command have no limits; noise and sample time keep the gains finite. The noise is another one
    than that of the measures.

    Raises ValueError if no optimum is found with worse neighbours on either side of each gain.
    """
    simulation = spec.required_simulation
    g_1, g_2 = (next(iter(g.values())) for g in (simulation.position_gain, simulation.velocity_gain))

    def gains(logs: Array) -> Gains:
        stiffness, damping, share = (float(part) for part in np.exp(logs))
        return g_1 * stiffness**2, g_2 * stiffness * damping, share * g_1 * g_2 * damping * stiffness**3

    machines = (plant if plant is not None else system_of(spec), system_of(without_friction(spec)))

    def distance(logs: Array) -> float:
        runs = [pid_run(spec, setting, ideal, gains(logs), machine, TUNING_SEED, substeps) for machine in machines]
        # A diverging loop counts as a distance of 10⁶, so that the square does not overflow.
        errors = [np.nan_to_num(np.abs(run.true_positions - ideal.true_positions), nan=RUNAWAY) for run in runs]
        return max(rms(np.minimum(error, RUNAWAY).ravel()) for error in errors)

    around = SPREAD * np.eye(3)
    best = min((np.log([s, d, INTEGRAL_SHARE]) for s in STIFFNESSES for d in DAMPINGS), key=distance)
    for _ in range(TUNING_ROUNDS):
        simplex = np.vstack([best, best + 1.5 * around])
        options = {"initial_simplex": simplex, "xatol": SPREAD / 4, "fatol": distance(best) / 100}
        found = minimize(distance, best, method="Nelder-Mead", options=options).x
        best = min((*(found + around), *(found - around)), key=distance)
        if distance(found) < distance(best):
            return gains(found)
    raise ValueError(f"no optimum of the PID's gains for {spec.name}")


def watch(spec: Spec, setting: Setting, observers: Mapping[str, Spec]) -> dict[str, LoopRun]:
    """Simulate one open-loop motion and run each observer over its noisy measurements.

    Returns:
        ``motion``: the simulated run; and by the name of each observer that run with its estimates.
    """
    spec = setting.applied(spec)
    controller = declared_controller(spec, spec.required_simulation, sample_count(spec))
    seen = closed_loop(spec, SampledLoop(controller, None, None, *noise_of(spec, setting)))
    runs = {"motion": seen}
    for name, observed in observers.items():
        observer = observer_of(from_zero(setting.applied(observed)))
        rows = np.hstack([seen.positions, seen.inputs])
        observer.start(rows[0])
        estimates, faults = observer.run(rows)
        runs[name] = replace(seen, outputs=observer.outputs, estimates=estimates, faults=faults)
    return runs


@dataclass(frozen=True)
class Runs:
    """The runs of a figure, from which it is drawn and measured.

    Attributes:
        specs: of the figure, in the order of its claims entry.
        setting: of the runs.
        loops: name → run.
        pid: gains of the tuned PID, if there is one; they are tuned once, in the setting as drawn.
        numbers: further numbers for the measures.
    """

    specs: Sequence[Spec]
    setting: Setting
    loops: Mapping[str, LoopRun] = field(default_factory=dict)
    pid: Gains | None = None
    numbers: Mapping[str, float] = field(default_factory=dict)

    def __getitem__(self, name: str) -> LoopRun:
        return self.loops[name]

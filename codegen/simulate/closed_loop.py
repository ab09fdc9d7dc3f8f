"""Closed-loop simulation by a spec's ``simulation`` section, with the spec's observer in the loop if it is chosen."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from codegen.base.errors import BadInput
from codegen.cancellation import cancelling_outputs, with_cancellation
from codegen.mechanics.system import System
from codegen.observers import observer_of
from codegen.replay.engine import Engine, engine_of
from codegen.simulate.controller import declared_controller, input_limit
from codegen.simulate.loop_run import LoopRun
from codegen.simulate.observed_loop import Cancellation, PlantMaker, SampledLoop, run_loop
from codegen.simulate.sensors import Sensors
from codegen.simulate.simulable import refuse_unsimulable, steps_a_sample
from codegen.spec.model import CancellationChoice, Simulation, Spec
from codegen.spec.numerics import numerical


@numerical("the motion that `simulation` asks for")
def simulate(
    spec: Spec, system: System, progress: Callable[[float], None] | None = None, make_plant: PlantMaker | None = None
) -> LoopRun:
    """The run of ``spec.simulation`` on ``system``.

    Inputs are functions of t plus feedback of the measured position where a reference is given; see
    ``declared_controller``. The machine starts at rest at its reference (zero without one), with no command before
    t = 0. With ``observer: true`` the generated observer is simulated too, and ``cancel`` adds that share of the
    cancelling input.

    Args:
        spec: for its ``simulation`` section, and its observer.
        system: the machine, with its effects; it may differ from the spec's.
        progress: called with the share that is done, from 0 to 1.
        make_plant: of the plant, see ``run_loop``.

    Raises:
        BadInput: if the spec has no simulation section, a reference or gain has no counterpart, a contact's law cannot
            be simulated, the observer cannot be sampled, its estimate cannot be cancelled, or the motion becomes
            unbounded.
    """
    simulation = spec.simulation
    if simulation is None:
        expected = "`simulation:` with duration, sample_time, and inputs or a reference with a controller's gains"
        raise BadInput(spec.place("simulation"), "no simulation section", expected, code="SPEC029")
    refuse_unsimulable(spec, system)
    samples = round(simulation.duration / simulation.sample_time)
    controller = declared_controller(spec, simulation, samples)
    observed_spec = spec
    if simulation.cancel is not None:  # the observer must compute the cancelling input, also without its own section
        observed_spec = replace(spec, cancellation=spec.cancellation or CancellationChoice())
    start = controller.reference(0.0)
    observer, every = generated_in_loop(observed_spec, simulation) if simulation.observer else (None, 1)
    loop = SampledLoop(
        controller,
        observer,
        None if simulation.cancel is None else declared_cancellation(simulation, system, simulation.cancel),
        declared_sensors(spec, simulation),
        simulation.seed,
        input_limit(spec, simulation),
        every,
    )
    at_rest = (start, np.zeros_like(start))
    period = simulation.sample_time
    run = run_loop(system, loop, period, samples, at_rest, progress=progress, make_plant=make_plant)
    finite = np.isfinite(run.true_positions).all(axis=1) & np.isfinite(run.true_velocities).all(axis=1)
    if not finite.all():
        found = f"a motion that leaves all bounds at t = {run.time[np.argmin(finite)]:.4g} s"
        expected = "inputs, gains and parameters under which the machine stays bounded"
        raise BadInput(spec.place("simulation"), found, expected, code="SPEC034")
    return run


def declared_sensors(spec: Spec, simulation: Simulation) -> Sensors:
    """Noise and encoder steps of each coordinate; with a velocity noise the controller has tachometers."""
    return Sensors(
        np.array([simulation.position_noise.get(x, 0.0) for x in spec.positions]),
        np.array([simulation.encoder_step.get(x, 0.0) for x in spec.positions]),
        np.array([simulation.velocity_noise.get(v, 0.0) for v in spec.velocities]),
        tachometer=bool(simulation.velocity_noise),
    )


def generated_in_loop(spec: Spec, simulation: Simulation) -> tuple[Engine, int]:
    """The spec's generated observer, with the cancelling input if the spec has one, and its samples in one of the loop.

    Raises BadInput for a spec without an observer, or if its sample time is no whole multiple of the simulation's.
    """
    observer = observer_of(spec)
    every = steps_a_sample(spec, simulation, observer)
    return engine_of(spec, with_cancellation(spec, observer), spec.code), every


def declared_cancellation(simulation: Simulation, system: System, gain: float) -> Cancellation:
    """The cancelling input times a gain; the generated observer computes it, with one output for each input."""
    return Cancellation(gain, simulation.cancel_delay, cancelling_outputs(system))

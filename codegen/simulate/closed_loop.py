"""A machine simulated as its spec's ``simulation`` section says, with the spec's observer in the loop if it asks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from codegen.base.errors import BadInput
from codegen.cancellation import cancelling_outputs, with_cancellation
from codegen.mechanics.system import System
from codegen.observers import observer_of
from codegen.simulate.controller import declared_controller, input_limit
from codegen.simulate.loop_run import LoopRun
from codegen.simulate.observed_loop import Method, PlantMaker, run_loop
from codegen.simulate.observer_in_loop import Cancellation, ObserverInLoop, generated_observer
from codegen.simulate.sensors import Sensors
from codegen.simulate.simulable import refuse_unsimulable, steps_a_sample
from codegen.spec.model import CancellationChoice, Simulation, Spec
from codegen.spec.numerics import numerical


@numerical("the motion that `simulation` asks for")
def simulate(
    spec: Spec,
    system: System,
    progress: Callable[[float], None] | None = None,
    twin: bool = False,
    method: Method = "steps",
    make_plant: PlantMaker | None = None,
) -> LoopRun:
    """Simulate ``spec.simulation`` on ``system``.

    Inputs follow their functions of t, plus feedback of the measured position where a reference is given; see
    ``declared_controller``. The machine starts at rest at its reference (zero without one), with no command before
    t = 0. With ``observer: true`` the spec's generated observer is simulated too, and ``cancel`` adds the input that
    cancels that share of its estimate.

    Args:
        spec: for its ``simulation`` section, and its observer.
        system: the machine, with its effects; it may differ from what the spec declares.
        progress: called with the share that is done, from 0 to 1.
        twin: whether the observer is the Python twin and not the compiled C.
        method, make_plant: of the plant, see ``run_loop``.

    Raises:
        BadInput: if the spec has no simulation section, a reference or gain has no counterpart, a contact's law cannot
            be simulated, the observer cannot be sampled or its estimate not be cancelled, or the motion leaves all
            bounds.
    """
    simulation = spec.simulation
    if simulation is None:
        expected = "`simulation:` with duration, sample_time and inputs"
        raise BadInput(spec.place("simulation"), "no simulation section", expected, code="SPEC029")
    refuse_unsimulable(spec, system)
    samples = round(simulation.duration / simulation.sample_time)
    controller = declared_controller(spec, simulation, samples)
    observed_spec = spec
    if simulation.cancel is not None:  # the observer is to compute the cancelling input, also without that section
        observed_spec = replace(spec, cancellation=spec.cancellation or CancellationChoice())
    start = np.zeros(len(spec.positions)) if controller.reference is None else controller.reference(0.0)
    run = run_loop(
        system,
        simulation.sample_time,
        samples,
        controller,
        generated_in_loop(observed_spec, simulation, twin) if simulation.observer else None,
        _cancellation(simulation, system),
        declared_sensors(spec, simulation),
        input_limit(spec, simulation),
        (start, np.zeros_like(start)),
        seed=simulation.seed,
        progress=progress,
        method=method,
        make_plant=make_plant,
    )
    finite = np.isfinite(run.true_positions).all(axis=1) & np.isfinite(run.true_velocities).all(axis=1)
    if not finite.all():
        found = f"a motion that leaves all bounds at t = {run.time[np.argmin(finite)]:.4g} s"
        expected = "inputs, gains and parameters under which the machine stays bounded"
        raise BadInput(spec.place("simulation"), found, expected, code="SPEC034")
    return run


def declared_sensors(spec: Spec, simulation: Simulation) -> Sensors:
    """Noise and encoder steps of each coordinate; a declared velocity noise gives the controller tachometers."""
    return Sensors(
        np.array([simulation.position_noise.get(x, 0.0) for x in spec.positions]),
        np.array([simulation.encoder_step.get(x, 0.0) for x in spec.positions]),
        np.array([simulation.velocity_noise.get(v, 0.0) for v in spec.velocities]),
        tachometer=bool(simulation.velocity_noise),
    )


def generated_in_loop(spec: Spec, simulation: Simulation, twin: bool = False) -> ObserverInLoop:
    """The spec's generated observer, with the cancelling input if it has one, stepped once in so many loop samples.

    Raises BadInput for a spec without an observer, or whose simulation's sample time does not divide the observer's.
    """
    observer = observer_of(spec)
    return generated_observer(spec, with_cancellation(spec, observer), steps_a_sample(spec, simulation, observer), twin)


def _cancellation(simulation: Simulation, system: System) -> Cancellation | None:
    """The share ``cancel`` of the cancelling input, of which the generated observer computes one output per input."""
    if simulation.cancel is None:
        return None
    identity = np.eye(len(system.inputs))
    return Cancellation(identity, simulation.cancel, simulation.cancel_delay, cancelling_outputs(system))

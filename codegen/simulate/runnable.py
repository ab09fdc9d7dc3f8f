"""What ``stiction simulate`` refuses of a spec before the first step; no plant is built for it."""

from __future__ import annotations

from codegen.base.errors import BadInput
from codegen.mechanics.system import System
from codegen.observers import Observer
from codegen.simulate.declared_control import control_loops
from codegen.simulate.simulable import refuse_unsimulable
from codegen.spec.model import Simulation, Spec
from codegen.spec.numerics import numerical


@numerical("the motion that `simulation` asks for")
def refuse_unrunnable(spec: Spec, system: System, observer: Observer | None) -> None:
    """Raise BadInput, at its line, for what ``simulate`` would refuse before the first step."""
    if spec.simulation is None:
        return
    refuse_unsimulable(spec, system)
    control_loops(spec, spec.simulation)
    if spec.simulation.observer and observer is not None:
        steps_a_sample(spec, spec.simulation, observer)


def steps_a_sample(spec: Spec, simulation: Simulation, observer: Observer) -> int:
    """The observer's sample time over the simulation's."""
    ratio = float(observer.sample_time) / simulation.sample_time
    every = round(ratio)
    if every < 1 or abs(ratio / every - 1) > 1e-9:
        found = f"{simulation.sample_time:g} s in the simulation and {float(observer.sample_time):g} s in the observer"
        raise BadInput(
            spec.place("simulation.sample_time"),
            found,
            "a sample time of which the observer's is a whole multiple",
            code="SPEC024",
        )
    return every

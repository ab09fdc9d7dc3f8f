"""Checks of a spec before a plant is built: laws that cannot be simulated, controllers, and sample times."""

from codegen.base.errors import BadInput
from codegen.mechanics.system import ContactFriction, System
from codegen.observers import Observer
from codegen.simulate.controller import control_loops
from codegen.spec.model import Simulation, Spec
from codegen.spec.numerics import numerical


def is_simulable(contact: ContactFriction) -> bool:
    """Whether a plant simulates the contact's law itself, and not only its level in steady sliding."""
    return contact.law.simulable and contact.level_at_rest is not None


def refuse_unsimulable(spec: Spec, system: System) -> None:
    """Raise BadInput at the first contact whose law no plant can simulate, with the reason and another law."""
    for index, contact in enumerate(system.contacts):
        if not is_simulable(contact):
            name = contact.law.name
            found = f"the law {name} at {contact.name} in a simulation: {contact.law.why_not}"
            expected = f"such as {contact.law.instead}"
            raise BadInput(spec.place(f"friction.contacts[{index}].law"), found, expected, code="SPEC035")


@numerical("the motion that `simulation` asks for")
def refuse_unrunnable(spec: Spec, system: System, observer: Observer | None) -> None:
    """Raise BadInput, at its line, for everything that ``simulate`` refuses before the first step."""
    if spec.simulation is None:
        return
    refuse_unsimulable(spec, system)
    control_loops(spec, spec.simulation)
    if spec.simulation.observer and observer is not None:
        steps_a_sample(spec, spec.simulation, observer)


def steps_a_sample(spec: Spec, simulation: Simulation, observer: Observer) -> int:
    """The observer's sample time over the simulation's; BadInput if that is not a whole number."""
    ratio = float(observer.sample_time) / simulation.sample_time
    every = round(ratio)
    if every < 1 or abs(ratio / every - 1) > 1e-9:
        found = f"{simulation.sample_time:g} s in the simulation and {float(observer.sample_time):g} s in the observer"
        expected = "a sample time of which the observer's is a whole multiple"
        raise BadInput(spec.place("simulation.sample_time"), found, expected, code="SPEC024")
    return every

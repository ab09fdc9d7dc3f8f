"""What ``stiction simulate`` refuses of a spec before a plant is built: laws, controllers and sample times."""

from __future__ import annotations

from codegen.base.errors import BadInput
from codegen.friction import MemoryLaw
from codegen.friction.memory import Karnopp
from codegen.mechanics.system import ContactFriction, System
from codegen.observers import Observer
from codegen.simulate.controller import control_loops
from codegen.spec.model import Simulation, Spec
from codegen.spec.numerics import numerical

_INSTEAD = {
    "rising_static_derjaguin": "static_viscous or karnopp, whose static level does not rise",
    "rising_static_kato": "static_viscous or karnopp, whose static level does not rise",
    "hess_soom_lag": "lorentzian, which is its steady sliding",
    "seven_parameter": "lugre, which has presliding and Stribeck friction, or lorentzian, which is its steady sliding",
    "bristle": "lugre, dahl or reset_integrator, whose state is a mean deflection",
    "ruina": "lugre or tustin",
    "linker_dieterich": "lugre or tustin",
}


def is_simulable(contact: ContactFriction) -> bool:
    """Whether a plant simulates the contact's law itself, and not only its level of steady sliding.

    Karnopp's law is run with a band of no width.
    """
    if isinstance(contact.law, MemoryLaw):
        return isinstance(contact.law, Karnopp)
    return contact.level_at_rest is not None


def refuse_unsimulable(spec: Spec, system: System) -> None:
    """Refuse a machine with a contact that a plant would run by its steady level only.

    Raises BadInput at the contact's law, with the reason and a law that can be run.
    """
    for index, contact in enumerate(system.contacts):
        if not is_simulable(contact):
            name = contact.law.name
            found = f"the law {name} at {contact.name} in a simulation: {contact.law.why_not}"
            instead = _INSTEAD.get(name, "a law of zero memory or with states")
            raise BadInput(spec.place(f"friction.contacts[{index}].law"), found, f"such as {instead}", code="SPEC035")


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
        expected = "a sample time of which the observer's is a whole multiple"
        raise BadInput(spec.place("simulation.sample_time"), found, expected, code="SPEC024")
    return every

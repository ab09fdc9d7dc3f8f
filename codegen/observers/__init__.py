"""The observers: equations only. Adding one: a file with its builder, and its kinds in OBSERVERS."""

from collections.abc import Callable

from codegen.errors import BadInput, nearest_name
from codegen.mechanics.system import System
from codegen.observers.coulomb import coulomb_friction_observer
from codegen.observers.equations import Equation, ErrorVariable, Observer
from codegen.observers.tracking import tracking_observer
from codegen.spec.model import Spec

OBSERVERS: dict[str, Callable[[Spec, System], Observer]] = {
    "cfo": coulomb_friction_observer,
    "gcfo": coulomb_friction_observer,
    "to": tracking_observer,
    "gto": tracking_observer,
    "mgto": tracking_observer,
}
SINGLE = {"cfo": "gcfo", "to": "gto"}


def build_observer(spec: Spec, system: System) -> Observer:
    """The observer that the spec asks for, on this system.

    Raises:
        BadInput: for a spec without observer, an unknown kind, or a single-coordinate kind on several coordinates.
    """
    choice = spec.observer
    if choice is None:
        raise BadInput(spec.place("name"), "no `observer:` section", "observer: {kind, velocity, gains, sample_time}")
    builder = OBSERVERS.get(choice.kind)
    place = spec.place("observer.kind")
    if builder is None:
        raise BadInput(
            place,
            f"unknown observer `{choice.kind}`",
            f"one of {', '.join(OBSERVERS)}",
            nearest_name(choice.kind, OBSERVERS),
        )
    if choice.kind in SINGLE and (system.degrees_of_freedom > 1 or len(system.contacts) > 1):
        found = f"{choice.kind} on {system.degrees_of_freedom} coordinates and {len(system.contacts)} contacts"
        raise BadInput(place, found, f"{SINGLE[choice.kind]}, its general form", SINGLE[choice.kind])
    return builder(spec, system)


__all__ = ["OBSERVERS", "Equation", "ErrorVariable", "Observer", "build_observer"]

"""A spec with what every verb derives from it first: its system and its observer."""

from __future__ import annotations

from dataclasses import dataclass

from codegen.effects.declare import add_declared_effects
from codegen.mechanics import System, build_system
from codegen.observers import Observer, build_observer
from codegen.spec import Spec
from codegen.spec.free_gains import at_middle


@dataclass(frozen=True)
class Model:
    """A spec with its system (declared effects included) and observer, if it has one; free gains at mid-range."""

    spec: Spec
    system: System
    observer: Observer | None


def model_of(spec: Spec) -> Model:
    system = add_declared_effects(build_system(spec), spec)
    return Model(spec, system, build_observer(at_middle(spec), system) if spec.observer is not None else None)

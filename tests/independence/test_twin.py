"""A against the generated code: one step of the Python twin, and two of the plant, from estimates wrong by ± e."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import stiction
from codegen.analysis.error_dynamics import derive_error_dynamics
from codegen.observers import Observer

from .derived import Derived, random_point
from .true_plant import Point, TruePlant
from .variants import SPECS, H, Variant, build, write

CASES = [
    Variant("one_mass", "cfo", "estimated", "", True),
    Variant("two_mass", "gcfo", "measured", "2", False),
    Variant("two_mass", "mgto", "estimated", "", True),
    Variant("one_mass", "dfo", "estimated", "lugre", True),
    Variant("two_mass", "gdfo", "measured", "reset_integrator", False),
]


def generated(variant: Variant, folder: Path) -> ModuleType:
    path = folder / "machine.yaml"
    path.write_text(write(variant))
    stiction.generate(path, folder / "twin", uncertified=True)
    name = f"twin_{variant.name.replace('-', '_')}"
    loader = importlib.util.spec_from_file_location(name, folder / "twin" / "__init__.py")
    assert loader is not None and loader.loader is not None
    twin = importlib.util.module_from_spec(loader)
    sys.modules[name] = twin
    loader.loader.exec_module(twin)
    return twin


def next_error(twin: ModuleType, plant: TruePlant, p: Point, e: Any) -> Any:
    """The error after one step of the twin and an explicit Euler step of the plant."""
    observer = plant.observer
    z = plant.states(p, e)
    inputs = named(observer, twin, p.x, p.v, commands(observer, p.w))
    state = twin.init(twin.Parameters(), inputs)
    for s, value in zip(observer.states, z, strict=True):
        setattr(state, s.name, value)
    twin.step(state, twin.Parameters(), inputs)
    acceleration, truth_rate, _ = plant.flow(p, z)
    after = Point(p.x + H * p.v, p.v + H * acceleration, p.w, p.truth + H * truth_rate)
    return plant.error(after, np.array([getattr(state, s.name) for s in observer.states]))


def commands(observer: Observer, acting: Any) -> Any:
    """The commands whose effective inputs these are: p.w is what acts, the twin takes the command before the gain."""
    system = observer.system
    gains = [system.actuators[w].gain.subs(system.values) if w in system.actuators else 1 for w in system.inputs]
    return [float(value / gain) for value, gain in zip(acting, gains, strict=True)]


def named(observer: Observer, twin: ModuleType, x: Any, v: Any, w: Any) -> Any:
    """The measured values of the twin."""
    system = observer.system
    values = dict(zip((*system.positions, *system.velocities, *system.inputs), (*x, *v, *w), strict=True))
    measured = twin.Inputs.__dataclass_fields__
    return twin.Inputs(**{s.name: float(value) for s, value in values.items() if s.name in measured})


LONG = ("two_mass-gdfo-measured-reset_integrator", "two_mass-mgto-estimated-effects")


@pytest.mark.parametrize(
    "variant", [pytest.param(v, id=v.name, marks=[pytest.mark.slow] if v.name in LONG else []) for v in CASES]
)
def test_the_sampled_matrix_is_one_step_of_the_generated_twin(variant: Variant, tmp_path: Path) -> None:
    """Central differences of 1e-4 in e leave 1e-8 of third order, and 1e-12/1e-4/h of rounding: 1e-4 of A is plenty."""
    spec, observer = build(variant)
    assert spec.path.parent == SPECS
    twin, plant = generated(variant, tmp_path), TruePlant(spec, observer)
    derived, random = Derived(spec, derive_error_dynamics(observer)), variant.generator("twin")
    checked = 0
    while checked < 3:
        p = random_point(spec, observer, random)
        now, later, _ = plant.slips(p, H)
        if np.abs(now).min() < 0.02 or (np.sign(now) != np.sign(later)).any():
            continue
        size = 1e-4 * min(1.0, float(np.abs(now).min()))
        axes = size * np.eye(len(observer.errors))
        step = np.array([next_error(twin, plant, p, e) - next_error(twin, plant, p, -e) for e in axes]).T / (2 * size)
        found = derived.matrices(p, plant, H)[1]
        right = (step - np.eye(len(step))) / H
        assert np.abs(found - right).max() < 1e-4 * np.abs(right).max()
        checked += 1

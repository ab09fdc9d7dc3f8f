"""Sections 6.7 and 7.7 of the thesis: generated observers of dynamic friction over the logs of their own specs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from codegen.emit.package import emit_sources, make_header
from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.program import build_program
from codegen.simulate.closed_loop import simulate
from codegen.spec import read_spec
from tests.twin import load_twin

THESIS = Path(__file__).parents[2] / "specs" / "thesis"


def estimated(name: str, duration: float, levels: dict[str, float]):
    """The log of a spec and its observer's rows (f̂, â, …) over it, started from wrong levels."""
    spec = read_spec(THESIS / f"{name}.yaml")
    assert spec.simulation is not None
    spec = replace(spec, simulation=replace(spec.simulation, duration=duration))
    system = build_system(spec)
    log = simulate(spec, system)
    source = emit_sources(build_program(build_observer(spec, system)), make_header(f"{name}.yaml", "", ""))
    twin = load_twin(source["__init__.py"], name)
    outputs = [f"{kind}_hat_{c.name}" for c in system.contacts for kind in ("f", "a")]
    parameters, state, rows = twin.Parameters(**levels), None, []
    for row in np.hstack([log.positions, log.inputs]).tolist():
        inputs = twin.Inputs(*row)
        state = twin.init(parameters, inputs) if state is None else state
        found = twin.step(state, parameters, inputs)
        rows.append([getattr(found, name) for name in outputs])
    return log, np.array(rows)


@pytest.mark.slow
@pytest.mark.parametrize("start", [30.0, pytest.param(70.0, marks=pytest.mark.slow)])
def test_dfo_finds_level_and_hysteresis_of_the_reset_integrator(start: float):
    log, rows = estimated("one_mass_dfo", 2.5, {"rail_a": start})
    late = log.time > 1.25
    force = log.contact_forces[:, 0]
    assert np.max(np.abs(force[late])) > 50
    assert np.min(force[late]) < -35  # it slides both ways, through presliding
    error = force - rows[:, 0] * rows[:, 1]
    assert np.sqrt(np.mean(error[late] ** 2)) < 0.001 * 50
    assert np.sqrt(np.mean(error[log.time < 0.25] ** 2)) > 0.1 * 50
    assert np.all(np.abs(rows[late, 1] - 50) < 0.002 * 50)
    assert np.sqrt(np.mean((force / 50 - rows[:, 0])[late] ** 2)) < 0.001


@pytest.mark.slow
def test_gdfo_keeps_both_forces_of_the_two_masses():
    log, rows = estimated("two_mass_gdfo", 2, {})
    for contact, level in enumerate((10, 20)):
        force = log.contact_forces[:, contact]
        assert np.max(force) > 0.99 * level and np.min(force) < -0.99 * level
        error = force - rows[:, 2 * contact] * rows[:, 2 * contact + 1]
        assert np.sqrt(np.mean(error**2)) < 0.002 * level

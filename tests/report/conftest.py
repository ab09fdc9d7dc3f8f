"""Simulated diagnoses: a machine whose spec lacks an offset, one whose spec lacks nothing, one with two coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import pytest

from codegen.base.resources import resource_folder
from codegen.diagnosis.diagnose import Models, diagnose_log
from codegen.diagnosis.results import Diagnosis
from codegen.effects.declare import add_declared_effects
from codegen.logs import read_log
from codegen.mechanics import build_system
from codegen.report.page import render_report
from codegen.simulate.closed_loop import simulate
from codegen.simulate.loop_run import write_log
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import among

SLIDE = """\
name: slide
source: "<script>alert(1)</script> & co"
coordinates:
  x: {velocity: v, unit: m}
inputs:
  w: {unit: N}
parameters:
  m: {value: 2, unit: kg, tolerance: 5%}
  k: {value: 30, unit: N/m}
mass_matrix: [[m]]
force: [w - k*x]
friction:
  distribution: [[1]]
  contacts:
    - {name: rail, law: coulomb, a: 3, unit: N}
effects: [] # <b>none yet</b>
simulation:
  duration: 14
  sample_time: 0.005
  inputs: {w: 25*sin(2*pi*0.7*t) + 14*sin(2*pi*0.31*t)}
  position_noise: {x: 1e-5}
  seed: 7
log:
  published: {"Figure of <others>": 4.2 %}
"""
FILES = {"augmented spec": "out/spec 2.yaml"}
OFFSET = "effects: [{kind: offset, on: x, parameters: {f0: 1.5}}]"


@dataclass(frozen=True)
class Case:
    """A spec, its diagnosis, the models, and the page that says it all."""

    spec: Spec
    diagnosis: Diagnosis
    models: Models

    @cached_property
    def html(self) -> str:
        return render_report(self.spec, self.diagnosis, self.models, FILES)


def diagnosed(folder: Path, text: str, truth: str, level: float = 3) -> Case:
    """Simulate a spec with ``truth`` for its effects and a level, and diagnose the log with the spec as it is, among a
    few kinds: the page is what is tested.
    """
    spec = parse_spec(text, folder / "spec.yaml")
    real = parse_spec(text.replace("effects: []", truth).replace("a: 3,", f"a: {level},"), folder / "real.yaml")
    path = folder / "log.csv"
    write_log(path, spec, simulate(real, add_declared_effects(build_system(real), real)))
    with among("offset", "coulomb_asymmetry", "viscous", "spring", "cogging"):
        return Case(spec, *diagnose_log(spec, build_system(spec), read_log(path, spec)))


@pytest.fixture(scope="session")
def lacking(tmp_path_factory: pytest.TempPathFactory) -> Case:
    """One coordinate; the spec lacks an offset, its level is off, and its words try to break out of the page."""
    return diagnosed(tmp_path_factory.mktemp("lacking"), SLIDE, OFFSET, 3.3)


@pytest.fixture(scope="session")
def complete(tmp_path_factory: pytest.TempPathFactory) -> Case:
    """One coordinate; the spec lacks nothing."""
    return diagnosed(tmp_path_factory.mktemp("complete"), SLIDE, "effects: []")


@pytest.fixture(scope="session")
def two_masses(tmp_path_factory: pytest.TempPathFactory) -> Case:
    """Two coordinates and an observer, from the shipped spec; the second mass is pushed by an offset."""
    text = (resource_folder("specs") / "two_mass.yaml").read_text(encoding="utf-8")
    text = text.replace("duration: 30", "duration: 8").replace("sample_time: 0.002", "sample_time: 0.005")
    return diagnosed(tmp_path_factory.mktemp("two"), text, OFFSET.replace("x", "x2").replace("1.5", "12"))

"""Machines of one and two bodies as specs, for exports."""

from __future__ import annotations

from pathlib import Path

from codegen.effects.declare import system_of
from codegen.mechanics.system import System
from codegen.spec.model import Spec
from codegen.spec.reader import parse_spec

ONE = """
name: axis
coordinates:
  x: {{velocity: v, unit: {unit}}}
inputs:
  w: {{unit: "{force}"}}
parameters:
  m: {{value: 2, unit: "{inertia}"}}
  k: {{value: 30, unit: "{force}/{unit}"}}
mass_matrix: [[m]]
force: [w - k*x]
friction:
  distribution: [[1]]
  contacts:
    - {{name: rail, unit: "{force}", {law}}}
effects: {effects}
envelope:
  x: [-1, 1]
  v: [-2, 2]
  w: [-12, 12]
simulation:
  duration: 2
  sample_time: 0.002
  inputs: {{w: 14*sin(2*pi*0.5*t) + 6*sin(2*pi*1.7*t)}}
"""

COULOMB = "law: coulomb, a: 3"


def one(law: str = COULOMB, effects: str = "[]", turns: bool = False) -> tuple[Spec, System]:
    """A mass on a spring (or a turning one), pushed hard enough to slide and to stop."""
    units = ("rad", "N*m", "kg*m^2") if turns else ("m", "N", "kg")
    unit, force, inertia = units
    text = ONE.format(law=law, effects=effects, unit=unit, force=force, inertia=inertia)
    spec = parse_spec(text, Path("axis.yaml"))
    return spec, system_of(spec)


def effect(kind: str, on: str, **parameters: object) -> str:
    values = ", ".join(f"{name}: {value}" for name, value in parameters.items())
    return f"[{{kind: {kind}, on: {on}, parameters: {{{values}}}}}]"

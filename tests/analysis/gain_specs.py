"""Specs with gains left open, and their error dynamics written by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from codegen.analysis.feasibility.gains import Feasibility, assess
from codegen.app.derived import Derived
from codegen.spec import Spec, parse_spec

MASS = 2.5

ONE_MASS = """
name: one_mass
coordinates: {{x: {{velocity: v, unit: m}}}}
inputs: {{w: {{unit: N}}}}
parameters:
  m: {{value: 2.5, unit: kg}}   # the mass
mass_matrix: [[m]]
force: [w]
friction:
  distribution: [[1]]
  contacts: [{{name: rail, law: coulomb, a: 50, unit: N}}]
observer:
  kind: {kind}
  velocity: {velocity}
  gains: {gains}     # to be found
  sample_time: {h}
  {more}
envelope: {{v: [-5, 5]}}
{simulation}
"""


def spec_of(
    gains: str, kind: str = "cfo", velocity: str = "measured", h: str = "0.001", more: str = "", simulation: str = ""
) -> Spec:
    text = ONE_MASS.format(gains=gains, kind=kind, velocity=velocity, h=h, more=more, simulation=simulation)
    return parse_spec(text, Path("one_mass.yaml"))


def assessed(spec: Spec, over: tuple[str, ...] = ()) -> Feasibility:
    return assess(spec, Derived(spec).nominal.observer, over)


def estimated_cfo(k_F: float, k_v: float, h: float) -> np.ndarray:
    """I + hΨ of the CFO with velocity observer on one mass, in (e_v, s·e_a), from (3.6)–(3.10) by hand.

    e_v' = −(k_v − …) needs no model: v̂' = −k_v(v̂ − v) + …; â's rate loses k_F k_v e_v by way of K_F |v̂|.
    """
    # v̂ = z_v + k_v x:          v̂' = (w − F̂)/m + k_v (v − v̂),    so e_v' = −k_v e_v − e_F/m
    # F̂ = s â, â = z_F − k_F|v̂|: s â' = k_F (w − F̂)/m − k_F v̂' = −k_F k_v e_v, so e_F' = k_F k_v e_v
    return np.eye(2) + h * np.array([[-k_v, -1 / MASS], [k_F * k_v, 0.0]])


def radius(matrix: np.ndarray) -> float:
    return float(np.abs(np.linalg.eigvals(matrix)).max())

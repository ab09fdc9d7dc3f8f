"""The audit's DFO, derived by its own chain rule, against build_observer and derive_error_dynamics."""

from __future__ import annotations

from pathlib import Path

import pytest
import sympy

from codegen.analysis.error_dynamics import derive_error_dynamics
from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.spec import parse_spec
from codegen.thesis.audit.derivations.one import one_dynamic, one_dynamic_estimated

SPEC = """
name: one
coordinates: {{x: {{velocity: v, unit: m}}}}
inputs: {{w: {{unit: N}}}}
parameters: {{m: {{value: 1, unit: kg}}}}
mass_matrix: [[m]]
force: [w]
friction:
  distribution: [[1]]
  contacts: [{{name: rail, law: reset_integrator, a: 50, c: 100, unit: N}}]
observer: {{kind: dfo, velocity: {velocity}, gains: {{K_a: -10, K_f1: 2, K_f2: 3{more}}}, sample_time: 0.001}}
envelope: {{v: [-5, 5], a_rail: [40, 60]}}
"""
NAMES = {"K_a": "k_a", "K_f1": "k_f1", "K_f2": "k_f2", "K_v": "k_v", "a_rail": "a", "f_rail": "f", "v": "v"}
NAMES |= {"rail_c": "xi_v", "xi_f_rail": "xi_f"}  # of the reset integrator, ∂ξ/∂v is c


@pytest.mark.parametrize(("velocity", "more"), [("measured", ""), ("estimated", ", K_v: 100")])
def test_psi_of_the_dfo_is_derived_twice(velocity: str, more: str) -> None:
    spec = parse_spec(SPEC.format(velocity=velocity, more=more), Path("one.yaml"))
    dynamics = derive_error_dynamics(build_observer(spec, build_system(spec)))
    ours = dynamics.jacobian.subs({s: sympy.Symbol(NAMES.get(s.name, s.name)) for s in dynamics.jacobian.free_symbols})
    ours = ours.subs(sympy.Symbol("m"), 1)
    audited = (one_dynamic() if velocity == "measured" else one_dynamic_estimated()).derived["jacobian"].value
    theirs = audited.subs({s: sympy.Symbol(s.name) for s in audited.free_symbols})
    order = [0, 1] if velocity == "measured" else [0, 2, 1]  # the thesis has e_v, e_a, e_f
    theirs = sympy.Matrix(len(order), len(order), lambda i, j: theirs[order[i], order[j]])
    assert (sympy.Matrix(ours) - theirs).expand() == sympy.zeros(*theirs.shape)

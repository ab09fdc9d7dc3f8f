"""The same quantities by the project itself: shipped spec → System → Observer → derive_error_dynamics."""

from dataclasses import replace
from typing import Any

import sympy

from codegen.analysis.error_dynamics import ErrorDynamics, derive_error_dynamics
from codegen.base.resources import resource_folder
from codegen.mechanics.build import build_system
from codegen.observers import build_observer
from codegen.spec.reader import read_spec
from codegen.thesis.audit.derivation import Derivations, real

ONE_MASS: dict[str, dict[str, Any]] = {
    "cfo": {"K_F": "10", "K_v": "100"},
    "to": {"K_1": "1", "K_2": "-100", "K_v": "100"},
}
TWO_MASS: dict[str, dict[str, Any]] = {
    "gcfo": {"K_F": ["500", "700"], "K_v": ["10", "10"]},
    "gto": {"K_1": ["1", "1"], "K_2": ["-1000", "-5000"], "K_v": ["10", "10"]},
}


def _error_dynamics(name: str, kind: str, gains: dict[str, Any]) -> ErrorDynamics:
    """The error dynamics of a shipped system under another observer, velocity estimated."""
    spec = read_spec(resource_folder("specs") / f"{name}.yaml")
    spec = replace(spec, observer=replace(spec.required_observer, kind=kind, velocity="estimated", gains=gains))
    return derive_error_dynamics(build_observer(spec, build_system(spec)))


def one_mass_jacobian(kind: str) -> Any:
    """Ψ of force errors for one mass of 1 kg, in the thesis' symbols."""
    dynamics = _error_dynamics("one_mass", kind, ONE_MASS[kind])
    rename = {"K_F": "k_F", "K_v": "k_v", "K_1": "k_1", "K_2": "k_2"}
    psi = dynamics.in_force(dynamics.jacobian)
    known = {s: real(rename[s.name])[0] for s in psi.free_symbols if s.name in rename}
    return sympy.Matrix(psi.subs(known).subs(real("m")[0], 1))


def shipped_one_mass() -> Derivations:
    """Ψ of the shipped one-mass spec."""
    return Derivations({}, {kind: one_mass_jacobian(kind) for kind in ONE_MASS})


def shipped_two_mass() -> Derivations:
    """M, g, U and Ψ of the shipped two-mass spec."""
    system = build_system(read_spec(resource_folder("specs") / "two_mass.yaml"))
    parts = {"mass": system.mass_matrix, "force": system.force, "distribution": system.distribution}
    psi = {kind: _error_dynamics("two_mass", kind, gains).jacobian for kind, gains in TWO_MASS.items()}
    return Derivations({}, {name: sympy.Matrix(part) for name, part in (parts | psi).items()})

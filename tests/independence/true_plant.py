"""The second derivation: plant and observer as one ODE in CasADi, differentiated by CasADi; no SymPy derivative in it.

The plant is M v' = g − U λ with λ = s a and a' = 0 (CFO), a constant force (TO, MGTO), or λ = a φ(u, f), f' = ξ(u, f)
and a' = 0 (DFO). With estimates y = y(z, x, v) and truths T the error is e = T − y, so at fixed x, v, T

    ∂(de/dt)/∂e = −∂(de/dt)/∂z (∂y/∂z)⁻¹,    de/dt = T' − (∂y/∂z z' + ∂y/∂x v + ∂y/∂v v').
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np
import sympy

from codegen.friction import LAWS, DynamicLaw
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import TIME
from codegen.observers import Observer
from codegen.spec import Spec


@dataclass(frozen=True)
class Point:
    """An operating point: ``truth`` in the order of the errors less the velocities."""

    x: Any
    v: Any
    w: Any
    truth: Any


class TruePlant:
    """Plant and observer as CasADi functions of (x, v, w, truth, z, W, h) with W = M⁻¹ as numbers."""

    def __init__(self, spec: Spec, observer: Observer) -> None:
        system = observer.system
        self.observer, self.n = observer, system.degrees_of_freedom
        self.estimated = observer.velocity == "estimated"
        self.x, self.v = casadi.SX.sym("x", self.n), casadi.SX.sym("v", self.n)
        self.w, self.h = casadi.SX.sym("w", len(system.inputs)), casadi.SX.sym("h")
        hidden = len(observer.errors) - (self.n if self.estimated else 0)
        self.truth, self.z = casadi.SX.sym("t", hidden), casadi.SX.sym("z", len(observer.states))
        self.inverse = casadi.SX.sym("W", self.n, self.n)
        self.numbers = {s: casadi.SX(float(value)) for s, value in observer.values.items()}
        names = self._named(self.x, self.v)
        self.mass = casadi.Function("mass", [self.x], [casadi.densify(to_casadi(system.mass_matrix, names))])
        self.slip = casadi.densify(to_casadi(system.distribution, names)).T @ self.v
        self.acceleration, self.truth_rate = self._plant(spec, names)

        walked, self.z_rate = self._observer()
        arguments = [self.x, self.v, self.w, self.truth, self.z, self.inverse, self.h]
        true_values = casadi.vertcat(self.v, self.truth) if self.estimated else self.truth
        by_z, by_x, by_v = (casadi.jacobian(walked, q) for q in (self.z, self.x, self.v))
        moved = by_z @ self.z_rate + by_x @ self.v + by_v @ self.acceleration
        true_rate = casadi.vertcat(self.acceleration, self.truth_rate) if self.estimated else self.truth_rate
        rate = true_rate - moved
        step = casadi.substitute(
            walked,
            casadi.vertcat(self.z, self.x, self.v),
            casadi.vertcat(
                self.z + self.h * self.z_rate, self.x + self.h * self.v, self.v + self.h * self.acceleration
            ),
        )
        self.function = casadi.Function(
            "errors",
            arguments,
            [true_values - walked, by_z, casadi.jacobian(rate, self.z), casadi.jacobian(step, self.z)],
        )
        later = casadi.substitute(
            self.slip,
            casadi.vertcat(self.x, self.v),
            casadi.vertcat(self.x + self.h * self.v, self.v + self.h * self.acceleration),
        )
        self.motion = casadi.Function(
            "motion", arguments, [self.acceleration, self.truth_rate, self.z_rate, self.slip, later]
        )

    def _named(self, x: Any, v: Any) -> dict[sympy.Symbol, Any]:
        system = self.observer.system
        names = dict(self.numbers) | {TIME: casadi.SX(0.7)}
        for symbols, column in ((system.positions, x), (system.velocities, v), (system.inputs, self.w)):
            names |= {s: column[k] for k, s in enumerate(symbols)}
        return names

    def _plant(self, spec: Spec, names: dict[sympy.Symbol, Any]) -> tuple[Any, Any]:
        """(v', T'), from M, g, U and the laws as declared."""
        system, kind, count = self.observer.system, self.observer.kind, self.slip.shape[0]
        onto = casadi.densify(to_casadi(system.distribution, names))
        known = [to_casadi(c.known_force, {**names, c.slip: self.slip[k]}) for k, c in enumerate(system.contacts)]
        rate = casadi.SX.zeros(self.truth.shape[0])
        if kind in ("cfo", "gcfo"):
            force = onto @ (casadi.sign(self.slip) * self.truth)
        elif kind == "mgto":
            force = onto @ self.truth
        elif kind in ("to", "gto"):
            force = self.truth
        else:
            contact = []
            for k in range(count):
                law, parameters = _law(spec, k)
                u, f, a = self.slip[k], self.truth[k], self.truth[count + k]
                contact.append(_force(law, parameters, u, f, a))
                rate[k] = _rate(law, parameters, u, f)
            force = onto @ casadi.vertcat(*contact)
        right = casadi.densify(to_casadi(system.force, names)) - force - onto @ casadi.vertcat(*known)
        return self.inverse @ right, rate

    def _observer(self) -> tuple[Any, Any]:
        """(estimates, dz/dt) over z, x, v and w: the equations one after another."""
        names = self._named(self.x, self.v)
        names |= {s: self.z[k] for k, s in enumerate(self.observer.states)}
        estimates = []
        for equation in self.observer.equations:
            value = casadi.densify(to_casadi(equation.expression, names))
            if equation.form == "mass_solve":
                value = self.inverse @ value
            names |= {s: value[k] for k, s in enumerate(equation.symbols)}
            if equation.state is not None:
                estimates.append(value)
        return casadi.vertcat(*estimates), casadi.densify(to_casadi(self.observer.rates, names))

    def states(self, p: Point, e: Any) -> Any:
        """z at which the error is e: y(z) = z + (what depends on earlier estimates), solved by substitution."""
        inverse, z = np.linalg.inv(np.asarray(self.mass(p.x))), np.zeros(len(self.observer.states))
        for _ in range(4):
            z = z + np.asarray(self.function(p.x, p.v, p.w, p.truth, z, inverse, 0)[0]).ravel() - e
        return z

    def error(self, p: Point, z: Any) -> Any:
        inverse = np.linalg.inv(np.asarray(self.mass(p.x)))
        return np.asarray(self.function(p.x, p.v, p.w, p.truth, z, inverse, 0)[0]).ravel()

    def matrices(self, p: Point, h: float) -> tuple[Any, Any]:
        """Ψ, and A of e[k+1] = (I + hA) e[k] for explicit Euler steps of observer and plant."""
        inverse = np.linalg.inv(np.asarray(self.mass(p.x)))
        z = self.states(p, np.zeros(len(self.observer.errors)))
        _, by_z, rate, step = (np.asarray(m) for m in self.function(p.x, p.v, p.w, p.truth, z, inverse, h))
        back = np.linalg.inv(by_z)
        return -rate @ back, (step @ back - np.eye(len(z))) / h

    def flow(self, p: Point, z: Any) -> tuple[Any, Any, Any]:
        """(v', T', z') at a state of plant and observer."""
        inverse = np.linalg.inv(np.asarray(self.mass(p.x)))
        found = self.motion(p.x, p.v, p.w, p.truth, z, inverse, 0)
        return tuple(np.asarray(part).ravel() for part in found[:3])

    def slips(self, p: Point, h: float) -> tuple[Any, Any, Any]:
        """(slip now, slip after an explicit Euler step, v after it)."""
        inverse = np.linalg.inv(np.asarray(self.mass(p.x)))
        found = self.motion(p.x, p.v, p.w, p.truth, np.zeros(len(self.observer.states)), inverse, h)
        return np.asarray(found[3]).ravel(), np.asarray(found[4]).ravel(), p.v + h * np.asarray(found[0]).ravel()


def _law(spec: Spec, contact: int) -> tuple[DynamicLaw, dict[str, float]]:
    """The law that the DFO is built on, with its parameters as numbers."""
    assert spec.observer is not None
    declared = spec.contacts[contact]
    chosen = spec.observer.laws.get(declared.name, declared)
    law = LAWS[chosen.law]
    assert isinstance(law, DynamicLaw)
    return law, {p.name: float(chosen.parameters.get(p.name, p.default or 0)) for p in law.parameters}


U, F = sympy.symbols("u_ f_", real=True)


def _force(law: DynamicLaw, parameters: dict[str, float], u: Any, f: Any, a: Any) -> Any:
    """λ with the true level a in the place of the law's scale, or as a factor where the law has none."""
    unit = parameters | ({law.scale: 1.0} if law.scale else {})
    return a * to_casadi(law.force(U, (F,), _exact(unit)), {U: u, F: f})


def _rate(law: DynamicLaw, parameters: dict[str, float], u: Any, f: Any) -> Any:
    return to_casadi(law.rates(U, (F,), _exact(parameters))[0], {U: u, F: f})


def _exact(parameters: dict[str, float]) -> dict[str, Any]:
    return {name: sympy.Rational(repr(value)) for name, value in parameters.items()}

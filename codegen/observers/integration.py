"""Discretisation of an observer's differential equations: the spec's ``integration``.

With v̂ = z + Γ x, dz/dt = −Γ v̂ + Φ a and an explicit Euler step, the velocity estimate becomes v̂[k+1] = (I − hΓ)
v̂[k] + Γ (x[k+1] − x[k]) + h Φ a[k], so Γ and Φ choose how its decay K_v is integrated:

  - ``euler``: Γ = K_v, Φ = I, as in the thesis;
  - ``semi_implicit``: Γ = (I + hK_v)⁻¹ K_v, Φ = (I + hK_v)⁻¹, the decay −K_v v̂ at the new sample, the rest at the old;
  - ``exponential``: Γ = (I − exp(−hK_v))/h, Φ = Γ K_v⁻¹, the decay exact over a sample.

``implicit`` (backward Euler) takes every rate at the new sample; its equations are those of ``euler``, and
``program/implicit_step.py`` solves for the step.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy

from codegen.base.errors import BadInput
from codegen.mechanics.system import Matrix
from codegen.spec.model import Spec, symbol

SAMPLE_TIME = symbol("h")
INTEGRATIONS = {
    "euler": "explicit Euler",
    "semi_implicit": "semi-implicit Euler",
    "implicit": "backward Euler",
    "exponential": "exponential Euler",
}
LARGEST_FULL_GAIN = 3


@dataclass(frozen=True)
class VelocityStep:
    """Γ and Φ above, n by n over K_v and the sample time ``h``; 1/s and 1."""

    gain: Matrix
    weight: Matrix


def velocity_step(spec: Spec, gain: Matrix) -> VelocityStep:
    """Γ and Φ of the spec's integration for K_v = ``gain``.

    Raises:
        BadInput: for ``exponential`` with a K_v that is not diagonal, or ``semi_implicit`` with one of order above 3.
    """
    assert spec.observer is not None
    integration, n, h = spec.observer.integration, gain.rows, SAMPLE_TIME
    if integration == "semi_implicit":
        if gain.is_diagonal():
            weight = sympy.diag(*[1 / (1 + h * gain[i, i]) for i in range(n)])
        else:
            if n > LARGEST_FULL_GAIN:
                found = f"a K_v of order {n} that is not diagonal"
                raise BadInput(
                    spec.place("observer.gains.K_v"), found, "a diagonal K_v under semi_implicit", code="SPEC022"
                )
            weight = (sympy.eye(n) + h * gain).inv(method="ADJ")
        return VelocityStep(Matrix(weight * gain), Matrix(weight))
    if integration == "exponential":
        if not gain.is_diagonal():
            raise BadInput(
                spec.place("observer.gains.K_v"),
                "a K_v that is not diagonal",
                "a diagonal K_v under exponential",
                code="SPEC022",
            )
        rates = [(1 - sympy.exp(-h * gain[i, i])) / h for i in range(n)]
        return VelocityStep(
            Matrix(sympy.diag(*rates)), Matrix(sympy.diag(*[r / gain[i, i] for i, r in enumerate(rates)]))
        )
    return VelocityStep(gain, Matrix(sympy.eye(n)))


def refuse_integration(spec: Spec) -> None:
    """Raise BadInput for an integration of the velocity estimate where velocity is measured."""
    choice = spec.observer
    assert choice is not None
    if choice.velocity == "measured" and choice.integration in ("semi_implicit", "exponential"):
        found = f"{choice.integration} with measured velocity; it integrates the decay of the velocity estimate"
        raise BadInput(
            spec.place("observer.integration"), found, "euler or implicit, or `velocity: estimated`", code="SPEC022"
        )

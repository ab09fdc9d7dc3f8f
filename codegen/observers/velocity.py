"""The velocity that an observer works with: measured, or estimated by the first of its equations."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import sympy

from codegen.mechanics.system import Matrix, System
from codegen.observers import parts
from codegen.observers.equations import Equation, ErrorVariable
from codegen.observers.gains import read_gain
from codegen.observers.integration import VelocityStep, velocity_step
from codegen.spec.model import ObserverChoice, Spec, symbol


@dataclass(frozen=True)
class States:
    """States of an observer: symbols, units, rates, and values from the first measurement."""

    symbols: Matrix
    units: tuple[str, ...]
    rates: Matrix
    initial: Matrix


@dataclass(frozen=True)
class Velocity:
    """v, or v̂ = z_v + Γ x with dz_v/dt = −Γ v̂ + Φ M⁻¹[g(x, v̂, w) − F̂], (3.6), (3.7), (4.25), (4.26).

    Γ = K_v and Φ = I under explicit Euler.

    Attributes:
        symbols: v or v̂, n by 1.
        gain: K_v, n by n; None where the velocity is measured.
        values: of K_v's symbols.
        equations: of v̂.
        errors: v − v̂.
    """

    system: System
    symbols: Matrix
    gain: Matrix | None = None
    values: dict[sympy.Symbol, Any] = field(default_factory=dict)
    equations: tuple[Equation, ...] = ()
    errors: tuple[ErrorVariable, ...] = ()
    step: VelocityStep | None = None

    @property
    def estimated(self) -> bool:
        return self.step is not None

    def with_own(
        self,
        acceleration: Matrix,
        states: Iterable[Any],
        units: Iterable[str],
        rates: Iterable[Any],
        initial: Iterable[Any],
    ) -> States:
        """An observer's states: those of the velocity estimate, where there is one, and behind them its own.

        Args:
            acceleration: M⁻¹[g(x, v̂, w) − F̂], n by 1.
        """
        if self.step is None:
            return States(Matrix([*states]), tuple(units), Matrix([*rates]), Matrix([*initial]))
        rate = -self.step.gain * self.symbols + self.step.weight * acceleration
        return States(
            Matrix([*(self.equations[0].state or ()), *states]),
            (*parts.velocity_units(self.system), *units),
            Matrix([*rate, *rates]),
            Matrix([*(-self.step.gain * self.system.x), *initial]),
        )


def velocity_of(spec: Spec, choice: ObserverChoice, system: System) -> Velocity:
    """The velocity of a spec's observer.

    Raises:
        BadInput: for a K_v of wrong shape or sign, or one that the integration does not take.
    """
    if choice.velocity == "measured":
        return Velocity(system, system.v)
    names, units = parts.velocity_names(system), parts.velocity_units(system)
    gain = read_gain(spec, choice, "K_v", names, names, sign=1)
    step = velocity_step(spec, gain.matrix)
    state, estimate = parts.vector("z", names), Matrix([symbol(f"{name}_hat") for name in names])
    value = Matrix(state + step.gain * system.x)
    equation = Equation("velocity_estimate", estimate, value, units, "(4.25)", state=state, output=True)
    errors = tuple(
        ErrorVariable(symbol(f"e_{v}"), v, "velocity", None, k, f"{v} - {v}_hat", unit)
        for k, (v, unit) in enumerate(zip(system.velocities, units, strict=True))
    )
    return Velocity(system, estimate, gain.matrix, dict(gain.values), (equation,), errors, step)

"""Velocity of an observer: measured, or estimated by a velocity observer with the spec's ``integration``.

v̂ = z + Γ x, dz/dt = −Γ v̂ + Φ a. An explicit Euler step gives v̂[k+1] = (I − hΓ) v̂[k] + Γ (x[k+1] − x[k]) + h Φ a[k],
so Γ and Φ determine how the decay term −K_v v̂ is integrated:

  - ``euler``: Γ = K_v, Φ = I, as in the thesis;
  - ``semi_implicit``: Γ = (I + hK_v)⁻¹ K_v, Φ = (I + hK_v)⁻¹: −K_v v̂ at the new sample, the rest at the old one;
  - ``exponential``: Γ = (I − exp(−hK_v))/h, Φ = Γ K_v⁻¹: the decay is exact over a sample.

``implicit`` (backward Euler) evaluates all rates at the new sample; its equations are those of ``euler``, and
``program/implicit_step.py`` solves the step.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sympy

from codegen.base.errors import BadInput
from codegen.mechanics.system import Matrix, System
from codegen.observers import parts
from codegen.observers.equations import Equation, ErrorVariable, Observer
from codegen.observers.gains import GainMatrix, read_gain
from codegen.spec.model import ObserverChoice, Spec, symbol

SAMPLE_TIME = symbol("h")
INTEGRATIONS = {
    "euler": "explicit Euler",
    "semi_implicit": "semi-implicit Euler",
    "implicit": "backward Euler",
    "exponential": "exponential Euler",
}
LARGEST_FULL_GAIN = 3
"""Largest order of a K_v that is not diagonal, with ``semi_implicit``, whose inverse is symbolic."""


@dataclass(frozen=True)
class States:
    """States of an observer: symbols, units, rates dz/dt, and values at the first sample."""

    symbols: Iterable[sympy.Symbol]
    units: Iterable[str]
    rates: Iterable[Any]
    initial: Iterable[Any]


@dataclass(frozen=True)
class Velocity:
    """v, or v̂ = z_v + Γ x with dz_v/dt = −Γ v̂ + Φ M⁻¹[g(x, v̂, w) − F̂], (3.6), (3.7), (4.25), (4.26).

    Attributes:
        symbols: v or v̂, n by 1.
        known: v at the first sample, n by 1; zero if it is estimated.
        gain: K_v; None if the velocity is measured.
        step: Γ in 1/s and Φ, n by n, over K_v and the sample time ``h``.
        equations: of v̂.
        errors: v − v̂.
    """

    system: System
    symbols: Matrix
    known: Matrix
    gain: GainMatrix | None = None
    step: tuple[Matrix, Matrix] | None = None
    equations: tuple[Equation, ...] = ()
    errors: tuple[ErrorVariable, ...] = ()

    @property
    def estimated(self) -> bool:
        """Whether the velocity is estimated, not measured."""
        return self.gain is not None

    @property
    def matrix(self) -> Matrix | None:
        """K_v, n by n; None if the velocity is measured."""
        return None if self.gain is None else self.gain.matrix

    def observer(
        self,
        choice: ObserverChoice,
        equations: Sequence[Equation],
        own: States,
        errors: Sequence[ErrorVariable],
        true_friction: Matrix,
        gains: Sequence[GainMatrix],
        gain_units: Mapping[sympy.Symbol, str],
        **more: Any,
    ) -> Observer:
        """The observer with these equations, after those of the velocity estimate if there is one.

        Args:
            own: states without those of the velocity estimate.
            errors: without v − v̂.
            gains: without K_v.
            gain_units: of all of ``gains``; K_v is in 1/s.
            more: other fields of ``Observer``.
        """
        system = self.system
        states, units, rates, initial = ([*part] for part in (own.symbols, own.units, own.rates, own.initial))
        if self.step is not None:
            gain, weight = self.step
            acceleration = next(e.symbols for e in equations if e.form == "mass_solve")
            states = [*(self.equations[0].state or ()), *states]
            units = [*parts.velocity_units(system), *units]
            rates = [*(-gain * self.symbols + weight * acceleration), *rates]
            initial = [*(-gain * system.x), *initial]
        values = {s: value for gain in (*gains, self.gain) if gain is not None for s, value in gain.values.items()}
        unit_of = {**gain_units, **({} if self.gain is None else dict.fromkeys(self.gain.values, "1/s"))}
        return Observer(
            kind=choice.kind,
            velocity=choice.velocity,
            system=system,
            equations=(*self.equations, *equations),
            states=Matrix(states),
            state_units=tuple(units),
            rates=Matrix(rates),
            initial=Matrix(initial),
            errors=(*self.errors, *errors),
            true_friction=Matrix(true_friction),
            signs=tuple(symbol(f"s_{c.name}") for c in system.contacts),
            gains=values,
            gain_units={s: unit_of[s] for s in values},
            sample_time=choice.sample_time,
            **more,
        )


def velocity_of(spec: Spec, choice: ObserverChoice, system: System) -> Velocity:
    """The velocity of a spec's observer; BadInput for a K_v that is wrong or that the step does not allow."""
    if choice.velocity == "measured":
        return Velocity(system, system.v, system.v)
    names, units = [v.name for v in system.velocities], parts.velocity_units(system)
    gain = read_gain(spec, choice, "K_v", names, names, sign=1)
    step = _step(spec, choice.integration, gain.matrix)
    state, estimate = parts.vector("z", names), Matrix([symbol(f"{name}_hat") for name in names])
    value = Matrix(state + step[0] * system.x)
    equation = Equation("velocity_estimate", estimate, value, units, "(4.25)", state=state, output=True)
    errors = tuple(
        ErrorVariable(symbol(f"e_{v}"), v, "velocity", None, k, f"{v} - {v}_hat", unit)
        for k, (v, unit) in enumerate(zip(system.velocities, units, strict=True))
    )
    return Velocity(system, estimate, Matrix(sympy.zeros(len(names), 1)), gain, step, (equation,), errors)


def _step(spec: Spec, integration: str, gain: Matrix) -> tuple[Matrix, Matrix]:
    """Γ and Φ of the spec's integration for K_v = ``gain``; BadInput for a K_v that it does not support."""
    n, h = gain.rows, SAMPLE_TIME
    diagonal, place = gain.is_diagonal(), spec.place("observer.gains.K_v")
    if integration == "semi_implicit":
        if not diagonal and n > LARGEST_FULL_GAIN:
            found = f"a K_v of order {n} that is not diagonal"
            raise BadInput(place, found, "a diagonal K_v under semi_implicit", code="SPEC022")
        if diagonal:
            weight = sympy.diag(*[1 / (1 + h * gain[i, i]) for i in range(n)])
        else:
            weight = (sympy.eye(n) + h * gain).inv(method="ADJ")
        return Matrix(weight * gain), Matrix(weight)
    if integration == "exponential":
        if not diagonal:
            raise BadInput(place, "a K_v that is not diagonal", "a diagonal K_v under exponential", code="SPEC022")
        rates = [(1 - sympy.exp(-h * gain[i, i])) / h for i in range(n)]
        return Matrix(sympy.diag(*rates)), Matrix(sympy.diag(*[r / gain[i, i] for i, r in enumerate(rates)]))
    return gain, Matrix(sympy.eye(n))


def refuse_integration(spec: Spec) -> None:
    """Raise BadInput for an integration that concerns the velocity estimate only, if the velocity is measured."""
    choice = spec.required_observer
    if choice.velocity == "measured" and choice.integration in ("semi_implicit", "exponential"):
        found = f"{choice.integration} with measured velocity; it integrates the decay of the velocity estimate"
        raise BadInput(
            spec.place("observer.integration"), found, "euler or implicit, or `velocity: estimated`", code="SPEC022"
        )

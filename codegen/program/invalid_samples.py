"""Prediction of the states over invalid samples, without a jump of the estimates at the next valid one.

All estimates, such as v̂ = z + Γ x, are held. The machine is assumed to move on at the held velocity, so an invalid
sample changes the states by −h (∂v̂/∂x) v̂: at the next valid sample v̂ is the held one, plus Γ times the deviation of
the position from the assumed one. After n invalid samples this acts as one step of length (n + 1) h, which is stable
only for (n + 1) h Γ < 2. After more, the next valid sample sets the states so that each estimate equals the held one:
at the measured x, or, for an explicit step, at the coming x + h v̂.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import casadi
import sympy

from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import Matrix
from codegen.observers.equations import Equation, Observer
from codegen.observers.velocity import SAMPLE_TIME
from codegen.program.model import HELD

MOST = (8, 4, 2)
"""Candidates for ``most_lost``, largest first; the first that the gains allow is taken."""


def held_outputs(names: Iterable[sympy.Symbol]) -> dict[sympy.Symbol, Any]:
    """Symbol of an estimate → SX of the output of the last valid sample."""
    return {s: casadi.SX.sym(f"{HELD}{s.name}") for s in names}


def most_lost(observer: Observer) -> int:
    """Number n of consecutive invalid samples after which a valid one sets the states: n h Γ < 2.

    1 where the prediction may diverge.
    """
    slopes = [(e, slope) for e in observer.equations for _, slope in _slopes(observer, e)]
    if observer.velocity == "measured":
        return 1 if slopes else MOST[0]
    if any(s.free_symbols & set(observer.system.positions) for _, along in slopes for s in along.values()):
        return 1
    values = {**observer.values, SAMPLE_TIME: observer.sample_time}
    velocity = observer.equations[0]
    gains = [sum(abs(float(s.xreplace(values))) for s in along.values()) for e, along in slopes if e is velocity]
    largest = float(observer.sample_time) * max(gains)  # h Γ
    return next((n for n in MOST if n * largest < 2), 1)


def predicted_changes(observer: Observer, names: Mapping[sympy.Symbol, Any], period: Any) -> dict[sympy.Symbol, Any]:
    """State z → its change over an invalid sample, for an observer that estimates the velocity; ``period``: SX of h."""
    velocity = dict(zip(observer.system.positions, held_outputs(observer.equations[0].symbols).values(), strict=True))
    return {
        z: -period * sum(to_casadi(slope, names) * velocity[x] for x, slope in along.items())
        for e in observer.equations
        for z, along in _slopes(observer, e)
    }


def resumed_states(observer: Observer, names: Mapping[sympy.Symbol, Any], period: Any) -> dict[sympy.Symbol, Any]:
    """State z → the value that makes each estimate equal to the held one; ``period``: SX of h.

    ``names``: symbol → SX of every parameter, and of this sample's positions, velocities and inputs.
    """
    system, values = observer.system, dict(names)
    velocity = system.v
    if observer.velocity == "estimated":
        velocity = observer.equations[0].symbols
        values |= held_outputs(velocity)
    if observer.integration != "implicit":
        values |= {x: values[x] + period * values[v] for x, v in zip(system.positions, velocity, strict=True)}
    found: dict[sympy.Symbol, Any] = {}
    last = max(k for k, equation in enumerate(observer.equations) if equation.state is not None)
    for equation in observer.equations[: last + 1]:
        if equation.state is None:
            value = casadi.vertsplit(to_casadi(equation.expression, values))
            values |= dict(zip(equation.symbols, value, strict=True))
            continue
        measured = casadi.vertsplit(to_casadi(Matrix(equation.expression - equation.state), values))  # φ of z + φ
        estimates = held_outputs(equation.symbols)
        values |= estimates
        found |= {z: e - phi for z, e, phi in zip(equation.state, estimates.values(), measured, strict=True)}
    return found


def _slopes(observer: Observer, equation: Equation) -> Iterator[tuple[sympy.Symbol, dict[sympy.Symbol, sympy.Expr]]]:
    """(state z, {position x: slope ∂φ/∂x of its estimate z + φ}), for states whose estimate depends on a position."""
    for z, expression in zip(equation.state or (), equation.expression, strict=False):
        free = expression.free_symbols
        along = {x: expression.diff(x) for x in observer.system.positions if x in free}
        if along:
            yield z, along

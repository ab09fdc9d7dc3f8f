"""States during invalid samples, chosen so that the estimates continue when valid samples return.

The estimates are held: v̂ = z + Γ x and the others. The machine is assumed to continue with the held velocity, so each
invalid sample changes the states by −h (∂v̂/∂x) v̂, and the next valid sample finds v̂ unchanged except for Γ times the
deviation of the position. After n invalid samples that is a step of (n + 1) h, which is stable only while (n + 1) h Γ <
2. After more, the next valid sample x sets the states so that each estimate equals the held one: at x, or for an
explicit step at the coming x + h v̂.
"""

from __future__ import annotations

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
"""Consecutive invalid samples after which a valid one sets the states, where the gains allow. Powers of two, so that
counting in halves is exact."""


def held(names: Iterable[sympy.Symbol]) -> dict[sympy.Symbol, Any]:
    """SX of the outputs of the last valid sample."""
    return {s: casadi.SX.sym(f"{HELD}{s.name}") for s in names}


def most_lost(observer: Observer) -> int:
    """Number of consecutive invalid samples after which a valid one sets the states; 1 where no more are safe."""
    slopes = [(e, slope) for e in observer.equations for _, slope in _slopes(observer, e)]
    if observer.velocity == "measured":
        return 1 if slopes else MOST[0]
    if any(s.free_symbols & set(observer.system.positions) for _, along in slopes for s in along.values()):
        return 1
    values = {**observer.values, SAMPLE_TIME: observer.sample_time}
    estimate = observer.equations[0]
    sizes = [sum(abs(float(s.xreplace(values))) for s in along.values()) for e, along in slopes if e is estimate]
    step = float(observer.sample_time) * max(sizes)
    return next((n for n in MOST if n * step < 2), 1)


def carried_states(observer: Observer, names: Mapping[sympy.Symbol, Any], period: Any) -> dict[sympy.Symbol, Any]:
    """z → its change by an invalid sample, where the velocity is estimated; ``names`` has SX of every parameter."""
    velocity = dict(zip(observer.system.positions, held(observer.equations[0].symbols).values(), strict=True))
    return {
        z: -period * sum(to_casadi(slope, names) * velocity[x] for x, slope in along.items())
        for e in observer.equations
        for z, along in _slopes(observer, e)
    }


def resumed_states(observer: Observer, names: Mapping[sympy.Symbol, Any], period: Any) -> dict[sympy.Symbol, Any]:
    """z → its value, set from a valid sample, with which the estimates continue from the held ones.

    ``names`` has SX of every parameter and of this sample's positions, velocities and inputs.
    """
    system, values = observer.system, dict(names)
    velocity = system.v
    if observer.velocity == "estimated":
        velocity = observer.equations[0].symbols
        values |= held(velocity)
    if observer.integration != "implicit":
        values |= {x: values[x] + period * values[v] for x, v in zip(system.positions, velocity, strict=True)}
    found: dict[sympy.Symbol, Any] = {}
    last = max(k for k, equation in enumerate(observer.equations) if equation.state is not None)
    for equation in observer.equations[: last + 1]:
        here = equation.expression if equation.state is None else Matrix(equation.expression - equation.state)
        value = casadi.vertsplit(to_casadi(here, values))
        if equation.state is None:
            values |= dict(zip(equation.symbols, value, strict=True))
            continue
        estimates = held(equation.symbols)
        values |= estimates
        found |= {z: e - k for z, e, k in zip(equation.state, estimates.values(), value, strict=True)}
    return found


def _slopes(observer: Observer, equation: Equation) -> Iterator[tuple[sympy.Symbol, dict[sympy.Symbol, sympy.Expr]]]:
    """(z, position → slope of its estimate), for states whose estimate depends on a position."""
    for z, expression in zip(equation.state or (), equation.expression, strict=False):
        free = expression.free_symbols
        along = {x: expression.diff(x) for x in observer.system.positions if x in free}
        if along:
            yield z, along

"""What becomes of the states while samples are lost, so that the estimates go on when good ones are back.

The estimates are held: v̂ = z + Γ x and the others. Meanwhile the machine is taken to go on with the velocity that is
held, so for each lost sample the states go along, z − h (∂v̂/∂x) v̂, and the next good sample finds v̂ where it was but
for Γ times what the position did otherwise. After n lost in a row that is a step of (n + 1) h, so it stands only while
(n + 1) h Γ < 2. From then on the next good sample x sets the states so that each estimate is the held one: at x, or for
an explicit step at the x + h v̂ to come.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import casadi
import sympy

from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import Matrix
from codegen.observers.equations import Equation, Observer
from codegen.observers.integration import SAMPLE_TIME
from codegen.program.model import HELD

MOST = (8, 4, 2)
"""Samples lost in a row from which on a good one sets the states, where the gains allow. Powers of two, so that their
count in fractions of 1/2 is exact."""


def held(names: Iterable[sympy.Symbol]) -> dict[sympy.Symbol, Any]:
    """SX of outputs as the last good sample left them."""
    return {s: casadi.SX.sym(f"{HELD}{s.name}") for s in names}


def most_lost(observer: Observer) -> int:
    """How many samples lost in a row need a good one that sets the states; 1 where their way is not known."""
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
    """z → what is added to it for a lost sample, where the velocity is estimated.

    Args:
        names: SX of every parameter.
        period: SX of the sample time, s.
    """
    velocity = dict(zip(observer.system.positions, held(observer.equations[0].symbols).values(), strict=True))
    return {
        z: -period * sum(to_casadi(slope, names) * velocity[x] for x, slope in along.items())
        for e in observer.equations
        for z, along in _slopes(observer, e)
    }


def resumed_states(observer: Observer, names: Mapping[sympy.Symbol, Any], period: Any) -> dict[sympy.Symbol, Any]:
    """z → its value by which the estimates go on from the held ones, set from a good sample.

    Args:
        names: SX of every parameter and of this sample's positions, velocities and inputs.
        period: SX of the sample time, s.
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
    """(z, position → ∂ of its estimate), for the states whose estimate holds a position."""
    for z, expression in zip(equation.state or (), equation.expression, strict=False):
        free = expression.free_symbols
        along = {x: expression.diff(x) for x in observer.system.positions if x in free}
        if along:
            yield z, along

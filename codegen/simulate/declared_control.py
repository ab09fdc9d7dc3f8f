"""The controller that a spec's ``simulation`` section declares."""

from __future__ import annotations

from dataclasses import dataclass

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.errors import BadInput
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import TIME
from codegen.simulate.controller import Feedback, sampled
from codegen.spec.model import Simulation, Spec

Array = NDArray[np.float64]
GAINS = ("position_gain", "velocity_gain", "integral_gain")


@dataclass(frozen=True)
class Loop:
    """One input under control: which coordinate it moves, and where to."""

    coordinate: int
    reference: sympy.Expr


def control_loops(spec: Spec, simulation: Simulation) -> dict[int, Loop]:
    """Input index → its loop. A reference is named by its coordinate or its input; the two have the same index, or
    the other is the only one of its sort.

    Raises:
        BadInput: for a reference without a counterpart or without a position gain, two references for one input or one
            coordinate, or a gain for an input without a reference.
    """
    coordinates, inputs = list(spec.positions), [i.name for i in spec.inputs]
    loops: dict[int, Loop] = {}
    for name, reference in simulation.reference.items():
        place = spec.place(f"simulation.reference.{name}")
        if name in coordinates:
            coordinate = coordinates.index(name)
            index = 0 if len(inputs) == 1 else coordinate
        else:
            index = inputs.index(name)
            coordinate = 0 if len(coordinates) == 1 else index
        if index >= len(inputs) or coordinate >= len(coordinates):
            raise BadInput(
                place, f"a reference for `{name}`, which no input moves", f"one of {', '.join(inputs)}", code="SPEC025"
            )
        if index in loops:
            raise BadInput(
                place, f"a second reference for the input `{inputs[index]}`", "one reference per input", code="SPEC025"
            )
        if any(loop.coordinate == coordinate and loop.reference != reference for loop in loops.values()):
            found = f"another reference for the coordinate `{coordinates[coordinate]}`"
            raise BadInput(place, found, "the same one for every input that moves it", code="SPEC025")
        if inputs[index] not in simulation.position_gain:
            raise BadInput(
                place,
                "a reference without a gain",
                f"`position_gain: {{{inputs[index]}: …}}` too",
                code="SPEC025",
            )
        loops[index] = Loop(coordinate, reference)
    for section in GAINS:
        for name in getattr(simulation, section):
            if inputs.index(name) not in loops:
                raise BadInput(
                    spec.place(f"simulation.{section}.{name}"),
                    "a gain without a reference",
                    f"a `reference:` for `{name}` to follow",
                    code="SPEC025",
                )
    return loops


def declared_controller(spec: Spec, simulation: Simulation, samples: int) -> Feedback:
    """w = its function of t + position_gain (reference − x) − velocity_gain v + integral_gain ∫(reference − x) dt.

    Raises:
        BadInput: as ``control_loops``.
    """
    loops, inputs = control_loops(spec, simulation), [i.name for i in spec.inputs]
    n, m, period = len(spec.positions), len(inputs), simulation.sample_time
    targets = {loop.coordinate: loop.reference for loop in loops.values()}
    time: Array = period * np.arange(samples, dtype=np.float64)
    feed = _signals([simulation.inputs.get(name, sympy.Integer(0)) for name in inputs], time)
    target = _signals([targets.get(i, sympy.Integer(0)) for i in range(n)], time)
    gains: dict[str, Array | None] = {}
    for section in GAINS:
        gain = np.zeros((m, n))
        for index, loop in loops.items():
            gain[index, loop.coordinate] = getattr(simulation, section).get(inputs[index], 0.0)
        gains[section] = gain if gain.any() else None
    return Feedback(
        m,
        n,
        feed=sampled(feed, period),
        reference=sampled(target, period),
        limit=input_limit(spec, simulation) if gains["integral_gain"] is not None else None,
        position_gain=gains["position_gain"],
        velocity_gain=gains["velocity_gain"],
        integral_gain=gains["integral_gain"],
    )


def input_limit(spec: Spec, simulation: Simulation) -> Array | None:
    """(m,), infinite where there is none; None without any."""
    if not simulation.input_limit:
        return None
    return np.array([simulation.input_limit.get(i.name, np.inf) for i in spec.inputs])


def _signals(functions: list[sympy.Expr], time: Array) -> Array:
    """(N, functions) values of expressions over t."""
    t = casadi.SX.sym("t")
    values = casadi.vertcat(*[to_casadi(f, {TIME: t}) for f in functions])
    function = casadi.Function("signals", [t], [casadi.densify(values)])
    return np.asarray(function(time[None, :]).full().T, dtype=float)

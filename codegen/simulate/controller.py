"""The digital side of a simulated machine: which input follows what, encoder, PD law and limits, over CasADi."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi
import sympy

from codegen.errors import BadInput
from codegen.spec.model import Simulation, Spec

VELOCITY_FILTER_SAMPLES = 4


@dataclass(frozen=True)
class Loop:
    """One input under PD control: which coordinate it moves, where to, and with what gains."""

    coordinate: int
    reference: sympy.Expr
    position_gain: float
    velocity_gain: float


def control_loops(spec: Spec, simulation: Simulation) -> dict[int, Loop]:
    """Input index → its loop. A reference is named by its coordinate or its input; the two have the same index, or
    the other is the only one of its sort.

    Raises:
        BadInput: for a reference without a counterpart or without a position gain, two references for one input, or a
            gain for an input without a reference.
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
            raise BadInput(place, f"a reference for `{name}`, which no input moves", f"one of {', '.join(inputs)}")
        if index in loops:
            raise BadInput(place, f"a second reference for the input `{inputs[index]}`", "one reference per input")
        if inputs[index] not in simulation.position_gain:
            raise BadInput(place, "a reference without a gain", f"`position_gain: {{{inputs[index]}: …}}` beside it")
        gains = simulation.position_gain[inputs[index]], simulation.velocity_gain.get(inputs[index], 0.0)
        loops[index] = Loop(coordinate, reference, *gains)
    for section in ("position_gain", "velocity_gain"):
        for name in getattr(simulation, section):
            if inputs.index(name) not in loops:
                raise BadInput(
                    spec.place(f"simulation.{section}.{name}"), "a gain", f"a `reference:` that `{name}` is to follow"
                )
    return loops


def encoder(spec: Spec, simulation: Simulation, position: Any, noise: Any) -> Any:
    """Measured positions, n by 1: white noise added, then rounded to the encoder's steps."""
    measured = []
    for i, name in enumerate(spec.positions):
        step = simulation.encoder_step.get(name, 0.0)
        value = position[i] + noise[i]
        measured.append(casadi.floor(value / step + 0.5) * step if step > 0 else value)
    return casadi.vertcat(*measured)


def low_passed_velocity(measured: Any, before: Any, velocity: Any, period: float) -> Any:
    """Backward difference of the measured position through a first-order low-pass of a few samples."""
    share = 1 / (1 + VELOCITY_FILTER_SAMPLES)
    return velocity + share * ((measured - before) / period - velocity)


def commands(
    spec: Spec, simulation: Simulation, loops: dict[int, Loop], feed: Any, target: Any, measured: Any, velocity: Any
) -> Any:
    """Commands, m by 1: feedforward + position_gain (target − measured) − velocity_gain velocity, within the limits.

    Args:
        feed, target: the input's own function of t and its reference, m by 1.
        measured, velocity: n by 1.
    """
    result = []
    for index, declared in enumerate(spec.inputs):
        w = feed[index]
        if index in loops:
            loop = loops[index]
            w = w + loop.position_gain * (target[index] - measured[loop.coordinate])
            w = w - loop.velocity_gain * velocity[loop.coordinate]
        limit = simulation.input_limit.get(declared.name)
        result.append(w if limit is None else casadi.fmin(casadi.fmax(w, -limit), limit))
    return casadi.vertcat(*result)

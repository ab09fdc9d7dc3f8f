"""The sampled controller of a simulated machine: linear feedback, as a spec's ``simulation`` section declares it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import casadi
import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.base.errors import BadInput, Place
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import TIME
from codegen.spec.model import Simulation, Spec

Signal = Callable[[float], Array]
"""t in s → a value for each coordinate or each input."""


class Sample(NamedTuple):
    """What a controller sees at t_k.

    Attributes:
        time: t_k, s.
        positions: (n,) as measured.
        velocities: (n,) as measured, or low-passed differences of the measured positions.
        estimates: (outputs,) latest of the observer, in its order; empty without one.
        sent: (m,) the command of the sample before, limited and with the cancelling input; zero at first.
        period: s since the controller's last sample.
    """

    time: float
    positions: Array
    velocities: Array
    estimates: Array
    sent: Array
    period: float


class Controller(Protocol):
    """A command at each sample."""

    def start(self) -> None:
        """Forget what earlier runs left behind."""

    def command(self, now: Sample) -> Array:
        """(m,) held until the next sample."""


@dataclass
class Feedback:
    """w = feed(t) + K_x (x_r − x) + K_v (v_r − v) + K_i ∫(x_r − x) dt: open loop, P, PD, PI, PID and state feedback.

    A PI controller of velocity is K_v and K_i with x_r the integral of v_r. An integral rests while the command last
    sent is at its limit and the error would push it further (K_i then has one coordinate an input).

    Attributes:
        inputs, coordinates: m and n.
        feed: t → (m,).
        reference: t → x_r (n,); zero if not given. velocity_reference: t → v_r (n,).
        position_gain, velocity_gain, integral_gain: K_x, K_v, K_i, each (m, n); zero if not given.
        limit: (m,) of the command, for the integral; the loop itself limits what is sent.
    """

    inputs: int
    coordinates: int
    feed: Signal | None = None
    reference: Signal | None = None
    velocity_reference: Signal | None = None
    position_gain: Array | None = None
    velocity_gain: Array | None = None
    integral_gain: Array | None = None
    limit: Array | None = None

    def __post_init__(self) -> None:
        """Refuse gains of another shape. Raises ValueError with the shape found and the one expected."""
        shape = (self.inputs, self.coordinates)
        for name in ("position_gain", "velocity_gain", "integral_gain"):
            gain = getattr(self, name)
            if gain is not None and np.shape(gain) != shape:
                raise ValueError(f"{name} of shape {np.shape(gain)}; expected {shape}, inputs by coordinates")
        self.start()

    def start(self) -> None:
        self._sum = np.zeros(self.inputs)

    def command(self, now: Sample) -> Array:
        w = np.zeros(self.inputs) if self.feed is None else np.asarray(self.feed(now.time), dtype=float)
        error = -now.positions if self.reference is None else self.reference(now.time) - now.positions
        if self.position_gain is not None:
            w = w + self.position_gain @ error
        if self.velocity_gain is not None:
            target = 0.0 if self.velocity_reference is None else self.velocity_reference(now.time)
            w = w + self.velocity_gain @ (target - now.velocities)
        if self.integral_gain is not None:
            push = self.integral_gain @ error
            if self.limit is not None:
                push = np.where((np.abs(now.sent) >= self.limit) & (push * now.sent > 0), 0.0, push)
            self._sum = self._sum + now.period * push
            w = w + self._sum
        return w


def sampled(values: Array, period: float) -> Signal:
    """A function of t from its values (N, …) at 0, period, 2 period …"""
    last = len(values) - 1
    return lambda t: np.asarray(values[min(round(t / period), last)])


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
            raise _refused(place, f"a reference for `{name}`, which no input moves", f"one of {', '.join(inputs)}")
        if index in loops:
            raise _refused(place, f"a second reference for the input `{inputs[index]}`", "one reference per input")
        if any(loop.coordinate == coordinate and loop.reference != reference for loop in loops.values()):
            found = f"another reference for the coordinate `{coordinates[coordinate]}`"
            raise _refused(place, found, "the same one for every input that moves it")
        if inputs[index] not in simulation.position_gain:
            raise _refused(place, "a reference without a gain", f"`position_gain: {{{inputs[index]}: …}}` too")
        loops[index] = Loop(coordinate, reference)
    for section in GAINS:
        for name in getattr(simulation, section):
            if inputs.index(name) not in loops:
                place = spec.place(f"simulation.{section}.{name}")
                raise _refused(place, "a gain without a reference", f"a `reference:` for `{name}` to follow")
    return loops


def _refused(place: Place, found: str, expected: str) -> BadInput:
    return BadInput(place, found, expected, code="SPEC025")


def declared_controller(spec: Spec, simulation: Simulation, samples: int) -> Feedback:
    """w = its function of t + position_gain (reference − x) − velocity_gain v + integral_gain ∫(reference − x) dt.

    Raises BadInput as ``control_loops``.
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

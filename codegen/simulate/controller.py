"""Sampled controller of a simulated machine: feedforward and PID feedback, from a spec's ``simulation`` section."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.base.errors import BadInput, Place
from codegen.mechanics.casadi_form import at_points, function_of
from codegen.mechanics.system import TIME
from codegen.spec.model import Simulation, Spec

Signal = Callable[[float], Array]
"""t in s → a value for each coordinate or each input."""


class Sample(NamedTuple):
    """A controller's inputs at sample time t_k.

    Attributes:
        time: t_k, s.
        positions: (n,) measured positions.
        velocities: (n,) measured velocities, or low-passed differences of the measured positions.
        estimates: (outputs,) the observer's latest outputs, in its order; empty without an observer.
        previous_input: (m,) applied to the machine from t_{k−1} to t_k: command plus cancelling input, saturated; zero
            at the first sample.
        period: t_k − t_{k−1}, s.
    """

    time: float
    positions: Array
    velocities: Array
    estimates: Array
    previous_input: Array
    period: float


def zero(t: float) -> Array:
    """The signal that is zero."""
    return np.zeros(1)


@dataclass
class Feedback:
    """w = w_ff(t) + K_x (x_r − x) + K_v (v_r − v) + ∫ K_i (x_r − x) dt: open loop, P, PD, PI, PID and state feedback.

    A PI controller of velocity has K_v and K_i, with x_r the integral of v_r. Anti-windup is by conditional
    integration: the integral of an input is held while that input is at its limit and the integral would increase it
    further. This assumes one coordinate per input in K_i.

    Attributes:
        inputs: their number m; n is that of the coordinates.
        feedforward: w_ff, t → (m,).
        reference, velocity_reference: x_r and v_r, t → (n,).
        position_gain, velocity_gain, integral_gain: K_x, K_v, K_i, each (m, n); zero if not given.
        limit: (m,) limits of the inputs, for the anti-windup alone; the loop does the saturation.
    """

    inputs: int
    feedforward: Signal = zero
    reference: Signal = zero
    velocity_reference: Signal = zero
    position_gain: Array | None = None
    velocity_gain: Array | None = None
    integral_gain: Array | None = None
    limit: Array | None = None

    def __post_init__(self) -> None:
        self.start()

    def start(self) -> None:
        """Set the integrals to zero."""
        self._integral = self._no_command = np.zeros(self.inputs)

    def command(self, now: Sample) -> Array:
        """The command (m,), which is held from t_k to t_{k+1}."""
        w = self._no_command + self.feedforward(now.time)
        error = self.reference(now.time) - now.positions
        if self.position_gain is not None:
            w = w + self.position_gain.dot(error)  # dot takes a third of the time of @
        if self.velocity_gain is not None:
            w = w + self.velocity_gain.dot(self.velocity_reference(now.time) - now.velocities)
        if self.integral_gain is not None:
            rate = self.integral_gain.dot(error)
            if self.limit is not None:
                saturated = np.abs(now.previous_input) >= self.limit
                rate = np.where(saturated & (rate * now.previous_input > 0), 0.0, rate)
            self._integral = self._integral + now.period * rate
            w = w + self._integral
        return w


def sampled(values: Array, period: float) -> Signal:
    """The signal with values (N, …) at 0, period, 2 period …: at any t, the value of the nearest of these times."""
    last = len(values) - 1
    return lambda t: np.asarray(values[min(round(t / period), last)])


GAINS = ("position_gain", "velocity_gain", "integral_gain")


@dataclass(frozen=True)
class Loop:
    """A control loop of one input: the index of the controlled coordinate, and its reference over t."""

    coordinate: int
    reference: sympy.Expr


def control_loops(spec: Spec, simulation: Simulation) -> dict[int, Loop]:
    """Input index → its control loop.

    A key of ``reference:`` names a coordinate or an input. A coordinate is paired with the input that acts on it by
    ``force:``, or with the only input of the machine; an input with the coordinate on which it acts. Of several, the
    one with the same index is taken.

    Raises BadInput for a reference without such an input or without a position gain, two references for one input, two
    different ones for one coordinate, or a gain for an input without a reference.
    """
    coordinates, inputs = list(spec.positions), [i.name for i in spec.inputs]
    loops: dict[int, Loop] = {}
    for name, reference in simulation.reference.items():
        place = spec.place(f"simulation.reference.{name}")
        index, coordinate = _paired(spec, name, place)
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


def _paired(spec: Spec, name: str, place: Place) -> tuple[int, int]:
    """Indices (input, coordinate) of the control loop of a reference, from the name of either."""
    coordinates, inputs, acting = list(spec.positions), [i.name for i in spec.inputs], _acting(spec)
    controls = name in coordinates
    own, others = (coordinates, inputs) if controls else (inputs, coordinates)
    index = own.index(name)
    found = [j if controls else k for j, k in acting if index == (k if controls else j)]
    found = [0] if len(others) == 1 else found
    if index not in found and len(found) != 1:
        several = " and ".join(f"`{others[k]}`" for k in found)
        which = f"{several} act" if found else "no input acts"
        what = f"a reference for `{name}`, on which {which}" if controls else f"a reference for `{name}`: on {several}"
        pairs = [f"`{coordinates[k]}` (by `{inputs[j]}`)" for j, k in acting if k < len(coordinates)]
        raise _refused(place, what, f"one for {' or '.join(pairs)}")
    other = index if index in found else found[0]
    return (other, index) if controls else (index, other)


def _acting(spec: Spec) -> list[tuple[int, int]]:
    """(input, coordinate) for each coordinate on which an input acts by ``force:``.

    An input that does not occur there, such as a motor of a robot file, acts on the coordinate of its own index.
    """
    symbols = [{s.name for s in force.free_symbols} for force in spec.force]
    found = [(j, k) for j, i in enumerate(spec.inputs) for k, names in enumerate(symbols) if i.name in names]
    known = {j for j, _ in found}
    return [*found, *((j, j) for j in range(len(spec.inputs)) if j not in known)]


def _refused(place: Place, found: str, expected: str) -> BadInput:
    return BadInput(place, found, expected, code="SPEC025")


def declared_controller(spec: Spec, simulation: Simulation, samples: int) -> Feedback:
    """The controller of the ``simulation`` section: w = inputs(t) + K_x (x_r − x) − K_v v + ∫ K_i (x_r − x) dt.

    Raises BadInput as ``control_loops``.
    """
    loops, inputs = control_loops(spec, simulation), [i.name for i in spec.inputs]
    n, m, period = len(spec.positions), len(inputs), simulation.sample_time
    references = {loop.coordinate: loop.reference for loop in loops.values()}
    time: Array = period * np.arange(samples, dtype=np.float64)
    feedforward = _signals([simulation.inputs.get(name, sympy.Integer(0)) for name in inputs], time)
    reference = _signals([references.get(i, sympy.Integer(0)) for i in range(n)], time)
    gains: dict[str, Array | None] = {}
    for section in GAINS:
        gain = np.zeros((m, n))
        for index, loop in loops.items():
            gain[index, loop.coordinate] = getattr(simulation, section).get(inputs[index], 0.0)
        gains[section] = gain if gain.any() else None
    return Feedback(
        m,
        feedforward=sampled(feedforward, period),
        reference=sampled(reference, period),
        limit=input_limit(spec, simulation) if gains["integral_gain"] is not None else None,
        position_gain=gains["position_gain"],
        velocity_gain=gains["velocity_gain"],
        integral_gain=gains["integral_gain"],
    )


def input_limit(spec: Spec, simulation: Simulation) -> Array | None:
    """(m,) limit of each input's magnitude, infinite for inputs without one; None if no input has one."""
    if not simulation.input_limit:
        return None
    return np.array([simulation.input_limit.get(i.name, np.inf) for i in spec.inputs])


def _signals(functions: list[sympy.Expr], time: Array) -> Array:
    """Values of expressions over t at N times, (N, functions)."""
    return np.asarray(
        at_points(function_of(sympy.Matrix(len(functions), 1, functions), [TIME]), time[:, None])[:, :, 0], dtype=float
    )

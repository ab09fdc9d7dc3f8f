"""one_mass_domain: friction observer CFO, velocity estimated, double precision.

Made by stiction 0.1.0 from one_mass_domain.yaml
sha256 8d460ce60843deab9a083d6f6e692c331d1ab3b95be9c9c28efa58c7ade55a45
with: stiction generate one_mass_domain.yaml

The twin of one_mass_domain.c: the same operations in the same order on doubles, with bit-identical results.
Do not edit.
"""

import math
from dataclasses import dataclass

__all__ = ["Inputs", "Outputs", "Parameters", "State", "init", "prepare", "step"]

SPEC_SHA256 = "8d460ce60843deab9a083d6f6e692c331d1ab3b95be9c9c28efa58c7ade55a45"
LARGEST = 1e+150
# modes: what the next valid sample does
RUNNING = 0  # gives new estimates
HOLDING = 1  # after 8 invalid samples in a row: sets the state so that the estimates equal the held ones
STARTING = 2  # no sample was valid so far: initialises the state
ENVELOPE = {  # lower and upper limits: the operating region for which certificate.json holds
    "x": ("-10", "10"),
    "v": ("-5", "5"),
    "w": ("-150", "150"),
    "v_dot": ("-210", "210"),
    "x_noise": ("-1/200000", "1/200000"),
    "a_rail": ("40", "60"),
}


@dataclass(slots=True)
class Parameters:
    """Model constants and gains with the spec's values, followed by the constants that ``prepare`` derives from them."""

    m: float = 1.0  # kg: model parameter
    rail_a: float = 50.0  # N: model parameter
    K_F: float = 10.0  # N*s/m: observer gain
    K_v: float = 100.0  # 1/s: observer gain
    slip_speed: float = 1.0  # m/s: least slip speed of the domain
    a_low_rail: float = 40.0  # N: least level
    a_high_rail: float = 60.0  # N: largest level
    settle_samples: float = 300.0  # 1: samples until the estimate is in its domain
    restart_samples: float = 88.0  # 1: samples in which the level is held at a start
    largest_innovation: float = 0.0003  # m: of the measured position, in the domain
    sample_time: float = 0.001  # s: sample time
    one_over_m: float = 1.0  # 1.0 / m
    constant_1: float = 50.0  # 0.5 * a_high_rail + 0.5 * a_low_rail


@dataclass(slots=True)
class State:
    """State of the observer between two samples."""

    z_v: float = 0.0  # m/s: observer state
    z_rail: float = 0.0  # N: observer state
    direction_rail: float = 0.0  # 1: sign with which the level was updated, or 0
    samples_held: float = 0.0  # 1: samples for which the level is held after a start
    samples_slid: float = 0.0  # 1: samples since the level is updated, counted up to settle_samples
    x_predicted: float = 0.0  # m: position predicted for this sample
    mode: int = RUNNING
    invalid_samples: int = 0  # in a row; the count restarts after a valid one


@dataclass(slots=True)
class Inputs:
    """Measurements and commands at a sample."""

    x: float = 0.0  # m: measured position
    w: float = 0.0  # N: input


@dataclass(slots=True)
class Outputs:
    """Estimates at a sample."""

    v_hat: float = 0.0  # m/s: velocity estimate, (4.25)
    a_hat_rail: float = 0.0  # N: friction level, (4.11)
    F_hat_rail: float = 0.0  # N: contact friction, (4.10)
    F_hat_on_x: float = 0.0  # N: friction force, (4.10)
    in_domain: float = 0.0  # 1: in domain, 1 where the certificate's bound holds, if its assumptions do
    fault: int = 0  # 1 if this sample was not used


def _sign(u: float) -> float:
    return 1.0 if u > 0.0 else (-1.0 if u < 0.0 else 0.0)


def prepare(parameters: Parameters) -> None:
    """Compute the derived constants again, after a parameter was changed."""
    parameters.one_over_m = 1.0 / parameters.m
    parameters.constant_1 = 0.5 * parameters.a_high_rail + 0.5 * parameters.a_low_rail


def init(parameters: Parameters, inputs: Inputs) -> State:
    """The initial state, from the first measurement; if that is invalid, the first valid sample sets it."""
    state = State(
        z_v=-(parameters.K_v * inputs.x),
        z_rail=parameters.rail_a,
        direction_rail=0.0,
        samples_held=parameters.restart_samples,
        samples_slid=0.0,
        x_predicted=inputs.x,
    )
    check = (
        abs(inputs.x) + abs(inputs.w) + abs(state.z_v) + abs(state.z_rail) + abs(state.direction_rail)
        + abs(state.samples_held) + abs(state.samples_slid) + abs(state.x_predicted)
    )
    if not abs(check) <= LARGEST:
        state = State(mode=STARTING)
    return state


def _predict(state: State, parameters: Parameters, outputs: Outputs) -> None:
    """Predict the state over an invalid sample, as if the machine moved at the held velocity estimate."""
    state.z_v = state.z_v - parameters.sample_time * parameters.K_v * outputs.v_hat
    state.z_rail = outputs.a_hat_rail
    state.direction_rail = 0.0
    state.samples_held = parameters.restart_samples
    state.samples_slid = 0.0
    state.x_predicted = state.x_predicted + parameters.sample_time * outputs.v_hat
    if state.mode == RUNNING:
        if outputs.fault == 0:
            state.invalid_samples = 0  # the sample before was valid
        state.invalid_samples += 1
        if state.invalid_samples >= 8:
            state.mode = HOLDING


def _resume(state: State, parameters: Parameters, inputs: Inputs, outputs: Outputs) -> None:
    """Set the state from a valid sample so that the estimates equal the held ones."""
    state.z_v = outputs.v_hat - parameters.K_v * (inputs.x + parameters.sample_time * outputs.v_hat)
    state.z_rail = outputs.a_hat_rail
    state.direction_rail = 0.0
    state.samples_held = parameters.restart_samples
    state.samples_slid = 0.0
    state.x_predicted = inputs.x + parameters.sample_time * outputs.v_hat
    state.mode = RUNNING
    state.invalid_samples = 0


def _handle_fault(state: State, parameters: Parameters, inputs: Inputs, outputs: Outputs, valid: bool) -> None:
    """Handle an invalid sample, or an invalid state: hold the last estimates, and set the state for the next sample."""
    if not valid:  # sample
        if state.mode != STARTING:
            _predict(state, parameters, outputs)
    elif state.mode == HOLDING:  # first valid sample after many invalid ones
        _resume(state, parameters, inputs, outputs)
    else:  # first valid sample of all, or an invalid state
        fresh = init(parameters, inputs)
        for name in State.__slots__:
            setattr(state, name, getattr(fresh, name))
    outputs.fault = 1


def step(state: State, parameters: Parameters, inputs: Inputs, outputs: Outputs | None = None) -> Outputs:
    """One sample: estimates from the state and this measurement; ``state`` becomes that of the next sample.

    The estimates are written to ``outputs``, or to a new object.
    A sample is invalid if an input is NaN or infinite, or if the inputs in sum, and the next states that they give, are
    beyond 1e+150: ``outputs`` then hold the last estimates, ``fault`` is 1, and the state is predicted with
    the held velocity. If the inputs are valid but the state is not, or its mode is not ``RUNNING``, the estimates are held
    too, ``fault`` is 1, and the state is set from this sample. The held estimates are read from ``outputs``: pass the same
    ones to each step.
    """
    if outputs is None:
        outputs = Outputs()

    # velocity estimate, (4.25)
    v_hat = state.z_v + parameters.K_v * inputs.x  # m/s

    # slip sign, (4.13)
    sign_rail = _sign(v_hat)  # 1

    # learning, 1 where the level is learnt
    learning_1 = state.samples_held - 0.5
    learning_2 = _sign(abs(v_hat) - parameters.slip_speed)
    learning_3 = state.direction_rail * sign_rail
    learning_4 = 0.5 * _sign(learning_1)
    learning = (
        (0.5 - learning_4) * (0.5 * abs(learning_2) + 0.5 * learning_2) * (1.0 + 0.5 * learning_3 - 0.5
        * abs(learning_3))
    )  # 1

    # level read, (4.11)
    a_read_rail = state.z_rail - parameters.K_F * state.direction_rail * v_hat  # N

    # friction level, (4.11)
    a_hat_rail = (
        a_read_rail + (1.0 - learning) * (parameters.constant_1 + 0.5 * abs(a_read_rail - parameters.a_low_rail)
        - a_read_rail - 0.5 * abs(a_read_rail - parameters.a_high_rail))
    )  # N

    # contact friction, (4.10)
    F_hat_rail = sign_rail * a_hat_rail  # N

    # acceleration, (4.2)
    v_dot_hat = parameters.one_over_m * (inputs.w - F_hat_rail)  # m/s^2

    # calm, 1 where the innovation is small
    calm_1 = _sign(abs(inputs.x - state.x_predicted) - parameters.largest_innovation)
    calm = 1.0 - 0.5 * abs(calm_1) - 0.5 * calm_1  # 1

    # in domain, 1 where the certificate's bound holds, if its assumptions do
    in_domain_1 = 0.5 + state.samples_slid
    in_domain_2 = learning * calm
    in_domain_3 = 0.5 * _sign(in_domain_1 - parameters.settle_samples)
    in_domain = in_domain_2 * (0.5 + in_domain_3)  # 1

    # shared by the states
    step_1 = sign_rail * learning

    # states one sample later (explicit Euler)
    z_v_next = state.z_v + parameters.sample_time * (v_dot_hat - parameters.K_v * v_hat)
    z_rail_next = a_hat_rail + parameters.K_F * step_1 * (v_hat + parameters.sample_time * v_dot_hat)
    direction_rail_next = step_1
    samples_held_next = learning_1 - learning_4
    samples_slid_next = in_domain_2 * (in_domain_1 - in_domain_3)
    x_predicted_next = inputs.x + parameters.sample_time * v_hat

    # this sum is too large or NaN if a next state is, or an input or output on which no next state depends
    check = (
        z_v_next + z_rail_next + direction_rail_next + samples_held_next + samples_slid_next + x_predicted_next
        + in_domain
    )
    if state.mode != RUNNING or not abs(check) <= LARGEST:
        given = abs(inputs.x) + abs(inputs.w)
        _handle_fault(state, parameters, inputs, outputs, abs(given) <= LARGEST)
        return outputs
    outputs.fault = 0
    outputs.v_hat = v_hat
    outputs.a_hat_rail = a_hat_rail
    outputs.F_hat_rail = F_hat_rail
    outputs.F_hat_on_x = F_hat_rail
    outputs.in_domain = in_domain
    state.z_v = z_v_next
    state.z_rail = z_rail_next
    state.direction_rail = direction_rail_next
    state.samples_held = samples_held_next
    state.samples_slid = samples_slid_next
    state.x_predicted = x_predicted_next
    return outputs

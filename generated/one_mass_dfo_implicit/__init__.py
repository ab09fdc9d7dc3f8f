"""one_mass_dfo_implicit: friction observer DFO, velocity estimated, double precision.

Made by stiction 0.1.0 from one_mass_dfo_implicit.yaml
sha256 17681b16fcc2f3a9b534fe636ee6636e1a2e959da23f3b9cd0482eb72dad1be6
with: stiction generate one_mass_dfo_implicit.yaml

The twin of one_mass_dfo_implicit.c: the same operations in the same order on doubles, with bit-identical results.
Do not edit.
"""

import math
from dataclasses import dataclass

__all__ = ["Inputs", "Outputs", "Parameters", "State", "init", "prepare", "step"]

SPEC_SHA256 = "17681b16fcc2f3a9b534fe636ee6636e1a2e959da23f3b9cd0482eb72dad1be6"
LARGEST = 1e+150
# modes: what the next valid sample does
RUNNING = 0  # gives new estimates
HOLDING = 1  # after 8 invalid samples in a row: sets the state so that the estimates equal the held ones
STARTING = 2  # no sample was valid so far: initialises the state
ENVELOPE = {  # lower and upper limits: the operating region for which certificate.json holds
    "v": ("1/2", "10"),
    "f_rail": ("10001/10000", "101/100"),
    "v_dot": ("-100", "100"),
    "f_rail_dot": ("-1/10", "1/10"),
}


@dataclass(slots=True)
class Parameters:
    """Model constants and gains with the spec's values, followed by the constants that ``prepare`` derives from them."""

    m: float = 1.0  # kg: model parameter
    rail_a: float = 50.0  # N: model parameter
    rail_c: float = 100.0  # 1/m: model parameter
    rail_D1: float = 1000.0  # m/s: model parameter
    rail_D2: float = 0.0001  # m/s: model parameter
    K_a: float = -10.0  # N*s/m: observer gain
    K_f1: float = -0.01  # 1/m: observer gain
    K_f2: float = 0.0  # s/m: observer gain
    K_v: float = 100.0  # 1/s: observer gain
    sample_time: float = 0.001  # s: sample time
    h_K_v: float = 0.1  # sample_time * K_v
    rail_D1_minus_rail_D2: float = 999.9999  # rail_D1 - rail_D2
    h_K_f2: float = 0.0  # sample_time * K_f2
    K_a_K_f2: float = -0.0  # K_a * K_f2
    constant_1: float = 0.9090909090909091  # 1.0 / (h_K_v + 1.0)
    constant_2: float = 0.09090909090909091  # h_K_v / (h_K_v + 1.0)
    constant_3: float = 100.0  # rail_c * (1.0 - rail_D2 * K_f2 - K_f2 * rail_D1_minus_rail_D2)
    constant_4: float = 0.0  # 0.5 * rail_c * K_f2 * rail_D1_minus_rail_D2
    constant_5: float = 0.0009090909090909091  # sample_time / (h_K_v + 1.0)
    h_K_a: float = -0.01  # sample_time * K_a
    constant_6: float = -0.00909090909090909  # h_K_a / (h_K_v + 1.0)
    constant_7: float = 100000.0  # rail_c * (rail_D2 + rail_D1 - rail_D2)
    constant_8: float = 49999.995  # 0.5 * rail_c * rail_D1_minus_rail_D2


@dataclass(slots=True)
class State:
    """State of the observer between two samples."""

    z_v: float = 0.0  # m/s: observer state
    z_f_rail: float = 0.0  # 1: observer state
    z_a_rail: float = 0.0  # N: observer state
    w_held: float = 0.0  # N: w since the sample before
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
    f_hat_rail: float = 0.0  # 1: friction state, (7.11)
    a_hat_rail: float = 0.0  # N: friction level, (7.10)
    F_hat_rail: float = 0.0  # N: contact friction, (7.12)
    F_hat_on_x: float = 0.0  # N: friction force, (7.12)
    fault: int = 0  # 1 if this sample was not used


def _sign(u: float) -> float:
    return 1.0 if u > 0.0 else (-1.0 if u < 0.0 else 0.0)


def _quotient(a: float, b: float) -> float:
    if b != 0.0:
        return a / b
    return math.nan if a == 0.0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)


def prepare(parameters: Parameters) -> None:
    """Compute the derived constants again, after a parameter was changed."""
    parameters.h_K_v = parameters.sample_time * parameters.K_v
    parameters.rail_D1_minus_rail_D2 = parameters.rail_D1 - parameters.rail_D2
    parameters.h_K_f2 = parameters.sample_time * parameters.K_f2
    parameters.K_a_K_f2 = parameters.K_a * parameters.K_f2
    parameters.constant_1 = 1.0 / (parameters.h_K_v + 1.0)
    parameters.constant_2 = parameters.h_K_v / (parameters.h_K_v + 1.0)
    parameters.constant_3 = (
        parameters.rail_c * (1.0 - parameters.rail_D2 * parameters.K_f2 - parameters.K_f2
        * parameters.rail_D1_minus_rail_D2)
    )
    parameters.constant_4 = 0.5 * parameters.rail_c * parameters.K_f2 * parameters.rail_D1_minus_rail_D2
    parameters.constant_5 = parameters.sample_time / (parameters.h_K_v + 1.0)
    parameters.h_K_a = parameters.sample_time * parameters.K_a
    parameters.constant_6 = parameters.h_K_a / (parameters.h_K_v + 1.0)
    parameters.constant_7 = parameters.rail_c * (parameters.rail_D2 + parameters.rail_D1 - parameters.rail_D2)
    parameters.constant_8 = 0.5 * parameters.rail_c * parameters.rail_D1_minus_rail_D2


def init(parameters: Parameters, inputs: Inputs) -> State:
    """The initial state, from the first measurement; if that is invalid, the first valid sample sets it."""
    state = State(
        z_v=-(parameters.K_v * inputs.x),
        z_f_rail=-(parameters.K_f1 * inputs.x),
        z_a_rail=parameters.rail_a,
        w_held=inputs.w,
    )
    check = (
        abs(inputs.x) + abs(inputs.w) + abs(state.z_v) + abs(state.z_f_rail) + abs(state.z_a_rail)
        + abs(state.w_held)
    )
    if not abs(check) <= LARGEST:
        state = State(mode=STARTING)
    return state


def _predict(state: State, parameters: Parameters, outputs: Outputs) -> None:
    """Predict the state over an invalid sample, as if the machine moved at the held velocity estimate."""
    state.z_v = state.z_v - parameters.h_K_v * outputs.v_hat
    state.z_f_rail = state.z_f_rail - parameters.sample_time * parameters.K_f1 * outputs.v_hat
    if state.mode == RUNNING:
        if outputs.fault == 0:
            state.invalid_samples = 0  # the sample before was valid
        state.invalid_samples += 1
        if state.invalid_samples >= 8:
            state.mode = HOLDING


def _resume(state: State, parameters: Parameters, inputs: Inputs, outputs: Outputs) -> None:
    """Set the state from a valid sample so that the estimates equal the held ones."""
    state.z_v = outputs.v_hat - parameters.K_v * inputs.x
    state.z_f_rail = outputs.f_hat_rail - parameters.K_f1 * inputs.x - parameters.K_f2 * outputs.v_hat
    state.z_a_rail = outputs.a_hat_rail - parameters.K_a * outputs.v_hat * outputs.f_hat_rail
    state.w_held = inputs.w
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

    # state now, z[k] = z[k-1] + h f(z[k]), first Newton step
    state_now_1 = parameters.K_v * inputs.x
    state_now_2 = parameters.K_f1 * inputs.x
    z_start_1 = state.z_v - parameters.constant_2 * (state.z_v + state_now_1)
    state_now_3 = z_start_1 + state_now_1
    f43 = state.z_f_rail + state_now_2 + parameters.K_f2 * state_now_3
    state_now_4 = f43 - 1.0
    sign_state_now_4 = _sign(state_now_4)
    state_now_5 = 1.0 + f43
    sign_state_now_5 = _sign(state_now_5)
    state_now_6 = (
        parameters.constant_3 - parameters.constant_4 * sign_state_now_4 + parameters.constant_4
        * sign_state_now_5
    )
    state_now_7 = parameters.constant_5 * (state_now_6 - parameters.K_f1)
    A24 = parameters.h_K_f2 - parameters.sample_time * state_now_7
    state_now_8 = (
        parameters.rail_c * (state_now_3 - parameters.rail_D2 * f43 - parameters.rail_D1_minus_rail_D2 * (f43
        + 0.5 * abs(state_now_4) - 0.5 * abs(state_now_5)))
    )
    state_now_9 = z_start_1 - state.z_v + parameters.h_K_v * state_now_3
    r2 = parameters.sample_time * (state_now_8 - parameters.K_f1 * state_now_3) - state_now_7 * state_now_9
    f31 = parameters.constant_6 * (state_now_3 * state_now_6 + state_now_8)
    state_now_10 = parameters.K_a * f43
    state_now_11 = state.z_a_rail + state_now_3 * state_now_10
    f41 = (
        parameters.constant_1 * (f43 * (parameters.K_a_K_f2 * state_now_3 + state_now_10) + parameters.K_f2
        * state_now_11)
    )
    state_now_12 = (
        parameters.constant_7 + parameters.constant_8 * sign_state_now_4 - parameters.constant_8
        * sign_state_now_5
    )
    one_over_p2 = _quotient(1.0, 1.0 + parameters.sample_time * state_now_12)
    state_now_13 = parameters.h_K_a * state_now_3 * state_now_12 * one_over_p2
    A34_ = parameters.sample_time * state_now_10 + parameters.sample_time * f31 + A24 * state_now_13
    r3_ = state_now_9 * f31 - parameters.h_K_a * state_now_3 * state_now_8 + r2 * state_now_13
    f42 = one_over_p2 * (parameters.K_a * state_now_3 * f43 + state_now_11)
    d4 = (
        (state.w_held + state_now_9 * f41 - r2 * f42 - f43 * (state_now_11 + r3_)) * _quotient(1.0, parameters.m
        + parameters.sample_time * f41 - A24 * f42 - f43 * A34_)
    )
    z_v_newton = z_start_1 + parameters.constant_1 * (parameters.sample_time * d4 - state_now_9)  # m/s
    z_f_rail_newton = state.z_f_rail + one_over_p2 * (r2 - A24 * d4)  # 1
    z_a_rail_newton = state.z_a_rail + r3_ - A34_ * d4  # N

    # state now, z[k] = z[k-1] + h f(z[k]), second Newton step
    state_now_14 = z_v_newton + state_now_1
    f43_ = z_f_rail_newton + state_now_2 + parameters.K_f2 * state_now_14
    state_now_15 = f43_ - 1.0
    sign_state_now_15 = _sign(state_now_15)
    state_now_16 = 1.0 + f43_
    sign_state_now_16 = _sign(state_now_16)
    state_now_17 = (
        parameters.constant_3 - parameters.constant_4 * sign_state_now_15 + parameters.constant_4
        * sign_state_now_16
    )
    state_now_18 = parameters.constant_5 * (state_now_17 - parameters.K_f1)
    A24_ = parameters.h_K_f2 - parameters.sample_time * state_now_18
    state_now_19 = z_v_newton - state.z_v - parameters.sample_time * (d4 - parameters.K_v * state_now_14)
    state_now_20 = (
        parameters.rail_c * (state_now_14 - parameters.rail_D2 * f43_ - parameters.rail_D1_minus_rail_D2 * (f43_
        + 0.5 * abs(state_now_15) - 0.5 * abs(state_now_16)))
    )
    state_now_21 = parameters.K_f2 * d4
    r2_ = (
        state.z_f_rail - state_now_18 * state_now_19 - z_f_rail_newton + parameters.sample_time * (state_now_20
        - parameters.K_f1 * state_now_14 - state_now_21)
    )
    f31_ = parameters.constant_6 * (state_now_21 + state_now_14 * state_now_17 + state_now_20)
    state_now_22 = parameters.K_a * f43_
    state_now_23 = z_a_rail_newton + state_now_14 * state_now_22
    f41_ = (
        parameters.constant_1 * (f43_ * (parameters.K_a_K_f2 * state_now_14 + state_now_22) + parameters.K_f2
        * state_now_23)
    )
    state_now_24 = (
        parameters.constant_7 + parameters.constant_8 * sign_state_now_15 - parameters.constant_8
        * sign_state_now_16
    )
    one_over_p2_ = _quotient(1.0, 1.0 + parameters.sample_time * state_now_24)
    f32_ = parameters.h_K_a * one_over_p2_ * (d4 - state_now_14 * state_now_24)
    A34_3 = parameters.sample_time * state_now_22 + parameters.sample_time * f31_ - A24_ * f32_
    r3_3 = (
        state_now_19 * f31_ - z_a_rail_newton + state.z_a_rail - parameters.h_K_a * (d4 * f43_ + state_now_14
        * state_now_20) - r2_ * f32_
    )
    f42_ = one_over_p2_ * (parameters.K_a * state_now_14 * f43_ + state_now_23)
    d4_ = (
        (state_now_19 * f41_ - parameters.m * d4 + state.w_held - r2_ * f42_ - f43_ * (state_now_23 + r3_3))
        * _quotient(1.0, parameters.m + parameters.sample_time * f41_ - A24_ * f42_ - f43_ * A34_3)
    )
    z_v_now = z_v_newton + parameters.constant_1 * (parameters.sample_time * d4_ - state_now_19)  # m/s
    z_f_rail_now = z_f_rail_newton + one_over_p2_ * (r2_ - A24_ * d4_)  # 1
    z_a_rail_now = z_a_rail_newton + r3_3 - A34_3 * d4_  # N

    # velocity estimate, (4.25)
    v_hat = z_v_now + state_now_1  # m/s

    # friction state, (7.11)
    f_hat_rail = z_f_rail_now + state_now_2 + parameters.K_f2 * v_hat  # 1

    # friction level, (7.10)
    a_hat_rail = z_a_rail_now + parameters.K_a * v_hat * f_hat_rail  # N

    # contact friction, (7.12)
    F_hat_rail = f_hat_rail * a_hat_rail  # N

    # states one sample later (backward Euler)
    z_v_next = z_v_now
    z_f_rail_next = z_f_rail_now
    z_a_rail_next = z_a_rail_now
    w_held_next = inputs.w

    # this sum is too large or NaN if a next state is, or an input or output on which no next state depends
    check = z_v_next + z_f_rail_next + z_a_rail_next + w_held_next + a_hat_rail + F_hat_rail
    if state.mode != RUNNING or not abs(check) <= LARGEST:
        given = abs(inputs.x) + abs(inputs.w)
        _handle_fault(state, parameters, inputs, outputs, abs(given) <= LARGEST)
        return outputs
    outputs.fault = 0
    outputs.v_hat = v_hat
    outputs.f_hat_rail = f_hat_rail
    outputs.a_hat_rail = a_hat_rail
    outputs.F_hat_rail = F_hat_rail
    outputs.F_hat_on_x = F_hat_rail
    state.z_v = z_v_next
    state.z_f_rail = z_f_rail_next
    state.z_a_rail = z_a_rail_next
    state.w_held = w_held_next
    return outputs

"""two_link_arm: friction observer GCFO, velocity estimated, double precision.

Made by stiction 0.1.0 from two_link_arm.yaml
sha256 b6da30848bfb88be36fdd088967c28eb76bff5115c2e0e2e130e666fe4a04476
with: stiction generate two_link_arm.yaml

The twin of two_link_arm.c: the same operations in the same order on doubles, with bit-identical results.
Do not edit.
"""

import math
from dataclasses import dataclass

__all__ = ["Inputs", "Outputs", "Parameters", "State", "init", "prepare", "step"]

SPEC_SHA256 = "b6da30848bfb88be36fdd088967c28eb76bff5115c2e0e2e130e666fe4a04476"
LARGEST = 1e+150
# modes: what the next valid sample does
RUNNING = 0  # gives new estimates
HOLDING = 1  # after 8 invalid samples in a row: sets the state so that the estimates equal the held ones
STARTING = 2  # no sample was valid so far: initialises the state
ENVELOPE = {  # lower and upper limits: the operating region for which certificate.json holds
    "theta1": ("-3927/1250", "3927/1250"),
    "theta2": ("-3927/1250", "3927/1250"),
    "omega1": ("-3/10", "3/10"),
    "omega2": ("-3/10", "3/10"),
}


@dataclass(slots=True)
class Parameters:
    """Model constants and gains with the spec's values, followed by the constants that ``prepare`` derives from them."""

    m1: float = 0.7718  # kg: model parameter
    m2: float = 0.2713  # kg: model parameter
    l1: float = 0.205  # m: model parameter
    b1: float = 0.04  # m: model parameter
    b2: float = 0.065  # m: model parameter
    I1: float = 0.00863  # kg*m^2: model parameter
    I2: float = 0.00132  # kg*m^2: model parameter
    gravity: float = 9.8  # m/s^2: model parameter
    shoulder_a: float = 0.001  # N*m: model parameter
    elbow_a: float = 0.005  # N*m: model parameter
    K_F_shoulder_shoulder: float = 0.01  # N*m*s/rad: observer gain
    K_F_elbow_shoulder: float = 0.01  # N*m*s/rad: observer gain
    K_F_elbow_elbow: float = 0.005  # N*m*s/rad: observer gain
    K_v_omega1_omega1: float = 1.0  # 1/s: observer gain
    K_v_omega1_omega2: float = 0.5  # 1/s: observer gain
    K_v_omega2_omega1: float = 1.0  # 1/s: observer gain
    K_v_omega2_omega2: float = 10.0  # 1/s: observer gain
    sample_time: float = 0.001  # s: sample time
    constant_1: float = 0.023732505  # I1 + I2 + m1 * b1 * b1 + m2 * b2 * b2 + m2 * l1 * l1
    twice_m2_l1_b2: float = 0.0072301449999999995  # 2.0 * m2 * l1 * b2
    I2_plus_m2_b2_squared: float = 0.0024662425  # I2 + m2 * b2 * b2
    m2_l1_b2: float = 0.0036150724999999997  # m2 * l1 * b2
    m2_b2_gravity: float = 0.17281810000000003  # m2 * b2 * gravity
    m1_b1_gravity_plus_m2_l1_gravity: float = 0.8475873  # m1 * b1 * gravity + m2 * l1 * gravity
    h_K_F_shoulder_shoulder: float = 1e-05  # sample_time * K_F_shoulder_shoulder
    h_K_F_elbow_elbow: float = 5e-06  # sample_time * K_F_elbow_elbow
    h_K_F_elbow_shoulder: float = 1e-05  # sample_time * K_F_elbow_shoulder


@dataclass(slots=True)
class State:
    """State of the observer between two samples."""

    z_omega1: float = 0.0  # rad/s: observer state
    z_omega2: float = 0.0  # rad/s: observer state
    z_shoulder: float = 0.0  # N*m: observer state
    z_elbow: float = 0.0  # N*m: observer state
    mode: int = RUNNING
    invalid_samples: int = 0  # in a row; the count restarts after a valid one


@dataclass(slots=True)
class Inputs:
    """Measurements and commands at a sample."""

    theta1: float = 0.0  # rad: measured position
    theta2: float = 0.0  # rad: measured position
    w1: float = 0.0  # N*m: input
    w2: float = 0.0  # N*m: input


@dataclass(slots=True)
class Outputs:
    """Estimates at a sample."""

    omega1_hat: float = 0.0  # rad/s: velocity estimate, (4.25)
    omega2_hat: float = 0.0  # rad/s: velocity estimate, (4.25)
    a_hat_shoulder: float = 0.0  # N*m: friction level, (4.11)
    a_hat_elbow: float = 0.0  # N*m: friction level, (4.11)
    F_hat_shoulder: float = 0.0  # N*m: contact friction, (4.10)
    F_hat_elbow: float = 0.0  # N*m: contact friction, (4.10)
    F_hat_on_theta1: float = 0.0  # N*m: friction force, (4.10)
    F_hat_on_theta2: float = 0.0  # N*m: friction force, (4.10)
    fault: int = 0  # 1 if this sample was not used


def _sign(u: float) -> float:
    return 1.0 if u > 0.0 else (-1.0 if u < 0.0 else 0.0)


def _sin(u: float) -> float:
    return math.sin(u) if math.isfinite(u) else math.nan


def _cos(u: float) -> float:
    return math.cos(u) if math.isfinite(u) else math.nan


def _quotient(a: float, b: float) -> float:
    if b != 0.0:
        return a / b
    return math.nan if a == 0.0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)


def prepare(parameters: Parameters) -> None:
    """Compute the derived constants again, after a parameter was changed."""
    parameters.constant_1 = (
        parameters.I1 + parameters.I2 + parameters.m1 * parameters.b1 * parameters.b1 + parameters.m2
        * parameters.b2 * parameters.b2 + parameters.m2 * parameters.l1 * parameters.l1
    )
    parameters.twice_m2_l1_b2 = 2.0 * parameters.m2 * parameters.l1 * parameters.b2
    parameters.I2_plus_m2_b2_squared = parameters.I2 + parameters.m2 * parameters.b2 * parameters.b2
    parameters.m2_l1_b2 = parameters.m2 * parameters.l1 * parameters.b2
    parameters.m2_b2_gravity = parameters.m2 * parameters.b2 * parameters.gravity
    parameters.m1_b1_gravity_plus_m2_l1_gravity = (
        parameters.m1 * parameters.b1 * parameters.gravity + parameters.m2 * parameters.l1 * parameters.gravity
    )
    parameters.h_K_F_shoulder_shoulder = parameters.sample_time * parameters.K_F_shoulder_shoulder
    parameters.h_K_F_elbow_elbow = parameters.sample_time * parameters.K_F_elbow_elbow
    parameters.h_K_F_elbow_shoulder = parameters.sample_time * parameters.K_F_elbow_shoulder


def init(parameters: Parameters, inputs: Inputs) -> State:
    """The initial state, from the first measurement; if that is invalid, the first valid sample sets it."""
    state = State(
        z_omega1=(
        -(parameters.K_v_omega1_omega1 * inputs.theta1 + parameters.K_v_omega1_omega2 * inputs.theta2)
    ),
        z_omega2=(
        -(parameters.K_v_omega2_omega1 * inputs.theta1 + parameters.K_v_omega2_omega2 * inputs.theta2)
    ),
        z_shoulder=parameters.shoulder_a,
        z_elbow=parameters.elbow_a,
    )
    check = (
        abs(inputs.theta1) + abs(inputs.theta2) + abs(inputs.w1) + abs(inputs.w2) + abs(state.z_omega1)
        + abs(state.z_omega2) + abs(state.z_shoulder) + abs(state.z_elbow)
    )
    if not abs(check) <= LARGEST:
        state = State(mode=STARTING)
    return state


def _predict(state: State, parameters: Parameters, outputs: Outputs) -> None:
    """Predict the state over an invalid sample, as if the machine moved at the held velocity estimate."""
    state.z_omega1 = (
        state.z_omega1 - parameters.sample_time * parameters.K_v_omega1_omega1 * outputs.omega1_hat
        - parameters.sample_time * parameters.K_v_omega1_omega2 * outputs.omega2_hat
    )
    state.z_omega2 = (
        state.z_omega2 - parameters.sample_time * parameters.K_v_omega2_omega1 * outputs.omega1_hat
        - parameters.sample_time * parameters.K_v_omega2_omega2 * outputs.omega2_hat
    )
    if state.mode == RUNNING:
        if outputs.fault == 0:
            state.invalid_samples = 0  # the sample before was valid
        state.invalid_samples += 1
        if state.invalid_samples >= 8:
            state.mode = HOLDING


def _resume(state: State, parameters: Parameters, inputs: Inputs, outputs: Outputs) -> None:
    """Set the state from a valid sample so that the estimates equal the held ones."""
    resumed_1 = inputs.theta1 + parameters.sample_time * outputs.omega1_hat
    resumed_2 = inputs.theta2 + parameters.sample_time * outputs.omega2_hat
    resumed_3 = abs(outputs.omega1_hat)
    state.z_omega1 = (
        outputs.omega1_hat - parameters.K_v_omega1_omega1 * resumed_1 - parameters.K_v_omega1_omega2 * resumed_2
    )
    state.z_omega2 = (
        outputs.omega2_hat - parameters.K_v_omega2_omega1 * resumed_1 - parameters.K_v_omega2_omega2 * resumed_2
    )
    state.z_shoulder = outputs.a_hat_shoulder + parameters.K_F_shoulder_shoulder * resumed_3
    state.z_elbow = (
        outputs.a_hat_elbow + parameters.K_F_elbow_elbow * abs(outputs.omega2_hat)
        + parameters.K_F_elbow_shoulder * resumed_3
    )
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
    omega1_hat = (
        state.z_omega1 + parameters.K_v_omega1_omega1 * inputs.theta1 + parameters.K_v_omega1_omega2
        * inputs.theta2
    )  # rad/s
    omega2_hat = (
        state.z_omega2 + parameters.K_v_omega2_omega1 * inputs.theta1 + parameters.K_v_omega2_omega2
        * inputs.theta2
    )  # rad/s

    # slip sign, (4.13)
    sign_shoulder = _sign(omega1_hat)  # 1
    sign_elbow = _sign(omega2_hat)  # 1

    # friction level, (4.11)
    abs_omega1_hat = abs(omega1_hat)
    a_hat_shoulder = state.z_shoulder - parameters.K_F_shoulder_shoulder * abs_omega1_hat  # N*m
    a_hat_elbow = (
        state.z_elbow - parameters.K_F_elbow_elbow * abs(omega2_hat) - parameters.K_F_elbow_shoulder
        * abs_omega1_hat
    )  # N*m

    # contact friction, (4.10)
    F_hat_shoulder = sign_shoulder * a_hat_shoulder  # N*m
    F_hat_elbow = sign_elbow * a_hat_elbow  # N*m

    # acceleration, (4.2)
    cos_theta2 = _cos(inputs.theta2)
    sin_theta2 = _sin(inputs.theta2)
    cos_theta1 = _cos(inputs.theta1)
    M11 = parameters.constant_1 + parameters.twice_m2_l1_b2 * cos_theta2
    M21 = parameters.I2_plus_m2_b2_squared + parameters.m2_l1_b2 * cos_theta2
    acceleration_1 = parameters.m2_b2_gravity * (cos_theta2 * cos_theta1 - sin_theta2 * _sin(inputs.theta1))
    r1 = (
        inputs.w1 + sin_theta2 * omega2_hat * (parameters.m2_l1_b2 * omega2_hat + parameters.twice_m2_l1_b2
        * omega1_hat) - F_hat_shoulder - parameters.m1_b1_gravity_plus_m2_l1_gravity * cos_theta1
        - acceleration_1
    )
    r2 = inputs.w2 - F_hat_elbow - acceleration_1 - parameters.m2_l1_b2 * sin_theta2 * omega1_hat * omega1_hat
    one_over_det_M = _quotient(1.0, parameters.I2_plus_m2_b2_squared * M11 - M21 * M21)
    omega1_dot_hat = one_over_det_M * (parameters.I2_plus_m2_b2_squared * r1 - M21 * r2)  # rad/s^2
    omega2_dot_hat = one_over_det_M * (M11 * r2 - M21 * r1)  # rad/s^2

    # states one sample later (explicit Euler)
    z_omega1_next = (
        state.z_omega1 + parameters.sample_time * (omega1_dot_hat - parameters.K_v_omega1_omega1 * omega1_hat
        - parameters.K_v_omega1_omega2 * omega2_hat)
    )
    z_omega2_next = (
        state.z_omega2 + parameters.sample_time * (omega2_dot_hat - parameters.K_v_omega2_omega1 * omega1_hat
        - parameters.K_v_omega2_omega2 * omega2_hat)
    )
    z_shoulder_next = state.z_shoulder + parameters.h_K_F_shoulder_shoulder * sign_shoulder * omega1_dot_hat
    z_elbow_next = (
        state.z_elbow + parameters.h_K_F_elbow_elbow * sign_elbow * omega2_dot_hat
        + parameters.h_K_F_elbow_shoulder * sign_shoulder * omega1_dot_hat
    )

    # this sum is too large or NaN if a next state is, or an input or output on which no next state depends
    check = z_omega1_next + z_omega2_next + z_shoulder_next + z_elbow_next
    if state.mode != RUNNING or not abs(check) <= LARGEST:
        given = abs(inputs.theta1) + abs(inputs.theta2) + abs(inputs.w1) + abs(inputs.w2)
        _handle_fault(state, parameters, inputs, outputs, abs(given) <= LARGEST)
        return outputs
    outputs.fault = 0
    outputs.omega1_hat = omega1_hat
    outputs.omega2_hat = omega2_hat
    outputs.a_hat_shoulder = a_hat_shoulder
    outputs.a_hat_elbow = a_hat_elbow
    outputs.F_hat_shoulder = F_hat_shoulder
    outputs.F_hat_elbow = F_hat_elbow
    outputs.F_hat_on_theta1 = F_hat_shoulder
    outputs.F_hat_on_theta2 = F_hat_elbow
    state.z_omega1 = z_omega1_next
    state.z_omega2 = z_omega2_next
    state.z_shoulder = z_shoulder_next
    state.z_elbow = z_elbow_next
    return outputs

"""two_mass_gdfo: friction observer GDFO, velocity estimated, double precision.

Made by stiction 0.1.0 from two_mass_gdfo.yaml
sha256 7d02c83e0b5f919a9fb44a751f66f366eab47db73186cc4e84137a69465b93fc
with: stiction generate two_mass_gdfo.yaml

The twin of two_mass_gdfo.c: the same operations in the same order on doubles, with bit-identical results.
Do not edit.
"""

import math
from dataclasses import dataclass

__all__ = ["Inputs", "Outputs", "Parameters", "State", "init", "prepare", "step"]

SPEC_SHA256 = "7d02c83e0b5f919a9fb44a751f66f366eab47db73186cc4e84137a69465b93fc"
LARGEST = 1e+150
# modes: what the next valid sample does
RUNNING = 0  # gives new estimates
HOLDING = 1  # after 8 invalid samples in a row: sets the state so that the estimates equal the held ones
STARTING = 2  # no sample was valid so far: initialises the state
ENVELOPE = {  # lower and upper limits: the operating region for which certificate.json holds
    "v1": ("-5", "5"),
    "v2": ("-5", "5"),
}


@dataclass(slots=True)
class Parameters:
    """Model constants and gains with the spec's values, followed by the constants that ``prepare`` derives from them."""

    m1: float = 10.0  # kg: model parameter
    m2: float = 50.0  # kg: model parameter
    eta1: float = 100.0  # N/m: model parameter
    eta2: float = 50.0  # N/m: model parameter
    eta3: float = 20.0  # N/m: model parameter
    between_a: float = 10.0  # N: model parameter
    between_c: float = 100.0  # 1/m: model parameter
    between_D1: float = 1000.0  # m/s: model parameter
    between_D2: float = 0.0001  # m/s: model parameter
    ground_a: float = 20.0  # N: model parameter
    ground_c: float = 100.0  # 1/m: model parameter
    ground_D1: float = 1000.0  # m/s: model parameter
    ground_D2: float = 0.0001  # m/s: model parameter
    K_a_between: float = -30.0  # N*s/m: observer gain
    K_a_ground: float = -100.0  # N*s/m: observer gain
    K_f1_between: float = 0.01  # 1/m: observer gain
    K_f1_ground: float = 0.01  # 1/m: observer gain
    K_f2_between: float = 0.0  # s/m: observer gain
    K_f2_ground: float = 0.0  # s/m: observer gain
    K_v_v1: float = 10.0  # 1/s: observer gain
    K_v_v2: float = 10.0  # 1/s: observer gain
    sample_time: float = 1e-05  # s: sample time
    eta2_plus_eta3: float = 70.0  # eta2 + eta3
    eta1_plus_eta3: float = 120.0  # eta1 + eta3
    one_over_m1: float = 0.1  # 1.0 / m1
    one_over_m2: float = 0.02  # 1.0 / m2
    between_D1_minus_between_D2: float = 999.9999  # between_D1 - between_D2
    ground_D1_minus_ground_D2: float = 999.9999  # ground_D1 - ground_D2
    h_K_a_between: float = -0.00030000000000000003  # sample_time * K_a_between
    h_K_a_ground: float = -0.001  # sample_time * K_a_ground


@dataclass(slots=True)
class State:
    """State of the observer between two samples."""

    z_v1: float = 0.0  # m/s: observer state
    z_v2: float = 0.0  # m/s: observer state
    z_f_between: float = 0.0  # 1: observer state
    z_f_ground: float = 0.0  # 1: observer state
    z_a_between: float = 0.0  # N: observer state
    z_a_ground: float = 0.0  # N: observer state
    mode: int = RUNNING
    invalid_samples: int = 0  # in a row; the count restarts after a valid one


@dataclass(slots=True)
class Inputs:
    """Measurements and commands at a sample."""

    x1: float = 0.0  # m: measured position
    x2: float = 0.0  # m: measured position
    w: float = 0.0  # N: input


@dataclass(slots=True)
class Outputs:
    """Estimates at a sample."""

    v1_hat: float = 0.0  # m/s: velocity estimate, (4.25)
    v2_hat: float = 0.0  # m/s: velocity estimate, (4.25)
    f_hat_between: float = 0.0  # 1: friction state, (7.11)
    f_hat_ground: float = 0.0  # 1: friction state, (7.11)
    a_hat_between: float = 0.0  # N: friction level, (7.10)
    a_hat_ground: float = 0.0  # N: friction level, (7.10)
    F_hat_between: float = 0.0  # N: contact friction, (7.12)
    F_hat_ground: float = 0.0  # N: contact friction, (7.12)
    F_hat_on_x1: float = 0.0  # N: friction force, (7.12)
    F_hat_on_x2: float = 0.0  # N: friction force, (7.12)
    fault: int = 0  # 1 if this sample was not used


def prepare(parameters: Parameters) -> None:
    """Compute the derived constants again, after a parameter was changed."""
    parameters.eta2_plus_eta3 = parameters.eta2 + parameters.eta3
    parameters.eta1_plus_eta3 = parameters.eta1 + parameters.eta3
    parameters.one_over_m1 = 1.0 / parameters.m1
    parameters.one_over_m2 = 1.0 / parameters.m2
    parameters.between_D1_minus_between_D2 = parameters.between_D1 - parameters.between_D2
    parameters.ground_D1_minus_ground_D2 = parameters.ground_D1 - parameters.ground_D2
    parameters.h_K_a_between = parameters.sample_time * parameters.K_a_between
    parameters.h_K_a_ground = parameters.sample_time * parameters.K_a_ground


def init(parameters: Parameters, inputs: Inputs) -> State:
    """The initial state, from the first measurement; if that is invalid, the first valid sample sets it."""
    state = State(
        z_v1=-(parameters.K_v_v1 * inputs.x1),
        z_v2=-(parameters.K_v_v2 * inputs.x2),
        z_f_between=-(parameters.K_f1_between * inputs.x1),
        z_f_ground=-(parameters.K_f1_ground * inputs.x2),
        z_a_between=parameters.between_a,
        z_a_ground=parameters.ground_a,
    )
    check = (
        abs(inputs.x1) + abs(inputs.x2) + abs(inputs.w) + abs(state.z_v1) + abs(state.z_v2)
        + abs(state.z_f_between) + abs(state.z_f_ground) + abs(state.z_a_between) + abs(state.z_a_ground)
    )
    if not abs(check) <= LARGEST:
        state = State(mode=STARTING)
    return state


def _predict(state: State, parameters: Parameters, outputs: Outputs) -> None:
    """Predict the state over an invalid sample, as if the machine moved at the held velocity estimate."""
    state.z_v1 = state.z_v1 - parameters.sample_time * parameters.K_v_v1 * outputs.v1_hat
    state.z_v2 = state.z_v2 - parameters.sample_time * parameters.K_v_v2 * outputs.v2_hat
    state.z_f_between = state.z_f_between - parameters.sample_time * parameters.K_f1_between * outputs.v1_hat
    state.z_f_ground = state.z_f_ground - parameters.sample_time * parameters.K_f1_ground * outputs.v2_hat
    if state.mode == RUNNING:
        if outputs.fault == 0:
            state.invalid_samples = 0  # the sample before was valid
        state.invalid_samples += 1
        if state.invalid_samples >= 8:
            state.mode = HOLDING


def _resume(state: State, parameters: Parameters, inputs: Inputs, outputs: Outputs) -> None:
    """Set the state from a valid sample so that the estimates equal the held ones."""
    resumed_1 = inputs.x1 + parameters.sample_time * outputs.v1_hat
    resumed_2 = inputs.x2 + parameters.sample_time * outputs.v2_hat
    state.z_v1 = outputs.v1_hat - parameters.K_v_v1 * resumed_1
    state.z_v2 = outputs.v2_hat - parameters.K_v_v2 * resumed_2
    state.z_f_between = (
        outputs.f_hat_between - parameters.K_f1_between * resumed_1 - parameters.K_f2_between * outputs.v1_hat
    )
    state.z_f_ground = (
        outputs.f_hat_ground - parameters.K_f1_ground * resumed_2 - parameters.K_f2_ground * outputs.v2_hat
    )
    state.z_a_between = (
        outputs.a_hat_between - parameters.K_a_between * outputs.f_hat_between * (outputs.v1_hat
        - outputs.v2_hat)
    )
    state.z_a_ground = outputs.a_hat_ground - parameters.K_a_ground * outputs.v2_hat * outputs.f_hat_ground
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
    v1_hat = state.z_v1 + parameters.K_v_v1 * inputs.x1  # m/s
    v2_hat = state.z_v2 + parameters.K_v_v2 * inputs.x2  # m/s

    # slip velocity, U' v, (4.5)
    slip_between = v1_hat - v2_hat  # m/s

    # friction state, (7.11)
    f_hat_between = state.z_f_between + parameters.K_f1_between * inputs.x1 + parameters.K_f2_between * v1_hat  # 1
    f_hat_ground = state.z_f_ground + parameters.K_f1_ground * inputs.x2 + parameters.K_f2_ground * v2_hat  # 1

    # friction level, (7.10)
    a_hat_between = state.z_a_between + parameters.K_a_between * slip_between * f_hat_between  # N
    a_hat_ground = state.z_a_ground + parameters.K_a_ground * v2_hat * f_hat_ground  # N

    # contact friction, (7.12)
    F_hat_between = f_hat_between * a_hat_between  # N
    F_hat_ground = f_hat_ground * a_hat_ground  # N

    # friction force, (7.12)
    F_hat_on_x2 = F_hat_ground - F_hat_between  # N

    # acceleration, (4.2)
    v1_dot_hat = (
        parameters.one_over_m1 * (parameters.eta3 * inputs.x2 - parameters.eta2_plus_eta3 * inputs.x1
        - F_hat_between)
    )  # m/s^2
    v2_dot_hat = (
        parameters.one_over_m2 * (inputs.w + parameters.eta3 * inputs.x1 - F_hat_on_x2
        - parameters.eta1_plus_eta3 * inputs.x2)
    )  # m/s^2

    # friction state rate, xi_1 of (6.5), (6.6)
    f_rate_between = (
        parameters.between_c * (slip_between - parameters.between_D2 * f_hat_between
        - parameters.between_D1_minus_between_D2 * (f_hat_between + 0.5 * abs(f_hat_between - 1.0) - 0.5
        * abs(1.0 + f_hat_between)))
    )  # 1/s
    f_rate_ground = (
        parameters.ground_c * (v2_hat - parameters.ground_D2 * f_hat_ground
        - parameters.ground_D1_minus_ground_D2 * (f_hat_ground + 0.5 * abs(f_hat_ground - 1.0) - 0.5 * abs(1.0
        + f_hat_ground)))
    )  # 1/s

    # states one sample later (explicit Euler)
    z_v1_next = state.z_v1 + parameters.sample_time * (v1_dot_hat - parameters.K_v_v1 * v1_hat)
    z_v2_next = state.z_v2 + parameters.sample_time * (v2_dot_hat - parameters.K_v_v2 * v2_hat)
    z_f_between_next = (
        state.z_f_between + parameters.sample_time * (f_rate_between - parameters.K_f1_between * v1_hat
        - parameters.K_f2_between * v1_dot_hat)
    )
    z_f_ground_next = (
        state.z_f_ground + parameters.sample_time * (f_rate_ground - parameters.K_f1_ground * v2_hat
        - parameters.K_f2_ground * v2_dot_hat)
    )
    z_a_between_next = (
        state.z_a_between - parameters.h_K_a_between * (f_hat_between * (v1_dot_hat - v2_dot_hat) + slip_between
        * f_rate_between)
    )
    z_a_ground_next = (
        state.z_a_ground - parameters.h_K_a_ground * (f_hat_ground * v2_dot_hat + v2_hat * f_rate_ground)
    )

    # this sum is too large or NaN if a next state is, or an input or output on which no next state depends
    check = (
        z_v1_next + z_v2_next + z_f_between_next + z_f_ground_next + z_a_between_next + z_a_ground_next
    )
    if state.mode != RUNNING or not abs(check) <= LARGEST:
        given = abs(inputs.x1) + abs(inputs.x2) + abs(inputs.w)
        _handle_fault(state, parameters, inputs, outputs, abs(given) <= LARGEST)
        return outputs
    outputs.fault = 0
    outputs.v1_hat = v1_hat
    outputs.v2_hat = v2_hat
    outputs.f_hat_between = f_hat_between
    outputs.f_hat_ground = f_hat_ground
    outputs.a_hat_between = a_hat_between
    outputs.a_hat_ground = a_hat_ground
    outputs.F_hat_between = F_hat_between
    outputs.F_hat_ground = F_hat_ground
    outputs.F_hat_on_x1 = F_hat_between
    outputs.F_hat_on_x2 = F_hat_on_x2
    state.z_v1 = z_v1_next
    state.z_v2 = z_v2_next
    state.z_f_between = z_f_between_next
    state.z_f_ground = z_f_ground_next
    state.z_a_between = z_a_between_next
    state.z_a_ground = z_a_ground_next
    return outputs

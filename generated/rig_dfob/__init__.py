"""rig_dfob: friction observer DFO, velocity estimated, double precision.

Made by stiction 0.1.0 from rig_dfob.yaml
sha256 35344a60bec08ac01ae4fac2503c305726c82aef028174816f332dc9de0dc5f3
with: stiction generate rig_dfob.yaml

The twin of rig_dfob.c: the same operations in the same order on doubles, with bit-identical results.
Do not edit.
"""

import math
from dataclasses import dataclass

__all__ = ["Inputs", "Outputs", "Parameters", "State", "init", "prepare", "step"]

SPEC_SHA256 = "35344a60bec08ac01ae4fac2503c305726c82aef028174816f332dc9de0dc5f3"
LARGEST = 1e+150
# modes: what the next valid sample does
RUNNING = 0  # gives new estimates
HOLDING = 1  # after 2 invalid samples in a row: sets the state so that the estimates equal the held ones
STARTING = 2  # no sample was valid so far: initialises the state
ENVELOPE = {  # lower and upper limits: the operating region for which certificate.json holds
    "omega": ("-20", "20"),
}


@dataclass(slots=True)
class Parameters:
    """Model constants and gains with the spec's values, followed by the constants that ``prepare`` derives from them."""

    J: float = 1.0  # kg*m^2: model parameter
    plates_a: float = 30.0  # N*m: model parameter
    plates_c: float = 5.0  # 1/rad: model parameter
    K_a: float = -5.0  # N*m*s/rad: observer gain
    K_f1: float = 0.0  # 1/rad: observer gain
    K_f2: float = 0.0  # s/rad: observer gain
    K_v: float = 50.0  # 1/s: observer gain
    sample_time: float = 0.01  # s: sample time
    one_over_J: float = 1.0  # 1.0 / J
    h_K_a: float = -0.05  # sample_time * K_a


@dataclass(slots=True)
class State:
    """State of the observer between two samples."""

    z_omega: float = 0.0  # rad/s: observer state
    z_f_plates: float = 0.0  # 1: observer state
    z_a_plates: float = 0.0  # N*m: observer state
    mode: int = RUNNING
    invalid_samples: int = 0  # in a row; the count restarts after a valid one


@dataclass(slots=True)
class Inputs:
    """Measurements and commands at a sample."""

    theta: float = 0.0  # rad: measured position
    w: float = 0.0  # N*m: input


@dataclass(slots=True)
class Outputs:
    """Estimates at a sample."""

    omega_hat: float = 0.0  # rad/s: velocity estimate, (4.25)
    f_hat_plates: float = 0.0  # 1: friction state, (7.11)
    a_hat_plates: float = 0.0  # N*m: friction level, (7.10)
    F_hat_plates: float = 0.0  # N*m: contact friction, (7.12)
    F_hat_on_theta: float = 0.0  # N*m: friction force, (7.12)
    fault: int = 0  # 1 if this sample was not used


def _sign(u: float) -> float:
    return 1.0 if u > 0.0 else (-1.0 if u < 0.0 else 0.0)


def prepare(parameters: Parameters) -> None:
    """Compute the derived constants again, after a parameter was changed."""
    parameters.one_over_J = 1.0 / parameters.J
    parameters.h_K_a = parameters.sample_time * parameters.K_a


def init(parameters: Parameters, inputs: Inputs) -> State:
    """The initial state, from the first measurement; if that is invalid, the first valid sample sets it."""
    state = State(
        z_omega=-(parameters.K_v * inputs.theta),
        z_f_plates=-(parameters.K_f1 * inputs.theta),
        z_a_plates=parameters.plates_a,
    )
    check = (
        abs(inputs.theta) + abs(inputs.w) + abs(state.z_omega) + abs(state.z_f_plates) + abs(state.z_a_plates)
    )
    if not abs(check) <= LARGEST:
        state = State(mode=STARTING)
    return state


def _predict(state: State, parameters: Parameters, outputs: Outputs) -> None:
    """Predict the state over an invalid sample, as if the machine moved at the held velocity estimate."""
    state.z_omega = state.z_omega - parameters.sample_time * parameters.K_v * outputs.omega_hat
    state.z_f_plates = state.z_f_plates - parameters.sample_time * parameters.K_f1 * outputs.omega_hat
    if state.mode == RUNNING:
        if outputs.fault == 0:
            state.invalid_samples = 0  # the sample before was valid
        state.invalid_samples += 1
        if state.invalid_samples >= 2:
            state.mode = HOLDING


def _resume(state: State, parameters: Parameters, inputs: Inputs, outputs: Outputs) -> None:
    """Set the state from a valid sample so that the estimates equal the held ones."""
    resumed_1 = inputs.theta + parameters.sample_time * outputs.omega_hat
    state.z_omega = outputs.omega_hat - parameters.K_v * resumed_1
    state.z_f_plates = outputs.f_hat_plates - parameters.K_f1 * resumed_1 - parameters.K_f2 * outputs.omega_hat
    state.z_a_plates = outputs.a_hat_plates - parameters.K_a * outputs.omega_hat * outputs.f_hat_plates
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
    omega_hat = state.z_omega + parameters.K_v * inputs.theta  # rad/s

    # friction state, (7.11)
    f_hat_plates = state.z_f_plates + parameters.K_f1 * inputs.theta + parameters.K_f2 * omega_hat  # 1

    # friction level, (7.10)
    a_hat_plates = state.z_a_plates + parameters.K_a * omega_hat * f_hat_plates  # N*m

    # contact friction, (7.12)
    F_hat_plates = f_hat_plates * a_hat_plates  # N*m

    # acceleration, (4.2)
    omega_dot_hat = parameters.one_over_J * (inputs.w - F_hat_plates)  # rad/s^2

    # friction state rate, xi_1 of (6.5), (6.6)
    f_rate_plates = parameters.plates_c * omega_hat * (1.0 - _sign(omega_hat) * f_hat_plates)  # 1/s

    # states one sample later (explicit Euler)
    z_omega_next = state.z_omega + parameters.sample_time * (omega_dot_hat - parameters.K_v * omega_hat)
    z_f_plates_next = (
        state.z_f_plates + parameters.sample_time * (f_rate_plates - parameters.K_f1 * omega_hat
        - parameters.K_f2 * omega_dot_hat)
    )
    z_a_plates_next = (
        state.z_a_plates - parameters.h_K_a * (f_hat_plates * omega_dot_hat + omega_hat * f_rate_plates)
    )

    # this sum is too large or NaN if a next state is, or an input or output on which no next state depends
    check = z_omega_next + z_f_plates_next + z_a_plates_next
    if state.mode != RUNNING or not abs(check) <= LARGEST:
        given = abs(inputs.theta) + abs(inputs.w)
        _handle_fault(state, parameters, inputs, outputs, abs(given) <= LARGEST)
        return outputs
    outputs.fault = 0
    outputs.omega_hat = omega_hat
    outputs.f_hat_plates = f_hat_plates
    outputs.a_hat_plates = a_hat_plates
    outputs.F_hat_plates = F_hat_plates
    outputs.F_hat_on_theta = F_hat_plates
    state.z_omega = z_omega_next
    state.z_f_plates = z_f_plates_next
    state.z_a_plates = z_a_plates_next
    return outputs

"""rig_to: friction observer TO, velocity estimated, double precision.

Made by stiction 0.1.0 from rig_to.yaml
sha256 3f8a34b28bf62f6eba9ec73e43a7a6df1bc1671345b852be96b034354d84bb91
with: stiction generate rig_to.yaml

The twin of rig_to.c: the same operations in the same order on doubles, so the same bits. Do not edit.
"""

import math
from dataclasses import dataclass

__all__ = ["Inputs", "Outputs", "Parameters", "State", "init", "prepare", "step"]

SPEC_SHA256 = "3f8a34b28bf62f6eba9ec73e43a7a6df1bc1671345b852be96b034354d84bb91"
LARGEST = 1e+150
ENVELOPE = {  # low and high: where the certificate beside this file speaks
    "omega": ("-20", "20"),
    "omega_dot": ("-400", "400"),
    "theta_noise": ("-3927/2500000", "3927/2500000"),
}


@dataclass(slots=True)
class Parameters:
    """Constants of the model and gains, with the spec's values; behind them what ``prepare`` derives from these."""

    J: float = 1.0  # kg*m^2: model parameter
    K_1: float = 0.0  # N*m/rad: observer gain
    K_2: float = -10.0  # N*m*s/rad: observer gain
    K_v: float = 50.0  # 1/s: observer gain
    sample_time: float = 0.01  # s: sample time
    one_over_J: float = 1.0  # 1.0 / J
    h_K_1: float = 0.0  # sample_time * K_1
    h_K_2: float = -0.1  # sample_time * K_2


@dataclass(slots=True)
class State:
    """What the observer remembers from sample to sample."""

    z_omega: float = 0.0  # rad/s: observer state
    z_theta: float = 0.0  # N*m: observer state
    waiting: float = 0.0  # 1 until a good sample has set the state; below 1/2 in use


@dataclass(slots=True)
class Inputs:
    """What is measured and commanded at a sample."""

    theta: float = 0.0  # rad: measured position
    w: float = 0.0  # N*m: input


@dataclass(slots=True)
class Outputs:
    """What is estimated."""

    omega_hat: float = 0.0  # rad/s: velocity estimate, (4.25)
    tracked_theta: float = 0.0  # N*m: tracked friction, (4.16)
    F_hat_on_theta: float = 0.0  # N*m: friction force, (4.16)
    fault: int = 0  # 1 if this sample was not used


def prepare(parameters: Parameters) -> None:
    """Compute the derived constants anew, after a parameter was changed."""
    parameters.one_over_J = 1.0 / parameters.J
    parameters.h_K_1 = parameters.sample_time * parameters.K_1
    parameters.h_K_2 = parameters.sample_time * parameters.K_2


def init(parameters: Parameters, inputs: Inputs) -> State:
    """The state from the first measurement; if that cannot be used, one that waits for a good sample."""
    state = State(
        z_omega=-(parameters.K_v * inputs.theta),
        z_theta=-(parameters.K_1 * inputs.theta),
    )
    check = inputs.theta + inputs.w + state.z_omega + state.z_theta
    if not abs(check) <= LARGEST:
        state = State(waiting=1.0)
    return state


def _miss(state: State, parameters: Parameters, outputs: Outputs) -> None:
    """A sample is lost: the machine is taken to go on with the velocity that is held, and the states with it."""
    state.z_omega = state.z_omega - parameters.sample_time * parameters.K_v * outputs.omega_hat
    state.z_theta = state.z_theta - parameters.h_K_1 * outputs.omega_hat
    if state.waiting < 0.5:
        state.waiting = (state.waiting if outputs.fault else 0.0) + 0.25


def _resume(state: State, parameters: Parameters, inputs: Inputs, outputs: Outputs) -> None:
    """Set the state from a good sample after many that were lost, so that the estimates go on from the held ones."""
    resumed_1 = inputs.theta + parameters.sample_time * outputs.omega_hat
    state.z_omega = outputs.omega_hat - parameters.K_v * resumed_1
    state.z_theta = outputs.tracked_theta - parameters.K_1 * resumed_1 - parameters.K_2 * outputs.omega_hat
    state.waiting = 0.0


def _set_anew(state: State, parameters: Parameters, inputs: Inputs, outputs: Outputs, good: bool) -> None:
    """What becomes of the state where a sample is not used."""
    if not good:
        if state.waiting < 0.75:
            _miss(state, parameters, outputs)
    elif state.waiting < 0.5 or state.waiting > 0.75:
        fresh = init(parameters, inputs)  # the state cannot be used, or waits for its first sample
        for name in State.__slots__:
            setattr(state, name, getattr(fresh, name))
    else:
        _resume(state, parameters, inputs, outputs)
    outputs.fault = 1


def step(state: State, parameters: Parameters, inputs: Inputs, outputs: Outputs | None = None) -> Outputs:
    """One sample: estimates from the state and this measurement; ``state`` becomes that of the next sample.

    The estimates go into ``outputs``, or into new ones.
    Where an input is NaN or infinite, or a next state would be or lie beyond 1e+150, ``outputs`` stay as they
    are but for ``fault``, which is 1; the state goes along as if the machine went on with the velocity that is held. Where
    the inputs are good, it is the state that cannot be used or waits: it is set from them, and the next sample is
    estimated again. The held estimates are read from ``outputs``: hand in the same at each step.
    """
    if outputs is None:
        outputs = Outputs()

    # velocity estimate, (4.25)
    omega_hat = state.z_omega + parameters.K_v * inputs.theta  # rad/s

    # tracked friction, (4.16)
    tracked_theta = state.z_theta + parameters.K_1 * inputs.theta + parameters.K_2 * omega_hat  # N*m

    # acceleration, (4.2)
    omega_dot_hat = parameters.one_over_J * (inputs.w - tracked_theta)  # rad/s^2

    # states one sample later (explicit Euler)
    z_omega_next = state.z_omega + parameters.sample_time * (omega_dot_hat - parameters.K_v * omega_hat)
    z_theta_next = state.z_theta - parameters.h_K_1 * omega_hat - parameters.h_K_2 * omega_dot_hat

    # hold the last state and estimates where a next state, or an input that it does not show, is too large or NaN
    check = z_omega_next + z_theta_next
    if state.waiting >= 0.5 or not abs(check) <= LARGEST:
        given = inputs.theta + inputs.w
        _set_anew(state, parameters, inputs, outputs, abs(given) <= LARGEST)
        return outputs
    outputs.fault = 0
    outputs.omega_hat = omega_hat
    outputs.tracked_theta = tracked_theta
    outputs.F_hat_on_theta = tracked_theta
    state.z_omega = z_omega_next
    state.z_theta = z_theta_next
    return outputs

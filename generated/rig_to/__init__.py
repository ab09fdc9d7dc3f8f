"""rig_to: friction observer TO, velocity estimated.

Made by stiction 0.1.0 from rig_to.yaml
sha256 548fde0b8ad1aa0f939cbcfd46f103a1fdb2f3fd97d1d062f74811fafc58e9f5
with: stiction generate rig_to.yaml

The twin of rig_to.c: the same operations in the same order on doubles, so the same bits. Do not edit.
"""

import math
from dataclasses import dataclass

__all__ = ["Inputs", "Outputs", "Parameters", "State", "init", "step"]

SPEC_SHA256 = "548fde0b8ad1aa0f939cbcfd46f103a1fdb2f3fd97d1d062f74811fafc58e9f5"


@dataclass(slots=True)
class Parameters:
    """Constants of the model and gains, with the spec's values."""

    J: float = 1.0  # kg*m^2: model parameter
    K_1: float = 0.0  # N*m/rad: observer gain
    K_2: float = -10.0  # N*m*s/rad: observer gain
    K_v: float = 50.0  # 1/s: observer gain
    sample_time: float = 0.01  # s: sample time


@dataclass(slots=True)
class State:
    """What the observer remembers from sample to sample."""

    z_omega: float = 0.0  # rad/s: observer state
    z_theta: float = 0.0  # N*m: observer state


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


def init(parameters: Parameters, inputs: Inputs) -> State:
    """The state from the first measurement."""
    # states at the first sample
    return State(
        z_omega=-(parameters.K_v * inputs.theta),
        z_theta=-(parameters.K_1 * inputs.theta),
    )


def step(state: State, parameters: Parameters, inputs: Inputs) -> Outputs:
    """One sample: estimates from the state and this measurement; ``state`` becomes that of the next sample."""
    # velocity estimate, (4.25)
    omega_hat = state.z_omega + parameters.K_v * inputs.theta  # rad/s

    # tracked friction, (4.16)
    tracked_theta = state.z_theta + parameters.K_1 * inputs.theta + parameters.K_2 * omega_hat  # N*m

    # friction force, (4.16)
    F_hat_on_theta = tracked_theta  # N*m

    # acceleration, (4.2)
    omega_dot_hat = (inputs.w - F_hat_on_theta) / parameters.J  # rad/s^2

    # states one sample later (explicit Euler)
    z_omega_next = state.z_omega + parameters.sample_time * (omega_dot_hat - parameters.K_v * omega_hat)
    z_theta_next = state.z_theta - parameters.sample_time * (parameters.K_1 * omega_hat + parameters.K_2 * omega_dot_hat)
    state.z_omega = z_omega_next
    state.z_theta = z_theta_next

    return Outputs(
        omega_hat=omega_hat,
        tracked_theta=tracked_theta,
        F_hat_on_theta=F_hat_on_theta,
    )

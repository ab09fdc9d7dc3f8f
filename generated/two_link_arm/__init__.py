"""two_link_arm: friction observer GCFO, velocity estimated.

Made by stiction 0.1.0 from two_link_arm.yaml
sha256 8b25c9c1855802942b021ffbcf57601b15385794294bca198854e44907fbf30b
with: stiction generate two_link_arm.yaml

The twin of two_link_arm.c: the same operations in the same order on doubles, so the same bits. Do not edit.
"""

import math
from dataclasses import dataclass

__all__ = ["Inputs", "Outputs", "Parameters", "State", "init", "step"]

SPEC_SHA256 = "8b25c9c1855802942b021ffbcf57601b15385794294bca198854e44907fbf30b"


@dataclass(slots=True)
class Parameters:
    """Constants of the model and gains, with the spec's values."""

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


@dataclass(slots=True)
class State:
    """What the observer remembers from sample to sample."""

    z_omega1: float = 0.0  # rad/s: observer state
    z_omega2: float = 0.0  # rad/s: observer state
    z_shoulder: float = 0.0  # N*m: observer state
    z_elbow: float = 0.0  # N*m: observer state


@dataclass(slots=True)
class Inputs:
    """What is measured and commanded at a sample."""

    theta1: float = 0.0  # rad: measured position
    theta2: float = 0.0  # rad: measured position
    w1: float = 0.0  # N*m: input
    w2: float = 0.0  # N*m: input


@dataclass(slots=True)
class Outputs:
    """What is estimated."""

    omega1_hat: float = 0.0  # rad/s: velocity estimate, (4.25)
    omega2_hat: float = 0.0  # rad/s: velocity estimate, (4.25)
    a_hat_shoulder: float = 0.0  # N*m: friction level, (4.11)
    a_hat_elbow: float = 0.0  # N*m: friction level, (4.11)
    F_hat_shoulder: float = 0.0  # N*m: contact friction, (4.10)
    F_hat_elbow: float = 0.0  # N*m: contact friction, (4.10)
    F_hat_on_theta1: float = 0.0  # N*m: friction force, (4.10)
    F_hat_on_theta2: float = 0.0  # N*m: friction force, (4.10)


def _sign(u: float) -> float:
    return 1.0 if u > 0.0 else (-1.0 if u < 0.0 else 0.0)


def init(parameters: Parameters, inputs: Inputs) -> State:
    """The state from the first measurement."""
    # states at the first sample
    return State(
        z_omega1=-(parameters.K_v_omega1_omega1 * inputs.theta1 + parameters.K_v_omega1_omega2 * inputs.theta2),
        z_omega2=-(parameters.K_v_omega2_omega1 * inputs.theta1 + parameters.K_v_omega2_omega2 * inputs.theta2),
        z_shoulder=parameters.shoulder_a,
        z_elbow=parameters.elbow_a,
    )


def step(state: State, parameters: Parameters, inputs: Inputs) -> Outputs:
    """One sample: estimates from the state and this measurement; ``state`` becomes that of the next sample."""
    # velocity estimate, (4.25)
    omega1_hat = state.z_omega1 + parameters.K_v_omega1_omega1 * inputs.theta1 + parameters.K_v_omega1_omega2 * inputs.theta2  # rad/s
    omega2_hat = state.z_omega2 + parameters.K_v_omega2_omega1 * inputs.theta1 + parameters.K_v_omega2_omega2 * inputs.theta2  # rad/s

    # slip velocity, U' v, (4.5)
    slip_shoulder = omega1_hat  # rad/s
    slip_elbow = omega2_hat  # rad/s

    # slip sign, (4.13)
    sign_shoulder = _sign(slip_shoulder)  # 1
    sign_elbow = _sign(slip_elbow)  # 1

    # friction level, (4.11)
    part_of_friction_level_1 = abs(slip_shoulder)
    a_hat_shoulder = state.z_shoulder - parameters.K_F_shoulder_shoulder * part_of_friction_level_1  # N*m
    a_hat_elbow = state.z_elbow - parameters.K_F_elbow_elbow * abs(slip_elbow) - parameters.K_F_elbow_shoulder * part_of_friction_level_1  # N*m

    # contact friction, (4.10)
    F_hat_shoulder = a_hat_shoulder * sign_shoulder  # N*m
    F_hat_elbow = a_hat_elbow * sign_elbow  # N*m

    # friction force, (4.10)
    F_hat_on_theta1 = F_hat_shoulder  # N*m
    F_hat_on_theta2 = F_hat_elbow  # N*m

    # acceleration, (4.2)
    part_of_acceleration_1 = parameters.b2 * parameters.l1 * parameters.m2
    part_of_acceleration_2 = math.sin(inputs.theta2)
    part_of_acceleration_3 = 2.0 * parameters.b2 * parameters.l1 * parameters.m2
    part_of_acceleration_4 = math.cos(inputs.theta1)
    part_of_acceleration_5 = parameters.b2 * parameters.gravity * parameters.m2 * math.cos(inputs.theta1 + inputs.theta2)
    part_of_acceleration_6 = inputs.w1 + part_of_acceleration_1 * (omega2_hat * omega2_hat) * part_of_acceleration_2 + part_of_acceleration_3 * omega1_hat * omega2_hat * part_of_acceleration_2 - F_hat_on_theta1 - parameters.b1 * parameters.gravity * parameters.m1 * part_of_acceleration_4 - part_of_acceleration_5 - parameters.gravity * parameters.l1 * parameters.m2 * part_of_acceleration_4
    part_of_acceleration_7 = parameters.m2 * (parameters.b2 * parameters.b2)
    part_of_acceleration_8 = math.cos(inputs.theta2)
    part_of_acceleration_9 = parameters.I1 + parameters.I2 + parameters.m1 * (parameters.b1 * parameters.b1) + part_of_acceleration_7 + parameters.m2 * (parameters.l1 * parameters.l1) + part_of_acceleration_3 * part_of_acceleration_8
    part_of_acceleration_10 = parameters.I2 + part_of_acceleration_7
    part_of_acceleration_11 = (part_of_acceleration_10 + part_of_acceleration_1 * part_of_acceleration_8) / part_of_acceleration_9
    part_of_acceleration_12 = (inputs.w2 - F_hat_on_theta2 - part_of_acceleration_5 - part_of_acceleration_1 * (omega1_hat * omega1_hat) * part_of_acceleration_2 - part_of_acceleration_11 * part_of_acceleration_6) / (part_of_acceleration_10 - part_of_acceleration_11 * part_of_acceleration_11 * part_of_acceleration_9)
    omega1_dot_hat = part_of_acceleration_6 / part_of_acceleration_9 - part_of_acceleration_11 * part_of_acceleration_12  # rad/s^2
    omega2_dot_hat = part_of_acceleration_12  # rad/s^2

    # states one sample later (explicit Euler)
    z_omega1_next = state.z_omega1 + parameters.sample_time * (omega1_dot_hat - parameters.K_v_omega1_omega1 * omega1_hat - parameters.K_v_omega1_omega2 * omega2_hat)
    z_omega2_next = state.z_omega2 + parameters.sample_time * (omega2_dot_hat - parameters.K_v_omega2_omega1 * omega1_hat - parameters.K_v_omega2_omega2 * omega2_hat)
    z_shoulder_next = state.z_shoulder + parameters.sample_time * (parameters.K_F_shoulder_shoulder * omega1_dot_hat * sign_shoulder)
    z_elbow_next = state.z_elbow + parameters.sample_time * (parameters.K_F_elbow_elbow * omega2_dot_hat * sign_elbow + parameters.K_F_elbow_shoulder * omega1_dot_hat * sign_shoulder)
    state.z_omega1 = z_omega1_next
    state.z_omega2 = z_omega2_next
    state.z_shoulder = z_shoulder_next
    state.z_elbow = z_elbow_next

    return Outputs(
        omega1_hat=omega1_hat,
        omega2_hat=omega2_hat,
        a_hat_shoulder=a_hat_shoulder,
        a_hat_elbow=a_hat_elbow,
        F_hat_shoulder=F_hat_shoulder,
        F_hat_elbow=F_hat_elbow,
        F_hat_on_theta1=F_hat_on_theta1,
        F_hat_on_theta2=F_hat_on_theta2,
    )

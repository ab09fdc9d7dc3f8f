"""seven_joint_arm: friction observer GTO, velocity estimated, double precision.

Made by stiction 0.1.0 from seven_joint_arm.yaml
sha256 9fdf4378f6fb9e1b1c4b537e8ffc93bd7914598df7afed94c8c086353543ed8a
with: stiction generate seven_joint_arm.yaml

The twin of seven_joint_arm.c: the same operations in the same order on doubles, with bit-identical results.
Do not edit.
"""

import math
from dataclasses import dataclass

__all__ = ["Inputs", "Outputs", "Parameters", "State", "init", "prepare", "step"]

SPEC_SHA256 = "9fdf4378f6fb9e1b1c4b537e8ffc93bd7914598df7afed94c8c086353543ed8a"
LARGEST = 1e+150
# modes: what the next valid sample does
RUNNING = 0  # gives new estimates
HOLDING = 1  # after 8 invalid samples in a row: sets the state so that the estimates equal the held ones
STARTING = 2  # no sample was valid so far: initialises the state
ENVELOPE = {  # lower and upper limits: the operating region for which certificate.json holds
    "shoulder_yaw": ("-29/10", "29/10"),
    "shoulder_pitch": ("-2", "2"),
    "arm_roll": ("-29/10", "29/10"),
    "elbow_pitch": ("-2", "2"),
    "forearm_roll": ("-29/10", "29/10"),
    "wrist_pitch": ("-2", "2"),
    "hand_roll": ("-3", "3"),
    "v_shoulder_yaw": ("-9/5", "9/5"),
    "v_shoulder_pitch": ("-9/5", "9/5"),
    "v_arm_roll": ("-11/5", "11/5"),
    "v_elbow_pitch": ("-11/5", "11/5"),
    "v_forearm_roll": ("-13/5", "13/5"),
    "v_wrist_pitch": ("-3", "3"),
    "v_hand_roll": ("-3", "3"),
}


@dataclass(slots=True)
class Parameters:
    """Model constants and gains with the spec's values, followed by the constants that ``prepare`` derives from them."""

    viscous_shoulder_yaw_b: float = 0.9  # N*m*s/rad: model parameter
    viscous_shoulder_pitch_b: float = 0.9  # N*m*s/rad: model parameter
    viscous_arm_roll_b: float = 0.6  # N*m*s/rad: model parameter
    viscous_elbow_pitch_b: float = 0.5  # N*m*s/rad: model parameter
    viscous_forearm_roll_b: float = 0.3  # N*m*s/rad: model parameter
    viscous_wrist_pitch_b: float = 0.2  # N*m*s/rad: model parameter
    viscous_hand_roll_b: float = 0.1  # N*m*s/rad: model parameter
    K_2_shoulder_yaw: float = -25.0  # N*m*s/rad: observer gain
    K_2_shoulder_pitch: float = -40.0  # N*m*s/rad: observer gain
    K_2_arm_roll: float = -8.0  # N*m*s/rad: observer gain
    K_2_elbow_pitch: float = -30.0  # N*m*s/rad: observer gain
    K_2_forearm_roll: float = -1.5  # N*m*s/rad: observer gain
    K_2_wrist_pitch: float = -12.0  # N*m*s/rad: observer gain
    K_2_hand_roll: float = -0.35  # N*m*s/rad: observer gain
    K_v_v_shoulder_yaw: float = 300.0  # 1/s: observer gain
    K_v_v_shoulder_pitch: float = 300.0  # 1/s: observer gain
    K_v_v_arm_roll: float = 300.0  # 1/s: observer gain
    K_v_v_elbow_pitch: float = 300.0  # 1/s: observer gain
    K_v_v_forearm_roll: float = 300.0  # 1/s: observer gain
    K_v_v_wrist_pitch: float = 300.0  # 1/s: observer gain
    K_v_v_hand_roll: float = 300.0  # 1/s: observer gain
    sample_time: float = 0.0005  # s: sample time
    h_K_2_shoulder_yaw: float = -0.0125  # sample_time * K_2_shoulder_yaw
    h_K_2_shoulder_pitch: float = -0.02  # sample_time * K_2_shoulder_pitch
    h_K_2_arm_roll: float = -0.004  # sample_time * K_2_arm_roll
    h_K_2_elbow_pitch: float = -0.015  # sample_time * K_2_elbow_pitch
    h_K_2_forearm_roll: float = -0.00075  # sample_time * K_2_forearm_roll
    h_K_2_wrist_pitch: float = -0.006  # sample_time * K_2_wrist_pitch
    h_K_2_hand_roll: float = -0.000175  # sample_time * K_2_hand_roll


@dataclass(slots=True)
class State:
    """State of the observer between two samples."""

    z_v_shoulder_yaw: float = 0.0  # rad/s: observer state
    z_v_shoulder_pitch: float = 0.0  # rad/s: observer state
    z_v_arm_roll: float = 0.0  # rad/s: observer state
    z_v_elbow_pitch: float = 0.0  # rad/s: observer state
    z_v_forearm_roll: float = 0.0  # rad/s: observer state
    z_v_wrist_pitch: float = 0.0  # rad/s: observer state
    z_v_hand_roll: float = 0.0  # rad/s: observer state
    z_shoulder_yaw: float = 0.0  # N*m: observer state
    z_shoulder_pitch: float = 0.0  # N*m: observer state
    z_arm_roll: float = 0.0  # N*m: observer state
    z_elbow_pitch: float = 0.0  # N*m: observer state
    z_forearm_roll: float = 0.0  # N*m: observer state
    z_wrist_pitch: float = 0.0  # N*m: observer state
    z_hand_roll: float = 0.0  # N*m: observer state
    mode: int = RUNNING
    invalid_samples: int = 0  # in a row; the count restarts after a valid one


@dataclass(slots=True)
class Inputs:
    """Measurements and commands at a sample."""

    shoulder_yaw: float = 0.0  # rad: measured position
    shoulder_pitch: float = 0.0  # rad: measured position
    arm_roll: float = 0.0  # rad: measured position
    elbow_pitch: float = 0.0  # rad: measured position
    forearm_roll: float = 0.0  # rad: measured position
    wrist_pitch: float = 0.0  # rad: measured position
    hand_roll: float = 0.0  # rad: measured position
    w_shoulder_yaw: float = 0.0  # N*m: input
    w_shoulder_pitch: float = 0.0  # N*m: input
    w_arm_roll: float = 0.0  # N*m: input
    w_elbow_pitch: float = 0.0  # N*m: input
    w_forearm_roll: float = 0.0  # N*m: input
    w_wrist_pitch: float = 0.0  # N*m: input
    w_hand_roll: float = 0.0  # N*m: input


@dataclass(slots=True)
class Outputs:
    """Estimates at a sample."""

    v_shoulder_yaw_hat: float = 0.0  # rad/s: velocity estimate, (4.25)
    v_shoulder_pitch_hat: float = 0.0  # rad/s: velocity estimate, (4.25)
    v_arm_roll_hat: float = 0.0  # rad/s: velocity estimate, (4.25)
    v_elbow_pitch_hat: float = 0.0  # rad/s: velocity estimate, (4.25)
    v_forearm_roll_hat: float = 0.0  # rad/s: velocity estimate, (4.25)
    v_wrist_pitch_hat: float = 0.0  # rad/s: velocity estimate, (4.25)
    v_hand_roll_hat: float = 0.0  # rad/s: velocity estimate, (4.25)
    tracked_shoulder_yaw: float = 0.0  # N*m: tracked friction, (4.16)
    tracked_shoulder_pitch: float = 0.0  # N*m: tracked friction, (4.16)
    tracked_arm_roll: float = 0.0  # N*m: tracked friction, (4.16)
    tracked_elbow_pitch: float = 0.0  # N*m: tracked friction, (4.16)
    tracked_forearm_roll: float = 0.0  # N*m: tracked friction, (4.16)
    tracked_wrist_pitch: float = 0.0  # N*m: tracked friction, (4.16)
    tracked_hand_roll: float = 0.0  # N*m: tracked friction, (4.16)
    F_hat_on_shoulder_yaw: float = 0.0  # N*m: friction force, (4.16)
    F_hat_on_shoulder_pitch: float = 0.0  # N*m: friction force, (4.16)
    F_hat_on_arm_roll: float = 0.0  # N*m: friction force, (4.16)
    F_hat_on_elbow_pitch: float = 0.0  # N*m: friction force, (4.16)
    F_hat_on_forearm_roll: float = 0.0  # N*m: friction force, (4.16)
    F_hat_on_wrist_pitch: float = 0.0  # N*m: friction force, (4.16)
    F_hat_on_hand_roll: float = 0.0  # N*m: friction force, (4.16)
    fault: int = 0  # 1 if this sample was not used


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
    parameters.h_K_2_shoulder_yaw = parameters.sample_time * parameters.K_2_shoulder_yaw
    parameters.h_K_2_shoulder_pitch = parameters.sample_time * parameters.K_2_shoulder_pitch
    parameters.h_K_2_arm_roll = parameters.sample_time * parameters.K_2_arm_roll
    parameters.h_K_2_elbow_pitch = parameters.sample_time * parameters.K_2_elbow_pitch
    parameters.h_K_2_forearm_roll = parameters.sample_time * parameters.K_2_forearm_roll
    parameters.h_K_2_wrist_pitch = parameters.sample_time * parameters.K_2_wrist_pitch
    parameters.h_K_2_hand_roll = parameters.sample_time * parameters.K_2_hand_roll


def init(parameters: Parameters, inputs: Inputs) -> State:
    """The initial state, from the first measurement; if that is invalid, the first valid sample sets it."""
    state = State(
        z_v_shoulder_yaw=-(parameters.K_v_v_shoulder_yaw * inputs.shoulder_yaw),
        z_v_shoulder_pitch=-(parameters.K_v_v_shoulder_pitch * inputs.shoulder_pitch),
        z_v_arm_roll=-(parameters.K_v_v_arm_roll * inputs.arm_roll),
        z_v_elbow_pitch=-(parameters.K_v_v_elbow_pitch * inputs.elbow_pitch),
        z_v_forearm_roll=-(parameters.K_v_v_forearm_roll * inputs.forearm_roll),
        z_v_wrist_pitch=-(parameters.K_v_v_wrist_pitch * inputs.wrist_pitch),
        z_v_hand_roll=-(parameters.K_v_v_hand_roll * inputs.hand_roll),
        z_shoulder_yaw=0.0,
        z_shoulder_pitch=0.0,
        z_arm_roll=0.0,
        z_elbow_pitch=0.0,
        z_forearm_roll=0.0,
        z_wrist_pitch=0.0,
        z_hand_roll=0.0,
    )
    check = (
        abs(inputs.shoulder_yaw) + abs(inputs.shoulder_pitch) + abs(inputs.arm_roll) + abs(inputs.elbow_pitch)
        + abs(inputs.forearm_roll) + abs(inputs.wrist_pitch) + abs(inputs.hand_roll)
        + abs(inputs.w_shoulder_yaw) + abs(inputs.w_shoulder_pitch) + abs(inputs.w_arm_roll)
        + abs(inputs.w_elbow_pitch) + abs(inputs.w_forearm_roll) + abs(inputs.w_wrist_pitch)
        + abs(inputs.w_hand_roll) + abs(state.z_v_shoulder_yaw) + abs(state.z_v_shoulder_pitch)
        + abs(state.z_v_arm_roll) + abs(state.z_v_elbow_pitch) + abs(state.z_v_forearm_roll)
        + abs(state.z_v_wrist_pitch) + abs(state.z_v_hand_roll) + abs(state.z_shoulder_yaw)
        + abs(state.z_shoulder_pitch) + abs(state.z_arm_roll) + abs(state.z_elbow_pitch)
        + abs(state.z_forearm_roll) + abs(state.z_wrist_pitch) + abs(state.z_hand_roll)
    )
    if not abs(check) <= LARGEST:
        state = State(mode=STARTING)
    return state


def _predict(state: State, parameters: Parameters, outputs: Outputs) -> None:
    """Predict the state over an invalid sample, as if the machine moved at the held velocity estimate."""
    state.z_v_shoulder_yaw = (
        state.z_v_shoulder_yaw - parameters.sample_time * parameters.K_v_v_shoulder_yaw
        * outputs.v_shoulder_yaw_hat
    )
    state.z_v_shoulder_pitch = (
        state.z_v_shoulder_pitch - parameters.sample_time * parameters.K_v_v_shoulder_pitch
        * outputs.v_shoulder_pitch_hat
    )
    state.z_v_arm_roll = (
        state.z_v_arm_roll - parameters.sample_time * parameters.K_v_v_arm_roll * outputs.v_arm_roll_hat
    )
    state.z_v_elbow_pitch = (
        state.z_v_elbow_pitch - parameters.sample_time * parameters.K_v_v_elbow_pitch
        * outputs.v_elbow_pitch_hat
    )
    state.z_v_forearm_roll = (
        state.z_v_forearm_roll - parameters.sample_time * parameters.K_v_v_forearm_roll
        * outputs.v_forearm_roll_hat
    )
    state.z_v_wrist_pitch = (
        state.z_v_wrist_pitch - parameters.sample_time * parameters.K_v_v_wrist_pitch
        * outputs.v_wrist_pitch_hat
    )
    state.z_v_hand_roll = (
        state.z_v_hand_roll - parameters.sample_time * parameters.K_v_v_hand_roll * outputs.v_hand_roll_hat
    )
    if state.mode == RUNNING:
        if outputs.fault == 0:
            state.invalid_samples = 0  # the sample before was valid
        state.invalid_samples += 1
        if state.invalid_samples >= 8:
            state.mode = HOLDING


def _resume(state: State, parameters: Parameters, inputs: Inputs, outputs: Outputs) -> None:
    """Set the state from a valid sample so that the estimates equal the held ones."""
    state.z_v_shoulder_yaw = (
        outputs.v_shoulder_yaw_hat - parameters.K_v_v_shoulder_yaw * (inputs.shoulder_yaw
        + parameters.sample_time * outputs.v_shoulder_yaw_hat)
    )
    state.z_v_shoulder_pitch = (
        outputs.v_shoulder_pitch_hat - parameters.K_v_v_shoulder_pitch * (inputs.shoulder_pitch
        + parameters.sample_time * outputs.v_shoulder_pitch_hat)
    )
    state.z_v_arm_roll = (
        outputs.v_arm_roll_hat - parameters.K_v_v_arm_roll * (inputs.arm_roll + parameters.sample_time
        * outputs.v_arm_roll_hat)
    )
    state.z_v_elbow_pitch = (
        outputs.v_elbow_pitch_hat - parameters.K_v_v_elbow_pitch * (inputs.elbow_pitch + parameters.sample_time
        * outputs.v_elbow_pitch_hat)
    )
    state.z_v_forearm_roll = (
        outputs.v_forearm_roll_hat - parameters.K_v_v_forearm_roll * (inputs.forearm_roll
        + parameters.sample_time * outputs.v_forearm_roll_hat)
    )
    state.z_v_wrist_pitch = (
        outputs.v_wrist_pitch_hat - parameters.K_v_v_wrist_pitch * (inputs.wrist_pitch + parameters.sample_time
        * outputs.v_wrist_pitch_hat)
    )
    state.z_v_hand_roll = (
        outputs.v_hand_roll_hat - parameters.K_v_v_hand_roll * (inputs.hand_roll + parameters.sample_time
        * outputs.v_hand_roll_hat)
    )
    state.z_shoulder_yaw = (
        outputs.tracked_shoulder_yaw - parameters.K_2_shoulder_yaw * outputs.v_shoulder_yaw_hat
    )
    state.z_shoulder_pitch = (
        outputs.tracked_shoulder_pitch - parameters.K_2_shoulder_pitch * outputs.v_shoulder_pitch_hat
    )
    state.z_arm_roll = outputs.tracked_arm_roll - parameters.K_2_arm_roll * outputs.v_arm_roll_hat
    state.z_elbow_pitch = outputs.tracked_elbow_pitch - parameters.K_2_elbow_pitch * outputs.v_elbow_pitch_hat
    state.z_forearm_roll = (
        outputs.tracked_forearm_roll - parameters.K_2_forearm_roll * outputs.v_forearm_roll_hat
    )
    state.z_wrist_pitch = outputs.tracked_wrist_pitch - parameters.K_2_wrist_pitch * outputs.v_wrist_pitch_hat
    state.z_hand_roll = outputs.tracked_hand_roll - parameters.K_2_hand_roll * outputs.v_hand_roll_hat
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
    v_shoulder_yaw_hat = state.z_v_shoulder_yaw + parameters.K_v_v_shoulder_yaw * inputs.shoulder_yaw  # rad/s
    v_shoulder_pitch_hat = (
        state.z_v_shoulder_pitch + parameters.K_v_v_shoulder_pitch * inputs.shoulder_pitch
    )  # rad/s
    v_arm_roll_hat = state.z_v_arm_roll + parameters.K_v_v_arm_roll * inputs.arm_roll  # rad/s
    v_elbow_pitch_hat = state.z_v_elbow_pitch + parameters.K_v_v_elbow_pitch * inputs.elbow_pitch  # rad/s
    v_forearm_roll_hat = state.z_v_forearm_roll + parameters.K_v_v_forearm_roll * inputs.forearm_roll  # rad/s
    v_wrist_pitch_hat = state.z_v_wrist_pitch + parameters.K_v_v_wrist_pitch * inputs.wrist_pitch  # rad/s
    v_hand_roll_hat = state.z_v_hand_roll + parameters.K_v_v_hand_roll * inputs.hand_roll  # rad/s

    # tracked friction, (4.16)
    tracked_shoulder_yaw = state.z_shoulder_yaw + parameters.K_2_shoulder_yaw * v_shoulder_yaw_hat  # N*m
    tracked_shoulder_pitch = state.z_shoulder_pitch + parameters.K_2_shoulder_pitch * v_shoulder_pitch_hat  # N*m
    tracked_arm_roll = state.z_arm_roll + parameters.K_2_arm_roll * v_arm_roll_hat  # N*m
    tracked_elbow_pitch = state.z_elbow_pitch + parameters.K_2_elbow_pitch * v_elbow_pitch_hat  # N*m
    tracked_forearm_roll = state.z_forearm_roll + parameters.K_2_forearm_roll * v_forearm_roll_hat  # N*m
    tracked_wrist_pitch = state.z_wrist_pitch + parameters.K_2_wrist_pitch * v_wrist_pitch_hat  # N*m
    tracked_hand_roll = state.z_hand_roll + parameters.K_2_hand_roll * v_hand_roll_hat  # N*m

    # known friction, declared effects
    known_shoulder_yaw = parameters.viscous_shoulder_yaw_b * v_shoulder_yaw_hat  # N*m
    known_shoulder_pitch = parameters.viscous_shoulder_pitch_b * v_shoulder_pitch_hat  # N*m
    known_arm_roll = parameters.viscous_arm_roll_b * v_arm_roll_hat  # N*m
    known_elbow_pitch = parameters.viscous_elbow_pitch_b * v_elbow_pitch_hat  # N*m
    known_forearm_roll = parameters.viscous_forearm_roll_b * v_forearm_roll_hat  # N*m
    known_wrist_pitch = parameters.viscous_wrist_pitch_b * v_wrist_pitch_hat  # N*m
    known_hand_roll = parameters.viscous_hand_roll_b * v_hand_roll_hat  # N*m

    # friction force, (4.16)
    F_hat_on_shoulder_yaw = known_shoulder_yaw + tracked_shoulder_yaw  # N*m
    F_hat_on_shoulder_pitch = known_shoulder_pitch + tracked_shoulder_pitch  # N*m
    F_hat_on_arm_roll = known_arm_roll + tracked_arm_roll  # N*m
    F_hat_on_elbow_pitch = known_elbow_pitch + tracked_elbow_pitch  # N*m
    F_hat_on_forearm_roll = known_forearm_roll + tracked_forearm_roll  # N*m
    F_hat_on_wrist_pitch = known_wrist_pitch + tracked_wrist_pitch  # N*m
    F_hat_on_hand_roll = known_hand_roll + tracked_hand_roll  # N*m

    # acceleration, (4.2)
    cos_hand_roll = _cos(inputs.hand_roll)
    sin_hand_roll = _sin(inputs.hand_roll)
    cos_forearm_roll = _cos(inputs.forearm_roll)
    cos_wrist_pitch = _cos(inputs.wrist_pitch)
    sin_wrist_pitch = _sin(inputs.wrist_pitch)
    sin_forearm_roll = _sin(inputs.forearm_roll)
    acceleration_1 = 0.0003027650871698192 * cos_hand_roll
    cos_elbow_pitch = _cos(inputs.elbow_pitch)
    sin_elbow_pitch = _sin(inputs.elbow_pitch)
    cos_shoulder_pitch = _cos(inputs.shoulder_pitch)
    cos_arm_roll = _cos(inputs.arm_roll)
    sin_arm_roll = _sin(inputs.arm_roll)
    sin_shoulder_pitch = _sin(inputs.shoulder_pitch)
    acceleration_2 = 0.0002259499347204054 * sin_hand_roll
    v_shoulder_pitch_hat_squared = v_shoulder_pitch_hat * v_shoulder_pitch_hat
    acceleration_3 = 9.81 * sin_shoulder_pitch
    acceleration_4 = sin_arm_roll * acceleration_3
    acceleration_5 = cos_arm_roll * acceleration_3
    acceleration_6 = 0.9950041652780258 * cos_hand_roll
    acceleration_7 = 0.09983341664682815 * sin_hand_roll
    acceleration_8 = 0.9950041652780258 * sin_hand_roll
    acceleration_9 = 0.09983341664682815 * cos_hand_roll
    acceleration_10 = 0.00056 * sin_hand_roll - 7.699999999999992e-05 * cos_hand_roll
    acceleration_11 = cos_hand_roll * acceleration_10
    acceleration_12 = 0.0073443 - acceleration_11
    acceleration_13 = 0.0010488 + acceleration_11
    acceleration_14 = 0.0002259499347204054 * cos_hand_roll + 0.0003027650871698192 * sin_hand_roll
    acceleration_15 = 0.09983341664682815 * acceleration_13 + 0.9950041652780258 * acceleration_14
    acceleration_16 = 4.6197084915690593e-05 * cos_hand_roll + 0.00010609713490378748 * sin_hand_roll
    acceleration_17 = (
        0.04187779227084341 + 0.09983341664682815 * acceleration_15 + 0.09933466539753062 * acceleration_14
        - 2.0 * (0.00436873060511378 * acceleration_16)
    )
    acceleration_18 = 0.0004604299187458011 * cos_hand_roll + 0.0010574324179126165 * sin_hand_roll
    acceleration_19 = (
        0.006233836391918195 + 0.9900332889206209 * acceleration_13 - 0.19866933079506124 * acceleration_14
        - 2.0 * (0.043541584522179204 * acceleration_18)
    )
    acceleration_20 = (
        0.9950041652780258 * acceleration_15 - 0.012821687277795328 - 0.009966711079379185 * acceleration_14
        - 0.043541584522179204 * acceleration_16 - 0.00436873060511378 * acceleration_18
    )
    acceleration_21 = (
        cos_wrist_pitch * (acceleration_19 - acceleration_17) - 2.0 * sin_wrist_pitch * acceleration_20
    )
    acceleration_22 = cos_wrist_pitch * acceleration_21
    acceleration_23 = 0.0020022 + acceleration_17 + acceleration_22
    acceleration_24 = sin_hand_roll * acceleration_10 - 0.00028
    acceleration_25 = acceleration_1 - acceleration_2
    acceleration_26 = 0.001062741699796952 * cos_hand_roll - 0.00046274169979695207 * sin_hand_roll
    acceleration_27 = (
        0.9950041652780258 * acceleration_24 - 8.3e-05 + 0.09983341664682815 * acceleration_25
        + 0.043541584522179204 * acceleration_26
    )
    acceleration_28 = cos_wrist_pitch * acceleration_27
    acceleration_29 = (
        0.09983341664682815 * acceleration_24 - 0.00074 - 0.9950041652780258 * acceleration_25
        + 0.00436873060511378 * acceleration_26
    )
    acceleration_30 = sin_wrist_pitch * acceleration_29
    acceleration_31 = 0.000144 + acceleration_28 - acceleration_30
    acceleration_32 = (
        cos_forearm_roll * (acceleration_23 - acceleration_12) - 2.0 * sin_forearm_roll * acceleration_31
    )
    acceleration_33 = cos_forearm_roll * acceleration_32
    acceleration_34 = 0.0030261 + acceleration_12 + acceleration_33
    acceleration_35 = 0.08557967683091304 - acceleration_18
    acceleration_36 = 0.27339050816391913 + acceleration_16
    acceleration_37 = sin_wrist_pitch * acceleration_35 - cos_wrist_pitch * acceleration_36
    acceleration_38 = 0.39 * acceleration_37
    acceleration_39 = 0.73793 + acceleration_19 - acceleration_22 - 2.0 * acceleration_38
    acceleration_40 = cos_wrist_pitch * acceleration_35
    acceleration_41 = sin_wrist_pitch * acceleration_36
    acceleration_42 = acceleration_40 + acceleration_41
    acceleration_43 = 0.000482 + 0.39 * acceleration_42 - acceleration_20 - sin_wrist_pitch * acceleration_21
    acceleration_44 = cos_forearm_roll * acceleration_43
    M65 = sin_wrist_pitch * acceleration_27 + cos_wrist_pitch * acceleration_29
    acceleration_45 = 0.016055 + 0.39 * acceleration_26 - M65
    acceleration_46 = sin_forearm_roll * acceleration_45
    acceleration_47 = acceleration_44 - 0.00107 - acceleration_46
    acceleration_48 = (
        cos_elbow_pitch * (acceleration_34 - acceleration_39) - 2.0 * sin_elbow_pitch * acceleration_47
    )
    acceleration_49 = cos_elbow_pitch * acceleration_48
    acceleration_50 = 0.0022 + acceleration_42
    acceleration_51 = cos_forearm_roll * acceleration_50
    acceleration_52 = 0.0525 + acceleration_26
    acceleration_53 = sin_forearm_roll * acceleration_52
    acceleration_54 = acceleration_51 - 0.0087 - acceleration_53
    acceleration_55 = sin_elbow_pitch * acceleration_54
    acceleration_56 = 2.181 - acceleration_37
    acceleration_57 = cos_elbow_pitch * acceleration_56
    acceleration_58 = (
        1.78847 + acceleration_34 - acceleration_49 + 2.0 * (0.41 * (acceleration_55 + acceleration_57))
    )
    acceleration_59 = 0.0159 + acceleration_23 - acceleration_33
    acceleration_60 = 0.0035496 + acceleration_39 + acceleration_49
    acceleration_61 = 0.000139 - acceleration_31 - sin_forearm_roll * acceleration_32
    acceleration_62 = cos_elbow_pitch * acceleration_61
    M54 = sin_forearm_roll * acceleration_43 + cos_forearm_roll * acceleration_45
    acceleration_63 = 0.0102 - M54
    acceleration_64 = sin_elbow_pitch * acceleration_63
    acceleration_65 = 7.2e-05 - acceleration_62 + acceleration_64
    acceleration_66 = cos_arm_roll * (acceleration_60 - acceleration_59) - 2.0 * sin_arm_roll * acceleration_65
    acceleration_67 = cos_arm_roll * acceleration_66
    acceleration_68 = 0.0045041 + acceleration_59 + acceleration_67
    acceleration_69 = (
        0.003468 + acceleration_47 + sin_elbow_pitch * acceleration_48 + 0.41 * (cos_elbow_pitch
        * acceleration_54 - sin_elbow_pitch * acceleration_56)
    )
    acceleration_70 = cos_arm_roll * acceleration_69
    acceleration_71 = sin_forearm_roll * acceleration_50
    acceleration_72 = cos_forearm_roll * acceleration_52
    acceleration_73 = sin_elbow_pitch * acceleration_61 + cos_elbow_pitch * acceleration_63
    acceleration_74 = 0.41 * (acceleration_71 + acceleration_72) - 0.00471 - acceleration_73
    acceleration_75 = sin_arm_roll * acceleration_74
    acceleration_76 = sin_arm_roll * acceleration_69 + cos_arm_roll * acceleration_74
    M21 = (
        sin_shoulder_pitch * (acceleration_65 - 0.000118 + sin_arm_roll * acceleration_66) - cos_shoulder_pitch
        * (0.01112 + acceleration_76)
    )
    M33 = acceleration_60 + acceleration_59
    M31 = cos_shoulder_pitch * M33 - sin_shoulder_pitch * (acceleration_75 - acceleration_70)
    acceleration_77 = acceleration_64 - acceleration_62
    M44 = acceleration_34 + acceleration_39
    acceleration_78 = M44 + 0.41 * (acceleration_57 + acceleration_55)
    acceleration_79 = (
        sin_shoulder_pitch * (cos_arm_roll * acceleration_77 + sin_arm_roll * acceleration_78)
        + cos_shoulder_pitch * acceleration_73
    )
    acceleration_80 = acceleration_46 - acceleration_44
    M55 = acceleration_23 + acceleration_12
    M53 = sin_elbow_pitch * acceleration_80 + cos_elbow_pitch * M55
    acceleration_81 = (
        cos_elbow_pitch * acceleration_80 - sin_elbow_pitch * M55 + 0.41 * (acceleration_53 - acceleration_51)
    )
    acceleration_82 = M54 + 0.41 * cos_elbow_pitch * (acceleration_72 + acceleration_71)
    M51 = (
        cos_shoulder_pitch * M53 - sin_shoulder_pitch * (cos_arm_roll * acceleration_81 + sin_arm_roll
        * acceleration_82)
    )
    acceleration_83 = acceleration_30 - acceleration_28
    M66 = acceleration_19 + acceleration_17
    acceleration_84 = M66 - acceleration_38
    acceleration_85 = cos_forearm_roll * acceleration_83 - sin_forearm_roll * acceleration_84
    M63 = sin_elbow_pitch * acceleration_85 + cos_elbow_pitch * M65
    acceleration_86 = (
        cos_elbow_pitch * acceleration_85 - sin_elbow_pitch * M65 + 0.41 * sin_forearm_roll * acceleration_37
    )
    acceleration_87 = sin_forearm_roll * acceleration_83 + cos_forearm_roll * acceleration_84
    acceleration_88 = (
        acceleration_87 - 0.41 * (cos_forearm_roll * cos_elbow_pitch * acceleration_37 - sin_elbow_pitch
        * (acceleration_41 + acceleration_40))
    )
    M61 = (
        cos_shoulder_pitch * M63 - sin_shoulder_pitch * (cos_arm_roll * acceleration_86 - sin_arm_roll
        * acceleration_88)
    )
    acceleration_89 = 0.001062741699796952 * sin_hand_roll + 0.00046274169979695207 * cos_hand_roll
    acceleration_90 = (
        0.0002248211261911014 * cos_hand_roll + 0.00030125252283473466 * sin_hand_roll + 0.00020172340167658097
        - 0.00436873060511378 * acceleration_89
    )
    acceleration_91 = (
        2.2557353974265858e-05 * cos_hand_roll + 3.0226073093537806e-05 * sin_hand_roll - 0.002010505416360779
        + 0.043541584522179204 * acceleration_89
    )
    acceleration_92 = (
        cos_wrist_pitch * acceleration_90 - sin_wrist_pitch * acceleration_91 + 0.39 * acceleration_89
    )
    acceleration_93 = 4.6197084915690593e-05 * sin_hand_roll - 0.00010609713490378748 * cos_hand_roll
    acceleration_94 = 0.0004604299187458011 * sin_hand_roll - 0.0010574324179126165 * cos_hand_roll
    M76 = (
        acceleration_2 - acceleration_1 + 0.043541584522179204 * acceleration_93 - 0.00436873060511378
        * acceleration_94
    )
    acceleration_95 = cos_wrist_pitch * acceleration_94 - sin_wrist_pitch * acceleration_93
    acceleration_96 = M76 + 0.39 * acceleration_95
    acceleration_97 = cos_forearm_roll * acceleration_92 - sin_forearm_roll * acceleration_96
    acceleration_98 = sin_wrist_pitch * acceleration_90 + cos_wrist_pitch * acceleration_91
    M73 = sin_elbow_pitch * acceleration_97 - cos_elbow_pitch * acceleration_98
    acceleration_99 = (
        cos_elbow_pitch * acceleration_97 + sin_elbow_pitch * acceleration_98 - 0.41 * (sin_forearm_roll
        * acceleration_95 - cos_forearm_roll * acceleration_89)
    )
    acceleration_100 = sin_forearm_roll * acceleration_92 + cos_forearm_roll * acceleration_96
    acceleration_101 = (
        acceleration_100 + 0.41 * (cos_elbow_pitch * (cos_forearm_roll * acceleration_95 + sin_forearm_roll
        * acceleration_89) + sin_elbow_pitch * (sin_wrist_pitch * acceleration_94 + cos_wrist_pitch
        * acceleration_93))
    )
    M71 = (
        cos_shoulder_pitch * M73 - sin_shoulder_pitch * (cos_arm_roll * acceleration_99 - sin_arm_roll
        * acceleration_101)
    )
    acceleration_102 = v_shoulder_yaw_hat * sin_shoulder_pitch
    acceleration_102_squared = acceleration_102 * acceleration_102
    acceleration_103 = acceleration_102_squared + v_shoulder_pitch_hat_squared
    acceleration_104 = v_shoulder_yaw_hat * cos_shoulder_pitch
    acceleration_104_squared = acceleration_104 * acceleration_104
    acceleration_105 = acceleration_102_squared + acceleration_104_squared
    acceleration_106 = v_shoulder_pitch_hat * acceleration_104
    acceleration_107 = v_shoulder_pitch_hat * acceleration_102
    acceleration_108 = acceleration_102 * acceleration_104
    acceleration_109 = sin_arm_roll * acceleration_102 + v_shoulder_pitch_hat * cos_arm_roll
    acceleration_110 = acceleration_104 + v_arm_roll_hat
    acceleration_111 = acceleration_109 * acceleration_110
    acceleration_112 = v_arm_roll_hat * acceleration_109 - cos_arm_roll * acceleration_106
    acceleration_113 = acceleration_111 + acceleration_112
    acceleration_114 = v_shoulder_pitch_hat * sin_arm_roll - cos_arm_roll * acceleration_102
    acceleration_115 = acceleration_110 * acceleration_114
    acceleration_116 = sin_arm_roll * acceleration_106 - v_arm_roll_hat * acceleration_114
    acceleration_117 = acceleration_115 - acceleration_116
    acceleration_118 = acceleration_109 * acceleration_114
    acceleration_119 = acceleration_118 - acceleration_107
    acceleration_114_squared = acceleration_114 * acceleration_114
    acceleration_110_squared = acceleration_110 * acceleration_110
    acceleration_120 = acceleration_114_squared + acceleration_110_squared
    acceleration_109_squared = acceleration_109 * acceleration_109
    acceleration_121 = acceleration_114_squared + acceleration_109_squared
    acceleration_122 = cos_elbow_pitch * acceleration_110 - sin_elbow_pitch * acceleration_114
    acceleration_123 = v_elbow_pitch_hat - acceleration_109
    acceleration_124 = acceleration_122 * acceleration_123
    acceleration_125 = (
        cos_elbow_pitch * acceleration_112 - sin_elbow_pitch * acceleration_107 + v_elbow_pitch_hat
        * acceleration_122
    )
    acceleration_126 = acceleration_124 + acceleration_125
    acceleration_127 = cos_elbow_pitch * acceleration_114 + sin_elbow_pitch * acceleration_110
    acceleration_128 = acceleration_123 * acceleration_127
    acceleration_129 = (
        sin_elbow_pitch * acceleration_112 + cos_elbow_pitch * acceleration_107 + v_elbow_pitch_hat
        * acceleration_127
    )
    acceleration_130 = acceleration_128 + acceleration_129
    acceleration_131 = acceleration_122 * acceleration_127
    acceleration_132 = acceleration_131 - acceleration_116
    acceleration_127_squared = acceleration_127 * acceleration_127
    acceleration_123_squared = acceleration_123 * acceleration_123
    acceleration_133 = acceleration_127_squared + acceleration_123_squared
    acceleration_122_squared = acceleration_122 * acceleration_122
    acceleration_134 = acceleration_127_squared + acceleration_122_squared
    acceleration_135 = acceleration_111 - acceleration_112
    acceleration_136 = acceleration_4 + 0.41 * acceleration_135
    acceleration_137 = sin_forearm_roll * acceleration_127 + cos_forearm_roll * acceleration_123
    acceleration_138 = (
        cos_forearm_roll * acceleration_125 + sin_forearm_roll * acceleration_116 - v_forearm_roll_hat
        * acceleration_137
    )
    acceleration_139 = acceleration_122 + v_forearm_roll_hat
    acceleration_140 = acceleration_137 * acceleration_139
    acceleration_141 = acceleration_138 - acceleration_140
    acceleration_142 = cos_forearm_roll * acceleration_127 - sin_forearm_roll * acceleration_123
    acceleration_143 = acceleration_139 * acceleration_142
    acceleration_144 = (
        cos_forearm_roll * acceleration_116 - sin_forearm_roll * acceleration_125 - v_forearm_roll_hat
        * acceleration_142
    )
    acceleration_145 = acceleration_143 - acceleration_144
    acceleration_146 = acceleration_137 * acceleration_142
    acceleration_147 = acceleration_146 + acceleration_129
    acceleration_142_squared = acceleration_142 * acceleration_142
    acceleration_139_squared = acceleration_139 * acceleration_139
    acceleration_148 = acceleration_142_squared + acceleration_139_squared
    acceleration_137_squared = acceleration_137 * acceleration_137
    acceleration_149 = acceleration_142_squared + acceleration_137_squared
    acceleration_150 = 9.81 * cos_shoulder_pitch - 0.41 * acceleration_121
    acceleration_151 = acceleration_115 + acceleration_116
    acceleration_152 = 0.41 * acceleration_151 - acceleration_5
    acceleration_153 = cos_elbow_pitch * acceleration_150 - sin_elbow_pitch * acceleration_152
    acceleration_154 = sin_wrist_pitch * acceleration_142 + cos_wrist_pitch * acceleration_139
    acceleration_155 = (
        cos_wrist_pitch * acceleration_138 + sin_wrist_pitch * acceleration_129 - v_wrist_pitch_hat
        * acceleration_154
    )
    acceleration_156 = v_wrist_pitch_hat - acceleration_137
    acceleration_157 = acceleration_154 * acceleration_156
    acceleration_158 = acceleration_155 - acceleration_157
    acceleration_159 = cos_wrist_pitch * acceleration_142 - sin_wrist_pitch * acceleration_139
    acceleration_160 = acceleration_156 * acceleration_159
    acceleration_161 = (
        cos_wrist_pitch * acceleration_129 - sin_wrist_pitch * acceleration_138 - v_wrist_pitch_hat
        * acceleration_159
    )
    acceleration_162 = acceleration_160 - acceleration_161
    acceleration_163 = acceleration_154 * acceleration_159
    acceleration_164 = acceleration_144 - acceleration_163
    acceleration_159_squared = acceleration_159 * acceleration_159
    acceleration_156_squared = acceleration_156 * acceleration_156
    acceleration_165 = acceleration_159_squared + acceleration_156_squared
    acceleration_154_squared = acceleration_154 * acceleration_154
    acceleration_166 = acceleration_159_squared + acceleration_154_squared
    acceleration_167 = cos_elbow_pitch * acceleration_152 + sin_elbow_pitch * acceleration_150
    acceleration_168 = cos_forearm_roll * acceleration_136 - sin_forearm_roll * acceleration_167
    acceleration_169 = acceleration_140 + acceleration_138
    acceleration_170 = acceleration_168 - 0.39 * acceleration_169
    acceleration_171 = (
        acceleration_7 * acceleration_154 - acceleration_8 * acceleration_159 + cos_hand_roll * acceleration_156
    )
    acceleration_172 = (
        0.09983341664682815 * acceleration_159 + 0.9950041652780258 * acceleration_154 + v_hand_roll_hat
    )
    acceleration_173 = acceleration_171 * acceleration_172
    acceleration_174 = (
        acceleration_6 * acceleration_155 + acceleration_9 * acceleration_161 + sin_hand_roll * acceleration_144
        + v_hand_roll_hat * acceleration_171
    )
    acceleration_175 = acceleration_173 + acceleration_174
    acceleration_176 = (
        acceleration_6 * acceleration_159 - acceleration_9 * acceleration_154 + sin_hand_roll * acceleration_156
    )
    acceleration_177 = acceleration_172 * acceleration_176
    acceleration_178 = (
        cos_hand_roll * acceleration_144 - acceleration_8 * acceleration_155 - acceleration_7 * acceleration_161
        - v_hand_roll_hat * acceleration_176
    )
    acceleration_179 = acceleration_177 - acceleration_178
    acceleration_180 = acceleration_171 * acceleration_176
    acceleration_181 = 0.09983341664682815 * acceleration_155 - 0.9950041652780258 * acceleration_161
    acceleration_182 = acceleration_180 + acceleration_181
    acceleration_176_squared = acceleration_176 * acceleration_176
    acceleration_172_squared = acceleration_172 * acceleration_172
    acceleration_183 = acceleration_176_squared + acceleration_172_squared
    acceleration_171_squared = acceleration_171 * acceleration_171
    acceleration_184 = acceleration_176_squared + acceleration_171_squared
    acceleration_185 = cos_forearm_roll * acceleration_167 + sin_forearm_roll * acceleration_136
    acceleration_186 = acceleration_143 + acceleration_144
    acceleration_187 = acceleration_185 + 0.39 * acceleration_186
    acceleration_188 = acceleration_153 - 0.39 * acceleration_149
    acceleration_189 = cos_wrist_pitch * acceleration_187 - sin_wrist_pitch * acceleration_188
    acceleration_190 = acceleration_154_squared + acceleration_156_squared
    acceleration_191 = acceleration_163 + acceleration_144
    acceleration_192 = (
        acceleration_189 - 0.043541584522179204 * acceleration_190 - 0.00436873060511378 * acceleration_191
    )
    acceleration_193 = sin_wrist_pitch * acceleration_187 + cos_wrist_pitch * acceleration_188
    acceleration_194 = (
        0.043541584522179204 * acceleration_164 - 0.00436873060511378 * acceleration_165 - acceleration_193
    )
    acceleration_195 = 0.09983341664682815 * acceleration_192 - 0.9950041652780258 * acceleration_194
    acceleration_196 = (
        0.0010488 * acceleration_175 - 0.00028 * acceleration_179 + 0.0002259499347204054 * acceleration_182
        + 0.0003027650871698192 * (acceleration_183 - acceleration_184) + 0.001062741699796952
        * acceleration_195
    )
    acceleration_197 = acceleration_180 - acceleration_181
    acceleration_198 = acceleration_171_squared + acceleration_172_squared
    acceleration_199 = (
        0.0003027650871698192 * acceleration_197 - 0.0009718 * acceleration_179 + 0.00028 * acceleration_175
        - 0.0002259499347204054 * (acceleration_184 - acceleration_198) + 0.00046274169979695207
        * acceleration_195
    )
    acceleration_200 = (
        acceleration_170 + 0.043541584522179204 * acceleration_162 + 0.00436873060511378 * acceleration_158
    )
    acceleration_201 = (
        0.0009718 * acceleration_182 - 0.0010488 * acceleration_197 - 0.0002259499347204054 * (acceleration_173
        - acceleration_174) - 0.0003027650871698192 * (acceleration_177 + acceleration_178) - 0.00028
        * (acceleration_198 - acceleration_183) - 0.00046274169979695207 * (cos_hand_roll * acceleration_200
        - acceleration_8 * acceleration_192 - acceleration_7 * acceleration_194) - 0.001062741699796952
        * (acceleration_6 * acceleration_192 + acceleration_9 * acceleration_194 + sin_hand_roll
        * acceleration_200)
    )
    acceleration_202 = 0.001062741699796952 * acceleration_197 + 0.00046274169979695207 * acceleration_198
    acceleration_203 = 0.00046274169979695207 * acceleration_182 + 0.001062741699796952 * acceleration_183
    acceleration_204 = sin_hand_roll * acceleration_202 - cos_hand_roll * acceleration_203
    acceleration_205 = (
        0.04187779227084341 * acceleration_158 - 0.012821687277795328 * acceleration_162 + 8.3e-05
        * acceleration_164 - 0.00074 * (acceleration_165 - acceleration_166) - 0.27339050816391913
        * acceleration_170 + acceleration_6 * acceleration_196 - acceleration_8 * acceleration_199
        + 0.09983341664682815 * acceleration_201 + 0.00436873060511378 * acceleration_204
    )
    acceleration_206 = (
        0.00074 * acceleration_191 - 8.3e-05 * (acceleration_166 - acceleration_190) - 0.006233836391918195
        * acceleration_162 + 0.012821687277795328 * acceleration_158 - 0.08557967683091304 * acceleration_170
        + acceleration_9 * acceleration_196 - acceleration_7 * acceleration_199 - 0.9950041652780258
        * acceleration_201 - 0.043541584522179204 * acceleration_204
    )
    acceleration_207 = (
        0.08557967683091304 * acceleration_162 - 0.27339050816391913 * acceleration_158 + acceleration_204
    )
    acceleration_208 = (
        0.0063725 * acceleration_141 + 0.000144 * acceleration_145 + 0.000482 * acceleration_147 + 0.016055
        * (acceleration_148 - acceleration_149) + 0.0525 * acceleration_153 + cos_wrist_pitch
        * acceleration_205 - sin_wrist_pitch * acceleration_206 - 0.39 * acceleration_207
    )
    acceleration_209 = acceleration_129 - acceleration_146
    acceleration_210 = acceleration_137_squared + acceleration_139_squared
    acceleration_211 = 0.001062741699796952 * acceleration_175 - 0.00046274169979695207 * acceleration_179
    acceleration_212 = (
        acceleration_9 * acceleration_202 + acceleration_7 * acceleration_203 - 0.9950041652780258
        * acceleration_211
    )
    acceleration_213 = (
        acceleration_6 * acceleration_202 + acceleration_8 * acceleration_203 + 0.09983341664682815
        * acceleration_211
    )
    acceleration_214 = (
        0.006233836391918195 * acceleration_164 + 0.04187779227084341 * acceleration_191 + 8.3e-05
        * (acceleration_157 + acceleration_155) + 0.00074 * (acceleration_160 + acceleration_161)
        - 0.012821687277795328 * (acceleration_190 - acceleration_165) - 0.08557967683091304 * acceleration_193
        + 0.27339050816391913 * acceleration_189 + sin_hand_roll * acceleration_196 + cos_hand_roll
        * acceleration_199 + 0.043541584522179204 * acceleration_212 - 0.00436873060511378 * acceleration_213
    )
    acceleration_215 = (
        acceleration_213 - 0.08557967683091304 * acceleration_190 + 0.27339050816391913 * acceleration_191
    )
    acceleration_216 = (
        0.08557967683091304 * acceleration_164 + 0.27339050816391913 * acceleration_165 + acceleration_212
    )
    acceleration_217 = cos_wrist_pitch * acceleration_215 - sin_wrist_pitch * acceleration_216
    acceleration_218 = (
        0.016055 * acceleration_209 - 0.0020022 * acceleration_145 - 0.000144 * acceleration_141 + 0.000482
        * (acceleration_149 - acceleration_210) - 0.0022 * acceleration_153 + acceleration_214 + 0.39
        * acceleration_217
    )
    acceleration_219 = (
        0.73793 * acceleration_126 - 0.00107 * acceleration_130 - 0.000139 * acceleration_132 + 0.0102
        * (acceleration_133 - acceleration_134) - 2.181 * acceleration_136 + cos_forearm_roll
        * acceleration_208 - sin_forearm_roll * acceleration_218
    )
    acceleration_220 = acceleration_131 + acceleration_116
    acceleration_221 = acceleration_122_squared + acceleration_123_squared
    acceleration_222 = (
        0.000144 * (acceleration_210 - acceleration_148) - 0.0020022 * acceleration_147 - 0.0063725
        * acceleration_209 - 0.000482 * acceleration_169 - 0.016055 * acceleration_186 + 0.0022
        * acceleration_168 - 0.0525 * acceleration_185 - sin_wrist_pitch * acceleration_205 - cos_wrist_pitch
        * acceleration_206
    )
    acceleration_223 = (
        0.0102 * acceleration_220 - 0.0030261 * acceleration_130 + 0.00107 * acceleration_126 + 0.000139
        * (acceleration_134 - acceleration_221) - 0.0087 * acceleration_136 + acceleration_222
    )
    acceleration_224 = 0.0525 * acceleration_209 - 0.0022 * acceleration_210 + acceleration_217
    acceleration_225 = acceleration_207 - 0.0022 * acceleration_147 - 0.0525 * acceleration_148
    acceleration_226 = (
        0.0159 * acceleration_113 + 7.2e-05 * acceleration_117 - 0.003468 * acceleration_119 - 0.00471
        * (acceleration_120 - acceleration_121) + 0.05886 * cos_shoulder_pitch + cos_elbow_pitch
        * acceleration_219 - sin_elbow_pitch * acceleration_223 + 0.41 * (2.181 * acceleration_126 - 0.0087
        * acceleration_130 - sin_forearm_roll * acceleration_224 - cos_forearm_roll * acceleration_225)
    )
    acceleration_227 = acceleration_118 + acceleration_107
    acceleration_228 = acceleration_109_squared + acceleration_110_squared
    acceleration_229 = (
        0.0030261 * acceleration_132 - 0.73793 * acceleration_220 + 0.000139 * (acceleration_124
        - acceleration_125) - 0.0102 * (acceleration_128 - acceleration_129) - 0.00107 * (acceleration_221
        - acceleration_133) - 0.0087 * acceleration_153 - 2.181 * acceleration_167 - sin_forearm_roll
        * acceleration_208 - cos_forearm_roll * acceleration_218
    )
    acceleration_230 = (
        0.003468 * (acceleration_121 - acceleration_228) - 0.00471 * acceleration_227 - 0.0035496
        * acceleration_117 - 7.2e-05 * acceleration_113 - 0.121644 * cos_shoulder_pitch + 0.41
        * (cos_elbow_pitch * (2.181 * acceleration_220 + 0.0087 * acceleration_221 + cos_forearm_roll
        * acceleration_224 - sin_forearm_roll * acceleration_225) - sin_elbow_pitch * (0.0022
        * acceleration_145 - 0.0087 * acceleration_132 - 2.181 * acceleration_133 + 0.0525 * acceleration_141
        - sin_wrist_pitch * acceleration_215 - cos_wrist_pitch * acceleration_216)) - acceleration_229
    )
    acceleration_231 = acceleration_104_squared + v_shoulder_pitch_hat_squared
    acceleration_232 = (
        0.0035496 * acceleration_119 - 0.0159 * acceleration_227 + 0.003468 * acceleration_135 + 0.00471
        * acceleration_151 + 7.2e-05 * (acceleration_228 - acceleration_120) + 0.0124 * acceleration_4 + 0.006
        * acceleration_5 + sin_elbow_pitch * acceleration_219 + cos_elbow_pitch * acceleration_223
    )
    r1 = (
        inputs.w_shoulder_yaw - F_hat_on_shoulder_yaw + sin_shoulder_pitch * (0.000102 * acceleration_107
        - 0.01112 * (acceleration_103 - acceleration_105) - 3.57694 * acceleration_106 + 0.000118
        * acceleration_108 + cos_arm_roll * acceleration_226 - sin_arm_roll * acceleration_230)
        + cos_shoulder_pitch * (0.0090082 * acceleration_107 - 0.01112 * acceleration_108 - 0.000102
        * acceleration_106 - 0.000118 * (acceleration_105 - acceleration_231) - acceleration_232)
    )
    one_over_D1 = (
        _quotient(1.0, 0.0239368 + acceleration_58 + cos_shoulder_pitch * (cos_shoulder_pitch * (acceleration_68
        - acceleration_58) - 2.0 * sin_shoulder_pitch * (acceleration_75 - 5.1e-05 - acceleration_70))
        + acceleration_60 - acceleration_67)
    )
    L21 = M21 * one_over_D1
    L31 = M31 * one_over_D1
    acceleration_233 = acceleration_79 * one_over_D1
    L51 = M51 * one_over_D1
    L61 = M61 * one_over_D1
    L71 = M71 * one_over_D1
    one_over_D2 = _quotient(1.0, acceleration_68 + acceleration_58 - M21 * L21)
    acceleration_234 = acceleration_76 + M31 * L21
    acceleration_235 = one_over_D2 * acceleration_234
    LD42 = sin_arm_roll * acceleration_77 - cos_arm_roll * acceleration_78 + acceleration_79 * L21
    L42 = one_over_D2 * LD42
    LD52 = sin_arm_roll * acceleration_81 - cos_arm_roll * acceleration_82 - M51 * L21
    L52 = one_over_D2 * LD52
    LD62 = sin_arm_roll * acceleration_86 + cos_arm_roll * acceleration_88 - M61 * L21
    L62 = one_over_D2 * LD62
    LD72 = sin_arm_roll * acceleration_99 + cos_arm_roll * acceleration_101 - M71 * L21
    L72 = one_over_D2 * LD72
    one_over_D3 = _quotient(1.0, M33 - M31 * L31 - acceleration_234 * acceleration_235)
    LD43 = acceleration_79 * L31 - acceleration_73 + acceleration_235 * LD42
    L43 = one_over_D3 * LD43
    LD53 = M53 - M51 * L31 + acceleration_235 * LD52
    L53 = one_over_D3 * LD53
    LD63 = M63 - M61 * L31 + acceleration_235 * LD62
    L63 = one_over_D3 * LD63
    LD73 = M73 - M71 * L31 + acceleration_235 * LD72
    L73 = one_over_D3 * LD73
    one_over_D4 = _quotient(1.0, M44 - acceleration_79 * acceleration_233 - LD42 * L42 - LD43 * L43)
    LD54 = M54 + M51 * acceleration_233 - L42 * LD52 - L43 * LD53
    L54 = one_over_D4 * LD54
    LD64 = M61 * acceleration_233 - acceleration_87 - L42 * LD62 - L43 * LD63
    L64 = one_over_D4 * LD64
    LD74 = M71 * acceleration_233 - acceleration_100 - L42 * LD72 - L43 * LD73
    L74 = one_over_D4 * LD74
    one_over_D5 = _quotient(1.0, M55 - M51 * L51 - LD52 * L52 - LD53 * L53 - LD54 * L54)
    LD65 = M65 - M61 * L51 - L52 * LD62 - L53 * LD63 - L54 * LD64
    L65 = one_over_D5 * LD65
    acceleration_236 = acceleration_98 + M71 * L51 + L52 * LD72 + L53 * LD73 + L54 * LD74
    acceleration_237 = one_over_D5 * acceleration_236
    one_over_D6 = _quotient(1.0, M66 - M61 * L61 - LD62 * L62 - LD63 * L63 - LD64 * L64 - LD65 * L65)
    LD76 = M76 - M71 * L61 - L62 * LD72 - L63 * LD73 - L64 * LD74 + L65 * acceleration_236
    L76 = one_over_D6 * LD76
    y2 = (
        inputs.w_shoulder_pitch - F_hat_on_shoulder_pitch - sin_arm_roll * acceleration_226 + 1.7839659
        * acceleration_108 + 5.1e-05 * (acceleration_231 - acceleration_103) + 47.13705 * sin_shoulder_pitch
        + 0.04022100000000001 * cos_shoulder_pitch - cos_arm_roll * acceleration_230 - r1 * L21
    )
    y3 = inputs.w_arm_roll - F_hat_on_arm_roll - acceleration_232 - r1 * L31 + acceleration_235 * y2
    y4 = (
        inputs.w_elbow_pitch - F_hat_on_elbow_pitch - acceleration_229 + r1 * acceleration_233 - L42 * y2 - L43
        * y3
    )
    y5 = (
        inputs.w_forearm_roll - F_hat_on_forearm_roll - acceleration_222 - r1 * L51 - L52 * y2 - L53 * y3 - L54
        * y4
    )
    y6 = (
        inputs.w_wrist_pitch - F_hat_on_wrist_pitch - acceleration_214 - r1 * L61 - L62 * y2 - L63 * y3 - L64
        * y4 - L65 * y5
    )
    a7 = (
        _quotient(1.0, 0.0020206 - M71 * L71 - LD72 * L72 - LD73 * L73 - LD74 * L74 - acceleration_236
        * acceleration_237 - LD76 * L76) * (inputs.w_hand_roll - F_hat_on_hand_roll - acceleration_201 - r1
        * L71 - L72 * y2 - L73 * y3 - L74 * y4 + acceleration_237 * y5 - L76 * y6)
    )
    a6 = one_over_D6 * y6 - L76 * a7
    a5 = one_over_D5 * y5 - L65 * a6 + acceleration_237 * a7
    a4 = one_over_D4 * y4 - L54 * a5 - L64 * a6 - L74 * a7
    a3 = one_over_D3 * y3 - L43 * a4 - L53 * a5 - L63 * a6 - L73 * a7
    a2 = one_over_D2 * y2 + acceleration_235 * a3 - L42 * a4 - L52 * a5 - L62 * a6 - L72 * a7
    v_shoulder_yaw_dot_hat = (
        r1 * one_over_D1 - L21 * a2 - L31 * a3 + acceleration_233 * a4 - L51 * a5 - L61 * a6 - L71 * a7
    )  # rad/s^2

    # states one sample later (explicit Euler)
    z_v_shoulder_yaw_next = (
        state.z_v_shoulder_yaw + parameters.sample_time * (v_shoulder_yaw_dot_hat
        - parameters.K_v_v_shoulder_yaw * v_shoulder_yaw_hat)
    )
    z_v_shoulder_pitch_next = (
        state.z_v_shoulder_pitch + parameters.sample_time * (a2 - parameters.K_v_v_shoulder_pitch
        * v_shoulder_pitch_hat)
    )
    z_v_arm_roll_next = (
        state.z_v_arm_roll + parameters.sample_time * (a3 - parameters.K_v_v_arm_roll * v_arm_roll_hat)
    )
    z_v_elbow_pitch_next = (
        state.z_v_elbow_pitch + parameters.sample_time * (a4 - parameters.K_v_v_elbow_pitch * v_elbow_pitch_hat)
    )
    z_v_forearm_roll_next = (
        state.z_v_forearm_roll + parameters.sample_time * (a5 - parameters.K_v_v_forearm_roll
        * v_forearm_roll_hat)
    )
    z_v_wrist_pitch_next = (
        state.z_v_wrist_pitch + parameters.sample_time * (a6 - parameters.K_v_v_wrist_pitch * v_wrist_pitch_hat)
    )
    z_v_hand_roll_next = (
        state.z_v_hand_roll + parameters.sample_time * (a7 - parameters.K_v_v_hand_roll * v_hand_roll_hat)
    )
    z_shoulder_yaw_next = state.z_shoulder_yaw - parameters.h_K_2_shoulder_yaw * v_shoulder_yaw_dot_hat
    z_shoulder_pitch_next = state.z_shoulder_pitch - parameters.h_K_2_shoulder_pitch * a2
    z_arm_roll_next = state.z_arm_roll - parameters.h_K_2_arm_roll * a3
    z_elbow_pitch_next = state.z_elbow_pitch - parameters.h_K_2_elbow_pitch * a4
    z_forearm_roll_next = state.z_forearm_roll - parameters.h_K_2_forearm_roll * a5
    z_wrist_pitch_next = state.z_wrist_pitch - parameters.h_K_2_wrist_pitch * a6
    z_hand_roll_next = state.z_hand_roll - parameters.h_K_2_hand_roll * a7

    # this sum is too large or NaN if a next state is, or an input or output on which no next state depends
    check = (
        z_v_shoulder_yaw_next + z_v_shoulder_pitch_next + z_v_arm_roll_next + z_v_elbow_pitch_next
        + z_v_forearm_roll_next + z_v_wrist_pitch_next + z_v_hand_roll_next + z_shoulder_yaw_next
        + z_shoulder_pitch_next + z_arm_roll_next + z_elbow_pitch_next + z_forearm_roll_next
        + z_wrist_pitch_next + z_hand_roll_next
    )
    if state.mode != RUNNING or not abs(check) <= LARGEST:
        given = (
        abs(inputs.shoulder_yaw) + abs(inputs.shoulder_pitch) + abs(inputs.arm_roll) + abs(inputs.elbow_pitch)
        + abs(inputs.forearm_roll) + abs(inputs.wrist_pitch) + abs(inputs.hand_roll)
        + abs(inputs.w_shoulder_yaw) + abs(inputs.w_shoulder_pitch) + abs(inputs.w_arm_roll)
        + abs(inputs.w_elbow_pitch) + abs(inputs.w_forearm_roll) + abs(inputs.w_wrist_pitch)
        + abs(inputs.w_hand_roll)
    )
        _handle_fault(state, parameters, inputs, outputs, abs(given) <= LARGEST)
        return outputs
    outputs.fault = 0
    outputs.v_shoulder_yaw_hat = v_shoulder_yaw_hat
    outputs.v_shoulder_pitch_hat = v_shoulder_pitch_hat
    outputs.v_arm_roll_hat = v_arm_roll_hat
    outputs.v_elbow_pitch_hat = v_elbow_pitch_hat
    outputs.v_forearm_roll_hat = v_forearm_roll_hat
    outputs.v_wrist_pitch_hat = v_wrist_pitch_hat
    outputs.v_hand_roll_hat = v_hand_roll_hat
    outputs.tracked_shoulder_yaw = tracked_shoulder_yaw
    outputs.tracked_shoulder_pitch = tracked_shoulder_pitch
    outputs.tracked_arm_roll = tracked_arm_roll
    outputs.tracked_elbow_pitch = tracked_elbow_pitch
    outputs.tracked_forearm_roll = tracked_forearm_roll
    outputs.tracked_wrist_pitch = tracked_wrist_pitch
    outputs.tracked_hand_roll = tracked_hand_roll
    outputs.F_hat_on_shoulder_yaw = F_hat_on_shoulder_yaw
    outputs.F_hat_on_shoulder_pitch = F_hat_on_shoulder_pitch
    outputs.F_hat_on_arm_roll = F_hat_on_arm_roll
    outputs.F_hat_on_elbow_pitch = F_hat_on_elbow_pitch
    outputs.F_hat_on_forearm_roll = F_hat_on_forearm_roll
    outputs.F_hat_on_wrist_pitch = F_hat_on_wrist_pitch
    outputs.F_hat_on_hand_roll = F_hat_on_hand_roll
    state.z_v_shoulder_yaw = z_v_shoulder_yaw_next
    state.z_v_shoulder_pitch = z_v_shoulder_pitch_next
    state.z_v_arm_roll = z_v_arm_roll_next
    state.z_v_elbow_pitch = z_v_elbow_pitch_next
    state.z_v_forearm_roll = z_v_forearm_roll_next
    state.z_v_wrist_pitch = z_v_wrist_pitch_next
    state.z_v_hand_roll = z_v_hand_roll_next
    state.z_shoulder_yaw = z_shoulder_yaw_next
    state.z_shoulder_pitch = z_shoulder_pitch_next
    state.z_arm_roll = z_arm_roll_next
    state.z_elbow_pitch = z_elbow_pitch_next
    state.z_forearm_roll = z_forearm_roll_next
    state.z_wrist_pitch = z_wrist_pitch_next
    state.z_hand_roll = z_hand_roll_next
    return outputs

"""seven_joint_arm: friction observer GTO, velocity estimated.

Made by stiction 0.1.0 from seven_joint_arm.yaml
sha256 52b7fc24362cad8069841d41e04e6920488a5d21d83ed6b1e517ee0008775850
with: stiction generate seven_joint_arm.yaml

The twin of seven_joint_arm.c: the same operations in the same order on doubles, so the same bits. Do not edit.
"""

import math
from dataclasses import dataclass

__all__ = ["Inputs", "Outputs", "Parameters", "State", "init", "step"]

SPEC_SHA256 = "52b7fc24362cad8069841d41e04e6920488a5d21d83ed6b1e517ee0008775850"


@dataclass(slots=True)
class Parameters:
    """Constants of the model and gains, with the spec's values."""

    viscous_shoulder_yaw_b: float = 0.9  # N*m*s/rad: model parameter
    viscous_shoulder_pitch_b: float = 0.9  # N*m*s/rad: model parameter
    viscous_arm_roll_b: float = 0.6  # N*m*s/rad: model parameter
    viscous_elbow_pitch_b: float = 0.5  # N*m*s/rad: model parameter
    viscous_forearm_roll_b: float = 0.3  # N*m*s/rad: model parameter
    viscous_wrist_pitch_b: float = 0.2  # N*m*s/rad: model parameter
    viscous_hand_roll_b: float = 0.1  # N*m*s/rad: model parameter
    K_1_shoulder_yaw: float = 0.0  # N*m/rad: observer gain
    K_1_shoulder_pitch: float = 0.0  # N*m/rad: observer gain
    K_1_arm_roll: float = 0.0  # N*m/rad: observer gain
    K_1_elbow_pitch: float = 0.0  # N*m/rad: observer gain
    K_1_forearm_roll: float = 0.0  # N*m/rad: observer gain
    K_1_wrist_pitch: float = 0.0  # N*m/rad: observer gain
    K_1_hand_roll: float = 0.0  # N*m/rad: observer gain
    K_2_shoulder_yaw: float = -40.0  # N*m*s/rad: observer gain
    K_2_shoulder_pitch: float = -40.0  # N*m*s/rad: observer gain
    K_2_arm_roll: float = -16.0  # N*m*s/rad: observer gain
    K_2_elbow_pitch: float = -16.0  # N*m*s/rad: observer gain
    K_2_forearm_roll: float = -6.0  # N*m*s/rad: observer gain
    K_2_wrist_pitch: float = -3.0  # N*m*s/rad: observer gain
    K_2_hand_roll: float = -0.8  # N*m*s/rad: observer gain
    K_v_v_shoulder_yaw: float = 200.0  # 1/s: observer gain
    K_v_v_shoulder_pitch: float = 200.0  # 1/s: observer gain
    K_v_v_arm_roll: float = 200.0  # 1/s: observer gain
    K_v_v_elbow_pitch: float = 200.0  # 1/s: observer gain
    K_v_v_forearm_roll: float = 200.0  # 1/s: observer gain
    K_v_v_wrist_pitch: float = 200.0  # 1/s: observer gain
    K_v_v_hand_roll: float = 200.0  # 1/s: observer gain
    sample_time: float = 0.0005  # s: sample time


@dataclass(slots=True)
class State:
    """What the observer remembers from sample to sample."""

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


@dataclass(slots=True)
class Inputs:
    """What is measured and commanded at a sample."""

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
    """What is estimated."""

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


def init(parameters: Parameters, inputs: Inputs) -> State:
    """The state from the first measurement."""
    # states at the first sample
    return State(
        z_v_shoulder_yaw=-(parameters.K_v_v_shoulder_yaw * inputs.shoulder_yaw),
        z_v_shoulder_pitch=-(parameters.K_v_v_shoulder_pitch * inputs.shoulder_pitch),
        z_v_arm_roll=-(parameters.K_v_v_arm_roll * inputs.arm_roll),
        z_v_elbow_pitch=-(parameters.K_v_v_elbow_pitch * inputs.elbow_pitch),
        z_v_forearm_roll=-(parameters.K_v_v_forearm_roll * inputs.forearm_roll),
        z_v_wrist_pitch=-(parameters.K_v_v_wrist_pitch * inputs.wrist_pitch),
        z_v_hand_roll=-(parameters.K_v_v_hand_roll * inputs.hand_roll),
        z_shoulder_yaw=-(parameters.K_1_shoulder_yaw * inputs.shoulder_yaw),
        z_shoulder_pitch=-(parameters.K_1_shoulder_pitch * inputs.shoulder_pitch),
        z_arm_roll=-(parameters.K_1_arm_roll * inputs.arm_roll),
        z_elbow_pitch=-(parameters.K_1_elbow_pitch * inputs.elbow_pitch),
        z_forearm_roll=-(parameters.K_1_forearm_roll * inputs.forearm_roll),
        z_wrist_pitch=-(parameters.K_1_wrist_pitch * inputs.wrist_pitch),
        z_hand_roll=-(parameters.K_1_hand_roll * inputs.hand_roll),
    )


def step(state: State, parameters: Parameters, inputs: Inputs) -> Outputs:
    """One sample: estimates from the state and this measurement; ``state`` becomes that of the next sample."""
    # velocity estimate, (4.25)
    v_shoulder_yaw_hat = state.z_v_shoulder_yaw + parameters.K_v_v_shoulder_yaw * inputs.shoulder_yaw  # rad/s
    v_shoulder_pitch_hat = state.z_v_shoulder_pitch + parameters.K_v_v_shoulder_pitch * inputs.shoulder_pitch  # rad/s
    v_arm_roll_hat = state.z_v_arm_roll + parameters.K_v_v_arm_roll * inputs.arm_roll  # rad/s
    v_elbow_pitch_hat = state.z_v_elbow_pitch + parameters.K_v_v_elbow_pitch * inputs.elbow_pitch  # rad/s
    v_forearm_roll_hat = state.z_v_forearm_roll + parameters.K_v_v_forearm_roll * inputs.forearm_roll  # rad/s
    v_wrist_pitch_hat = state.z_v_wrist_pitch + parameters.K_v_v_wrist_pitch * inputs.wrist_pitch  # rad/s
    v_hand_roll_hat = state.z_v_hand_roll + parameters.K_v_v_hand_roll * inputs.hand_roll  # rad/s

    # tracked friction, (4.16)
    tracked_shoulder_yaw = state.z_shoulder_yaw + parameters.K_1_shoulder_yaw * inputs.shoulder_yaw + parameters.K_2_shoulder_yaw * v_shoulder_yaw_hat  # N*m
    tracked_shoulder_pitch = state.z_shoulder_pitch + parameters.K_1_shoulder_pitch * inputs.shoulder_pitch + parameters.K_2_shoulder_pitch * v_shoulder_pitch_hat  # N*m
    tracked_arm_roll = state.z_arm_roll + parameters.K_1_arm_roll * inputs.arm_roll + parameters.K_2_arm_roll * v_arm_roll_hat  # N*m
    tracked_elbow_pitch = state.z_elbow_pitch + parameters.K_1_elbow_pitch * inputs.elbow_pitch + parameters.K_2_elbow_pitch * v_elbow_pitch_hat  # N*m
    tracked_forearm_roll = state.z_forearm_roll + parameters.K_1_forearm_roll * inputs.forearm_roll + parameters.K_2_forearm_roll * v_forearm_roll_hat  # N*m
    tracked_wrist_pitch = state.z_wrist_pitch + parameters.K_1_wrist_pitch * inputs.wrist_pitch + parameters.K_2_wrist_pitch * v_wrist_pitch_hat  # N*m
    tracked_hand_roll = state.z_hand_roll + parameters.K_1_hand_roll * inputs.hand_roll + parameters.K_2_hand_roll * v_hand_roll_hat  # N*m

    # slip velocity, U' v, (4.5)
    slip_shoulder_yaw = v_shoulder_yaw_hat  # rad/s
    slip_shoulder_pitch = v_shoulder_pitch_hat  # rad/s
    slip_arm_roll = v_arm_roll_hat  # rad/s
    slip_elbow_pitch = v_elbow_pitch_hat  # rad/s
    slip_forearm_roll = v_forearm_roll_hat  # rad/s
    slip_wrist_pitch = v_wrist_pitch_hat  # rad/s
    slip_hand_roll = v_hand_roll_hat  # rad/s

    # known friction, declared effects
    known_shoulder_yaw = slip_shoulder_yaw * parameters.viscous_shoulder_yaw_b  # N*m
    known_shoulder_pitch = slip_shoulder_pitch * parameters.viscous_shoulder_pitch_b  # N*m
    known_arm_roll = slip_arm_roll * parameters.viscous_arm_roll_b  # N*m
    known_elbow_pitch = slip_elbow_pitch * parameters.viscous_elbow_pitch_b  # N*m
    known_forearm_roll = slip_forearm_roll * parameters.viscous_forearm_roll_b  # N*m
    known_wrist_pitch = slip_wrist_pitch * parameters.viscous_wrist_pitch_b  # N*m
    known_hand_roll = slip_hand_roll * parameters.viscous_hand_roll_b  # N*m

    # friction force, (4.16)
    F_hat_on_shoulder_yaw = known_shoulder_yaw + tracked_shoulder_yaw  # N*m
    F_hat_on_shoulder_pitch = known_shoulder_pitch + tracked_shoulder_pitch  # N*m
    F_hat_on_arm_roll = known_arm_roll + tracked_arm_roll  # N*m
    F_hat_on_elbow_pitch = known_elbow_pitch + tracked_elbow_pitch  # N*m
    F_hat_on_forearm_roll = known_forearm_roll + tracked_forearm_roll  # N*m
    F_hat_on_wrist_pitch = known_wrist_pitch + tracked_wrist_pitch  # N*m
    F_hat_on_hand_roll = known_hand_roll + tracked_hand_roll  # N*m

    # acceleration, (4.2)
    part_of_acceleration_1 = math.sin(inputs.shoulder_pitch)
    part_of_acceleration_2 = part_of_acceleration_1 * v_shoulder_yaw_hat
    part_of_acceleration_3 = part_of_acceleration_2 * v_shoulder_pitch_hat
    part_of_acceleration_4 = math.cos(inputs.shoulder_pitch)
    part_of_acceleration_5 = part_of_acceleration_4 * v_shoulder_yaw_hat
    part_of_acceleration_6 = part_of_acceleration_5 * v_shoulder_pitch_hat
    part_of_acceleration_7 = 0.0816141 * v_shoulder_pitch_hat - (0.00011800000000000001 * part_of_acceleration_2 + 0.01112 * part_of_acceleration_5)
    part_of_acceleration_8 = 0.01112 * v_shoulder_pitch_hat - (5.099999999999994e-05 * part_of_acceleration_2 + 0.0126441 * part_of_acceleration_5)
    part_of_acceleration_9 = math.cos(inputs.arm_roll)
    part_of_acceleration_10 = math.sin(inputs.arm_roll)
    part_of_acceleration_11 = part_of_acceleration_10 * part_of_acceleration_2 + part_of_acceleration_9 * v_shoulder_pitch_hat
    part_of_acceleration_12 = part_of_acceleration_11 * v_arm_roll_hat - part_of_acceleration_9 * part_of_acceleration_6
    part_of_acceleration_13 = part_of_acceleration_10 * v_shoulder_pitch_hat - part_of_acceleration_9 * part_of_acceleration_2
    part_of_acceleration_14 = part_of_acceleration_10 * part_of_acceleration_6 - part_of_acceleration_13 * v_arm_roll_hat
    part_of_acceleration_15 = 9.81 * part_of_acceleration_1
    part_of_acceleration_16 = -0.39 * part_of_acceleration_6
    part_of_acceleration_17 = -0.39 * v_shoulder_pitch_hat
    part_of_acceleration_18 = -0.39 * part_of_acceleration_2
    part_of_acceleration_19 = part_of_acceleration_9 * part_of_acceleration_17 + part_of_acceleration_10 * part_of_acceleration_18
    part_of_acceleration_20 = part_of_acceleration_10 * part_of_acceleration_15 - part_of_acceleration_9 * part_of_acceleration_16 + part_of_acceleration_19 * v_arm_roll_hat
    part_of_acceleration_21 = part_of_acceleration_5 + v_arm_roll_hat
    part_of_acceleration_22 = part_of_acceleration_10 * part_of_acceleration_17 - part_of_acceleration_9 * part_of_acceleration_18
    part_of_acceleration_23 = 0.001368 * part_of_acceleration_13 + 0.005310000000000001 * part_of_acceleration_11 + 0.0118396 * part_of_acceleration_21 + (0.012400000000000001 * part_of_acceleration_22 + 0.093 * part_of_acceleration_19)
    part_of_acceleration_24 = -7.200000000000007e-05 * part_of_acceleration_13 + 0.0342396 * part_of_acceleration_11 + 0.005310000000000001 * part_of_acceleration_21 - -0.21700000000000003 * part_of_acceleration_19
    part_of_acceleration_25 = 0.012400000000000001 * part_of_acceleration_11 - 0.093 * part_of_acceleration_13
    part_of_acceleration_26 = math.cos(inputs.elbow_pitch)
    part_of_acceleration_27 = math.sin(inputs.elbow_pitch)
    part_of_acceleration_28 = part_of_acceleration_26 * part_of_acceleration_21 - part_of_acceleration_27 * part_of_acceleration_13
    part_of_acceleration_29 = part_of_acceleration_26 * part_of_acceleration_12 - part_of_acceleration_27 * part_of_acceleration_3 + part_of_acceleration_28 * v_elbow_pitch_hat
    part_of_acceleration_30 = part_of_acceleration_26 * part_of_acceleration_13 + part_of_acceleration_27 * part_of_acceleration_21
    part_of_acceleration_31 = part_of_acceleration_27 * part_of_acceleration_12 + part_of_acceleration_26 * part_of_acceleration_3 + part_of_acceleration_30 * v_elbow_pitch_hat
    part_of_acceleration_32 = part_of_acceleration_20 - 0.02 * part_of_acceleration_12
    part_of_acceleration_33 = 9.81 * part_of_acceleration_4
    part_of_acceleration_34 = part_of_acceleration_22 * v_arm_roll_hat - (part_of_acceleration_9 * part_of_acceleration_15 + part_of_acceleration_10 * part_of_acceleration_16)
    part_of_acceleration_35 = part_of_acceleration_34 + 0.02 * part_of_acceleration_14
    part_of_acceleration_36 = 0.02 * part_of_acceleration_11 - part_of_acceleration_19
    part_of_acceleration_37 = part_of_acceleration_26 * part_of_acceleration_36
    part_of_acceleration_38 = part_of_acceleration_26 * part_of_acceleration_33 - part_of_acceleration_27 * part_of_acceleration_35 - part_of_acceleration_37 * v_elbow_pitch_hat
    part_of_acceleration_39 = v_elbow_pitch_hat - part_of_acceleration_11
    part_of_acceleration_40 = part_of_acceleration_27 * part_of_acceleration_36
    part_of_acceleration_41 = -0.00013900000000000007 * part_of_acceleration_30 + -0.010199999999999999 * part_of_acceleration_28 + 0.0490261 * part_of_acceleration_39 - (-0.0087 * part_of_acceleration_40 + 0.29 * part_of_acceleration_37)
    part_of_acceleration_42 = part_of_acceleration_22 - 0.02 * part_of_acceleration_13
    part_of_acceleration_43 = 0.00107 * part_of_acceleration_30 + 0.010636099999999996 * part_of_acceleration_28 + -0.010199999999999999 * part_of_acceleration_39 + (0.087 * part_of_acceleration_37 + -0.0087 * part_of_acceleration_42)
    part_of_acceleration_44 = 2.9 * part_of_acceleration_42 + (-0.0087 * part_of_acceleration_28 - 0.29 * part_of_acceleration_30)
    part_of_acceleration_45 = 2.9 * part_of_acceleration_40 + (0.087 * part_of_acceleration_30 - -0.0087 * part_of_acceleration_39)
    part_of_acceleration_46 = math.cos(inputs.forearm_roll)
    part_of_acceleration_47 = math.sin(inputs.forearm_roll)
    part_of_acceleration_48 = part_of_acceleration_47 * part_of_acceleration_30 + part_of_acceleration_46 * part_of_acceleration_39
    part_of_acceleration_49 = part_of_acceleration_46 * part_of_acceleration_29 + part_of_acceleration_47 * part_of_acceleration_14 - part_of_acceleration_48 * v_forearm_roll_hat
    part_of_acceleration_50 = part_of_acceleration_46 * part_of_acceleration_30 - part_of_acceleration_47 * part_of_acceleration_39
    part_of_acceleration_51 = part_of_acceleration_46 * part_of_acceleration_14 - part_of_acceleration_47 * part_of_acceleration_29 - part_of_acceleration_50 * v_forearm_roll_hat
    part_of_acceleration_52 = part_of_acceleration_26 * part_of_acceleration_35 + part_of_acceleration_27 * part_of_acceleration_33 - part_of_acceleration_40 * v_elbow_pitch_hat
    part_of_acceleration_53 = part_of_acceleration_52 + 0.37 * part_of_acceleration_14
    part_of_acceleration_54 = 0.37 * part_of_acceleration_29 - part_of_acceleration_32
    part_of_acceleration_55 = part_of_acceleration_37 - 0.37 * part_of_acceleration_39
    part_of_acceleration_56 = 0.37 * part_of_acceleration_30 - part_of_acceleration_42
    part_of_acceleration_57 = part_of_acceleration_46 * part_of_acceleration_55 - part_of_acceleration_47 * part_of_acceleration_56
    part_of_acceleration_58 = part_of_acceleration_47 * part_of_acceleration_53 + part_of_acceleration_46 * part_of_acceleration_54 + part_of_acceleration_57 * v_forearm_roll_hat
    part_of_acceleration_59 = part_of_acceleration_28 + v_forearm_roll_hat
    part_of_acceleration_60 = part_of_acceleration_47 * part_of_acceleration_55 + part_of_acceleration_46 * part_of_acceleration_56
    part_of_acceleration_61 = 0.00033200000000000005 * part_of_acceleration_50 - 0.0035399999999999997 * part_of_acceleration_48 + 0.005882199999999999 * part_of_acceleration_59 - (0.0022 * part_of_acceleration_60 + 0.044000000000000004 * part_of_acceleration_57)
    part_of_acceleration_62 = -0.000144 * part_of_acceleration_50 - 0.0189222 * part_of_acceleration_48 + 0.0035399999999999997 * part_of_acceleration_59 + (-0.132 * part_of_acceleration_57 + 0.0022 * part_of_acceleration_40)
    part_of_acceleration_63 = 0.0022 * part_of_acceleration_48 + 0.044000000000000004 * part_of_acceleration_50 - 2.2 * part_of_acceleration_40
    part_of_acceleration_64 = 2.2 * part_of_acceleration_60 + (-0.132 * part_of_acceleration_50 - 0.0022 * part_of_acceleration_59)
    part_of_acceleration_65 = math.cos(inputs.wrist_pitch)
    part_of_acceleration_66 = math.sin(inputs.wrist_pitch)
    part_of_acceleration_67 = part_of_acceleration_66 * part_of_acceleration_50 + part_of_acceleration_65 * part_of_acceleration_59
    part_of_acceleration_68 = part_of_acceleration_65 * part_of_acceleration_49 + part_of_acceleration_66 * part_of_acceleration_31 - part_of_acceleration_67 * v_wrist_pitch_hat
    part_of_acceleration_69 = part_of_acceleration_65 * part_of_acceleration_50 - part_of_acceleration_66 * part_of_acceleration_59
    part_of_acceleration_70 = part_of_acceleration_65 * part_of_acceleration_31 - part_of_acceleration_66 * part_of_acceleration_49 - part_of_acceleration_69 * v_wrist_pitch_hat
    part_of_acceleration_71 = part_of_acceleration_46 * part_of_acceleration_53 - part_of_acceleration_47 * part_of_acceleration_54 - part_of_acceleration_60 * v_forearm_roll_hat
    part_of_acceleration_72 = part_of_acceleration_71 + 0.02 * part_of_acceleration_51
    part_of_acceleration_73 = part_of_acceleration_57 - 0.02 * part_of_acceleration_48
    part_of_acceleration_74 = part_of_acceleration_65 * part_of_acceleration_73 + part_of_acceleration_66 * part_of_acceleration_40
    part_of_acceleration_75 = part_of_acceleration_66 * part_of_acceleration_72 + part_of_acceleration_65 * part_of_acceleration_38 + part_of_acceleration_74 * v_wrist_pitch_hat
    part_of_acceleration_76 = part_of_acceleration_58 + 0.02 * part_of_acceleration_49
    part_of_acceleration_77 = part_of_acceleration_65 * part_of_acceleration_40 - part_of_acceleration_66 * part_of_acceleration_73
    part_of_acceleration_78 = part_of_acceleration_60 + 0.02 * part_of_acceleration_50
    part_of_acceleration_79 = 0.0034 * part_of_acceleration_67 + -0.068 * part_of_acceleration_69 - 1.7 * part_of_acceleration_78
    part_of_acceleration_80 = v_wrist_pitch_hat - part_of_acceleration_48
    part_of_acceleration_81 = 1.7 * part_of_acceleration_77 - (0.0085 * part_of_acceleration_69 - 0.0034 * part_of_acceleration_80)
    part_of_acceleration_82 = 8.300000000000001e-05 * part_of_acceleration_69 - 0.00074 * part_of_acceleration_67 + 0.0078268 * part_of_acceleration_80 + (0.0034 * part_of_acceleration_77 - -0.068 * part_of_acceleration_74)
    part_of_acceleration_83 = 0.000236 * part_of_acceleration_69 - 0.0038493000000000004 * part_of_acceleration_67 + 0.00074 * part_of_acceleration_80 + (0.0085 * part_of_acceleration_74 + 0.0034 * part_of_acceleration_78)
    part_of_acceleration_84 = math.cos(inputs.hand_roll)
    part_of_acceleration_85 = 0.9950041652780258 * part_of_acceleration_84
    part_of_acceleration_86 = 0.09983341664682815 * part_of_acceleration_84
    part_of_acceleration_87 = math.sin(inputs.hand_roll)
    part_of_acceleration_88 = 0.09983341664682815 * part_of_acceleration_87
    part_of_acceleration_89 = 0.9950041652780258 * part_of_acceleration_87
    part_of_acceleration_90 = part_of_acceleration_88 * part_of_acceleration_67 - part_of_acceleration_89 * part_of_acceleration_69 + part_of_acceleration_84 * part_of_acceleration_80
    part_of_acceleration_91 = part_of_acceleration_85 * part_of_acceleration_68 + part_of_acceleration_86 * part_of_acceleration_70 + part_of_acceleration_87 * part_of_acceleration_51 + part_of_acceleration_90 * v_hand_roll_hat
    part_of_acceleration_92 = part_of_acceleration_85 * part_of_acceleration_69 - part_of_acceleration_86 * part_of_acceleration_67 + part_of_acceleration_87 * part_of_acceleration_80
    part_of_acceleration_93 = part_of_acceleration_84 * part_of_acceleration_51 - (part_of_acceleration_89 * part_of_acceleration_68 + part_of_acceleration_88 * part_of_acceleration_70) - part_of_acceleration_92 * v_hand_roll_hat
    part_of_acceleration_94 = 0.09983341664682815 * part_of_acceleration_68 + -0.9950041652780258 * part_of_acceleration_70
    part_of_acceleration_95 = part_of_acceleration_65 * part_of_acceleration_72 - part_of_acceleration_66 * part_of_acceleration_38 + part_of_acceleration_77 * v_wrist_pitch_hat
    part_of_acceleration_96 = part_of_acceleration_95 - -0.06 * part_of_acceleration_51
    part_of_acceleration_97 = 0.05 * part_of_acceleration_51 - part_of_acceleration_75
    part_of_acceleration_98 = 0.09983341664682815 * part_of_acceleration_96 + -0.9950041652780258 * part_of_acceleration_97
    part_of_acceleration_99 = part_of_acceleration_76 + (0.05 * part_of_acceleration_70 - -0.06 * part_of_acceleration_68)
    part_of_acceleration_100 = part_of_acceleration_74 - -0.06 * part_of_acceleration_80
    part_of_acceleration_101 = part_of_acceleration_77 + 0.05 * part_of_acceleration_80
    part_of_acceleration_102 = 0.05 * part_of_acceleration_67 + -0.06 * part_of_acceleration_69 - part_of_acceleration_78
    part_of_acceleration_103 = part_of_acceleration_85 * part_of_acceleration_100 + part_of_acceleration_86 * part_of_acceleration_101 + part_of_acceleration_87 * part_of_acceleration_102
    part_of_acceleration_104 = part_of_acceleration_89 * part_of_acceleration_96 + part_of_acceleration_88 * part_of_acceleration_97 + part_of_acceleration_84 * part_of_acceleration_99 + part_of_acceleration_103 * v_hand_roll_hat
    part_of_acceleration_105 = 0.09983341664682815 * part_of_acceleration_69 - -0.9950041652780258 * part_of_acceleration_67 + v_hand_roll_hat
    part_of_acceleration_106 = part_of_acceleration_84 * part_of_acceleration_102 - (part_of_acceleration_89 * part_of_acceleration_100 + part_of_acceleration_88 * part_of_acceleration_101)
    part_of_acceleration_107 = 0.00019601428534987285 * part_of_acceleration_92 + -0.0002340142853498729 * part_of_acceleration_90 + 0.0020205999999999987 * part_of_acceleration_105 + (-0.0004627416997969522 * part_of_acceleration_106 - 0.0010627416997969527 * part_of_acceleration_103)
    part_of_acceleration_108 = 0.09983341664682815 * part_of_acceleration_100 + -0.9950041652780258 * part_of_acceleration_101
    part_of_acceleration_109 = 0.00028 * part_of_acceleration_92 + 0.0169318 * part_of_acceleration_90 + -0.0002340142853498729 * part_of_acceleration_105 + (0.12200000000000001 * part_of_acceleration_103 - -0.0004627416997969522 * part_of_acceleration_108)
    part_of_acceleration_110 = 1.4 * part_of_acceleration_108 - (-0.0004627416997969522 * part_of_acceleration_90 - 0.0010627416997969527 * part_of_acceleration_92)
    part_of_acceleration_111 = 1.4 * part_of_acceleration_106 - (0.12200000000000001 * part_of_acceleration_92 - -0.0004627416997969522 * part_of_acceleration_105)
    part_of_acceleration_112 = 0.0170088 * part_of_acceleration_91 + 0.0002799999999999998 * part_of_acceleration_93 + 0.00019601428534987285 * part_of_acceleration_94 + (0.0010627416997969527 * part_of_acceleration_98 + 0.12200000000000001 * part_of_acceleration_104) + (part_of_acceleration_90 * part_of_acceleration_107 - part_of_acceleration_105 * part_of_acceleration_109 + (part_of_acceleration_106 * part_of_acceleration_110 - part_of_acceleration_108 * part_of_acceleration_111))
    part_of_acceleration_113 = part_of_acceleration_85 * part_of_acceleration_96 + part_of_acceleration_86 * part_of_acceleration_97 - part_of_acceleration_87 * part_of_acceleration_99 + part_of_acceleration_106 * v_hand_roll_hat
    part_of_acceleration_114 = 0.0170088 * part_of_acceleration_92 + 0.0002799999999999998 * part_of_acceleration_90 + 0.00019601428534987285 * part_of_acceleration_105 + (0.0010627416997969527 * part_of_acceleration_108 - 0.12200000000000001 * part_of_acceleration_106)
    part_of_acceleration_115 = 1.4 * part_of_acceleration_103 - (0.0010627416997969527 * part_of_acceleration_105 - 0.12200000000000001 * part_of_acceleration_90)
    part_of_acceleration_116 = 0.00028 * part_of_acceleration_91 + 0.0169318 * part_of_acceleration_93 + -0.0002340142853498729 * part_of_acceleration_94 + (0.12200000000000001 * part_of_acceleration_113 - -0.0004627416997969522 * part_of_acceleration_98) + (part_of_acceleration_105 * part_of_acceleration_114 - part_of_acceleration_92 * part_of_acceleration_107 + (part_of_acceleration_108 * part_of_acceleration_115 - part_of_acceleration_103 * part_of_acceleration_110))
    part_of_acceleration_117 = 0.00019601428534987285 * part_of_acceleration_91 + -0.0002340142853498729 * part_of_acceleration_93 + 0.0020205999999999987 * part_of_acceleration_94 - (-0.0004627416997969522 * part_of_acceleration_104 + 0.0010627416997969527 * part_of_acceleration_113) + (part_of_acceleration_92 * part_of_acceleration_109 - part_of_acceleration_90 * part_of_acceleration_114 + (part_of_acceleration_103 * part_of_acceleration_111 - part_of_acceleration_106 * part_of_acceleration_115))
    part_of_acceleration_118 = 1.4 * part_of_acceleration_113 - (0.0010627416997969527 * part_of_acceleration_94 - 0.12200000000000001 * part_of_acceleration_93) + (part_of_acceleration_90 * part_of_acceleration_110 - part_of_acceleration_105 * part_of_acceleration_111)
    part_of_acceleration_119 = part_of_acceleration_105 * part_of_acceleration_115 - part_of_acceleration_92 * part_of_acceleration_110 - (1.4 * part_of_acceleration_104 + (0.12200000000000001 * part_of_acceleration_91 - -0.0004627416997969522 * part_of_acceleration_94))
    part_of_acceleration_120 = part_of_acceleration_87 * part_of_acceleration_118 + part_of_acceleration_84 * part_of_acceleration_119
    part_of_acceleration_121 = 0.0089625 * part_of_acceleration_68 + 0.000236 * part_of_acceleration_70 + 8.300000000000001e-05 * part_of_acceleration_51 + (0.0085 * part_of_acceleration_75 - -0.068 * part_of_acceleration_76) + (part_of_acceleration_77 * part_of_acceleration_79 + part_of_acceleration_78 * part_of_acceleration_81 - (part_of_acceleration_67 * part_of_acceleration_82 + part_of_acceleration_80 * part_of_acceleration_83)) + (part_of_acceleration_85 * part_of_acceleration_112 - part_of_acceleration_89 * part_of_acceleration_116 + 0.09983341664682815 * part_of_acceleration_117 + -0.06 * part_of_acceleration_120)
    part_of_acceleration_122 = 0.0089625 * part_of_acceleration_69 - 0.000236 * part_of_acceleration_67 + 8.300000000000001e-05 * part_of_acceleration_80 - (-0.068 * part_of_acceleration_78 + 0.0085 * part_of_acceleration_77)
    part_of_acceleration_123 = 1.7 * part_of_acceleration_74 - (-0.068 * part_of_acceleration_80 + 0.0085 * part_of_acceleration_67)
    part_of_acceleration_124 = 0.000236 * part_of_acceleration_68 + 0.0038493000000000004 * part_of_acceleration_70 + 0.00074 * part_of_acceleration_51 + (0.0085 * part_of_acceleration_95 + 0.0034 * part_of_acceleration_76) + (part_of_acceleration_80 * part_of_acceleration_122 - part_of_acceleration_69 * part_of_acceleration_82 - (part_of_acceleration_78 * part_of_acceleration_123 + part_of_acceleration_74 * part_of_acceleration_79)) + (part_of_acceleration_86 * part_of_acceleration_112 - part_of_acceleration_88 * part_of_acceleration_116 + -0.9950041652780258 * part_of_acceleration_117 - 0.05 * part_of_acceleration_120)
    part_of_acceleration_125 = part_of_acceleration_69 * part_of_acceleration_81 + part_of_acceleration_67 * part_of_acceleration_123 - (1.7 * part_of_acceleration_76 + (0.0034 * part_of_acceleration_70 - -0.068 * part_of_acceleration_68)) + part_of_acceleration_120
    part_of_acceleration_126 = 0.0208 * part_of_acceleration_49 + -0.000144 * part_of_acceleration_51 - 0.00033200000000000005 * part_of_acceleration_31 + (0.044000000000000004 * part_of_acceleration_38 + -0.132 * part_of_acceleration_58) - (part_of_acceleration_48 * part_of_acceleration_61 + part_of_acceleration_59 * part_of_acceleration_62 + (part_of_acceleration_60 * part_of_acceleration_63 + part_of_acceleration_40 * part_of_acceleration_64)) + (part_of_acceleration_65 * part_of_acceleration_121 - part_of_acceleration_66 * part_of_acceleration_124 - 0.02 * part_of_acceleration_125)
    part_of_acceleration_127 = 0.0208 * part_of_acceleration_50 - -0.000144 * part_of_acceleration_48 + 0.00033200000000000005 * part_of_acceleration_59 + (-0.132 * part_of_acceleration_60 - 0.044000000000000004 * part_of_acceleration_40)
    part_of_acceleration_128 = 2.2 * part_of_acceleration_57 - (0.044000000000000004 * part_of_acceleration_59 + -0.132 * part_of_acceleration_48)
    part_of_acceleration_129 = 1.4 * part_of_acceleration_98 - (-0.0004627416997969522 * part_of_acceleration_93 - 0.0010627416997969527 * part_of_acceleration_91) + (part_of_acceleration_92 * part_of_acceleration_111 - part_of_acceleration_90 * part_of_acceleration_115)
    part_of_acceleration_130 = part_of_acceleration_86 * part_of_acceleration_118 - part_of_acceleration_88 * part_of_acceleration_119 + -0.9950041652780258 * part_of_acceleration_129
    part_of_acceleration_131 = part_of_acceleration_85 * part_of_acceleration_118 - part_of_acceleration_89 * part_of_acceleration_119 + 0.09983341664682815 * part_of_acceleration_129
    part_of_acceleration_132 = 8.300000000000001e-05 * part_of_acceleration_68 + 0.00074 * part_of_acceleration_70 + 0.0078268 * part_of_acceleration_51 - (0.0034 * part_of_acceleration_75 + -0.068 * part_of_acceleration_95) + (part_of_acceleration_69 * part_of_acceleration_83 + part_of_acceleration_67 * part_of_acceleration_122 + (part_of_acceleration_74 * part_of_acceleration_81 - part_of_acceleration_77 * part_of_acceleration_123)) + (part_of_acceleration_87 * part_of_acceleration_112 + part_of_acceleration_84 * part_of_acceleration_116 + (0.05 * part_of_acceleration_130 - -0.06 * part_of_acceleration_131))
    part_of_acceleration_133 = 1.7 * part_of_acceleration_95 - (-0.068 * part_of_acceleration_51 - 0.0085 * part_of_acceleration_70) - (part_of_acceleration_67 * part_of_acceleration_79 + part_of_acceleration_80 * part_of_acceleration_81) + part_of_acceleration_131
    part_of_acceleration_134 = part_of_acceleration_80 * part_of_acceleration_123 - part_of_acceleration_69 * part_of_acceleration_79 - (1.7 * part_of_acceleration_75 + (0.0085 * part_of_acceleration_68 - 0.0034 * part_of_acceleration_51)) + part_of_acceleration_130
    part_of_acceleration_135 = part_of_acceleration_65 * part_of_acceleration_133 - part_of_acceleration_66 * part_of_acceleration_134
    part_of_acceleration_136 = -0.000144 * part_of_acceleration_49 + 0.0189222 * part_of_acceleration_51 - 0.0035399999999999997 * part_of_acceleration_31 + (-0.132 * part_of_acceleration_71 - 0.0022 * part_of_acceleration_38) + (part_of_acceleration_59 * part_of_acceleration_127 - part_of_acceleration_50 * part_of_acceleration_61 - (part_of_acceleration_40 * part_of_acceleration_128 + part_of_acceleration_57 * part_of_acceleration_63)) + (part_of_acceleration_132 + 0.02 * part_of_acceleration_135)
    part_of_acceleration_137 = 2.2 * part_of_acceleration_71 + (0.044000000000000004 * part_of_acceleration_31 + -0.132 * part_of_acceleration_51) + (part_of_acceleration_59 * part_of_acceleration_64 - part_of_acceleration_48 * part_of_acceleration_63) + part_of_acceleration_135
    part_of_acceleration_138 = part_of_acceleration_59 * part_of_acceleration_128 - part_of_acceleration_50 * part_of_acceleration_63 - (2.2 * part_of_acceleration_58 + (-0.132 * part_of_acceleration_49 + 0.0022 * part_of_acceleration_31)) + part_of_acceleration_125
    part_of_acceleration_139 = part_of_acceleration_47 * part_of_acceleration_137 + part_of_acceleration_46 * part_of_acceleration_138
    part_of_acceleration_140 = 0.05361 * part_of_acceleration_29 - 0.00107 * part_of_acceleration_31 - -0.00013900000000000007 * part_of_acceleration_14 - (0.29 * part_of_acceleration_32 + 0.087 * part_of_acceleration_38) + (part_of_acceleration_28 * part_of_acceleration_41 - part_of_acceleration_39 * part_of_acceleration_43 + (part_of_acceleration_40 * part_of_acceleration_44 - part_of_acceleration_42 * part_of_acceleration_45)) + (part_of_acceleration_46 * part_of_acceleration_126 - part_of_acceleration_47 * part_of_acceleration_136 - 0.37 * part_of_acceleration_139)
    part_of_acceleration_141 = 0.05361 * part_of_acceleration_30 + 0.00107 * part_of_acceleration_28 + -0.00013900000000000007 * part_of_acceleration_39 + (0.087 * part_of_acceleration_40 - 0.29 * part_of_acceleration_42)
    part_of_acceleration_142 = 2.9 * part_of_acceleration_37 - (0.29 * part_of_acceleration_39 - 0.087 * part_of_acceleration_28)
    part_of_acceleration_143 = 0.00033200000000000005 * part_of_acceleration_49 + 0.0035399999999999997 * part_of_acceleration_51 - 0.005882199999999999 * part_of_acceleration_31 - (0.0022 * part_of_acceleration_58 + 0.044000000000000004 * part_of_acceleration_71) + (part_of_acceleration_50 * part_of_acceleration_62 + part_of_acceleration_48 * part_of_acceleration_127 + (part_of_acceleration_60 * part_of_acceleration_128 - part_of_acceleration_57 * part_of_acceleration_64)) - (part_of_acceleration_66 * part_of_acceleration_121 + part_of_acceleration_65 * part_of_acceleration_124)
    part_of_acceleration_144 = 0.00107 * part_of_acceleration_29 - 0.010636099999999996 * part_of_acceleration_31 - -0.010199999999999999 * part_of_acceleration_14 + (0.087 * part_of_acceleration_52 + -0.0087 * part_of_acceleration_32) + (part_of_acceleration_39 * part_of_acceleration_141 - part_of_acceleration_30 * part_of_acceleration_41 + (part_of_acceleration_37 * part_of_acceleration_44 - part_of_acceleration_42 * part_of_acceleration_142)) + part_of_acceleration_143
    part_of_acceleration_145 = -0.0087 * part_of_acceleration_31 + 0.29 * part_of_acceleration_29 - 2.9 * part_of_acceleration_32 - (part_of_acceleration_30 * part_of_acceleration_45 + part_of_acceleration_28 * part_of_acceleration_142) - part_of_acceleration_139
    part_of_acceleration_146 = 0.03898 * part_of_acceleration_12 + -7.200000000000007e-05 * part_of_acceleration_14 - 0.001368 * part_of_acceleration_3 + (0.9123300000000001 * part_of_acceleration_4 - -0.21700000000000003 * part_of_acceleration_20) + (part_of_acceleration_11 * part_of_acceleration_23 - part_of_acceleration_21 * part_of_acceleration_24 - part_of_acceleration_22 * part_of_acceleration_25) + (part_of_acceleration_26 * part_of_acceleration_140 - part_of_acceleration_27 * part_of_acceleration_144 + 0.02 * part_of_acceleration_145)
    part_of_acceleration_147 = 0.03898 * part_of_acceleration_13 + -7.200000000000007e-05 * part_of_acceleration_11 + 0.001368 * part_of_acceleration_21 - -0.21700000000000003 * part_of_acceleration_22
    part_of_acceleration_148 = part_of_acceleration_46 * part_of_acceleration_137 - part_of_acceleration_47 * part_of_acceleration_138
    part_of_acceleration_149 = part_of_acceleration_26 * (2.9 * part_of_acceleration_52 - (0.087 * part_of_acceleration_31 - 0.29 * part_of_acceleration_14) + (part_of_acceleration_39 * part_of_acceleration_45 - part_of_acceleration_28 * part_of_acceleration_44) + part_of_acceleration_148) - part_of_acceleration_27 * (2.9 * part_of_acceleration_38 - (0.087 * part_of_acceleration_29 + -0.0087 * part_of_acceleration_14) + (part_of_acceleration_39 * part_of_acceleration_142 + part_of_acceleration_30 * part_of_acceleration_44) + (2.2 * part_of_acceleration_38 - (0.0022 * part_of_acceleration_51 - 0.044000000000000004 * part_of_acceleration_49) + (part_of_acceleration_48 * part_of_acceleration_128 - part_of_acceleration_50 * part_of_acceleration_64) - (part_of_acceleration_66 * part_of_acceleration_133 + part_of_acceleration_65 * part_of_acceleration_134)))
    part_of_acceleration_150 = -0.00013900000000000007 * part_of_acceleration_29 - -0.010199999999999999 * part_of_acceleration_31 - 0.0490261 * part_of_acceleration_14 + (-0.0087 * part_of_acceleration_38 - 0.29 * part_of_acceleration_52) + (part_of_acceleration_30 * part_of_acceleration_43 - part_of_acceleration_28 * part_of_acceleration_141 + (part_of_acceleration_40 * part_of_acceleration_142 - part_of_acceleration_37 * part_of_acceleration_45)) - (part_of_acceleration_47 * part_of_acceleration_126 + part_of_acceleration_46 * part_of_acceleration_136 + 0.37 * part_of_acceleration_148)
    part_of_acceleration_151 = -7.200000000000007e-05 * part_of_acceleration_12 + 0.0342396 * part_of_acceleration_14 - 0.005310000000000001 * part_of_acceleration_3 + (-0.21700000000000003 * part_of_acceleration_34 - 0.12164400000000002 * part_of_acceleration_4) + (part_of_acceleration_21 * part_of_acceleration_147 - part_of_acceleration_13 * part_of_acceleration_23 - part_of_acceleration_19 * part_of_acceleration_25) + (0.02 * part_of_acceleration_149 - part_of_acceleration_150)
    part_of_acceleration_152 = 3.1 * part_of_acceleration_22 - (-0.21700000000000003 * part_of_acceleration_13 - 0.012400000000000001 * part_of_acceleration_21)
    part_of_acceleration_153 = 3.1 * part_of_acceleration_34 + (0.093 * part_of_acceleration_3 + -0.21700000000000003 * part_of_acceleration_14) - (part_of_acceleration_11 * part_of_acceleration_25 + part_of_acceleration_21 * part_of_acceleration_152) + part_of_acceleration_149
    part_of_acceleration_154 = 3.1 * part_of_acceleration_19 + (0.093 * part_of_acceleration_21 - -0.21700000000000003 * part_of_acceleration_11)
    part_of_acceleration_155 = 3.1 * part_of_acceleration_20 - (-0.21700000000000003 * part_of_acceleration_12 + 0.012400000000000001 * part_of_acceleration_3) + (part_of_acceleration_13 * part_of_acceleration_25 - part_of_acceleration_21 * part_of_acceleration_154) - part_of_acceleration_145
    part_of_acceleration_156 = 0.00011800000000000001 * v_shoulder_pitch_hat - (0.08524999999999999 * part_of_acceleration_2 + 5.099999999999994e-05 * part_of_acceleration_5)
    part_of_acceleration_157 = 0.001368 * part_of_acceleration_12 + 0.005310000000000001 * part_of_acceleration_14 - 0.0118396 * part_of_acceleration_3 + (0.012400000000000001 * part_of_acceleration_20 - 0.093 * part_of_acceleration_34) + (part_of_acceleration_13 * part_of_acceleration_24 - part_of_acceleration_11 * part_of_acceleration_147 + (part_of_acceleration_22 * part_of_acceleration_154 - part_of_acceleration_19 * part_of_acceleration_152)) + (part_of_acceleration_27 * part_of_acceleration_140 + part_of_acceleration_26 * part_of_acceleration_144)
    part_of_acceleration_158 = inputs.w_shoulder_yaw - F_hat_on_shoulder_yaw + (part_of_acceleration_1 * (5.099999999999994e-05 * part_of_acceleration_3 - 0.08524999999999999 * part_of_acceleration_6 + 0.8044199999999999 * part_of_acceleration_4 - (part_of_acceleration_5 * part_of_acceleration_7 + v_shoulder_pitch_hat * part_of_acceleration_8) + (part_of_acceleration_9 * part_of_acceleration_146 - part_of_acceleration_10 * part_of_acceleration_151 + -0.39 * (part_of_acceleration_10 * part_of_acceleration_153 + part_of_acceleration_9 * part_of_acceleration_155))) + part_of_acceleration_4 * (0.0126441 * part_of_acceleration_3 - 5.099999999999994e-05 * part_of_acceleration_6 - 0.8044199999999999 * part_of_acceleration_1 + (v_shoulder_pitch_hat * part_of_acceleration_156 + part_of_acceleration_2 * part_of_acceleration_7) - part_of_acceleration_157))
    part_of_acceleration_159 = 0.016923826846380885 * part_of_acceleration_84 - 0.0002786011662778472 * part_of_acceleration_87 + 1.9568775818064122e-05
    part_of_acceleration_160 = 0.000278601166277847 * part_of_acceleration_84 - 0.01684721152565448 * part_of_acceleration_87 + -2.3362445650643596e-05
    part_of_acceleration_161 = 0.000195035030377119 * part_of_acceleration_84 - -0.00023284518865768404 * part_of_acceleration_87 + 0.00020172340167658084
    part_of_acceleration_162 = -4.61970849156906e-05 * part_of_acceleration_84 - 0.00010609713490378755 * part_of_acceleration_87 + -0.12139050816391916
    part_of_acceleration_163 = part_of_acceleration_162 + -0.08399999999999999
    part_of_acceleration_164 = 0.0089625 + (part_of_acceleration_159 * part_of_acceleration_85 - part_of_acceleration_160 * part_of_acceleration_89 + 0.09983341664682815 * part_of_acceleration_161 + -0.06 * part_of_acceleration_162 - 0.06 * part_of_acceleration_163)
    part_of_acceleration_165 = 0.001698046617062571 * part_of_acceleration_84 - 2.795335666111188e-05 * part_of_acceleration_87 + -0.000195035030377119
    part_of_acceleration_166 = 2.7953356661111864e-05 * part_of_acceleration_84 - 0.001690359443980765 * part_of_acceleration_87 + 0.00023284518865768404
    part_of_acceleration_167 = 1.9568775818064122e-05 * part_of_acceleration_84 - -2.3362445650643596e-05 * part_of_acceleration_87 + -0.0020105054163607776
    part_of_acceleration_168 = -0.0004604299187458012 * part_of_acceleration_84 - 0.0010574324179126171 * part_of_acceleration_87 + 0.012179676830913037
    part_of_acceleration_169 = part_of_acceleration_168 + 0.06999999999999999
    part_of_acceleration_170 = 0.000236 + (part_of_acceleration_165 * part_of_acceleration_85 - part_of_acceleration_166 * part_of_acceleration_89 + 0.09983341664682815 * part_of_acceleration_167 + -0.05 * part_of_acceleration_162 + 0.06 * part_of_acceleration_169)
    part_of_acceleration_171 = part_of_acceleration_65 * part_of_acceleration_164 - part_of_acceleration_66 * part_of_acceleration_170
    part_of_acceleration_172 = 0.000236 + (part_of_acceleration_159 * part_of_acceleration_86 - part_of_acceleration_160 * part_of_acceleration_88 + -0.9950041652780258 * part_of_acceleration_161 - -0.06 * part_of_acceleration_168 - 0.05 * part_of_acceleration_163)
    part_of_acceleration_173 = 0.0038493000000000004 + (part_of_acceleration_165 * part_of_acceleration_86 - part_of_acceleration_166 * part_of_acceleration_88 + -0.9950041652780258 * part_of_acceleration_167 - -0.05 * part_of_acceleration_168 + 0.05 * part_of_acceleration_169)
    part_of_acceleration_174 = part_of_acceleration_65 * part_of_acceleration_172 - part_of_acceleration_66 * part_of_acceleration_173
    part_of_acceleration_175 = 0.0034 + part_of_acceleration_169
    part_of_acceleration_176 = part_of_acceleration_66 * part_of_acceleration_175
    part_of_acceleration_177 = -0.068 + part_of_acceleration_163
    part_of_acceleration_178 = part_of_acceleration_65 * part_of_acceleration_177
    part_of_acceleration_179 = part_of_acceleration_176 + part_of_acceleration_178
    part_of_acceleration_180 = 0.06199999999999999 - part_of_acceleration_179
    part_of_acceleration_181 = 0.0208 + (part_of_acceleration_171 * part_of_acceleration_65 - part_of_acceleration_174 * part_of_acceleration_66 + -0.02 * part_of_acceleration_179 + 0.02 * part_of_acceleration_180)
    part_of_acceleration_182 = 0.0170088 * part_of_acceleration_87 + 0.00028 * part_of_acceleration_84
    part_of_acceleration_183 = 0.0002799999999999998 * part_of_acceleration_87 + 0.0169318 * part_of_acceleration_84
    part_of_acceleration_184 = 0.00019601428534987285 * part_of_acceleration_87 + -0.0002340142853498729 * part_of_acceleration_84
    part_of_acceleration_185 = -0.0004627416997969522 * part_of_acceleration_87 + 0.0010627416997969527 * part_of_acceleration_84
    part_of_acceleration_186 = 8.300000000000001e-05 + (part_of_acceleration_182 * part_of_acceleration_85 - part_of_acceleration_183 * part_of_acceleration_89 + 0.09983341664682815 * part_of_acceleration_184 - 0.05 * part_of_acceleration_185)
    part_of_acceleration_187 = 0.00074 + (part_of_acceleration_182 * part_of_acceleration_86 - part_of_acceleration_183 * part_of_acceleration_88 + -0.9950041652780258 * part_of_acceleration_184 + 0.06 * part_of_acceleration_185)
    part_of_acceleration_188 = -0.000144 + (part_of_acceleration_186 * part_of_acceleration_65 - part_of_acceleration_187 * part_of_acceleration_66)
    part_of_acceleration_189 = part_of_acceleration_46 * part_of_acceleration_181 - part_of_acceleration_47 * part_of_acceleration_188
    part_of_acceleration_190 = 8.300000000000001e-05 + (part_of_acceleration_159 * part_of_acceleration_87 + part_of_acceleration_160 * part_of_acceleration_84 + -0.05 * part_of_acceleration_185)
    part_of_acceleration_191 = 0.00074 + (part_of_acceleration_165 * part_of_acceleration_87 + part_of_acceleration_166 * part_of_acceleration_84 - -0.06 * part_of_acceleration_185)
    part_of_acceleration_192 = part_of_acceleration_65 * part_of_acceleration_190 - part_of_acceleration_66 * part_of_acceleration_191
    part_of_acceleration_193 = -0.000144 + part_of_acceleration_192
    part_of_acceleration_194 = 0.0078268 + (part_of_acceleration_182 * part_of_acceleration_87 + part_of_acceleration_183 * part_of_acceleration_84 - (0.06 * part_of_acceleration_162 - 0.05 * part_of_acceleration_168) - (-0.05 * part_of_acceleration_169 - -0.06 * part_of_acceleration_163))
    part_of_acceleration_195 = 0.0189222 + (part_of_acceleration_194 - 0.02 * part_of_acceleration_179 - -0.02 * part_of_acceleration_180)
    part_of_acceleration_196 = part_of_acceleration_46 * part_of_acceleration_193 - part_of_acceleration_47 * part_of_acceleration_195
    part_of_acceleration_197 = -0.132 + part_of_acceleration_180
    part_of_acceleration_198 = part_of_acceleration_197 + 1.9609999999999999
    part_of_acceleration_199 = 0.05361 + (part_of_acceleration_189 * part_of_acceleration_46 - part_of_acceleration_196 * part_of_acceleration_47 + 0.37 * part_of_acceleration_197 - -0.37 * part_of_acceleration_198)
    part_of_acceleration_200 = part_of_acceleration_66 * part_of_acceleration_172 + part_of_acceleration_65 * part_of_acceleration_173
    part_of_acceleration_201 = part_of_acceleration_66 * part_of_acceleration_164 + part_of_acceleration_65 * part_of_acceleration_170
    part_of_acceleration_202 = part_of_acceleration_65 * part_of_acceleration_175
    part_of_acceleration_203 = part_of_acceleration_66 * part_of_acceleration_177
    part_of_acceleration_204 = part_of_acceleration_202 - part_of_acceleration_203
    part_of_acceleration_205 = 0.00033200000000000005 + (part_of_acceleration_200 * part_of_acceleration_66 - part_of_acceleration_201 * part_of_acceleration_65 - 0.02 * part_of_acceleration_204)
    part_of_acceleration_206 = 0.0085 + part_of_acceleration_185
    part_of_acceleration_207 = part_of_acceleration_66 * part_of_acceleration_190 + part_of_acceleration_65 * part_of_acceleration_191
    part_of_acceleration_208 = 0.0035399999999999997 + (-0.02 * part_of_acceleration_206 - part_of_acceleration_207)
    part_of_acceleration_209 = 0.0022 + part_of_acceleration_204
    part_of_acceleration_210 = part_of_acceleration_46 * part_of_acceleration_209
    part_of_acceleration_211 = 0.044000000000000004 + part_of_acceleration_206
    part_of_acceleration_212 = part_of_acceleration_47 * part_of_acceleration_211
    part_of_acceleration_213 = part_of_acceleration_210 - part_of_acceleration_212
    part_of_acceleration_214 = 0.00107 + (part_of_acceleration_205 * part_of_acceleration_46 - part_of_acceleration_208 * part_of_acceleration_47 + -0.37 * part_of_acceleration_213)
    part_of_acceleration_215 = part_of_acceleration_26 * part_of_acceleration_199 - part_of_acceleration_27 * part_of_acceleration_214
    part_of_acceleration_216 = 0.00033200000000000005 + (-0.02 * part_of_acceleration_204 - (part_of_acceleration_171 * part_of_acceleration_66 + part_of_acceleration_174 * part_of_acceleration_65))
    part_of_acceleration_217 = 0.0035399999999999997 - (part_of_acceleration_186 * part_of_acceleration_66 + part_of_acceleration_187 * part_of_acceleration_65 + 0.02 * part_of_acceleration_206)
    part_of_acceleration_218 = part_of_acceleration_46 * part_of_acceleration_216 - part_of_acceleration_47 * part_of_acceleration_217
    part_of_acceleration_219 = 0.00107 + (part_of_acceleration_218 - 0.37 * part_of_acceleration_213)
    part_of_acceleration_220 = 0.005882199999999999 + (part_of_acceleration_201 * part_of_acceleration_66 + part_of_acceleration_200 * part_of_acceleration_65)
    part_of_acceleration_221 = 0.010636099999999996 + part_of_acceleration_220
    part_of_acceleration_222 = part_of_acceleration_26 * part_of_acceleration_219 - part_of_acceleration_27 * part_of_acceleration_221
    part_of_acceleration_223 = -0.0087 + part_of_acceleration_213
    part_of_acceleration_224 = part_of_acceleration_27 * part_of_acceleration_223
    part_of_acceleration_225 = 0.29 + part_of_acceleration_198
    part_of_acceleration_226 = part_of_acceleration_26 * part_of_acceleration_225
    part_of_acceleration_227 = part_of_acceleration_224 + part_of_acceleration_226
    part_of_acceleration_228 = part_of_acceleration_227 + 0.16399999999999998
    part_of_acceleration_229 = 0.03898 + (part_of_acceleration_215 * part_of_acceleration_26 - part_of_acceleration_222 * part_of_acceleration_27 - -0.02 * part_of_acceleration_227 + 0.02 * part_of_acceleration_228)
    part_of_acceleration_230 = part_of_acceleration_47 * part_of_acceleration_216 + part_of_acceleration_46 * part_of_acceleration_217
    part_of_acceleration_231 = part_of_acceleration_47 * part_of_acceleration_209
    part_of_acceleration_232 = part_of_acceleration_46 * part_of_acceleration_211
    part_of_acceleration_233 = part_of_acceleration_231 + part_of_acceleration_232
    part_of_acceleration_234 = -0.010199999999999999 - (part_of_acceleration_230 + -0.37 * part_of_acceleration_233)
    part_of_acceleration_235 = part_of_acceleration_47 * part_of_acceleration_193 + part_of_acceleration_46 * part_of_acceleration_195
    part_of_acceleration_236 = part_of_acceleration_47 * part_of_acceleration_181 + part_of_acceleration_46 * part_of_acceleration_188
    part_of_acceleration_237 = -0.00013900000000000007 + (part_of_acceleration_235 * part_of_acceleration_47 - part_of_acceleration_236 * part_of_acceleration_46)
    part_of_acceleration_238 = -7.200000000000007e-05 + (part_of_acceleration_234 * part_of_acceleration_27 - part_of_acceleration_237 * part_of_acceleration_26)
    part_of_acceleration_239 = part_of_acceleration_9 * part_of_acceleration_229 - part_of_acceleration_10 * part_of_acceleration_238
    part_of_acceleration_240 = -0.00013900000000000007 - (part_of_acceleration_189 * part_of_acceleration_47 + part_of_acceleration_196 * part_of_acceleration_46)
    part_of_acceleration_241 = -0.010199999999999999 + (0.37 * part_of_acceleration_233 - (part_of_acceleration_205 * part_of_acceleration_47 + part_of_acceleration_208 * part_of_acceleration_46))
    part_of_acceleration_242 = part_of_acceleration_26 * part_of_acceleration_240 - part_of_acceleration_27 * part_of_acceleration_241
    part_of_acceleration_243 = -7.200000000000007e-05 - part_of_acceleration_242
    part_of_acceleration_244 = 0.0490261 + (part_of_acceleration_236 * part_of_acceleration_47 + part_of_acceleration_235 * part_of_acceleration_46 - -0.37 * part_of_acceleration_197 + 0.37 * part_of_acceleration_198)
    part_of_acceleration_245 = 0.0342396 + (part_of_acceleration_244 + 0.02 * part_of_acceleration_227 - -0.02 * part_of_acceleration_228)
    part_of_acceleration_246 = part_of_acceleration_9 * part_of_acceleration_243 - part_of_acceleration_10 * part_of_acceleration_245
    part_of_acceleration_247 = -0.21700000000000003 + part_of_acceleration_228
    part_of_acceleration_248 = -4.407 - part_of_acceleration_247
    part_of_acceleration_249 = part_of_acceleration_27 * part_of_acceleration_240 + part_of_acceleration_26 * part_of_acceleration_241
    part_of_acceleration_250 = 0.087 - part_of_acceleration_233
    part_of_acceleration_251 = 0.005310000000000001 - (part_of_acceleration_249 + -0.02 * part_of_acceleration_250)
    part_of_acceleration_252 = part_of_acceleration_27 * part_of_acceleration_199 + part_of_acceleration_26 * part_of_acceleration_214
    part_of_acceleration_253 = part_of_acceleration_27 * part_of_acceleration_219 + part_of_acceleration_26 * part_of_acceleration_221
    part_of_acceleration_254 = part_of_acceleration_26 * part_of_acceleration_223 - part_of_acceleration_27 * part_of_acceleration_225
    part_of_acceleration_255 = 0.001368 + (part_of_acceleration_252 * part_of_acceleration_26 - part_of_acceleration_253 * part_of_acceleration_27 - 0.02 * part_of_acceleration_254)
    part_of_acceleration_256 = 0.012400000000000001 + part_of_acceleration_254
    part_of_acceleration_257 = 0.093 - part_of_acceleration_250
    part_of_acceleration_258 = part_of_acceleration_9 * part_of_acceleration_256 - part_of_acceleration_10 * part_of_acceleration_257
    part_of_acceleration_259 = 0.001368 + (part_of_acceleration_215 * part_of_acceleration_27 + part_of_acceleration_222 * part_of_acceleration_26 + -0.02 * part_of_acceleration_254)
    part_of_acceleration_260 = 0.005310000000000001 + (0.02 * part_of_acceleration_250 - (part_of_acceleration_237 * part_of_acceleration_27 + part_of_acceleration_234 * part_of_acceleration_26))
    part_of_acceleration_261 = part_of_acceleration_9 * part_of_acceleration_259 - part_of_acceleration_10 * part_of_acceleration_260 + -0.39 * part_of_acceleration_258
    part_of_acceleration_262 = 0.0118396 + (part_of_acceleration_252 * part_of_acceleration_27 + part_of_acceleration_253 * part_of_acceleration_26)
    part_of_acceleration_263 = 0.0157968 + ((part_of_acceleration_1 * (0.08524999999999999 + (part_of_acceleration_239 * part_of_acceleration_9 - part_of_acceleration_246 * part_of_acceleration_10 - -0.39 * part_of_acceleration_247 - 0.39 * part_of_acceleration_248)) + part_of_acceleration_4 * (5.099999999999994e-05 + (part_of_acceleration_251 * part_of_acceleration_10 - part_of_acceleration_255 * part_of_acceleration_9 + 0.39 * part_of_acceleration_258))) * part_of_acceleration_1 + (part_of_acceleration_1 * (5.099999999999994e-05 - part_of_acceleration_261) + part_of_acceleration_4 * (0.0126441 + part_of_acceleration_262)) * part_of_acceleration_4)
    part_of_acceleration_264 = part_of_acceleration_10 * part_of_acceleration_256
    part_of_acceleration_265 = part_of_acceleration_9 * part_of_acceleration_257
    part_of_acceleration_266 = (part_of_acceleration_1 * (0.00011800000000000001 + (part_of_acceleration_239 * part_of_acceleration_10 + part_of_acceleration_246 * part_of_acceleration_9)) + part_of_acceleration_4 * (0.01112 - (part_of_acceleration_255 * part_of_acceleration_10 + part_of_acceleration_251 * part_of_acceleration_9 + -0.39 * (part_of_acceleration_264 + part_of_acceleration_265)))) / part_of_acceleration_263
    part_of_acceleration_267 = inputs.w_shoulder_pitch - F_hat_on_shoulder_pitch - (0.01112 * part_of_acceleration_3 - 0.00011800000000000001 * part_of_acceleration_6 + (-4.42431 * part_of_acceleration_1 - 0.040221 * part_of_acceleration_4) + (part_of_acceleration_5 * part_of_acceleration_156 - part_of_acceleration_2 * part_of_acceleration_8) + (part_of_acceleration_10 * part_of_acceleration_146 + part_of_acceleration_9 * part_of_acceleration_151 - -0.39 * (part_of_acceleration_9 * part_of_acceleration_153 - part_of_acceleration_10 * part_of_acceleration_155))) + part_of_acceleration_266 * part_of_acceleration_158
    part_of_acceleration_268 = 0.0816141 + ((part_of_acceleration_10 * part_of_acceleration_229 + part_of_acceleration_9 * part_of_acceleration_238) * part_of_acceleration_10 + (part_of_acceleration_10 * part_of_acceleration_243 + part_of_acceleration_9 * part_of_acceleration_245) * part_of_acceleration_9 + 0.39 * part_of_acceleration_247 + -0.39 * part_of_acceleration_248) - part_of_acceleration_266 * part_of_acceleration_266 * part_of_acceleration_263
    part_of_acceleration_269 = (part_of_acceleration_4 * part_of_acceleration_262 - part_of_acceleration_1 * part_of_acceleration_261) / part_of_acceleration_263
    part_of_acceleration_270 = (part_of_acceleration_10 * part_of_acceleration_259 + part_of_acceleration_9 * part_of_acceleration_260 + -0.39 * (part_of_acceleration_265 + part_of_acceleration_264) + part_of_acceleration_269 * part_of_acceleration_266 * part_of_acceleration_263) / part_of_acceleration_268
    part_of_acceleration_271 = inputs.w_arm_roll - F_hat_on_arm_roll - part_of_acceleration_157 - part_of_acceleration_269 * part_of_acceleration_158 - part_of_acceleration_270 * part_of_acceleration_267
    part_of_acceleration_272 = part_of_acceleration_262 - part_of_acceleration_269 * part_of_acceleration_269 * part_of_acceleration_263 - part_of_acceleration_270 * part_of_acceleration_270 * part_of_acceleration_268
    part_of_acceleration_273 = part_of_acceleration_226 + part_of_acceleration_224
    part_of_acceleration_274 = part_of_acceleration_244 + 0.02 * part_of_acceleration_273
    part_of_acceleration_275 = (part_of_acceleration_4 * part_of_acceleration_249 - part_of_acceleration_1 * (part_of_acceleration_9 * part_of_acceleration_242 + part_of_acceleration_10 * part_of_acceleration_274 - -0.39 * (part_of_acceleration_10 * part_of_acceleration_273))) / part_of_acceleration_263
    part_of_acceleration_276 = (part_of_acceleration_10 * part_of_acceleration_242 - part_of_acceleration_9 * part_of_acceleration_274 + -0.39 * (part_of_acceleration_9 * part_of_acceleration_273) + part_of_acceleration_275 * part_of_acceleration_266 * part_of_acceleration_263) / part_of_acceleration_268
    part_of_acceleration_277 = (part_of_acceleration_249 - part_of_acceleration_275 * part_of_acceleration_269 * part_of_acceleration_263 - part_of_acceleration_276 * part_of_acceleration_270 * part_of_acceleration_268) / part_of_acceleration_272
    part_of_acceleration_278 = inputs.w_elbow_pitch - F_hat_on_elbow_pitch - part_of_acceleration_150 - part_of_acceleration_275 * part_of_acceleration_158 - part_of_acceleration_276 * part_of_acceleration_267 - part_of_acceleration_277 * part_of_acceleration_271
    part_of_acceleration_279 = part_of_acceleration_244 - part_of_acceleration_275 * part_of_acceleration_275 * part_of_acceleration_263 - part_of_acceleration_276 * part_of_acceleration_276 * part_of_acceleration_268 - part_of_acceleration_277 * part_of_acceleration_277 * part_of_acceleration_272
    part_of_acceleration_280 = part_of_acceleration_232 + part_of_acceleration_231
    part_of_acceleration_281 = 0.37 * part_of_acceleration_280 - part_of_acceleration_230
    part_of_acceleration_282 = part_of_acceleration_212 - part_of_acceleration_210
    part_of_acceleration_283 = part_of_acceleration_218 + 0.37 * part_of_acceleration_282
    part_of_acceleration_284 = part_of_acceleration_27 * part_of_acceleration_283 + part_of_acceleration_26 * part_of_acceleration_220
    part_of_acceleration_285 = part_of_acceleration_26 * part_of_acceleration_283 - part_of_acceleration_27 * part_of_acceleration_220 + 0.02 * part_of_acceleration_282
    part_of_acceleration_286 = part_of_acceleration_26 * part_of_acceleration_280
    part_of_acceleration_287 = part_of_acceleration_281 + 0.02 * part_of_acceleration_286
    part_of_acceleration_288 = (part_of_acceleration_4 * part_of_acceleration_284 - part_of_acceleration_1 * (part_of_acceleration_9 * part_of_acceleration_285 + part_of_acceleration_10 * part_of_acceleration_287 - -0.39 * (part_of_acceleration_10 * part_of_acceleration_286 + part_of_acceleration_9 * part_of_acceleration_282))) / part_of_acceleration_263
    part_of_acceleration_289 = (part_of_acceleration_10 * part_of_acceleration_285 - part_of_acceleration_9 * part_of_acceleration_287 - -0.39 * (part_of_acceleration_10 * part_of_acceleration_282 - part_of_acceleration_9 * part_of_acceleration_286) + part_of_acceleration_288 * part_of_acceleration_266 * part_of_acceleration_263) / part_of_acceleration_268
    part_of_acceleration_290 = (part_of_acceleration_284 - part_of_acceleration_288 * part_of_acceleration_269 * part_of_acceleration_263 - part_of_acceleration_289 * part_of_acceleration_270 * part_of_acceleration_268) / part_of_acceleration_272
    part_of_acceleration_291 = (part_of_acceleration_281 - part_of_acceleration_288 * part_of_acceleration_275 * part_of_acceleration_263 - part_of_acceleration_289 * part_of_acceleration_276 * part_of_acceleration_268 - part_of_acceleration_290 * part_of_acceleration_277 * part_of_acceleration_272) / part_of_acceleration_279
    part_of_acceleration_292 = inputs.w_forearm_roll - F_hat_on_forearm_roll - part_of_acceleration_143 - part_of_acceleration_288 * part_of_acceleration_158 - part_of_acceleration_289 * part_of_acceleration_267 - part_of_acceleration_290 * part_of_acceleration_271 - part_of_acceleration_291 * part_of_acceleration_278
    part_of_acceleration_293 = part_of_acceleration_220 - part_of_acceleration_288 * part_of_acceleration_288 * part_of_acceleration_263 - part_of_acceleration_289 * part_of_acceleration_289 * part_of_acceleration_268 - part_of_acceleration_290 * part_of_acceleration_290 * part_of_acceleration_272 - part_of_acceleration_291 * part_of_acceleration_291 * part_of_acceleration_279
    part_of_acceleration_294 = part_of_acceleration_178 + part_of_acceleration_176
    part_of_acceleration_295 = part_of_acceleration_194 - 0.02 * part_of_acceleration_294
    part_of_acceleration_296 = part_of_acceleration_47 * part_of_acceleration_294
    part_of_acceleration_297 = part_of_acceleration_46 * part_of_acceleration_192 - part_of_acceleration_47 * part_of_acceleration_295 + 0.37 * part_of_acceleration_296
    part_of_acceleration_298 = part_of_acceleration_27 * part_of_acceleration_297 - part_of_acceleration_26 * part_of_acceleration_207
    part_of_acceleration_299 = part_of_acceleration_26 * part_of_acceleration_297 + part_of_acceleration_27 * part_of_acceleration_207 + 0.02 * part_of_acceleration_296
    part_of_acceleration_300 = part_of_acceleration_46 * part_of_acceleration_294
    part_of_acceleration_301 = 0.37 * part_of_acceleration_300 - (part_of_acceleration_47 * part_of_acceleration_192 + part_of_acceleration_46 * part_of_acceleration_295)
    part_of_acceleration_302 = part_of_acceleration_26 * part_of_acceleration_300 + part_of_acceleration_27 * (part_of_acceleration_203 - part_of_acceleration_202)
    part_of_acceleration_303 = part_of_acceleration_301 + 0.02 * part_of_acceleration_302
    part_of_acceleration_304 = (part_of_acceleration_4 * part_of_acceleration_298 - part_of_acceleration_1 * (part_of_acceleration_9 * part_of_acceleration_299 + part_of_acceleration_10 * part_of_acceleration_303 - -0.39 * (part_of_acceleration_10 * part_of_acceleration_302 + part_of_acceleration_9 * part_of_acceleration_296))) / part_of_acceleration_263
    part_of_acceleration_305 = (part_of_acceleration_10 * part_of_acceleration_299 - part_of_acceleration_9 * part_of_acceleration_303 - -0.39 * (part_of_acceleration_10 * part_of_acceleration_296 - part_of_acceleration_9 * part_of_acceleration_302) + part_of_acceleration_304 * part_of_acceleration_266 * part_of_acceleration_263) / part_of_acceleration_268
    part_of_acceleration_306 = (part_of_acceleration_298 - part_of_acceleration_304 * part_of_acceleration_269 * part_of_acceleration_263 - part_of_acceleration_305 * part_of_acceleration_270 * part_of_acceleration_268) / part_of_acceleration_272
    part_of_acceleration_307 = (part_of_acceleration_301 - part_of_acceleration_304 * part_of_acceleration_275 * part_of_acceleration_263 - part_of_acceleration_305 * part_of_acceleration_276 * part_of_acceleration_268 - part_of_acceleration_306 * part_of_acceleration_277 * part_of_acceleration_272) / part_of_acceleration_279
    part_of_acceleration_308 = (part_of_acceleration_207 + part_of_acceleration_304 * part_of_acceleration_288 * part_of_acceleration_263 + part_of_acceleration_305 * part_of_acceleration_289 * part_of_acceleration_268 + part_of_acceleration_306 * part_of_acceleration_290 * part_of_acceleration_272 + part_of_acceleration_307 * part_of_acceleration_291 * part_of_acceleration_279) / part_of_acceleration_293
    part_of_acceleration_309 = inputs.w_wrist_pitch - F_hat_on_wrist_pitch - part_of_acceleration_132 - part_of_acceleration_304 * part_of_acceleration_158 - part_of_acceleration_305 * part_of_acceleration_267 - part_of_acceleration_306 * part_of_acceleration_271 - part_of_acceleration_307 * part_of_acceleration_278 + part_of_acceleration_308 * part_of_acceleration_292
    part_of_acceleration_310 = part_of_acceleration_194 - part_of_acceleration_304 * part_of_acceleration_304 * part_of_acceleration_263 - part_of_acceleration_305 * part_of_acceleration_305 * part_of_acceleration_268 - part_of_acceleration_306 * part_of_acceleration_306 * part_of_acceleration_272 - part_of_acceleration_307 * part_of_acceleration_307 * part_of_acceleration_279 - part_of_acceleration_308 * part_of_acceleration_308 * part_of_acceleration_293
    part_of_acceleration_311 = -0.00010609713490378755 * part_of_acceleration_84 - -4.61970849156906e-05 * part_of_acceleration_87
    part_of_acceleration_312 = -0.0010574324179126171 * part_of_acceleration_84 - -0.0004604299187458012 * part_of_acceleration_87
    part_of_acceleration_313 = part_of_acceleration_184 + (0.05 * part_of_acceleration_311 - -0.06 * part_of_acceleration_312)
    part_of_acceleration_314 = -0.0010627416997969527 * part_of_acceleration_87 + -0.0004627416997969522 * part_of_acceleration_84
    part_of_acceleration_315 = part_of_acceleration_161 + -0.06 * part_of_acceleration_314
    part_of_acceleration_316 = part_of_acceleration_167 - 0.05 * part_of_acceleration_314
    part_of_acceleration_317 = part_of_acceleration_65 * part_of_acceleration_315 - part_of_acceleration_66 * part_of_acceleration_316 - 0.02 * part_of_acceleration_314
    part_of_acceleration_318 = part_of_acceleration_65 * part_of_acceleration_312 - part_of_acceleration_66 * part_of_acceleration_311
    part_of_acceleration_319 = part_of_acceleration_313 + 0.02 * part_of_acceleration_318
    part_of_acceleration_320 = part_of_acceleration_47 * part_of_acceleration_318 + part_of_acceleration_46 * part_of_acceleration_314
    part_of_acceleration_321 = part_of_acceleration_46 * part_of_acceleration_317 - part_of_acceleration_47 * part_of_acceleration_319 - 0.37 * part_of_acceleration_320
    part_of_acceleration_322 = part_of_acceleration_66 * part_of_acceleration_315 + part_of_acceleration_65 * part_of_acceleration_316
    part_of_acceleration_323 = part_of_acceleration_27 * part_of_acceleration_321 - part_of_acceleration_26 * part_of_acceleration_322
    part_of_acceleration_324 = part_of_acceleration_26 * part_of_acceleration_321 + part_of_acceleration_27 * part_of_acceleration_322 - 0.02 * part_of_acceleration_320
    part_of_acceleration_325 = part_of_acceleration_46 * part_of_acceleration_318 - part_of_acceleration_47 * part_of_acceleration_314
    part_of_acceleration_326 = part_of_acceleration_47 * part_of_acceleration_317 + part_of_acceleration_46 * part_of_acceleration_319 + 0.37 * part_of_acceleration_325
    part_of_acceleration_327 = part_of_acceleration_26 * part_of_acceleration_325 + part_of_acceleration_27 * (part_of_acceleration_66 * part_of_acceleration_312 + part_of_acceleration_65 * part_of_acceleration_311)
    part_of_acceleration_328 = part_of_acceleration_326 + 0.02 * part_of_acceleration_327
    part_of_acceleration_329 = (part_of_acceleration_4 * part_of_acceleration_323 - part_of_acceleration_1 * (part_of_acceleration_9 * part_of_acceleration_324 - part_of_acceleration_10 * part_of_acceleration_328 + -0.39 * (part_of_acceleration_10 * part_of_acceleration_327 + part_of_acceleration_9 * part_of_acceleration_320))) / part_of_acceleration_263
    part_of_acceleration_330 = (part_of_acceleration_10 * part_of_acceleration_324 + part_of_acceleration_9 * part_of_acceleration_328 - -0.39 * (part_of_acceleration_9 * part_of_acceleration_327 - part_of_acceleration_10 * part_of_acceleration_320) + part_of_acceleration_329 * part_of_acceleration_266 * part_of_acceleration_263) / part_of_acceleration_268
    part_of_acceleration_331 = (part_of_acceleration_323 - part_of_acceleration_329 * part_of_acceleration_269 * part_of_acceleration_263 - part_of_acceleration_330 * part_of_acceleration_270 * part_of_acceleration_268) / part_of_acceleration_272
    part_of_acceleration_332 = (part_of_acceleration_326 + part_of_acceleration_329 * part_of_acceleration_275 * part_of_acceleration_263 + part_of_acceleration_330 * part_of_acceleration_276 * part_of_acceleration_268 + part_of_acceleration_331 * part_of_acceleration_277 * part_of_acceleration_272) / part_of_acceleration_279
    part_of_acceleration_333 = (part_of_acceleration_332 * part_of_acceleration_291 * part_of_acceleration_279 - (part_of_acceleration_322 + part_of_acceleration_329 * part_of_acceleration_288 * part_of_acceleration_263 + part_of_acceleration_330 * part_of_acceleration_289 * part_of_acceleration_268 + part_of_acceleration_331 * part_of_acceleration_290 * part_of_acceleration_272)) / part_of_acceleration_293
    part_of_acceleration_334 = (part_of_acceleration_313 - part_of_acceleration_329 * part_of_acceleration_304 * part_of_acceleration_263 - part_of_acceleration_330 * part_of_acceleration_305 * part_of_acceleration_268 - part_of_acceleration_331 * part_of_acceleration_306 * part_of_acceleration_272 + part_of_acceleration_332 * part_of_acceleration_307 * part_of_acceleration_279 + part_of_acceleration_333 * part_of_acceleration_308 * part_of_acceleration_293) / part_of_acceleration_310
    part_of_acceleration_335 = (inputs.w_hand_roll - F_hat_on_hand_roll - part_of_acceleration_117 - part_of_acceleration_329 * part_of_acceleration_158 - part_of_acceleration_330 * part_of_acceleration_267 - part_of_acceleration_331 * part_of_acceleration_271 + part_of_acceleration_332 * part_of_acceleration_278 - part_of_acceleration_333 * part_of_acceleration_292 - part_of_acceleration_334 * part_of_acceleration_309) / (0.0020206 - part_of_acceleration_329 * part_of_acceleration_329 * part_of_acceleration_263 - part_of_acceleration_330 * part_of_acceleration_330 * part_of_acceleration_268 - part_of_acceleration_331 * part_of_acceleration_331 * part_of_acceleration_272 - part_of_acceleration_332 * part_of_acceleration_332 * part_of_acceleration_279 - part_of_acceleration_333 * part_of_acceleration_333 * part_of_acceleration_293 - part_of_acceleration_334 * part_of_acceleration_334 * part_of_acceleration_310)
    part_of_acceleration_336 = part_of_acceleration_309 / part_of_acceleration_310 - part_of_acceleration_334 * part_of_acceleration_335
    part_of_acceleration_337 = part_of_acceleration_292 / part_of_acceleration_293 + part_of_acceleration_308 * part_of_acceleration_336 - part_of_acceleration_333 * part_of_acceleration_335
    part_of_acceleration_338 = part_of_acceleration_278 / part_of_acceleration_279 - part_of_acceleration_291 * part_of_acceleration_337 - part_of_acceleration_307 * part_of_acceleration_336 + part_of_acceleration_332 * part_of_acceleration_335
    part_of_acceleration_339 = part_of_acceleration_271 / part_of_acceleration_272 - part_of_acceleration_277 * part_of_acceleration_338 - part_of_acceleration_290 * part_of_acceleration_337 - part_of_acceleration_306 * part_of_acceleration_336 - part_of_acceleration_331 * part_of_acceleration_335
    part_of_acceleration_340 = part_of_acceleration_267 / part_of_acceleration_268 - part_of_acceleration_270 * part_of_acceleration_339 - part_of_acceleration_276 * part_of_acceleration_338 - part_of_acceleration_289 * part_of_acceleration_337 - part_of_acceleration_305 * part_of_acceleration_336 - part_of_acceleration_330 * part_of_acceleration_335
    v_shoulder_yaw_dot_hat = part_of_acceleration_158 / part_of_acceleration_263 + part_of_acceleration_266 * part_of_acceleration_340 - part_of_acceleration_269 * part_of_acceleration_339 - part_of_acceleration_275 * part_of_acceleration_338 - part_of_acceleration_288 * part_of_acceleration_337 - part_of_acceleration_304 * part_of_acceleration_336 - part_of_acceleration_329 * part_of_acceleration_335  # rad/s^2
    v_shoulder_pitch_dot_hat = part_of_acceleration_340  # rad/s^2
    v_arm_roll_dot_hat = part_of_acceleration_339  # rad/s^2
    v_elbow_pitch_dot_hat = part_of_acceleration_338  # rad/s^2
    v_forearm_roll_dot_hat = part_of_acceleration_337  # rad/s^2
    v_wrist_pitch_dot_hat = part_of_acceleration_336  # rad/s^2
    v_hand_roll_dot_hat = part_of_acceleration_335  # rad/s^2

    # states one sample later (explicit Euler)
    z_v_shoulder_yaw_next = state.z_v_shoulder_yaw + parameters.sample_time * (v_shoulder_yaw_dot_hat - parameters.K_v_v_shoulder_yaw * v_shoulder_yaw_hat)
    z_v_shoulder_pitch_next = state.z_v_shoulder_pitch + parameters.sample_time * (v_shoulder_pitch_dot_hat - parameters.K_v_v_shoulder_pitch * v_shoulder_pitch_hat)
    z_v_arm_roll_next = state.z_v_arm_roll + parameters.sample_time * (v_arm_roll_dot_hat - parameters.K_v_v_arm_roll * v_arm_roll_hat)
    z_v_elbow_pitch_next = state.z_v_elbow_pitch + parameters.sample_time * (v_elbow_pitch_dot_hat - parameters.K_v_v_elbow_pitch * v_elbow_pitch_hat)
    z_v_forearm_roll_next = state.z_v_forearm_roll + parameters.sample_time * (v_forearm_roll_dot_hat - parameters.K_v_v_forearm_roll * v_forearm_roll_hat)
    z_v_wrist_pitch_next = state.z_v_wrist_pitch + parameters.sample_time * (v_wrist_pitch_dot_hat - parameters.K_v_v_wrist_pitch * v_wrist_pitch_hat)
    z_v_hand_roll_next = state.z_v_hand_roll + parameters.sample_time * (v_hand_roll_dot_hat - parameters.K_v_v_hand_roll * v_hand_roll_hat)
    z_shoulder_yaw_next = state.z_shoulder_yaw - parameters.sample_time * (parameters.K_1_shoulder_yaw * v_shoulder_yaw_hat + parameters.K_2_shoulder_yaw * v_shoulder_yaw_dot_hat)
    z_shoulder_pitch_next = state.z_shoulder_pitch - parameters.sample_time * (parameters.K_1_shoulder_pitch * v_shoulder_pitch_hat + parameters.K_2_shoulder_pitch * v_shoulder_pitch_dot_hat)
    z_arm_roll_next = state.z_arm_roll - parameters.sample_time * (parameters.K_1_arm_roll * v_arm_roll_hat + parameters.K_2_arm_roll * v_arm_roll_dot_hat)
    z_elbow_pitch_next = state.z_elbow_pitch - parameters.sample_time * (parameters.K_1_elbow_pitch * v_elbow_pitch_hat + parameters.K_2_elbow_pitch * v_elbow_pitch_dot_hat)
    z_forearm_roll_next = state.z_forearm_roll - parameters.sample_time * (parameters.K_1_forearm_roll * v_forearm_roll_hat + parameters.K_2_forearm_roll * v_forearm_roll_dot_hat)
    z_wrist_pitch_next = state.z_wrist_pitch - parameters.sample_time * (parameters.K_1_wrist_pitch * v_wrist_pitch_hat + parameters.K_2_wrist_pitch * v_wrist_pitch_dot_hat)
    z_hand_roll_next = state.z_hand_roll - parameters.sample_time * (parameters.K_1_hand_roll * v_hand_roll_hat + parameters.K_2_hand_roll * v_hand_roll_dot_hat)
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

    return Outputs(
        v_shoulder_yaw_hat=v_shoulder_yaw_hat,
        v_shoulder_pitch_hat=v_shoulder_pitch_hat,
        v_arm_roll_hat=v_arm_roll_hat,
        v_elbow_pitch_hat=v_elbow_pitch_hat,
        v_forearm_roll_hat=v_forearm_roll_hat,
        v_wrist_pitch_hat=v_wrist_pitch_hat,
        v_hand_roll_hat=v_hand_roll_hat,
        tracked_shoulder_yaw=tracked_shoulder_yaw,
        tracked_shoulder_pitch=tracked_shoulder_pitch,
        tracked_arm_roll=tracked_arm_roll,
        tracked_elbow_pitch=tracked_elbow_pitch,
        tracked_forearm_roll=tracked_forearm_roll,
        tracked_wrist_pitch=tracked_wrist_pitch,
        tracked_hand_roll=tracked_hand_roll,
        F_hat_on_shoulder_yaw=F_hat_on_shoulder_yaw,
        F_hat_on_shoulder_pitch=F_hat_on_shoulder_pitch,
        F_hat_on_arm_roll=F_hat_on_arm_roll,
        F_hat_on_elbow_pitch=F_hat_on_elbow_pitch,
        F_hat_on_forearm_roll=F_hat_on_forearm_roll,
        F_hat_on_wrist_pitch=F_hat_on_wrist_pitch,
        F_hat_on_hand_roll=F_hat_on_hand_roll,
    )

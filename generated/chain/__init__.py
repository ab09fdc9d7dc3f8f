"""chain: friction observer GCFO, velocity estimated, double precision.

Made by stiction 0.1.0 from chain.yaml
sha256 b931a2bc6bd00bf64052ceced86f25ef4dcd72dd152d298eae1b835ca222581a
with: stiction generate chain.yaml

The twin of chain.c: the same operations in the same order on doubles, with bit-identical results.
Do not edit.
"""

import math
from dataclasses import dataclass, field

__all__ = ["Inputs", "Outputs", "Parameters", "State", "init", "prepare", "step"]

SPEC_SHA256 = "b931a2bc6bd00bf64052ceced86f25ef4dcd72dd152d298eae1b835ca222581a"
LARGEST = 1e+150
# modes: what the next valid sample does
RUNNING = 0  # gives new estimates
HOLDING = 1  # after 8 invalid samples in a row: sets the state so that the estimates equal the held ones
STARTING = 2  # no sample was valid so far: initialises the state
ENVELOPE = {  # lower and upper limits: the operating region for which certificate.json holds
    "v1": ("-1/2", "1/2"),
    "v2": ("-1/2", "1/2"),
    "v3": ("-1/2", "1/2"),
    "v4": ("-1/2", "1/2"),
    "v5": ("-1/2", "1/2"),
    "v6": ("-1/2", "1/2"),
    "v7": ("-1/2", "1/2"),
    "v8": ("-1/2", "1/2"),
    "v9": ("-1/2", "1/2"),
    "v10": ("-1/2", "1/2"),
    "v11": ("-1/2", "1/2"),
    "v12": ("-1/2", "1/2"),
    "v13": ("-1/2", "1/2"),
    "v14": ("-1/2", "1/2"),
    "v15": ("-1/2", "1/2"),
    "v16": ("-1/2", "1/2"),
    "v1_dot": ("-5", "5"),
    "v2_dot": ("-5", "5"),
    "v3_dot": ("-5", "5"),
    "v4_dot": ("-5", "5"),
    "v5_dot": ("-5", "5"),
    "v6_dot": ("-5", "5"),
    "v7_dot": ("-5", "5"),
    "v8_dot": ("-5", "5"),
    "v9_dot": ("-5", "5"),
    "v10_dot": ("-5", "5"),
    "v11_dot": ("-5", "5"),
    "v12_dot": ("-5", "5"),
    "v13_dot": ("-5", "5"),
    "v14_dot": ("-5", "5"),
    "v15_dot": ("-5", "5"),
    "v16_dot": ("-5", "5"),
    "x1_noise": ("-1/200000", "1/200000"),
    "x2_noise": ("-1/200000", "1/200000"),
    "x3_noise": ("-1/200000", "1/200000"),
    "x4_noise": ("-1/200000", "1/200000"),
    "x5_noise": ("-1/200000", "1/200000"),
    "x6_noise": ("-1/200000", "1/200000"),
    "x7_noise": ("-1/200000", "1/200000"),
    "x8_noise": ("-1/200000", "1/200000"),
    "x9_noise": ("-1/200000", "1/200000"),
    "x10_noise": ("-1/200000", "1/200000"),
    "x11_noise": ("-1/200000", "1/200000"),
    "x12_noise": ("-1/200000", "1/200000"),
    "x13_noise": ("-1/200000", "1/200000"),
    "x14_noise": ("-1/200000", "1/200000"),
    "x15_noise": ("-1/200000", "1/200000"),
    "x16_noise": ("-1/200000", "1/200000"),
}


@dataclass(slots=True)
class Parameters:
    """Model constants and gains with the spec's values, followed by the constants that ``prepare`` derives from them."""

    m: float = 1.0  # kg: model parameter
    k: float = 100.0  # N/m: model parameter
    c: float = 0.5  # N*s/m: model parameter
    ground_a: list[float] = field(  # N: ground1_a to ground16_a, model parameter
        default_factory=lambda: [
            0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5
        ]
    )
    K_F_ground: list[float] = field(  # N*s/m: K_F_ground1 to K_F_ground16, observer gain
        default_factory=lambda: [
            20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0
        ]
    )
    K_v_v: list[float] = field(  # 1/s: K_v_v1 to K_v_v16, observer gain
        default_factory=lambda: [
            20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0
        ]
    )
    sample_time: float = 0.001  # s: sample time
    one_over_D16: float = 1.0
    h_K_F_ground: list[float] = field(
        default_factory=lambda: [
            0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02
        ]
    )


@dataclass(slots=True)
class State:
    """State of the observer between two samples."""

    z_v: list[float] = field(  # m/s: z_v1 to z_v16, observer state
        default_factory=lambda: [
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        ]
    )
    z_ground: list[float] = field(  # N: z_ground1 to z_ground16, observer state
        default_factory=lambda: [
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        ]
    )
    mode: int = RUNNING
    invalid_samples: int = 0  # in a row; the count restarts after a valid one


@dataclass(slots=True)
class Inputs:
    """Measurements and commands at a sample."""

    x: list[float] = field(  # m: x1 to x16, measured position
        default_factory=lambda: [
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        ]
    )
    w: float = 0.0  # N: input


@dataclass(slots=True)
class Outputs:
    """Estimates at a sample."""

    v_hat: list[float] = field(  # m/s: v1_hat to v16_hat, velocity estimate, (4.25)
        default_factory=lambda: [
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        ]
    )
    a_hat_ground: list[float] = field(  # N: a_hat_ground1 to a_hat_ground16, friction level, (4.11)
        default_factory=lambda: [
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        ]
    )
    F_hat_ground: list[float] = field(  # N: F_hat_ground1 to F_hat_ground16, contact friction, (4.10)
        default_factory=lambda: [
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        ]
    )
    F_hat_on_x: list[float] = field(  # N: F_hat_on_x1 to F_hat_on_x16, friction force, (4.10)
        default_factory=lambda: [
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        ]
    )
    fault: int = 0  # 1 if this sample was not used


def _sign(u: float) -> float:
    return 1.0 if u > 0.0 else (-1.0 if u < 0.0 else 0.0)


def prepare(parameters: Parameters) -> None:
    """Compute the derived constants again, after a parameter was changed."""
    parameters.one_over_D16 = 1.0 / parameters.m
    for i in range(0, 16):
        parameters.h_K_F_ground[i] = parameters.sample_time * parameters.K_F_ground[i]


def init(parameters: Parameters, inputs: Inputs) -> State:
    """The initial state, from the first measurement; if that is invalid, the first valid sample sets it."""
    state = State()
    for i in range(0, 16):
        state.z_v[i] = -(parameters.K_v_v[i] * inputs.x[i])
        state.z_ground[i] = parameters.ground_a[i]
    check = abs(inputs.w)
    for i in range(0, 16):
        check += abs(inputs.x[i]) + abs(state.z_v[i]) + abs(state.z_ground[i])
    if not abs(check) <= LARGEST:
        state = State(mode=STARTING)
    return state


def _predict(state: State, parameters: Parameters, outputs: Outputs) -> None:
    """Predict the state over an invalid sample, as if the machine moved at the held velocity estimate."""
    for i in range(0, 16):
        state.z_v[i] = state.z_v[i] - parameters.sample_time * parameters.K_v_v[i] * outputs.v_hat[i]
    if state.mode == RUNNING:
        if outputs.fault == 0:
            state.invalid_samples = 0  # the sample before was valid
        state.invalid_samples += 1
        if state.invalid_samples >= 8:
            state.mode = HOLDING


def _resume(state: State, parameters: Parameters, inputs: Inputs, outputs: Outputs) -> None:
    """Set the state from a valid sample so that the estimates equal the held ones."""
    for i in range(0, 16):
        state.z_v[i] = (
            outputs.v_hat[i] - parameters.K_v_v[i] * (inputs.x[i] + parameters.sample_time * outputs.v_hat[i])
        )
        state.z_ground[i] = outputs.a_hat_ground[i] + parameters.K_F_ground[i] * abs(outputs.v_hat[i])
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
    v_hat = [0.0] * 16
    sign_ground = [0.0] * 15
    a_hat_ground = [0.0] * 16
    F_hat_ground = [0.0] * 16
    z_v_next = [0.0] * 16
    z_ground_next = [0.0] * 16

    # velocity estimate, (4.25)
    v_hat[0] = parameters.K_v_v[0] * inputs.x[0] + state.z_v[0]  # m/s
    v_hat[15] = parameters.K_v_v[15] * inputs.x[15] + state.z_v[15]  # m/s
    # slip sign, (4.13)
    sign_ground1 = _sign(v_hat[0])  # 1
    sign_ground16 = _sign(v_hat[15])  # 1
    # friction level, (4.11)
    a_hat_ground[0] = state.z_ground[0] - parameters.K_F_ground[0] * abs(v_hat[0])  # N
    a_hat_ground[15] = state.z_ground[15] - parameters.K_F_ground[15] * abs(v_hat[15])  # N
    # contact friction, (4.10)
    F_hat_ground[0] = sign_ground1 * a_hat_ground[0]  # N
    F_hat_ground[15] = sign_ground16 * a_hat_ground[15]  # N
    for i in range(1, 15):
        # velocity estimate, (4.25)
        v_hat[i] = parameters.K_v_v[i] * inputs.x[i] + state.z_v[i]  # m/s
        # slip sign, (4.13)
        sign_ground[i] = _sign(v_hat[i])  # 1
        # friction level, (4.11)
        a_hat_ground[i] = state.z_ground[i] - parameters.K_F_ground[i] * abs(v_hat[i])  # N
        # contact friction, (4.10)
        F_hat_ground[i] = sign_ground[i] * a_hat_ground[i]  # N
    # acceleration, (4.2)
    v1_dot_hat = (
        parameters.one_over_D16 * (parameters.c * (v_hat[1] - v_hat[0]) + parameters.k * (inputs.x[1]
        - inputs.x[0]) - F_hat_ground[0] + inputs.w)
    )  # m/s^2
    v16_dot_hat = (
        parameters.one_over_D16 * (parameters.c * (v_hat[14] - v_hat[15]) + parameters.k * (inputs.x[14]
        - inputs.x[15]) - F_hat_ground[15])
    )  # m/s^2
    # states one sample later (explicit Euler)
    z_v_next[0] = parameters.sample_time * (v1_dot_hat - parameters.K_v_v[0] * v_hat[0]) + state.z_v[0]  # m/s
    z_v_next[15] = parameters.sample_time * (v16_dot_hat - parameters.K_v_v[15] * v_hat[15]) + state.z_v[15]  # m/s
    z_ground_next[0] = parameters.h_K_F_ground[0] * sign_ground1 * v1_dot_hat + state.z_ground[0]  # N
    z_ground_next[15] = parameters.h_K_F_ground[15] * sign_ground16 * v16_dot_hat + state.z_ground[15]  # N
    for i in range(1, 15):
        # acceleration, (4.2)
        v_dot_hat = (
            parameters.one_over_D16 * (parameters.c * (v_hat[i - 1] - 2.0 * v_hat[i] + v_hat[i + 1])
            + parameters.k * (inputs.x[i - 1] - 2.0 * inputs.x[i] + inputs.x[i + 1]) - F_hat_ground[i])
        )  # m/s^2
        # states one sample later (explicit Euler)
        z_v_next[i] = parameters.sample_time * (v_dot_hat - parameters.K_v_v[i] * v_hat[i]) + state.z_v[i]  # m/s
        z_ground_next[i] = parameters.h_K_F_ground[i] * sign_ground[i] * v_dot_hat + state.z_ground[i]  # N

    # this sum is too large or NaN if a next state is, or an input or output on which no next state depends
    check = 0.0
    for i in range(0, 16):
        check += z_v_next[i] + z_ground_next[i]
    if state.mode != RUNNING or not abs(check) <= LARGEST:
        given = abs(inputs.w)
        for i in range(0, 16):
            given += abs(inputs.x[i])
        _handle_fault(state, parameters, inputs, outputs, abs(given) <= LARGEST)
        return outputs
    outputs.fault = 0
    for i in range(0, 16):
        outputs.v_hat[i] = v_hat[i]
    for i in range(0, 16):
        outputs.a_hat_ground[i] = a_hat_ground[i]
    for i in range(0, 16):
        outputs.F_hat_ground[i] = F_hat_ground[i]
    for i in range(0, 16):
        outputs.F_hat_on_x[i] = F_hat_ground[i]
    for i in range(0, 16):
        state.z_v[i] = z_v_next[i]
    for i in range(0, 16):
        state.z_ground[i] = z_ground_next[i]
    return outputs

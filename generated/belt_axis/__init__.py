"""belt_axis: friction observer GCFO, velocity estimated, double precision.

Made by stiction 0.1.0 from belt_axis.yaml
sha256 011c159c52aff177b4ffacdfdb486cf7c777fa8381d977de25a0d69ba40ac64f
with: stiction generate belt_axis.yaml

The twin of belt_axis.c: the same operations in the same order on doubles, so the same bits. Do not edit.
"""

import math
from dataclasses import dataclass

__all__ = ["Inputs", "Outputs", "Parameters", "State", "init", "prepare", "step"]

SPEC_SHA256 = "011c159c52aff177b4ffacdfdb486cf7c777fa8381d977de25a0d69ba40ac64f"
LARGEST = 1e+150
ENVELOPE = {  # low and high: where the certificate beside this file speaks
    "v": ("-1", "1"),
    "v_dot": ("-8", "8"),
    "x_noise": ("-1/400000", "1/400000"),
}


@dataclass(slots=True)
class Parameters:
    """Constants of the model and gains, with the spec's values; behind them what ``prepare`` derives from these."""

    m: float = 4.2  # kg: model parameter
    kf: float = 18.5  # N/V: model parameter
    b: float = 12.0  # N*s/m: model parameter
    guide_a: float = 9.0  # N: model parameter
    K_F: float = 250.0  # N*s/m: observer gain
    K_v: float = 120.0  # 1/s: observer gain
    sample_time: float = 0.001  # s: sample time
    one_over_m: float = 0.23809523809523808  # 1.0 / m
    h_K_F: float = 0.25  # sample_time * K_F


@dataclass(slots=True)
class State:
    """What the observer remembers from sample to sample."""

    z_v: float = 0.0  # m/s: observer state
    z_guide: float = 0.0  # N: observer state
    waiting: float = 0.0  # 1 until a good sample has set the state; below 1/2 in use


@dataclass(slots=True)
class Inputs:
    """What is measured and commanded at a sample."""

    x: float = 0.0  # m: measured position
    u: float = 0.0  # V: input


@dataclass(slots=True)
class Outputs:
    """What is estimated."""

    v_hat: float = 0.0  # m/s: velocity estimate, (4.25)
    a_hat_guide: float = 0.0  # N: friction level, (4.11)
    F_hat_guide: float = 0.0  # N: contact friction, (4.10)
    F_hat_on_x: float = 0.0  # N: friction force, (4.10)
    fault: int = 0  # 1 if this sample was not used


def _sign(u: float) -> float:
    return 1.0 if u > 0.0 else (-1.0 if u < 0.0 else 0.0)


def prepare(parameters: Parameters) -> None:
    """Compute the derived constants anew, after a parameter was changed."""
    parameters.one_over_m = 1.0 / parameters.m
    parameters.h_K_F = parameters.sample_time * parameters.K_F


def init(parameters: Parameters, inputs: Inputs) -> State:
    """The state from the first measurement; if that cannot be used, one that waits for a good sample."""
    state = State(
        z_v=-(parameters.K_v * inputs.x),
        z_guide=parameters.guide_a,
    )
    check = inputs.x + inputs.u + state.z_v + state.z_guide
    if not abs(check) <= LARGEST:
        state = State(waiting=1.0)
    return state


def _miss(state: State, parameters: Parameters, outputs: Outputs) -> None:
    """A sample is lost: the machine is taken to go on with the velocity that is held, and the states with it."""
    state.z_v = state.z_v - parameters.sample_time * parameters.K_v * outputs.v_hat
    if state.waiting < 0.5:
        state.waiting = (state.waiting if outputs.fault else 0.0) + 0.0625


def _resume(state: State, parameters: Parameters, inputs: Inputs, outputs: Outputs) -> None:
    """Set the state from a good sample after many that were lost, so that the estimates go on from the held ones."""
    state.z_v = outputs.v_hat - parameters.K_v * (inputs.x + parameters.sample_time * outputs.v_hat)
    state.z_guide = outputs.a_hat_guide + parameters.K_F * abs(outputs.v_hat)
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
    v_hat = state.z_v + parameters.K_v * inputs.x  # m/s

    # slip sign, (4.13)
    sign_guide = _sign(v_hat)  # 1

    # friction level, (4.11)
    a_hat_guide = state.z_guide - parameters.K_F * abs(v_hat)  # N

    # contact friction, (4.10)
    F_hat_guide = sign_guide * a_hat_guide  # N

    # acceleration, (4.2)
    v_dot_hat = parameters.one_over_m * (parameters.kf * inputs.u - F_hat_guide - parameters.b * v_hat)  # m/s^2

    # states one sample later (explicit Euler)
    z_v_next = state.z_v + parameters.sample_time * (v_dot_hat - parameters.K_v * v_hat)
    z_guide_next = state.z_guide + parameters.h_K_F * sign_guide * v_dot_hat

    # hold the last state and estimates where a next state, or an input that it does not show, is too large or NaN
    check = z_v_next + z_guide_next
    if state.waiting >= 0.5 or not abs(check) <= LARGEST:
        given = inputs.x + inputs.u
        _set_anew(state, parameters, inputs, outputs, abs(given) <= LARGEST)
        return outputs
    outputs.fault = 0
    outputs.v_hat = v_hat
    outputs.a_hat_guide = a_hat_guide
    outputs.F_hat_guide = F_hat_guide
    outputs.F_hat_on_x = F_hat_guide
    state.z_v = z_v_next
    state.z_guide = z_guide_next
    return outputs

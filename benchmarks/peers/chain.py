"""A chain of n masses on springs, each with friction to the ground: its spec, and its step as a CasADi function."""

from __future__ import annotations

from pathlib import Path

import casadi
import numpy as np

from benchmarks.measure.build import Peer
from benchmarks.model import NUDGE
from benchmarks.peers.casadi_c import Step, compiled_step
from benchmarks.text import render

MASS, SPRING, LEVEL, K_F, K_V, SAMPLE_TIME = 1.0, 100.0, 0.5, 20.0, 20.0, 0.001


def chain_spec(n: int, folder: Path) -> Path:
    """The spec file of a chain."""
    target = folder / f"chain_{n}.yaml"
    words = {"mass": MASS, "spring": SPRING, "level": LEVEL, "K_F": K_F, "K_v": K_V, "sample_time": SAMPLE_TIME}
    target.write_text(render("chain.yaml.j2", n=n, **words), encoding="utf-8")
    return target


def chain_rows(n: int, samples: int) -> np.ndarray:
    """Positions and the one input, samples by n + 1."""
    turn = 2.0 * np.pi * np.arange(samples) / samples
    columns = [0.1 * np.sin((1 + k % 3) * turn + 0.7 + 1.3 * k) for k in range(n)]
    return np.column_stack([*columns, 5.0 * np.sin(turn)])


def chain_casadi(n: int, title: str, limit: float) -> Peer:
    """CasADi's C of the chain's step, written with vectors as its user would."""
    x, w = casadi.SX.sym("x", n), casadi.SX.sym("w")
    z_v, z = casadi.SX.sym("z_v", n), casadi.SX.sym("z", n)
    p = casadi.SX.sym("p", 6)
    mass, spring, level_gain, velocity_gain, h = p[0], p[1], p[3], p[4], p[5]
    v = z_v + velocity_gain * x
    sign = casadi.sign(v)
    level = z - level_gain * casadi.fabs(v)
    friction = level * sign
    stretch = casadi.diff(x) if n > 1 else casadi.SX(0, 1)
    pull = spring * stretch
    force = casadi.vertcat(pull, 0) - casadi.vertcat(0, pull) + casadi.vertcat(w, casadi.SX.zeros(n - 1))
    a = (force - friction) / mass
    following = casadi.vertcat(z_v + h * (a - velocity_gain * v), z + h * level_gain * sign * a)
    outputs = casadi.vertcat(v, level, friction, friction)
    step = Step(casadi.vertcat(z_v, z), casadi.vertcat(x, w), p, following, outputs, False)
    first = np.concatenate([-K_V * chain_rows(n, 2)[0][:n], np.full(n, LEVEL)]) + NUDGE * (1 + np.arange(2 * n))
    values = [MASS, SPRING, LEVEL, K_F, K_V, SAMPLE_TIME]
    return compiled_step(step, title, first.tolist(), values, limit, cse=True)

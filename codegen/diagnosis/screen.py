"""Where the fit of each candidate starts: shapes tried on free runs near the refit, weights by least squares."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis.output_error import Shot, means, segment_cost, segment_weights
from codegen.diagnosis.trial import CHAIN, STRUCTURE, Part, Runner
from codegen.effects import CATALOGUE

Array = NDArray[np.float64]

SMALL = 1e-3
"""Size of a probe of a weight, in what would be a large effect."""


@dataclass(frozen=True)
class Scales:
    """Typical sizes at a place, SI: force, position, speed, input, inertia, and the log's times."""

    force: float
    position: float
    speed: float
    input: float
    inertia: float
    level: float
    noise: float
    sample_time: float
    duration: float
    cutoff_hz: float
    periods: Mapping[str, tuple[float, ...]]

    def size(self, unit: str) -> float:
        """The size that a parameter with this unit template has where its effect is as large as the force."""
        words = {"F": self.force, "q": self.position, "w": self.input, "s": self.position / self.speed, "rad": 1.0}
        text = unit.replace("{", "").replace("}", "").replace("^", "**")
        value = 1.0
        for sign, name, power in re.findall(r"([*/]?)([A-Za-z]+|1)(?:\*\*(\d+))?", text):
            factor = words.get(name, 1.0) ** int(power or 1)
            value = value / factor if sign == "/" else value * factor
        return value


def grid(part: Part, s: Scales, coupling: Mapping[str, float] | None = None) -> list[dict[str, float]]:
    """Values of a part's shape parameters to start from."""
    h, slow = s.sample_time, 1 / (2 * np.pi * s.cutoff_hz)
    match part.kind:
        case "input_delay":
            return [{"T": T} for T in np.geomspace(0.3 * h, 4 * slow, 7)]
        case "actuator_lag":
            return [{"tau": T} for T in np.geomspace(0.3 * h, 8 * slow, 7)]
        case "dead_zone":
            return [{"width": q * s.input} for q in (0.003, 0.01, 0.03, 0.08, 0.2)]
        case "saturation":
            return [{"limit": q * s.input} for q in (0.5, 0.75, 0.9, 1.0, 1.15)]
        case "input_gain":
            return [{"gain": q} for q in (0.7, 0.9, 0.95, 1.05, 1.1, 1.4)]
        case "presliding":
            return [{"sigma": s.level / (q * s.position)} for q in np.geomspace(0.3, 1e-4, 8)]
        case "compliance":
            return _couplings(s)
        case "backlash":
            return _backlashes(s, coupling)
        case "encoder_eccentricity":
            return [{"period": q} for q in s.periods["sensor"]]
        case "position_dependent_friction":
            return [{"period": q} for q in s.periods["friction"]]
        case "cogging":
            return [{"period": q} for q in s.periods["force"]]
        case "stribeck":
            return [{"v_s": q * s.speed} for q in np.geomspace(0.01, 0.8, 8)]
        case "friction_drift":
            return [{"T": q * s.duration} for q in (0.05, 0.15, 0.4, 1.0)]
    effect = CATALOGUE[part.kind]
    shapes = [p.name for p in effect.parameters if p.neutral is None and p.name != "phase"]
    sizes = [[q * s.size(p.unit) for q in (0.1, 0.5)] for p in effect.parameters if p.name in shapes]
    return [dict(zip(shapes, values, strict=True)) for values in product(*sizes)]


def _couplings(s: Scales) -> list[dict[str, float]]:
    found = []
    for f, rho in product((0.15, 0.4, 1.0, 2.5, 6.0), (0.3, 0.65)):
        shared = rho * (1 - rho) * s.inertia
        k = shared * (2 * np.pi * f * s.cutoff_hz) ** 2
        found.append({"k": k, "c": 0.3 * np.sqrt(k * shared), "load_fraction": rho})
    return found


def _backlashes(s: Scales, coupling: Mapping[str, float] | None) -> list[dict[str, float]]:
    """Gaps, with the coupling that was found without a gap or a few stiff ones."""
    stiff = [c for c in _couplings(s) if c["load_fraction"] > 0.5][2:]
    gaps = np.geomspace(max(2 * s.noise, 1e-5 * s.position), max(20 * s.noise, 0.05 * s.position), 5)
    return [{**c, "gap": float(gap)} for c in ([coupling, *stiff] if coupling else stiff) for gap in gaps]


def starting_points(
    runner: Runner, base: Shot, raw: Sequence[Array], s: Scales, most: int, coupling: Mapping[str, float] | None = None
) -> list[tuple[float, Array]]:
    """The best starts, as (cost by one linear step, theta of the trial), best first.

    Args:
        runner: of the trial with the part last.
        base: the fit without it. raw: slopes of its parameters, not projected.
        coupling: what a compliance at the same place was fitted to, to start a backlash from.
    """
    part = runner.trial.parts[-1]
    shapes = grid(part, s, coupling) or [{}]
    now = means(base.runner, base.runner.run(base.theta, base.offsets))
    weights = np.sqrt(segment_weights(base.residual))[:, None]
    moved = np.stack([base.starts.project(r, slope=True) for r in raw]) if raw else np.zeros((0, *now.shape))
    found = []
    for shape in shapes:
        effects = _weighted(part)
        if effects is None:
            theta = np.concatenate([base.theta, part.inward(shape)])
            probe = means(runner, runner.run(theta, base.offsets))
            step, cost = _solve(base, probe, moved, weights)
            theta[: len(base.theta)] += step
            found.append((cost, theta))
            continue
        columns, recover = _columns(runner, base, part, shape, s, now)
        step, cost = _solve(base, now, np.concatenate([moved, columns]), weights)
        values = recover(step[len(base.theta) :], shape)
        theta = np.concatenate([base.theta + step[: len(base.theta)], part.inward(values)])
        found.append((cost, theta))
    found.sort(key=lambda pair: pair[0])
    return found[:most]


def _solve(base: Shot, residual: Array, columns: Array, weights: Array) -> tuple[Array, float]:
    """(step, cost) of one linear step; the prior stays where the spec has it, wherever the base went."""
    flat = base.starts.project(residual)
    if not len(columns):
        return np.zeros(0), segment_cost(flat)
    scaled = (columns * weights).reshape(len(columns), -1)
    price, away = np.zeros(len(columns)), np.zeros(len(columns))
    price[: len(base.price)], away[: len(base.price)] = base.price, base.theta - base.centre
    matrix = scaled @ scaled.T + np.diag(price)
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    right = scaled @ (flat * weights).ravel() - price * away
    step = np.linalg.lstsq(matrix / np.outer(size, size), right / size, rcond=1e-9)[0] / size
    left = flat - np.tensordot(step, columns, axes=1)
    return step, segment_cost(left) + 0.5 * float((price * (away + step) ** 2).sum())


def _weighted(part: Part) -> tuple[str, ...] | None:
    """The parameters that scale the effect, or None where it is tried at values of all of them."""
    if part.kind in CHAIN or part.kind in STRUCTURE:
        return None
    if "phase" in part.names:
        return (part.names[0], "phase")
    effect = CATALOGUE[part.kind]
    return tuple(p.name for p in effect.parameters if p.neutral is not None)


def _columns(
    runner: Runner, base: Shot, part: Part, shape: Mapping[str, float], s: Scales, now: Array
) -> tuple[Array, Callable[[Array, Mapping[str, float]], dict[str, float]]]:
    effect = CATALOGUE[part.kind]
    if "phase" in part.names:
        size = part.names[0]
        big = s.position if part.kind == "encoder_eccentricity" else s.force
        probes = [dict(shape) | {size: SMALL * big, "phase": phase} for phase in (0.0, np.pi / 2)]
        steps = [SMALL * big] * 2

        def recover(weights: Array, shape: Mapping[str, float]) -> dict[str, float]:
            return dict(shape) | {size: float(np.hypot(*weights)), "phase": float(np.arctan2(weights[1], weights[0]))}
    else:
        scaling = [p for p in effect.parameters if p.neutral is not None]
        zero = {p.name: float(p.neutral or 0.0) for p in scaling}
        steps = [SMALL * s.size(p.unit) for p in scaling]
        probes = [dict(shape) | zero | {p.name: zero[p.name] + d} for p, d in zip(scaling, steps, strict=True)]

        def recover(weights: Array, shape: Mapping[str, float]) -> dict[str, float]:
            return dict(shape) | {p.name: zero[p.name] + float(w) for p, w in zip(scaling, weights, strict=True)}

    columns = []
    for probe, step in zip(probes, steps, strict=True):
        theta = np.concatenate([base.theta, part.inward(probe)])
        slope = (now - means(runner, runner.run(theta, base.offsets))) / step
        columns.append(base.starts.project(slope, slope=True))
    return np.stack(columns), recover

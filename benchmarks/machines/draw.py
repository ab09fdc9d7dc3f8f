"""A random case: a machine, its drive, its motion and what its spec lacks; a function of seed and index alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.machines.disturbances import STAGES, Disturbance, Heating, Ripple, Slip, Spots, Table, effect
from benchmarks.machines.drive import CONTROL_S, Record, Recorder, run
from benchmarks.machines.families import FAMILIES, Axis, Family
from benchmarks.machines.plant import Plant

SMOOTH_S = 0.04
"""Length of the moving average that makes the speed's corners round."""


def moves(rng: np.random.Generator, duration: float, dt: float, stroke: float, speed: float) -> NDArray[np.float64]:
    """Speeds of trapezoidal moves between random positions in ±stroke/2, with rests between them."""
    found: list[NDArray[np.float64]] = []
    at, total = 0.0, 0
    while total * dt < duration:
        top = speed * float(np.exp(rng.uniform(np.log(0.08), 0.0)))
        acceleration = speed * rng.uniform(2.0, 6.0)
        goal = rng.uniform(-stroke / 2, stroke / 2)
        distance = abs(goal - at)
        top = min(top, np.sqrt(distance * acceleration))
        if top <= 0:
            continue
        ramp, cruise = top / acceleration, distance / top - top / acceleration
        t = np.arange(0, 2 * ramp + cruise, dt)
        shape = np.clip(np.minimum(t / ramp, (2 * ramp + cruise - t) / ramp), 0, 1)
        shape *= distance / max(shape.sum() * dt, 1e-12)
        found += [np.sign(goal - at) * shape, np.zeros(round(rng.uniform(0.03, 0.4) / dt))]
        at, total = goal, total + len(t) + len(found[-1])
    return np.concatenate(found)[: round(duration / dt)]


def sines(rng: np.random.Generator, duration: float, dt: float, stroke: float, speed: float) -> NDArray[np.float64]:
    """Speeds of a sum of four sines that is zero at both ends, in ±stroke/2 and at most ``speed``."""
    t = np.arange(round(duration / dt)) * dt
    cycles = np.unique(np.round(duration * np.exp(rng.uniform(np.log(0.15), np.log(3.0), 4))).clip(1))
    position = sum(
        rng.uniform(0.3, 1.0) / c * np.sin(2 * np.pi * c * t / duration + rng.uniform(0, 2 * np.pi)) for c in cycles
    )
    position = position * np.minimum(1, np.minimum(t, t[::-1]) / 0.5) ** 2
    v = np.gradient(position, dt)
    scale = min(stroke / 2 / np.abs(position).max(), speed / np.abs(v).max())
    return np.asarray(scale * v)


def reference(
    rng: np.random.Generator, duration: float, dt: float, stroke: float, speed: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Position and speed, by sections of some seconds of moves or sines, each of which starts where the last ended."""
    parts, left = [], duration
    while left > 0.5:
        length = min(left, rng.uniform(3.0, 7.0))
        make = moves if rng.random() < 0.6 else sines
        part = make(rng, length, dt, stroke, speed)
        # A section of moves ends anywhere: return to the middle first.
        end = part.sum() * dt
        back = max(0.3, 2.5 * abs(end) / speed)
        t = np.arange(round(back / dt)) * dt
        parts += [part, -end / back * (1 - np.cos(2 * np.pi * t / back))]
        left -= length + back
    v = np.concatenate(parts)
    window = np.hanning(round(SMOOTH_S / dt) + 2)
    v = np.convolve(v, window / window.sum(), mode="same")
    return np.cumsum(v) * dt, v


TRAIN_S, TEST_S = (14.0, 20.0), 8.0
GROUPS = {"none": 0.17, "single": 0.5, "double": 0.15, "foreign": 0.18}
COMMANDED = ("input_delay", "actuator_lag", "dead_zone", "saturation")
"""Effects between command and current: a measured current has them already, so their logs hold the command."""
STIFF_STEP = 5e-5


@dataclass(frozen=True)
class Scale:
    """Sizes of an axis, from which strengths are drawn: force (RMS), level, stroke, speed, inertia, current (RMS)."""

    force: float
    level: float
    stroke: float
    speed: float
    mass: float
    current: float
    rotary: bool


@dataclass(frozen=True)
class Machine:
    """The random choices of one case.

    Attributes:
        values: true parameters. declared: those of the spec, and its levels. lacks: makes what the spec lacks anew,
            with its states at their start.
        undeclared: parameters of the family that neither machine nor spec has.
    """

    family: Family
    values: dict[str, float]
    declared: dict[str, float]
    levels: tuple[float, ...]
    declared_levels: tuple[float, ...]
    group: str
    lacks: Callable[[], list[Disturbance]]
    recorder: Recorder
    bandwidth_hz: float
    limits: tuple[float, ...]
    strokes: tuple[float, ...]
    speeds: tuple[float, ...]
    fixed: frozenset[str]

    def record(self, rng: np.random.Generator, duration: float) -> Record:
        """A run of this machine along random references."""
        goals = [
            reference(rng, duration, CONTROL_S, stroke, speed)
            for stroke, speed in zip(self.strokes, self.speeds, strict=True)
        ]
        length = min(len(position) for position, _ in goals)
        lacks = self.lacks()
        stiff = any(hasattr(d, "between") or d.kind == "presliding" for d in lacks)
        plant = Plant(self.family, self.values, self.levels, lacks, STIFF_STEP if stiff else 2e-4)
        cut = [(position[:length], speed[:length]) for position, speed in goals]
        return run(rng, plant, cut, self.recorder, self.bandwidth_hz, self.limits)


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def rounded(value: float, digits: int = 3) -> float:
    return float(f"{value:.{digits}g}")


def strengths(rng: np.random.Generator, kind: str, s: Scale, axis: Axis) -> dict[str, float]:
    """Parameters of an effect on an axis, with a force of a twentieth to a third of the drive force."""
    size = log_uniform(rng, 0.05, 0.35) * s.force
    sign = float(rng.choice([-1, 1]))
    phase = float(rng.uniform(-math.pi, math.pi))
    split = rng.uniform(0.3, 0.65)
    k = split * (1 - split) * s.mass * (2 * math.pi * rng.uniform(6, 22)) ** 2
    c = 2 * rng.uniform(0.03, 0.15) * math.sqrt(k * split * (1 - split) * s.mass)
    spring = {"k": k, "c": c, "load_fraction": split}
    turn = 2 * math.pi if s.rotary and s.stroke > 4 else s.stroke / rng.uniform(1.5, 4)
    return {
        "viscous": lambda: {"b": size / (0.4 * s.speed)},
        "quadratic_drag": lambda: {"c": size / (0.2 * s.speed**2)},
        "offset": lambda: {"f0": sign * size},
        "cogging": lambda: {"amplitude": 1.4 * size, "period": s.stroke / rng.uniform(4, 25), "phase": phase},
        "gravity_imbalance": lambda: {"G": 1.4 * size, "phase": phase},
        "spring": lambda: {"k": size / (0.25 * s.stroke)},
        "hardening_spring": lambda: {"k3": size / (0.25 * s.stroke) ** 3 / 2},
        "stribeck": lambda: {"delta": 2 * size, "v_s": s.speed * log_uniform(rng, 0.03, 0.15)},
        "coulomb_asymmetry": lambda: {"d": sign * min(size, 0.8 * s.level)},
        "position_dependent_friction": lambda: {
            "amplitude": min(1.4 * size, 0.8 * s.level),
            "period": s.stroke / rng.uniform(2.5, 12),
            "phase": phase,
        },
        "load_dependent_friction": lambda: {"mu": rng.uniform(0.08, 0.3)},
        "friction_drift": lambda: {"delta": 2 * size, "T": rng.uniform(3, 10)},
        "coupling": lambda: {"c": size / (0.1 * s.speed)},
        "input_gain": lambda: {"gain": float(rng.choice([rng.uniform(0.72, 0.88), rng.uniform(1.12, 1.3)]))},
        "input_delay": lambda: {"T": rng.uniform(0.004, 0.015)},
        "actuator_lag": lambda: {"tau": rng.uniform(0.005, 0.02)},
        "dead_zone": lambda: {"width": rng.uniform(0.1, 0.35) * s.current},
        "saturation": lambda: {"limit": rng.uniform(1.3, 1.9) * s.current},
        "inertia_error": lambda: {"delta": rng.uniform(0.15, 0.4) * s.mass},
        "presliding": lambda: {"sigma": s.level / (s.stroke * log_uniform(rng, 0.002, 0.02))},
        "compliance": lambda: spring,
        "backlash": lambda: {"gap": s.stroke * log_uniform(rng, 0.002, 0.01), **spring},
        "encoder_eccentricity": lambda: {
            "amplitude": turn * log_uniform(rng, 0.005, 0.02),
            "period": turn,
            "phase": phase,
        },
    }[kind]()


def eligible(family: Family, k: int, damped: bool) -> list[str]:
    """The kinds of effects that suit an axis and are not covered by a declared parameter."""
    axis = family.axes[k]
    kinds = ["quadratic_drag", "offset", "cogging", "stribeck", "coulomb_asymmetry", "position_dependent_friction"]
    kinds += ["friction_drift", "presliding"]
    if not damped:
        kinds.append("viscous")
    if axis.driven:
        kinds += [*STAGES, "load_dependent_friction"]
    if not (family.gravity and axis.unit == "rad") and family.name != "gimbal":
        kinds += ["spring", "hardening_spring", "gravity_imbalance"] if axis.unit == "rad" else ["spring"]
    if family.separate:
        kinds += ["compliance", "backlash", "inertia_error"]
    if len(family.axes) == 2 and not all(a.driven for a in family.axes):
        kinds.append("coupling")
    if axis.unit == "rad" and axis.driven:
        kinds.append("encoder_eccentricity")
    return kinds


def place(kind: str, family: Family, k: int) -> Any:
    """The name in a spec of the place of an effect on axis k."""
    axis = family.axes[k]
    if kind in STAGES:
        return axis.driven
    if kind == "coupling":
        return [a.x for a in family.axes]
    contact = ("viscous", "stribeck", "coulomb_asymmetry", "position_dependent_friction", "load_dependent_friction")
    return f"F{axis.x}" if kind in (*contact, "friction_drift", "presliding") else axis.x


def foreign(rng: np.random.Generator, family: Family, k: int, s: Scale) -> Callable[[], list[Disturbance]]:
    """A disturbance that no kind describes, on axis k."""
    size = rng.uniform(0.12, 0.35) * s.force
    kinds = ["gusts", "cable", "bearing_spots"]
    if family.axes[k].driven:
        kinds += ["heating", "current_ripple"]
    if family.separate and not family.gravity:
        kinds.append("belt_slip")
    kind = str(rng.choice(kinds))
    noise = rng.standard_normal(4000)
    if kind == "heating":
        values = {"T": rng.uniform(5, 12), "loss": rng.uniform(0.15, 0.3), "rms": s.current}
        return lambda: [Heating(kind, k, values)]
    if kind == "current_ripple":
        ripple = {"share": rng.uniform(0.15, 0.3), "period": s.stroke / rng.uniform(5, 25)}
        return lambda: [Ripple(kind, k, ripple)]
    if kind == "belt_slip":
        # In sines and moves at 2 to 6 times the speed a second, the load's share of the inertia slips at its peaks.
        slip = {"load_fraction": rng.uniform(0.4, 0.7), "v0": 0.01 * s.speed}
        slip["limit"] = rng.uniform(0.8, 1.5) * slip["load_fraction"] * s.mass * s.speed
        return lambda: [Slip(kind, k, slip)]
    if kind == "bearing_spots":
        places = tuple(rng.uniform(-s.stroke / 2, s.stroke / 2, int(rng.integers(3, 7))))
        spots = {"height": 2.5 * size, "width": s.stroke * rng.uniform(0.015, 0.05)}
        return lambda: [Spots(kind, k, spots, places=places)]
    if kind == "gusts":
        # First-order noise with a correlation time of 0.3 to 1.5 s.
        keep = math.exp(-0.01 / rng.uniform(0.3, 1.5))
        table, now = [], 0.0
        for shock in noise:
            now = keep * now + math.sqrt(1 - keep**2) * float(shock)
            table.append(size * now)
        return lambda: [Table(kind, k, {"rms": size}, values=table)]
    pulls = np.zeros(4000)
    for at in rng.integers(0, 3900, 16):
        length = int(rng.integers(60, 200))
        pulls[at : at + length] += rng.choice([-1, 1]) * 2 * size * np.hanning(length)[: len(pulls[at : at + length])]
    return lambda: [Table(kind, k, {"peak": 2 * size}, values=pulls.tolist())]


def draw(seed: int, index: int) -> Machine:
    """Case ``index`` of a seed; families take turns."""
    rng = np.random.default_rng([seed, index])
    family = FAMILIES[index % len(FAMILIES)]
    group = str(rng.choice(list(GROUPS), p=list(GROUPS.values())))
    values = {name: rounded(log_uniform(rng, q.low, q.high)) for name, q in family.quantities.items()}
    if "b" in values and rng.random() < 0.5:
        del values["b"]
    strokes = tuple(log_uniform(rng, *axis.stroke) for axis in family.axes)
    speeds = tuple(s * log_uniform(rng, *axis.speed) for s, axis in zip(strokes, family.axes, strict=True))
    scales, levels = [], []
    mass = family.mass(values, [0.0] * len(strokes), math)
    for k, axis in enumerate(family.axes):
        moving = mass[k] * speeds[k] * 2.0
        held = max(abs(family.position(values, [0.35 * s for s in strokes], math)[k]) if axis.driven else 0.0, 0.0)
        if family.name == "two_mass_drive":
            held = 0.0
        levels.append(rounded((moving + held) * rng.uniform(0.15, 0.5) * (1.0 if axis.driven else 0.4)))
        force = math.hypot(moving, held) + levels[k]
        factor = family.drive(values)[k]
        current = force / factor if factor else 0.0
        scales.append(Scale(force, levels[k], strokes[k], speeds[k], mass[k], current, axis.unit == "rad"))
    lacks = _lacks(rng, group, family, scales, "b" in values)
    kinds = [d.kind for d in lacks()]
    declared = {
        name: rounded(v * (1 + 0.7 * family.quantities[name].tolerance * rng.standard_normal()), 4)
        for name, v in values.items()
    }
    fixed = frozenset(_fixed(family, kinds))
    declared |= {name: values[name] for name in fixed}
    measured = rng.random() < 0.6 and not any(kind in COMMANDED for kind in kinds)
    largest = max(s.current for s in scales)
    recorder = Recorder(
        every=int(rng.choice([1, 2, 4] if measured else [1, 2])),
        encoder=tuple(rounded(s / log_uniform(rng, 1e4, 4e5), 2) for s in strokes),
        measured=measured,
        filter_s=float(rng.choice([0.0, 5e-4, 2e-3])),
        late=int(rng.choice([0, 0, 1])) if measured else 0,
        noise=largest * rng.uniform(0.002, 0.02),
        resolution=rounded(largest / log_uniform(rng, 200, 4000), 2),
        loop_s=rng.uniform(1e-4, 4e-4),
    )
    off = [rounded(a * (1 + rng.uniform(-0.25, 0.25))) for a in levels]
    bandwidth = rng.uniform(8, 16) if family.name != "two_mass_drive" else rng.uniform(4, 7)
    limits = tuple(6 * s.current if s.current else 0.0 for s in scales)
    return Machine(
        family, values, declared, tuple(levels), tuple(off), group, lacks, recorder, bandwidth, limits,
        strokes, speeds, fixed,
    )  # fmt: skip


def _fixed(family: Family, kinds: Sequence[str]) -> list[str]:
    """Parameters that the spec states exactly: a tolerance there would stand for the effect that is to be named."""
    found = []
    if "inertia_error" in kinds or "input_gain" in kinds:
        found += [name for name in family.quantities if name != "b"]
    return found


def _lacks(
    rng: np.random.Generator, group: str, family: Family, scales: Sequence[Scale], damped: bool
) -> Callable[[], list[Disturbance]]:
    k = int(rng.integers(len(family.axes)))
    if group == "none":
        return list
    if group == "foreign":
        return foreign(rng, family, k, scales[k])
    chosen: list[tuple[str, int, dict[str, float]]] = []
    for _ in range(1 if group == "single" else 2):
        k = int(rng.integers(len(family.axes)))
        taken = [kind for kind, at, _ in chosen if at == k]
        free = [kind for kind in eligible(family, k, damped) if kind not in taken]
        kinds = [kind for kind in free if not any({kind, other} in CLASHES for other in taken)]
        kind = str(rng.choice(kinds))
        p = {name: rounded(v, 4) for name, v in strengths(rng, kind, scales[k], family.axes[k]).items()}
        chosen.append((kind, 0 if kind == "coupling" else k, p))
    return lambda: [effect(kind, k, p, place(kind, family, k)) for kind, k, p in chosen]


CLASHES = (
    {"offset", "coulomb_asymmetry"},
    {"compliance", "backlash"},
    {"input_gain", "inertia_error"},
    {"input_delay", "actuator_lag"},
    {"spring", "hardening_spring"},
    {"presliding", "stribeck"},
    {"viscous", "quadratic_drag"},
)
"""Pairs of effects that one log can hardly distinguish; no case has both on an axis."""

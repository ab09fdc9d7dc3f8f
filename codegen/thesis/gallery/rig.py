"""Figures 8.3 to 8.6: simulation of the experimental rig with four observers, without and with cancellation."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations
from typing import Any

import numpy as np
import sympy

from codegen.analysis.analysis import analyse
from codegen.base.arrays import Array
from codegen.effects.declare import system_of
from codegen.mechanics.system import System
from codegen.observers import build_observer
from codegen.simulate.loop_run import LoopRun
from codegen.spec.functions import Sgn
from codegen.spec.model import Spec, symbol
from codegen.thesis.gallery import drawing as d
from codegen.thesis.gallery.measures import Mask, Reading, hang_off, ratio, rms, sliding
from codegen.thesis.gallery.runs import Gains, Runs, ideal_run, pid_run, reference_of, servo_run, tuned_pid
from codegen.thesis.gallery.setting import Setting, from_zero, with_observer

NAMES = ("CFO", "TO", "DFOa", "DFOb")
RAISED = "plates"
HALF_PERIOD = 2.0
AMPLITUDE = 0.8727
SUBSTEP = 1e-3
"""s; with a tenth of it, the position differs by 0.05° RMS."""
CHAPTER_3 = {"K_1": 0, "K_2": -100, "K_v": 100}
"""Gains of figure 3.4."""
DEGREES = 180 / np.pi


def target_of(runs: Runs) -> Array:
    """The reference of the rig at each sample, (N,), rad."""
    return reference_of(runs.setting.applied(runs.specs[0]), len(runs["ideal"].time))


def draw(figure: Any, runs: Runs) -> None:
    """Left without, right with cancellation: position, distance, friction over time and over velocity."""
    name = name_of(runs.specs[1])
    grid = figure.subplots(4, 2)
    pid = runs["pid"]
    target = target_of(runs)
    for column, key, letter, words in zip(
        grid.T, (f"{name}_off", name), "ab", ("not cancelled", "cancelled"), strict=True
    ):
        run = runs[key]
        position, distance, force, over_velocity = column
        d.line(position, run.time, target * DEGREES, d.IDEAL, "reference", 1.4, (0, (5, 2)))
        d.line(position, run.time, run.true_positions[:, 0] * DEGREES, d.ESTIMATED, f"with the {name}")
        error = [(r.true_positions[:, 0] - target) * DEGREES for r in (run, pid)]
        if letter == "b":
            d.line(distance, run.time, error[1], d.THIRD_ONE, "PID", 1.4)
        d.line(distance, run.time, error[0], d.ESTIMATED)
        distance.set_ylim(-15, 15)
        d.line(force, run.time, run.friction_estimate[:, 0], d.ESTIMATED, None, 1.2)
        d.line(force, run.time, run.friction[:, 0], d.TRUE, "true friction", 1.2)
        d.dots(over_velocity, run.true_velocities[:, 0], run.friction[:, 0], d.TRUE)
        d.dots(over_velocity, run.true_velocities[:, 0], run.friction_estimate[:, 0], d.ESTIMATED)
        for axes in (force, over_velocity):
            d.limit(axes, run.friction, 1.8)
        for axes in (position, distance, force):
            axes.axvline(runs.numbers["half"], color=d.OTHER, linewidth=1.2, linestyle=(0, (2, 2)))
        first = letter == "a"
        d.frame(position, "", "angle in °" if first else "", f"({letter}) {words}")
        d.frame(distance, "", "distance in °" if first else "")
        d.frame(force, d.TIME, "friction in N·m" if first else "")
        d.frame(over_velocity, "velocity in rad/s", "friction in N·m" if first else "")
    d.legend(figure, grid[0, 1], grid[1, 1], grid[2, 1])


def rig_runs(specs: Sequence[Spec], setting: Setting, pid: Gains | None = None) -> Runs:
    """Runs NAME and NAME_off of each observer, with and without cancellation; ``servo`` without one; pid and ideal.

    The first spec is the rig; the others are observers in the order of ``NAMES``, or one alone. The second spec is the
    figure's own.
    """
    rig = setting.applied(specs[0])
    machine, simulation = raised_half_way(rig, setting.levels), rig.required_simulation
    substeps = max(1, round(simulation.sample_time / SUBSTEP))
    ideal = ideal_run(specs[1], setting)
    gains = pid or tuned_pid(specs[1], setting, ideal, machine, max(1, substeps // 3))
    loops = {
        "ideal": ideal,
        "pid": pid_run(specs[1], setting, ideal, gains, machine, substeps=substeps),
        "servo": servo_run(specs[1], setting, None, plant=machine, substeps=substeps),
    }
    for spec in specs[1:]:
        name, observed = name_of(spec), from_zero(spec)
        loops[name] = servo_run(spec, setting, 1.0, observed, machine, setting.delay, substeps)
        loops[f"{name}_off"] = servo_run(spec, setting, 0.0, observed, machine, setting.delay, substeps)
    numbers = {"half": simulation.duration / 2, "end": simulation.duration}
    return Runs(specs, setting, loops, gains, numbers)


def name_of(spec: Spec) -> str:
    """CFO, TO, DFOa (on the reset integrator) or DFOb (on Dahl's law), as the thesis calls them."""
    kind = spec.required_observer.kind.upper()
    return kind if kind != "DFO" else "DFOa" if spec.contacts[0].law == "reset_integrator" else "DFOb"


def raised_half_way(rig: Spec, factor: float = 1.0) -> System:
    """The rig, whose plates touch from half of its simulation on; every friction level is scaled by ``factor``."""
    system = system_of(rig)
    half = sympy.Rational(repr(rig.required_simulation.duration)) / 2
    touching = (1 + Sgn(symbol("t") - half)) / 2
    contacts = [
        replace(c, extra_level=c.law_level * (touching - 1)) if c.name == RAISED else c for c in system.contacts
    ]
    scaled = {s: v * sympy.Rational(repr(factor)) if s.name.endswith("_a") else v for s, v in system.values.items()}
    return replace(system, contacts=tuple(contacts), values=scaled)


def hang_offs(runs: Runs, name: str) -> tuple[float, float]:
    """``hang_off`` before and after the plates touch, rad, without each first cycle, in which the estimate rises."""
    run, half, period = runs[name], runs.numbers["half"], runs.setting.slower * HALF_PERIOD
    target = target_of(runs)
    before = hang_off(run, target, period, 2 * period, half)
    return before, hang_off(run, target, period, half + 2 * period, runs.numbers["end"])


def _halves(runs: Runs, run: LoopRun) -> tuple[Mask, Mask]:
    """Samples before and after the plates touch, each without the first cycle."""
    half, cycle = runs.numbers["half"], 2 * runs.setting.slower * HALF_PERIOD
    later = run.time >= half
    return ~later & (run.time >= cycle), later & (run.time >= half + cycle)


def _force_error(runs: Runs, name: str) -> float:
    """RMS error of the friction estimate during sliding, N·m."""
    run = runs[name]
    before, late = _halves(runs, run)
    return rms((run.friction - run.friction_estimate)[sliding(run) & (before | late), 0])


def grows_with_friction(runs: Runs) -> Reading:
    name = name_of(runs.specs[1])
    before, after = hang_offs(runs, f"{name}_off")
    return Reading(ratio(after, before), (("before", before * DEGREES), ("after", after * DEGREES)), "°")


def eliminated(runs: Runs) -> Reading:
    name = name_of(runs.specs[1])
    without, left = hang_offs(runs, f"{name}_off"), hang_offs(runs, name)
    labels = ("before, not cancelled", "cancelled", "after, not cancelled", "cancelled")
    values = [value * DEGREES for pair in zip(without, left, strict=True) for value in pair]
    worst = max(ratio(a, b) for a, b in zip(left, without, strict=True))
    return Reading(worst, tuple(zip(labels, values, strict=True)), "°")


def no_worse_than_pid(runs: Runs) -> Reading:
    name = name_of(runs.specs[1])
    errors = list(_distances(runs, (name, "pid")).values())
    left = [max(hang_offs(runs, key)) * DEGREES for key in (name, "pid")]
    parts = ((name, errors[0]), ("PID", errors[1]), ("hang-off", left[0]), ("of the PID", left[1]))
    return Reading(ratio(*errors), parts, "°")


def _distances(runs: Runs, names: Sequence[str] = NAMES) -> dict[str, float]:
    """RMS distance from the ideal, °."""
    path = runs["ideal"].true_positions
    return {name: rms((runs[name].true_positions - path).ravel()) * DEGREES for name in names}


def proportional(runs: Runs) -> Reading:
    hangs = {name: hang_offs(runs, name) for name in ("servo", *(f"{name}_off" for name in NAMES))}
    ratios = {name: ratio(late, before) for name, (before, late) in hangs.items()}
    levels = [float(c.parameters["a"]) for c in runs.specs[0].contacts]
    grown = sum(levels) / levels[0]
    parts = [("no observer", ratios["servo"]), *((f"v̂ of the {n}", ratios[f"{n}_off"]) for n in NAMES)]
    return Reading(abs(ratios["servo"] / grown - 1), (("friction", grown), *parts), "times")


def cfo_estimates_best(runs: Runs) -> Reading:
    errors = {name: _force_error(runs, name) for name in NAMES}
    return Reading(ratio(errors["CFO"], min(errors[n] for n in NAMES[1:])), tuple(errors.items()), "N·m")


def cfo_compensates_best(runs: Runs) -> Reading:
    errors = _distances(runs)
    return Reading(ratio(errors["CFO"], min(errors[n] for n in NAMES[1:])), tuple(errors.items()), "°")


def to_overcompensates(runs: Runs) -> Reading:
    parts = []
    for name in NAMES:
        run = runs[name]
        chosen = sliding(run) & np.logical_or(*_halves(runs, run))
        truth, estimate = run.friction[chosen, 0], run.friction_estimate[chosen, 0]
        parts.append((name, ratio(float(np.sum(estimate * np.sign(truth))), float(np.sum(np.abs(truth))))))
    return Reading(dict(parts)["TO"] - 1, tuple(parts))


def to_lies_between(runs: Runs) -> Reading:
    errors = _distances(runs)
    ends = errors["CFO"], (errors["DFOa"] + errors["DFOb"]) / 2
    off = abs(errors["TO"] - sum(ends) / 2)
    return Reading(ratio(off, abs(ends[1] - ends[0]) / 2), tuple(errors.items()), "°")


def loop_stays(runs: Runs) -> Reading:
    parts = []
    for name in NAMES:
        run = runs[f"{name}_off"]
        estimate, v = run.friction_estimate[:, 0], run.true_velocities[:, 0]
        before, late = (abs(float(np.trapezoid(estimate[chosen], v[chosen]))) for chosen in _halves(runs, run))
        parts.append((name, ratio(late, before)))
    return Reading(max(abs(grown - 1) for _, grown in parts), tuple(parts), "times")


def _similar(runs: Runs, names: Sequence[str]) -> Reading:
    """Largest RMS distance between the motions of two runs, over the amplitude."""
    motions = [runs[name].true_positions for name in names]
    apart = max(rms((a - b).ravel()) for a, b in combinations(motions, 2))
    return Reading(apart / AMPLITUDE, (("RMS apart", apart * DEGREES),), "°")


cfo_like_to = partial(_similar, names=("CFO", "TO"))
dfoa_like_dfob = partial(_similar, names=("DFOa", "DFOb"))
to_like_dfos_off = partial(_similar, names=("TO_off", "DFOa_off", "DFOb_off"))


def on_the_boundary(runs: Runs) -> Reading:
    spec = with_observer(_tracking(runs), "to", CHAPTER_3)
    radius = analyse(spec, build_observer(spec, system_of(spec))).spectral_radius
    return Reading(abs(radius - 1), (("spectral radius", radius),))


def grows_at_chapter_3_gains(runs: Runs) -> Reading:
    spec = with_observer(_tracking(runs), "to", CHAPTER_3)
    setting = replace(runs.setting, step=None, factors={k: v for k, v in runs.setting.factors.items() if k == "J"})
    rig = setting.applied(runs.specs[0])
    machine = raised_half_way(rig, setting.levels)
    substeps = max(1, round(rig.required_simulation.sample_time / SUBSTEP))
    estimate = servo_run(spec, setting, 0.0, from_zero(spec), machine, setting.delay, substeps).friction_estimate[:, 0]
    count = len(estimate) // 4
    growth = ratio(rms(estimate[3 * count : 4 * count]), rms(estimate[2 * count : 3 * count])) ** (1 / count)
    return Reading(growth, (("growth in a sample", growth),))


def _tracking(runs: Runs) -> Spec:
    return next(spec for spec in runs.specs[1:] if name_of(spec) == "TO")

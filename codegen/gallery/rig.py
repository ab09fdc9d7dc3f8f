"""Figures 8.3 to 8.6: the experimental rig simulated, with four observers, without and with cancellation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import sympy

from codegen.gallery import drawing as d
from codegen.gallery.figure import Plot, Runs
from codegen.gallery.measures import Array, Reading, hang_off, ratio, rms, sliding
from codegen.gallery.runs import Gains, ideal_run, pid_run, plant_of, reference_of, servo_run, tuned_pid
from codegen.gallery.setting import Setting, from_zero, observer_choice, simulation_of, with_observer
from codegen.mechanics.system import System
from codegen.observers import build_observer
from codegen.simulate import LoopRun
from codegen.spec.functions import Sgn
from codegen.spec.model import Spec, symbol
from codegen.stability.analysis import analyse

NAMES = ("CFO", "TO", "DFOa", "DFOb")
FIGURES = ("8.3", "8.4", "8.5", "8.6")
RAISED = "plates"
HALF_PERIOD = 2.0
CYCLE = 2 * HALF_PERIOD
AMPLITUDE = 0.8727
SUBSTEP = 1e-3
"""s: against steps of a tenth of it, the position differs by 0.05° RMS."""
CHAPTER_3 = {"K_1": 0, "K_2": -100, "K_v": 100}
DEGREES = 180 / np.pi


def rig_runs(specs: Sequence[Spec], setting: Setting, pid: Gains | None = None) -> Runs:
    """NAME and NAME_off, with and without cancellation, of each observer; pid and ideal.

    The first spec is the rig, the others are observers in the order of ``NAMES``, or one of them alone.
    """
    rig = setting.applied(specs[0])
    machine, simulation = raised_half_way(rig, setting.levels), simulation_of(rig)
    substeps = max(1, round(simulation.sample_time / SUBSTEP))
    ideal = ideal_run(specs[1], setting)
    gains = pid or tuned_pid(specs[1], setting, ideal, machine, max(1, substeps // 3))
    loops = {"ideal": ideal, "pid": pid_run(specs[1], setting, ideal, gains, machine, substeps=substeps)}
    for spec in specs[1:]:
        name, observed = name_of(spec), from_zero(spec)
        loops[name] = servo_run(spec, setting, 1.0, observed, machine, setting.delay, substeps)
        loops[f"{name}_off"] = servo_run(spec, setting, 0.0, observed, machine, 0, substeps)
    numbers = {"half": simulation.duration / 2, "end": simulation.duration}
    return Runs(specs, setting, loops, gains, numbers)


def name_of(spec: Spec) -> str:
    """CFO, TO, DFOa (on the reset integrator) or DFOb (on Dahl's law), as the thesis calls them."""
    kind = observer_choice(spec).kind.upper()
    return kind if kind != "DFO" else "DFOa" if spec.contacts[0].law == "reset_integrator" else "DFOb"


def raised_half_way(rig: Spec, factor: float = 1.0) -> System:
    """The rig with its plates brought together half-way through its simulation, every level times ``factor``."""
    system = plant_of(rig)
    half = sympy.Rational(repr(simulation_of(rig).duration)) / 2
    touching = (1 + Sgn(symbol("t") - half)) / 2
    contacts = [
        replace(c, extra_level=c.law_level * (touching - 1)) if c.name == RAISED else c for c in system.contacts
    ]
    scaled = {s: v * sympy.Rational(repr(factor)) if s.name.endswith("_a") else v for s, v in system.values.items()}
    return replace(system, contacts=tuple(contacts), values=scaled)


def _target(runs: Runs, run: LoopRun) -> Array:
    return reference_of(runs.setting.applied(runs.specs[0]), len(run.time))


def hang_offs(runs: Runs, name: str) -> tuple[float, float]:
    """Before and after the plates touch, rad; the first cycle of each, in which the estimate rises, is left out."""
    run, half = runs[name], runs.numbers["half"]
    target = _target(runs, run)
    before = hang_off(run, target, HALF_PERIOD, CYCLE, half)
    return before, hang_off(run, target, HALF_PERIOD, half + CYCLE, runs.numbers["end"])


def _force_error(run: LoopRun) -> float:
    moving = sliding(run)
    return rms((run.friction - run.friction_estimate)[moving, 0])


def grows_with_friction(name: str) -> Any:
    def measure(runs: Runs) -> Reading:
        before, after = hang_offs(runs, f"{name}_off")
        return Reading(ratio(after, before), (("before", before * DEGREES), ("after", after * DEGREES)), "°")

    return measure


def eliminated(name: str) -> Any:
    def measure(runs: Runs) -> Reading:
        without, left = hang_offs(runs, f"{name}_off"), hang_offs(runs, name)
        parts = (
            ("before, not cancelled", without[0]),
            ("cancelled", left[0]),
            ("after, not cancelled", without[1]),
            ("cancelled", left[1]),
        )
        return Reading(
            max(ratio(a, b) for a, b in zip(left, without, strict=True)),
            tuple((label, value * DEGREES) for label, value in parts),
            "°",
        )

    return measure


def no_worse_than_pid(name: str) -> Any:
    def measure(runs: Runs) -> Reading:
        path = runs["ideal"].true_positions
        errors = [rms((runs[key].true_positions - path).ravel()) * DEGREES for key in (name, "pid")]
        left = [max(hang_offs(runs, key)) * DEGREES for key in (name, "pid")]
        parts = ((name, errors[0]), ("PID", errors[1]), ("hang-off", left[0]), ("of the PID", left[1]))
        return Reading(ratio(*errors), parts, "°")

    return measure


def proportional(runs: Runs) -> Reading:
    before, after = hang_offs(runs, "CFO_off")
    levels = [float(c.parameters["a"]) for c in runs.specs[0].contacts]
    off = abs(after / before / (sum(levels) / levels[0]) - 1)
    return Reading(off, (("hang-off", after / before), ("friction", sum(levels) / levels[0])), "times")


def cfo_estimates_best(runs: Runs) -> Reading:
    errors = {name: _force_error(runs[name]) for name in NAMES}
    return Reading(ratio(errors["CFO"], min(errors[n] for n in NAMES[1:])), tuple(errors.items()), "N·m")


def cfo_compensates_best(runs: Runs) -> Reading:
    path = runs["ideal"].true_positions
    errors = {name: rms((runs[name].true_positions - path).ravel()) * DEGREES for name in NAMES}
    return Reading(ratio(errors["CFO"], min(errors[n] for n in NAMES[1:])), tuple(errors.items()), "°")


def to_overcompensates(runs: Runs) -> Reading:
    """How far the estimate's magnitude exceeds the friction while the plate slides, in the mean."""
    parts = []
    for name in NAMES:
        run = runs[name]
        moving = sliding(run)
        over = float(np.mean((run.friction_estimate * np.sign(run.friction))[moving] / np.abs(run.friction[moving])))
        parts.append((name, over))
    return Reading(dict(parts)["TO"] - 1, tuple(parts))


def similar(first: str, second: str) -> Any:
    def measure(runs: Runs) -> Reading:
        apart = rms((runs[first].true_positions - runs[second].true_positions).ravel())
        return Reading(apart / AMPLITUDE, (("RMS apart", apart * DEGREES),), "°")

    return measure


def on_the_boundary(runs: Runs) -> Reading:
    """Spectral radius of the sampled error of a TO with the gains of figure 3.4, at the rig's 100 Hz."""
    spec = with_observer(_tracking(runs), "to", CHAPTER_3)
    radius = analyse(spec, build_observer(spec, plant_of(spec))).spectral_radius
    return Reading(abs(radius - 1), (("spectral radius", radius),))


def grows_at_chapter_3_gains(runs: Runs) -> Reading:
    """The same gains watching the rig, whose servo gets their velocity estimate: growth of the estimate in a sample."""
    spec = with_observer(_tracking(runs), "to", CHAPTER_3)
    rig = runs.setting.applied(runs.specs[0])
    machine = raised_half_way(rig, runs.setting.levels)
    substeps = max(1, round(simulation_of(rig).sample_time / SUBSTEP))
    estimate = servo_run(spec, runs.setting, 0.0, from_zero(spec), machine, 0, substeps).friction_estimate[:, 0]
    count = len(estimate) // 4
    growth = ratio(rms(estimate[3 * count : 4 * count]), rms(estimate[2 * count : 3 * count])) ** (1 / count)
    return Reading(growth, (("growth in a sample", growth),))


def _tracking(runs: Runs) -> Spec:
    return next(spec for spec in runs.specs[1:] if name_of(spec) == "TO")


def drawing_of(name: str) -> Any:
    def draw(figure: Any, runs: Runs) -> None:
        """Left without, right with cancellation: position, distance, friction over time and over velocity."""
        grid = figure.subplots(4, 2)
        ideal, pid = runs["ideal"], runs["pid"]
        target = _target(runs, ideal)
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

    return draw


def _measures(name: str) -> dict[str, Any]:
    own = {
        "grows_with_friction": grows_with_friction(name),
        "eliminated": eliminated(name),
        "no_worse_than_pid": no_worse_than_pid(name),
    }
    return own | {
        "proportional": proportional,
        "cfo_estimates_best": cfo_estimates_best,
        "cfo_compensates_best": cfo_compensates_best,
        "to_overcompensates": to_overcompensates,
        "cfo_like_to": similar("CFO", "TO"),
        "dfoa_like_dfob": similar("DFOa", "DFOb"),
        "to_like_dfoa_off": similar("TO_off", "DFOa_off"),
        "on_the_boundary": on_the_boundary,
        "grows_at_chapter_3_gains": grows_at_chapter_3_gains,
    }


SETTINGS = (
    Setting("estimate one sample old", delay=1),
    Setting("half the friction", levels=0.5),
    Setting("twice the friction", levels=2.0),
    Setting("sampled at 1 kHz", step=0.001),
    Setting("noise of 0.5 pulses", noise=0.0016),
)
PLOTS = {
    number: Plot(rig_runs, drawing_of(name), 4, _measures(name), SETTINGS if name == NAMES[0] else SETTINGS[:3], cost=4)
    for number, name in zip(FIGURES, NAMES, strict=True)
}

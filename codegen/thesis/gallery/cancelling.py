"""Figure 5.1: the friction on the ground cancelled by the input on the lower of two masses."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from codegen.cancellation import cancelling_outputs, with_cancellation
from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.replay.engine import engine_of
from codegen.simulate.controller import declared_controller
from codegen.simulate.loop_run import LoopRun
from codegen.simulate.observed_loop import Cancellation, SampledLoop
from codegen.spec.model import Spec
from codegen.thesis.gallery import drawing as d
from codegen.thesis.gallery.measures import Reading, ratio, rms
from codegen.thesis.gallery.runs import Gains, Runs, closed_loop, sample_count
from codegen.thesis.gallery.setting import Setting, from_zero, without_friction

PUSHED = (np.array([0.0, 0.0]), np.array([0.0, 1.0]))
"""Positions in m and velocities in m/s of a start in motion, since the thesis does not state the start."""


def with_and_without(specs: Sequence[Spec], setting: Setting, pid: Gains | None = None) -> Runs:
    """Runs ``cancelled``, ``none`` and ``ideal`` from rest, and ``pushed_cancelled``, … after a push.

    The ideal machine has the friction between the masses, which the input cannot cancel, as in section 5.4.
    """
    spec = setting.applied(specs[0])
    free = replace(spec, contacts=(spec.contacts[0], without_friction(spec).contacts[1]))
    made = from_zero(spec)
    system = build_system(made)
    observer = engine_of(made, with_cancellation(made, build_observer(made, system)), made.code)
    cancellation = Cancellation(outputs=cancelling_outputs(system))
    quiet = Setting(setting.name, noise=0.0)
    loops = {}
    for prefix, start in (("", None), ("pushed_", PUSHED)):
        loops[f"{prefix}ideal"] = _run(free, quiet, start=start)
        loops[f"{prefix}none"] = _run(spec, setting, start=start)
        loops[f"{prefix}cancelled"] = _run(spec, setting, observer, cancellation, start)
    return Runs(specs, setting, loops)


def _run(spec: Spec, setting: Setting, observer: Any = None, cancellation: Any = None, start: Any = None) -> LoopRun:
    controller = declared_controller(spec, spec.required_simulation, sample_count(spec))
    seed = spec.required_simulation.seed + setting.seed
    loop = SampledLoop(controller, observer, cancellation, setting.sensors(spec, False), seed)
    return closed_loop(spec, loop, start=start)


def _closeness(runs: Runs, prefix: str) -> Reading:
    """RMS distance from the ideal motion with cancellation, over that without."""
    ideal = runs[f"{prefix}ideal"].true_positions
    left, without = (rms((runs[prefix + name].true_positions - ideal).ravel()) for name in ("cancelled", "none"))
    return Reading(ratio(left, without), (("cancelled", left), ("not", without)), "m")


closer_to_ideal = partial(_closeness, prefix="")
closer_when_pushed = partial(_closeness, prefix="pushed_")


def draw(figure: Any, runs: Runs) -> None:
    """Responses of both masses without and with cancellation, and their distance from the ideal: at rest and pushed."""
    grid = figure.subplots(2, 3, sharex=True)
    for row, prefix, words in zip(grid, ("", "pushed_"), ("from rest", "pushed, 1 m/s"), strict=True):
        ideal = runs[f"{prefix}ideal"]
        for axes, name, letter in zip(row[:2], ("none", "cancelled"), "ab", strict=True):
            run = runs[f"{prefix}{name}"]
            d.line(axes, ideal.time, ideal.true_positions[:, 1], d.IDEAL, "ideal, lower mass", dashes=(0, (5, 2)))
            d.line(axes, run.time, run.true_positions[:, 0], d.OTHER, "upper mass", 1.4)
            d.line(axes, run.time, run.true_positions[:, 1], d.ESTIMATED, "lower mass")
            how = "not cancelled" if name == "none" else "cancelled"
            d.frame(axes, d.TIME if prefix else "", "position in m", f"({letter}) {how}, {words}")
        for name, colour, label in (("none", d.THIRD_ONE, "#1: (a)"), ("cancelled", d.TRUE, "#2: (b)")):
            run = runs[f"{prefix}{name}"]
            d.line(row[2], run.time, (run.true_positions - ideal.true_positions)[:, 1], colour, label)
        d.frame(row[2], d.TIME if prefix else "", "distance in m", "(c) lower mass")
    d.legend(figure, grid[0, 0], grid[0, 2])

"""Pictures of the position servo: a row for each observer, or one for the servo alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from codegen.effects.declare import system_of
from codegen.simulate.loop_run import LoopRun
from codegen.spec.model import Spec
from codegen.thesis.gallery import drawing as d
from codegen.thesis.gallery.figure import Runs
from codegen.thesis.gallery.measures import position_error

LETTERS = "abcd"


def draw_responses(figure: Any, runs: Runs) -> None:
    """Figure 2.3: response, its distance from the ideal, friction against velocity."""
    response, error, friction = figure.subplots(1, 3)
    run, ideal = runs["a"], runs["ideal"]
    d.line(response, ideal.time, ideal.true_positions[:, 0], d.IDEAL, "without friction", dashes=(0, (5, 2)))
    d.line(response, run.time, run.true_positions[:, 0], d.TRUE, "with friction, not cancelled")
    d.line(error, run.time, position_error(run, ideal), d.TRUE)
    _friction(friction, runs.specs[0], run)
    d.frame(response, d.TIME, "position in m", "(a)")
    d.frame(error, d.TIME, "distance in m", "(b)")
    d.frame(friction, "velocity in m/s", "friction in N", "(c)")
    d.legend(figure, response)


def draw_cancelled(figure: Any, runs: Runs) -> None:
    """Figures 2.4, 2.5, 3.3 and 3.4: a row for each observer, beside the servo without cancellation and the PID."""
    letters = [letter for letter, spec in zip(LETTERS, runs.specs, strict=False) if _drawn(spec, runs)]
    grid = figure.subplots(len(letters), 3, squeeze=False, sharex="col")
    for row, letter, spec in zip(grid, letters, runs.specs, strict=False):
        response, error, friction = row
        run = runs[letter]
        draw_motions(response, error, runs, (f"none_{letter}", f"pid_{letter}", letter))
        d.dots(friction, run.true_velocities[:, 0], run.friction_estimate[:, 0], d.ESTIMATED)
        _friction(friction, spec, run)
        d.limit(friction, run.friction, 1.8)
        last = letter == letters[-1]
        d.frame(response, d.TIME if last else "", "position in m", f"({letter}) {_gains(spec)}")
        d.frame(error, d.TIME if last else "", "distance in m")
        d.frame(friction, "velocity in m/s" if last else "", "friction in N")
    d.legend(figure, grid[0, 0], grid[0, 2])


def draw_motions(response: Any, error: Any, runs: Runs, names: tuple[str, str, str]) -> None:
    """The ideal motion and those not cancelled, under the PID and cancelled; and their distances from the ideal."""
    ideal = runs["ideal"]
    d.line(response, ideal.time, ideal.true_positions[:, 0], d.IDEAL, "without friction", dashes=(0, (5, 2)))
    labels = ("not cancelled", "PID", "estimated and cancelled")
    for name, colour, label, width in zip(
        names, (d.OTHER, d.THIRD_ONE, d.ESTIMATED), labels, (1.4, 1.4, 1.8), strict=True
    ):
        run = runs[name]
        d.line(response, run.time, run.true_positions[:, 0], colour, label, width)
        d.line(error, run.time, position_error(run, ideal), colour, width=width)


def draw_friction(figure: Any, runs: Runs) -> None:
    """Figure 3.2: friction against velocity as it was in the motion."""
    panels = figure.subplots(1, 2)
    for axes, letter, spec, words in zip(panels, "ab", runs.specs, ("Coulomb", "“extended” Coulomb"), strict=True):
        run = runs[letter]
        d.dots(axes, run.true_velocities[:, 0], run.friction[:, 0], d.ESTIMATED, "in the motion")
        _friction(axes, spec, run)
        d.frame(axes, "velocity in m/s", "friction in N", f"({letter}) {words}")
    d.legend(figure, panels[0])


def _drawn(spec: Spec, runs: Runs) -> bool:
    """Whether a spec belongs to this figure, and is not there for a comparison only."""
    return spec.source.split(",")[-1][:-1] == runs.specs[0].source.split(",")[-1][:-1]


def _gains(spec: Spec) -> str:
    choice = spec.observer
    if choice is None:
        return ""
    words = [f"{name} = {value}" for name, value in choice.gains.items() if str(value) != "0"]
    mu = [f"μ = {choice.exponent}"] if choice.kind == "cfo" and choice.velocity == "measured" else []
    return f"{choice.kind.upper()}, " + ", ".join(words + mu).replace("-", "−").replace("K_", "k_")


def _friction(axes: Any, spec: Spec, run: LoopRun) -> None:
    """The law of the spec's first contact over the velocities of a run, joined at standstill."""
    system = system_of(spec)
    contact = system.contacts[0]
    speed = np.linspace(0, float(np.max(np.abs(run.true_velocities))), 100)
    level = [float(contact.law_level.subs({**system.values, contact.slip: float(s)})) for s in speed]
    both = np.concatenate([-speed[::-1], speed]), np.concatenate([-np.array(level[::-1]), level])
    d.line(axes, *both, d.TRUE, "true friction", width=1.6)

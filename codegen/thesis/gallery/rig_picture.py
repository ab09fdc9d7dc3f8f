"""The picture of figures 8.3 to 8.6: one observer's two experiments beside each other."""

from __future__ import annotations

from typing import Any

import numpy as np

from codegen.thesis.gallery import drawing as d
from codegen.thesis.gallery.figure import Runs
from codegen.thesis.gallery.measures import Array
from codegen.thesis.gallery.runs import reference_of

DEGREES = 180 / np.pi


def target_of(runs: Runs) -> Array:
    """The reference of the rig at each sample, (N,), rad."""
    return reference_of(runs.setting.applied(runs.specs[0]), len(runs["ideal"].time))


def drawing_of(name: str) -> Any:
    def draw(figure: Any, runs: Runs) -> None:
        """Left without, right with cancellation: position, distance, friction over time and over velocity."""
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

    return draw

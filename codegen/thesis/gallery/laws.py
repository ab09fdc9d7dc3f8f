"""Figures 1.1 and 1.2: the classical friction laws, and one with hysteresis."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from codegen.spec.model import Spec
from codegen.thesis.gallery import drawing as d
from codegen.thesis.gallery.measures import Reading, after, friction_level, ratio
from codegen.thesis.gallery.runs import Gains, Runs, watch
from codegen.thesis.gallery.setting import Setting

SPEEDS = np.linspace(0.0, 10.0, 401)
TITLES = ("Coulomb", "static and viscous", "static, viscous and Stribeck")
SETTLED = 1.0
"""s from which on the motion counts as periodic."""


def levels_of(specs: Sequence[Spec], setting: Setting, pid: Gains | None = None) -> Runs:
    """No run; the laws are read from the spec."""
    return Runs(specs, setting)


def coulomb_is_constant(runs: Runs) -> Reading:
    force = friction_level(runs.specs[0], 0, SPEEDS)
    spread = float(np.ptp(force) / force.mean())
    return Reading(spread, (("lowest", float(force.min())), ("highest", float(force.max()))), "N")


def breakaway_is_higher(runs: Runs) -> Reading:
    force = friction_level(runs.specs[0], 1, SPEEDS)
    return Reading(ratio(force[0], force[1]), (("at rest", force[0]), ("just sliding", force[1])), "N")


def viscous_part_rises(runs: Runs) -> Reading:
    force = friction_level(runs.specs[0], 1, SPEEDS)
    return Reading(float(np.min(np.diff(force[1:]))), (("just sliding", force[1]), ("at 10 m/s", force[-1])), "N")


def stribeck_dips(runs: Runs) -> Reading:
    force = friction_level(runs.specs[0], 2, SPEEDS)
    at = int(np.argmin(force))
    parts = (("at rest", force[0]), (f"at {SPEEDS[at]:.3g} m/s", force[at]), ("at 10 m/s", force[-1]))
    return Reading(min(float(force[0]), float(force[-1])) - float(force[at]), parts, "N")


def driven(specs: Sequence[Spec], setting: Setting, pid: Gains | None = None) -> Runs:
    """The open-loop motion of the driven mass, as run ``motion``."""
    return Runs(specs, setting, watch(specs[0], setting, {}))


def hysteresis_width(runs: Runs) -> Reading:
    run = runs["motion"]
    force, v = run.friction[:, 0], run.true_velocities[:, 0]
    crossing = np.flatnonzero((force[1:] * force[:-1] < 0) & after(run, SETTLED)[1:])
    share = force[crossing] / (force[crossing] - force[crossing + 1])
    at = v[crossing] + share * (v[crossing + 1] - v[crossing])
    width = float(np.mean(np.abs(at)))
    return Reading(
        width / float(np.max(np.abs(v))), (("force 0 at", width), ("top speed", float(np.max(np.abs(v))))), "m/s"
    )


def draw_laws(figure: Any, runs: Runs) -> None:
    """Figure 1.1: force against velocity of three laws."""
    for k, (axes, title) in enumerate(zip(figure.subplots(1, 3, sharey=True), TITLES, strict=True)):
        force = friction_level(runs.specs[0], k, SPEEDS)
        both = np.concatenate([-SPEEDS[::-1], SPEEDS]), np.concatenate([-force[::-1], force])
        d.line(axes, *both, d.ESTIMATED, None, 2.4)
        d.frame(axes, "velocity in m/s", "friction in N" if k == 0 else "", f"({'abc'[k]}) {title}")


def draw_hysteresis(figure: Any, runs: Runs) -> None:
    """Figure 1.2: force against velocity, and both over time."""
    run = runs["motion"]
    late = after(run, SETTLED)
    loop, time = figure.subplots(1, 2)
    d.line(loop, run.true_velocities[late, 0], run.friction[late, 0], d.ESTIMATED, None, 2.2)
    d.line(time, run.time, run.friction[:, 0], d.ESTIMATED, "friction in N", 2.2)
    d.line(time, run.time, 100 * run.true_velocities[:, 0], d.IDEAL, "velocity in cm/s", 1.6, (0, (5, 2)))
    d.frame(loop, "velocity in m/s", "friction in N", "hysteresis at zero velocity")
    d.frame(time, d.TIME, "friction, velocity")
    d.legend(figure, time)

"""Figure 4.7: the two-link arm, and the stability of its observer along the motion."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from codegen.analysis.error_dynamics import derive_error_dynamics
from codegen.analysis.operating_points import matrix_function
from codegen.base.arrays import Array
from codegen.effects.declare import system_of
from codegen.mechanics.casadi_form import at_points
from codegen.observers import build_observer
from codegen.simulate.loop_run import LoopRun
from codegen.spec.model import Spec
from codegen.thesis.gallery import drawing as d
from codegen.thesis.gallery.measures import Reading, after, friction_error, ratio, rms
from codegen.thesis.gallery.runs import Gains, Runs, watch
from codegen.thesis.gallery.setting import Setting

SETTLED = 5.0
"""s, half of the run."""
STRIDE = 10
"""Samples between those at which Ψ is evaluated."""
JOINTS = ("F₁ at the shoulder", "F₂ at the elbow")


def watched(specs: Sequence[Spec], setting: Setting, pid: Gains | None = None) -> Runs:
    """The arm with its observer, as run ``a``."""
    return Runs(specs, setting, watch(specs[0], setting, {"a": specs[0]}))


def growth_rates(spec: Spec, run: LoopRun) -> Array:
    """Largest real part of Ψ's eigenvalues, 1/s, with Ψ frozen at every ``STRIDE``-th sample of a motion."""
    system = system_of(spec)
    dynamics = derive_error_dynamics(build_observer(spec, system))
    variables = [*system.positions, *system.velocities, *system.inputs, *dynamics.observer.signs]
    slip = run.true_velocities @ np.array(system.distribution, dtype=float)
    rows = np.hstack([run.true_positions, run.true_velocities, run.inputs, np.sign(slip)])[::STRIDE]
    function = matrix_function(dynamics, dynamics.in_force(dynamics.jacobian), variables)
    return np.asarray(np.linalg.eigvals(at_points(function, rows)).real.max(axis=1))


def finds_friction(runs: Runs) -> Reading:
    run = runs["a"]
    late = after(run, SETTLED)
    shares = [ratio(rms(friction_error(run, k)[late]), rms(run.friction[late, k])) for k in range(2)]
    return Reading(max(shares), tuple(zip(("F₁", "F₂"), shares, strict=True)))


def unstable_share(runs: Runs) -> Reading:
    rates = growth_rates(runs.specs[0], runs["a"])
    share = float(np.mean(rates > 0))
    return Reading(share, (("share of the time", share), ("fastest growth in 1/s", float(rates.max()))))


def top_speed(runs: Runs) -> Reading:
    speeds = np.max(np.abs(runs["a"].true_velocities), axis=0)
    return Reading(float(speeds.max()), tuple(zip(("ω₁", "ω₂"), speeds.tolist(), strict=True)), "rad/s")


def draw(figure: Any, runs: Runs) -> None:
    """Friction of both joints, the speeds, and the growth rate of the error."""
    run = runs["a"]
    grid = figure.subplots(2, 2, sharex=True)
    for k, axes in enumerate(grid[0]):
        d.line(axes, run.time, 1e3 * run.friction_estimate[:, k], d.ESTIMATED, "estimated", 1.0)
        d.line(axes, run.time, 1e3 * run.friction[:, k], d.TRUE, "true", 1.4)
        d.limit(axes, 1e3 * run.friction[:, k], 12 if k == 0 else 4)
        d.frame(axes, "", f"F{'₁₂'[k]} in mN·m", f"({'ab'[k]}) {JOINTS[k]}")
    speeds, growth = grid[1]
    for k, (colour, label) in enumerate(((d.OTHER, "ω₁"), (d.THIRD_ONE, "ω₂"))):
        d.line(speeds, run.time, run.true_velocities[:, k], colour, label, 1.2)
    d.frame(speeds, d.TIME, "velocity in rad/s", "speed of the joints")
    rates = growth_rates(runs.specs[0], run)
    d.line(growth, run.time[::STRIDE], rates, d.TRUE, None, 1.2)
    growth.fill_between(run.time[::STRIDE], 0, rates, where=rates > 0, color=d.OTHER, alpha=0.5, linewidth=0)
    d.frame(growth, d.TIME, "max Re λ(Ψ) in 1/s", "frozen error dynamics: unstable above 0")
    d.legend(figure, grid[0, 0], speeds)

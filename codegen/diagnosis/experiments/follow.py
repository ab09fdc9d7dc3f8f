"""Simulation of a machine that follows a path under a position loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.diagnosis.fit.search import Search
from codegen.logs import Log
from codegen.mechanics.system import System
from codegen.simulate.controller import Feedback, sampled
from codegen.simulate.loop_run import LoopRun

LOOP_SHARE, LOOP_SAMPLES = 0.4, 60
"""Bandwidth of the loop over the coarse cutoff, and least number of samples in its period."""


def follow(
    search: Search,
    machine: System,
    target: Array,
    rate: Array,
    centre: Array,
    h: float,
    limit: Array | None = None,
    substeps: int | None = None,
) -> LoopRun | None:
    """Simulate a machine that follows a trajectory under a PD loop, critically damped at ``centre``.

    The run starts at rest at the first position.

    Args:
        search: its system and cutoff give the gains, see ``loop_gains``.
        machine: the plant.
        target, rate: (N, n) reference positions and velocities, one row for each sample.
        centre: (n,) positions at which the gains are computed.
        h: sample time, s.
        limit: (m,) largest |w|; None for no limit.
        substeps: of the plant in a sample; by default those of ``substeps_of``.

    Returns:
        The run, or None if it diverges.
    """
    from codegen.simulate.observed_loop import run_loop  # with the code generator, which few diagnoses need

    position_gain, velocity_gain = loop_gains(search, centre, h)
    controller = Feedback(
        len(machine.inputs),
        machine.degrees_of_freedom,
        reference=sampled(target, h),
        velocity_reference=sampled(rate, h),
        position_gain=position_gain,
        velocity_gain=velocity_gain,
    )
    start = (target[0], np.zeros_like(target[0]))
    run = run_loop(machine, h, len(target), controller, limit=limit, start=start, substeps=substeps)
    return run if np.isfinite(run.positions).all() and np.isfinite(run.inputs).all() else None


def logged(log: Log, positions: Array, inputs: Array) -> Log:
    """A copy of a log with the data of a simulated run."""
    time = log.sample_time * np.arange(len(positions), dtype=np.float64)
    return replace(log, time=time, positions=positions, velocities=None, inputs=inputs, gaps=())


def loop_gains(search: Search, centre: Array, h: float) -> tuple[Array, Array]:
    """(m, n) gains ω² B⁺M and 2ω B⁺M of a critically damped position loop; M and B = ∂g/∂w at ``centre``."""
    system = search.system
    at = dict(system.values) | dict(zip(system.positions, map(float, centre), strict=True))
    at |= dict.fromkeys((*system.velocities, *system.inputs), 0)
    mass = np.array(system.mass_matrix.subs(at), dtype=float)
    reached = np.array(sympy.Matrix(system.force).jacobian(list(system.inputs)).subs(at), dtype=float)
    frequency = 2 * np.pi * min(LOOP_SHARE * search.motion.cutoff_hz, 1 / (LOOP_SAMPLES * h))
    to_inputs = np.linalg.pinv(reached) @ mass
    return frequency**2 * to_inputs, 2 * frequency * to_inputs

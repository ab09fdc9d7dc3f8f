"""A machine simulated as its spec's ``simulation`` section says: plant, encoders, PD control, hold and delay."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, floor
from typing import Any

import casadi
import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.errors import BadInput
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import TIME, System
from codegen.simulate.controller import Loop, commands, control_loops, encoder, low_passed_velocity
from codegen.simulate.dynamic_contact import DynamicContacts
from codegen.simulate.plant import Plant
from codegen.simulate.simulable import refuse_unsimulable
from codegen.simulate.simulated_log import SimulatedLog
from codegen.spec.model import Simulation, Spec

Array = NDArray[np.float64]
LONGEST_SUBSTEP = 1e-4
STEP_OF_PRESLIDING = 0.05
MOST_SUBSTEPS = 1000
PARTS = 20


def simulate(spec: Spec, system: System, progress: Callable[[float], None] | None = None) -> SimulatedLog:
    """Simulate ``spec.simulation`` on ``system``.

    Inputs follow their functions of t, plus PD control on the measured position where a reference is given; see
    ``controller``. The machine starts at rest at its reference (zero without one), with no command before t = 0.
    Substeps are at most ``LONGEST_SUBSTEP`` long and, where a law has states, 1/20 of what a radian of the oscillation
    on the stuck contact takes: position and velocity then agree with an exact integration to 1e-5 of their size.

    Args:
        spec: for its ``simulation`` section.
        system: the machine, with its effects; it may differ from what the spec declares.
        progress: told the share that is done, from 0 to 1.

    Raises:
        BadInput: if the spec has no simulation section, a reference or gain has no counterpart, a contact's law cannot
            be simulated, or the motion leaves all bounds.
    """
    simulation = spec.simulation
    if simulation is None:
        raise BadInput(
            spec.place("simulation"), "no simulation section", "`simulation:` with duration, sample_time and inputs"
        )
    refuse_unsimulable(spec, system)
    loops = control_loops(spec, simulation)
    period, n, m = simulation.sample_time, system.degrees_of_freedom, len(system.inputs)
    count = round(simulation.duration / period)
    time: Array = period * np.arange(count, dtype=np.float64)
    generator = np.random.default_rng(simulation.seed)
    noise = generator.standard_normal((count, n)) * [simulation.position_noise.get(x, 0.0) for x in spec.positions]
    feed = _signals([simulation.inputs.get(w.name, sympy.Integer(0)) for w in spec.inputs], time)
    target = _signals([loops[j].reference if j in loops else sympy.Integer(0) for j in range(m)], time)
    position = np.zeros(n)
    for index, loop in loops.items():
        position[loop.coordinate] = target[0, index]
    machine = _Machine(spec, simulation, system, loops, _substeps(system, period, position))
    drive = np.hstack([time[:, None], feed, target, noise])
    recorded = machine.run(machine.start(position, noise[0]), drive, progress)
    measured, w, x, v, force = np.split(recorded, np.cumsum([n, m, n, n]), axis=1)
    if not np.all(np.isfinite(recorded)):
        first = time[np.argmin(np.all(np.isfinite(recorded), axis=1))]
        found = f"a motion that leaves all bounds at t = {first:.4g} s"
        raise BadInput(
            spec.place("simulation"), found, "inputs, gains and parameters under which the machine stays bounded"
        )
    return SimulatedLog(time, measured, w, x, v, force)


class _Machine:
    """One sample of plant and controller as a CasADi function.

    The state is (plant state, last measurement, velocity estimate, commands: this sample's and those before it).
    """

    def __init__(
        self, spec: Spec, simulation: Simulation, system: System, loops: dict[int, Loop], substeps: int
    ) -> None:
        period = simulation.sample_time
        self.plant = Plant(system, substeps)
        self._spec, self._simulation = spec, simulation
        n, m = system.degrees_of_freedom, len(system.inputs)
        delays = [
            float(system.values[system.input_delay[w]]) / period if w in system.input_delay else 0.0
            for w in system.inputs
        ]
        self.history = 1 + max((ceil(d) for d in delays), default=0)
        state = casadi.SX.sym("state", self.plant.state_size + 2 * n + m * self.history)
        drive = casadi.SX.sym("drive", 1 + 2 * m + n)
        plant, before, estimate, past = casadi.vertsplit(
            state, np.cumsum([0, self.plant.state_size, n, n, m * self.history]).tolist()
        )
        t, feed, target, noise = casadi.vertsplit(drive, np.cumsum([0, 1, m, m, n]).tolist())
        measured = encoder(spec, simulation, plant[:n], noise)
        velocity = low_passed_velocity(measured, before, estimate, period)
        w = commands(spec, simulation, loops, feed, target, measured, velocity)
        past = casadi.vertcat(w, past)[: m * self.history]
        effective = _delayed(past, delays, self.plant.substeps)
        after, force = self.plant.sample(plant, casadi.vertcat(t, period / self.plant.substeps, *effective))
        record = casadi.vertcat(measured, w, plant[: 2 * n], force)
        self.sample = casadi.Function(
            "sample", [state, drive], [casadi.vertcat(after, measured, velocity, past), record]
        )

    def start(self, position: Array, noise: Array) -> Array:
        """The state at rest at ``position`` (n,), measured with ``noise`` (n,)."""
        measured = encoder(self._spec, self._simulation, casadi.DM(position), casadi.DM(noise)).full().ravel()
        rest = self.plant.start(position, np.zeros_like(position))[0]
        past = np.zeros(len(self.plant.system.inputs) * self.history)
        return np.concatenate([rest, measured, np.zeros_like(position), past])

    def run(self, state: Array, drive: Array, progress: Callable[[float], None] | None) -> Array:
        """Records, one row per row of ``drive``, in parts between which progress is told."""
        length = ceil(len(drive) / PARTS)
        function = self.sample.mapaccum("part", length, 1)
        padded = np.vstack([drive, np.repeat(drive[-1:], PARTS * length - len(drive), axis=0)])
        records, now = [], casadi.DM(state)
        for part in range(PARTS):
            states, record = function(now, padded[part * length : (part + 1) * length].T)
            now = states[:, -1]
            records.append(record.full().T)
            if progress is not None:
                progress((part + 1) / PARTS)
        return np.asarray(np.vstack(records)[: len(drive)], dtype=float)


def _substeps(system: System, period: float, position: Array) -> int:
    """Substeps of a sample: short against the oscillation of a contact stuck on its law's presliding spring."""
    longest = LONGEST_SUBSTEP
    dynamic = DynamicContacts(system)
    if dynamic.contacts:
        names = {s: casadi.SX(float(value)) for s, value in system.values.items()}
        names |= {s: casadi.SX(float(x)) for s, x in zip(system.positions, position, strict=True)}
        mass, U = (np.asarray(casadi.evalf(to_casadi(m, names))) for m in (system.mass_matrix, system.distribution))
        mobility = np.diag(U.T @ np.linalg.solve(mass, U))[list(dynamic.contacts)]
        rate = float(np.sqrt(np.max(mobility * np.maximum(dynamic.stiffness, 0))))
        longest = min(longest, STEP_OF_PRESLIDING / rate) if rate > 0 else longest
    return min(max(1, ceil(period / longest - 1e-9)), MOST_SUBSTEPS)


def _delayed(past: Any, delays: list[float], substeps: int) -> list[Any]:
    """Effective inputs of all substeps; ``past`` holds the commands, latest first, ``delays`` are in samples."""
    m = len(delays)
    effective = []
    for substep in range(substeps):
        for index, delay in enumerate(delays):
            whole = floor(delay)
            older = min(max((delay - whole) * substeps - substep, 0.0), 1.0)
            w = past[whole * m + index]
            effective.append(w if older == 0 else (1 - older) * w + older * past[(whole + 1) * m + index])
    return effective


def _signals(functions: list[sympy.Expr], time: Array) -> Array:
    """(N, functions) values of expressions over t."""
    t = casadi.SX.sym("t")
    values = casadi.vertcat(*[to_casadi(f, {TIME: t}) for f in functions])
    function = casadi.Function("signals", [t], [values])
    return np.asarray(function(time[None, :]).full().T, dtype=float)

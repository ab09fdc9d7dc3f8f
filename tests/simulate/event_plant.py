"""Event-driven simulation of a plant with stick and slip: the independent reference for the time stepper."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi
import numpy as np
from scipy.integrate import solve_ivp

from codegen.base.arrays import Array
from codegen.mechanics.casadi_form import in_place, symbol_values, to_casadi
from codegen.mechanics.solve import factorised
from codegen.mechanics.system import TIME, System
from codegen.simulate.drive import HeldInput
from codegen.simulate.plant import PlantContacts, smooth_forces

from .mode_search import Limits, Mode, NoMode, find_mode, forces_of

TOLERANCE = 1e-11
"""Relative tolerance of the integrator; the absolute one is a tenth of it."""
_REST = 1e-11
"""Slip speed below which a contact counts as at rest at an event."""
_BACK = 1e-12
"""A sliding mode ends at this slip speed against its direction, a sticking one at this share of the level above it.

With zero instead, rounding would end the mode of a contact that barely slides or sticks at every step.
"""
_ROUNDING = 64 * float(np.finfo(np.float64).eps)
"""Relative magnitude below which an acceleration counts as a rounding error."""
_MOST_EVENTS = 10_000
"""Most events between two changes of the input; beyond them the state is NaN."""


class EventPlant:
    """Event-driven plant of a System whose friction laws are all set-valued.

    A mode says for each contact whether it slides forward, backward, or sticks. Within a mode the motion is a smooth
    differential equation (DOP853), in which forces keep U'v = 0 of the stuck contacts. The mode ends when a slip
    reaches zero or the force of a stuck contact its level, an event located on the integrator's dense output. The next
    mode is the consistent one among all possible modes.

    Attributes:
        state: (2 n,) positions and velocities now.
        positions, velocities: (n,) views of ``state``.
        forces: λ at the beginning of the last sample.
        events: number of events so far.
    """

    def __init__(self, system: System, period: float, x: Array, v: Array) -> None:
        """Raises ValueError for a law with states, an actuator with a lag, or a load behind a spring."""
        contacts = PlantContacts(system)
        lags = any(system.actuator(k).lag is not None for k in range(len(system.inputs)))
        laws = [f"the law {system.contacts[c].law.name}" for c in contacts.dynamic.contacts]
        beyond = ["an actuator lag"] * lags + ["a compliance or backlash"] * bool(system.transmissions) + laws
        if beyond:
            raise ValueError(f"{beyond[0]} of {system.name}: for the time stepper alone")
        n = system.degrees_of_freedom
        self.state: Array = np.concatenate([x, v]).astype(float)
        self.positions, self.velocities = self.state[:n], self.state[n:]
        self.forces, self.events = np.zeros(len(system.contacts)), 0
        self._n, self._period = n, period
        self._edges = _edges(system, period)
        self._held = HeldInput(system, period, self._edges)
        function, count = _laws(system, contacts), len(system.contacts)
        ends = np.cumsum([n * count, n, *[count] * 7, count * count]).tolist()
        self._places = [slice(a, b) for a, b in zip([0, *ends], ends, strict=False)]
        self._given, self._found = np.zeros(function.size1_in(0)), np.zeros(function.size1_out(0))
        self._buffer, self._evaluate = in_place(function, [self._given], [self._found])
        self._directions = np.zeros(len(system.contacts), dtype=int)
        self._set_directions(_REST)

    def move(self, time: float, command: Array) -> None:
        """Simulate one sample under a command held from ``time``."""
        marks = time + self._period * self._edges
        for piece, w in enumerate(self._held.take(command)):
            mode = self._mode(marks[piece], w)
            if piece == 0:
                self.forces = mode.forces + self._at(marks[0], self.state, w).smooth
            self._until(marks[piece], marks[piece + 1], w, mode)

    def _until(self, now: float, end: float, w: Array, mode: Mode) -> None:
        """Integrate from ``now`` to ``end`` under the input w, from event to event; NaN if that fails."""
        for _ in range(_MOST_EVENTS):
            watched = range(len(mode.directions))
            found = solve_ivp(
                self._rate,
                (now, end),
                self.state,
                "DOP853",
                args=(w, mode.directions),
                rtol=TOLERANCE,
                atol=TOLERANCE / 10,
                events=[_Event(self._distance, c) for c in watched],
            )
            if not found.success or not np.isfinite(found.y[:, -1]).all():
                self.state[:] = np.nan
                return
            self.state[:], now = found.y[:, -1], float(found.t[-1])
            if found.status != 1:
                return
            self.events += 1
            met = [c for c in watched if len(found.t_events[c])]
            leaving = {c: self._way_out(now, w, mode, c) for c in met if not mode.directions[c]}
            for c in met:
                self._directions[c] = 0
            self._set_directions(_REST)
            mode = self._mode(now, w, leaving)
        self.state[:] = np.nan

    def _set_directions(self, rest: float) -> None:
        """Set the directions by the slip velocities; a slip below ``rest`` is set to zero exactly, by an impulse."""
        laws = self._at(0.0, self.state, None)
        slow = np.abs(laws.slip) <= rest
        self._directions = np.where(slow, 0, np.sign(laws.slip)).astype(int)
        chosen = np.flatnonzero(slow)
        if len(chosen):
            own = laws.mobility[np.ix_(chosen, chosen)]
            self.velocities -= laws.compliance[:, chosen] @ np.linalg.lstsq(own, laws.slip[chosen], rcond=1e-11)[0]

    def _mode(self, time: float, w: Array, leaving: dict[int, int] | None = None) -> Mode:
        """The consistent mode at the present state; ``leaving`` as of ``find_mode``, ignored if inconsistent."""
        laws = self._at(time, self.state, w)
        resting = np.flatnonzero(self._directions == 0).tolist()
        parts = list(self._directions), resting, laws.free, laws.mobility, laws.limits
        try:
            mode = find_mode(*parts, leaving)
        except NoMode:
            mode = find_mode(*parts)
        self._directions = np.array(mode.directions)
        return mode

    def _way_out(self, time: float, w: Array, mode: Mode, c: int) -> int:
        """The direction, ±1, in which a stuck contact at its level begins to slide."""
        laws = self._at(time, self.state, w)
        return 1 if forces_of(mode.directions, laws.free, laws.mobility, laws.limits)[c] > 0 else -1

    def _rate(self, time: float, state: Array, w: Array, directions: tuple[int, ...]) -> Array:
        """d(state)/dt within a mode."""
        laws = self._at(time, state, w)
        forces = forces_of(directions, laws.free, laws.mobility, laws.limits)
        held = laws.compliance @ forces
        size = np.abs(laws.motion) + np.abs(laws.compliance) @ np.abs(forces)
        # The rounding error of balanced forces is set to zero, so that a contact at rest stays at rest.
        moved = np.where(np.abs(laws.motion - held) <= _ROUNDING * size, 0.0, laws.motion - held)
        return np.concatenate([state[self._n :], moved])

    def _distance(self, time: float, state: Array, w: Array, directions: tuple[int, ...], c: int) -> float:
        """Event function of a contact: distance of a sliding one from rest, or of a stuck one from break-away."""
        laws = self._at(time, state, w)
        if directions[c]:
            return float(directions[c] * laws.slip[c] + _BACK)
        forward, backward = laws.limits.held_forward[c], laws.limits.held_backward[c]
        force = forces_of(directions, laws.free, laws.mobility, laws.limits)[c]
        return float(min(forward - force, backward + force) + _BACK * (forward + backward))

    def _at(self, time: float, state: Array, w: Array | None) -> _Laws:
        self._given[: 2 * self._n], self._given[2 * self._n : -1], self._given[-1] = (
            state,
            0.0 if w is None else w,
            time,
        )
        self._evaluate()
        return _Laws([self._found[place].copy() for place in self._places], self._n)


class _Laws:
    """Quantities at a state, unpacked from the columns of ``_laws``.

    Attributes:
        compliance: M⁻¹U, (n, contacts).
        motion: M⁻¹(g − U smooth), the accelerations without set-valued forces, (n,).
        slip, free: u, and u' without set-valued forces, (contacts,).
        smooth: smooth contact forces, (contacts,).
        mobility: U'M⁻¹U.
        limits: levels of the set-valued forces.
    """

    def __init__(self, columns: Sequence[Array], n: int) -> None:
        compliance, self.motion, self.slip, self.free, self.smooth, *levels, mobility = columns
        contacts = len(self.slip)
        self.compliance = np.ascontiguousarray(compliance.reshape(contacts, n).T)
        self.mobility = np.ascontiguousarray(mobility.reshape(contacts, contacts).T)
        self.limits = Limits(*levels)


def _laws(system: System, contacts: PlantContacts) -> Any:
    """CasADi function of the column (x, v, w, t) → the parts of ``_Laws``, column by column."""
    n, count = system.degrees_of_freedom, len(system.contacts)
    x, v, w = casadi.SX.sym("x", n), casadi.SX.sym("v", n), casadi.SX.sym("w", len(system.inputs))
    t = casadi.SX.sym("t")
    columns = (system.positions, x), (system.velocities, v), (system.inputs, w)
    names = symbol_values(system.values, *columns) | {TIME: t}
    mass, U = to_casadi(system.mass_matrix, names), to_casadi(system.distribution, names)
    factors = factorised(mass)
    compliance = factors.solve_columns(U)
    slip = casadi.mtimes(U.T, v)
    levels = contacts.levels(slip, names)
    smooth = smooth_forces(system.contacts, slip, names)
    motion = factors.solve(to_casadi(system.force, names) - casadi.mtimes(U, smooth))
    free = casadi.mtimes(U.T, motion) + casadi.jtimes(slip, x, v)
    jumps = levels.jumps
    held = [
        casadi.vertcat(*[(rest if jumps[c] else sliding)[c] for c in range(count)])
        for rest, sliding in ((levels.held, levels.forward), (levels.held, levels.backward))
    ]
    parts = [compliance, motion, slip, free, smooth, levels.forward, levels.backward, *held]
    found = casadi.vertcat(*(casadi.vec(casadi.densify(p)) for p in (*parts, casadi.mtimes(U.T, compliance))))
    return casadi.Function("laws", [casadi.vertcat(x, v, w, t)], [found], {"cse": True})


def _edges(system: System, period: float) -> Array:
    """The times within a sample, from 0 to 1, at which a delayed command changes, with both ends."""
    delays = [float(system.actuator(k).delay.subs(system.values)) / period for k in range(len(system.inputs))]
    return np.array(sorted({0.0, 1.0} | {d % 1 for d in delays}))


class _Event:
    """An event for SciPy's integrator: a contact's ``_distance`` falls to zero."""

    terminal = True
    direction = -1.0

    def __init__(self, distance: Callable[..., float], contact: int) -> None:
        self._distance, self._contact = distance, contact

    def __call__(self, time: float, state: Array, w: Array, directions: tuple[int, ...]) -> float:
        return self._distance(time, state, w, directions, self._contact)

"""The machine in time: Moreau's midpoint scheme with set-valued friction, one coordinate a contact.

A step takes the position half a step on with the old speed, finds the new speed there from forces at the mean speed,
and the other half with the new speed. With diagonal inertia the friction of a step has a closed form: the speed that
the other forces give is brought towards zero by at most dt·level/M, and stays there if that suffices.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from benchmarks.machines.disturbances import Coupled, Coupling, Disturbance, Inertia, Presliding
from benchmarks.machines.families import Family, Values

TINY = 1e-12
"""Speed by which a direction of slip is given to friction laws at rest."""


def slowed(v: float, forward: float, backward: float) -> float:
    """A speed after friction that may change it by at most ``forward`` (if positive) or ``backward``."""
    return max(0.0, v - forward) if v > 0 else min(0.0, v + backward)


@dataclass
class Plant:
    """A machine with its true parameters, friction levels and what the spec lacks.

    Attributes:
        levels: a of each contact. step: of the integration, s.
        x, v: state. load: position and speed of the load of a coupled axis. bristle: Dahl's z of each contact.
    """

    family: Family
    values: Values
    levels: Sequence[float]
    lacks: Sequence[Disturbance]
    step: float = 2e-4
    x: list[float] = field(default_factory=list)
    v: list[float] = field(default_factory=list)
    t: float = 0.0

    def __post_init__(self) -> None:
        count = len(self.family.axes)
        self.x, self.v = self.x or [0.0] * count, self.v or [0.0] * count
        self.factors = self.family.drive(self.values)
        self.load, self.bristle = [self.x[0], 0.0], [0.0] * count
        kinds = self.lacks
        self.chain = sorted((d for d in kinds if type(d).current is not Disturbance.current), key=lambda d: d.stage)
        self.forces = [d for d in kinds if type(d).force is not Disturbance.force]
        self.rough = [d for d in kinds if type(d).level is not Disturbance.level]
        self.presliding = {d.k: d.p["sigma"] for d in kinds if isinstance(d, Presliding)}
        self.heavier = {d.k: d.p["delta"] for d in kinds if isinstance(d, Inertia)}
        self.coupled = next((d for d in kinds if isinstance(d, Coupled)), None)
        if self.coupled is not None and not self.family.separate:
            raise ValueError(f"{self.family.name}: no load behind a spring")

    def advance(self, currents: Sequence[float], duration: float) -> None:
        """Go on with currents that are held, one an axis."""
        for _ in range(max(1, round(duration / self.step))):
            acted = list(currents)
            for d in self.chain:
                acted[d.k] = d.current(self.t, acted[d.k], self.step)
            self._step([f * i for f, i in zip(self.factors, acted, strict=True)])

    def _step(self, drive: list[float]) -> None:
        dt, half = self.step, self.step / 2
        x = [a + half * b for a, b in zip(self.x, self.v, strict=True)]
        load = self.load[0] + half * self.load[1]
        self.t += half
        bristle = self.bristle
        mean, loaded, after, after_load = self.v, self.load[1], self.v, self.load[1]
        for _ in range(2):
            after, after_load, bristle = self._speeds(x, mean, load, loaded, drive)
            mean = [(a + b) / 2 for a, b in zip(self.v, after, strict=True)]
            loaded = (self.load[1] + after_load) / 2
        self.x = [a + half * b for a, b in zip(x, after, strict=True)]
        self.load = [load + half * after_load, after_load]
        self.v, self.bristle = after, bristle
        self.t += dt - half

    def _speeds(
        self, x: list[float], v: list[float], load: float, load_speed: float, drive: list[float]
    ) -> tuple[list[float], float, list[float]]:
        """The speeds of axes and load at the end of a step, by forces at (x, v) in its middle; and the bristles."""
        dt, family, p = self.step, self.family, self.values
        mass = family.mass(p, x, math)
        for k, delta in self.heavier.items():
            mass[k] += delta
        moving, fixed = family.motion(p, x, v, math), family.position(p, x, math)
        after_load = load_speed
        if self.coupled is not None:
            share = self.coupled.p["load_fraction"]
            between = self.coupled.between(x[0] - load, v[0] - load_speed)
            at_load = family.position(p, [load], math)[0]
            after_load = self.load[1] + dt * (at_load + between) / (share * mass[0])
            mass[0], fixed[0] = (1 - share) * mass[0], -between
        force = [a + b + c for a, b, c in zip(drive, moving, fixed, strict=True)]
        for d in self.forces:
            added = d.force(self.t, x, v, drive[d.k])
            force[d.k] += added
            if isinstance(d, Coupling):
                force[1 - d.k] -= added
        after, bristle = [], list(self.bristle)
        for k, f in enumerate(force):
            if k in self.presliding:
                sigma, a = self.presliding[k], self.level(k, x[k], v[k], drive[k])
                # Midpoint rule of z' = v − (σ/a) z |v|, which is linear in z.
                rate = dt * sigma / a * abs(v[k])
                bristle[k] = (self.bristle[k] * (1 - rate / 2) + dt * v[k]) / (1 + rate / 2)
                f -= sigma * (bristle[k] + self.bristle[k]) / 2
                after.append(self.v[k] + dt * f / mass[k])
                continue
            speed = abs(v[k]) + TINY
            forward, backward = (self.level(k, x[k], u, drive[k]) for u in (speed, -speed))
            after.append(slowed(self.v[k] + dt * f / mass[k], dt * forward / mass[k], dt * backward / mass[k]))
        return after, after_load, bristle

    def level(self, k: int, s: float, u: float, drive: float) -> float:
        """The friction level of contact k at slip position s, slip speed u and drive force ``drive``."""
        added = sum(d.level(self.t, s, u, drive) for d in self.rough if d.k == k)
        return max(0.0, self.levels[k] + added)

    def measured(self) -> list[float]:
        """Positions as the encoders have them, before quantisation."""
        seen = list(self.x)
        for d in self.lacks:
            seen[d.k] = d.measured(seen[d.k])
        return seen

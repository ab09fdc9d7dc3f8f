"""Effects of a compliant drive: a spring between motor and load, without or with backlash."""

from collections.abc import Mapping
from itertools import product
from math import pi, sqrt
from typing import ClassVar

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.base.significant import in_percent
from codegen.effects.effect import Confusion, Effect, EffectParameter, Symbols
from codegen.effects.on_coordinate import InertiaError
from codegen.effects.places import coupled_or_varying
from codegen.effects.start import Covered
from codegen.mechanics.actuator import Transmission
from codegen.mechanics.system import System

STIFFNESS = EffectParameter("k", "{F}/{q}", "stiffness", low=0.0, essential=True)
DAMPING = EffectParameter("c", "{F}*s/{q}", "damping", low=0.0)
LEAST_LOAD = 0.02
"""Least load fraction that a diagnosis accepts. The effect of a lighter load is at its resonance only, and can be the
same as that of a disturbance periodic in time."""
SHARE = EffectParameter(
    "load_fraction", "1", "share ρ of the inertia behind the spring", low=0.0, high=1.0, absent_at=LEAST_LOAD
)
FREQUENCIES = (0.15, 0.4, 1.0, 2.5, 6.0)
"""Starting values of the resonance frequency, as multiples of the log's cutoff frequency."""
LOADS = (0.3, 0.65)
"""Starting values of the load fraction."""
DAMPING_RATIOS = (0.15, 0.6)
"""Starting values of the damping ratio of the resonance: lightly and well damped."""
GAPS, GAP_RATIO = 5, 1.25
"""Number of starting gaps for every coupling, and ratio of neighbouring gaps for well damped couplings of medium
stiffness. The free-run error depends on the gap only within about a quarter of the true gap, but then for any coupling
near the true one."""
FOLLOWED_LOADS, FOLLOWED_RATIO = (0.25, 0.45, 0.65), 1.5
FOLLOWED_CONTACTS = ((0.4, 0.15), (0.63, 0.15), (1.0, 0.6), (2.5, 0.6))
"""Load fractions, ratio of neighbouring gaps, and contacts of the grid of ``Effect.followed``: frequency, as a multiple
of the log's cutoff frequency, and damping ratio. The force residual changes gradually with all of them, and gives the
friction level too. A hard contact whose ringing is above the cutoff is well damped in it; a soft one rings in the log.
"""
HELD_FREQUENCIES, HELD_RATIOS = tuple(np.geomspace(0.05, 1.5, 14).tolist()), (0.05, 0.3)
"""Natural frequencies of the load with the motor held, as multiples of the log's cutoff frequency, and damping ratios:
the grid of ``Effect.followed`` where a declared force of position, such as gravity, acts at the load and moves it."""
RESTARTED_LOADS, IMPACT = (0.15, 0.35, 0.55, 0.75), 0.3
"""Load fractions, and damping ratio, from which a fit of backlash is repeated with the fitted stiffness.

Slow motion under gravity depends on the stiffness only, so the load fraction of the first fit may be wrong by far. Then
the frequency of the load is wrong too, a lightly damped load is simulated out of phase, and a fit keeps the wrong load.
So the starts are well damped: their phase is about right if the frequency is right to about the damping ratio."""
CONTACTS = (0.5, 2.0)
"""Stiffness and damping, over the fitted ones, of the neighbours of a fit of backlash. Impacts of stiff contacts last a
few samples, so the free-run error depends little on them, and a search ends near its start."""
SEEN_GAP = 2.0
"""Least gap, in standard deviations of the position noise, for which backlash is distinguishable from compliance."""


class OnAxis(Effect):
    """A spring between the motor of an axis and its load."""

    sits_on = "axis"
    seen_over = "time"
    nameless: ClassVar[tuple[str, ...]] = ("slipping_load",)
    needs = "an axis with a constant inertia of its own, not coupled to others, and no compliance or backlash yet"

    def applies(self, system: System, place: int) -> bool:
        taken = any(t.coordinate == place for t in system.transmissions)
        return not taken and not coupled_or_varying(system, place)

    def add(self, system: System, place: int, p: Symbols) -> System:
        gap = p.get("gap", sympy.S.Zero)
        return system.with_transmission(Transmission(place, p["k"], p["c"], p["load_fraction"], gap))

    def unseen(self, values: Mapping[str, float], noise: float) -> str:
        """Why a log cannot show this load: it is lighter than ``LEAST_LOAD``; "" where it can."""
        share = values["load_fraction"]
        if share >= LEAST_LOAD:
            return ""
        return f"acts at its resonance alone: its load is {in_percent(share)} of the inertia"

    def limit(self, system: System, place: int, values: Mapping[str, float]) -> tuple[str, dict[str, float]] | None:
        """An inertia error of −ρM: with a spring too soft to move the load, only the motor's inertia acts."""
        inertia = float(system.mass_matrix[place, place].subs(system.values))
        return InertiaError.kind, {"delta": -values["load_fraction"] * inertia}


class Compliance(OnAxis):
    """Compliance: inertia (1 − ρ)M at the motor, ρM at the load, and the force k dx + c dv between, dx = x − x_load.

    Encoder, input, friction and damping are at the motor, and so are forces of other effects, such as cogging; declared
    forces of position alone, such as gravity, act at the load.
    """

    kind = "compliance"
    equation = "(1 − ρ)·M at the motor, ρ·M at the load; between them k·dx + c·dv"
    signature = "a resonance: ringing after each jump of the input or of friction"
    parameters = (STIFFNESS, DAMPING, SHARE)
    confused_with = (
        Confusion("backlash", "preload: it takes the play out"),
        Confusion("input_delay", "a chirp to high frequencies"),
        Confusion("actuator_lag", "a chirp to high frequencies"),
        Confusion("presliding", "a chirp to high frequencies"),
    )

    def starts(self, covered: Covered) -> list[dict[str, float]]:
        """Lightly damped resonances from 0.15 to 6 times the cutoff frequency, with load fractions of 0.3 and 0.65."""
        return [_coupling(covered, *where) for where in product(FREQUENCIES, LOADS, DAMPING_RATIOS[:1])]

    def suggested(self, covered: Covered) -> list[dict[str, float]]:
        return [dict(one) for one in covered.resonances()]

    def coupling(self, values: Mapping[str, float]) -> dict[str, float] | None:
        return dict(values)

    def followed(self, covered: Covered) -> list[dict[str, float]]:
        """A grid where a force acts at the load, such as gravity; else no start.

        Without such a force the motion of the load is the filtered motion of the motor, and ``suggested`` gives better
        starts.
        """
        if not covered.carried:
            return []
        grid = product(HELD_FREQUENCIES, FOLLOWED_LOADS, HELD_RATIOS)
        return [_held(covered, 2 * pi * frequency * covered.cutoff_hz, *load) for frequency, *load in grid]


class Backlash(OnAxis):
    """Backlash: as compliance, but the force acts only beyond half the gap, and the surfaces push and never pull."""

    kind = "backlash"
    equation = "as compliance, with a force only where |dx| > gap/2, and never pulling"
    signature = "lost motion: after each reversal the motor turns without its load"
    parameters = (EffectParameter("gap", "{q}", "full width of the play", low=0.0), STIFFNESS, DAMPING, SHARE)
    confused_with = (
        Confusion("compliance", "preload: it takes the play out"),
        Confusion("presliding", "a microscopic slow sine: presliding resists it with a force, backlash does not"),
        Confusion("input_delay", "a chirp at two amplitudes"),
    )
    extends = Compliance.kind

    @property
    def rough(self) -> bool:
        """True: a small change of a parameter shifts an impact by a sample."""
        return True

    def restarts(self, values: Mapping[str, float], covered: Covered) -> list[dict[str, float]]:
        """The found stiffness with other loads, well damped: from a lightly damped start a fit keeps the wrong load."""
        gap = {"gap": values["gap"]}
        return [gap | _spring(covered, values["k"], load, IMPACT) for load in RESTARTED_LOADS]

    def neighbours(self, values: Mapping[str, float]) -> list[dict[str, float]]:
        """The same play and load with softer and harder contacts."""
        return [dict(values) | {name: ratio * values[name] for name in ("k", "c")} for ratio in CONTACTS]

    def starts(self, covered: Covered) -> list[dict[str, float]]:
        """Gaps from the noise to a tenth of the span, each with the compliance fitted at this axis and stiffer ones.

        The free-run error depends on the gap only near the true one. So for well damped couplings of medium stiffness
        the gaps are close to each other.
        """
        stiff = [_coupling(covered, *where) for where in product(FREQUENCIES[2:], LOADS, DAMPING_RATIOS)]
        middling = [_coupling(covered, *where) for where in product(FREQUENCIES[2:4], LOADS, DAMPING_RATIOS[1:])]
        couplings, close = [covered.coupling, *stiff] if covered.coupling else stiff, _gaps(covered, 1e-5, GAP_RATIO)
        return [
            {**coupling, "gap": float(gap)}
            for some, gaps in ((couplings, np.geomspace(close[0], close[-1], GAPS)), (middling, close))
            for coupling in some
            for gap in gaps
        ]

    def followed(self, covered: Covered) -> list[dict[str, float]]:
        couplings = [
            _coupling(covered, frequency, load, damping_ratio)
            for frequency, damping_ratio in FOLLOWED_CONTACTS
            for load in FOLLOWED_LOADS
        ]
        gaps = _gaps(covered, 1e-3, FOLLOWED_RATIO)
        return [{**coupling, "gap": float(gap)} for coupling in couplings for gap in gaps]

    def unseen(self, values: Mapping[str, float], noise: float) -> str:
        """Why a log cannot show these values: gap within the noise, or load below ``LEAST_LOAD``; "" where it can."""
        if values["gap"] < SEEN_GAP * noise:
            return "has a gap below what the noise of the position lets one see"
        return super().unseen(values, noise)


def _gaps(covered: Covered, least_share: float, ratio: float) -> Array:
    """Gaps from the noise, or this share of half the span, to a tenth of the span; neighbours at most at this ratio."""
    noise, half = covered.noise, covered.half_span
    least, most = max(2 * noise, least_share * half), max(20 * noise, 0.2 * half)
    return np.geomspace(least, most, 2 + int(np.log(most / least) / np.log(ratio)))


def _coupling(covered: Covered, frequency: float, load: float, damping_ratio: float) -> dict[str, float]:
    """k, c and load_fraction for a resonance of motor and load at ``frequency`` times the log's cutoff frequency."""
    k = load * (1 - load) * covered.inertia * (2 * pi * frequency * covered.cutoff_hz) ** 2
    return _spring(covered, k, load, damping_ratio)


def _spring(covered: Covered, k: float, load: float, damping_ratio: float) -> dict[str, float]:
    """k, c and load_fraction for this stiffness and damping ratio of the resonance of motor and load."""
    c = 2 * damping_ratio * sqrt(k * load * (1 - load) * covered.inertia)
    return {"k": k, "c": c, "load_fraction": load}


def _held(covered: Covered, frequency: float, load: float, damping_ratio: float) -> dict[str, float]:
    """k, c and load_fraction for a resonance of the load at ``frequency``, in rad/s, with the motor held."""
    mass = load * covered.inertia
    return {"k": mass * frequency**2, "c": 2 * damping_ratio * frequency * mass, "load_fraction": load}

"""Regions of the envelope in which a DFO is stable, although its level is unobservable at zero friction or slip.

A region is a box in the variables of ``along_friction``, the same for both signs of every friction state. How far it
goes is found by bisection, in floating point; ``region_proofs`` then has the checker decide.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.certify import centre
from codegen.certify.along_friction import AlongFriction, Box, ContactAxes
from codegen.certify.centre import Group, least_rate
from codegen.certify.content import Found
from codegen.certify.enclosure import Enclosure, cells_of, exact_ranges
from codegen.certify.family import Family
from codegen.certify.lyapunov import (
    Worst,
    analytic_centre_at,
    common_lyapunov_at,
    common_lyapunov_of_many,
    decay_rate_limit,
)
from codegen.certify.prefix import rounded

KEPT, KEPT_BESIDE = 0.5, 0.4
"""Shares of the best rate of sliding: certified at the largest |f| for the slips of the region, and for its other |f|.
The first is also the rate while sliding of the P that bounds the growth through zero."""
DEARER = 2.0
"""Factor by which the accelerations may increase the growth through zero."""
PRESLIDING = 0.25
"""Presliding: the share of the spectral rate that is certified in its region."""
DIRECTIONS = ((-1.0, 1.0), (0.0, 1.0), (0.2, 1.0))
"""Slips as shares of the largest: both directions, and two ranges of those along the friction state."""
COARSE, RATIO, FINE = 8.0, 0.03, 2e-4
BELOW, THIN = 5e-4, 0.99
FLOOR, FASTEST, CELLS = 1e-6, 2.0, 5
DIGITS = 5
"""Of the ends of a box."""
NEAR = 1e-5
"""As in ``lyapunov``, for the many matrices of cells: within 1 % of the proved limit."""


class RegionSearch:
    """Looks for the boxes."""

    def __init__(self, along: AlongFriction) -> None:
        self.along = along
        self.h = float(along.dynamics.observer.sample_time)
        self.fastest_slip = max(float(axis.largest_slip) for axis in along.axes)
        self.acceleration = 0.0
        self.sliding: list[Any] | None = None
        self._enclosures: dict[int, Enclosure] = {}

    def regions(self) -> list[Found]:
        """Sliding first; what is not found is left out."""
        sliding = self._sliding()
        if sliding is None:
            return []
        found, states, slips = [], *sliding
        self.sliding = states
        family, stack = self._family(self._box(states, slips))
        best = common_lyapunov_of_many(stack, self.h)
        if best is None:
            return []
        if any(axis.largest_rate is None for axis in self.along.axes):
            self._bound_acceleration(states, slips, best[1])
            family, stack = self._family(self._box(states, slips))
            best = common_lyapunov_of_many(stack, self.h) or best
        found.append(self._split("sliding", family) or Found(family, *best, kind="sliding"))
        found += self._presliding(states)
        return found + self._through_zero(family, stack, best[1])

    def presliding(self, along: AlongFriction) -> list[Found]:
        """Presliding alone, at other levels, with the sliding and the accelerations that ``regions`` found."""
        other = RegionSearch(along)
        other.acceleration, other._enclosures = self.acceleration, self._enclosures
        return [] if self.sliding is None else other._presliding(self.sliding)

    def _bound_acceleration(self, states: list[Any], slips: tuple[float, float], rate: float) -> None:
        """Up to where growth through zero is at most DEARER times that without acceleration."""
        leasts = [axis.least_state for axis in self.along.axes]

        def both(w: float) -> tuple[Array, Array]:
            return self._family(self._box(states, slips, w))[1], self._family(self._box(leasts, (-1.0, 1.0), w))[1]

        stack, whole = both(0.0)
        growth, _ = self._growth([(stack, KEPT * rate)], whole)
        worst: Worst = []

        def holds(w: float) -> bool:
            stack, whole = both(w)
            return common_lyapunov_at([(stack, KEPT * rate), (whole, -DEARER * growth)], self.h, worst) is not None

        self.acceleration = _bisected(holds, 0.0, 2 * self.fastest_slip / self.h, True)

    def _growth(self, groups: Sequence[Group], whole: Array) -> tuple[float, Array | None]:
        """The least rate of growth, 1/s, of a P that also meets the conditions of ``groups``, and this P or None."""
        worst: Worst = []

        @cache
        def served(rate: float) -> Array | None:
            return common_lyapunov_at([*groups, (whole, -rate)], self.h, worst)

        def holds(rate: float) -> bool:
            return served(rate) is not None

        least = 1.0
        while not holds(least) and least < FASTEST / self.h:
            least *= COARSE
        while least > FLOOR and holds(least / COARSE):
            least /= COARSE
        least = _bisected(holds, least, least / COARSE, geometric=True)
        return least, served(least)

    def _sliding(self) -> tuple[list[Any], tuple[float, float]] | None:
        """The least |f| of each contact, and the slips as shares of the largest, where at least KEPT of the rate is."""
        tips = [axis.largest_state for axis in self.along.axes]
        limit = self._limit(self._box(tips, (0.5, 1.0)))
        slips = next((s for s in DIRECTIONS[:2] if self._holds(tips, s, KEPT * limit)), None)
        if slips is None:
            low = _bisected(lambda x: self._holds(tips, (x, 1.0), KEPT * limit), 1.0, 1e-3, geometric=True)
            slips = (low, 1.0) if low < 1 else None
        if slips is None or limit <= 0:
            return None
        slower, directions = KEPT_BESIDE * limit, slips
        for k, axis in enumerate(self.along.axes):

            def holds(least: Any, k: int = k) -> bool:
                return self._holds([*tips[:k], least, *tips[k + 1 :]], directions, slower)

            tips[k] = self._least_state(axis, holds)
        return (tips, slips) if self._holds(tips, slips, 0.9 * slower) else None

    def _least_state(self, axis: ContactAxes, holds: Callable[[Any], bool]) -> Any:
        """The least |f|, to four decimals, for which a condition holds that holds at the largest."""
        good, bad = float(axis.largest_state), float(axis.least_state)
        found = bad if holds(axis.least_state) else _bisected(lambda x: holds(rounded(x, DIGITS)), good, bad)
        return min(rounded(np.ceil(found * 1e4) / 1e4, DIGITS), axis.largest_state)

    def _presliding(self, sliding: list[Any]) -> list[Found]:
        """Away from zero friction, for both directions of slip; or for that of the friction state, away from zero slip.

        Up to the largest |f|, or to where sliding begins: a law with a kink there is two laws. Empty if none is found.
        """
        tops = [axis.largest_state for axis in self.along.axes]
        below = [rounded(np.floor((float(x) - BELOW) * 1e4) / 1e4, DIGITS) for x in sliding]
        for slips, upper in product((DIRECTIONS[0], DIRECTIONS[2]), (tops, below)):
            region = self._away(upper, *slips)
            if region is not None and [region.family.variables[axis.state][0] for axis in self.along.axes] < sliding:
                return [region]
        return []

    def _away(self, tops: list[Any], low: float, high: float) -> Found | None:
        def box(share: float, t: float) -> Box:
            states = [rounded(np.ceil(share * float(top) * 1e4) / 1e4, DIGITS) for top in tops]
            return self._box([min(pair) for pair in zip(states, tops, strict=True)], (low * t, high * t), tops=tops)

        worst: Worst = []

        @cache
        def holds(share: float, t: float) -> bool:
            stack = self._family(box(share, t))[1]
            limit = decay_rate_limit(stack, self.h)
            return limit > 0 and common_lyapunov_at([(stack, PRESLIDING * limit)], self.h, worst) is not None

        slow = 1e-3 if low < 0 < high else 0.02
        if not holds(THIN, slow):  # nor then with less left out
            return None
        least = _bisected(lambda x: holds(x, slow), 1.0, 0.0)
        if least > THIN:
            return None
        share = least + (1 - least) / 4
        t = _bisected(lambda t: holds(share, t), slow, 1.0, geometric=True) if holds(share, slow) else slow
        family, stack = self._family(box(share, t))
        best = common_lyapunov_of_many(stack, self.h, near=centre.NEAR)  # few digits must do for its P
        return None if best is None else Found(family, *best, kind="presliding")

    def _through_zero(self, sliding: Family, stack: Array, rate: float) -> list[Found]:
        """The least growth over the whole envelope, and with a P that falls while sliding, at KEPT of the rate."""
        family, whole = self._family(self._box([axis.least_state for axis in self.along.axes], (-1.0, 1.0)))
        found = []
        claims: list[tuple[str, list[Group]]] = [("weak", []), ("passing", [(stack, KEPT * rate)])]
        for kind, groups in claims:
            growth, p = self._growth(groups, whole)
            p = analytic_centre_at([*groups, (whole, -growth)], self.h, p)
            if p is None:
                continue
            shown = least_rate(p, whole, self.h)
            found.append(Found(family, p, shown - 1e-3 * abs(shown), kind=kind))
            if groups:
                shown = least_rate(p, stack, self.h)
                found.append(Found(sliding, p, shown * 0.999, kind="recovery"))
        return found

    def _box(
        self, states: list[Any], slips: tuple[float, float], w: float | None = None, tops: list[Any] | None = None
    ) -> Box:
        """From the least and largest |f| of each contact, slips as shares of the largest, and the largest |du/dt|."""
        box: dict[sympy.Symbol, tuple[Any, Any]] = {}
        w = self.acceleration if w is None else w
        tops = tops or [axis.largest_state for axis in self.along.axes]
        for axis, least, top in zip(self.along.axes, states, tops, strict=True):
            share = float(axis.largest_slip) / self.fastest_slip
            most = rounded(w * share, DIGITS) if axis.largest_rate is None else axis.largest_rate
            box[axis.state] = (least, top)
            low, high = slips
            box[axis.slip] = (rounded(low, DIGITS) * axis.largest_slip, rounded(high, DIGITS) * axis.largest_slip)
            box[axis.slip_rate] = (-most, most)
        return box

    def _family(self, box: Box) -> tuple[Family, Array]:
        family = self.along.family(box)
        if id(family.matrix) not in self._enclosures:
            self._enclosures[id(family.matrix)] = Enclosure(family)
        return family, self._enclosures[id(family.matrix)].vertices([exact_ranges(family)])

    def _split(self, kind: str, family: Family) -> Found | None:
        """Of one contact: the box in cells, whose enclosures lose less."""
        if len(self.along.axes) > 1:
            return None
        ends, axis = exact_ranges(family), self.along.axes[0]
        breaks = {
            v: [low + (high - low) * Fraction(k, CELLS) for k in range(CELLS + 1)]
            for v, (low, high) in ends.items()
            if v in (axis.state, axis.slip)
        }
        stack = self._enclosures[id(family.matrix)].vertices({**ends, **cell} for cell in cells_of(breaks))
        best = common_lyapunov_of_many(stack, self.h, near=NEAR)
        exact = {v: [sympy.Rational(x.numerator, x.denominator) for x in points] for v, points in breaks.items()}
        return None if best is None else Found(family, *best, exact, kind=kind)

    def _limit(self, box: Box) -> float:
        return decay_rate_limit(self._family(box)[1], self.h)

    def _holds(self, states: list[Any], slips: tuple[float, float], rate: float) -> bool:
        stack = self._family(self._box(states, slips))[1]
        return (
            rate > 0
            and decay_rate_limit(stack, self.h) > rate
            and common_lyapunov_at([(stack, rate)], self.h) is not None
        )


def _bisected(holds: Callable[[float], bool], good: float, bad: float, geometric: bool = False) -> float:
    """The number nearest to ``bad`` for which a condition is found to hold that holds at ``good``, to 3 % or 0.0001."""
    if holds(bad):
        return bad
    if good == 0.0:  # a largest size: tenths of ``bad`` down to one that is good
        good = bad
        while not holds(good):
            good, bad = good / COARSE, good
            if good < FLOOR:
                return 0.0
    while abs(good - bad) > (RATIO * abs(good) if geometric else FINE):
        middle = float(np.sqrt(good * bad)) if geometric else (good + bad) / 2
        good, bad = (middle, bad) if holds(middle) else (good, middle)
    return good

"""Search for regions of the envelope in which a DFO is stable, its level being unobservable at zero friction or slip.

A region is a box in the sign-symmetric coordinates of ``along_friction``, which covers both signs of every friction
state. Its size is found by bisection in floating point; ``region_proofs`` submits it to the checker.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.certify.along_friction import AlongFriction, ContactAxes
from codegen.certify.centre import Group, least_rate
from codegen.certify.certificate_text import rounded
from codegen.certify.content import Found
from codegen.certify.enclosure import Enclosure, cells_of, exact_ranges
from codegen.certify.family import Family
from codegen.certify.lyapunov import Active, analytic_centre_at, common_lyapunov, common_lyapunov_at, decay_rate_limit

KEPT, KEPT_BELOW = 0.5, 0.4
"""Least decay rates in the sliding region, as shares of the best one: at the largest |f|, and below it. The first is
also required of the P that bounds the growth of V through zero friction, while sliding."""
LARGEST_INCREASE = 2.0
"""Largest factor by which the range of accelerations may increase the growth rate through zero friction."""
PRESLIDING = 0.25
"""Presliding: the share of the spectral rate that is certified in its region."""
DIRECTIONS = ((-1.0, 1.0), (0.0, 1.0), (0.2, 1.0))
"""Ranges of σu as shares of the largest slip: both directions, and two ranges with slip and friction of one sign."""
COARSE, RATIO, FINE = 8.0, 0.03, 2e-4
"""Bisection: factor of the first steps, and the relative and the absolute tolerance."""
BELOW, THIN = 5e-4, 0.99
"""Distance of presliding below the least |f| of sliding, and the largest least |f| of presliding over its largest."""
FLOOR, FASTEST, CELLS = 1e-6, 2.0, 5
"""Least rate of growth that is searched for, 1/s; h times the largest; cells for each variable of ``_split``."""
DIGITS = 5
"""Significant digits of the ends of a box."""
NEAR = 1e-5
"""Relative tolerance of the method of centres for cells: the rate is then within 1 % of the proved limit."""


class RegionSearch:
    """Search for the boxes of sliding, presliding and reversals, and for their Lyapunov matrices.

    Attributes:
        fastest_slip: the largest slip speed of all contacts.
        acceleration: bound on |du/dt| of the fastest contact, if the envelope has none; found by ``regions``.
    """

    def __init__(self, along: AlongFriction) -> None:
        self.along = along
        self.h = float(along.dynamics.observer.sample_time)
        self.fastest_slip = max(float(axis.largest_slip) for axis in along.axes)
        self.acceleration = 0.0
        self._enclosures: dict[int, Enclosure] = {}
        self._active: Active = {}

    def regions(self) -> list[Found]:
        """The proposals found: sliding first, then presliding, then those for the whole envelope."""
        sliding = self._sliding()
        if sliding is None:
            return []
        found, states, slips = [], *sliding
        family, stack = self._family(states, slips)
        best = common_lyapunov(stack, self.h, near=NEAR)
        if best is None:
            return []
        if any(axis.largest_rate is None for axis in self.along.axes):
            self._bound_acceleration(states, slips, best[1])
            family, stack = self._family(states, slips)
            best = common_lyapunov(stack, self.h, near=NEAR) or best
        found.append(self._split(family) or _found(family, stack, best, "sliding"))
        found += self._presliding(states)
        return found + self._through_zero(family, stack, best[1])

    def _bound_acceleration(self, states: list[Any], slips: tuple[float, float], rate: float) -> None:
        """Set ``acceleration``: the largest with at most ``LARGEST_INCREASE`` times the growth rate through zero.

        ``states``, ``slips`` and ``rate``, 1/s, are those of the sliding region.
        """
        leasts = [axis.least_state for axis in self.along.axes]

        def both(w: float) -> tuple[Array, Array]:
            """A at the vertices of the sliding region, and of the whole envelope, for accelerations up to w."""
            return self._family(states, slips, w)[1], self._family(leasts, (-1.0, 1.0), w)[1]

        stack, whole = both(0.0)
        growth, _ = self._growth([(stack, KEPT * rate)], whole)

        def holds(w: float) -> bool:
            stack, whole = both(w)
            return self._exists([(stack, KEPT * rate), (whole, -LARGEST_INCREASE * growth)])

        self.acceleration = _bisected(holds, 0.0, 2 * self.fastest_slip / self.h, True)

    def _growth(self, groups: Sequence[Group], whole: Array) -> tuple[float, Array | None]:
        """(r, P): the least r, 1/s, for which some P has the rates of ``groups``, and at least −r for ``whole``."""

        @cache
        def holds(rate: float) -> bool:
            return self._exists([*groups, (whole, -rate)])

        least = 1.0
        while not holds(least) and least < FASTEST / self.h:
            least *= COARSE
        while least > FLOOR and holds(least / COARSE):
            least /= COARSE
        least = _bisected(holds, least, least / COARSE, geometric=True)
        return least, common_lyapunov_at([*groups, (whole, -least)], self.h)

    def _sliding(self) -> tuple[list[Any], tuple[float, float]] | None:
        """The sliding region: least |f| of each contact, and (low, high) slips as shares of the largest; or None."""
        leasts = [axis.largest_state for axis in self.along.axes]
        limit = decay_rate_limit(self._family(leasts, (0.5, 1.0))[1], self.h)
        slips = next((s for s in DIRECTIONS[:2] if self._holds(leasts, s, KEPT * limit)), None)
        if slips is None:
            low = _bisected(lambda x: self._holds(leasts, (x, 1.0), KEPT * limit), 1.0, 1e-3, geometric=True)
            slips = (low, 1.0) if low < 1 else None
        if slips is None or limit <= 0:
            return None
        lower_rate, directions = KEPT_BELOW * limit, slips
        for k, axis in enumerate(self.along.axes):

            def holds(least: Any, k: int = k) -> bool:
                return self._holds([*leasts[:k], least, *leasts[k + 1 :]], directions, lower_rate)

            leasts[k] = self._least_state(axis, holds)
        return (leasts, slips) if self._holds(leasts, slips, 0.9 * lower_rate) else None

    def _least_state(self, axis: ContactAxes, holds: Callable[[Any], bool]) -> Any:
        """The least |f| for which a condition holds, by bisection from the largest |f|; rounded up to four decimals."""
        good, bad = float(axis.largest_state), float(axis.least_state)
        found = bad if holds(axis.least_state) else _bisected(lambda x: holds(rounded(x, DIGITS)), good, bad)
        return min(rounded(np.ceil(found * 1e4) / 1e4, DIGITS), axis.largest_state)

    def _presliding(self, sliding: list[Any]) -> list[Found]:
        """The proposal of presliding, a region without zero friction; empty if none is found.

        Slips are of both directions or, if that fails, of the sign of the friction state and not zero. |f| is up to the
        largest or, if that fails, to where sliding begins, since the law may be piecewise with a kink there.
        """
        largest = [axis.largest_state for axis in self.along.axes]
        below = [rounded(np.floor((float(x) - BELOW) * 1e4) / 1e4, DIGITS) for x in sliding]
        for slips, tops in product((DIRECTIONS[0], DIRECTIONS[2]), (largest, below)):
            region = self._away(tops, slips)
            if region is not None and [region.family.variables[axis.state][0] for axis in self.along.axes] < sliding:
                return [region]
        return []

    def _away(self, tops: list[Any], slips: tuple[float, float]) -> Found | None:
        """The largest region |f| ≤ ``tops`` with slips in t times these, shares of the largest, and its P; or None.

        V decreases there at ``PRESLIDING`` of the spectral rate.
        """
        low, high = slips

        def family_at(share: float, t: float) -> tuple[Family, Array]:
            """The family with |f| from this share of ``tops`` up to ``tops``, and t times these slips."""
            states = [rounded(np.ceil(share * float(top) * 1e4) / 1e4, DIGITS) for top in tops]
            least = [min(pair) for pair in zip(states, tops, strict=True)]
            return self._family(least, (low * t, high * t), tops=tops)

        @cache
        def holds(share: float, t: float) -> bool:
            stack = family_at(share, t)[1]
            limit = decay_rate_limit(stack, self.h)
            return limit > 0 and self._exists([(stack, PRESLIDING * limit)])

        slow = 1e-3 if low < 0 < high else 0.02  # the least t
        if not holds(THIN, slow):  # nor for a larger region
            return None
        least = _bisected(lambda x: holds(x, slow), 1.0, 0.0)
        if least > THIN:
            return None
        share = least + (1 - least) / 4
        t = _bisected(lambda t: holds(share, t), slow, 1.0, geometric=True) if holds(share, slow) else slow
        family, stack = family_at(share, t)
        best = common_lyapunov(stack, self.h)  # few digits must do for its P
        return None if best is None else _found(family, stack, best, "presliding")

    def _through_zero(self, sliding: Family, stack: Array, rate: float) -> list[Found]:
        """Proposals for the whole envelope with the least growth of V: any P, and a P that decreases while sliding.

        ``sliding``, ``stack`` and ``rate`` are the family of sliding, its matrices at vertices, and its decay rate,
        1/s.
        """
        family, whole = self._family([axis.least_state for axis in self.along.axes], (-1.0, 1.0))
        found = []
        claims: list[tuple[str, list[Group]]] = [("weak", []), ("passing", [(stack, KEPT * rate)])]
        for kind, groups in claims:
            growth, p = self._growth(groups, whole)
            p = analytic_centre_at([*groups, (whole, -growth)], self.h, p)
            if p is None:
                continue
            found.append(_found(family, whole, (p, least_rate(p, whole, self.h)), kind))
            if groups:
                found.append(_found(sliding, stack, (p, least_rate(p, stack, self.h)), "recovery"))
        return found

    def _family(
        self, states: list[Any], slips: tuple[float, float], w: float | None = None, tops: list[Any] | None = None
    ) -> tuple[Family, Array]:
        """The family over the box of a region, and A at the vertices of its parameter box, N by m by m.

        Args:
            states, tops: least and largest |f| of each contact; largest: by default that of the envelope.
            slips: (low, high) as shares of the largest slip.
            w: largest |du/dt| of the fastest contact, where the envelope has none; ``acceleration`` by default.
        """
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
        family = self.along.family(box)
        if id(family.matrix) not in self._enclosures:
            self._enclosures[id(family.matrix)] = Enclosure(family)
        return family, self._enclosures[id(family.matrix)].vertices([exact_ranges(family)])

    def _split(self, family: Family) -> Found | None:
        """The proposal of sliding by cells in |f| and slip, whose enclosures are tighter; None for several contacts."""
        if len(self.along.axes) > 1:
            return None
        ends, axis = exact_ranges(family), self.along.axes[0]
        breaks = {
            v: [low + (high - low) * Fraction(k, CELLS) for k in range(CELLS + 1)]
            for v, (low, high) in ends.items()
            if v in (axis.state, axis.slip)
        }
        stack = self._enclosures[id(family.matrix)].vertices({**ends, **cell} for cell in cells_of(breaks))
        best = common_lyapunov(stack, self.h, near=NEAR)
        return None if best is None else replace(_found(family, stack, best, "sliding"), splits=breaks)

    def _holds(self, states: list[Any], slips: tuple[float, float], rate: float) -> bool:
        """Whether a common P with this decay rate, 1/s, is found for a box."""
        stack = self._family(states, slips)[1]
        return rate > 0 and decay_rate_limit(stack, self.h) > rate and self._exists([(stack, rate)])

    def _exists(self, groups: Sequence[Group]) -> bool:
        """Whether a common P with the rates of these groups is found."""
        return common_lyapunov_at(groups, self.h, self._active) is not None


def _found(family: Family, stack: Array, best: tuple[Array, float], kind: str) -> Found:
    """The proposal of a P, with a rate 0.1 % below that of the P: it is then certified with fewer digits of P."""
    p, rate = best
    return Found(family, p, rate - 1e-3 * abs(rate), kind=kind, matrices=stack)


def _bisected(holds: Callable[[float], bool], good: float, bad: float, geometric: bool = False) -> float:
    """The number nearest to ``bad`` at which a condition holds, as at ``good``: to 0.0002, or of logarithms to 3 %."""
    if holds(bad):
        return bad
    if good == 0.0:  # search for the largest size: ``bad`` divided by 8 until the condition holds
        good = bad
        while not holds(good):
            good, bad = good / COARSE, good
            if good < FLOOR:
                return 0.0
    while abs(good - bad) > (RATIO * abs(good) if geometric else FINE):
        middle = float(np.sqrt(good * bad)) if geometric else (good + bad) / 2
        good, bad = (middle, bad) if holds(middle) else (good, middle)
    return good

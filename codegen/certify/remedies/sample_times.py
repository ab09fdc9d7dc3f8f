"""Largest sample time that can be certified at a spec's gains, for every integration method of its observer."""

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
import sympy

from codegen.analysis.analysis import Analysis, analyse
from codegen.analysis.error_dynamics import ErrorDynamics
from codegen.analysis.operating_points import distinct_points, matrix_function
from codegen.base.errors import BadInput
from codegen.certify.along_friction import Box, along_friction
from codegen.certify.centre import least_rate
from codegen.certify.certificate_text import rounded
from codegen.certify.certify import Certificate, Refusal
from codegen.certify.content import Found, frame, proved
from codegen.certify.cover import sampled_matrices, with_cover
from codegen.certify.enclosure import Cells, Enclosure, enclose_family, exact_ranges, partition
from codegen.certify.family import Family, NotEnclosable, build_family
from codegen.certify.levels import levels_of
from codegen.certify.lyapunov import common_lyapunov_at, decay_rate_limit
from codegen.certify.size_limit import beyond_checker
from codegen.checker import verify
from codegen.mechanics.casadi_form import at_points
from codegen.mechanics.computed import ComputedEntry
from codegen.observers import build_observer
from codegen.observers.velocity import INTEGRATIONS
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical

ANY = 1e3
"""Sample time that counts as arbitrarily long, s."""
SHORTEST = 1e-9
"""Shortest sample time that is tried, s."""
STEPS, STEPS_VARYING = 14, 8
"""Numbers of bisection steps for a constant and for a varying A."""
FACTOR = 4.0
"""Quotient of successive sample times before the bisection."""
MARGIN, NEAR = 0.995, 0.99
"""Share of the largest feasible sample time that is submitted to the checker, and share of the spectral limit that is
tried first."""
CELLS = 64
"""Largest number of cells of the envelope, if a P is found over these at the spec's own sample time. With the thousands
that a certificate may have, the search takes minutes; for a slider-crank it finds a sample time that is 1 % longer."""
SLOWEST = 1e-3
"""Required decay rate for a varying A, as a share of the upper bound that the vertices give."""

Breaks = Mapping[sympy.Symbol, Sequence[Fraction]]
"""Variable → breakpoints of the cells."""


@numerical("the largest sample times")
def largest_sample_times(spec: Spec, own: Analysis, outcome: Certificate | Refusal | None = None) -> dict[str, float]:
    """Integration method → the largest certified sample time, s; inf if 1000 s is certified, 0 if none was found.

    The tolerance is 1 %, or 2 % if A varies over the envelope and needs a common P. A method is omitted if it does not
    apply (velocity measured, K_v not diagonal) or if a certificate cannot express its A. Each sample time was certified
    by the checker.

    Args:
        own: analysis of the spec.
        outcome: result of ``certify``; for a refused DFO with a certified sliding region, the sample times are those of
            the region.
    """
    found: dict[str, float] = {}
    euler: ErrorDynamics | None = None
    choice, system = spec.required_observer, own.dynamics.observer.system
    if beyond_checker(own.dynamics.observer) or system.mass_matrix.has(ComputedEntry):
        return found  # no A that a certificate can state
    regions = outcome.regions if isinstance(outcome, Refusal) else None
    sliding = None if regions is None else regions.proofs.get("sliding.json")
    content = outcome.content if isinstance(outcome, Certificate) else {"variables": {}}
    breaks: Breaks = {}
    covered = True
    if sliding is None and not own.points.missing:
        with suppress(NotEnclosable, TypeError, verify.Refused):
            breaks, covered = _chosen(spec, levels_of(own, content), isinstance(outcome, Certificate))
    for integration in INTEGRATIONS:
        chosen = replace(spec, observer=replace(choice, integration=integration, domain=None))
        with suppress(BadInput, NotEnclosable, TypeError):  # BadInput: the method does not apply to this observer
            same = integration == choice.integration and choice.domain is None
            observer = build_observer(chosen, system)
            if sliding is not None:  # over the ranges of the spec's own step
                analysis = replace(own, dynamics=replace(own.dynamics, observer=observer))
                largest = _largest_sliding(chosen, analysis, sliding)
            else:
                analysis = own if same else analyse(chosen, observer, conditions=False, differential=euler)
                euler = analysis.dynamics if integration == "euler" else euler
                if analysis.points.missing:
                    continue
                largest = _largest(chosen, levels_of(analysis, content), breaks, covered)
            if largest is not None:
                found[integration] = largest
    return found


def _chosen(spec: Spec, analysis: Analysis, certified: bool) -> tuple[Breaks, bool]:
    """(breakpoints of the cells at every sample time, whether a P with a cover is searched for first).

    ``certified``: whether there is a P at the spec's own sample time.
    """
    family = build_family(analysis.dynamics, analysis.points.ranges)
    few = partition(family, CELLS)
    if not certified:
        return few, True
    own = float(analysis.dynamics.observer.sample_time)
    covered = not analysis.dynamics.implicit and sampled_matrices(family) is not None
    covered = covered and _Proofs(spec, analysis, _at_samples, covered=True).certified(own)
    enough = _Proofs(spec, analysis, partial(_at_cells, few)).feasible(own)
    return few if enough else partition(family), covered


def _largest(spec: Spec, analysis: Analysis, breaks: Breaks, covered: bool) -> float | None:
    """The largest certified sample time over the envelope, s; ``breaks`` and ``covered`` are of ``_chosen``."""
    at_cells = partial(_at_cells, breaks)
    dynamics, ranges = analysis.dynamics, analysis.points.ranges
    stable, own = _stable(analysis), build_family(dynamics, ranges)
    if not any(e.free_symbols for e in own.parameters.values()):
        return _Proofs(spec, analysis, at_cells).largest(stable, STEPS)
    if analysis.largest_sample_time == 0:  # not stable in continuous time
        return 0.0
    with suppress(verify.Refused):  # of an expression, which ends in no sample time below
        Enclosure(own)  # raises NotEnclosable: ``certify`` refuses such a matrix at every sample time
    low = high = float(dynamics.observer.sample_time)
    while high < ANY and stable(high):
        low, high = high, high * FACTOR
    beyond = _between(stable, low, high, STEPS_VARYING if low < high < ANY else 0)[1]
    if covered and not dynamics.implicit and sampled_matrices(own) is not None:
        proofs = _Proofs(spec, analysis, _at_samples, covered=True)
        if largest := proofs.largest(proofs.feasible, STEPS_VARYING, beyond):
            return largest
    proofs = _Proofs(spec, analysis, at_cells)
    return proofs.largest(proofs.feasible, STEPS_VARYING, beyond)


def _at_cells(breaks: Breaks, analysis: Analysis) -> tuple[Family, Cells]:
    """The family of an analysis over the envelope, and its cells."""
    family = build_family(analysis.dynamics, analysis.points.ranges)
    return family, enclose_family(family, breaks)


def _at_samples(analysis: Analysis) -> tuple[Family, Cells]:
    """The family of an analysis over the envelope, and its matrices at sampled points; a cover has to follow."""
    family = build_family(analysis.dynamics, analysis.points.ranges)
    matrices = sampled_matrices(family)
    if matrices is None:
        raise NotEnclosable("the error matrix has no cover at another sample time")
    return family, Cells({}, matrices)


def _largest_sliding(spec: Spec, analysis: Analysis, content: Mapping[str, Any]) -> float | None:
    """The largest certified sample time in the region of a sliding.json, s; None if A has no symmetric form."""
    along = along_friction(levels_of(analysis, content))
    if along is None:
        return None
    ranges, symbols = content["variables"], [v for axis in along.axes for v in axis.symbols]
    ends = {v: [sympy.Rational(x) for x in ranges[v.name]] for v in symbols if v.name in ranges}
    # A slip without a range is in no entry of A at the spec's own step, so that every slip of the envelope is allowed.
    box: Box = {axis.slip: (-axis.largest_slip, axis.largest_slip) for axis in along.axes}
    box = {**box, **{v: (low, high) for v, (low, high) in ends.items()}}

    def cells(at: Analysis) -> tuple[Family, Cells]:
        family = along.at(at.dynamics.observer.sample_time).family(box)
        return family, Cells({}, Enclosure(family).vertices([exact_ranges(family)]))

    proofs = _Proofs(spec, analysis, cells)
    return proofs.largest(proofs.feasible, STEPS_VARYING)


def _stable(analysis: Analysis) -> Callable[[float], bool]:
    """The test of a sample time: whether the error is stable at every point; for a constant A there is then a P."""
    dynamics = analysis.dynamics
    step = dynamics.in_force(dynamics.sampled)
    points, _ = distinct_points(dynamics, analysis.points, step)
    function = matrix_function(dynamics, step, points.variables)

    def stable(h: float) -> bool:
        rows = np.column_stack([points.values, np.full(len(points.values), h)])
        values = np.linalg.eigvals(at_points(function, rows))
        return bool(np.abs(dynamics.multipliers(values, h)).max() < 1)

    return stable


@dataclass(frozen=True, eq=False)
class _Proofs:
    """Search for a common P of all cells of the envelope at given sample times, and its proof.

    Attributes:
        cells_at: analysis → the family and its matrices at the sample time of the analysis.
        covered: whether these are sampled, so that the proof needs a cover.
    """

    spec: Spec
    analysis: Analysis
    cells_at: Callable[[Analysis], tuple[Family, Cells]]
    covered: bool = False

    def largest(self, feasible: Callable[[float], bool], steps: int, beyond: float = ANY) -> float | None:
        """The largest certified sample time, s: from the spec's own up or down by factors, then by bisection.

        inf if ``ANY`` is certified; None if a P is found for ``ANY`` that the checker refuses; 0 if none is certified.

        Args:
            feasible: whether a P exists, in floating point, at a sample time.
            steps: number of bisection steps.
            beyond: upper bound of the sample time, s.
        """
        if beyond >= ANY and feasible(ANY):
            return math.inf if self.certified(ANY) else None
        low = high = float(self.analysis.dynamics.observer.sample_time)

        if beyond < ANY and feasible(NEAR * beyond):
            low, high, steps = NEAR * beyond, beyond, 0
        while not feasible(low):
            low, high = low / FACTOR, low
            if low < SHORTEST:
                return 0.0
        while high == low or (high < beyond and feasible(high)):
            low, high = high, min(high * FACTOR, beyond)
        low, _ = _between(feasible, low, high, steps)
        tried = (float(f"{low * share:.3g}") for share in (MARGIN, MARGIN**2, 0.9))
        return next(filter(self.certified, tried), 0.0)

    def feasible(self, h: float) -> bool:
        """Whether a P is found at this sample time, s."""
        return self.found(h) is not None

    def found(self, h: float) -> tuple[Analysis, Found] | None:
        """(analysis at this sample time, P in floating point); None if no P is found."""
        dynamics = self.analysis.dynamics
        at = replace(self.analysis, dynamics=dynamics.at(rounded(h, 12)))
        try:
            family, cells = self.cells_at(at)
        except verify.Refused:
            return None
        step = 0.0 if dynamics.implicit else h
        limit = decay_rate_limit(cells.matrices, step)
        p = common_lyapunov_at([(cells.matrices, SLOWEST * limit)], step) if limit > 0 else None
        if p is None:
            return None
        rate = least_rate(p, cells.matrices, step)
        return at, Found(family, p, 0.999 * rate, cells.splits, matrices=cells.matrices)

    def certified(self, h: float) -> bool:
        """Whether a P is found at this sample time and the checker accepts it."""
        proposal = self.found(h)
        if proposal is None:
            return False
        at, sampled = proposal
        found = with_cover(sampled, at.dynamics.observer.sample_time) if self.covered else sampled
        with suppress(verify.Refused):
            return found is not None and bool(proved([(frame(self.spec, {}, "certify", at, found.family), found)], at))
        return False


def _between(holds: Callable[[float], bool], low: float, high: float, steps: int) -> tuple[float, float]:
    """A smaller interval (low, high) with the condition true at low, by bisection of logarithms."""
    for _ in range(steps):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low, high

"""The largest sample time that can be certified at a spec's gains, for every way to step its observer."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.analysis.analysis import Analysis, analyse
from codegen.analysis.operating_points import evaluate_columns, matrix_function
from codegen.base.errors import BadInput
from codegen.certify.along_friction import Box, along_friction
from codegen.certify.certify import Certificate, Refusal
from codegen.certify.content import Found, frame, proved
from codegen.certify.enclosure import Cells, enclose_family
from codegen.certify.family import Family, NotEnclosable, build_family
from codegen.certify.levels import levels_of, over_levels
from codegen.certify.lyapunov import common_at, common_lyapunov, decay_rate_limit, shown_rates
from codegen.certify.region_proofs import Regions
from codegen.certify.regions import one_cell
from codegen.certify.size import beyond_checker
from codegen.checker import verify
from codegen.observers import build_observer
from codegen.observers.velocity import INTEGRATIONS
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical

ANY = 1e3
SHORTEST = 1e-9
STEPS, STEPS_VARYING = 14, 8
FACTOR = 4.0
MARGIN, NEAR = 0.995, 0.99
SLOWEST = 1e-3
"""Where A varies: the share of the slowest vertex' rate that is asked for."""

Array = NDArray[np.float64]


@numerical("the largest sample times")
def largest_sample_times(spec: Spec, own: Analysis, outcome: Certificate | Refusal | None = None) -> dict[str, float]:
    """Integration → the largest sample time in s that was certified, within 1 %; inf where 1000 s still is.

    Where A varies over the envelope it is that of a common P for all of it, within 2 %. An integration is left out that
    does not apply (velocity measured, K_v not diagonal) or whose A a certificate cannot state, and 0 says that none was
    found. What is handed out has passed the checker.

    Args:
        own: analysis of the spec as it stands.
        outcome: of ``certify``: of a refused DFO that slides in a certified region, it is for that region.
    """
    assert spec.observer is not None
    found: dict[str, float] = {}
    if beyond_checker(own.dynamics.observer):
        return found
    regions = outcome.regions if isinstance(outcome, Refusal) else None
    content = outcome.content if isinstance(outcome, Certificate) else None
    sliding = regions is not None and "sliding.json" in regions.proofs
    for integration in INTEGRATIONS:
        if spec.observer.velocity == "measured" and integration in ("semi_implicit", "exponential"):
            continue
        if integration == "exponential" and _full(spec.observer.gains.get("K_v")):
            continue
        chosen = replace(spec, observer=replace(spec.observer, integration=integration, domain=None))
        with suppress(BadInput, NotEnclosable, TypeError):
            analysis = analyse(chosen, build_observer(chosen, own.dynamics.observer.system), conditions=False)
            if analysis.points.missing:
                continue
            if sliding and regions is not None:
                largest = _largest_sliding(chosen, analysis, regions)
            else:
                largest = _largest(chosen, over_levels(analysis, levels_of(analysis, content or {"variables": {}})))
            if largest is not None:
                found[integration] = largest
    return found


def _full(gain: object) -> bool:
    return isinstance(gain, list) and any(isinstance(row, list) for row in gain)


def _at(analysis: Analysis, h: float) -> Analysis:
    """The same at another sample time; what was taken at operating points is the old one's."""
    dynamics = analysis.dynamics
    exact = sympy.Rational(Fraction(f"{h:.12g}"))
    return replace(analysis, dynamics=replace(dynamics, observer=replace(dynamics.observer, sample_time=exact)))


def _largest(spec: Spec, analysis: Analysis) -> float | None:
    family = build_family(analysis.dynamics, analysis.points.ranges)

    def cells(at: Analysis) -> tuple[Family, Cells]:
        family = build_family(at.dynamics, at.points.ranges)
        return family, enclose_family(family)

    if not any(e.free_symbols for e in family.parameters.values()):
        return _bisected(_stands(analysis), _Proofs(spec, analysis, cells).certified, STEPS, ANY)
    if analysis.largest_sample_time == 0:  # not stable in continuous time
        return 0.0
    return _largest_varying(spec, analysis, cells, _spectral_limit(analysis))


def _spectral_limit(analysis: Analysis) -> float:
    """A sample time beyond which the sampled error is unstable at a point of the envelope, nearly the least, s."""
    dynamics, points = analysis.dynamics, analysis.points
    function = matrix_function(dynamics, dynamics.in_force(dynamics.sampled), points, ())

    def stable(h: float) -> bool:
        values = np.linalg.eigvals(evaluate_columns(function, points.values, np.full((len(points.values), 1), h)))
        return bool(np.abs(dynamics.multipliers(values, h)).max() < 1)

    low = high = float(dynamics.observer.sample_time)
    while high < ANY and stable(high):
        low, high = high, high * FACTOR
    for _ in range(STEPS_VARYING if low < high < ANY else 0):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return high


def _largest_sliding(spec: Spec, analysis: Analysis, regions: Regions) -> float | None:
    content = regions.proofs["sliding.json"]
    along = along_friction(over_levels(analysis, levels_of(analysis, content)))
    if along is None:
        return None
    ends = {name: tuple(sympy.Rational(x) for x in pair) for name, pair in content["variables"].items()}
    box: Box = {v: (ends[v.name][0], ends[v.name][1]) for axis in along.axes for v in axis.symbols if v.name in ends}

    def cells(at: Analysis) -> tuple[Family, Cells]:
        family = along.at(at.dynamics.observer.sample_time).family(box)
        return family, Cells({}, one_cell(family))

    return _largest_varying(spec, analysis, cells)


def _largest_varying(
    spec: Spec, analysis: Analysis, cells_at: Callable[[Analysis], tuple[Family, Cells]], beyond: float = ANY
) -> float | None:
    proofs, start = _Proofs(spec, analysis, cells_at), float(analysis.dynamics.observer.sample_time)
    return _bisected(lambda h: proofs.found(h) is not None, proofs.certified, STEPS_VARYING, start, beyond)


@dataclass(frozen=True, eq=False)
class _Proofs:
    """One P for all cells of the envelope, at any sample time.

    Attributes:
        cells_at: the family and its cells at the sample time of an analysis.
    """

    spec: Spec
    analysis: Analysis
    cells_at: Callable[[Analysis], tuple[Family, Cells]]

    def found(self, h: float) -> tuple[Analysis, Family, Found] | None:
        """A P in floating point; None if none is found."""
        at = _at(self.analysis, h)
        try:
            family, cells = self.cells_at(at)
        except verify.Refused:
            return None
        step = 0.0 if self.analysis.dynamics.implicit else h
        limit = decay_rate_limit(cells.matrices, step)
        p = common_at([(cells.matrices, SLOWEST * limit)], step) if limit > 0 else None
        if p is None:
            return None
        rate = float(shown_rates(p, np.array(cells.matrices), step).min())
        return at, family, Found(0.999 * rate, cells.splits, p)

    def certified(self, h: float) -> bool:
        """Whether the checker accepts what is found."""
        proposal = self.found(h)
        if proposal is None:
            return False
        at, family, p = proposal
        with suppress(verify.Refused):
            content, _ = proved((frame(self.spec, {}, "certify", at, family), family, p), at)
            return bool(verify.check(json.dumps(content)).facts)
        return False


def _bisected(
    stands: Callable[[float], bool], certified: Callable[[float], bool], steps: int, start: float, beyond: float = ANY
) -> float | None:
    """The largest sample time, s: from ``start`` up, or down, by factors, then by bisection; None: any, not certified.

    Args:
        stands: whether floating point finds a Lyapunov matrix at a sample time.
        certified: whether the checker accepts what is found there.
        beyond: where nothing stands.
    """
    if beyond >= ANY and stands(ANY):
        return math.inf if certified(ANY) else None
    low = high = start
    if stands(NEAR * beyond):
        low, high, steps = NEAR * beyond, beyond, 0
    while not stands(low):
        low, high = low / FACTOR, low
        if low < SHORTEST:
            return 0.0
    while high == low or (high < beyond and stands(high)):
        low, high = high, min(high * FACTOR, beyond)
    for _ in range(steps):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if stands(middle) else (low, middle)
    for share in (MARGIN, MARGIN**2, 0.9):
        h = float(f"{low * share:.3g}")
        if certified(h):
            return h
    return 0.0


def _stands(analysis: Analysis) -> Callable[[float], bool]:
    """Whether floating point finds a Lyapunov matrix at a sample time, where A does not vary over the envelope."""
    dynamics, points = analysis.dynamics, analysis.points
    function = matrix_function(dynamics, dynamics.in_force(dynamics.sampled), points, ())

    def stands(h: float) -> bool:
        a = evaluate_columns(function, points.values[:1], np.full((1, 1), h))[0]
        return common_lyapunov([a], 0.0 if dynamics.implicit else h) is not None

    return stands

"""Parameter estimates of the final fit with 95 % confidence intervals by the sandwich covariance.

No covariance of one criterion shows the bias of a wrong form, which its estimate absorbs. A second criterion weighs the
same misfit otherwise; ``widened_by`` widens the intervals by the difference of both estimates.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp, hypot, log, pi, sqrt

import numpy as np
from scipy.stats import f as fisher
from scipy.stats import t as student

from codegen.base.arrays import Array
from codegen.diagnosis.fit.linear import inverse
from codegen.diagnosis.fit.output_error import Fit, segment_weights
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.results import FoundEffect, Interval
from codegen.effects.declare import unit_words
from codegen.effects.register import twins_of
from codegen.mechanics.system import System

CONFIDENCE = 0.95
BLOCKS = 16
"""Consecutive parts of the log, each with the same number of segments, whose gradients are summed."""

ELLIPSE = 720
"""Points of an ellipse over which a range is taken."""

Values = dict[str, tuple[float, Interval]]


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimates in SI with 95 % intervals: of each refitted symbol, by name, and of the parameters of each part."""

    refitted: Values
    effects: tuple[Values, ...]


def estimate(fit: Fit, other: Fit | None = None) -> Estimate:
    """Estimates and intervals of a fit, by the larger of the sandwich covariances over segments and over parts.

    Errors of the model differ between ``BLOCKS`` parts of the log but hardly between neighbouring segments.

    Args:
        other: the same fit on segments of another length; the difference between the two is added to the deviation.
    """
    change = np.zeros(len(fit.theta)) if other is None else other.theta - fit.theta
    segments, count = len(fit.residual), len(fit.theta)
    clusters = [(0, segments - count), *([(BLOCKS, BLOCKS - 1)] if segments > BLOCKS else [])]
    spread = np.outer(change, change)
    found = [_intervals(fit, covariance(fit, number) + spread, max(freedom, 3)) for number, freedom in clusters]
    refitted, *effects = (_hull(some) for some in zip(*found, strict=True))
    return Estimate(refitted, tuple(effects))


def widened_by(own: Estimate, other: Estimate, parts: Sequence[Part], shares: Mapping[int, float]) -> Estimate:
    """Estimates whose intervals reach those of another criterion.

        half width² = h² + c (Δ² + t² τ²),   τ² = max(0, Δ² − s² − s₂²),   s = h/t,   s₂ = h₂/t

    with Δ the difference of the estimates, h and h₂ their half widths, and t the quantile of Student's distribution of
    ``BLOCKS`` − 1 degrees of freedom. τ is what chance does not explain of Δ: the variance between two measurements of
    one quantity (DerSimonian and Laird 1986). Differences are of logarithms for a parameter that scales its effect, if
    both estimates have one sign, and of the fit's coordinates for a bounded one; so no end passes a bound or zero.
    Those of phases are within half a turn.

    Args:
        shares: index of a part → c, the share of the squared residual that is no noise; parts without it are unchanged.
    """
    effects = list(own.effects)
    for k, share in shares.items():
        effects[k] = {
            name: (value, _widened(parts[k], name, value, ends, other.effects[k][name], share))
            for name, (value, ends) in own.effects[k].items()
        }
    return replace(own, effects=tuple(effects))


def _widened(
    part: Part, name: str, value: float, ends: Interval, other: tuple[float, Interval], share: float
) -> Interval:
    """The interval of one parameter by ``widened_by``."""
    second, (low, high) = other
    inward, outward, slope = _comparison_coordinate(part, name, (value, second, *ends))
    here, half2 = inward(value), 0.5 * (high - low) * slope(second)
    below, above = sorted(inward(end) for end in ends)
    gap, half = inward(second) - here, 0.5 * (above - below)
    is_phase = name in {phase for _, phase in part.effect.waves}
    if is_phase:
        gap = (gap + pi) % (2 * pi) - pi  # +π and −π are one phase
    if not np.isfinite([gap, half, half2]).all():
        return ends
    t = float(student.ppf(0.5 + CONFIDENCE / 2, BLOCKS - 1))
    chance = (half**2 + half2**2) / t**2
    more = sqrt(share * (gap**2 + t**2 * max(0.0, gap**2 - chance)))
    below, above = here - hypot(here - below, more), here + hypot(above - here, more)
    if is_phase:
        below, above = max(below, here - pi), min(above, here + pi)
    first, last = sorted((outward(below), outward(above)))
    return first, last


Map = Callable[[float], float]


def _comparison_coordinate(part: Part, name: str, values: Sequence[float]) -> tuple[Map, Map, Map]:
    """The coordinate in which a parameter's estimates are compared: map, inverse, and |slope| of the map."""
    place = part.names.index(name)
    coordinate, neutral = part.coordinates[place], part.effect.parameters[place].neutral
    if neutral is not None:
        signs = {np.sign(v - neutral) for v in values}
        if len(signs) == 1 and (sign := float(signs.pop())):
            return (lambda v: log(abs(v - neutral)), lambda q: neutral + sign * exp(q), lambda v: 1 / abs(v - neutral))
    if not coordinate.curved:
        return lambda v: v, lambda q: q, lambda v: 1.0
    step = 1e-6

    def slope(v: float) -> float:
        inner = coordinate.inward(v)
        return 2 * step / max(abs(coordinate.outward(inner + step) - coordinate.outward(inner - step)), 1e-300)

    return coordinate.inward, coordinate.outward, slope


def _hull(some: Sequence[Values]) -> Values:
    """The values, each with the hull of its intervals."""
    ends = {name: [values[name][1] for values in some] for name in some[0]}
    return {
        name: (value, (min(low for low, _ in ends[name]), max(high for _, high in ends[name])))
        for name, (value, _) in some[0].items()
    }


def _intervals(fit: Fit, covariance: Array, freedom: int) -> list[Values]:
    """The refitted values, then those of each part, by Student's distribution of so many degrees of freedom."""
    trial = fit.trial
    half_widths = float(student.ppf(0.5 + CONFIDENCE / 2, freedom)) * np.sqrt(np.diag(covariance))
    low, high = fit.theta - half_widths, fit.theta + half_widths
    k = len(trial.refitted_symbols)
    ends_of = zip(trial.refitted_symbols, fit.theta[:k], low[:k], high[:k], strict=True)
    found: list[Values] = [{s.name: (float(v), (float(a), float(b))) for s, v, a, b in ends_of}]
    for part, values in zip(trial.parts, fit.values[1], strict=True):
        intervals = {}
        for j, (name, coordinate) in enumerate(zip(part.names, part.coordinates, strict=True), k):
            value, half = values[name], float(half_widths[j])
            ends = (coordinate.outward(float(low[j])), coordinate.outward(float(high[j])))
            intervals[name] = (value, ends if coordinate.curved else (value - half, value + half))
        for size, phase in part.effect.waves:
            place = [k + part.names.index(name) for name in (size, phase)]
            ends_of_both = wave_intervals(float(fit.theta[place[0]]), covariance[np.ix_(place, place)], freedom)
            for name, (first, last) in zip((size, phase), ends_of_both, strict=True):
                value, (least, most) = intervals[name]
                turned = value if name == phase else 0.0
                intervals[name] = (value, (min(least, turned + first), max(most, turned + last)))
        k += len(part.names)
        found.append(intervals)
    return found


def wave_intervals(size: float, covariance: Array, freedom: int) -> tuple[Interval, Interval]:
    """Profile-likelihood intervals of the size of a wave, and of its phase less the estimate.

    An effect is linear in the weights (size·cos(phase), size·sin(phase)). The intervals are the ranges of radius and
    angle over the ellipse of these weights for one parameter. If the joint region by the F distribution contains the
    origin, the size may be zero and the phase has any value.
    """
    along = np.diag([np.sign(size) or 1.0, abs(size)])
    variances, axes = np.linalg.eigh(along @ covariance @ along)
    deviations = np.sqrt(np.maximum(variances, 0.0))
    factor = float(student.ppf(0.5 + CONFIDENCE / 2, freedom))
    turn = np.linspace(0.0, 2 * np.pi, ELLIPSE, endpoint=False)
    x, y = axes @ (factor * deviations[:, None] * np.stack([np.cos(turn), np.sin(turn)]))
    radius, angle = np.hypot(abs(size) + x, y), np.arctan2(y, abs(size) + x)
    origin = axes.T @ np.array([-abs(size), 0.0]) / np.maximum(deviations, 1e-300)
    if float(origin @ origin) <= 2 * float(fisher.ppf(CONFIDENCE, 2, freedom)):
        return (0.0, float(radius.max())), (-np.pi, np.pi)
    return (float(radius.min()), float(radius.max())), (float(angle.min()), float(angle.max()))


def covariance(fit: Fit, clusters: int = 0) -> Array:
    """(p, p) cluster-robust sandwich covariance in a fit's coordinates, by default with each segment a cluster."""
    clusters = clusters or len(fit.residual)
    weights = segment_weights(fit.residual)
    weighted = fit.slopes * weights[:, None]
    bread = np.einsum("ask,bsk->ab", weighted, fit.slopes, optimize=True) + fit.prior.precision
    by_segment = np.einsum("ask,sk->sa", weighted, fit.residual)
    gradients = np.array([part.sum(axis=0) for part in np.array_split(by_segment, clusters)])
    segments, count = len(fit.residual), len(fit.theta)
    small_sample = segments / max(segments - count, 1) * (1.0 if clusters == segments else clusters / (clusters - 1))
    meat = gradients.T @ gradients * small_sample
    # The prior's gradient has the variance of the tolerances, whatever the tempering of the likelihood.
    meat += fit.prior.precision / fit.prior.tempering
    half = inverse(bread)
    return np.asarray(half @ meat @ half)


def effect_of(
    part: Part, values: Mapping[str, float], system: System, intervals: Mapping[str, Interval] | None = None
) -> FoundEffect:
    """An effect with its values; without intervals where its loss is rough, so that slopes do not give them."""
    units, also = unit_words(part.effect, part.place, system), tuple(twins_of(part.effect, system, part.place))
    return FoundEffect(part.kind, part.on, values, units, also, {} if part.effect.rough else intervals or {})


def named_effects(parts: Sequence[Part], estimated: Estimate, system: System) -> list[FoundEffect]:
    return [
        effect_of(part, {n: v for n, (v, _) in values.items()}, system, {n: one for n, (_, one) in values.items()})
        for part, values in zip(parts, estimated.effects, strict=True)
    ]

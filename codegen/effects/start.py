"""Starting values of shape parameters from the ranges that a log covers."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Covered:
    """The ranges that a log covers at the place of an effect; SI.

    Attributes:
        force: standard deviation of the drive force there, or of inertia times acceleration, the larger of the two.
        span: distance from the lowest to the highest position.
        top_speed: 95 % quantile of the speed of the coordinate, or of the contact's slip.
        top_input: 98 % quantile of the input's magnitude.
        peak_input: maximum of the input's magnitude, away from ends and gaps of the log.
        small_inputs: quantiles of the input's magnitude at several shares of the samples, from 0.5 to 50 %, rising.
        inertia: of the coordinate, at the middle of its positions.
        level: refitted friction level of the contact; 1 where there is none.
        noise: standard deviation of the position noise.
        sample_time, duration: of the log, s.
        cutoff_hz: cutoff frequency of the log's filters; accelerations are visible below it.
        periods: function that gives the main periods of the residual over position.
        carried: whether a declared force of position, such as gravity, acts there; behind a spring, at the load.
        coupling: k, c and load_fraction of the compliance fitted at this place; None where none was fitted.
        resonances: function that gives k, c and load_fraction of the compliances that the residual suggests.
    """

    force: float
    span: float
    top_speed: float
    top_input: float
    peak_input: float
    inertia: float
    level: float
    noise: float
    sample_time: float
    duration: float
    cutoff_hz: float
    small_inputs: tuple[float, ...] = ()
    periods: Callable[[], Sequence[float]] = tuple
    carried: bool = True
    coupling: Mapping[str, float] | None = None
    resonances: Callable[[], Sequence[Mapping[str, float]]] = tuple

    @property
    def half_span(self) -> float:
        """Half the distance from the lowest to the highest position."""
        return self.span / 2

    @property
    def slow(self) -> float:
        """Time constant 1/(2π cutoff_hz), s."""
        return 1 / (2 * np.pi * self.cutoff_hz)

    def size(self, unit: str) -> float:
        """The value of a parameter with this unit template at which its effect is as large as the force."""
        return size_by_unit(unit, self.force, self.half_span, self.top_speed, self.top_input)


def size_by_unit(unit: str, force: float, half_span: float, top_speed: float, top_input: float) -> float:
    """The product of these sizes that has the unit of a template, such as force/half_span for {F}/{q}."""
    words = {"F": force, "q": half_span, "w": top_input, "s": half_span / top_speed, "rad": 1.0}
    text = unit.replace("{", "").replace("}", "").replace("^", "**")
    value = 1.0
    for sign, name, power in re.findall(r"([*/]?)([A-Za-z]+|1)(?:\*\*(\d+))?", text):
        factor = words.get(name, 1.0) ** int(power or 1)
        value = value / factor if sign == "/" else value * factor
    return value


Start = Callable[[Covered], Sequence[float]]
"""Function that gives the starting values of a shape parameter."""


def speeds(covered: Covered) -> Sequence[float]:
    """From a hundredth of the top speed nearly up to it."""
    return tuple(np.geomspace(0.01, 0.8, 8) * covered.top_speed)


def periods(covered: Covered) -> Sequence[float]:
    """The most prominent ones of the residual over position."""
    return tuple(covered.periods())


def delays(covered: Covered) -> Sequence[float]:
    """From a third of a sample to four time constants of the cutoff."""
    return tuple(np.geomspace(0.3 * covered.sample_time, 4 * covered.slow, 7))


def lags(covered: Covered) -> Sequence[float]:
    """From a third of a sample to eight time constants of the cutoff."""
    return tuple(np.geomspace(0.3 * covered.sample_time, 8 * covered.slow, 7))


def slow_times(covered: Covered) -> Sequence[float]:
    """From a twentieth of the log to all of it: slower is a straight line, faster is another effect."""
    return tuple(q * covered.duration for q in (0.05, 0.15, 0.4, 1.0))


def dead_widths(covered: Covered) -> Sequence[float]:
    """From 0.3 % to a fifth of the top input."""
    return tuple(q * covered.top_input for q in (0.003, 0.01, 0.03, 0.08, 0.2))


def thresholds(covered: Covered) -> Sequence[float]:
    """From 0.3 % to a fifth of the top input, and the magnitudes that 0.5 to 50 % of the inputs are below."""
    return tuple(sorted({*dead_widths(covered), *(w for w in covered.small_inputs if w > 0)}))


def limits(covered: Covered) -> Sequence[float]:
    """From half the top input up to the greatest: a limit may be met once in a log."""
    top, above = covered.top_input, max(covered.peak_input - covered.top_input, 0.0)
    tried = (0.5 * top, 0.75 * top, 0.9 * top, *(top + q * above for q in (0.0, 0.25, 0.5, 0.75)))
    return tuple(dict.fromkeys(tried))


def gains(covered: Covered) -> Sequence[float]:
    """Between 0.7 and 1.4."""
    return (0.7, 0.9, 0.95, 1.05, 1.1, 1.4)


def bristles(covered: Covered) -> Sequence[float]:
    """Stiff enough to reach the friction level within 30 % down to a ten-thousandth of half the span."""
    return tuple(covered.level / (q * covered.half_span) for q in np.geomspace(0.3, 1e-4, 8))


def roundings(covered: Covered) -> Sequence[float]:
    """At 0.5 and 0.85."""
    return (0.5, 0.85)

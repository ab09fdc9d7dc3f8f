"""Transformations of a bounded parameter to an unbounded coordinate in which a fit changes it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import inf

import numpy as np

LARGEST_EXPONENT = 300.0
NEAREST = 2.0**-52
"""Distance to an upper bound, over that between the bounds, below which a value counts as at this distance."""


class Coordinate(ABC):
    """A monotone map between a parameter's values and the real numbers.

    Attributes:
        reach: largest change that a fit may make from its starting value, in this coordinate.
        of_unit_size: whether 1 is the scale of a large change; if not, the value itself is.
        curved: whether a confidence interval that is symmetric in this coordinate is asymmetric in the parameter.
    """

    reach: float = inf
    of_unit_size: bool = True
    curved: bool = True

    @abstractmethod
    def inward(self, value: float) -> float:
        """Parameter → coordinate."""

    @abstractmethod
    def outward(self, inner: float) -> float:
        """Coordinate → parameter."""


@dataclass(frozen=True)
class Free(Coordinate):
    """The identity."""

    of_unit_size: bool = False
    curved: bool = False

    def inward(self, value: float) -> float:
        return float(value)

    def outward(self, inner: float) -> float:
        return float(inner)


@dataclass(frozen=True)
class Above(Coordinate):
    """The logarithm of the distance to a lower bound; a fit may change it by a factor of 150."""

    low: float = 0.0
    reach: float = 5.0

    def inward(self, value: float) -> float:
        """log(value − low); for the bound itself, to which a fit may round, the smallest finite coordinate."""
        return float(np.log(max(value - self.low, np.exp(-LARGEST_EXPONENT))))

    def outward(self, inner: float) -> float:
        return float(self.low + np.exp(min(inner, LARGEST_EXPONENT)))


@dataclass(frozen=True)
class Between(Coordinate):
    """The logit of a value between two bounds."""

    low: float = 0.0
    high: float = 1.0
    reach: float = 5.0

    def inward(self, value: float) -> float:
        """The logit; finite also for a bound itself, to which a fit may round."""
        share = min(max((value - self.low) / (self.high - self.low), np.exp(-LARGEST_EXPONENT)), 1 - NEAREST)
        return float(np.log(share / (1 - share)))

    def outward(self, inner: float) -> float:
        return float(self.low + (self.high - self.low) / (1 + np.exp(min(-inner, LARGEST_EXPONENT))))


FREE = Free()
ANGLE = Free(of_unit_size=True)
PERIOD = Above(reach=0.2)
"""A period may change by a fifth: beyond, another number of waves fits in the stroke."""

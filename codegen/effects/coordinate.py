"""Transformations of a bounded parameter to an unbounded coordinate in which a fit changes it."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import inf

import numpy as np

LARGEST_EXPONENT = 300.0
"""Largest magnitude of an argument of exp."""
NEAREST = 2.0**-52
"""Least distance of a value to its upper bound, relative to the distance of the bounds."""


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
"""Coordinate of a parameter without bounds."""
ANGLE = Free(of_unit_size=True)
"""Coordinate of an angle, rad."""
PERIOD = Above(reach=0.2)
"""Coordinate of a period, which may change by a fifth; after a larger change the stroke has another number of waves."""

"""The coordinate in which a fit moves a parameter: one without bounds, in which the parameter keeps its own."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import inf

import numpy as np

LARGEST_EXPONENT = 300.0


class Coordinate(ABC):
    """A rising map between a parameter's values and all numbers.

    Attributes:
        reach: how far a fit may go from where it starts, in this coordinate.
        of_unit_size: whether a change by 1 is a large one; else a change by the value itself is.
        curved: whether an interval in it is not symmetric about the value.
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
    """The value itself."""

    of_unit_size: bool = False
    curved: bool = False

    def inward(self, value: float) -> float:
        return float(value)

    def outward(self, inner: float) -> float:
        return float(inner)


@dataclass(frozen=True)
class Above(Coordinate):
    """The logarithm of what the value is above a bound; a fit may go a factor of 150 either way."""

    low: float = 0.0
    reach: float = 5.0

    def inward(self, value: float) -> float:
        return float(np.log(value - self.low))

    def outward(self, inner: float) -> float:
        return float(self.low + np.exp(min(inner, LARGEST_EXPONENT)))


@dataclass(frozen=True)
class Between(Coordinate):
    """The logit of a value between two bounds."""

    low: float = 0.0
    high: float = 1.0
    reach: float = 5.0

    def inward(self, value: float) -> float:
        return float(np.log((value - self.low) / (self.high - value)))

    def outward(self, inner: float) -> float:
        return float(self.low + (self.high - self.low) / (1 + np.exp(min(-inner, LARGEST_EXPONENT))))


FREE = Free()
ANGLE = Free(of_unit_size=True)
PERIOD = Above(reach=0.2)
"""A period is changed by a fifth at most: further away a wave fits by another of its turns."""

"""Range of a signal compared with the spec's envelope."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codegen.base.arrays import Array
from codegen.logs.log import Finding


@dataclass
class Span:
    """The range of a signal's values so far, and its range in the envelope.

    Attributes:
        low, high: the envelope's range, in ``unit``.
        least, most: of the finite values.
    """

    name: str
    unit: str
    low: float
    high: float
    least: float = float("inf")
    most: float = float("-inf")
    count: int = 0
    outside: int = 0

    def add(self, values: Array) -> None:
        """Count further values, (N,)."""
        finite = values[np.isfinite(values)]
        if len(finite):
            self.least, self.most = min(self.least, float(finite.min())), max(self.most, float(finite.max()))
            self.count += len(finite)
            self.outside += int(np.count_nonzero((finite < self.low) | (finite > self.high)))

    @property
    def finding(self) -> Finding | None:
        """A warning if a value is outside the envelope, else None."""
        if not self.outside:
            return None
        share = self.outside / self.count
        words = (
            f"{self.name} runs from {self.least:.4g} to {self.most:.4g} {self.unit}, outside the spec's envelope "
            f"[{self.low:g}, {self.high:g}] for {share:.1%} of the time: the certificate does not cover that part."
        )
        figures = {"min": self.least, "max": self.most, "low": self.low, "high": self.high, "share": share}
        return Finding("warning", f"envelope of {self.name}", words, figures)

"""Rates of a number of trials, with their confidence intervals."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from scipy.stats import binomtest

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Rate:
    """A number of hits in a number of trials."""

    hits: int
    trials: int

    @property
    def share(self) -> float | None:
        """Hits over trials; None without trials."""
        return self.hits / self.trials if self.trials else None

    @property
    def interval(self) -> tuple[float, float] | None:
        """Wilson's interval of the true rate; None without trials."""
        if not self.trials:
            return None
        found = binomtest(self.hits, self.trials).proportion_ci(CONFIDENCE, method="wilson")
        return float(found.low), float(found.high)

    def __str__(self) -> str:
        if self.interval is None:
            return "–"
        low, high = self.interval
        return (
            f"{self.hits} of {self.trials}: {100 * self.hits / self.trials:.0f} % ({100 * low:.0f} … {100 * high:.0f})"
        )


@dataclass(frozen=True)
class Bar:
    """The range in which a rate should be, ends included."""

    least: float = 0.0
    most: float = 1.0

    def met_by(self, found: Rate) -> bool | None:
        """Whether a rate is between both ends; None without trials."""
        return None if found.share is None else self.least <= found.share <= self.most

    def __str__(self) -> str:
        if self.least and self.most < 1:
            return f"{100 * self.least:.0f} to {100 * self.most:.0f} %"
        if self.least:
            return f"≥ {100 * self.least:.0f} %"
        return f"≤ {100 * self.most:.0f} %" if self.most else "0"


def rate(marks: Iterable[bool]) -> Rate:
    """The rate of true marks."""
    counted = list(marks)
    return Rate(sum(counted), len(counted))

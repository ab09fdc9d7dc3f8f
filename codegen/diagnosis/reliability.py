"""Measured reliability of a verdict: the share of right verdicts of its class on logs with known truth.

A class is a verdict together with whether the final model reaches the noise (``acceptance.NEAR_NOISE``). The counts lie
in reliability.json beside this file, which `python -m benchmarks.reliability` writes.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter
from scipy.special import betaincinv

from codegen.base.text import render

FILE = Path(__file__).with_name("reliability.json")
CONFIDENCE = 0.95
FEWEST = 10
"""Least number of judged logs of a class."""
_COUNTS: TypeAdapter[dict[str, tuple[int, int]]] = TypeAdapter(dict[str, tuple[int, int]])


@dataclass(frozen=True)
class Reliability:
    """Number of right verdicts among all of one class, on logs with known truth."""

    right: int
    of: int
    name: str = ""

    @property
    def probability(self) -> float:
        """Posterior mean of the rate under Jeffreys' prior, (right + 1/2)/(of + 1)."""
        return (self.right + 0.5) / (self.of + 1)

    @property
    def interval(self) -> tuple[float, float]:
        """Equal-tailed 95 % interval of that posterior, a beta distribution."""
        a, b, tail = self.right + 0.5, self.of - self.right + 0.5, (1 - CONFIDENCE) / 2
        return float(betaincinv(a, b, tail)), float(betaincinv(a, b, 1 - tail))

    @property
    def words(self) -> str:
        """The counts in a sentence."""
        (low, high), probability = self.interval, self.probability
        given = {"right": self.right, "of": self.of, "probability": probability, "low": low, "high": high}
        return render("text/facts.j2", say="reliability", name=self.name, **given).strip()

    def as_json(self) -> dict[str, Any]:
        """The object of diagnosis.json."""
        return {
            "class": self.name,
            "right": self.right,
            "of": self.of,
            "probability": round(self.probability, 4),
            "interval": [round(v, 4) for v in self.interval],
        }


def class_of(verdict: str, near: bool) -> str | None:
    """The class of a verdict, at or above the noise; None for verdicts that claim nothing."""
    return None if verdict in ("unknown", "unfit") else f"{verdict}, {'at' if near else 'above'} the noise"


def reliability_of(verdict: str, near: bool) -> Reliability | None:
    """The reliability of a verdict's class; None if it claims nothing or fewer than ``FEWEST`` logs were judged."""
    name = class_of(verdict, near)
    right, of = (0, 0) if name is None else measured().get(name, (0, 0))
    return Reliability(right, of, name or "") if of >= FEWEST else None


@cache
def measured() -> Mapping[str, tuple[int, int]]:
    """Class → (right, judged), of the shipped file."""
    return _COUNTS.validate_json(FILE.read_bytes())

"""A finding of the preflight: one property of a log that matters for a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Severity = Literal["info", "warning", "problem"]


@dataclass(frozen=True)
class Finding:
    """A finding of the preflight.

    Attributes:
        severity: ``info`` has no influence on a diagnosis, ``warning`` may spoil it, ``problem`` does.
        topic: a word or two.
        words: a sentence for an engineer.
        figures: the numbers behind it, SI; shares are 0 to 1.
    """

    severity: Severity
    topic: str
    words: str
    figures: Mapping[str, float] = field(default_factory=dict)


def decide(warn: bool) -> Severity:
    """``warning`` if ``warn``, else ``info``."""
    return "warning" if warn else "info"

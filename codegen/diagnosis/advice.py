"""Advice beyond the verdict: experiments that discriminate tied candidates, and terms for an unknown residual."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any

from codegen.effects.declare import written_place

WORTH = 2.0
"""A change of the machine is proposed where it separates this many times better than repeating the same motion."""


@dataclass(frozen=True)
class TiedPair:
    """Two candidates that the log does not tell apart.

    Attributes:
        first, other: (kind, on).
        angle: degrees between the parts of the refit's residual that the two explain on this log; 0 means the same
            motion.
        distance: how much better the first fits this log, in standard deviations of the noise; negative where the
            other does: the force residual or later rounds may prefer the first all the same.
        separated_by: experiment that the catalogue names for telling the two apart; may be empty.
    """

    first: tuple[str, str]
    other: tuple[str, str]
    angle: float
    distance: float
    separated_by: str

    @property
    def better(self) -> tuple[str, str]:
        """The one that fits this log better."""
        return self.first if self.distance >= 0 else self.other


@dataclass(frozen=True)
class MotionTried:
    """A simulated extra motion.

    Attributes:
        duration: s. energy: ∫|w|² dt.
        separation: smallest over the pairs, in standard deviations of the noise.
    """

    name: str
    duration: float
    energy: float
    separation: float


@dataclass(frozen=True)
class SetupTried:
    """A simulated change of the machine, under which the log's path is followed again.

    Attributes:
        kind: none, load, payload, mounting, speed or temperature. words: what is changed.
        separation: smallest over the pairs with the best candidate, in standard deviations of its residual, each
            candidate fitted to both logs together.
        largest_input: that the path then needs.
    """

    kind: str
    words: str
    separation: float
    largest_input: float


@dataclass(frozen=True)
class Separation:
    """Discriminating experiments for candidates that tie.

    Attributes:
        pairs: the best candidate with each rival.
        tried: motions, in order. chosen: the cheapest that separates; None where none does.
        references: of the chosen motion, coordinate → expression of t. needed: the separation asked for.
        changes: of the machine, on the log's own path, largest separation first; empty where a candidate has states of
            its own.
    """

    pairs: tuple[TiedPair, ...]
    tried: tuple[MotionTried, ...]
    chosen: MotionTried | None
    references: Mapping[str, str]
    needed: float
    changes: tuple[SetupTried, ...] = ()

    @property
    def change(self) -> SetupTried | None:
        """The change that separates most, where that is enough and clearly more than repeating the same motion."""
        again = next((c.separation for c in self.changes if c.kind == "none"), 0.0)
        best = self.changes[0] if self.changes else None
        enough = best is not None and best.kind != "none" and best.separation >= max(self.needed, WORTH * again)
        return best if enough else None

    def as_json(self) -> dict[str, Any]:
        """Plain objects."""

        def change(c: SetupTried) -> dict[str, Any]:
            return {"kind": c.kind, "what": c.words, "separation": c.separation, "largest_input": c.largest_input}

        def motion(m: MotionTried) -> dict[str, Any]:
            return {"name": m.name, "duration_s": m.duration, "energy": m.energy, "separation": m.separation}

        return {
            "pairs": [
                {
                    "first": {"kind": a.first[0], "on": written_place(a.first[1])},
                    "other": {"kind": a.other[0], "on": written_place(a.other[1])},
                    "angle_deg": a.angle,
                    "distance_on_this_log": a.distance,
                    "catalogue": a.separated_by,
                }
                for a in self.pairs
            ],
            "separation_needed": self.needed,
            "motion": None if self.chosen is None else motion(self.chosen) | {"reference": dict(self.references)},
            "tried": [motion(m) for m in self.tried],
            "change": None if self.change is None else change(self.change),
            "changes": [change(c) for c in self.changes],
        }


@dataclass(frozen=True)
class ProposedTerms:
    """A sparse sum of terms fitted to the residual of one coordinate; a proposal, never part of a spec.

    Attributes:
        terms: expression over positions and velocities → its weight, all in SI.
        share: of the squared held-out residual that the sum removes; NaN where there is too little of it.
    """

    coordinate: str
    unit: str
    terms: Mapping[str, float]
    share: float


@dataclass(frozen=True)
class Proposal:
    """Terms that sparse regression (PySINDy) proposes for the force residual g − M a − U λ of the refit."""

    coordinates: tuple[ProposedTerms, ...]

    def as_json(self) -> dict[str, Any]:
        """Plain objects."""
        return {
            "is": "a proposal by sparse regression, not a finding; it is in no spec and in no code",
            "coordinates": [
                {
                    "coordinate": c.coordinate,
                    "unit": c.unit,
                    "terms": dict(c.terms),
                    "held_out_share": c.share if isfinite(c.share) else None,
                }
                for c in self.coordinates
            ],
        }

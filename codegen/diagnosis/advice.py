"""What a diagnosis says beyond its verdict: how to tell tied candidates apart, and what an unknown residual is like."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any

from codegen.effects.declare import written_place

WORTH = 2.0
"""A change of the machine is proposed where it separates so many times what the same motion does again."""


@dataclass(frozen=True)
class Likeness:
    """Two candidates that tie.

    Attributes:
        first, other: (kind, on).
        angle: degrees between what the two take out of the refit's residual on this log; 0 is the same motion.
        distance: how much better the first fits this log, in standard deviations of the noise.
        separated_by: what the catalogue says tells the two apart; empty where it does not say.
    """

    first: tuple[str, str]
    other: tuple[str, str]
    angle: float
    distance: float
    separated_by: str


@dataclass(frozen=True)
class MotionTried:
    """An extra motion in simulation.

    Attributes:
        duration: s. energy: ∫|w|² dt. separation: the least over the pairs, in standard deviations of the noise.
    """

    name: str
    duration: float
    energy: float
    separation: float


@dataclass(frozen=True)
class SetupTried:
    """A change of the machine under which the log's path is followed again, in simulation.

    Attributes:
        kind: none, load, payload, mounting, speed or temperature. words: what is changed.
        separation: least distance over the pairs with the best candidate, in standard deviations of what it leaves,
            where every candidate is fitted to this log and that one together.
        largest_input: that the path takes then.
    """

    kind: str
    words: str
    separation: float
    largest_input: float


@dataclass(frozen=True)
class Separation:
    """How candidates that tie could be discriminated.

    Attributes:
        alike: the first of them with each other one.
        tried: motions, in order. chosen: the cheapest that separates; None where none does.
        references: of the chosen motion, coordinate → expression of t. needed: the separation asked for.
        changes: of the machine, on the log's own path, the one that separates most first; none where a candidate has
            states of its own.
    """

    alike: tuple[Likeness, ...]
    tried: tuple[MotionTried, ...]
    chosen: MotionTried | None
    references: Mapping[str, str]
    needed: float
    changes: tuple[SetupTried, ...] = ()

    @property
    def change(self) -> SetupTried | None:
        """The change that separates most, where it separates enough and more than the same motion does again."""
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
                for a in self.alike
            ],
            "separation_needed": self.needed,
            "motion": None if self.chosen is None else motion(self.chosen) | {"reference": dict(self.references)},
            "tried": [motion(m) for m in self.tried],
            "change": None if self.change is None else change(self.change),
            "changes": [change(c) for c in self.changes],
        }


@dataclass(frozen=True)
class ProposedTerms:
    """A sparse sum for the residual of one coordinate; a proposal, never part of a spec.

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
    """What PySINDy proposes for the force residual g − M a − U λ of the refit."""

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

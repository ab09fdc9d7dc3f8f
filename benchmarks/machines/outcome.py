"""The outcome of a diagnosis of a case, compared with the truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from benchmarks.rates import Bar, Rate, rate
from benchmarks.spikes.outcome import named
from codegen.effects import CATALOGUE

RIGHT, WITH, PART = "right", "ambiguous with the truth", "one of two"
MISSED, UNKNOWN, WRONG = "missed (none)", "unknown", "wrong name"
EXTRA, WITHOUT = "right, and a wrong name", "ambiguous without the truth"
ALARM, FOREIGN, OTHER = "false alarm", "foreign under a known name", "unfit or refused"
OUTCOMES = (RIGHT, WITH, PART, EXTRA, MISSED, UNKNOWN, WITHOUT, WRONG, ALARM, FOREIGN, OTHER)
WORDS = {"none": MISSED, "unknown": UNKNOWN}
NEIGHBOURS = {"bearing_spots": {"position_dependent_friction"}}
"""Kinds that do say what a foreign disturbance is: places where the bearing sticks are friction over position."""
BARS = {
    "one effect, identifiable: named": Bar(0.9),
    "one effect, identifiable: wrong name": Bar(most=0.05),
    "no effect: false alarm": Bar(most=0.0),
    "foreign disturbance: under a known name": Bar(most=0.05),
}


@dataclass(frozen=True)
class Row:
    """A case: what is true, what was said, and what that is worth.

    Attributes:
        truth, said: kinds. shown: share and t of the truth by inverse dynamics.
    """

    case: str
    family: str
    group: str
    truth: tuple[str, ...]
    identifiable: bool
    share: float
    left: float
    t: float
    verdict: str
    said: tuple[str, ...]
    outcome: str
    cpu_s: float
    code: str


def outcome_of(truth: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> str:
    """The outcome of a diagnosis, one of ``OUTCOMES``."""
    verdict, said = diagnosis["verdict"], named(diagnosis)
    if verdict not in ("effect", "ambiguous", "none", "unknown"):
        return OTHER
    if truth["group"] == "none":
        return ALARM if verdict in ("effect", "ambiguous") else RIGHT if verdict == "none" else UNKNOWN
    if truth["group"] == "foreign":
        claimed = set(said) - NEIGHBOURS.get(truth["foreign"], set())
        return FOREIGN if claimed and verdict == "effect" else RIGHT
    if verdict in WORDS:
        return WORDS[verdict]
    pairs = zip(truth["effects"], truth["equivalents"], strict=True)
    known = [{effect["kind"], *twins} for effect, twins in pairs]
    hits = [any(_is(kind, names) for kind in said) for names in known]
    if verdict == "ambiguous":
        return WITH if any(hits) else WITHOUT
    wrong = [kind for kind in said if not any(_is(kind, names) for names in known)]
    if wrong:
        return EXTRA if all(hits) else WRONG
    return RIGHT if all(hits) else PART


def _is(kind: str, names: set[str]) -> bool:
    """Whether a name is right: the kind, a twin, or a richer form of it."""
    return kind in names or (kind in CATALOGUE and CATALOGUE[kind].refines in names)


def row_of(case: str, truth: Mapping[str, Any], diagnosis: Mapping[str, Any], cpu_s: float, code: str) -> Row:
    kinds = tuple(effect["kind"] for effect in truth["effects"]) or ((truth["foreign"],) if truth["foreign"] else ())
    shown = truth["shown"]
    return Row(
        case=case,
        family=truth["family"],
        group=truth["group"],
        truth=kinds,
        identifiable=truth["identifiable"],
        share=shown["share"],
        left=shown["left"],
        t=shown["t"],
        verdict=diagnosis["verdict"],
        said=named(diagnosis),
        outcome=outcome_of(truth, diagnosis),
        cpu_s=cpu_s,
        code=code,
    )


def rates(rows: Sequence[Row]) -> dict[str, Rate]:
    """The rates of the page: description → rate."""

    def share(group: str, outcomes: Sequence[str], clear: bool | None = None) -> Rate:
        some = [r for r in rows if r.group == group and (clear is None or r.identifiable == clear)]
        return rate(r.outcome in outcomes for r in some)

    return {
        "one effect, identifiable: named": share("single", (RIGHT,), True),
        "one effect, identifiable: named, or ambiguous with it": share("single", (RIGHT, WITH), True),
        "one effect, identifiable: wrong name": share("single", (WRONG, EXTRA, WITHOUT), True),
        "one effect, identifiable: none": share("single", (MISSED,), True),
        "one effect, identifiable: unknown": share("single", (UNKNOWN,), True),
        "one effect, not identifiable: wrong name": share("single", (WRONG, EXTRA, WITHOUT), False),
        "two effects: both named": share("double", (RIGHT,)),
        "two effects: one of them, nothing wrong": share("double", (PART,)),
        "two effects: wrong name": share("double", (WRONG, EXTRA, WITHOUT)),
        "no effect: false alarm": share("none", (ALARM,)),
        "no effect: none": share("none", (RIGHT,)),
        "foreign disturbance: under a known name": share("foreign", (FOREIGN,)),
    }

"""The outcome of a diagnosis of a spiked log, compared with the diagnosis of the log without the spike.

The machine may have the effect already, or one that hides it. So right is a verdict that names the spike in addition
to, or in place of, what the plain log got, with the parameter own + spike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import log
from typing import Any

from scipy.stats import norm

from benchmarks.rates import Rate, rate
from codegen.diagnosis.fit.acceptance import ALPHA, LEAST_SHARE, TIE_LEVEL
from codegen.effects import CATALOGUE

NEAR = 0.3
"""A parameter is right that is off by no more than this share of the spike, or whose interval has own + spike."""
SIGNIFICANT = 1.96
"""Standard errors from zero, 95 %."""
CANDIDATES = 23
"""Effects at their places among which a diagnosis of one of these axes chooses."""
CHOSEN = float(norm.isf(ALPHA / 2 / CANDIDATES))
"""Standard errors from zero at which any one of the candidates is significant at level α (Bonferroni)."""
PREFERRED = log(1 / TIE_LEVEL)
"""Nats of one law over another at which they do not tie: a likelihood ratio of 20."""
DETECTED, TAKEN, EXTRA = "detected", "taken by the refit", "detected, and a wrong name"
WITH, WITHOUT = "ambiguous with it", "ambiguous without it"
PLAIN, WRONG = "as the plain log", "wrong name"
OTHERS = ("unknown", "none", "unfit", "refused")
OUTCOMES = (DETECTED, TAKEN, EXTRA, WITH, WITHOUT, PLAIN, WRONG, *OTHERS)
SENSED, FALSE = (DETECTED, TAKEN, EXTRA), (EXTRA, WRONG)
MULTIPLIES = ("input_gain",)
"""Own and spike are factors."""


@dataclass(frozen=True)
class Spike:
    """A known effect in a log.

    Attributes:
        parameter, size: its strength, SI.
        accepted: kinds that name it rightly: its own and its exact twins.
        own: what least squares finds of it in the log as it is; None where that was not computed, or where the spec
            declares a parameter for the same force, which least squares finds with it.
        refitted: parameter of the spec whose refit takes the same force, with `-` before it for the other sign, of a
            factor for its inverse; or "".
        visible: share of the squared residual of least squares that the effect itself removes; None if not known.
        deviations: standard errors of the spike from zero by least squares; None if not known.
        found_deviations: those of the effect in the spiked log, own + spike; None if not known, or where ``own`` is.
        other, nats: the best other law by least squares, and the log-likelihood by which the spike's law is preferred
            to it; None if not known.
    """

    kind: str
    parameter: str
    size: float
    accepted: frozenset[str]
    own: float | None = None
    refitted: str = ""
    visible: float | None = None
    deviations: float | None = None
    found_deviations: float | None = None
    other: str = ""
    nats: float | None = None

    @property
    def is_told(self) -> bool:
        """Whether a coefficient of the spike's size is significant in least squares with the right structure."""
        return self.deviations is None or self.deviations >= SIGNIFICANT

    @property
    def is_told_among_all(self) -> bool:
        """Whether spike and whole effect would also be significant among all candidates (``CHOSEN``)."""
        known = [d for d in (self.deviations, self.found_deviations) if d is not None]
        return all(d >= CHOSEN for d in known)

    @property
    def is_preferred(self) -> bool:
        """Whether least squares also prefers the spike's law to every other one in its place; not if not known."""
        return self.is_told_among_all and self.nats is not None and self.nats >= PREFERRED

    @property
    def is_visible(self) -> bool:
        """Whether the effect, of the machine and of the spike together, removes as much as a diagnosis asks for."""
        return self.visible is None or self.visible >= LEAST_SHARE

    @property
    def expected(self) -> float:
        """The expected parameter: that of the machine and that of the spike together."""
        if self.kind in MULTIPLIES:
            return self.size * (1.0 if self.own is None else self.own)
        return self.size + (self.own or 0.0)

    @property
    def strength(self) -> float:
        """The change of the parameter by the spike."""
        return abs(self.size - (1.0 if self.kind in MULTIPLIES else 0.0))


@dataclass(frozen=True)
class Outcome:
    """The outcome of one spike.

    Attributes:
        outcome: of ``OUTCOMES``. said: the names of the verdict.
        found: the parameter that it was named with; None where it was not, or under a twin's name.
        near: whether that is own + spike.
    """

    outcome: str
    said: tuple[str, ...]
    found: float | None = None
    near: bool | None = None


def spike_of(truth: Mapping[str, Any], checked: Mapping[str, Any], refitted: str) -> Spike:
    """The spike of a truth.json; its strength is the first parameter of the kind in the catalogue.

    Args:
        checked: what ``spike.py --check`` prints. Least squares cannot fit a delay; it removes what the log as it is
            has less.
        refitted: as in ``Spike``; where it is given there is no ``own``.
    """
    own, visible = (None if refitted else checked.get("own")), None
    if "residual_after" in checked:
        left = checked.get("residual_with_effect", checked["residual_before"])
        visible = max(0.0, 1 - (left / checked["residual_after"]) ** 2)
    (effect,), (twins,) = truth["effects"], truth["equivalents"]
    name = CATALOGUE[effect["kind"]].parameters[0].name
    accepted = frozenset({effect["kind"], *(twin["kind"] for twin in twins)})
    size, deviations = float(effect["parameters"][name]), checked.get("deviations")
    whole = None if refitted else checked.get("found_deviations")
    best = str(checked.get("other", "")), checked.get("nats")
    return Spike(effect["kind"], name, size, accepted, own, refitted, visible, deviations, whole, *best)


def outcome_of(spike: Spike, plain: Mapping[str, Any], spiked: Mapping[str, Any]) -> Outcome:
    """The outcome of a spike, from the diagnoses of the log without and with it."""
    verdict, said = spiked["verdict"], named(spiked)
    if verdict == "ambiguous":
        return Outcome(WITH if any(_is_spike(spike, kind) for kind in said) else WITHOUT, said)
    before = named(plain)
    it = next((e for e in spiked["effects"] if verdict == "effect" and _is_spike(spike, e["kind"])), None)
    wrong = verdict == "effect" and any(not _is_spike(spike, kind) and kind not in before for kind in said)
    if it is not None and not _unchanged(spike, plain, it):
        value = it["parameters"].get(spike.parameter) if it["kind"] == spike.kind else None
        near = None if value is None else _near(spike, value, it.get("intervals", {}).get(spike.parameter))
        return Outcome(EXTRA if wrong else DETECTED, said, value, near)
    if wrong:
        return Outcome(WRONG, said)
    if _taken(spike, plain, spiked):
        return Outcome(TAKEN, said)
    return Outcome(PLAIN if verdict == "effect" else verdict, said)


def named(diagnosis: Mapping[str, Any]) -> tuple[str, ...]:
    """The kinds of a verdict `effect`, or those that tie on the verdict `ambiguous`."""
    if diagnosis["verdict"] == "effect":
        return tuple(effect["kind"] for effect in diagnosis["effects"])
    if diagnosis["verdict"] != "ambiguous":
        return ()
    pairs = (diagnosis.get("separation") or {}).get("pairs", [])
    tied = [pair[side]["kind"] for pair in pairs for side in ("first", "other")]
    tied = tied or [effect["kind"] for effect in diagnosis.get("tied", [])]
    return tuple(dict.fromkeys(tied)) or tuple(c["kind"] for c in diagnosis["candidates"][:2])


def totals(outcomes: Sequence[Outcome]) -> dict[str, Rate]:
    """Sensitivity and wrong names of some spikes, in words."""
    sensed = [o for o in outcomes if o.outcome in SENSED]
    return {
        "detected": Rate(len(sensed), len(outcomes)),
        "with the parameter own + spike": rate(bool(o.near) for o in sensed if o.near is not None),
        "ambiguous with it": rate(o.outcome == WITH for o in outcomes),
        "wrong names": rate(o.outcome in FALSE for o in outcomes),
    }


def _is_spike(spike: Spike, kind: str) -> bool:
    """Whether a name is right: the kind, a twin, or a richer form of it."""
    return kind in spike.accepted or (kind in CATALOGUE and CATALOGUE[kind].refines == spike.kind)


def _unchanged(spike: Spike, plain: Mapping[str, Any], it: Mapping[str, Any]) -> bool:
    """Whether the plain log got this name too, with a parameter that is nearer to this one than own + spike is."""
    if plain["verdict"] != "effect":
        return False
    own = next((e for e in plain["effects"] if e["kind"] == it["kind"]), None)
    if own is None or spike.parameter not in own["parameters"] or it["kind"] != spike.kind:
        return own is not None
    before, after = float(own["parameters"][spike.parameter]), float(it["parameters"][spike.parameter])
    both = before * spike.size if spike.kind in MULTIPLIES else before + spike.size
    return abs(after - before) <= abs(after - both)


def _near(spike: Spike, value: float, interval: Sequence[float | None] | None) -> bool:
    if abs(value - spike.expected) <= NEAR * spike.strength:
        return True
    low, high = interval or (None, None)
    return low is not None and high is not None and low <= spike.expected <= high


def _taken(spike: Spike, plain: Mapping[str, Any], spiked: Mapping[str, Any]) -> bool:
    """Whether a parameter with a tolerance moved by the spike: the refit has taken it, and there is nothing to name."""
    name, sign = spike.refitted.lstrip("-"), -1 if spike.refitted.startswith("-") else 1
    if not name:
        return False
    values = [d.get("values", {}).get(name, {}).get(_adopted(d)) for d in (plain, spiked)]
    if None in values:
        return False
    if spike.kind in MULTIPLIES:
        return abs((values[1] / values[0]) ** sign - spike.size) <= NEAR * spike.strength
    return abs(values[1] - values[0] - sign * spike.size) <= NEAR * spike.strength


def _adopted(diagnosis: Mapping[str, Any]) -> str:
    return "augmented" if diagnosis["verdict"] == "effect" else "refit"

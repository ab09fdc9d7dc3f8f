"""The tables of candidates of a diagnosis, from the outcome of forward selection."""

from collections.abc import Collection, Iterator, Sequence

from codegen.diagnosis.evidence.estimate import effect_of
from codegen.diagnosis.evidence.force_gain import nested_evidence_of
from codegen.diagnosis.fit.acceptance import noise_ratio
from codegen.diagnosis.fit.output_error import Fit, at_limit
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.results import Candidate, FoundEffect, Round, Verdict
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.ranking import Ranked, twins
from codegen.diagnosis.selection.significance import p_by_free_runs
from codegen.effects import CATALOGUE
from codegen.effects.declare import places_of
from codegen.effects.register import is_own
from codegen.mechanics.system import System

TABLE_SIZE = 12
"""Candidates in the table of a round."""


def rivals_of(outcome: Outcome, tied: Sequence[Fit], system: System) -> tuple[FoundEffect, ...]:
    """The rivals of the first effect, with the values of the fits ``tied`` in its place where there are such fits."""
    first = [(fit.trial.parts[0], fit.values[1][0]) for fit in tied[1:]]
    others = [(r.part, r.found.parameters) for r in outcome.rivals[len(first) :]]
    return tuple(effect_of(part, values, system) for part, values in (*first, *others))


def candidates(outcome: Outcome, system: System, verdict: Verdict) -> tuple[Candidate, ...]:
    """The table of candidates, best first; always with a user's own effects."""
    ranked = _listed(outcome, outcome.first)
    kept = [r for k, r in enumerate(ranked) if k < TABLE_SIZE or is_own(r.part.kind)]
    tried = {r.part.key for r in ranked}
    return (*(_row(r) for r in kept), *_not_tried(system, tried, verdict))


def rounds(outcome: Outcome) -> tuple[Round, ...]:
    """The later rounds of forward selection, each with the effects found before it."""
    return tuple(
        Round(
            tuple(p.key for p in later.found_before),
            tuple(_row(r) for r in _listed(outcome, later.ranked)[:TABLE_SIZE]),
        )
        for later in outcome.later
    )


def _not_tried(system: System, tried: Collection[tuple[str, str]], verdict: Verdict) -> Iterator[Candidate]:
    """A user's own effects that were not fitted, with the reason."""
    for kind, effect in CATALOGUE.items():
        if not is_own(kind):
            continue
        for k, on in enumerate(places_of(effect, system)):
            if (kind, on) in tried:
                continue
            if verdict == "unfit":
                why = "not tried: the log is unfit for this spec"
            elif not effect.applies(system, k):
                why = f"does not apply here{f': {effect.needs}' if effect.needs else ''}"
            elif effect.refines:
                why = f"tried only where {effect.refines} is found, which it refines"
            elif any(p.start is not None for p in effect.parameters):
                why = "not tried: its starting values gave no run that can be fitted"
            else:
                why = "not tried: no run of it could be fitted"
            none = float("nan")
            yield Candidate(kind, on, {}, none, none, 0, 0, None, False, why, (), own=True, p=none)


def _listed(outcome: Outcome, ranked: Sequence[Ranked]) -> list[Ranked]:
    """A round with the finally named effects first, then their rivals, then the others in the round's order."""
    order = {p.key: k for k, p in enumerate([*outcome.parts, *(r.part for r in outcome.rivals)])}
    order |= {(CATALOGUE[p.kind].refines, p.on): k for k, p in enumerate(outcome.parts)}
    return sorted(ranked, key=lambda r: order.get(r.part.key, len(order)))


def _row(r: Ranked, k: int = -1) -> Candidate:
    """The row of the k-th effect of a fit, by default of the last one."""
    part, e = r.found.trial.parts[k], r.evidence
    return Candidate(
        kind=part.kind,
        on=part.on,
        parameters=r.found.values[1][k],
        gain=e.share,
        t=e.t,
        blocks_won=e.won,
        blocks=e.blocks,
        free_run=r.ratio,
        accepted=not r.why_not,
        why_not=r.why_not,
        also=tuple(twins(part, r.found)),
        size=r.size,
        own=is_own(part.kind),
        at_limit=at_limit(r.found)[k],
        p=r.p,
        form=part.form,
    )


def in_no_round(search: Search, outcome: Outcome) -> tuple[Candidate, ...]:
    """Effects of the verdict that were a candidate in no round: that replaced another, or are a refined form of one.

    Each with the evidence, on held-out segments of the last fit, of all effects over those without it.
    """
    every = (outcome.first, *(later.ranked for later in outcome.later))
    shown = {r.part.key for ranked in every for r in ranked}
    final, rows = outcome.final, []
    for k, part in enumerate(outcome.parts):
        if part.key in shown:
            continue
        soft, without = search.with_noise_floor(search.without(final, k))
        whole = soft.fitted_again(final)
        e = nested_evidence_of(without, whole)
        ratio, p = noise_ratio(whole) / noise_ratio(without), p_by_free_runs(search, whole, e, 1)
        rows.append(_row(Ranked(final, e, ratio, float("nan"), "", p=p), k))
    return tuple(rows)

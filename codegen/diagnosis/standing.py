"""Effects of a verdict that stand in no round's table, with the evidence for each beside the others."""

from __future__ import annotations

from codegen.diagnosis.credit import evidence, held_out_losses, level, noise_loss
from codegen.diagnosis.limits import at_limit
from codegen.diagnosis.output_error import Shot
from codegen.diagnosis.ranking import chance
from codegen.diagnosis.results import Candidate
from codegen.diagnosis.rounds import Outcome
from codegen.diagnosis.search import Search
from codegen.effects.register import is_own


def beside_the_others(search: Search, outcome: Outcome) -> tuple[Candidate, ...]:
    """What came in when effects were exchanged, or as a richer form of one: in no round was it a candidate.

    Args:
        search: on whose segments the outcome's last fit is.
    """
    shown = {(r.found.part.kind, r.found.part.on) for r in outcome.first}
    shown |= {(r.found.part.kind, r.found.part.on) for later in outcome.later for r in later.ranked}
    lacking = [k for k, p in enumerate(outcome.parts) if (p.kind, p.on) not in shown]
    return tuple(_standing(search, outcome.final, k) for k in lacking)


def _standing(search: Search, final: Shot, k: int) -> Candidate:
    """The fit with all effects over the fit without the k-th, both on held-out segments."""
    soft, without = search.softened(search.without(final, k))
    whole = soft.rebased(final)
    before = held_out_losses(without)
    e = evidence(before, held_out_losses(whole), without.residual.shape[1], noise_loss(without) / len(before))
    trial = final.runner.trial
    part = trial.parts[k]
    return Candidate(
        kind=part.kind,
        on=part.on,
        parameters=trial.split(final.theta)[1][k],
        gain=e.share,
        t=e.t,
        blocks_won=e.won,
        blocks=e.blocks,
        free_run=level(whole) / level(without),
        accepted=True,
        why_not="",
        also=tuple(part.effect.twins(trial.system, part.place)),
        size=float("nan"),
        own=is_own(part.kind),
        at_limit=at_limit(final)[k],
        p=chance(search, whole, e, 1),
    )

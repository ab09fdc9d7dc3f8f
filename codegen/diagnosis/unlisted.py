"""Evidence for effects of the verdict that were a candidate in no round."""

from __future__ import annotations

from codegen.diagnosis.credit import evidence, held_out_losses, noise_loss, noise_ratio
from codegen.diagnosis.forward_selection import Outcome
from codegen.diagnosis.output_error import Fit, at_limit
from codegen.diagnosis.ranking import chance
from codegen.diagnosis.results import Candidate
from codegen.diagnosis.search import Search
from codegen.effects.register import is_own


def effects_in_no_round(search: Search, outcome: Outcome) -> tuple[Candidate, ...]:
    """Effects that came in by replacement, or as a refined form of another, as candidates.

    Args:
        search: on whose segments the outcome's last fit is.
    """
    shown = {(r.found.part.kind, r.found.part.on) for r in outcome.first}
    shown |= {(r.found.part.kind, r.found.part.on) for later in outcome.later for r in later.ranked}
    lacking = [k for k, p in enumerate(outcome.parts) if (p.kind, p.on) not in shown]
    return tuple(_candidate(search, outcome.final, k) for k in lacking)


def _candidate(search: Search, final: Fit, k: int) -> Candidate:
    """The fit with all effects over the fit without the k-th, both on held-out segments."""
    soft, without = search.with_noise_floor(search.without(final, k))
    whole = soft.fitted_again(final)
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
        free_run=noise_ratio(whole) / noise_ratio(without),
        accepted=True,
        why_not="",
        also=tuple(part.effect.twins(trial.system, part.place)),
        size=float("nan"),
        own=is_own(part.kind),
        at_limit=at_limit(final)[k],
        p=chance(search, whole, e, 1),
    )

"""One round: every candidate beside what was found, with its evidence and the test that it fails."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis import credit
from codegen.diagnosis.attempt import Found, attempt
from codegen.diagnosis.credit import Evidence, evidence, held_out_losses, independent_share, level, noise_loss, size_of
from codegen.diagnosis.models import with_effects
from codegen.diagnosis.output_error import Shot
from codegen.diagnosis.residual import inverse_dynamics_residual
from codegen.diagnosis.results import FoundEffect
from codegen.diagnosis.search import Search
from codegen.diagnosis.trial import STRUCTURE, Part
from codegen.effects import CATALOGUE

Array = NDArray[np.float64]

STRUCTURE_SIZE = 2e-3
SEEN_GAP = 2.0
"""Standard deviations of the position's noise: the play of a smaller one is a compliance's freedom to fit."""


@dataclass(frozen=True, eq=False)
class Ranked:
    """A candidate of one round.

    Attributes:
        losses: (S,) of held-out segments.
        ratio: median error of its free runs over that of the model without it.
        size: change of the prediction over what the drive force does.
        why_not: the test that it fails, in words; empty where it passes all.
        unsure: whether that test is the probability alone: beside another effect it may still pass.
    """

    found: Found
    evidence: Evidence
    losses: Array
    ratio: float
    size: float
    why_not: str
    unsure: bool = False


def run_round(search: Search, current: Shot, parts: Sequence[Part], tell: Callable[[float], None]) -> list[Ranked]:
    """Every candidate beside what was found already, ranked: those that pass every test first."""
    soft, base = search.softened(current)
    before = held_out_losses(base)
    kept = base.residual.shape[1]
    floor = noise_loss(base) / len(before)
    ranked = []
    for found in attempt(soft, base, parts, tell):
        losses = held_out_losses(found.shot)
        one = evidence(before, losses, kept, floor)
        ratio = level(found.shot) / level(base)
        size = weight_of(search, found, base)
        why_not = _why_not(search, found, one, size)
        unsure = not why_not and not _sure(search, found.shot, one, len(parts))
        if unsure:
            why_not = f"better on {one.won} of {one.blocks} blocks of held-out segments only (t = {one.t:.2g})"
        ranked.append(Ranked(found, one, losses, ratio, size, why_not, unsure))
    return sorted(ranked, key=lambda r: (bool(r.why_not) and not r.unsure, r.found.shot.cost))


def ties(ranked: Sequence[Ranked]) -> list[Ranked]:
    """Candidates that the data do not tell from the best one, twins left out."""
    best = ranked[0]
    same = {(best.found.part.kind, best.found.part.on), *twins(best.found.part, best.found)}
    kept, white = best.found.shot.residual.shape[1], independent_share(best.found.shot)
    tied = []
    for other in ranked[1:]:
        if (other.why_not and not other.unsure) or (other.found.part.kind, other.found.part.on) in same:
            continue
        if evidence(other.losses, best.losses, kept).p(white) > credit.TIE_LEVEL:
            tied.append(other)
    return tied


def twins(part: Part, found: Found) -> list[tuple[str, str]]:
    """(kind, on) of effects that give the same motion."""
    effect = CATALOGUE[part.kind]
    return effect.twins(found.trial.system, part.place)


def _sure(search: Search, shot: Shot, e: Evidence, candidates: int) -> bool:
    """Whether such a gain comes without an effect at most at the rate α, over all candidates."""
    soft = float(shot.runner.record.noise[0] / search.record.noise[0])
    white = independent_share(shot) if level(shot) * soft <= credit.NEAR_NOISE else 0.0
    return bool(candidates * e.p(white) <= credit.ALPHA)


def credible(search: Search, before: Shot, after: Shot, candidates: int) -> bool:
    """Whether a model with more effects is credited over one with fewer."""
    soft, base = search.softened(before)
    richer = soft.rebased(after)
    losses = held_out_losses(base)
    floor = noise_loss(base) / len(losses)
    one = evidence(losses, held_out_losses(richer), base.residual.shape[1], floor)
    return one.share >= credit.LEAST_SHARE and _sure(search, richer, one, candidates)


def weight_of(search: Search, found: Found, base: Shot) -> float:
    """Force of the effect over the drive force along the measured motion; else change of the prediction."""
    if found.part.kind in STRUCTURE:
        return size_of(found.shot, base)
    effect, system = CATALOGUE[found.part.kind], search.system
    if not effect.with_parameters(found.part.names).admissible(system, found.part.place, found.parameters):
        return size_of(found.shot, base)
    declared = FoundEffect(found.part.kind, found.part.on, found.parameters, {})
    richer = inverse_dynamics_residual(with_effects(system, [declared]), search.motion)
    return search.drive.share(richer - search.drive.residual)


def _why_not(search: Search, found: Found, e: Evidence, size: float) -> str:
    if e.gain <= 0:
        return "makes the error on held-out segments no smaller"
    if e.share < credit.LEAST_SHARE:
        return f"removes {100 * e.share:.2g} % of the squared residual on held-out segments"
    if size < (STRUCTURE_SIZE if found.part.kind in STRUCTURE else credit.LEAST_SIZE):
        return f"its force is {100 * size:.2g} % of the drive force: too little to matter"
    if not admissible(search, found):
        return "fits only with values that are not physical"
    if found.parameters.get("gap", np.inf) < SEEN_GAP * search.record.noise[found.part.place]:
        return "its gap is below what the noise of the position lets one see"
    return ""


def admissible(search: Search, found: Found) -> bool:
    """Whether the fitted values lie within the effect's bounds."""
    effect, values = CATALOGUE[found.part.kind], found.parameters
    if not all(np.isfinite(v) for v in values.values()):
        return False
    return effect.with_parameters(found.part.names).admissible(search.system, found.part.place, values)

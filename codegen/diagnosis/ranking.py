"""One round: every candidate beside what was found, with its evidence and the test that it fails."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis import credit
from codegen.diagnosis.attempt import Found, attempt
from codegen.diagnosis.credit import Evidence, evidence, held_out_losses, independent_share, level, noise_loss, size_of
from codegen.diagnosis.force_witness import ForceGain, fair_residual, force_gain
from codegen.diagnosis.models import model_of, with_effects
from codegen.diagnosis.output_error import Shot
from codegen.diagnosis.reservations import never_passed
from codegen.diagnosis.residual import drive_left, inverse_dynamics_residual
from codegen.diagnosis.results import FoundEffect
from codegen.diagnosis.search import Search
from codegen.diagnosis.trial import Part
from codegen.effects import CATALOGUE
from codegen.effects.family import is_anew
from codegen.mechanics.system import System

Array = NDArray[np.float64]

FORCE_SHARE = 0.1
"""Of α, for the force residual's own test."""


@dataclass(frozen=True, eq=False)
class Ranked:
    """A candidate of one round.

    Attributes:
        losses: (S,) of held-out segments.
        ratio: median error of its free runs over that of the model without it.
        size: change of the prediction over what the drive force does.
        why_not: the test that it fails, in words; empty where it passes all.
        unsure: whether that test is the probability alone: beside another effect it may still pass.
        p: probability of such gains without an effect, for one candidate of the round or another; α is its bound.
        witness: its force residual.
    """

    found: Found
    evidence: Evidence
    losses: Array
    ratio: float
    size: float
    why_not: str
    unsure: bool = False
    p: float = 1.0
    witness: Witness | None = None


@dataclass(frozen=True, eq=False)
class Witness:
    """The force residual of a fit, computed where it is asked for."""

    search: Search
    shot: Shot

    @cached_property
    def system(self) -> System:
        return model_of(self.shot.runner.trial, self.shot.theta)

    @cached_property
    def residual(self) -> Array:
        """(N, n) with the friction levels of the fit."""
        return inverse_dynamics_residual(self.system, self.search.motion)

    @cached_property
    def fair(self) -> Array:
        """(N, n) with the friction levels that suit it best."""
        return fair_residual(self.search.problem, self.system)

    def over(self, other: Witness) -> ForceGain:
        """What the force residual says for this fit over another."""
        return force_gain(self.search.problem, other.fair, self.fair)


def run_round(search: Search, current: Shot, parts: Sequence[Part], tell: Callable[[float], None]) -> list[Ranked]:
    """Every candidate beside what was found already, ranked: those that pass every test first."""
    soft, base = search.softened(current)
    before = held_out_losses(base)
    kept = base.residual.shape[1]
    floor = noise_loss(base) / len(before)
    ranked, without = [], Witness(search, base)
    for found in attempt(soft, base, parts, tell):
        losses = held_out_losses(found.shot)
        one = evidence(before, losses, kept, floor)
        ratio = level(found.shot) / level(base)
        size = weight_of(search, found, base)
        witness = Witness(search, found.shot)
        why_not = _why_not(search, found, one, size) or too_alike(without, witness, found)
        why_not = why_not or by_the_drive_itself(without, witness)
        p = chance(search, found.shot, one, len(parts))
        p = p if why_not else with_force(p, without, witness, len(parts))
        unsure = not why_not and p > credit.ALPHA
        if unsure:
            why_not = f"better on {one.won} of {one.blocks} blocks of held-out segments only (t = {one.t:.2g})"
        ranked.append(Ranked(found, one, losses, ratio, size, why_not, unsure, p, witness))
    return sorted(ranked, key=lambda r: (bool(r.why_not) and not r.unsure, r.found.shot.cost))


def ties(search: Search, ranked: Sequence[Ranked]) -> list[Ranked]:
    """Candidates that neither free runs nor the force residual tell from the best one, twins left out."""
    return [other for other in _tied(search, ranked[0], ranked) if not _preferred(ranked[0], other)]


def _tied(search: Search, best: Ranked, ranked: Sequence[Ranked]) -> list[Ranked]:
    """Those that free runs do not tell from one of them, twins left out."""
    same = {(best.found.part.kind, best.found.part.on), *twins(best.found.part, best.found)}
    kept, white = best.found.shot.residual.shape[1], whiteness(search, best.found.shot)
    tied = []
    for other in ranked:
        if other is best or (other.why_not and not other.unsure) or _is_one_of(other.found, same):
            continue
        if 1 - other.evidence.share > credit.TIE_RATIO * (1 - best.evidence.share):
            continue
        if evidence(other.losses, best.losses, kept).p(white) > credit.TIE_LEVEL:
            tied.append(other)
    return tied


def led_by_force(search: Search, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The candidates with that one first which the force residual prefers among the best and those that tie with it.

    Free runs weigh slow errors, the force residual fast ones: what one leaves open the other may tell. Far from the
    noise a second effect may be lacking, which the force residual may take for another: there the order stays.
    """
    best = ranked[0]
    if level(best.found.shot) > credit.NEAR_NOISE:
        return list(ranked)
    for other in _tied(search, best, ranked):
        if _preferred(other, best):
            best = other
    return [best, *(r for r in ranked if r is not best)]


def _preferred(one: Ranked, other: Ranked) -> bool:
    if one.witness is None or other.witness is None:
        return False
    gain = one.witness.over(other.witness)
    return gain.left < 1 and gain.p <= credit.TIE_LEVEL


def twins(part: Part, found: Found) -> list[tuple[str, str]]:
    """(kind, on) of effects that give the same motion."""
    effect = CATALOGUE[part.kind]
    return effect.twins(found.trial.system, part.place)


def _is_one_of(found: Found, known: Collection[tuple[str, str]]) -> bool:
    """Whether a candidate is an effect of these (kind, on), or one of them under a name of a user's own."""
    part, system = found.part, found.trial.system
    kinds = [kind for kind, on in known if on == part.on]
    return any(part.kind == k or is_anew(part.effect, CATALOGUE[k], system, part.place) for k in kinds)


def chance(search: Search, shot: Shot, e: Evidence, candidates: int) -> float:
    """Probability of such a gain without an effect, for any of so many candidates (Bonferroni)."""
    return min(1.0, candidates * e.p(whiteness(search, shot)))


def with_force(p: float, before: Witness, after: Witness, candidates: int) -> float:
    """Probability by either witness, the force residual asked where free runs leave doubt.

    Free runs of a model that is far from the data diverge in some segments and agree in others, whatever is added to
    it. Of the probability that may be wrong, the force residual has a tenth (weighted Bonferroni).
    """
    free = min(1.0, p / (1 - FORCE_SHARE))
    if free <= credit.ALPHA:
        return free
    gain = after.over(before)
    if gain.left > 1 - credit.LEAST_SHARE:
        return free
    return min(free, candidates * gain.p / FORCE_SHARE)


def whiteness(search: Search, shot: Shot) -> float:
    """Share of the residuals that count as independent; 0 far from the noise, where no likelihood holds."""
    soft = float(shot.runner.record.noise[0] / search.record.noise[0])
    return independent_share(shot) if level(shot) * soft <= credit.NEAR_NOISE else 0.0


def credible(search: Search, before: Shot, after: Shot, candidates: int) -> bool:
    """Whether a model with more effects is credited over one with fewer."""
    soft, base = search.softened(before)
    richer = soft.rebased(after)
    losses = held_out_losses(base)
    floor = noise_loss(base) / len(losses)
    one = evidence(losses, held_out_losses(richer), base.residual.shape[1], floor)
    if one.share < credit.LEAST_SHARE:
        return False
    p = chance(search, richer, one, candidates)
    return with_force(p, Witness(search, before), Witness(search, after), candidates) <= credit.ALPHA


def weight_of(search: Search, found: Found, base: Shot) -> float:
    """Force of the effect over the drive force along the measured motion; else change of the prediction."""
    if found.trial.adds_states:
        return size_of(found.shot, base)
    effect, system = CATALOGUE[found.part.kind], search.system
    if not effect.with_parameters(found.part.names).admissible(system, found.part.place, found.parameters):
        return size_of(found.shot, base)
    declared = FoundEffect(found.part.kind, found.part.on, found.parameters, {})
    richer = inverse_dynamics_residual(with_effects(system, [declared]), search.motion)
    return search.drive.share(richer - search.drive.residual)


def too_alike(before: Witness, after: Witness, found: Found) -> str:
    """Words where the effect's force is what the refitted values take already, to within ``LEAST_NET``."""
    if found.trial.adds_states:
        return ""
    net = before.search.drive.share(after.residual - before.residual)
    if net >= credit.LEAST_NET:
        return ""
    return f"changes the force by {100 * net:.2g} % of the drive force beside refitted values: too little to matter"


def _why_not(search: Search, found: Found, e: Evidence, size: float) -> str:
    if e.gain <= 0:
        return "makes the error on held-out segments no smaller"
    if e.share < credit.LEAST_SHARE:
        return f"removes {100 * e.share:.2g} % of the squared residual on held-out segments"
    if size < (credit.LEAST_NET if found.trial.adds_states else credit.LEAST_SIZE):
        return f"its force is {100 * size:.2g} % of the drive force: too little to matter"
    if not admissible(search, found):
        return "fits only with values that are not physical"
    if never_passed(search.system, search.motion, found.part, found.parameters):
        return "its period is longer than the way that the log travels: less than one period shows no repetition"
    here = CATALOGUE[found.part.kind].coordinate(search.system, found.part.place)
    return found.part.effect.unseen(found.parameters, float(search.record.noise[here]))


def by_the_drive_itself(before: Witness, after: Witness) -> str:
    """Words where friction that follows the drive force explains it by itself.

    With the measured drive on both sides of the balance, such friction takes noise and structure away as it takes the
    drive away: what counts is the residual over the share of the drive that is left.
    """
    motion = before.search.motion
    left, had = drive_left(after.system, motion), drive_left(before.system, motion)
    if np.all(left >= (1 - credit.LEAST_SHARE) * had) or after.over(before).left <= 1 - credit.LEAST_SHARE:
        return ""
    return f"leaves {100 * left.min():.2g} % of the drive force to the motion, and of that no more is explained"


def admissible(search: Search, found: Found) -> bool:
    """Whether the fitted values lie within the effect's bounds."""
    effect, values = CATALOGUE[found.part.kind], found.parameters
    if not all(np.isfinite(v) for v in values.values()):
        return False
    return effect.with_parameters(found.part.names).admissible(search.system, found.part.place, values)

"""Effects one after the other while held-out segments credit one, each looked at again once the others are in place."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis import credit
from codegen.diagnosis.credit import Evidence, evidence, held_out_losses, independent_share, level, noise_loss, size_of
from codegen.diagnosis.measure import share_of_drive
from codegen.diagnosis.models import with_effects
from codegen.diagnosis.output_error import Shot
from codegen.diagnosis.residual import inverse_dynamics_residual
from codegen.diagnosis.results import FoundEffect
from codegen.diagnosis.search import Found, Search
from codegen.diagnosis.trial import STRUCTURE, Part
from codegen.effects import CATALOGUE

Array = NDArray[np.float64]

MOST_EFFECTS = 3
SWAPPED = 6
STRUCTURE_SIZE = 2e-3
BETTER = 10.0
"""Nats by which another effect must fit better to take the place of one found earlier."""

Progress = Callable[[int, float], None]


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


@dataclass(frozen=True, eq=False)
class Outcome:
    """What all rounds found.

    Attributes:
        base: the refit of the declared structure. final: the fit with all effects (``base`` where there is none).
        first: the first round, best first. rivals: of the first effect, which the data cannot tell from it.
        explained: share of the squared residual, or of its excess over the noise, that the effects remove.
        segments: of the record.
        unexplained: whether nothing is credited although the residual is far above the noise and no small one.
    """

    base: Shot
    final: Shot
    first: tuple[Ranked, ...]
    rivals: tuple[Ranked, ...]
    explained: float
    segments: int
    unexplained: bool = False

    @property
    def parts(self) -> tuple[Part, ...]:
        return self.final.runner.trial.parts


def find_effects(search: Search, tell: Progress, refit_only: bool = False) -> Outcome:
    """Rounds of candidates until none is credited; none at all where ``refit_only``."""
    base = current = confirmed = search.refit()
    first: list[Ranked] = []
    rivals: list[Ranked] = []
    for turn in range(0 if refit_only else MOST_EFFECTS):
        if turn and at_noise(current):
            break
        parts = search.every_part(current.runner.trial.parts)
        ranked = run_round(search, current, parts, partial(tell, turn))
        first = first or ranked
        possible = [r for r in ranked if not r.why_not or r.unsure]
        if not possible:
            break
        tied = ties(possible)
        current = search.rebased(possible[0].found.shot)
        rivals = tied or rivals
        if not credible(search, confirmed, current, len(parts)):
            continue
        if confirmed is not base and _explained(search, confirmed, current) < credit.LEAST_EXPLAINED:
            break
        confirmed = current
    current = confirmed
    if not current.runner.trial.parts:
        rivals = []
    if len(current.runner.trial.parts) > 1:
        current, rivals = _reconsidered(search, current, first, rivals)
    lost = current is base and not refit_only and level(base) > credit.NEAR_NOISE
    return Outcome(
        base,
        current,
        tuple(first),
        tuple(rivals),
        _explained(search, base, current),
        len(search.record.start),
        lost and credit.misfit(base) > credit.LEAST_SIZE,
    )


def run_round(search: Search, current: Shot, parts: Sequence[Part], tell: Callable[[float], None]) -> list[Ranked]:
    """Every candidate beside what was found already, ranked: those that pass every test first."""
    soft, base = search.softened(current)
    before = held_out_losses(base)
    kept = base.residual.shape[1]
    floor = noise_loss(base) / len(before)
    ranked = []
    for found in soft.attempt(base, parts, tell):
        losses = held_out_losses(found.shot)
        one = evidence(before, losses, kept, floor)
        ratio = level(found.shot) / level(base)
        size = _size(search, found, base)
        why_not = _why_not(search, found, one, size)
        unsure = not why_not and not _sure(search, found.shot, one, len(parts))
        if unsure:
            why_not = f"better on {one.won} of {one.blocks} blocks of held-out segments only (t = {one.t:.2g})"
        ranked.append(Ranked(found, one, losses, ratio, size, why_not, unsure))
    return sorted(ranked, key=lambda r: (bool(r.why_not) and not r.unsure, r.found.shot.cost))


def at_noise(shot: Shot) -> bool:
    """Whether a model leaves nothing but the noise of the positions."""
    noise = noise_loss(shot)
    return bool(held_out_losses(shot).sum() <= (1 + credit.AT_NOISE) * noise)


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


def _size(search: Search, found: Found, base: Shot) -> float:
    """Force of the effect over the drive force along the measured motion; else change of the prediction."""
    if found.part.kind in STRUCTURE:
        return size_of(found.shot, base)
    effect, motion, system = CATALOGUE[found.part.kind], search.motion, search.system
    if not effect.with_parameters(found.part.names).admissible(system, found.part.place, found.parameters):
        return size_of(found.shot, base)
    declared = FoundEffect(found.part.kind, found.part.on, found.parameters, {})
    richer = inverse_dynamics_residual(with_effects(system, [declared]), motion)
    change = richer - inverse_dynamics_residual(system, motion)
    return share_of_drive(system, motion, change)


def _why_not(search: Search, found: Found, e: Evidence, size: float) -> str:
    if e.gain <= 0:
        return "makes the error on held-out segments no smaller"
    if e.share < credit.LEAST_SHARE:
        return f"removes {100 * e.share:.2g} % of the squared residual on held-out segments"
    if size < (STRUCTURE_SIZE if found.part.kind in STRUCTURE else credit.LEAST_SIZE):
        return f"its force is {100 * size:.2g} % of the drive force: too little to matter"
    if not admissible(search, found):
        return "fits only with values that are not physical"
    return ""


def admissible(search: Search, found: Found) -> bool:
    """Whether the fitted values lie within the effect's bounds."""
    effect, values = CATALOGUE[found.part.kind], found.parameters
    if not all(np.isfinite(v) for v in values.values()):
        return False
    return effect.with_parameters(found.part.names).admissible(search.system, found.part.place, values)


def _reconsidered(
    search: Search, current: Shot, first: Sequence[Ranked], rivals: Sequence[Ranked]
) -> tuple[Shot, list[Ranked]]:
    """Each effect set against others with the rest in place: those of the first round, and what is confused with it.

    Returns:
        The better fit, and the rivals of the first effect that still tie with it.
    """
    for _ in range(MOST_EFFECTS):
        leader = current.runner.trial.parts[0]
        better, left = _swapped(search, current, first, rivals)
        if better is None:
            return current, left
        current = better
        if not _same(leader, current.runner.trial.parts[0]):
            rivals = []
    return current, []


def _swapped(
    search: Search, current: Shot, first: Sequence[Ranked], rivals: Sequence[Ranked]
) -> tuple[Shot | None, list[Ranked]]:
    """The fit with one effect replaced (it then stands last), or None; and the first one's rivals that tie."""
    left: list[Ranked] = []
    parts = current.runner.trial.parts
    for k in range(len(parts)):
        others = _others(search, parts, k, first)
        if not others:
            continue
        tried = search.attempt(search.without(current, k), others, lambda share: None)
        good = [f for f in tried if admissible(search, f)]
        if good and good[0].shot.cost < current.cost - BETTER:
            return search.rebased(good[0].shot), left
        if k == 0:
            left = [r for r in rivals if any(_ties(f, current) for f in good if _same(f.part, r.found.part))]
    return None, left


def _others(search: Search, parts: Sequence[Part], k: int, first: Sequence[Ranked]) -> list[Part]:
    """What may take the place of effect ``k``; the last one was chosen with the rest in place."""
    rest = [p for j, p in enumerate(parts) if j != k]
    alike = {c.other for c in CATALOGUE[parts[k].kind].confused_with}
    best = {(r.found.part.kind, r.found.part.on) for r in first[:SWAPPED]} if k < len(parts) - 1 else set()
    possible = [p for p in search.every_part(rest) if not _same(p, parts[k])]
    return [p for p in possible if p.kind in alike or (p.kind, p.on) in best]


def _ties(found: Found, current: Shot) -> bool:
    better = evidence(held_out_losses(found.shot), held_out_losses(current), current.residual.shape[1])
    return better.p(independent_share(current)) > credit.TIE_LEVEL


def _same(one: Part, other: Part) -> bool:
    return (one.kind, one.on) == (other.kind, other.on)


def _explained(search: Search, base: Shot, final: Shot) -> float:
    """The larger of: share of the squared residual removed, share of the loss above noise removed."""
    if final is base:
        return 0.0
    soft, before = search.softened(base)
    after = soft.rebased(final)
    a, b = held_out_losses(before), held_out_losses(after)
    one = evidence(a, b, before.residual.shape[1])
    excess = float(a.sum()) - noise_loss(before)
    return max(one.share, one.gain / excess if excess > 0 else 0.0)

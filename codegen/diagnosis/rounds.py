"""Forward selection of effects, cross-validated; each is tested again once the others are in place."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations

from codegen.diagnosis import credit
from codegen.diagnosis.attempt import Found, attempt, every_part
from codegen.diagnosis.credit import evidence, held_out_losses, level, noise_loss
from codegen.diagnosis.output_error import Shot
from codegen.diagnosis.ranking import Ranked, admissible, credible, led_by_force, run_round, ties, whiteness
from codegen.diagnosis.search import Search
from codegen.diagnosis.shooting import Record
from codegen.diagnosis.trial import Part
from codegen.effects import CATALOGUE
from codegen.effects.family import kinds_of

MOST_EFFECTS = 3
WILD, SHORTEST = 100.0, 0.25
"""Error of the refit in noise above which segments are halved, down to this share of their length."""
SWAPPED = 6
PAIRED = 5
"""Best of the first round that are tried in pairs, where the best alone leaves far more than the noise."""
BETTER = 10.0
"""Nats by which another effect must fit better to take the place of one found earlier."""

Progress = Callable[[int, float], None]


@dataclass(frozen=True, eq=False)
class LaterRound:
    """A round beside effects that were found before: those, and its candidates, best first."""

    beside: tuple[Part, ...]
    ranked: tuple[Ranked, ...]


@dataclass(frozen=True, eq=False)
class Outcome:
    """What all rounds found.

    Attributes:
        base: the refit of the declared structure. final: the fit with all effects (``base`` where there is none).
        first: the first round, best first. rivals: of the first effect, which the data cannot tell from it.
        explained: share of the squared residual, or of its excess over the noise, that the effects remove.
        segments: of the record.
        unexplained: whether nothing is credited although the residual is far above the noise, at least in some
            segments, and no small one.
        later: rounds after the first, whether or not they found anything.
    """

    base: Shot
    final: Shot
    first: tuple[Ranked, ...]
    rivals: tuple[Ranked, ...]
    explained: float
    segments: int
    unexplained: bool = False
    later: tuple[LaterRound, ...] = ()

    @property
    def parts(self) -> tuple[Part, ...]:
        return self.final.runner.trial.parts


def within_reach(search: Search) -> tuple[Search, Shot]:
    """The search on segments so short that free runs stay near the measured motion, and its refit.

    An error grows along a free run with the square of time, in a chaotic machine faster: a run that has left the
    motion tells candidates apart no more, and its slopes lead nowhere. Segments are halved while the refit leaves more
    than ``WILD`` times the noise.
    """
    near, base, share = search, search.refit(), 1.0
    while level(base) > WILD and share > SHORTEST:
        share /= 2
        near = replace(search, record=search.shorter(share), shorter=partial(_shorter, search, share))
        base = near.refit()
    return near, base


def _shorter(search: Search, factor: float, share: float) -> Record:
    return search.shorter(factor * share)


def find_effects(search: Search, base: Shot, tell: Progress, refit_only: bool = False) -> Outcome:
    """Rounds of candidates until none is credited; none at all where ``refit_only``.

    Args:
        base: the refit of the declared structure.
    """
    current = confirmed = base
    first: list[Ranked] = []
    rivals: list[Ranked] = []
    later: list[LaterRound] = []
    for turn in range(0 if refit_only else MOST_EFFECTS):
        if turn and at_noise(current):
            break
        parts = every_part(search, current.runner.trial.parts)
        ranked = run_round(search, current, parts, partial(tell, turn))
        first = first or ranked
        if turn:
            later.append(LaterRound(current.runner.trial.parts, tuple(ranked)))
        possible = [r for r in ranked if not r.why_not or r.unsure]
        if not possible:
            break
        possible = led_by_force(search, possible)
        tied = ties(search, possible)
        current = search.rebased(possible[0].found.shot)
        rivals = rivals if turn else tied
        if not credible(search, confirmed, current, len(parts)):
            continue
        if confirmed is not base and explained_share(search, confirmed, current) < credit.FURTHER:
            break
        rivals = tied or rivals
        confirmed = current
        if not turn and level(current) > credit.FAR:
            pair = _pair(search, possible[:PAIRED])
            if pair is not None and pair.cost < current.cost and worth_it(search, current, pair, len(parts)):
                current = confirmed = pair
                rivals = []
    current = confirmed
    if not current.runner.trial.parts:
        rivals = []
    if len(current.runner.trial.parts) > 1:
        current, rivals = _reconsidered(search, current, first, rivals)
        current = pruned(search, current, 1)
        single = _single(search, current)
        current, rivals = (current, rivals) if single is None else (single, [])
        current, rivals = standing(search, base, current, rivals, len(first))
    lost = current is base and not refit_only
    lost = lost and (level(base) > credit.NEAR_NOISE or credit.share_far(base) > credit.FEW)
    return Outcome(
        base,
        current,
        tuple(first),
        tuple(rivals),
        explained_share(search, base, current),
        len(search.record.start),
        lost and credit.misfit(base) > credit.LEAST_SIZE,
        tuple(later),
    )


def _pair(search: Search, ranked: Sequence[Ranked]) -> Shot | None:
    """The best fit of two of the first round together, where they are of different kinds.

    Of two effects that are both lacking, each biases the fit of the other: which of several similar shapes is the right
    one is seen only once the other is in place.
    """
    found: list[Shot] = []
    for k, one in enumerate(ranked[:-1]):
        others = [r.found.part for r in ranked[k + 1 :] if not _alike(one.found.part, r.found.part)]
        if others:
            both = run_round(search, search.rebased(one.found.shot), others, lambda share: None)
            found += [search.rebased(r.found.shot) for r in both if not r.why_not][:1]
    return min(found, key=lambda shot: shot.cost, default=None)


def _alike(one: Part, other: Part) -> bool:
    """Whether two effects leave their signature at the same place over the same axis."""
    effects = CATALOGUE[one.kind], CATALOGUE[other.kind]
    return one.on == other.on and effects[0].seen_over == effects[1].seen_over


def _single(search: Search, current: Shot) -> Shot | None:
    """The fit with one effect in place of two at one place over one axis, where it does as well; None elsewhere.

    A spring found late leaves a piece of a long wave and a hardening spring that together bend to its straight line.
    """
    parts = current.runner.trial.parts
    for j, k in combinations(range(len(parts)), 2):
        if not _alike(parts[j], parts[k]):
            continue
        rest = search.without(search.without(current, k), j)
        others = [p for p in every_part(search, rest.runner.trial.parts) if _alike(p, parts[j])]
        good = [f for f in attempt(search, rest, others, lambda share: None) if admissible(search, f)]
        if good and not worth_it(search, good[0].shot, current, len(others)):
            simpler = search.rebased(good[0].shot)
            return _single(search, simpler) or simpler
    return None


def worth_it(search: Search, shot: Shot, richer: Shot, candidates: int) -> bool:
    """Whether free runs credit a fit with more effects over one with fewer, by much of what that leaves."""
    much = explained_share(search, shot, richer) >= credit.FURTHER
    return much and credible(search, shot, richer, candidates)


def pruned(search: Search, shot: Shot, candidates: int, spared: int = 0) -> Shot:
    """The fit without those effects that are not worth their place beside the others.

    Args:
        spared: so many of the last stay.
    """
    for k in range(len(shot.runner.trial.parts) - 1 - spared, -1, -1):
        if len(shot.runner.trial.parts) > 1:
            without = search.without(shot, k)
            shot = shot if worth_it(search, without, shot, candidates) else without
    return shot


def standing(
    search: Search, base: Shot, current: Shot, rivals: Sequence[Ranked], candidates: int
) -> tuple[Shot, list[Ranked]]:
    """A fit of which effects were dropped, and its rivals; the refit where what is left is not credited over it.

    Two effects may be credited together of which neither is on its own. A rival that was tried beside an effect is
    none of an effect that stands alone.
    """
    alone = len(current.runner.trial.parts) == 1
    if alone and not credible(search, base, current, candidates):
        return base, []
    return current, [r for r in rivals if not alone or len(r.found.trial.parts) == 1]


def at_noise(shot: Shot) -> bool:
    """Whether a model leaves nothing but the noise of the positions."""
    noise = noise_loss(shot)
    return bool(held_out_losses(shot).sum() <= (1 + credit.AT_NOISE) * noise)


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
        tried = attempt(search, search.without(current, k), others, lambda share: None)
        good = [f for f in tried if admissible(search, f)]
        if good and good[0].shot.cost < current.cost - BETTER:
            return search.rebased(good[0].shot), left
        if k == 0:
            left = [r for r in rivals if any(_ties(search, f, current) for f in good if _same(f.part, r.found.part))]
    return None, left


def _others(search: Search, parts: Sequence[Part], k: int, first: Sequence[Ranked]) -> list[Part]:
    """What may take the place of effect ``k``; the last one was chosen with the rest in place."""
    rest = [p for j, p in enumerate(parts) if j != k]
    alike = {c.other for c in CATALOGUE[parts[k].kind].confused_with}
    best = {(r.found.part.kind, r.found.part.on) for r in first[:SWAPPED]} if k < len(parts) - 1 else set()
    possible = [p for p in every_part(search, rest) if not _same(p, parts[k])]
    return [p for p in possible if kinds_of(p.kind) & alike or (p.kind, p.on) in best]


def _ties(search: Search, found: Found, current: Shot) -> bool:
    better = evidence(held_out_losses(found.shot), held_out_losses(current), current.residual.shape[1])
    return better.p(whiteness(search, current)) > credit.TIE_LEVEL


def _same(one: Part, other: Part) -> bool:
    return (one.kind, one.on) == (other.kind, other.on)


def explained_share(search: Search, base: Shot, final: Shot) -> float:
    """The larger of: share of the squared residual removed, share of the loss above noise removed."""
    if final is base:
        return 0.0
    soft, before = search.softened(base)
    after = soft.rebased(final)
    a, b = held_out_losses(before), held_out_losses(after)
    one = evidence(a, b, before.residual.shape[1])
    excess = float(a.sum()) - noise_loss(before)
    return max(one.share, one.gain / excess if excess > 0 else 0.0)

"""Forward selection of effects with cross-validation; each effect is tested again once the others are included."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from codegen.base.progress import shares_to
from codegen.diagnosis.evidence.force_gain import ForceCriterion
from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.acceptance import noise_ratio
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import Search, joint_of
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.selection.candidate_fits import every_part
from codegen.diagnosis.selection.comparison import (
    force_prefers,
    leader_first,
    leaves_as_little,
    most_left,
    runs_prefer,
    same_signature,
    ties,
)
from codegen.diagnosis.selection.parsimony import (
    BETTER,
    MOST_EFFECTS,
    at_noise,
    explained_share,
    explains_enough,
    is_accepted,
    judged_together,
    nothing_left,
    with_simplest_effects,
    worth_it,
)
from codegen.diagnosis.selection.ranking import Ranked, credible, refused_when_fitted_again, run_round, same_motion
from codegen.diagnosis.selection.significance import hypotheses

DIVERGING, SHORTEST = 100.0, 0.25
"""Ratio of the refit's error to the noise above which segments are halved, and least share of their length."""
PAIRED = 5
"""Number of the best candidates of the first round that are tried in pairs if the best leaves far more than the noise,
at least in some segments."""

Progress = Callable[[int, float], None]


@dataclass(frozen=True, eq=False)
class LaterRound:
    """A round after the first: the effects found before it, and its candidates, best first."""

    found_before: tuple[Part, ...]
    ranked: tuple[Ranked, ...]


@dataclass(frozen=True, eq=False)
class Outcome:
    """The result of forward selection.

    Attributes:
        base: the refit of the declared structure.
        final: the fit with all effects; ``base`` without effects.
        first: the first round, best first.
        rivals: of the first effect, which the data do not distinguish from it.
        explained: share of the squared residual, or of its excess over the noise, that the effects remove.
        later: rounds after the first, whether or not they found an effect.
    """

    base: Fit
    final: Fit
    first: tuple[Ranked, ...]
    rivals: tuple[Ranked, ...]
    explained: float
    later: tuple[LaterRound, ...] = ()

    @property
    def parts(self) -> tuple[Part, ...]:
        return self.final.trial.parts

    def with_final(self, search: Search, final: Fit, rivals: Sequence[Ranked]) -> Outcome:
        """The outcome with another last fit, and these rivals of its first effect."""
        explained = explained_share(search, search.on_its_record(self.base), final)
        return replace(self, final=final, rivals=tuple(rivals), explained=explained)


BEAM = 3
"""Candidates of the first round that get a second round of their own."""


@dataclass(frozen=True, eq=False)
class SecondRound:
    """A candidate of the first round with all that are accepted in addition to it, best first.

    Attributes:
        pair: the fit with the best of these.
    """

    first: Ranked
    accepted: tuple[Ranked, ...]
    pair: Fit


def second_rounds(search: Search, ranked: Sequence[Ranked]) -> list[SecondRound]:
    """The best of the first round, each with candidates for a second effect (a beam search).

    It ends with a pair that leaves only noise, which no other pair explains better.

    Two missing effects bias each other's fit. Effects with nearly as small a residual as the best get a second round of
    all candidates; other pairs are of the best candidates with different signatures. Forms of one effect leave the same
    for a second effect, as effects with the same motion do (``twins``), so only the best one is tried in pairs.
    """
    found: list[SecondRound] = []
    for k, one in enumerate(ranked):
        if any(one.part.key in same_motion(r.found) for r in ranked[:k]):
            continue
        if 0 < k < BEAM and leaves_as_little(one, ranked[0]):
            others = every_part(search, [one.part])
        else:
            others = [r.part for r in ranked[k + 1 :] if not same_signature(one.part, r.part)]
        own, same = joint_of(search, one.part), same_motion(one.found)
        others = [p for p in others if joint_of(search, p) == own and p.key not in same]
        both = run_round(search, search.fitted_again(one.found), others, leading=True) if others else []
        accepted = tuple(r for r in both if not r.why_not)
        if accepted:
            found.append(SecondRound(one, accepted, search.fitted_again(accepted[0].found)))
            if at_noise(found[-1].pair):
                break
    return found


def explains_more(search: Search, led: Fit, pair: Fit) -> bool:
    """Whether a pair of effects explains more than another effect does, and no less than that with the second of them.

    Each by free runs and by the force residual. A further missing effect can be what makes the wrong one of two the
    best alone. Example: a spring explained more than a constant force on a motor that also lacks viscous friction, and
    no more beside viscous friction. The other way round, of a pair whose second effect only corrects what the first one
    lacks, the first adds nothing to the other effect.
    """
    here = ForceCriterion(search, pair)
    if pair.cost >= led.cost - BETTER or not force_prefers(here, ForceCriterion(search, led)):
        return False
    refitted_values, values = led.values
    other = search.with_parts(led, refitted_values, [*led.trial.parts, pair.part], [*values, pair.parameters])
    there = ForceCriterion(search, other)
    return not (runs_prefer(search, other, pair) or force_prefers(there, here, most_left(other)))


def within_reach(search: Search) -> tuple[Search, Fit]:
    """The search with segments so short that free runs stay near the measured motion, and its refit."""
    near, base, share = search, search.refit(), 1.0
    while noise_ratio(base) > DIVERGING and share > SHORTEST:
        share /= 2
        near = search.on_shorter(share)
        base = near.refit()
    return near, base


def find_effects(
    search: Search,
    base: Fit,
    report_progress: Progress,
    refit_only: bool = False,
    is_superseded: Callable[[Fit], bool] = lambda found: False,
) -> Outcome:
    """Forward selection until no candidate is accepted; no round with ``refit_only``.

    If an arm is simulated joint by joint, each joint has its own rounds, the worst joint first.

    Args:
        is_superseded: asked of each fit with a further accepted effect, whether the effects are sought again anyway.
            The outcome then has the effects so far.
    """
    rounds = _Rounds.before_the_first(search, base, 0 if refit_only else MOST_EFFECTS, report_progress)
    while not rounds.are_over():
        before = rounds.confirmed
        rounds.next()
        if rounds.confirmed is not before and is_superseded(rounds.confirmed):
            return rounds.outcome(base, rounds.confirmed)
    confirmed = rounds.confirmed
    with shares_to(partial(report_progress, rounds.taken)):
        rivals = rounds.rivals if confirmed.trial.parts else []
        current, rivals = judged_together(search, base, confirmed, rivals, rounds.paired)
    return rounds.outcome(base, current, rivals)


@dataclass(eq=False)
class _Rounds:
    """The rounds of a forward selection, and what they have found so far.

    An effect that is not accepted alone may be with a second one at the same joint, so it stays for one more round.

    Attributes:
        left: joint → rounds that it may still have; one joint, None, for a machine that is simulated as a whole.
        confirmed: the fit with all accepted effects.
        current: the fit that the next round extends: ``confirmed``, or that with an effect that is not accepted alone.
        rivals: of the first effect.
        first, later: the candidates of the first round, and the other rounds.
        joint: of the last round. hypotheses: number that it tested.
        taken: number of rounds that had a possible candidate.
        leaders: the best of the first round, until pairs of them are tried. led: the fit with the first of them.
        alone: number of hypotheses of that round.
        paired: whether the first two effects were found as a pair.
    """

    search: Search
    report: Progress
    left: dict[int | None, int]
    confirmed: Fit
    current: Fit
    led: Fit
    rivals: list[Ranked] = field(default_factory=list)
    first: list[Ranked] = field(default_factory=list)
    later: list[LaterRound] = field(default_factory=list)
    joint: int | None = None
    hypotheses: int = 0
    taken: int = 0
    leaders: list[Ranked] = field(default_factory=list)
    alone: int = 0
    paired: bool = False

    @classmethod
    def before_the_first(cls, search: Search, base: Fit, most: int, report: Progress) -> _Rounds:
        """No effect found; ``most``: of rounds at each joint."""
        joints: Sequence[int | None] = (search.record.joints or ()) if search.rigid else [None]
        return cls(search, report, dict.fromkeys(joints, most), confirmed=base, current=base, led=base)

    def outcome(self, base: Fit, final: Fit, rivals: Sequence[Ranked] = ()) -> Outcome:
        """The outcome with this last fit, and these rivals of its first effect."""
        explained = explained_share(self.search, base, final)
        return Outcome(base, final, tuple(self.first), tuple(rivals), explained, tuple(self.later))

    def are_over(self) -> bool:
        return not (self.leaders or self._joints())

    def next(self) -> None:
        """One step: pairs of the first round's best candidates, once the best had a second round; else a new round."""
        joints = self._joints()
        if self.leaders and (self.search.rigid or self.taken > 1 or not joints):
            self._try_pairs()
            return
        ranked = self._ranked(joints) if joints else []
        possible = [r for r in ranked if r.grade]
        if possible:
            self._take(possible, [r for r in ranked if r.contradicted])
        else:
            self._end()

    def _joints(self) -> list[int | None]:
        return _unexplained(self.search, self.current, self.left, bool(self.taken))

    def _doubtful(self) -> Sequence[Part]:
        """The effects that are not accepted alone."""
        return self.current.trial.parts[len(self.confirmed.trial.parts) :]

    def _end(self) -> None:
        """No further round at this joint; an effect that is not accepted alone is left out."""
        self.current, self.left[self.joint] = self.confirmed, 0

    def _ranked(self, joints: Sequence[int | None]) -> list[Ranked]:
        """The candidates at the joint of an effect in doubt, else at the worst joint, best first."""
        search, parts = self.search, self.current.trial.parts
        self.joint = [*(joint_of(search, p) for p in self._doubtful()), *joints][0]
        candidates = [p for p in every_part(search, parts) if joint_of(search, p) == self.joint]
        with shares_to(partial(self.report, self.taken)):
            ranked = run_round(search, self.current, candidates)
        self.hypotheses = hypotheses(candidates)
        if self.first:
            self.later.append(LaterRound(parts, tuple(r.for_table for r in ranked)))
        self.first = self.first or ranked
        return ranked

    def _take(self, possible: Sequence[Ranked], contradicted: Sequence[Ranked]) -> None:
        """The first of these candidates, accepted or in doubt; ``contradicted``: others that may tie with it.

        One that is not accepted alone stays for one more round, and not for a second one: with three effects in doubt
        there are so many sets that one passes by chance.
        """
        search, is_first, doubtful = self.search, not self.taken, bool(self._doubtful())
        possible = leader_first(search, possible)
        tied = ties(search, [*possible, *contradicted])
        current = search.fitted_again(possible[0].found)
        self.current, self.rivals = with_simplest_effects(search, current, tied if is_first else self.rivals)
        self.taken += 1
        self.left[self.joint] -= 1
        if not credible(search, self.confirmed, self.current, self.hypotheses):
            if is_first:
                self.first = refused_when_fitted_again(self.first, possible[0])
            if doubtful or not self.left[self.joint]:
                self._end()
            return
        has_one = any(joint_of(search, p) == self.joint for p in self.confirmed.trial.parts)
        if has_one and not explains_enough(search, self.confirmed, self.current):
            self._end()
            return
        self.rivals = tied or self.rivals
        self.confirmed = self.current
        # What other joints lack is theirs.
        alone = self.current if self.joint is None else self.current.of_joint(self.joint)
        if is_first and not acceptance.near_noise(alone) and not acceptance.is_negligible(alone):
            self.leaders, self.led, self.alone = list(possible[:PAIRED]), self.current, self.hypotheses

    def _try_pairs(self) -> None:
        """A pair of the first round's best takes the place of the effects found, if it is better."""
        search, leaders, self.leaders = self.search, self.leaders, []
        with shares_to(partial(self.report, self.taken)):
            pairs = [] if at_noise(self.confirmed) else second_rounds(search, leaders)
        best = min(pairs, key=lambda one: one.pair.cost, default=None)
        better = best is not None and _is_better_pair(best.pair, self.confirmed)
        if best is not None and better and worth_it(search, self.led, best.pair, self.alone):
            self.current = self.confirmed = with_simplest_effects(search, best.pair, [])[0]
            self.rivals, self.paired = [], True
            self.left[self.joint] = MOST_EFFECTS - len(best.pair.trial.parts)
        elif self.confirmed is self.led:
            known = leaders[0], *self.rivals
            self.rivals = [*known[1:], *(p.first for p in pairs if p.first not in known and self._is_rival(p))]

    def _is_rival(self, one: SecondRound) -> bool:
        """Whether a candidate that is accepted alone explains more than the best, with another one added."""
        pairs = (self.search.fitted_again(r.found) for r in one.accepted if r.part.key != self.led.part.key)
        return not one.first.why_not and any(explains_more(self.search, self.led, pair) for pair in pairs)


def _unexplained(search: Search, fit: Fit, rounds: Mapping[int | None, int], begun: bool) -> list[int | None]:
    """The unexplained joints with remaining rounds, the worst first; [None] for a machine simulated as a whole."""
    if search.rigid is None:
        return [None] if rounds[None] and not (begun and nothing_left(fit)) else []
    left = [(joint, fit.of_joint(joint)) for joint, count in rounds.items() if count and joint is not None]
    return [joint for joint, own in sorted(left, key=lambda pair: -pair[1].cost) if not nothing_left(own)]


def _is_better_pair(pair: Fit, confirmed: Fit) -> bool:
    """Whether a pair takes the place of the effects found in rounds: it fits better, by ``BETTER`` if these are two."""
    return pair.cost < confirmed.cost - (BETTER if len(confirmed.trial.parts) >= len(pair.trial.parts) else 0.0)


def common_effects(search: Search, outcome: Outcome) -> tuple[Search, Outcome] | None:
    """The outcome with the effects that all tied models have in common; None if these are not accepted alone.

    Rivals may tie in explaining the remainder of an effect, such as a delay or a lag of a fraction of a sample with a
    dead zone, or a wrong parameter. If the fit with the common effects ends at a limit, it and the refit are repeated
    without limits.

    Returns:
        The search in which the common effects were fitted, and the outcome.
    """
    if not outcome.rivals or len(outcome.parts) < 2:
        return None
    base, common = outcome.base, search.without(outcome.final, 0)
    freed = search.without_limits(common)
    if freed is not None:
        search, common = freed
        base = search.fitted_again(base)
    if not is_accepted(search, base, common):
        return None
    return search, replace(outcome, base=base).with_final(search, common, ())

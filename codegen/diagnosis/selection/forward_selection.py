"""Forward selection of effects with cross-validation; each effect is tested again once the others are included."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import combinations

from codegen.diagnosis.evidence.force_gain import ForceCriterion
from codegen.diagnosis.evidence.score_test import nested_evidence_of
from codegen.diagnosis.fit import credit
from codegen.diagnosis.fit.credit import evidence_of, noise_loss, noise_ratio
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import Search, joint_of, where_they_differ
from codegen.diagnosis.fit.shooting import hidden_states
from codegen.diagnosis.fit.trial import Part, part_of
from codegen.diagnosis.selection.candidate_fits import (
    FORM_GAIN,
    every_part,
    fit_candidates,
    in_simplest_forms,
    simpler_forms,
)
from codegen.diagnosis.selection.ranking import (
    CLOSE,
    Ranked,
    credible,
    force_prefers,
    is_no_better_form,
    leader_first,
    leaves_as_little,
    most_left,
    nearest_of_equal,
    refused_when_fitted_again,
    run_round,
    runs_prefer,
    same_motion,
    same_signature,
    tied_by_free_runs,
    ties,
    tolerances_prefer,
)
from codegen.diagnosis.selection.refusals import (
    contradicted_by_force,
    corrects_a_form,
    force_share,
    is_possible,
    matters,
)
from codegen.diagnosis.selection.significance import hypotheses
from codegen.effects import CATALOGUE
from codegen.effects.register import kinds_of, separating_experiment, twins_of

MOST_EFFECTS = 3
DIVERGING, SHORTEST = 100.0, 0.25
"""Ratio of the refit's error to the noise above which segments are halved, and least share of their length."""
BEAM = 3
"""Candidates of the first round that get a second round of their own."""
PAIRED = 5
"""Number of the best candidates of the first round that are tried in pairs if the best leaves far more than the noise,
at least in some segments."""
BETTER = 10.0
"""Nats by which another effect must fit better to replace one found earlier."""

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
        segments: number in the record.
        unexplained: whether no effect is credited although the residual is material and far above the noise, at least
            in some segments.
        later: rounds after the first, whether or not they found an effect.
    """

    base: Fit
    final: Fit
    first: tuple[Ranked, ...]
    rivals: tuple[Ranked, ...]
    explained: float
    segments: int
    unexplained: bool = False
    later: tuple[LaterRound, ...] = ()

    @property
    def parts(self) -> tuple[Part, ...]:
        return self.final.trial.parts

    def with_final(self, search: Search, final: Fit, rivals: Sequence[Ranked]) -> Outcome:
        """The outcome with another last fit, and these rivals of its first effect."""
        explained = explained_share(search, self.base, final)
        return replace(self, final=final, rivals=tuple(rivals), explained=explained)


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
    """Forward selection until no candidate is credited; no round with ``refit_only``.

    If an arm is simulated joint by joint, each joint has its own rounds, the worst joint first.

    Args:
        is_superseded: asked of each fit with a further credited effect, whether the effects are sought again anyway.
            The outcome then has the effects so far.
    """
    rounds = _Rounds.before_the_first(search, base, 0 if refit_only else MOST_EFFECTS, report_progress)
    while not rounds.are_over():
        before = rounds.confirmed
        rounds.next()
        if rounds.confirmed is not before and is_superseded(rounds.confirmed):
            return rounds.outcome(base)
    confirmed, rivals, paired, among_all = rounds.confirmed, rounds.rivals, rounds.paired, rounds.among_all
    progress = partial(report_progress, rounds.taken)
    pair = _split(search, confirmed, progress)
    if pair is not None:
        confirmed, rivals, paired, among_all = pair, [], True, False
    rivals = rivals if confirmed.trial.parts else []
    current, rivals = _revised(search, base, confirmed, rivals, paired, among_all, progress)
    lost = current is base and not refit_only and not credit.near_noise(base)
    unexplained = lost and credit.misfit(base) > credit.LEAST_SIZE
    explained, segments = explained_share(search, base, current), len(search.record.start)
    first, later = tuple(rounds.first), tuple(rounds.later)
    return Outcome(base, current, first, tuple(rivals), explained, segments, unexplained, later)


@dataclass(eq=False)
class _Rounds:
    """The rounds of a forward selection, and what they have found so far.

    An effect that is not credited alone may be with a second one at the same joint, so it stays for one more round.
    Then the other candidates of its round are tried in its place.

    Attributes:
        left: joint → rounds that it may still have; one joint, None, for a machine that is simulated as a whole.
        confirmed: the fit with all credited effects.
        current: the fit that the next round extends: ``confirmed``, or that with an effect that is not credited alone.
        rivals: of the first effect.
        first, later: the candidates of the first round, and the other rounds.
        joint: of the last round. hypotheses: number that it tested.
        begun: number of rounds. taken: number of those that had a possible candidate.
        waiting: candidates of a round that pass every test where its leader does not, and predict held-out segments as
            well. beside: the others of that round that may tie with them, the leader among them.
        leaders: the best of the first round, until pairs of them are tried. led: the fit with the first of them.
        alone: number of hypotheses of that round.
        paired: whether the effects were found as a pair. among_all: as of ``_reconsidered``.
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
    begun: int = 0
    taken: int = 0
    waiting: list[Ranked] = field(default_factory=list)
    beside: list[Ranked] = field(default_factory=list)
    leaders: list[Ranked] = field(default_factory=list)
    alone: int = 0
    paired: bool = False
    among_all: bool = True

    @classmethod
    def before_the_first(cls, search: Search, base: Fit, most: int, report: Progress) -> _Rounds:
        """No effect found; ``most``: of rounds at each joint."""
        joints: Sequence[int | None] = (search.record.joints or ()) if search.rigid else [None]
        return cls(search, report, dict.fromkeys(joints, most), confirmed=base, current=base, led=base)

    def outcome(self, base: Fit) -> Outcome:
        """What they have found so far, each effect as its round found it."""
        explained, segments = explained_share(self.search, base, self.confirmed), len(self.search.record.start)
        return Outcome(base, self.confirmed, tuple(self.first), (), explained, segments, later=tuple(self.later))

    def are_over(self) -> bool:
        return not (self.leaders or self.waiting or self._joints())

    def next(self) -> None:
        """One step: pairs of the first round's best candidates, once the best had a second round; else a new round."""
        joints = self._joints()
        if self.leaders and (self.search.rigid or self.begun > 1 or not joints):
            self._try_pairs()
            return
        self.begun += 1
        ranked = self._ranked(joints) if joints else []
        possible = [r for r in ranked if not r.why_not or r.unsure]
        contradicted = [r for r in ranked if r.contradicted]
        if possible:
            self._take(possible, contradicted)
        elif self.waiting:
            self._fall_back(contradicted)
        else:
            self._end()

    def _joints(self) -> list[int | None]:
        return _unexplained(self.search, self.current, self.left, bool(self.taken))

    def _doubtful(self) -> Sequence[Part]:
        """The effects that are not credited alone."""
        return self.current.trial.parts[len(self.confirmed.trial.parts) :]

    def _end(self) -> None:
        """No further round at this joint; an effect that is not credited alone is left out."""
        self.current, self.left[self.joint] = self.confirmed, 0

    def _ranked(self, joints: Sequence[int | None]) -> list[Ranked]:
        """The candidates at the joint of an effect in doubt, else at the worst joint, best first."""
        search, parts = self.search, self.current.trial.parts
        self.joint = [*(joint_of(search, p) for p in self._doubtful()), *joints][0]
        candidates = [p for p in every_part(search, parts) if joint_of(search, p) == self.joint]
        ranked = run_round(search, self.current, candidates, partial(self.report, self.taken))
        self.hypotheses = hypotheses(candidates)
        if self.first:
            self.later.append(LaterRound(parts, tuple(r.for_table for r in ranked)))
        self.first = self.first or ranked
        return ranked

    def _fall_back(self, contradicted: list[Ranked]) -> None:
        """Try the waiting candidates in place of a leader that is not credited; one that fails too ends the rounds."""
        waiting, self.waiting = self.waiting, []
        self.current = self.confirmed
        self.joint = joint_of(self.search, waiting[0].found.part)
        self.rivals = self.rivals if self.confirmed.trial.parts else []  # else those of the leader in doubt
        self._take(waiting, [*contradicted, *self.beside], falls_back=True)

    def _take(self, possible: Sequence[Ranked], alike: Sequence[Ranked], falls_back: bool = False) -> None:
        """The first of these candidates, credited or in doubt; ``alike``: others that may tie with it."""
        search, is_first = self.search, not self.taken
        last_chance = falls_back or bool(self._doubtful())
        possible = leader_first(search, possible)
        tied = ties(search, [*possible, *alike])
        current = search.fitted_again(possible[0].found)
        self.current, self.rivals = _in_simplest_forms(search, current, tied if is_first else self.rivals)
        self.taken += 1
        count = len(self.current.trial.parts)
        self.left[self.joint] = MOST_EFFECTS - count if falls_back else self.left[self.joint] - 1
        if not credible(search, self.confirmed, self.current, self.hypotheses):
            if is_first:
                self.first = refused_when_fitted_again(self.first, possible[0])
            self._keep_in_doubt(possible, last_chance)
            return
        has_one = any(joint_of(search, p) == self.joint for p in self.confirmed.trial.parts)
        if has_one and explained_share(search, self.confirmed, self.current) < credit.FURTHER:
            self._end()
            return
        self.waiting = []
        self.rivals = tied or self.rivals
        self.confirmed, self.among_all = self.current, True
        # What other joints lack is theirs.
        alone = self.current if self.joint is None else self.current.of_joint(self.joint)
        if is_first and not credit.near_noise(alone) and not credit.is_negligible(alone):
            self.leaders, self.led, self.alone = list(possible[:PAIRED]), self.current, self.hypotheses

    def _keep_in_doubt(self, possible: Sequence[Ranked], last_chance: bool) -> None:
        """Keep an effect that is not credited alone for one more round, and note the candidates to try in its place.

        There is no second such round: with three effects in doubt there are so many sets that one passes by chance.
        """
        if last_chance:
            self.left[self.joint] = 0
        else:
            least = possible[0].evidence.share - credit.LEAST_SHARE
            self.waiting = [r for r in possible[1:] if not r.why_not and r.evidence.share > least]
            self.beside = [r for r in possible if all(r is not one for one in self.waiting)]
        if not self.left[self.joint]:
            self.current = self.confirmed

    def _try_pairs(self) -> None:
        """A pair of the first round's best takes the place of the effects found, if it is better."""
        search = self.search
        progress = partial(self.report, self.taken)
        pair, among_all = (None, False) if at_noise(self.confirmed) else _pair(search, self.leaders, progress)
        self.leaders = []
        if pair is None or not _is_better_pair(pair, self.confirmed):
            return
        if worth_it(search, self.led, pair, self.alone):
            self.current = self.confirmed = _in_simplest_forms(search, pair, [])[0]
            self.rivals, self.paired, self.among_all, self.waiting = [], True, among_all, []
            self.left[self.joint] = MOST_EFFECTS - len(pair.trial.parts)


def _revised(
    search: Search,
    base: Fit,
    current: Fit,
    rivals: list[Ranked],
    paired: bool,
    among_all: bool,
    report_progress: Callable[[float], None] = lambda share: None,
) -> tuple[Fit, list[Ranked]]:
    """Several effects judged together, which rounds found one after another, and the rivals of the first of them.

    Each may be replaced or removed, and is taken in its simplest form.

    Args:
        paired: whether the effects were found as a pair, so that rivals of the first one are unknown.
        among_all: as of ``_reconsidered``.
    """
    if len(current.trial.parts) < 2:
        return current, rivals
    current, rivals = _reconsidered(search, current, None if paired else rivals, among_all, report_progress)
    current, rivals = _pruned_with_rivals(search, current, rivals)
    current, rivals = _in_simplest_forms(search, current, rivals)  # also of an effect that replaced another
    current, rivals = still_credited(search, base, current, rivals)
    return current if rivals else _largest_first(search, current), rivals


def _unexplained(search: Search, fit: Fit, rounds: Mapping[int | None, int], begun: bool) -> list[int | None]:
    """The unexplained joints with remaining rounds, the worst first; [None] for a machine simulated as a whole."""
    if search.rigid is None:
        return [None] if rounds[None] and not (begun and nothing_left(fit)) else []
    left = [(joint, fit.of_joint(joint)) for joint, count in rounds.items() if count and joint is not None]
    return [joint for joint, own in sorted(left, key=lambda pair: -pair[1].cost) if not nothing_left(own)]


def _is_better_pair(pair: Fit, confirmed: Fit) -> bool:
    """Whether a pair takes the place of the effects found in rounds: it fits better, by ``BETTER`` if these are two."""
    return pair.cost < confirmed.cost - (BETTER if len(confirmed.trial.parts) >= len(pair.trial.parts) else 0.0)


def _pair(
    search: Search, ranked: Sequence[Ranked], report_progress: Callable[[float], None]
) -> tuple[Fit | None, bool]:
    """The best fit with two effects, at least one of them among the best of the first round (a beam search).

    It ends with a pair that leaves only noise, which no other pair explains better.

    Two missing effects bias each other's fit. Effects with nearly as small a residual as the best get a second round of
    all candidates; other pairs are of the best candidates with different signatures. Forms of one effect leave the same
    for a second effect, as effects with the same motion do (``twins``), so only the best one is tried in pairs.

    Returns:
        The fit, None if there is none, and whether its last effect was chosen among all with the first kept.
    """
    best: Fit | None = None
    among_all = False
    for k, one in enumerate(ranked):
        if any((one.found.part.kind, one.found.part.on) in same_motion(r.found) for r in ranked[:k]):
            continue
        every = 0 < k < BEAM and leaves_as_little(one, ranked[0])
        if every:
            others = every_part(search, [one.found.part])
        else:
            others = [r.found.part for r in ranked[k + 1 :] if not same_signature(one.found.part, r.found.part)]
        own, same = joint_of(search, one.found.part), same_motion(one.found)
        others = [p for p in others if joint_of(search, p) == own and (p.kind, p.on) not in same]
        if others:
            both = run_round(search, search.fitted_again(one.found), others, report_progress, leading=True)
            for found in [search.fitted_again(r.found) for r in both if not r.why_not][:1]:
                if best is None or found.cost < best.cost:
                    best, among_all = found, every
        if best is not None and at_noise(best):
            break
    return best, among_all


def _split(search: Search, current: Fit, report_progress: Callable[[float], None] = lambda share: None) -> Fit | None:
    """The fit with two effects in place of one that is confused with both, if they explain more; else None.

    Only pairs with no more parameters than the one are tried, so that the better fit decides. Example: within a part of
    a turn, a spring and a constant force look like an unbalanced mass.
    """
    here = ForceCriterion(search, current)
    for k, part in enumerate(current.trial.parts):
        if len(part.names) < 2 or at_noise(current):
            continue
        rest = search.without(current, k)
        alike = [p for p in every_part(search, rest.trial.parts) if _is_confused(search, part, p)]
        for one, two in combinations(alike, 2):
            if _same(one, two) or len(one.names) + len(two.names) > len(part.names):
                continue
            for first in fit_candidates(search, rest, [one], report_progress):
                for both in fit_candidates(search, first, [two], report_progress):
                    better = both.cost < current.cost - BETTER and runs_prefer(search, both, current)
                    if better and is_possible(search, both) and not force_prefers(here, ForceCriterion(search, both)):
                        return search.fitted_again(both)
    return None


def _is_confused(search: Search, one: Part, other: Part) -> bool:
    """Whether the catalogue lists two effects on the same coordinate as having a similar signature."""
    here, there = (p.effect.coordinate(search.system, p.place) for p in (one, other))
    return here == there and bool(separating_experiment(one.kind, other.kind))


def _in_simplest_forms(search: Search, current: Fit, rivals: list[Ranked]) -> tuple[Fit, list[Ranked]]:
    """The fit with each effect at the joint of the last one in its simplest form that fits as well with all the others.

    Each form was chosen before the later effects were found. Examples: a backlash with a gap of 1e-15 rad is a
    compliance; viscous friction whose slope falls with speed may be a line once a spring is found. A simpler kind is
    then removed from the rivals. A parameter of the other form starts from the one with its unit.
    """
    trial, (moved, values) = current.trial, current.values
    if len(trial.parts) < 2:
        return current, rivals
    for k, part in enumerate(trial.parts):
        own = {p.unit: values[k][p.name] for p in part.effect.parameters}
        here = joint_of(search, part) == joint_of(search, trial.parts[-1])
        for form in simpler_forms(part) if here else []:
            simpler = part_of(form, part.place, search.system)
            parts = [simpler if p is part else p for p in trial.parts]
            start = {p.name: values[k].get(p.name, own.get(p.unit, 1.0)) for p in form.parameters}
            other = search.with_parts(current, moved, parts, [*values[:k], start, *values[k + 1 :]])
            if other.cost <= current.cost + FORM_GAIN:
                return _in_simplest_forms(search, other, [r for r in rivals if not _same(r.found.part, simpler)])
    return current, rivals


def worth_it(search: Search, fit: Fit, richer: Fit, candidates: int) -> bool:
    """Whether free runs credit the fit with more effects, which explains at least ``FURTHER`` of the remaining loss."""
    much = explained_share(search, fit, richer) >= credit.FURTHER
    return much and credible(search, fit, richer, candidates)


def pruned(search: Search, fit: Fit, candidates: int, spared: int = 0) -> Fit:
    """Backward elimination of effects that free runs do not credit; the last ``spared`` stay."""
    for k in range(len(fit.trial.parts) - 1 - spared, -1, -1):
        if len(fit.trial.parts) > 1:
            without = search.without(fit, k)
            fit = fit if worth_it(search, without, fit, candidates) else without
    return fit


def _pruned_with_rivals(search: Search, current: Fit, rivals: list[Ranked]) -> tuple[Fit, list[Ranked]]:
    """Backward elimination; if the first effect is removed, so are its rivals."""
    leader, kept = current.trial.parts[0], pruned(search, current, 1)
    return kept, rivals if _same(leader, kept.trial.parts[0]) else []


def still_credited(search: Search, base: Fit, current: Fit, rivals: Sequence[Ranked]) -> tuple[Fit, list[Ranked]]:
    """A fit in which effects were replaced or removed, with its rivals; the refit if the fit is not credited.

    Each effect may be needed in addition to the others although all together predict no better than the refit. A rival
    that was tried in addition to an effect is no rival of a single effect.
    """
    if not is_credited(search, base, current):
        return base, []
    alone = len(current.trial.parts) == 1
    return current, [r for r in rivals if not alone or len(r.found.trial.parts) == 1]


def is_credited(search: Search, base: Fit, fit: Fit) -> bool:
    """Whether free runs credit a fit over the refit, among all candidates of the first round, fitted or not."""
    return credible(search, base, fit, hypotheses(every_part(search, base.trial.parts)))


def nothing_left(fit: Fit) -> bool:
    """Whether the search ends: only noise is left, or less than the smallest effect changes."""
    return at_noise(fit) or credit.is_negligible(fit)


def at_noise(fit: Fit) -> bool:
    """Whether a model leaves only the noise of the positions."""
    return bool(fit.held_out_losses.sum() <= (1 + credit.AT_NOISE) * noise_loss(fit))


def _reconsidered(
    search: Search,
    current: Fit,
    rivals: Sequence[Ranked] | None,
    among_all: bool = True,
    report_progress: Callable[[float], None] = lambda share: None,
) -> tuple[Fit, list[Ranked]]:
    """Compare each effect with its possible replacements, the others kept (stepwise selection with replacement).

    Args:
        rivals: of the first effect by the first round; None if they are unknown, as for a pair.
        among_all: whether the last effect was chosen among all candidates with the others kept, as replacements are.

    Returns:
        The better fit, and the rivals that still tie with its first effect. If only a later effect has rivals, it is
        put first.
    """
    for _ in range(MOST_EFFECTS):
        leader = current.trial.parts[0]
        better, tied = _swapped(search, current, rivals, among_all, report_progress)
        if better is None:
            k = min(tied, default=0)
            return (_put_first(search, current, k) if k else current), tied.get(k, [])
        current, among_all = better, True
        if rivals and not _same(leader, current.trial.parts[0]):
            rivals = []
    return current, []


def _swapped(
    search: Search,
    current: Fit,
    rivals: Sequence[Ranked] | None,
    among_all: bool = True,
    report_progress: Callable[[float], None] = lambda share: None,
) -> tuple[Fit | None, dict[int, list[Ranked]]]:
    """The fit with one effect replaced (the new one is last), or None; and index of an effect → rivals that tie.

    If the first round has rivals of the first effect, only these are tested.
    """
    tied: dict[int, list[Ranked]] = {}
    parts, here = current.trial.parts, ForceCriterion(search, current)
    for k in range(len(parts)):
        others = _others(search, parts, k, among_all)
        if not others:
            continue
        without = search.without(current, k)
        tried = fit_candidates(search, without, others, report_progress, current)
        good = [f for f in tried if is_possible(search, f) and matters(search, f, without)]
        good = in_simplest_forms([f for f in good if not _refused_by_force(search, without, f)])
        better = (f for f in good if f.cost < current.cost - BETTER and not _force_speaks_for(here, f))
        simpler = (f for f in good if _is_as_good_and_simpler(here, f, parts[k]))
        best = nearest_of_equal(search, better) or nearest_of_equal(search, simpler)
        if best is not None:
            return search.fitted_again(best), {}
        own = (f for f in good if CATALOGUE[f.part.kind].extends != parts[k].kind)
        own = (f for f in own if not is_no_better_form(f, current, parts[k]))
        as_it_is = as_replacement(search, current, without)
        same = [f for f in own if tied_by_free_runs(search, as_it_is, as_replacement(search, f, without))]
        if k or rivals is None:
            most = most_left(current)
            alike = (f for f in same if not force_prefers(here, ForceCriterion(search, f), most))
            alike = (f for f in alike if not tolerances_prefer(search, current, f))
            tied[k] = [as_replacement(search, f, without) for f in alike]
        else:
            tied[k] = [r for r in rivals if any(_same(f.part, r.found.part) for f in same)]
    return None, {k: found for k, found in tied.items() if found}


def _is_as_good_and_simpler(here: ForceCriterion, found: Fit, part: Part) -> bool:
    """Whether a replacement has fewer parameters than the effect ``part``, and neither criterion prefers that effect.

    Example: a load that a damper hardly moves is an inertia error and viscous friction, two effects in one.
    """
    search, current = here.search, here.fit
    if len(found.part.names) >= len(part.names) or found.cost > current.cost + FORM_GAIN:
        return False
    return not runs_prefer(search, current, found) and not force_prefers(here, ForceCriterion(search, found))


def _force_speaks_for(here: ForceCriterion, found: Fit) -> bool:
    """Whether the force residual prefers the present effects to a replacement far from the noise."""
    return not credit.near_noise(found) and force_prefers(here, ForceCriterion(here.search, found), 1 / CLOSE)


def _refused_by_force(search: Search, without: Fit, found: Fit) -> bool:
    """Whether the force residual contradicts a replacement."""
    before, after = ForceCriterion(search, without), ForceCriterion(search, found)
    return bool(corrects_a_form(before, after) or contradicted_by_force(before, after))


def _largest_first(search: Search, fit: Fit) -> Fit:
    """The fit with the effect of the largest force first; unchanged without effects, or with one that adds states."""
    trial = fit.trial
    if not trial.parts or hidden_states(trial.changed) > hidden_states(trial.system):
        return fit
    sizes = [force_share(search, p, v) for p, v in zip(trial.parts, fit.values[1], strict=True)]
    k = max(range(len(sizes)), key=sizes.__getitem__)
    return _put_first(search, fit, k) if k else fit


def _put_first(search: Search, fit: Fit, k: int) -> Fit:
    """The fit with its k-th effect before the others."""
    moved, found = fit.values
    order = sorted(range(len(found)), key=lambda j: j != k)
    return search.with_parts(fit, moved, [fit.trial.parts[j] for j in order], [found[j] for j in order])


def as_replacement(search: Search, found: Fit, without: Fit) -> Ranked:
    """A replacement with its evidence over the fit without it."""
    before, after = where_they_differ(search, without, found)
    ratio = noise_ratio(after) / noise_ratio(before)
    return Ranked(found, nested_evidence_of(before, after), ratio, float("nan"), "")


def _others(search: Search, parts: Sequence[Part], k: int, among_all: bool = True) -> list[Part]:
    """Possible replacements of effect ``k``; of a last one chosen ``among_all``, only those confused with it."""
    rest = [p for j, p in enumerate(parts) if j != k]
    same = {(parts[k].kind, parts[k].on), *twins_of(parts[k].effect, search.system, parts[k].place)}
    possible = [p for p in every_part(search, rest) if (p.kind, p.on) not in same]
    possible = [p for p in possible if joint_of(search, p) == joint_of(search, parts[k])]
    if k < len(parts) - 1 or not among_all:
        return possible
    alike = {c.other for c in CATALOGUE[parts[k].kind].confused_with}
    return [p for p in possible if kinds_of(p.kind) & alike]


def _same(one: Part, other: Part) -> bool:
    return (one.kind, one.on) == (other.kind, other.on)


def common_effects(search: Search, outcome: Outcome) -> tuple[Search, Outcome] | None:
    """The outcome with the effects that all tied models have in common; None if these are not credited alone.

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
    if not is_credited(search, base, common):
        return None
    return search, replace(outcome, base=base).with_final(search, common, ())


def explained_share(search: Search, base: Fit, final: Fit) -> float:
    """Share of the squared residual removed, or share of the loss above noise removed, whichever is larger."""
    if final is base:
        return 0.0
    soft, before = search.with_noise_floor(base)
    before, after = where_they_differ(search, before, soft.fitted_again(final))
    one = evidence_of(before, after, floored=False)
    excess = float(before.held_out_losses.sum()) - noise_loss(before)
    return max(one.share, one.gain / excess if excess > 0 else 0.0)

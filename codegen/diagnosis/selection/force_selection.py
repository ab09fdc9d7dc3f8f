"""Forward selection by fits to the force residual, judged on held-out blocks and confirmed by free runs.

For confirmation, free runs use these values of the effects, and refitted levels, toleranced values and start states.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import comb

import numpy as np

from codegen.base.arrays import Array
from codegen.base.progress import share_display, shares_to
from codegen.base.significant import in_percent
from codegen.diagnosis.evidence.estimate import estimate, named_effects
from codegen.diagnosis.evidence.force_gain import ForceCriterion
from codegen.diagnosis.evidence.reservations import determined_form, objections
from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.acceptance import Evidence, evidence, evidence_of, random_signs
from codegen.diagnosis.fit.drive import drive_left, drive_shares
from codegen.diagnosis.fit.output_error import Fit, segment_losses
from codegen.diagnosis.fit.search import Search, joint_of, joint_of_difference
from codegen.diagnosis.fit.starting_values import ForceStart
from codegen.diagnosis.fit.trial import Part, Trial, model_of, part_of
from codegen.diagnosis.results import Fact
from codegen.diagnosis.selection.attenuated_noise import only_attenuates_noise
from codegen.diagnosis.selection.comparison import differ_in_time, force_prefers, most_left, ties
from codegen.diagnosis.selection.force_fits import ForceFits
from codegen.diagnosis.selection.forward_selection import LaterRound
from codegen.diagnosis.selection.parsimony import MOST_EFFECTS, least_share
from codegen.diagnosis.selection.ranking import Ranked, in_simplest_admitted_forms, with_first
from codegen.diagnosis.selection.refusals import corrects_a_form, is_possible, matters, relative_size
from codegen.diagnosis.selection.significance import chance_in_words, hypotheses
from codegen.effects import CATALOGUE
from codegen.effects.register import kinds_of

FITTED = 8
"""Number of candidates that are fitted: those with the least residual after linear least squares from their start, over
the square of the drive force that they leave. Candidates that start with much less drive force are fitted in addition,
since such a start makes every force small."""


@dataclass(frozen=True, eq=False)
class ForceSelection:
    """Effects that are accepted by the force residual and confirmed by free runs.

    Attributes:
        fit: to the force residual, with all effects.
        rounds: for each round its candidates, the best first, and the effects found before.
        rivals: of the first effect.
    """

    fits: ForceFits
    fit: Fit
    rounds: tuple[LaterRound, ...]
    rivals: tuple[Ranked, ...]

    @property
    def run(self) -> Fit:
        """``ForceFits.run`` of ``fit``."""
        return self.fits.run(self.fit)

    @property
    def explained(self) -> float:
        """Share of the squared free-run error that the effects remove."""
        return evidence_of_blocks(self.fits.run(self.fits.plain), self.run).share


def selected_by_force(search: Search, base: Fit) -> ForceSelection | Fact | None:
    """Forward selection by the force residual, confirmed by free runs; None if no effect is accepted.

    Where the force residual accepts effects and free runs confirm none, the fact that says so.

    Args:
        base: the refit of the declared structure by free runs.
    """
    fits = ForceFits(search, base)
    fit = fits.plain
    rounds: list[LaterRound] = []
    joints: Sequence[int | None] = (search.record.joints or ()) if search.rigid else [None]
    most, report = MOST_EFFECTS * len(joints), share_display()
    for joint in joints:
        accepted = fit
        for turn in range(MOST_EFFECTS):
            with shares_to(partial(lambda done, share: report((done + share) / most), len(rounds))):
                ranked = force_round(fits, fit, joint)
            kept = (r if r.grade else r.for_table for r in ranked)
            rounds.append(LaterRound(fit.trial.parts, tuple(kept)))
            # Rivals are reported for the first effect only; another joint's effect with rivals is not accepted.
            is_tied = fit.trial.parts and not turn and _tied(search, ranked)
            # An effect that is not significant alone may be with a second one: each hides the other.
            doubtful = fit is not accepted
            if not ranked or is_tied or (ranked[0].why_not and (doubtful or not ranked[0].insignificant)):
                break
            fit = ranked[0].found
            if ranked[0].why_not:
                continue
            if doubtful and not are_significant(fits, accepted, fit):
                break
            accepted = fit
        fit = accepted
    rounds.sort(key=lambda one: not one.ranked or one.ranked[0].part not in fit.trial.parts)
    first = rounds[0].ranked
    by_force = in_determined_forms(fits, fit)
    fit = confirmed(fits, by_force)
    if not fit.trial.parts:
        return _not_confirmed(fits.plain, by_force) if by_force.trial.parts else None
    leading = [first[0]]
    if first[0].found.part in fit.trial.parts:
        again, leading = special_case(fits, *best_first_effect(fits, fit, [first[0], *_tied(search, first)]))
        fit = fit if again is fit else confirmed(fits, again)
    rounds[0] = replace(rounds[0], ranked=tuple(with_first(leading[0], first)))
    return ForceSelection(fits, fit, tuple(rounds), tuple(leading[1:]))


def _tied(search: Search, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The rivals of the best candidate of a round; candidates that are not significant only where it is not either."""
    return ties(search, [r for r in ranked if not r.why_not or ranked[0].why_not])


def are_significant(fits: ForceFits, before: Fit, fit: Fit) -> bool:
    """Whether several effects together are accepted over a fit without them, of all sets of as many candidates."""
    added = len(fit.trial.parts) - len(before.trial.parts)
    shown, _ = shown_on_blocks(fits, before, fit)
    chance = comb(hypotheses(fits.parts), added) * random_signs(shown.t)
    return shown.share >= acceptance.LEAST_SHARE and chance <= acceptance.ALPHA


def force_round(fits: ForceFits, plain: Fit, joint: int | None) -> list[Ranked]:
    """Add to a fit each of the candidates with the best starts (see ``FITTED``), and rank these: accepted ones first.

    ``joint``: of an arm that is simulated joint by joint, the joint of the candidates; else None. Of several forms of
    one effect, the simplest that fits as well and is accepted is kept, if any is.
    """
    taken = {p.key for p in plain.trial.parts}
    parts = [p for p in fits.candidates.parts if p.key not in taken and joint_of(fits.search, p) == joint]
    of_runs = share_of_runs(len(fits.search.record.start))
    count = hypotheses(parts)
    ranked = judged_in_addition(fits, plain, parts, count, of_level=1 - of_runs)
    ranked = [shown_by_runs(fits, plain, r, count, of_runs) if r.insignificant else r for r in ranked]
    return sorted(in_simplest_admitted_forms(ranked), key=lambda r: (-r.grade, r.found.cost))


def share_of_runs(segments: int) -> float:
    """Share of α for free runs in a round, B/(B + ``SIGN_BLOCKS``), B their blocks; the rest is the force residual's.

    Either of the two criteria may accept a candidate. Their p-values depend on each other in an unknown way (with α for
    each, normal scores with a correlation of 0.8 accept one of 20 candidates without an effect with a probability of
    1.7 α), so they share it (weighted Bonferroni). A sign test on B blocks gives at least Φ(−√B): free runs in few
    segments can hardly pass, and with half of α for them the other criterion would lose it for nothing. B is known
    before the test.
    """
    blocks = min(acceptance.SIGN_BLOCKS, segments)
    return blocks / (blocks + acceptance.SIGN_BLOCKS)


def judged_in_addition(
    fits: ForceFits,
    plain: Fit,
    parts: Sequence[Part],
    candidates: int,
    everywhere: bool = False,
    of_level: float = 1.0,
) -> list[Ranked]:
    """Those of the parts with the best starts (see ``FITTED``) that are possible, each added to a fit and judged.

    ``candidates``, ``everywhere``, ``of_level``: as of ``judged``.
    """
    start = ForceStart(fits.search.problem, plain, True, known=fits.by_links)
    trials = [plain.trial.with_part(p) for p in parts]
    starts = [start.best(trial, fits.candidates.covered(p)) for p, trial in zip(parts, trials, strict=True)]
    started = [(*s, trial) for s, trial in zip(starts, trials, strict=True) if s is not None]
    shares = [drive_kept(fits, plain, trial, theta) for _, theta, trial in started]
    begun = [(*one, share) for one, share in zip(started, shares, strict=True) if share > 0]  # else nothing is left
    begun.sort(key=lambda one: one[0] / one[3] ** 2)
    chosen = [one for rank, one in enumerate(begun) if rank < FITTED or one[3] < 1 - acceptance.LEAST_SHARE]
    found, report = list[Fit](), share_display()
    for _, theta, trial, _ in chosen:
        report(len(found) / len(chosen))
        found.append(fits.fit(trial, theta))
    return [judged(fits, plain, f, candidates, everywhere, of_level) for f in found if is_possible(fits.search, f)]


def shown_by_runs(fits: ForceFits, plain: Fit, one: Ranked, candidates: int, of_level: float) -> Ranked:
    """The candidate, accepted if free runs with these values of it are better by more than chance over all of them.

    The force residual must then confirm it (p ≤ ``acceptance.TIE_LEVEL``): elsewhere the force residual selects and
    free runs confirm, here the reverse. The values are those of the force residual, since free runs of a model that
    lacks other forces too may choose values with which that residual does not fall.
    """
    if random_signs(one.evidence.t) > acceptance.TIE_LEVEL:
        return one
    joint = joint_of_difference(fits.search, plain, one.found)
    shown = evidence_of_blocks(fits.run(plain, joint), fits.run(one.found, joint))
    p = min(1.0, candidates * random_signs(shown.t) / of_level)
    if shown.share < acceptance.LEAST_SHARE or p > acceptance.ALPHA:
        return one
    return replace(one, why_not="", insignificant=False, p=p)


def drive_kept(fits: ForceFits, plain: Fit, trial: Trial, theta: Array) -> float:
    """Share of a fit's drive force that remains with these values of a trial; the least over coordinates."""
    problem = fits.search.problem
    return float(np.min(drive_shares(model_of(trial, theta), plain.model, problem.motion, problem.used)))


def judged(
    fits: ForceFits, plain: Fit, found: Fit, candidates: int, everywhere: bool = False, of_level: float = 1.0
) -> Ranked:
    """A candidate with its evidence from the force residual over a fit without it, and the reason if not accepted.

    An effect that reduces the drive force reduces the residual in proportion, so only a larger reduction counts. The
    residual is already divided by a constant factor on the drive, as by friction in proportion to it
    (``residual_at_drive``). The share removed on held-out blocks is at most that of the fit to all blocks, since the
    correction of the fit for a held-out block is linear.

    Args:
        candidates: number of those among which it was chosen.
        everywhere: whether the evidence is over all joints of an arm, not at the joint of the effect alone.
        of_level: share of α that this criterion has.
    """
    least = least_share(fits.search, plain.trial.parts, found.part)
    one, ratio = shown_on_blocks(fits, plain, found, everywhere)
    problem = fits.search.problem
    scales = drive_left(found.model, problem.motion) / drive_left(plain.model, problem.motion)
    acting = min(1.0, float(np.min(drive_shares(found.model, plain.model, problem.motion, problem.used) / scales)))
    p = min(1.0, candidates * random_signs(one.t) / of_level)
    why_not, insignificant = "", False
    share = min(one.share, 1 - ratio**2)
    if 1 - share > (1 - least) * acting**2:
        why_not = f"removes {in_percent(share)} of the squared residual force on held-out parts"
        why_not += f" and leaves {in_percent(acting)} of the drive force" if acting < 0.99 else ""
    elif not matters(fits.search, found, plain):
        why_not = "is too small to matter"
    elif form := corrects_a_form(ForceCriterion(fits.search, plain), ForceCriterion(fits.search, found)):
        why_not = form
    elif p > acceptance.ALPHA:
        why_not, insignificant = f"may be chance: {chance_in_words(p, candidates)}", True
    return Ranked(found, one, ratio, relative_size(fits.search, found, plain), why_not, insignificant, p)


def in_determined_forms(fits: ForceFits, fit: Fit) -> Fit:
    """The fit with a simpler form of each effect whose interval includes zero in a form with more parameters."""
    parts = fit.trial.parts
    named = named_effects(parts, estimate(fit), fit.model)
    for k, (part, found) in enumerate(zip(parts, named, strict=True)):
        simpler = [form for form in CATALOGUE[part.kind].forms if {p.name for p in form.parameters} < set(part.names)]
        form = determined_form(part, found.intervals)
        if form is None and simpler and objections(found, part, fits.search.problem, fit.model):
            form = simpler[-1]
        if form is not None:
            simpler_part = part_of(form, part.place, fit.trial.system)
            kept = {name: fit.values[1][k][name] for name in simpler_part.names}
            return in_determined_forms(fits, fits.replaced(fit, {k: (simpler_part, kept)}))
    return fit


def best_first_effect(fits: ForceFits, fit: Fit, leading: Sequence[Ranked]) -> tuple[Fit, list[Ranked]]:
    """Repeat the choice between tied first effects with the later effects in the model.

    Without the later effects, their residual may have hidden the difference between the first ones. A rival that is
    itself a later effect is none any more: in place of the first it would be in the model twice.

    Args:
        leading: the best candidate of the first round and its rivals.

    Returns:
        The best fit, and its first effect followed by those that still tie with it.
    """
    _, *later = fit.trial.parts
    taken = {p.key for p in later}
    leading = [one for one in leading if one.part.key not in taken]
    if len(leading) < 2:
        return fit, list(leading)
    fitted = [(fit, leading[0])]
    fitted += [(fits.with_first_effect(one.found, fit) if later else one.found, one) for one in leading[1:]]
    if later:
        fitted.sort(key=lambda pair: pair[0].cost)
        best, _ = fitted[0]
        shown = ((shown_on_blocks(fits, other, best)[0], other, one) for other, one in fitted[1:])
        tied = ((f, r) for e, f, r in shown if random_signs(e.t) > acceptance.TIE_LEVEL or fits.nearly_alike(f, best))
        fitted = [fitted[0], *tied]
    best, leader = fitted[0]
    for other, one in fitted[1:]:
        if _acts_in_better_time(fits, other, best):
            best, leader = other, one
    rivals = ((f, r) for f, r in fitted if r is not leader)
    return best, [leader, *(r for f, r in rivals if not _acts_in_better_time(fits, best, f))]


def _acts_in_better_time(fits: ForceFits, one: Fit, other: Fit) -> bool:
    """Whether two fits differ by laws of how late an input acts, and the force residual prefers the first."""
    if not differ_in_time(one, other):
        return False
    a, b = (ForceCriterion(fits.search, fit) for fit in (one, other))
    return force_prefers(a, b, most_left(fits.base))


def special_case(fits: ForceFits, fit: Fit, leading: Sequence[Ranked]) -> tuple[Fit, list[Ranked]]:
    """A tied special case of the leading first effect in its place, if held-out blocks do not prefer that.

    A special case is a limiting case (``Effect.limit``) with fewer parameters, seen over the same variable. Cogging
    with a period of one turn, for example, is gravity on an unbalanced mass with one parameter too many: the two are
    nested models, not rivals.

    Args:
        leading: the first effect of ``fit``, and the rivals that tie with it.

    Returns:
        As of ``best_first_effect``; a special case replaces the leader.
    """
    leader, *rivals = leading
    for one in rivals:
        if _is_special_case(one.part, fit):
            special = fits.with_first_effect(one.found, fit)
            if random_signs(shown_on_blocks(fits, special, fit)[0].t) > acceptance.TIE_LEVEL:
                return special, [one, *(other for other in rivals if other is not one)]
    return fit, [leader, *rivals]


def _is_special_case(part: Part, fit: Fit) -> bool:
    """Whether an effect is a limiting case, with fewer parameters, of the first effect of a fit."""
    first, values = fit.trial.parts[0], fit.values[1][0]
    limit = first.effect.limit(fit.trial.system, first.place, values)
    if limit is None or limit[0] not in kinds_of(part.kind) or part.on != first.on:
        return False
    return part.effect.seen_over == first.effect.seen_over and len(part.names) < len(first.names)


def confirmed(fits: ForceFits, fit: Fit) -> Fit:
    """The fit without effects whose removal does not make free runs significantly worse.

    Nor is an effect confirmed that only attenuates the noise of the logged inputs.
    """

    def doubt(fit: Fit, k: int) -> float:
        other = fits.without(fit, k)
        joint = joint_of_difference(fits.search, fit, other)
        pair = fits.run(other, joint), fits.run(fit, joint)
        return 1.0 if only_attenuates_noise(fits.search, *pair) else random_signs(evidence_of_blocks(*pair).t)

    def needless(fit: Fit) -> int | None:
        doubts = [doubt(fit, k) for k in range(len(fit.trial.parts))]
        k = int(np.argmax(doubts)) if doubts else None
        return None if k is None or doubts[k] <= acceptance.TIE_LEVEL else k

    return fits.eliminated(fit, needless)


def shown_on_blocks(fits: ForceFits, before: Fit, after: Fit, everywhere: bool = False) -> tuple[Evidence, float]:
    """Evidence on held-out blocks for the second fit, where the effects differ; and its RMS over that of the first.

    With ``everywhere`` the evidence is over all joints.
    """
    without, with_it = (before, after) if everywhere else fits.where_they_differ(before, after)
    ratio = float(np.sqrt(with_it.by_segment.sum() / without.by_segment.sum()))
    return evidence_of(without, with_it, floored=False), ratio


def evidence_of_blocks(before: Fit, after: Fit) -> Evidence:
    """Evidence for the second fit from the residuals of both fits, without a correction for held-out blocks."""
    return evidence(segment_losses(before.residual), segment_losses(after.residual), before.residual.shape[1])


def _not_confirmed(plain: Fit, fit: Fit) -> Fact | None:
    """The fact on effects that the force residual accepts and free runs do not confirm.

    None if they explain nothing in their simplest forms: a curve over speed may imitate another missing force.
    """
    share = evidence_of_blocks(plain, fit).share
    if share < acceptance.LEAST_SHARE:
        return None
    named = named_effects(fit.trial.parts, estimate(fit), fit.model)
    effects = " and ".join(
        f"{e.title} ({', '.join(f'{k} = {v:.3g} {e.units[k]}' for k, v in e.parameters.items())})" for e in named
    )
    return Fact.worded("not accepted", "not confirmed", named=effects, share=in_percent(share, 3))

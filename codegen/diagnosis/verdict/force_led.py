"""Forward selection of effects by the force residual, for logs that free runs do not follow.

A free run integrates everything that the model lacks. Its error may be dominated by something that is not an effect,
such as jitter of the time stamps or a drift, and then no effect is credited by free runs. The force residual at one
time does not depend on earlier times. Candidates are fitted to it by nonlinear least squares and judged on held-out
blocks. Free runs must then confirm them: with the values of effects found this way, and with levels, toleranced values
and start states that suit them best.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.base.significant import in_percent
from codegen.diagnosis.evidence.estimate import estimate
from codegen.diagnosis.evidence.reservations import objections
from codegen.diagnosis.fit import credit
from codegen.diagnosis.fit.credit import SIGNED, Evidence, evidence, evidence_of, random_signs
from codegen.diagnosis.fit.output_error import (
    Fit,
    damped_step,
    polish,
    segment_cost,
    segment_losses,
    segment_weights,
    shooting_fit,
)
from codegen.diagnosis.fit.residual import (
    Problem,
    drive_gain,
    drive_left,
    drive_shares,
    drive_symbols,
    residual_at_drive,
)
from codegen.diagnosis.fit.search import ROUNDS, Search
from codegen.diagnosis.fit.starting_values import STEP, ForceStart
from codegen.diagnosis.fit.trial import Part, Trial, model_of, part_of
from codegen.diagnosis.results import ErrorFigures, Fact, Verdict
from codegen.diagnosis.selection.candidate_fits import CandidateFits, every_part
from codegen.diagnosis.selection.forward_selection import MOST_EFFECTS, LaterRound, Outcome
from codegen.diagnosis.selection.ranking import CLOSE, Ranked, in_simplest_admitted_forms, led_by, ties
from codegen.diagnosis.selection.refusals import is_possible, matters, relative_size
from codegen.diagnosis.selection.significance import hypotheses
from codegen.diagnosis.verdict.adoption import adopt_values
from codegen.diagnosis.verdict.answer import Answer
from codegen.diagnosis.verdict.conclusion import named_effects
from codegen.diagnosis.verdict.examination import with_estimate
from codegen.diagnosis.verdict.held_out import HeldOut, in_words
from codegen.diagnosis.verdict.wrong_values import better_values
from codegen.effects import CATALOGUE
from codegen.mechanics.system import System

LEVEL = 10.0
"""RMS to which the residual of the model without effects is scaled.

It is far above 1, where the loss of a block is logarithmic, so each block counts by the ratio of its residuals."""
FITTED = 8
"""Number of candidates that are fitted: those with the least residual after linear least squares from their start, over
the square of the drive force that they leave. Candidates that start with much less drive force are fitted in addition:
such a start makes every force small, and says little of what their fit will leave."""
ELSEWHERE = 0.2
"""Least share of the remaining squared residual that a further effect must remove, if it depends on another variable
than those found. If it depends on the same variable it may only correct a misfit of their form, and must remove
``credit.FURTHER``."""
FIXED = 1e-9
"""Prior deviation, in sizes of a parameter, of the values of effects in free runs in which they stay."""
STEPS, DAMPED = 5, 4
"""Most Gauss–Newton steps, and most attempts at one step with increasing damping."""


@dataclass(frozen=True, eq=False)
class ForceFits:
    """Fits of models to the low-passed force residual, with the log in ``SIGNED`` blocks in place of segments.

    Attributes:
        search: gives the prior of parameters with a tolerance. problem: the declared system on the log's motion.
        base: the refit by free runs, which gives the start states.
    """

    search: Search
    problem: Problem
    base: Fit

    @cached_property
    def _rows(self) -> list[NDArray[np.int_]]:
        """Samples used, for each coordinate: away from standstill, two in each period of the cutoff."""
        motion = self.problem.motion
        every = max(1, round(1 / (2 * motion.cutoff_hz * motion.sample_time)))
        return [np.flatnonzero(used)[::every] for used in self.problem.used.T]

    @cached_property
    def _sizes(self) -> list[float]:
        """Scale of the residual, for each coordinate: that of the model without effects becomes ``LEVEL``."""
        residual = self._forces(self.search.declared_trial, self.adopted)
        sizes = [
            float(np.sqrt(np.mean(r[k] ** 2))) if len(k) else 1.0 for r, k in zip(residual.T, self._rows, strict=True)
        ]
        return [max(size, 1e-300) / LEVEL for size in sizes]

    @cached_property
    def candidates(self) -> CandidateFits:
        """All candidates: every effect at every place, with the range of its variable that the log covers."""
        return CandidateFits(self.search, self.base, tuple(every_part(self.search, ())), lambda share: None)

    @cached_property
    def adopted(self) -> Array:
        """Values (p,) of levels and toleranced parameters that free runs and force residual together choose."""
        values = adopt_values(self.search, self.base, self.problem, self.search.system)
        return np.array(values.values, dtype=float)

    @cached_property
    def plain(self) -> Fit:
        """The fit of the model without effects."""
        return self.fit(self.search.declared_trial, self.adopted)

    def nearly_alike(self, one: Fit, best: Fit) -> bool:
        """Whether both what two fits leave of the squared residual and what they remove differ by little.

        A log is long enough to show any difference between two models that are both a little wrong. It then does not
        tell which effect acts, but which one also imitates part of what neither describes.
        """
        plain, less, most = (float(fit.by_segment.sum()) for fit in (self.plain, one, best))
        return less <= CLOSE * most and plain - most <= CLOSE * (plain - less)

    def _forces(self, trial: Trial, theta: Array) -> Array:
        """Residual over the drive force that the values leave: a weaker drive makes every force smaller."""
        model, motion = model_of(trial, theta), self.problem.motion
        forces = residual_at_drive(model, motion)
        return forces / drive_gain(model, self.problem.system, motion) if self._moves_drive else forces

    @cached_property
    def _moves_drive(self) -> bool:
        """Whether a refitted parameter scales the drive force."""
        return not drive_symbols(self.problem.system).isdisjoint(self.search.moved)

    def _residual(self, trial: Trial, theta: Array) -> Array:
        """Scaled residuals of each block, (SIGNED, K); shorter blocks are padded with zeros."""
        forces, count = self._forces(trial, theta), len(self.problem.motion.time)
        blocks: list[list[Array]] = [[] for _ in range(SIGNED)]
        for values, rows, size in zip(forces.T, self._rows, self._sizes, strict=True):
            edges = np.searchsorted(rows, np.linspace(0, count, SIGNED + 1)[1:-1])
            for block, part in zip(blocks, np.split(values[rows] / size, edges), strict=True):
                block.append(part)
        joined = [np.concatenate(block) for block in blocks]
        longest = max(map(len, joined))
        return np.array([np.pad(block, (0, longest - len(block))) for block in joined])

    def fit(self, trial: Trial, theta: Array) -> Fit:
        """The fit from these values, by damped Gauss–Newton steps."""
        runner = self.search.runners([trial])[0]
        prior = self.search.prior(trial, theta)
        first, damping = theta, 1e-6
        now = self._residual(trial, theta)
        slopes = self._slopes(trial, theta, now, prior.size)
        for _ in range(STEPS):
            weighted = slopes * segment_weights(now)[:, None]
            matrix = np.einsum("ask,bsk->ab", weighted, slopes) + np.diag(prior.precision)
            right = np.einsum("ask,sk->a", weighted, now) - prior.precision * (theta - prior.centre)
            cost = segment_cost(now) + prior.cost(theta)
            for _ in range(DAMPED):
                step = damped_step(matrix, right, damping)
                moved = prior.clip(np.clip(theta + step, first - prior.reach, first + prior.reach))
                then = self._residual(trial, moved)
                new = segment_cost(then) + prior.cost(moved)  # NaN where it is not finite
                if new < cost:
                    break
                damping = max(damping, 1e-4) * 10
            else:
                break
            theta, now, damping = moved, then, max(damping / 10, 1e-6)
            slopes = self._slopes(trial, theta, now, prior.size, slopes)
            if cost - new < 1e-2 + 1e-4 * cost:
                break
        at = self.base.offsets, now, now, slopes, self.base.starts
        return Fit(runner, theta, *at, prior, prior.limited(theta, theta))

    def _slopes(self, trial: Trial, theta: Array, now: Array, size: Array, before: Array | None = None) -> Array:
        """Derivatives of the predicted force by each parameter, (p, SIGNED, K).

        Forces are linear in the refitted levels and parameters, so their derivatives are taken from ``before``; over a
        drive force that these change, they are not.
        """
        slopes = [] if before is None or self._moves_drive else list(before[: len(trial.moved)])
        for k in range(len(slopes), len(theta)):
            step, moved = STEP * float(size[k]), theta.copy()
            moved[k] += step
            slopes.append((now - self._residual(trial, moved)) / step)
        return np.array(slopes)

    def without(self, fit: Fit, index: int) -> Fit:
        """The fit with one of its effects removed."""
        return self.fit(*fit.trial.without(fit.theta, index))

    def run(self, fit: Fit) -> Fit:
        """Free runs with the effects of a fit as they are, and levels, toleranced values and start states fitted.

        A level or a mass of the force residual may put free runs far off, whatever effects they have.
        """
        prior, effects = self.search.prior(fit.trial, fit.theta), slice(len(fit.trial.moved), None)
        precision, centre = prior.precision.copy(), prior.centre.copy()
        precision[effects], centre[effects] = (FIXED * prior.size[effects]) ** -2.0, fit.theta[effects]
        held = replace(prior, precision=precision, centre=centre)
        rough = shooting_fit(fit.runner, fit.theta, self.search.record.at_rest, held, ROUNDS, final_slopes=False)
        return replace(polish(rough, ROUNDS), prior=prior)


@dataclass(frozen=True, eq=False)
class ForceSelection:
    """Effects that are credited by the force residual and confirmed by free runs.

    Attributes:
        fit: to the force residual, with all of them. run: ``ForceFits.run`` of ``fit``.
        explained: share of the squared free-run error that they remove.
        rounds: for each round its candidates, the best first, and the effects found before. rivals: of the first
            effect.
    """

    fits: ForceFits
    fit: Fit
    run: Fit
    explained: float
    rounds: tuple[LaterRound, ...]
    rivals: tuple[Ranked, ...]

    @property
    def parts(self) -> tuple[Part, ...]:
        return self.fit.trial.parts


def credited_by_force(
    search: Search,
    outcome: Outcome,
    problem: Problem,
    answer: Answer,
    measured: Callable[[System], ErrorFigures],
    report_progress: Callable[[float], None],
    held_out: HeldOut | None = None,
    steady: bool = False,
) -> tuple[Answer, Outcome]:
    """The answer with effects that the force residual credits and free runs confirm; unchanged if there are none.

    The values and intervals of the effects are those of the fit to the force residual. The effects are examined as
    others are: by their intervals, by a smooth curve over their own variable, and by held-out data, which may refuse
    some of those that tie (``told_by_held_out``). They are not credited where wrong values of the spec's own parameters
    explain the free runs better. Effects that free runs credited are replaced only if ``against_free_runs`` gives a
    reason.

    Args:
        outcome: of the selection by free runs. answer: the answer from that outcome.
        problem: the declared system on the log's motion.
        held_out: data that no fit has seen; None where they tell no candidates apart.
        steady: whether the log runs at constant speed, at which parameters keep their tolerances.
    """
    doubtful: list[Fact] = []
    found = selected_by_force(search, outcome.base, problem, report_progress, doubtful.append)
    if found is None:
        said = doubtful if answer.verdict == "unknown" else []
        return replace(answer, remarks=(*answer.remarks, *said)), outcome
    refused: tuple[Fact, ...] = ()
    if held_out is not None:
        found, refused = told_by_held_out(found, held_out)
    alone = "alone no effect would be credited"
    if answer.verdict != "unknown":
        against = against_free_runs(found, outcome.final)
        if not against:
            return answer, outcome
        alone = f"alone {' and '.join(e.kind for e in answer.effects)} would be named, {against}"
    led = replace(
        outcome,
        final=found.run,
        first=_with_first(outcome.first, found.rounds[0].ranked),
        later=found.rounds[1:],
        rivals=found.rivals,
        explained=found.explained,
        unexplained=False,
    )
    verdict: Verdict = "ambiguous" if found.rivals else "effect"
    plain = replace(answer, verdict=verdict, effects=(), augmented=answer.refit, against=())
    plain = replace(plain, figures=(*answer.figures[:2], answer.figures[1]))
    second = with_estimate(search, led, problem, plain, measured, found.fit)
    if second.verdict != plain.verdict:
        return answer, outcome
    better = "" if steady else better_values(search, led)
    if better:
        named = " and ".join(f"{e.kind} on {e.on}" for e in second.effects)
        words = f"The residual force alone would name {named}, but in simulation {better} the training log better"
        return replace(answer, remarks=(*answer.remarks, Fact("not credited", words))), outcome
    words = (
        f"The residual force shows it; simulations of the training log with these values confirm it. By them {alone}"
    )
    return replace(second, remarks=(*second.remarks, Fact("evidence", words), *refused)), led


def told_by_held_out(found: ForceSelection, held_out: HeldOut) -> tuple[ForceSelection, tuple[Fact, ...]]:
    """The selection without those of its tied first effects that held-out data refuse, and what is said of them.

    Of a machine that moves about one place, a spring and a constant force are nearly one motion; about another place
    they are two. Where the leading effect is refused, the best of those that are left takes its place, if free runs
    confirm the fit with it. Unchanged where none of them is refused, or each of them.
    """
    fits, first = found.fits, found.rounds[0]
    leading = [first.ranked[0], *found.rivals]
    if not found.rivals or leading[0].found.part != found.parts[0]:
        return found, ()
    tied = [found.fit, *(with_first(fits, found.fit, one) for one in found.rivals)]
    refused = held_out.refused(tied)
    kept = [k for k in range(len(tied)) if k not in refused]
    if not refused or not kept:
        return found, ()
    led = replace(found, rivals=tuple(leading[k] for k in kept[1:]))
    if kept[0]:
        fit = tied[kept[0]]
        run = fits.run(fit)
        if confirmed(fits, fit, run)[0] is not fit:
            return found, ()
        ranked = tuple(led_by(leading[kept[0]], first.ranked))
        explained = _evidence_of_blocks(fits.run(fits.plain), run).share
        rounds = (replace(first, ranked=ranked), *found.rounds[1:])
        led = replace(led, fit=fit, run=run, explained=explained, rounds=rounds)
    return led, in_words(tied, refused)


def with_first(fits: ForceFits, fit: Fit, one: Ranked) -> Fit:
    """The fit with another candidate in place of its first effect."""
    _, *later = fit.trial.parts
    moved, (_, *values) = fit.values
    trial = replace(fit.trial, parts=(one.found.part, *later))
    return fits.fit(trial, trial.theta(moved, [one.found.parameters, *values]))


def against_free_runs(found: ForceSelection, by_runs: Fit) -> str:
    """The objection of the force residual to the effects that free runs credit, in words; empty if there is none.

    Backlash is exempt, since no log shows where the load is within the gap.
    """
    trial, fits = by_runs.trial, found.fits
    known, own = _forms(trial.parts), _forms(found.parts)
    larger = [f"{' and '.join(sorted(known[p] - own[p]))} of {p[0]}" for p in known if p in own and known[p] > own[p]]
    if (known.keys() == own.keys() and not larger) or any(t.gap != 0 for t in trial.changed.transmissions):
        return ""
    needed = _needed(fits, fits.fit(trial, by_runs.theta))
    gained = _evidence_of_blocks(needed, found.fit)
    not_needed = sorted(kind for kind, _ in known.keys() - _forms(needed.trial.parts).keys())
    if (not_needed or larger) and random_signs(-gained.t) > credit.TIE_LEVEL:
        return f"but the residual force shows no {' and '.join(not_needed or larger)}"
    leaves_more = random_signs(gained.t) <= credit.TIE_LEVEL and not fits.nearly_alike(needed, found.fit)
    return "which leaves more of the residual force" if leaves_more else ""


def _forms(parts: Sequence[Part]) -> dict[tuple[str, str], frozenset[str]]:
    """(kind, on) → names of the parameters of its form."""
    return {(p.kind, p.on): frozenset(p.names) for p in parts}


def _needed(fits: ForceFits, fit: Fit) -> Fit:
    """The fit to the force residual, without effects that do not significantly remove at least ``ELSEWHERE`` of it."""
    while len(fit.trial.parts) > 1:
        others = [fits.without(fit, k) for k in range(len(fit.trial.parts))]
        shown = [_evidence_of_blocks(other, fit) for other in others]
        k = min(range(len(shown)), key=lambda k: shown[k].share)
        if shown[k].share >= ELSEWHERE and random_signs(shown[k].t) <= credit.TIE_LEVEL:
            break
        fit = others[k]
    return fit


def _with_first(first: Sequence[Ranked], named: Sequence[Ranked]) -> tuple[Ranked, ...]:
    """The table of candidates, with ``named`` in place of its entries for the same effects."""
    known = {(r.found.part.kind, r.found.part.on, r.found.part.names) for r in named}
    others = [r for r in first if (r.found.part.kind, r.found.part.on, r.found.part.names) not in known]
    return (*named, *others)


def selected_by_force(
    search: Search,
    base: Fit,
    problem: Problem,
    report_progress: Callable[[float], None],
    tell: Callable[[Fact], None] = lambda fact: None,
) -> ForceSelection | None:
    """Forward selection by the force residual, confirmed by free runs; None where no effect is credited.

    Args:
        base: the refit of the declared structure by free runs. problem: the declared system on the log's motion.
        tell: called with a fact on the effects that the force residual credits, where free runs confirm none.
    """
    fits = ForceFits(search, problem, base)
    fit = plain = fits.plain
    rounds: list[LaterRound] = []
    for turn in range(MOST_EFFECTS):
        progress = partial(lambda turn, share: report_progress((turn + share) / MOST_EFFECTS), turn)
        ranked = force_round(fits, fit, progress)
        rounds.append(LaterRound(fit.trial.parts, tuple(ranked)))
        if not ranked or ranked[0].why_not:
            break
        fit = ranked[0].found
    first = rounds[0].ranked
    fit = in_determined_forms(fits, fit)
    before = fits.run(plain)
    by_force = fit
    fit, run = confirmed(fits, fit, fits.run(fit))
    if not fit.trial.parts:
        if by_force.trial.parts:
            tell(_not_confirmed(plain, by_force))
        return None
    leading = [first[0]]
    if first[0].found.part in fit.trial.parts:
        again, leading = best_first_effect(fits, fit, [first[0], *ties(search, first)])
        fit, run = (fit, run) if again is fit else confirmed(fits, again, fits.run(again))
    rounds[0] = replace(rounds[0], ranked=tuple(led_by(leading[0], first)))
    return ForceSelection(fits, fit, run, _evidence_of_blocks(before, run).share, tuple(rounds), tuple(leading[1:]))


def _not_confirmed(plain: Fit, fit: Fit) -> Fact:
    """What the force residual credits and free runs do not confirm."""
    named = named_effects(fit.trial.parts, estimate(fit), fit.model)
    effects = " and ".join(
        f"{e.kind} on {e.on} ({', '.join(f'{k} = {v:.3g} {e.units[k]}' for k, v in e.parameters.items())})"
        for e in named
    )
    share = _evidence_of_blocks(plain, fit).share
    return Fact(
        "not credited",
        f"The residual force alone would name {effects}, which removes {in_percent(share, 3)} of its square. "
        "Simulations of the training log do not confirm it",
    )


def in_determined_forms(fits: ForceFits, fit: Fit) -> Fit:
    """The fit with a simpler form of each effect whose interval includes zero in a form with more parameters.

    If a form has more parameters than the log determines, all of them become uncertain, also the size of the effect.
    """
    trial, (moved, values) = fit.trial, fit.values
    named = named_effects(trial.parts, estimate(fit), fit.model)
    for k, (part, found) in enumerate(zip(trial.parts, named, strict=True)):
        simpler = [form for form in CATALOGUE[part.kind].forms if {p.name for p in form.parameters} < set(part.names)]
        if not simpler or not objections(found, part, fits.problem):
            continue
        parts = [part_of(simpler[-1], p.place, trial.system) if p is part else p for p in trial.parts]
        kept = {name: values[k][name] for name in parts[k].names}
        other = replace(trial, parts=tuple(parts))
        return in_determined_forms(fits, fits.fit(other, other.theta(moved, [*values[:k], kept, *values[k + 1 :]])))
    return fit


def best_first_effect(fits: ForceFits, fit: Fit, leading: Sequence[Ranked]) -> tuple[Fit, list[Ranked]]:
    """Repeat the choice between tied first effects with the later effects in the model: the best fit, and what ties.

    Without the later effects, the residual that these explain may have hidden the difference between the first ones.

    Args:
        leading: the best candidate of the first round and its rivals.

    Returns:
        The fit with the best of them; the best, followed by those that still tie with it.
    """
    _, *later = fit.trial.parts
    if len(leading) < 2 or not later:
        return fit, list(leading)
    fitted = [(fit, leading[0]), *((with_first(fits, fit, one), one) for one in leading[1:])]
    fitted.sort(key=lambda pair: pair[0].cost)
    best, leader = fitted[0]
    shown = ((evidence_of(other, best, floored=False), other, one) for other, one in fitted[1:])
    tied = (one for e, fit, one in shown if random_signs(e.t) > credit.TIE_LEVEL or fits.nearly_alike(fit, best))
    return best, [leader, *tied]


def confirmed(fits: ForceFits, fit: Fit, run: Fit) -> tuple[Fit, Fit]:
    """The fit and its free runs, without the effects whose removal does not make free runs significantly worse.

    Levels and toleranced values are nuisance parameters here: both sides of a comparison have those that suit them.
    """
    while parts := fit.trial.parts:
        others = [fits.without(fit, k) for k in range(len(parts))]
        runs = [fits.run(other) for other in others]
        shown = [_evidence_of_blocks(one, run) for one in runs]
        doubt = [random_signs(one.t) for one in shown]
        k = int(np.argmax(doubt))
        if doubt[k] <= credit.TIE_LEVEL:
            break
        fit, run = others[k], runs[k]
    return fit, run


def _evidence_of_blocks(before: Fit, after: Fit) -> Evidence:
    """Evidence for the second fit from the residuals of both as they are, without a correction for held-out blocks."""
    return evidence(segment_losses(before.residual), segment_losses(after.residual), before.residual.shape[1])


def force_round(fits: ForceFits, plain: Fit, report_progress: Callable[[float], None]) -> list[Ranked]:
    """Add to a fit each of the candidates that start best (see ``FITTED``), and rank these: credited ones first.

    Of several forms of one effect, the simplest is kept that fits as well and is credited, if any is.
    """
    taken = {(p.kind, p.on) for p in plain.trial.parts}
    parts = [p for p in fits.candidates.parts if (p.kind, p.on) not in taken]
    start, trials = ForceStart(fits.problem, plain, True), [plain.trial.with_part(p) for p in parts]
    starts = [start.best(trial, fits.candidates.covered(p)) for p, trial in zip(parts, trials, strict=True)]
    started = [(*s, trial) for s, trial in zip(starts, trials, strict=True) if s is not None]
    shares = [drive_kept(fits, plain, trial, theta) for _, theta, trial in started]
    begun = [(*one, share) for one, share in zip(started, shares, strict=True) if share > 0]  # else nothing is left
    begun.sort(key=lambda one: one[0] / one[3] ** 2)
    chosen = [one for rank, one in enumerate(begun) if rank < FITTED or one[3] < 1 - credit.LEAST_SHARE]
    found: list[Fit] = []
    for _, theta, trial, _ in chosen:
        report_progress(len(found) / len(chosen))
        found.append(fit_in_addition(fits, plain, trial, theta))
    ranked = [judged(fits, plain, f, hypotheses(parts)) for f in found if is_possible(fits.search, f)]
    return sorted(in_simplest_admitted_forms(ranked), key=lambda r: (bool(r.why_not), r.found.cost))


def drive_kept(fits: ForceFits, plain: Fit, trial: Trial, theta: Array) -> float:
    """Share of a fit's drive force that is left with these values of a trial; the least over coordinates."""
    return float(np.min(drive_shares(model_of(trial, theta), plain.model, fits.problem.motion, fits.problem.used)))


def fit_in_addition(fits: ForceFits, plain: Fit, trial: Trial, theta: Array) -> Fit:
    """The fit of a trial that has one part more than a fit, from ``theta``.

    The trial contains the model without the part. So a fit that ends above it has lost its way from values that were
    too far off; it is repeated from the start at which only friction levels follow the part.
    """
    fit = fits.fit(trial, theta)
    if fit.cost <= plain.cost:
        return fit
    near = ForceStart(fits.problem, plain).best(trial, fits.candidates.covered(trial.parts[-1]))
    again = fit if near is None else fits.fit(trial, near[1])
    return again if again.cost < fit.cost else fit


def judged(fits: ForceFits, plain: Fit, found: Fit, candidates: int) -> Ranked:
    """A candidate with its evidence from the force residual over a fit without it, and the reason if not credited.

    An effect that reduces the drive force reduces the residual in proportion; only a larger reduction counts. By a
    constant factor, such as friction in proportion to the drive leaves, the residual is divided already
    (``residual_at_drive``). The share removed on held-out blocks is limited to the share that the fit to all blocks
    removes, since the correction of the fit for a held-out block is linear.
    """
    variables = {p.effect.seen_over for p in plain.trial.parts if not _has_twin_elsewhere(fits.search, p)}
    least = credit.LEAST_SHARE if not plain.trial.parts else ELSEWHERE
    least = credit.FURTHER if found.part.effect.seen_over in variables else least
    ratio = float(np.sqrt(found.by_segment.sum() / plain.by_segment.sum()))
    motion, used = fits.problem.motion, fits.problem.used
    scales = drive_left(found.model, motion) / drive_left(plain.model, motion)
    acting = min(1.0, float(np.min(drive_shares(found.model, plain.model, motion, used) / scales)))
    one = evidence_of(plain, found, floored=False)
    p = min(1.0, candidates * random_signs(one.t))
    why_not = ""
    share = min(one.share, 1 - ratio**2)
    if 1 - share > (1 - least) * acting**2:
        why_not = f"removes {in_percent(share)} of the squared residual force on held-out parts"
        why_not += f" and leaves {in_percent(acting)} of the drive force" if acting < 0.99 else ""
    elif not matters(fits.search, found, plain):
        why_not = "is too small to matter"
    elif p > credit.ALPHA:
        why_not = f"may be chance: it fits better by so little that p = {p:.2g} over all candidates"
    return Ranked(found, one, ratio, relative_size(fits.search, found, plain), why_not, False, p)


def _has_twin_elsewhere(search: Search, part: Part) -> bool:
    """Whether an effect has the same equation of motion as one that depends on another variable.

    Example: an asymmetric friction level is the same as a constant force, so viscous friction found in addition to it
    does not correct a misfit of its form.
    """
    twins = part.effect.twins(search.system, part.place)
    return any(CATALOGUE[kind].seen_over != part.effect.seen_over for kind, _ in twins)

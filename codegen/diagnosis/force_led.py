"""Forward selection by the force residual, where free runs stay far from the data.

Free runs of a real machine integrate everything that the model lacks. Their error may be led by something that is no
effect, as jitter of the stamps or a drift, and then they choose and credit nothing. The force residual of a moment
does not depend on what was before. Candidates are fitted to it by nonlinear least squares, judged on held-out blocks,
and confirmed by free runs with the values found, to which nothing is fitted then.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis import credit
from codegen.diagnosis.adoption import adopt_values
from codegen.diagnosis.answer import Answer
from codegen.diagnosis.candidate_fits import CandidateFits, Found, every_part, is_simpler_form
from codegen.diagnosis.credit import SIGNED, Evidence, evidence, held_out_losses, random_signs
from codegen.diagnosis.examination import with_estimate
from codegen.diagnosis.forward_selection import MOST_EFFECTS, LaterRound, Outcome
from codegen.diagnosis.output_error import (
    AT_END,
    Fit,
    scales,
    segment_cost,
    segment_losses,
    segment_weights,
    shooting_fit,
)
from codegen.diagnosis.ranking import Ranked, hypotheses, is_possible, matters, relative_size, ties
from codegen.diagnosis.residual import Problem, residual_at_drive
from codegen.diagnosis.results import ErrorFigures, Verdict
from codegen.diagnosis.search import Search
from codegen.diagnosis.starting_values import ForceStart
from codegen.diagnosis.trial import Part, Trial, model_of
from codegen.mechanics.system import System

Array = NDArray[np.float64]

LEVEL = 10.0
"""RMS of the base's residual in the unit of the residuals: far above 1, so that each block counts by its ratio."""
FITTED = 8
"""Candidates, by what least squares from their start leave, that are fitted."""
ELSEWHERE = 0.2
"""Least share of what is left for a further effect over another variable than those found; over the same variable it
may correct a misfit of their form, and must remove ``credit.FURTHER``."""
STEPS, DAMPED = 5, 4
"""Most Gauss–Newton steps, and most of a step that are tried with more damping."""
STEP = 1e-4
"""Step of a parameter for its slope, over its size."""


def _cost(residual: Array, theta: Array, precision: Array, centre: Array) -> float:
    return segment_cost(residual) + 0.5 * float((precision * (theta - centre) ** 2).sum())


@dataclass(frozen=True, eq=False)
class ForceFits:
    """Fits of trials to the low-passed force residual, in ``SIGNED`` blocks of the log as segments.

    Attributes:
        search: with the toleranced parameters' prior. problem: of the declared system on the log's motion.
        base: the free-run refit, which gives simulator and start states.
    """

    search: Search
    problem: Problem
    base: Fit

    @cached_property
    def _rows(self) -> list[NDArray[np.int_]]:
        """By coordinate, the samples used: away from standstill, two in a period of the cutoff."""
        motion = self.problem.motion
        every = max(1, round(1 / (2 * motion.cutoff_hz * motion.sample_time)))
        return [np.flatnonzero(used)[::every] for used in self.problem.masks.rows.T]

    @cached_property
    def _sizes(self) -> list[float]:
        """By coordinate, the unit of the residual."""
        residual = self._forces(self.search.declared_trial, self.adopted)
        sizes = [
            float(np.sqrt(np.mean(r[k] ** 2))) if len(k) else 1.0 for r, k in zip(residual.T, self._rows, strict=True)
        ]
        return [max(size, 1e-300) / LEVEL for size in sizes]

    @cached_property
    def adopted(self) -> Array:
        """(p,) refitted values that both criteria choose."""
        values = adopt_values(self.search, self.base, self.problem, self.search.system)
        return np.array(values.values, dtype=float)

    def _forces(self, trial: Trial, theta: Array) -> Array:
        return residual_at_drive(model_of(trial, theta), self.problem.motion)

    def _residual(self, trial: Trial, theta: Array) -> Array:
        """(SIGNED, K) residuals by block of the log; blocks with fewer are filled with zeros."""
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
        """The least-squares fit from these values, by Gauss–Newton steps with damping."""
        runner = self.search.runners([trial])[0]
        free = len(theta) - len(self.search.declared)
        precision = np.append(self.search.prior_precision, np.zeros(free))
        centre = np.append(self.search.declared, np.zeros(free))
        bound = np.where(precision > 0, self.search.within / np.sqrt(np.maximum(precision, 1e-300)), np.inf)
        size, reach = self.search.sizes(trial, theta)
        first, damping = theta, 1e-6
        now = self._residual(trial, theta)
        slopes = self._slopes(trial, theta, now, size)
        for _ in range(STEPS):
            weighted = slopes * segment_weights(now)[:, None]
            matrix = np.einsum("ask,bsk->ab", weighted, slopes) + np.diag(precision)
            right = np.einsum("ask,sk->a", weighted, now) - precision * (theta - centre)
            scale, cost, improved = scales(matrix), _cost(now, theta, precision, centre), False
            for _ in range(DAMPED):
                normal = matrix / np.outer(scale, scale) + damping * np.eye(len(scale))
                step = np.linalg.solve(normal, right / scale) / scale
                moved = np.clip(np.clip(theta + step, first - reach, first + reach), centre - bound, centre + bound)
                then = self._residual(trial, moved)
                improved = bool(np.isfinite(then).all()) and _cost(then, moved, precision, centre) < cost
                if improved:
                    break
                damping = max(damping, 1e-4) * 10
            if not improved:
                break
            theta, now, damping = moved, then, max(damping / 10, 1e-6)
            slopes = self._slopes(trial, theta, now, size, slopes)
            if cost - _cost(now, theta, precision, centre) < 1e-2 + 1e-4 * cost:
                break
        limited = np.abs(theta - centre) >= AT_END * bound
        at = self.base.offsets, now, now, slopes, self.base.starts
        return Fit(runner, theta, *at, precision, centre, limited, 1.0)

    def _slopes(self, trial: Trial, theta: Array, now: Array, size: Array, before: Array | None = None) -> Array:
        """(p, SIGNED, K) slopes of the prediction; those by refitted values, in which forces are linear, are kept."""
        known = [] if before is None else list(before[: len(trial.moved)])
        rest = range(len(known), len(theta))
        return np.array([*known, *(self._slope(trial, theta, k, STEP * float(size[k]), now) for k in rest)])

    def _slope(self, trial: Trial, theta: Array, k: int, step: float, now: Array) -> Array:
        moved = theta.copy()
        moved[k] += step
        return (now - self._residual(trial, moved)) / step

    def without(self, fit: Fit, index: int) -> Fit:
        """The fit with one of its effects removed."""
        trial = fit.runner.trial
        moved, found = trial.split(fit.theta)
        kept = replace(trial, parts=tuple(p for k, p in enumerate(trial.parts) if k != index))
        return self.fit(kept, kept.theta(moved, [values for k, values in enumerate(found) if k != index]))

    def run(self, fit: Fit) -> Fit:
        """Free runs with the values of a fit: only the start states are estimated."""
        count = len(fit.theta)
        return shooting_fit(
            fit.runner, fit.theta, self.search.record.at_rest, np.zeros(count), fit.theta, 0,
            self.search.sizes(fit.runner.trial, fit.theta)[0], within=self.search.within,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class ForceSelection:
    """Effects that the force residual credits and free runs confirm.

    Attributes:
        fit: to the force residual, with all of them. run: free runs with its values.
        explained: share of the squared error of free runs that they remove.
        rounds: candidates, the best first, each round with the effects found before. rivals: of the first effect.
    """

    fits: ForceFits
    fit: Fit
    run: Fit
    explained: float
    rounds: tuple[LaterRound, ...]
    rivals: tuple[Ranked, ...]

    @property
    def parts(self) -> tuple[Part, ...]:
        return self.fit.runner.trial.parts


def credited_by_force(
    search: Search,
    outcome: Outcome,
    problem: Problem,
    answer: Answer,
    measured: Callable[[System], ErrorFigures],
    report_progress: Callable[[float], None],
) -> tuple[Answer, Outcome]:
    """The answer with effects that the force residual credits and free runs confirm; as it is where there are none.

    The effects have their values and intervals from the force residual. They pass the same examination as others: their
    intervals, a smooth curve over their own variable, and held-out data. Where free runs credit other effects, these
    must also leave significantly more of the force residual on held-out blocks.

    Args:
        outcome: of the selection by free runs. answer: that to it.
        problem: of the log's motion.
    """
    found = selected_by_force(search, outcome.base, problem, report_progress)
    if found is None:
        return answer, outcome
    alone = "none is credited"
    if answer.verdict != "unknown":
        against = against_free_runs(found, outcome.final)
        if not against:
            return answer, outcome
        alone = f"{' and '.join(e.kind for e in answer.effects)} would be named, {against}"
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
    words = f"by the residual force, and free runs with the values found confirm it; by free runs alone {alone}"
    return replace(second, remarks=(*second.remarks, words)), led


def against_free_runs(found: ForceSelection, by_runs: Fit) -> str:
    """What the force residual says against the effects that free runs credit, in words; empty where it says nothing.

    It says that they leave significantly more of it, or that it does not need some of them and the others are no
    better. Nothing is asked of backlash: in the gap no log shows where the load is.
    """
    trial = by_runs.runner.trial
    known = {(p.kind, p.on) for p in trial.parts}
    if known == {(p.kind, p.on) for p in found.parts} or any(t.gap != 0 for t in trial.changed.transmissions):
        return ""
    needed = _needed(found.fits, found.fits.fit(trial, by_runs.theta))
    gained = _evidence_of_blocks(needed, found.fit)
    spare = known - {(p.kind, p.on) for p in needed.runner.trial.parts}
    if spare and random_signs(-gained.t) > credit.TIE_LEVEL:
        return f"of which the residual force does not need {' and '.join(sorted(kind for kind, _ in spare))}"
    return "which leaves more of the residual force" if random_signs(gained.t) <= credit.TIE_LEVEL else ""


def _needed(fits: ForceFits, fit: Fit) -> Fit:
    """The fit to the force residual without effects that remove no significant and sufficient share of it."""
    while len(fit.runner.trial.parts) > 1:
        others = [fits.without(fit, k) for k in range(len(fit.runner.trial.parts))]
        shown = [_evidence_of_blocks(other, fit) for other in others]
        k = min(range(len(shown)), key=lambda k: shown[k].share)
        if shown[k].share >= ELSEWHERE and random_signs(shown[k].t) <= credit.TIE_LEVEL:
            break
        fit = others[k]
    return fit


def _with_first(first: Sequence[Ranked], named: Sequence[Ranked]) -> tuple[Ranked, ...]:
    """The table of candidates with these in place of the same effects."""
    known = {(r.found.part.kind, r.found.part.on, r.found.part.names) for r in named}
    others = [r for r in first if (r.found.part.kind, r.found.part.on, r.found.part.names) not in known]
    return (*named, *others)


def selected_by_force(
    search: Search, base: Fit, problem: Problem, report_progress: Callable[[float], None]
) -> ForceSelection | None:
    """Forward selection by the force residual, confirmed by free runs; None where no effect is credited.

    Args:
        base: the refit of the declared structure by free runs. problem: of the log's motion.
    """
    fits = ForceFits(search, problem, base)
    fit = fits.fit(search.declared_trial, fits.adopted)
    run = plain = fits.run(fit)
    rounds: list[LaterRound] = []
    for turn in range(MOST_EFFECTS):
        ranked = _ranked(fits, fit, run, partial(_in_round, report_progress, turn))
        rounds.append(LaterRound(fit.runner.trial.parts, tuple(ranked)))
        if not ranked or ranked[0].why_not:
            break
        fit = ranked[0].found.fit
        run = fits.run(fit)
    fit, run = confirmed(fits, fit, run)
    if not fit.runner.trial.parts:
        return None
    first = rounds[0].ranked
    leading = [first[0]]
    if first[0].found.part in fit.runner.trial.parts:
        again, leading = first_with_others(fits, fit, [first[0], *ties(search, first)])
        fit, run = (fit, run) if again is fit else confirmed(fits, again, fits.run(again))
    rounds[0] = replace(rounds[0], ranked=(leading[0], *(r for r in first if r is not leading[0])))
    return ForceSelection(fits, fit, run, _evidence_of_blocks(plain, run).share, tuple(rounds), tuple(leading[1:]))


def _in_round(report_progress: Callable[[float], None], turn: int, share: float) -> None:
    report_progress((turn + share) / MOST_EFFECTS)


def first_with_others(fits: ForceFits, fit: Fit, leading: Sequence[Ranked]) -> tuple[Fit, list[Ranked]]:
    """The fit with the best of the tied first effects, and those that tie with it in the presence of the later ones.

    What one more effect explains may have hidden the difference between them.

    Args:
        leading: of the first round, the best and its rivals.
    """
    _, *later = fit.runner.trial.parts
    if len(leading) < 2 or not later:
        return fit, list(leading)
    moved, (_, *values) = fit.runner.trial.split(fit.theta)
    fitted = [(fit, leading[0])]
    for one in leading[1:]:
        trial = replace(fit.runner.trial, parts=(one.found.part, *later))
        fitted.append((fits.fit(trial, trial.theta(moved, [one.found.parameters, *values])), one))
    fitted.sort(key=lambda pair: pair[0].cost)
    best, kept = fitted[0][0], held_out_losses(fitted[0][0])
    count = best.residual.shape[1]
    tied = [
        one
        for other, one in fitted[1:]
        if random_signs(evidence(held_out_losses(other), kept, count).t) > credit.TIE_LEVEL
    ]
    return best, [fitted[0][1], *tied]


def confirmed(fits: ForceFits, fit: Fit, run: Fit) -> tuple[Fit, Fit]:
    """The fit, and its free runs, without effects whose removal does not make free runs significantly worse."""
    while parts := fit.runner.trial.parts:
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
    """Of what two fits leave as they are, without another step of either for held-out blocks."""
    return evidence(segment_losses(before.residual), segment_losses(after.residual), before.residual.shape[1])


def _ranked(fits: ForceFits, plain: Fit, run: Fit, report_progress: Callable[[float], None]) -> list[Ranked]:
    """Candidates in addition to a fit, the credited ones first, of these the best first.

    Args:
        run: free runs with the values of the fit.
    """
    parts = every_part(fits.search, plain.runner.trial.parts)
    tried = _fitted(fits, run, parts, report_progress)
    ranked = [judged(fits, plain, found, hypotheses(parts)) for found in tried]
    return sorted(ranked, key=lambda r: (bool(r.why_not), r.found.fit.cost))


def _fitted(fits: ForceFits, run: Fit, parts: Sequence[Part], report_progress: Callable[[float], None]) -> list[Found]:
    """The best candidates by linear least squares, fitted; of forms of one effect the simplest that is as good."""
    search = fits.search
    tried = CandidateFits(search, run, tuple(parts), report_progress)
    start = ForceStart(fits.problem, run)
    begun = [
        (start.best(trial, tried.covered(part)), trial) for part, trial in zip(tried.parts, tried.trials, strict=True)
    ]
    ordered = sorted(((s[0], k, s[1], t) for k, (s, t) in enumerate(begun) if s is not None), key=lambda one: one[:2])
    found: list[Found] = []
    for _, _, theta, trial in ordered[:FITTED]:
        report_progress(len(found) / FITTED)
        found.append(Found(trial, fits.fit(trial, theta)))
    possible = [f for f in found if is_possible(search, f)]
    return [f for f in possible if not any(is_simpler_form(other, f) for other in possible)]


def judged(fits: ForceFits, plain: Fit, found: Found, candidates: int) -> Ranked:
    """A candidate with its evidence by the force residual over a fit, and why it is not credited."""
    before_it = {p.effect.seen_over for p in plain.runner.trial.parts}
    least = credit.LEAST_SHARE if not before_it else ELSEWHERE
    least = credit.FURTHER if found.part.effect.seen_over in before_it else least
    before, after = held_out_losses(plain), held_out_losses(found.fit)
    one = evidence(before, after, plain.residual.shape[1])
    p = min(1.0, candidates * random_signs(one.t))
    why_not = ""
    if one.share < least:
        why_not = f"removes {100 * one.share:.2g} % of the squared force residual on held-out blocks"
    elif not matters(fits.search, found, plain):
        why_not = "its force is too little to matter"
    elif p > credit.ALPHA:
        why_not = f"fits better by so little that it may be chance (p = {p:.2g} over all candidates)"
    ratio = float(np.sqrt(found.fit.by_segment.sum() / plain.by_segment.sum()))
    return Ranked(found, one, after, ratio, relative_size(fits.search, found, plain), why_not, False, p)

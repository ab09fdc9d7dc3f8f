"""Adoption of values, checks of the effects found, and refusal by held-out data: from the outcome to the answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from codegen.diagnosis import credit
from codegen.diagnosis.adoption import Refit, adopt_values
from codegen.diagnosis.answer import REFIT_WORSE, Answer, Measured, Option, admitted
from codegen.diagnosis.conclusion import against_regression, force_agrees, named_effects, settled_by_free_runs
from codegen.diagnosis.estimate import estimate
from codegen.diagnosis.forward_selection import Outcome
from codegen.diagnosis.output_error import Fit, at_limit
from codegen.diagnosis.ranking import credible
from codegen.diagnosis.reservations import objections, remarks
from codegen.diagnosis.residual import Problem, drive_left
from codegen.diagnosis.results import ErrorFigures, FoundEffect, Verdict
from codegen.diagnosis.search import Search
from codegen.diagnosis.separation import without_leader
from codegen.diagnosis.trial import model_of, part_of, with_effects, with_values
from codegen.effects import CATALOGUE
from codegen.mechanics.system import System


def examine(
    search: Search, final_search: Search, outcome: Outcome, problem: Problem, verdict: Verdict, measured: Measured
) -> tuple[Answer, Outcome]:
    """Adopt values, check the effects, and refuse a model that is worse on held-out data than the declared one.

    Where candidates tie and held-out data refuse the first, the next is examined; what is refused is no rival.

    Args:
        final_search: the search on whose segments the outcome's last fit is.
        verdict: by forward selection.

    Returns:
        The answer, and the outcome that it is about.
    """
    system = search.system
    declared = measured(system)
    if verdict == "unfit":
        refit = model_of(outcome.base.runner.trial, outcome.base.theta)
        figures = measured(refit)
        return Answer(verdict, (), refit, refit, (declared, figures, figures)), outcome
    base = adopt_values(search, outcome.base, problem, system)
    chosen = admitted(_options(system, base, "refitted values"), declared, measured)
    refit = system if chosen.option is None else chosen.option[1]
    errors = () if chosen.refusals else base.errors
    three = (declared, chosen.figures, chosen.figures)
    plain = Answer(verdict, (), refit, refit, three, errors, remarks=(*base.notes, *chosen.remarks))
    if not outcome.parts:
        return plain, outcome
    answer = _with_effects(final_search, outcome, problem, plain, measured)
    if verdict == "ambiguous" and answer.verdict == "unknown":
        for other in without_leader(final_search, outcome):
            left: Verdict = "ambiguous" if other.rivals else "effect"
            second = _with_effects(final_search, other, problem, replace(plain, verdict=left), measured)
            if second.verdict == left:
                named = " and ".join(f"{p.kind} on {p.on}" for p in outcome.parts)
                words = f"{named}, which ties with it on the training log, is refused: {answer.against[0]}"
                return replace(second, remarks=(*second.remarks, words)), other
    return answer, outcome


def with_estimate(
    search: Search, outcome: Outcome, problem: Problem, plain: Answer, measured: Measured, by_force: Fit
) -> Answer:
    """The answer with the effects of a fit to the force residual, which has their values and intervals.

    Args:
        outcome: with free runs of these values as its last fit. plain: the answer without effects.
    """
    parts = outcome.final.runner.trial.parts
    named = named_effects(parts, estimate(by_force), plain.refit)
    found = tuple(replace(f, at_limit=marks) for f, marks in zip(named, at_limit(by_force), strict=True))
    raised = tuple(w for f, p in zip(found, parts, strict=True) for w in objections(f, p, problem))
    if raised:
        return replace(plain, verdict="unknown", effects=found, against=raised)
    return _judged(search, outcome, problem, plain, measured, outcome.final, found)


def _with_effects(
    final_search: Search, outcome: Outcome, problem: Problem, plain: Answer, measured: Measured
) -> Answer:
    fit, found, against = _examined(final_search, outcome, problem, plain.refit, plain.verdict == "effect")
    if against:
        return replace(plain, verdict=without_effects(outcome), effects=found, against=against)
    return _judged(final_search, outcome, problem, plain, measured, fit, found)


def _judged(
    final_search: Search,
    outcome: Outcome,
    problem: Problem,
    plain: Answer,
    measured: Measured,
    fit: Fit,
    found: tuple[FoundEffect, ...],
) -> Answer:
    """The answer with estimated effects, unless the force residual, a regression or held-out data refuse them."""
    system = with_effects(final_search.system, found)
    richer = adopt_values(final_search, fit, problem, system)
    without_it = {s.name: float(plain.refit.values[s]) for s in final_search.moved}
    options = _options(system, richer, "the effect with refitted values", without_it)
    models = problem, plain.refit, options[0][1]
    settled, against = settled_by_free_runs(outcome.final, outcome.explained, *models), ""
    if not (settled or force_agrees(outcome.final, *models)):
        against = "it does not reduce the squared residual force of the training log as much as it should"
    against = against or against_regression(outcome, *models, found)
    if against:
        return replace(plain, verdict="unknown", effects=found, against=(against,))
    declared, without, worse = references(plain, options[0][1], problem, settled)
    chosen = admitted(options, declared, measured, without, worse)
    if chosen.option is None:
        return replace(plain, verdict="unknown", effects=found, against=chosen.refusals)
    figures = (*plain.figures[:2], chosen.figures)
    errors = () if chosen.refusals else richer.errors
    written = replace(plain, effects=found, augmented=chosen.option[1], figures=figures, errors=errors)
    if plain.verdict == "ambiguous":
        return written
    notes = tuple(w for f, p in zip(found, fit.runner.trial.parts, strict=True) for w in remarks(f, p, problem))
    return replace(written, remarks=(*notes, *richer.notes, *chosen.remarks))


def references(
    plain: Answer, augmented: System, problem: Problem, settled: bool = False
) -> tuple[ErrorFigures, ErrorFigures, float]:
    """What a model with effects is compared with: errors as declared and of the refit, and the share it may exceed the
    refit's by.

    The motion of a load behind a spring is computed from differentiated noise, so its force residual is no criterion;
    the free run alone must then confirm it: its squared error falls by ``LEAST_SHARE``. So it is where free runs settle
    the question. Over the share of the drive
    that load-dependent friction leaves, noise of the acceleration counts for more: the refit's does too.
    """
    declared, refit = plain.figures[:2]
    if augmented.transmissions or settled:
        unknown = (float("nan"),) * len(refit.force_rms_rows)
        least = float(np.sqrt(1 - credit.LEAST_SHARE)) - 1
        return replace(declared, force_rms_rows=unknown), replace(refit, force_rms_rows=unknown), least
    left = drive_left(augmented, problem.motion) / drive_left(plain.refit, problem.motion)
    rows = tuple(rms / min(float(share), 1.0) for rms, share in zip(refit.force_rms_rows, left, strict=True))
    return declared, replace(refit, force_rms_rows=rows), REFIT_WORSE


def _examined(
    search: Search, outcome: Outcome, problem: Problem, refit: System, strict: bool
) -> tuple[Fit, tuple[FoundEffect, ...], tuple[str, ...]]:
    """The polished fit with the effects without objections; with all and the objections, where those without are none
    or are not credited over the refit.

    Args:
        strict: whether to look for objections.
    """
    final = outcome.final
    while True:
        fit, other = search.polished(final)
        parts = fit.runner.trial.parts
        named = named_effects(parts, estimate(fit, other), refit)
        found = tuple(replace(f, at_limit=marks) for f, marks in zip(named, at_limit(fit), strict=True))
        simpler = in_simpler_form(search, final, found)
        if simpler is not None:
            final = simpler
            continue
        raised = [objections(f, p, problem) if strict else [] for f, p in zip(found, parts, strict=True)]
        if not any(raised):
            return fit, found, ()
        words = tuple(w for one in raised for w in one)
        if all(raised):
            return fit, found, words
        final = search.without(final, next(k for k, one in enumerate(raised) if one))
        if not credible(search, outcome.base, final, len(outcome.first)):
            return fit, found, words


def in_simpler_form(search: Search, fit: Fit, found: Sequence[FoundEffect]) -> Fit | None:
    """The fit with one effect in a form with fewer parameters, where their intervals do not exclude it; else None."""
    trial = fit.runner.trial
    moved, values = trial.split(fit.theta)
    for k, (one, part) in enumerate(zip(found, trial.parts, strict=True)):
        form = CATALOGUE[part.kind].simpler(part.names, one.intervals)
        if form is not None:
            parts = [part_of(form, p.place, trial.system) if p is part else p for p in trial.parts]
            kept = {name: values[k][name] for name in parts[k].names}
            return search.with_parts(fit, moved, parts, [*values[:k], kept, *values[k + 1 :]])
    return None


def without_effects(outcome: Outcome) -> Verdict:
    """The verdict where no effect is credited: ``unknown`` if the refit leaves a material misfit above the noise."""
    base = outcome.base
    far = credit.noise_ratio(base) > credit.NEAR_NOISE or credit.share_far(base) > credit.FEW
    return "unknown" if far and credit.misfit(base) > credit.LEAST_SIZE else "none"


def _options(system: System, refit: Refit, words: str, without: Mapping[str, float] | None = None) -> list[Option]:
    """Models that may be written, from the values that the training log prefers to the declared ones, each once.

    Args:
        without: values adopted for the model without the effects.
    """
    ways: dict[str, Mapping[str, float]] = {
        words: refit.mapping(),
        f"{words} of friction levels alone": refit.mapping(refit.levels),
        **({"the effect with the values of the model without it": without} if without else {}),
        f"{'the effect with ' if without else ''}the declared values": refit.mapping(refit.declared),
    }
    tried: list[Mapping[str, float]] = []
    options = []
    for name, values in ways.items():
        if values not in tried:
            tried.append(values)
            options.append((name, with_values(system, values)))
    return options

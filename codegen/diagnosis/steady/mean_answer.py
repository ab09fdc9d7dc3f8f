"""The answer of a diagnosis of steady records: forward selection on their means, and what held-out ones refuse."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from codegen.diagnosis.evidence.estimate import effect_of
from codegen.diagnosis.results import ErrorFigures, Fact, FoundEffect, Round
from codegen.diagnosis.steady.mean_fits import SteadyFit, SteadySearch, Tried
from codegen.diagnosis.steady.record_means import mean_forces
from codegen.diagnosis.verdict.admission import Measured, Reference, admitted, merged
from codegen.diagnosis.verdict.answer import Answer
from codegen.diagnosis.verdict.table import TABLE_SIZE
from codegen.logs.formats.source import listing
from codegen.mechanics.system import System

MOST_EFFECTS = 3


@dataclass(frozen=True, eq=False)
class SteadyOutcome:
    """Forward selection on the means: the refit, the fits with one effect more each, and rivals of the first one."""

    base: SteadyFit
    fits: tuple[SteadyFit, ...]
    rounds: tuple[Round, ...]
    rivals: tuple[Tried, ...]


def select_effects(search: SteadySearch) -> SteadyOutcome:
    """Forward selection: effects one after the other, while one is accepted."""
    base = current = search.refit()
    fits: list[SteadyFit] = []
    rounds: list[Round] = []
    rivals: tuple[Tried, ...] = ()
    for turn in range(MOST_EFFECTS):
        ranked = search.ranked_candidates(current)
        before = tuple(p.key for p in current.trial.parts)
        rounds.append(Round(before, tuple(one.row for one in ranked[:TABLE_SIZE])))
        if not ranked or not ranked[0].row.accepted:
            break
        current = ranked[0].fit
        fits.append(current)
        if not turn and (rivals := tuple(search.ties(ranked, base))):
            break  # what is missing besides would be another effect for each of those that tie
    return SteadyOutcome(base, tuple(fits), tuple(rounds), rivals)


def answer_of(search: SteadySearch, measured: Measured, judged: Measured) -> tuple[Answer, SteadyOutcome]:
    """The answer on steady records; held-out records may refuse the refit and each effect.

    Args:
        measured: gives all errors of a model on held-out records, which the answer states.
        judged: gives those of these errors by which models are compared.
    """
    system, found = search.system, select_effects(search)
    declared, residual = judged(system), mean_forces(system, search.means)[0].ravel()
    options = [("declared values", system)]
    if float(found.base.left_out @ found.base.left_out) < float(residual @ residual):
        options.insert(0, ("refitted values", found.base.model))
    chosen = admitted(options, judged, Reference(declared))
    refit = system if chosen.option is None else chosen.option[1]
    errors = measured(system), measured(refit)
    left_out = search.means.left_out
    given = {"left_out": listing(left_out), "one": len(left_out) == 1}
    remarks = (Fact.said("note", "records", count=len(search.means), **given), *chosen.remarks)
    answer = Answer("none", (), refit, refit, (*errors, errors[1]), remarks=remarks)
    if not found.fits:
        return answer, found
    named, against = _not_refused(found.fits, judged, declared, judged(refit))
    if named is None:
        return answer.unknown(effects_of(found.fits[0], refit), against), found
    if against:
        further = found.fits[len(named.trial.parts)].part
        words = f"{further.title}, a further effect: {against[0].words}"
        remarks = (*remarks, Fact("not accepted", words))
    answer = replace(
        answer,
        verdict="ambiguous" if found.rivals else "effect",
        effects=effects_of(named, refit),
        augmented=named.model,
        figures=(*errors, measured(named.model)),
        remarks=(*remarks, *search.values_away(found.rivals)),
    )
    return answer, found


def _not_refused(
    fits: Sequence[SteadyFit], judged: Measured, declared: ErrorFigures, refit: ErrorFigures
) -> tuple[SteadyFit | None, tuple[Fact, ...]]:
    """The last of successive fits before one that held-out records refuse, and why they refuse that one."""
    named, before = None, refit
    for fit in fits:
        chosen = admitted([("refitted values", fit.model)], judged, Reference(declared, before))
        if chosen.option is None:
            return named, merged(chosen.refusals)
        named, before = fit, chosen.figures
    return named, ()


def effects_of(fit: SteadyFit, system: System) -> tuple[FoundEffect, ...]:
    """The parts of a fit as effects, with their intervals."""
    found = zip(fit.trial.parts, fit.parameters, fit.intervals(), strict=True)
    return tuple(effect_of(part, values, system, spans) for part, values, spans in found)

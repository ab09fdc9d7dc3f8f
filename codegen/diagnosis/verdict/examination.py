"""Examination of the outcome of forward selection: adopted values, and checks of the effects."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from codegen.base.significant import in_percent
from codegen.diagnosis.evidence.adoption import adopt_values
from codegen.diagnosis.evidence.estimate import Estimate, estimate, named_effects, widened_by
from codegen.diagnosis.evidence.reservations import (
    determined_form,
    may_be_absent,
    objections,
    remarks,
    takes_the_level,
    undetermined,
)
from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.acceptance import is_far
from codegen.diagnosis.fit.drive import drive_shares
from codegen.diagnosis.fit.output_error import Fit, at_limit
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import Search, joint_of
from codegen.diagnosis.fit.trial import Part, part_of, with_effects, with_values
from codegen.diagnosis.results import ErrorFigures, Fact, FoundEffect, Verdict, titles
from codegen.diagnosis.selection.force_fits import ForceFits
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.parsimony import explained_share, is_accepted
from codegen.diagnosis.selection.significance import dispersion
from codegen.diagnosis.verdict.admission import (
    REFIT_WORSE,
    Measured,
    Reference,
    Refusal,
    acts,
    admitted,
    in_proportion,
    may_be_chance,
    merged,
    options_of,
    outweighed,
    reduces_both,
    reduces_runs,
    reference_of,
    refused_values,
    worsened,
)
from codegen.diagnosis.verdict.against_regression import against_regression
from codegen.diagnosis.verdict.answer import (
    Answer,
    explains_material_force,
    force_agrees,
    settled_by_free_runs,
    without_effects,
)
from codegen.diagnosis.verdict.harmonics import with_harmonics
from codegen.diagnosis.verdict.held_out import HeldOut, without_refused
from codegen.diagnosis.verdict.over_positions import over_positions
from codegen.diagnosis.verdict.separation import without_leader
from codegen.mechanics.system import System


def examine(
    search: Search,
    final_search: Search,
    outcome: Outcome,
    verdict: Verdict,
    held_out: HeldOut,
    complete: bool = True,
) -> tuple[Answer, Outcome]:
    """Adopt values, check the effects, and refuse a model that is worse on held-out data than the declared one.

    Tied candidates that held-out data refuse are removed first (``without_refused``). If the first of the remaining
    candidates is refused, the next one is examined; a refused one is no rival.

    Args:
        final_search: the search of the outcome's last fit.
        complete: unset if a further effect is missing for certain, and the log does not tell which.
    """
    system, measured = search.system, held_out.measured
    declared = measured(system)
    if verdict == "unfit":
        refit = outcome.base.model
        figures = measured(refit)
        return Answer(verdict, (), refit, refit, (declared, figures, figures)), outcome
    base = adopt_values(search, outcome.base, system)
    options = options_of(system, base)
    chosen = admitted(options, measured, _by_drive(declared, search.problem))
    refused_refit = refused_values(options[0][1], system) if chosen.refusals else ()
    errors = () if chosen.refusals else base.errors
    refit = system if chosen.option is None else chosen.option[1]
    three = (declared, chosen.figures, chosen.figures)
    plain = Answer(verdict, (), refit, refit, three, errors, remarks=(*base.notes, *chosen.remarks, *refused_refit))
    if not outcome.parts:
        return plain, outcome
    refused: tuple[Fact, ...] = ()
    if verdict == "ambiguous":
        outcome, refused = without_refused(final_search, outcome, held_out)
        verdict = "ambiguous" if outcome.rivals else "effect"
        plain = replace(plain, verdict=verdict)
    answer, examined = _with_effects(final_search, outcome, plain, measured, complete)
    answer = answer.noted(*refused)
    if verdict == "ambiguous" and answer.verdict == "unknown":
        for other in without_leader(final_search, outcome):
            left: Verdict = "ambiguous" if other.rivals else "effect"
            second, other = _with_effects(final_search, other, replace(plain, verdict=left), measured)
            if second.verdict == left:
                given = {"named": titles(outcome.parts), "why": answer.against[0].words}
                of_leader = Fact.worded("not accepted", "refused leader", **given)
                return second.noted(*refused, replace(of_leader, detail=answer.against[0].detail)), other
    return answer, examined


def _by_drive(declared: ErrorFigures, problem: Problem) -> Callable[[System], Reference]:
    """The reference of a model without effects: declared errors in proportion to the drive force of that model.

    With a smaller motor constant all forces and their residual are smaller, though no motion is predicted better.
    """
    return lambda model: Reference(in_proportion(declared, model, problem.system, problem))


def with_estimate(search: Search, outcome: Outcome, plain: Answer, measured: Measured, by_force: Fit) -> Answer:
    """The answer with the effects, values and intervals of a fit to the force residual, confirmed by the outcome."""
    parts = outcome.parts
    found = _named(by_force, estimate(by_force), plain.refit)
    raised = tuple(
        w for f, p in zip(found, parts, strict=True) for w in objections(f, p, search.problem, by_force.model)
    )
    if raised:
        return plain.unknown(found, not_accepted(raised))
    harm = _harmful(search, outcome.final, measured)
    if harm is not None:
        return plain.unknown(found, (harm[1],))
    return _judged(search, outcome, plain, measured, outcome.final, found)


def _with_effects(
    final_search: Search, outcome: Outcome, plain: Answer, measured: Measured, complete: bool = True
) -> tuple[Answer, Outcome]:
    """The answer with the effects of an outcome that pass all checks, and the outcome that it is of.

    An effect that increases a held-out error is removed, and so is an unconfirmed load behind a spring, if all effects
    are ``complete``. Harmonics are then sought again: together with an effect that does not exist their sum may be no
    better than a single sine.
    """
    outcome, fit, found, against = _examined(final_search, outcome, plain.refit, plain.verdict == "effect")
    if against:
        return replace(plain, verdict=without_effects(outcome), effects=found, against=against), outcome
    harm = None
    if plain.verdict == "effect":
        harm = _harmful(final_search, outcome.final, measured)
        harm = harm or (_unconfirmed_load(final_search, outcome.final) if complete else None)
    if harm is not None:
        final = final_search.without(outcome.final, harm[0])
        if not is_accepted(final_search, final_search.on_its_record(outcome.base), final):
            return plain.unknown(found, (harm[1],)), outcome
        fewer, last = with_harmonics(final_search, outcome.with_final(final_search, final, outcome.rivals))
        answer, fewer = _with_effects(last, fewer, plain, measured, complete)
        return answer.noted(harm[1]), fewer
    return _judged(final_search, outcome, plain, measured, fit, found), outcome


def _harmful(search: Search, final: Fit, measured: Measured) -> tuple[int, Fact] | None:
    """The index of the one of several effects that increases a held-out error most, and the fact on it; None if none.

    Two effects may together imitate one that the catalogue lacks, on the motion of the training log. Both errors of all
    effects together can then be far below those without any, although one of the two is wrong. So each is compared
    with the fit of the others, as a single effect is with the refit. An increase of the free-run error alone is
    outweighed by a larger decrease of the force error in proportion to the drive force (``drive_shares``): what all
    effects leave is systematic, and may add to one of them in a free run.

    Far from the noise the fit with all effects may have worse values of the other parameters than the fit without one.
    So an effect that reduces both errors where it is added to that fit, with no value changed, does no harm. Nor does a
    load behind a spring with which free runs near the noise are better: as for a single effect (``reference_of``), the
    force residual would need its motion, which is not measured.
    """
    if len(final.trial.parts) < 2:
        return None
    figures, found = measured(final.model), list[tuple[float, int, dict[str, float]]]()
    loads, near = len(final.model.transmissions), not is_far(final)
    for k, (part, values) in enumerate(zip(final.trial.parts, final.values[1], strict=True)):
        model = search.without(final, k).model
        others = measured(model)
        worse = worsened(figures, others, REFIT_WORSE)
        if not worse or may_be_chance(worse, figures, others):
            continue
        if near and loads > len(model.transmissions) and reduces_runs(figures, others):
            continue
        problem = search.problem
        if outweighed(worse, figures, others, drive_shares(final.model, model, problem.motion, problem.used)):
            continue
        added = with_effects(model, [FoundEffect(part.kind, part.on, values, {})])
        if not reduces_both(measured(added), others):
            found.append((max(worse.values()), k, worse))
    if not found:
        return None
    _, k, worse = max(found, key=lambda one: one[0])
    part = final.trial.parts[k]
    return k, merged([Refusal("refitted values", f"without {part.title}", worse)])[0]


def _unconfirmed_load(search: Search, final: Fit) -> tuple[int, Fact] | None:
    """The index of a load behind a spring that explains too little of what the other effects leave; None if none.

    Its motion is not measured, so the force residual confirms no such load, and three free parameters correct much of
    an input that is logged late or of another effect of the wrong form. So free runs must ask more of it
    (``acceptance.FURTHER_LOAD``) than of an effect that both criteria confirm. Where a further effect is missing for
    certain, a true load explains less too, and is not asked.
    """
    for k, part in enumerate(final.trial.parts):
        others = search.without(final, k)
        fewer = len(others.model.transmissions) < len(final.model.transmissions)
        if not fewer or not any(joint_of(search, p) == joint_of(search, part) for p in others.trial.parts):
            continue
        share = explained_share(search, others, final)
        if share < acceptance.FURTHER_LOAD:
            given = {"load": part.title, "share": share, "least": acceptance.FURTHER_LOAD}
            return k, Fact.worded("not accepted", "unconfirmed load", **given)
    return None


def _judged(
    final_search: Search,
    outcome: Outcome,
    plain: Answer,
    measured: Measured,
    fit: Fit,
    found: tuple[FoundEffect, ...],
) -> Answer:
    """The answer with the effects found, or ``plain`` with the reason if force residual or held-out data refuse."""
    problem, system = final_search.problem, with_effects(final_search.system, found)
    richer = adopt_values(final_search, fit, system)
    without_it = {s.name: float(plain.refit.values[s]) for s in final_search.refitted_symbols}
    options = options_of(system, richer, without_it)
    models = problem, plain.refit, options[0][1]
    settled, against = settled_by_free_runs(outcome.final, outcome.explained, *models), ""
    agrees = force_agrees(outcome.final, *models)
    if not (settled or agrees):
        against = (
            f"it does not reduce the squared residual force of the training log by {in_percent(acceptance.LEAST_SHARE)}"
        )
    with_friction = any(p.effect.sits_on == "contact" for p in fit.trial.parts)
    level = takes_the_level(*models, with_friction=with_friction)
    against = against or against_regression(outcome.final, *models, found) or (f"it {level}" if level else "")
    against = against or over_positions(problem, plain.refit, found)
    if against:
        return plain.unknown(found, not_accepted([against]))
    without_effect = with_values(system, without_it)

    def shown() -> bool:
        """Whether effects that gain nothing on the held-out data are refused for that.

        They are if they act on these data, or explain no material force of the training log either.
        """
        return not explains_material_force(*models) or acts(measured(without_effect), plain.figures[1])

    places = sorted({p.effect.coordinate(problem.system, p.place) for p in fit.trial.parts})
    acting = {i: problem.system.positions[i].name for i in places}
    near = not is_far(outcome.final)

    for by_runs in (True, False) if settled and agrees else (settled,):  # the force agrees too: the usual reference
        reference = partial(reference_of, plain=plain, problem=problem, settled=by_runs, near=near)
        chosen = admitted(options, measured, reference, shown, acting)
        if chosen.option is not None:
            break
    if chosen.option is None:
        return plain.unknown(found, merged(chosen.refusals))
    figures = (*plain.figures[:2], chosen.figures)
    errors = () if chosen.refusals else richer.errors
    written = replace(plain, effects=found, augmented=chosen.option[1], figures=figures, errors=errors)
    if plain.verdict == "ambiguous":
        return written
    limits = (w for f, p in zip(found, fit.trial.parts, strict=True) for w in remarks(f, p, problem))
    notes = (Fact("values", words) for words in limits)
    return replace(written, remarks=(*notes, *richer.notes, *chosen.remarks))


def _examined(
    search: Search, outcome: Outcome, refit: System, strict: bool
) -> tuple[Outcome, Fit, tuple[FoundEffect, ...], tuple[Fact, ...]]:
    """The outcome with the effects that are left, their final fit, its effects, and the objections against them.

    If every effect has an objection, all are returned with the objections.

    Args:
        strict: set unless candidates tie. Effects are then fitted again in the simplest form that their intervals
            contain. Those with objections are removed one at a time, and the others fitted again; if these are not
            accepted over the refit, all effects are returned with the objections.
    """
    final = outcome.final
    while True:
        fit, other = search.polished(final)
        parts = fit.trial.parts
        alone = estimate(fit, other)
        own = named_effects(parts, alone, refit)
        found = _named(fit, _by_both(search, outcome.base, final, fit, alone), refit)
        simpler = _in_determined_forms(search, final, found) if strict else None
        if simpler is not None:
            final = simpler
            continue
        triples = zip(own, found, parts, strict=True)
        raised = [_objections(o, f, p, search.problem, fit.model) for o, f, p in triples]
        if not any(raised) or not (strict or all(raised)):
            if final is not outcome.final:
                outcome = outcome.with_final(search, final, outcome.rivals)
            return outcome, fit, found, ()
        against = not_accepted([w for one in raised for w in one])
        if all(raised):
            return outcome, fit, found, against
        final = search.without(final, next(k for k, one in enumerate(raised) if one))
        if not is_accepted(search, search.on_its_record(outcome.base), final):
            return outcome, fit, found, against


def _named(fit: Fit, estimated: Estimate, refit: System) -> tuple[FoundEffect, ...]:
    """The effects of a fit with these estimates, and the parameters that are at a limit."""
    named = named_effects(fit.trial.parts, estimated, refit)
    return tuple(replace(f, at_limit=marks) for f, marks in zip(named, at_limit(fit), strict=True))


def _in_determined_forms(search: Search, final: Fit, found: Sequence[FoundEffect]) -> Fit | None:
    """The fit with effects in simpler forms where their intervals contain these; None if there is no such effect."""
    forms = [determined_form(p, f.intervals) for p, f in zip(final.trial.parts, found, strict=True)]
    if not any(forms):
        return None
    pairs = zip(final.trial.parts, forms, strict=True)
    parts = [part_of(form, part.place, search.system) if form else part for part, form in pairs]
    kept = [{name: known[name] for name in part.names} for part, known in zip(parts, final.values[1], strict=True)]
    return search.replaced(final, dict(enumerate(zip(parts, kept, strict=True))))


def _by_both(search: Search, base: Fit, final: Fit, polished: Fit, own: Estimate) -> Estimate:
    """Estimates whose intervals reach those of the force residual where free runs leave more than noise."""
    if final.trial.changed.transmissions:
        return own
    joints = [joint_of(search, part) for part in final.trial.parts]
    left = {j: dispersion(search, final if j is None else final.of_joint(j)) for j in set(joints)}
    shares = {
        k: 1 - acceptance.ONLY_NOISE / left[joint]
        for k, joint in enumerate(joints)
        if left[joint] > acceptance.ONLY_NOISE
    }
    if not shares:
        return own
    by_force = ForceFits(search, search.on_its_record(base)).fit(polished.trial, polished.theta)
    return widened_by(own, estimate(by_force), polished.trial.parts, shares)


def _objections(own: FoundEffect, found: FoundEffect, part: Part, problem: Problem, model: System) -> list[str]:
    """The objections to an effect by its ``own`` interval, or by that of both criteria if that leaves the size open."""
    words = objections(own, part, problem, model)
    unshown = may_be_absent(part.effect, found.intervals) or undetermined(part.effect, found.intervals)
    return words if words or not unshown else objections(found, part, problem, model)


def not_accepted(words: Sequence[str]) -> tuple[Fact, ...]:
    """Reasons against an effect as facts."""
    return tuple(Fact("not accepted", one) for one in words)

"""Late inputs: by how much an input acts earlier than it was logged, judged with the effects that were found.

An input that is logged late, as a current behind a filter of the drive, leads the motion. Before effects are sought,
the force balance estimates this lead (``evidence.timing``). A force that the model lacks may hide it there, or look
like it. So free runs estimate it again, with what was found: beside each accepted effect and at the end of a selection,
also if nothing was found. If they end much nearer to the log with another lead, it is corrected, and the effects are
sought again. Free runs tell a lead where the force balance does not, as in slow motion, where the noise of the current
exceeds its changes, and beside a load behind a spring.

A lead may also be hidden by effects that add states, as a heavily damped compliance corrects it. If free runs with the
inputs taken earlier explain the log as well as these effects do, the lead is corrected in their place. Where free runs
then still leave far more than the noise, another force is missing, of which a lead explains a part, as a compliance
does. There it must also be shown as an effect is.

The estimate of a lead before effects are sought may also be too large. Free runs then find a delay or lag of the same
input that is about as long or shorter. It is no effect of the machine: the lead is reduced by it, and the effects are
sought again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, reduce

import numpy as np
from scipy.optimize import minimize_scalar

from codegen.diagnosis.case import Case
from codegen.diagnosis.evidence.timing import (
    ABOUT_HALF,
    EXPLAINED,
    LARGEST_IN_PLACE,
    LEAST_LEAD,
    SETTLED,
    Lead,
    lead_finding,
    open_inputs,
    overcorrection_finding,
)
from codegen.diagnosis.fit.acceptance import (
    ALPHA,
    evidence_of,
    independent_share,
    is_far,
    most_explained,
    random_signs,
)
from codegen.diagnosis.fit.identity_cache import identity_cache
from codegen.diagnosis.fit.output_error import Fit, segment_cost
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.shooting import hidden_states
from codegen.diagnosis.selection.parsimony import BETTER
from codegen.logs import Finding
from codegen.logs.uniform import earlier

TRIED = 0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0, LARGEST_IN_PLACE
"""Rows: the leads that free runs try one after the other, as long as they end nearer to the log."""


@identity_cache(1)
def corrected_for_leads(case: Case, search: Search, final: Fit) -> Case | None:
    """The case with other leads of its inputs than those with which a fit was found; None if it has the right ones.

    They take the place of a delay or lag that cancels a lead (``_overcorrected``) or of effects that add states
    (``_in_place_of_states``), or free runs of the same effects are much nearer to the log with them.
    """
    if over := _overcorrected(case, final):
        return case.with_leads({k: rows for k, (rows, _) in over.items()}, [finding for _, finding in over.values()])
    return _in_place_of_states(case, search, final) or _by_free_runs(case, search, final)


def _in_place_of_states(case: Case, search: Search, final: Fit) -> Case | None:
    """The case with inputs taken earlier in place of the effects of a fit that add states; None if those stay.

    They stay if free runs without them show no lead, if they gain more than ``BETTER`` nats by each of them over the
    lead, tempered by the share of independent residuals, or if they end far from the noise and the lead is not shown as
    an effect is (``late_is_better``). They are left out together, since a lead may have been named as two of them.
    """
    with_states = [k for k in range(len(final.trial.parts)) if _adds_states(final, k)]
    if not with_states:
        return None

    def without_states(search: Search) -> Fit:
        return reduce(search.without, reversed(with_states), final)

    leads = _nearest(case, search, without_states(search))
    if not leads:
        return None
    rest = without_states(_with_earlier_inputs(case, search, leads))
    is_part = is_far(rest) and not all(lead.explained for lead in leads.values())
    if -_gained(final, rest) > BETTER * len(with_states) or is_part:
        return None
    return _taken_earlier(case, leads, [final.trial.parts[k].title for k in with_states])


def adds_states(fit: Fit) -> bool:
    """Whether some effect of a fit adds states to the free run."""
    return any(_adds_states(fit, k) for k in range(len(fit.trial.parts)))


def _by_free_runs(case: Case, search: Search, final: Fit) -> Case | None:
    """The case with all inputs taken earlier, where free runs of a fit show a lead (``late_is_better``); else None.

    Half a row, by which a measurement leads, is taken for ``BETTER`` nats alone where no effect is found and the log
    does not say whether the inputs were measured.
    """
    unstated = not (case.log.description.input_hold or final.trial.parts)
    if not unstated and most_explained(final) < EXPLAINED:  # no lead can be shown, so none is sought
        return None
    leads = _nearest(case, search, final)
    taken = any(lead.explained or (unstated and lead.rows <= ABOUT_HALF) for lead in leads.values())
    return _taken_earlier(case, leads) if taken else None


def _nearest(case: Case, search: Search, fit: Fit) -> dict[int, Lead]:
    """The lead of all inputs with which free runs of a fit end nearest to the log: input → lead.

    Empty unless they gain more than ``BETTER`` nats by it, tempered. One device writes all inputs, so they have one
    lead, which is sought from the present one. ``explained`` is 0 where it is not shown (``late_is_better``).
    """
    inputs = [] if case.faults or case.steady else open_inputs(case.problem.system, case.log)
    if not inputs:
        return {}

    @cache
    def fitted(rows: float) -> Fit:
        return _with_earlier_inputs(case, search, dict.fromkeys(inputs, Lead(rows))).fitted_again(fit)

    def cost(rows: float) -> float:
        return segment_cost(fitted(rows).residual)

    def neighbours(k: int) -> range:
        return range(max(k - 1, 0), min(k + 2, len(TRIED)))

    present = [case.leads.get(k, 0.0) for k in inputs]
    best = int(np.argmin([abs(rows - np.mean(present)) for rows in TRIED]))
    if {*present} == {TRIED[best]}:  # the fit has this lead, and need not be repeated where both neighbours are worse
        here = segment_cost(fit.residual)
        if all(cost(TRIED[k]) >= here for k in neighbours(best) if k != best):
            return {}
    while (near := min(neighbours(best), key=lambda k: cost(TRIED[k]))) != best:
        best = near
    rows = TRIED[best]
    if _gained(fit, fitted(rows)) <= BETTER:
        return {}
    if rows > ABOUT_HALF:
        around = TRIED[best - 1], TRIED[min(best + 1, len(TRIED) - 1)]
        rows = float(minimize_scalar(cost, bounds=around, method="bounded", options={"xatol": SETTLED / 2}).x)
    if rows < LEAST_LEAD:
        return {}
    late = fitted(rows)
    explained = evidence_of(fit, late).share if late_is_better(late, fit) else 0.0
    return dict.fromkeys(inputs, Lead(rows, explained=explained))


def late_is_better(late: Fit, final: Fit) -> bool:
    """Whether free runs show a lead as they show an effect, and it removes ``EXPLAINED`` of their squared error.

    By nats alone a model that lacks a force would gain by a lead too, as by any other freedom.
    """
    shown = evidence_of(final, late)
    return shown.share >= EXPLAINED and random_signs(shown.t) <= ALPHA and _gained(final, late) > BETTER


def _gained(before: Fit, after: Fit) -> float:
    return independent_share(before) * (segment_cost(before.residual) - segment_cost(after.residual))


def _taken_earlier(case: Case, leads: Mapping[int, Lead], replaced: Sequence[str] = ()) -> Case:
    names = [w.name for w in case.problem.system.inputs]
    found = [
        lead_finding(names[k], lead, case.log, most=LARGEST_IN_PLACE, replaced=replaced) for k, lead in leads.items()
    ]
    return case.with_leads({k: lead.rows for k, lead in leads.items()}, found)


def _overcorrected(case: Case, final: Fit) -> dict[int, tuple[float, Finding]]:
    """Inputs whose correction is cancelled by a delay or lag of a fit: index → the lead that is left, and the finding.

    A machine may delay its input, but not by chance by as much as the input was taken earlier, to ``LEAST_LEAD`` rows:
    the estimate of the lead was too large.
    """
    h, found = case.log.sample_time, dict[int, tuple[float, Finding]]()
    for part, values in zip(final.trial.parts, final.values[1], strict=True):
        delay = part.effect.delay(values) / h
        lead = case.leads.get(part.place, 0.0)
        if delay > 0 and lead > 0 and delay <= lead + LEAST_LEAD:
            left = lead - delay if lead - delay >= LEAST_LEAD else 0.0
            found[part.place] = left, overcorrection_finding(part.on, part.kind, lead, delay, left, case.log)
    return found


def _adds_states(fit: Fit, k: int) -> bool:
    """Whether an effect of a fit adds states to the free run."""
    return hidden_states(fit.trial.without(fit.theta, k)[0].changed) < hidden_states(fit.trial.changed)


def _with_earlier_inputs(case: Case, search: Search, leads: Mapping[int, Lead]) -> Search:
    """The search on its record with the inputs of a case taken earlier by these leads."""
    commands, every = search.record.commands.copy(), search.record.every
    for k, lead in leads.items():
        commands[:, k] = earlier(commands[:, k], (lead.rows - case.leads.get(k, 0.0)) / every)
    return replace(search, record=replace(search.record, commands=commands))

"""Late inputs as an alternative explanation to effects that add states, such as a load behind a spring or presliding.

An input that is logged late, as a current behind a filter of the drive, leads the motion. Before effects are sought, a
force that the model lacks may hide this lead, and a heavily damped compliance then corrects it. So the lead is
estimated again with the other effects found in the model. If free runs with the inputs taken earlier explain the log as
well as the effects that add states do, the lead is corrected, and the effects are sought again.

Where free runs then still leave far more than the noise, another force is missing, of which a lead explains a part, as
a compliance does. There it must also explain a share of the residual force, as an effect must.

The estimate of a lead before effects are sought may also be too large. Free runs then find a delay or lag of the same
input that is about as long or shorter. It is no effect of the machine: the lead is reduced by it, and the effects are
sought again.

Where no effect is found, the force balance may not tell whether an input is held or was measured, half a row apart.
Free runs of the refit then decide it. With an effect they are not asked: a model with a wrong one, as weaker motors
where an arm carries a payload, gains by half a row as by any other freedom.

A longer lead may be significant in the force balance and still explain little of it, because a missing force hides it
or looks like it, or be longer than what is corrected. Then effects are sought again with the lead corrected, and free
runs of both selections decide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from codegen.diagnosis.case import Case
from codegen.diagnosis.evidence.timing import (
    ABOUT_HALF,
    EXPLAINED,
    LARGEST_IN_PLACE,
    LEAST_LEAD,
    Lead,
    further_leads,
    lead_finding,
    overcorrection_finding,
    undecided,
)
from codegen.diagnosis.fit.acceptance import LEAST_SHARE, independent_share, is_far, noise_ratio
from codegen.diagnosis.fit.identity_cache import identity_cache
from codegen.diagnosis.fit.output_error import Fit, segment_cost
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.shooting import hidden_states
from codegen.diagnosis.fit.trial import model_of
from codegen.diagnosis.selection.parsimony import BETTER
from codegen.logs import Finding
from codegen.logs.uniform import earlier


@identity_cache(1)
def corrected_for_leads(case: Case, search: Search, final: Fit) -> Case | None:
    """The case with inputs taken earlier in place of the effects of a fit that add states; None if those stay.

    Or with inputs taken less early, in place of a delay or lag that cancels the correction (``_overcorrected``).

    Effects that add states stay if no input has a significant lead without them, if free runs gain more than ``BETTER``
    nats by each of them over the lead, tempered by the share of independent residuals, or if these end far from the
    noise and a lead explains less than ``LEAST_SHARE`` of the squared residual force. They are left out together, since
    a lead may have been named as two of them.
    """
    if over := _overcorrected(case, final):
        return case.with_leads({k: rows for k, (rows, _) in over.items()}, [finding for _, finding in over.values()])
    if not final.trial.parts:
        return _taken_as_measured(case, search, final)
    with_states = [k for k in range(len(final.trial.parts)) if _adds_states(final, k)]
    if not with_states:
        return None
    trial, theta = final.trial, final.theta
    for k in reversed(with_states):
        trial, theta = trial.without(theta, k)
    leads = further_leads(replace(case.problem, system=model_of(trial, theta)), case.log, case.leads)
    if not leads:
        return None
    late, rest = _with_earlier_inputs(case, search, leads), final
    for k in reversed(with_states):
        rest = late.without(rest, k)
    if -_gained(final, rest) > BETTER * len(with_states):
        return None
    if is_far(rest) and min(lead.explained for lead in leads.values()) < LEAST_SHARE:
        return None
    replaced = [part.title for part in (final.trial.parts[k] for k in with_states)]
    return _taken_earlier(case, leads, replaced)


def _taken_as_measured(case: Case, search: Search, base: Fit) -> Case | None:
    """The case with inputs taken as measured, where free runs of the refit gain more than ``BETTER`` nats by that.

    The nats are tempered by the share of independent residuals. None where the force balance decides.
    """
    leads = _open_leads(case, half=True)
    if not leads or _gained(base, _with_earlier_inputs(case, search, leads).refit()) <= BETTER:
        return None
    return _taken_earlier(case, leads)


def late_on_trial(case: Case) -> Case | None:
    """The case with inputs taken earlier by leads above half a row that the force balance leaves open, if any."""
    leads = _open_leads(case, half=False)
    return _taken_earlier(case, leads) if leads else None


def late_is_better(late: Fit, final: Fit) -> bool:
    """Whether free runs decide for the leads on trial, with the effects that were found with them.

    They gain more than ``BETTER`` nats by them, tempered, and lose the share ``EXPLAINED`` of the squared error, which
    the leads do not explain of the force: else they may be a part of a force that the model lacks.
    """
    alike = late.residual.shape == final.residual.shape
    halved = noise_ratio(late) ** 2 <= (1 - EXPLAINED) * noise_ratio(final) ** 2
    return alike and halved and _gained(final, late) > BETTER


def _open_leads(case: Case, half: bool) -> dict[int, Lead]:
    leads = {} if case.faults or case.steady else undecided(case.problem, case.log, case.leads)
    return {k: lead for k, lead in leads.items() if (lead.rows <= ABOUT_HALF) == half}


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

"""Single events: an effect that predicts those of held-out data is accepted, and one that is left makes ``unknown``.

The tests on blocks cannot accept an effect that acts in one or two of them. Forward selection then ends with a best
candidate that fails the test of significance alone. It is accepted if, with the values of the training log, it predicts
the force residual in its events of the held-out data, and explains those of the training log (``single_events``). An
event that is left is no noise, so the verdict is not ``none``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from codegen.diagnosis.evidence.single_events import Event, Prediction, largest_event, predicted
from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.measure import driving_force_name
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.results import Fact
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.ranking import leader_first, ties
from codegen.diagnosis.verdict.answer import Answer
from codegen.diagnosis.verdict.statement import interval_in_words
from codegen.logs import Log


def shown_in_events(search: Search, outcome: Outcome, held_out: Problem, log: Log) -> tuple[Outcome, Fact] | None:
    """The outcome with the effect that events of the held-out data accept, and the fact that says so; None without one.

    Only the leader of the first round is tested, so that there is one hypothesis. ``log``: the held-out one.
    """
    in_doubt = [r for r in outcome.first if r.unsure]
    if outcome.parts or not in_doubt:
        return None
    leader, *others = leader_first(search, in_doubt)
    found = search.fitted_again(leader.found)
    shown = _prediction(search, outcome.base, found, held_out)
    if shown is None or shown.p > acceptance.ALPHA:
        return None
    alike = ties(search, [leader, *others])
    rivals = [r for r in alike if _prediction(search, outcome.base, r.found, held_out) is not None]
    named = replace(leader, why_not="", unsure=False, p=shown.p)
    first = (named, *(r for r in outcome.first if r is not leader))
    accepted = replace(outcome, first=first, unexplained=False).with_final(search, found, rivals)
    (start, stop), count = shown.spans[0], len(shown.spans)
    when, left = interval_in_words(start, stop, log), 1 - shown.share
    given = {"named": found.part.title, "count": count, "when": when, "left": left, "p": shown.p}
    return accepted, Fact.said("evidence", "predicts events", **given)


def _prediction(search: Search, base: Fit, found: Fit, held_out: Problem) -> Prediction | None:
    """An effect's prediction of held-out events; None unless it ``is_exact`` there and in those of the training log.

    An effect with states is not judged, since no log holds these.
    """
    if found.trial.adds_states:
        return None
    i = found.part.effect.coordinate(search.system, found.part.place)
    own, other = (predicted(problem, base.model, found.model, i) for problem in (search.problem, held_out))
    return other if own.is_exact and other.is_exact else None


def unknown_for_an_event(answer: Answer, problems: Mapping[str, tuple[Problem, Log]]) -> Answer:
    """The answer, ``unknown`` in place of ``none`` if its model leaves an event far above the usual residual.

    Args:
        problems: `training`, `held-out` → those data, and their log.
    """
    if answer.verdict != "none":
        return answer
    found: list[tuple[Event, str]] = []
    for data, (problem, log) in problems.items():
        for i, x in enumerate(answer.refit.positions):
            event = largest_event(problem, answer.refit, i)
            if event is not None:
                on = f" on {x.name}" if problem.used.shape[1] > 1 else ""
                found.append((event, f"{interval_in_words(event.start, event.stop, log)} of the {data} data{on}"))
    if not found:
        return answer
    event, where = max(found, key=lambda one: one[0].over_drive)
    given = {"over_drive": event.over_drive, "over_usual": event.over_usual, "drive": driving_force_name(answer.refit)}
    return replace(answer, verdict="unknown").noted(Fact.said("unexplained", "event", where=where, **given))

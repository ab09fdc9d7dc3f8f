"""The answer by effects that the force residual selects, for logs that free runs do not follow.

A free run integrates everything that the model lacks. Its error may be dominated by something that is not an effect,
such as jitter of the time stamps or a drift, and then no effect is accepted by free runs. The force residual at one
time does not depend on earlier times. Effects that it selects and free runs confirm are examined as others are. Effects
that free runs accept stay; on an arm those on its other joints are added.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import Search, joint_of
from codegen.diagnosis.results import Fact, Verdict, titles, worded
from codegen.diagnosis.selection.force_fits import ForceFits
from codegen.diagnosis.selection.force_selection import ForceSelection, selected_by_force
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.ranking import Ranked, credible
from codegen.diagnosis.selection.significance import hypotheses
from codegen.diagnosis.verdict.admission import Measured
from codegen.diagnosis.verdict.answer import Answer
from codegen.diagnosis.verdict.examination import with_estimate
from codegen.diagnosis.verdict.wrong_values import better_values


@dataclass(frozen=True, eq=False)
class ForceLed:
    """The examination of effects that the force residual selects.

    Attributes:
        measured: the errors of a model on held-out data.
        steady: whether the log runs at constant speed, at which parameters keep their tolerances.
        examined: the answer from an outcome of the selection by free runs, for an arm.
        checked: the answer after the last check on held-out data (``FinalCheck``). What it refuses must not replace
            effects that pass.
    """

    search: Search
    measured: Measured
    steady: bool
    examined: Callable[[Outcome], tuple[Answer, Outcome]]
    checked: Callable[[Answer, Fit], Answer]

    def accepted(self, outcome: Outcome, answer: Answer) -> tuple[Answer, Outcome]:
        """The answer with effects that the force residual accepts and free runs confirm; unchanged if there are none.

        Effects that free runs accepted stay. To those of an arm that is simulated joint by joint, the ones on its other
        joints are added (``with_other_joints``).

        Args:
            outcome: of the selection by free runs. answer: the answer from that outcome.
        """
        if answer.verdict != "unknown" and self.search.rigid is None:
            return answer, outcome
        found = selected_by_force(self.search, outcome.base)
        if not isinstance(found, ForceSelection):
            fact = (found,) if found is not None and answer.verdict == "unknown" else ()
            return answer.noted(*fact), outcome
        if answer.verdict == "unknown":
            return self._replaced(found, outcome, answer)
        return _joint_by_joint(found, outcome, answer, self.examined)

    def _replaced(self, found: ForceSelection, outcome: Outcome, answer: Answer) -> tuple[Answer, Outcome]:
        """The answer with the selected effects in place of those of free runs; unchanged if they are refused.

        Their values and intervals are those of the fit to the force residual. They are examined as others are: by their
        intervals, by a smooth curve over their own variable, and by held-out data. They are not accepted where wrong
        values of the spec's own parameters explain the free runs better.
        """
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
        estimated = with_estimate(self.search, led, plain, self.measured, found.fit)
        second = self.checked(estimated, led.final)
        if second.verdict != plain.verdict:
            return answer.noted(*_refused(answer, second)), outcome
        better = "" if self.steady else better_values(self.search, led)
        if better:
            said = Fact.said("not accepted", "values instead", named=titles(second.effects), values=better)
            return answer.noted(said), outcome
        return second.noted(Fact.said("evidence", "by force")), led


def _joint_by_joint(
    found: ForceSelection, outcome: Outcome, answer: Answer, examined: Callable[[Outcome], tuple[Answer, Outcome]]
) -> tuple[Answer, Outcome]:
    """The answer with the effects of ``with_other_joints``; unchanged if these are the same, or are refused."""
    fit = with_other_joints(found, outcome.final)
    if fit is outcome.final:
        return answer, outcome
    second, richer = examined(outcome.with_final(found.fits.search, fit, outcome.rivals))
    wanted = {p.key for p in fit.trial.parts}
    if second.verdict not in ("effect", "ambiguous") or {e.key for e in second.effects} != wanted:
        return answer, outcome
    return second, richer


def with_other_joints(found: ForceSelection, by_runs: Fit) -> Fit:
    """The fit to free runs of an arm with selected effects on the joints where these accept none.

    The joints are judged independently, and free runs must accept the added effects against no effect on their joint.
    This is necessary since the selection by free runs compares candidates on a few segments first, and fits only the
    best of them on all. A dead zone, which acts while the input is small, may not be among these.
    """
    search, fit = found.fits.search, by_runs
    many = hypotheses(found.fits.parts)
    known = {joint_of(search, part) for part in by_runs.trial.parts}
    for joint in dict.fromkeys(joint_of(search, part) for part in found.parts if joint_of(search, part) not in known):
        own = _on_joint(found.fits, found.fit, joint)
        moved, others = fit.values
        richer = search.with_parts(fit, moved, [*fit.trial.parts, *own.trial.parts], [*others, *own.values[1]])
        if credible(search, fit, richer, many):
            fit = richer
    return fit


def _on_joint(fits: ForceFits, fit: Fit, joint: int | None) -> Fit:
    """The fit to the force residual without the effects on other joints."""

    def elsewhere(fit: Fit) -> int | None:
        return max((k for k, p in enumerate(fit.trial.parts) if joint_of(fits.search, p) != joint), default=None)

    return fits.eliminated(fit, elsewhere)


def _refused(answer: Answer, by_force: Answer) -> tuple[Fact, ...]:
    """Why effects of the force residual are refused, where the verdict is `unknown` and the answer has others."""
    shown = [e.title for e in by_force.effects]
    if answer.verdict != "unknown" or shown == [e.title for e in answer.effects]:
        return ()
    given = {"named": " and ".join(shown), "one": len(shown) == 1}
    return tuple(replace(f, words=worded("refused by force", why=f.words, **given)) for f in by_force.against[:1])


def _with_first(first: Sequence[Ranked], named: Sequence[Ranked]) -> tuple[Ranked, ...]:
    """The table of candidates, with ``named`` in place of its entries for the same effects."""
    known = {(*r.part.key, r.part.names) for r in named}
    others = [r for r in first if (*r.part.key, r.part.names) not in known]
    return (*named, *others)

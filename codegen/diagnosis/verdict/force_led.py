"""The answer by effects that the force residual selects, for logs that free runs do not follow.

A free run integrates everything that the model lacks. Its error may be dominated by something that is not an effect,
such as jitter of the time stamps or a drift, and then no effect is accepted by free runs. The force residual at one
time does not depend on earlier times. Effects that it selects and free runs confirm are examined as others are. They
replace those that free runs accept only where the force residual objects to these.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.acceptance import random_signs
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import Search, joint_of
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.results import Fact, Verdict, titles, worded
from codegen.diagnosis.selection.force_fits import ForceFits
from codegen.diagnosis.selection.force_selection import (
    ForceSelection,
    confirmed,
    evidence_of_blocks,
    selected_by_force,
)
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.ranking import Ranked, credible, led_by
from codegen.diagnosis.selection.refusals import only_attenuates_noise
from codegen.diagnosis.selection.significance import hypotheses
from codegen.diagnosis.verdict.answer import Answer
from codegen.diagnosis.verdict.examination import with_estimate
from codegen.diagnosis.verdict.held_out import HeldOut
from codegen.diagnosis.verdict.wrong_values import better_values


@dataclass(frozen=True, eq=False)
class ForceLed:
    """The examination of effects that the force residual selects.

    Attributes:
        steady: whether the log runs at constant speed, at which parameters keep their tolerances.
        examined: the answer from an outcome of the selection by free runs, for an arm.
        checked: the answer after the last check on held-out data (``FinalCheck``). What it refuses must not replace
            effects that pass.
    """

    search: Search
    held_out: HeldOut
    steady: bool
    examined: Callable[[Outcome], tuple[Answer, Outcome]]
    checked: Callable[[Answer, Fit], Answer]

    def accepted(self, outcome: Outcome, answer: Answer, leader: Part | None = None) -> tuple[Answer, Outcome]:
        """The answer with effects that the force residual accepts and free runs confirm; unchanged if there are none.

        Effects that free runs accepted are replaced only if ``against_free_runs`` gives a reason; of an arm that is
        simulated joint by joint those of each joint apart (``with_shown_on_joints``). Held-out data may refuse some of
        the selected effects that tie (``without_refused_ties``). Nor are they replaced by effects that only attenuate
        the noise of the logged inputs, as a lag does: the force residual contains less of it then.

        Args:
            outcome: of the selection by free runs. answer: the answer from that outcome.
            leader: the first effect of the tied ones that free runs find. If the answer has another one, since the
                leader was refused, and the force residual selects it in a form that passes, the two remain tied.
        """
        found = selected_by_force(self.search, outcome.base)
        if not isinstance(found, ForceSelection):
            fact = (found,) if found is not None and answer.verdict == "unknown" else ()
            return answer.noted(*fact), outcome
        found, refused = without_refused_ties(found, self.held_out)
        if answer.verdict == "unknown":
            return self._replaced(found, outcome, answer, refused, "alone no effect would be accepted")
        if self.search.rigid:
            return _joint_by_joint(found, outcome, answer, self.examined)
        second_choice = _second_choice(found, outcome, leader)
        if second_choice:
            found = replace(found, rivals=(*found.rivals, *second_choice))
            answer = replace(answer, remarks=tuple(fact for fact in answer.remarks if fact.topic != "not accepted"))
            against = "since the better one is refused in the form that fits them best"
        else:
            against = against_free_runs(found, outcome.final)
        by_runs = self.search.on_its_record(outcome.final)
        of_same_data = by_runs.is_of_same_data(found.run)
        if not against or (of_same_data and only_attenuates_noise(self.search, by_runs, found.run)):
            return answer, outcome
        named = " and ".join(e.kind for e in answer.effects)
        return self._replaced(found, outcome, answer, refused, f"alone {named} would be named, {against}")

    def _replaced(
        self, found: ForceSelection, outcome: Outcome, answer: Answer, refused: Sequence[Fact], alone: str
    ) -> tuple[Answer, Outcome]:
        """The answer with the selected effects in place of those of free runs; unchanged if they are refused.

        Their values and intervals are those of the fit to the force residual. They are examined as others are: by their
        intervals, by a smooth curve over their own variable, and by held-out data. They are not accepted where wrong
        values of the spec's own parameters explain the free runs better.

        Args:
            refused: facts on tied effects that held-out data refuse.
            alone: what free runs alone would name, in words.
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
        estimated = with_estimate(self.search, led, plain, self.held_out.measured, found.fit)
        second = self.checked(estimated, led.final)
        if second.verdict != plain.verdict:
            return answer.noted(*_refused(answer, second)), outcome
        better = "" if self.steady else better_values(self.search, led)
        if better:
            said = Fact.said("not accepted", "values instead", named=titles(second.effects), values=better)
            return answer.noted(said), outcome
        return second.noted(Fact.said("evidence", "by force", alone=alone), *refused), led


def _second_choice(found: ForceSelection, outcome: Outcome, leader: Part | None) -> list[Ranked]:
    """The candidate that the answer has in place of a leader which the force residual selects; empty otherwise."""
    accepted = {p.key for p in outcome.parts}
    if leader is None or leader.key in accepted:
        return []
    if leader.key not in {p.key for p in found.parts}:
        return []
    return [r for r in outcome.first if {p.key for p in r.found.trial.parts} == accepted]


def _joint_by_joint(
    found: ForceSelection, outcome: Outcome, answer: Answer, examined: Callable[[Outcome], tuple[Answer, Outcome]]
) -> tuple[Answer, Outcome]:
    """The answer with the effects of ``with_shown_on_joints``; unchanged if these are the same, or are refused."""
    fit, remarks = with_shown_on_joints(found, outcome.final)
    if fit is outcome.final:
        return answer, outcome
    leader = outcome.parts[0] in fit.trial.parts
    second, richer = examined(outcome.with_final(found.fits.search, fit, outcome.rivals if leader else ()))
    wanted = {p.key for p in fit.trial.parts}
    if second.verdict not in ("effect", "ambiguous") or {e.key for e in second.effects} != wanted:
        return answer, outcome
    return second.noted(*remarks), richer


def with_shown_on_joints(found: ForceSelection, by_runs: Fit) -> tuple[Fit, tuple[Fact, ...]]:
    """The fit to free runs with, on each joint of an arm, the better of two selections; and remarks on what changed.

    The joints are judged independently. On a joint where free runs accept no effect, those that the force residual
    selects are added. On a joint where they accept some and the force residual objects to these, its own replace them.
    In both cases free runs must accept them against no effect on that joint.

    This is necessary since the selection by free runs compares candidates on a few segments first, and fits only the
    best of them on all. A dead zone, which acts while the input is small, may not be among these, and another effect is
    then selected on its joint.
    """
    search, fit, remarks = found.fits.search, by_runs, list[Fact]()
    many = hypotheses(found.fits.parts)
    for joint in dict.fromkeys(joint_of(search, part) for part in found.parts):
        own = _on_joint(found.fits, found.fit, joint)
        known = [p for p in by_runs.trial.parts if joint_of(search, p) == joint]
        words = _against_on_joint(found, by_runs, own, joint) if known else ""
        if known and not words:
            continue
        without = fit
        for part in known:
            without = search.without(without, without.trial.parts.index(part))
        moved, others = without.values
        parts = [*without.trial.parts, *own.trial.parts]
        richer = search.with_parts(without, moved, parts, [*others, *own.values[1]])
        if credible(search, without, richer, many):
            fit = richer
            named = titles(known)
            remarks += [Fact("evidence", f"By free runs alone {named} would be named, {words}")] if known else []
    return fit, tuple(remarks)


def _on_joint(fits: ForceFits, fit: Fit, joint: int | None) -> Fit:
    """The fit to the force residual without the effects on other joints."""

    def elsewhere(fit: Fit) -> int | None:
        return max((k for k, p in enumerate(fit.trial.parts) if joint_of(fits.search, p) != joint), default=None)

    return fits.eliminated(fit, elsewhere)


def _against_on_joint(found: ForceSelection, by_runs: Fit, own: Fit, joint: int | None) -> str:
    """``against_free_runs`` of the effects on one joint alone."""
    trial, theta = by_runs.trial, by_runs.theta
    while others := [k for k, p in enumerate(trial.parts) if joint_of(found.fits.search, p) != joint]:
        trial, theta = trial.without(theta, others[-1])
    alone = replace(by_runs, runner=replace(by_runs.runner, trial=trial), theta=theta)
    return against_free_runs(replace(found, fit=own), alone)


def _refused(answer: Answer, by_force: Answer) -> tuple[Fact, ...]:
    """Why effects of the force residual are refused, where the verdict is `unknown` and the answer has others."""
    shown = [e.title for e in by_force.effects]
    if answer.verdict != "unknown" or shown == [e.title for e in answer.effects]:
        return ()
    given = {"named": " and ".join(shown), "one": len(shown) == 1}
    return tuple(replace(f, words=worded("refused by force", why=f.words, **given)) for f in by_force.against[:1])


def without_refused_ties(found: ForceSelection, held_out: HeldOut) -> tuple[ForceSelection, tuple[Fact, ...]]:
    """The selection without those of its tied first effects that held-out data refuse, and facts on the refused ones.

    The first of the remaining effects then leads the selection, if free runs confirm it.
    """
    if not found.rivals or found.rounds[0].ranked[0].part != found.parts[0]:
        return found, ()
    fits, first = found.fits, found.rounds[0]
    leading = [first.ranked[0], *found.rivals]
    tied = [found.fit, *(fits.led_by(one.found, found.fit) for one in found.rivals)]
    kept, words = held_out.kept(tied)
    led = replace(found, rivals=tuple(leading[k] for k in kept[1:]))
    if kept[0]:
        fit = tied[kept[0]]
        if confirmed(fits, fit) is not fit:
            return found, ()
        ranked = tuple(led_by(leading[kept[0]], first.ranked))
        led = replace(led, fit=fit, rounds=(replace(first, ranked=ranked), *found.rounds[1:]))
    return led, words


def against_free_runs(found: ForceSelection, by_runs: Fit) -> str:
    """The objection of the force residual to the effects that free runs accept, in words; empty if there is none.

    Backlash is exempt, since no log shows where the load is within the gap.
    """
    trial, fits = by_runs.trial, found.fits
    known, own = _forms(trial.parts), _forms(found.parts)
    larger = [f"{' and '.join(sorted(known[p] - own[p]))} of {p[0]}" for p in known if p in own and known[p] > own[p]]
    if (known.keys() == own.keys() and not larger) or any(t.gap != 0 for t in trial.changed.transmissions):
        return ""
    needed = _needed(fits, fits.fit(trial, by_runs.theta))
    gained = evidence_of_blocks(*fits.where_they_differ(needed, found.fit))
    not_needed = sorted(kind for kind, _ in known.keys() - _forms(needed.trial.parts).keys())
    if (not_needed or larger) and random_signs(-gained.t) > acceptance.TIE_LEVEL:
        return f"but the residual force shows no {' and '.join(not_needed or larger)}"
    leaves_more = random_signs(gained.t) <= acceptance.TIE_LEVEL and not fits.nearly_alike(needed, found.fit)
    return "which leaves more of the residual force" if leaves_more else ""


def _forms(parts: Sequence[Part]) -> dict[tuple[str, str], frozenset[str]]:
    """(kind, on) → names of the parameters of its form."""
    return {p.key: frozenset(p.names) for p in parts}


def _needed(fits: ForceFits, fit: Fit) -> Fit:
    """The fit to the force residual with the effects that are needed: backward elimination from ``fit``.

    The effect that removes the smallest share of the residual is left out, until this share is significant and at least
    ``acceptance.ELSEWHERE``, or one effect is left.
    """

    def needless(fit: Fit) -> int | None:
        if (count := len(fit.trial.parts)) < 2:
            return None
        shown = [evidence_of_blocks(*fits.where_they_differ(fits.without(fit, k), fit)) for k in range(count)]
        k = min(range(count), key=lambda k: shown[k].share)
        return (
            None if shown[k].share >= acceptance.ELSEWHERE and random_signs(shown[k].t) <= acceptance.TIE_LEVEL else k
        )

    return fits.eliminated(fit, needless)


def _with_first(first: Sequence[Ranked], named: Sequence[Ranked]) -> tuple[Ranked, ...]:
    """The table of candidates, with ``named`` in place of its entries for the same effects."""
    known = {(*r.part.key, r.part.names) for r in named}
    others = [r for r in first if (*r.part.key, r.part.names) not in known]
    return (*named, *others)

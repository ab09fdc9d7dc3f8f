"""The verdict of a diagnosis with its models, and how it follows from an outcome and from the force that is left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite

from codegen.diagnosis.evidence.force_gain import ForceGain, force_gain
from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.acceptance import LEAST_SHARE, is_far
from codegen.diagnosis.fit.drive import residual_without_levels
from codegen.diagnosis.fit.measure import driving_force_name, force_errors
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.results import ErrorFigures, Fact, FoundEffect, ParameterError, Remainder, Verdict
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.ranking import Ranked
from codegen.mechanics.system import System

LEAST_EXPLAINED = 0.7
"""Largest share of the squared simulation error that a candidate without significance may remove where nothing is
missing. A period is searched on the whole training log, so noise is fitted to some extent on held-out parts too."""


@dataclass(frozen=True, eq=False)
class Answer:
    """A verdict and the systems that go with it.

    Attributes:
        effects: the effects of the verdict, accepted or not.
        errors: parameter errors in the model that is written.
        against: why the effects are not accepted, the decisive reason first.
        remarks: further facts for the reader.
        stroke: in words, the motion that would show the period of the refused effect; else empty.
    """

    verdict: Verdict
    effects: tuple[FoundEffect, ...]
    refit: System
    augmented: System
    figures: tuple[ErrorFigures, ErrorFigures, ErrorFigures]
    errors: tuple[ParameterError, ...] = ()
    against: tuple[Fact, ...] = ()
    remarks: tuple[Fact, ...] = ()
    stroke: str = ""

    @property
    def adopted(self) -> System | None:
        """The system whose values are written into the spec; None if the spec is unchanged."""
        if self.verdict == "unfit":
            return None
        return self.augmented if self.verdict == "effect" else self.refit

    def noted(self, *facts: Fact) -> Answer:
        """The answer with further remarks."""
        return replace(self, remarks=(*self.remarks, *facts))

    def unknown(self, effects: tuple[FoundEffect, ...], against: tuple[Fact, ...]) -> Answer:
        """The verdict ``unknown`` with effects that are not accepted, and the reasons."""
        return replace(self, verdict="unknown", effects=effects, against=against)

    def refused(self, words: str) -> Answer:
        """The verdict ``unknown`` and the model without the effects, which are candidates; ``words``: why."""
        kept = tuple(fact for fact in self.remarks if fact.topic not in ("values", "evidence"))  # not on these effects
        figures = (*self.figures[:2], self.figures[1])
        plain = replace(self, augmented=self.refit, figures=figures, errors=(), remarks=kept)
        return plain.unknown(self.effects, (Fact("not accepted", words),))


def verdict_of(outcome: Outcome, faults: bool) -> Verdict:
    """The verdict by forward selection; ``unfit`` where log and spec do not fit together."""
    if faults:
        return "unfit"
    if not outcome.parts:
        return without_effects(outcome)
    return "ambiguous" if outcome.rivals else "effect"


def is_small(left: Sequence[Remainder], material: float) -> bool:
    """Whether the part of the residual force that the motion predicts is below the material share on every coordinate.

    Coordinates that move too little to be judged are left out; where none is judged the answer is no.
    """
    judged = [r.material for r in left if isfinite(r.material)]
    return bool(judged) and max(judged) < material


def settled_by_free_runs(final: Fit, share: float, problem: Problem, refit: System, augmented: System) -> bool:
    """``free_runs_settle`` for effects that remove this share of the squared free-run residual."""
    return acceptance.free_runs_settle(final, share, _gain(problem, refit, augmented).left)


def _gain(problem: Problem, before: System, after: System) -> ForceGain:
    one, other = (residual_without_levels(problem, s) for s in (before, after))
    return force_gain(problem, one, other)


def force_agrees(final: Fit, problem: Problem, refit: System, augmented: System) -> bool:
    """Whether the force residual confirms effects that free runs accept: its square falls by ``LEAST_SHARE`` too.

    Not asked of backlash, since in the gap no log shows where the load is. At the noise of free runs it is mostly noise
    of the differentiation and must only not contradict; there a load behind a spring is not tested.
    """
    if any(t.gap != 0 for t in augmented.transmissions):
        return True
    near = not is_far(final)
    if near and augmented.transmissions:
        return True
    before, after = (force_errors(s, problem.motion, problem.used)[2] for s in (refit, augmented))
    if after**2 <= (1 - acceptance.LEAST_SHARE) * before**2:
        return True
    return near and _gain(problem, augmented, refit).p > acceptance.TIE_LEVEL


def explains_material_force(problem: Problem, refit: System, augmented: System) -> bool:
    """Whether effects explain a material force of a log: √(r₀² − r²) is at least ``problem.material``.

    r₀ and r are the residual forces without and with them, over the drive force.
    """
    before, after = (force_errors(s, problem.motion, problem.used)[2] for s in (refit, augmented))
    return bool(before**2 - after**2 >= problem.material**2)


def without_effects(outcome: Outcome) -> Verdict:
    """The verdict if no effect is accepted: ``unknown`` if the refit leaves a material misfit above the noise."""
    base = outcome.base
    lost = not acceptance.near_noise(base) and acceptance.misfit(base) > acceptance.LEAST_SIZE
    return "unknown" if lost else "none"


def by_remainder(verdict: Verdict, left: Sequence[Remainder], material: float) -> Verdict:
    """The verdict after a test of the remaining force residual; ``effect`` and ``ambiguous`` are not changed.

    ``unknown`` becomes ``none`` if the part that the motion predicts is immaterial, no material change in time is left,
    and the remainder is below the drive force. ``none`` becomes ``unknown`` if such a change or a large part is left.
    """
    if verdict not in ("none", "unknown"):
        return verdict
    changing = any(r.is_changing(material) for r in left)
    if verdict == "unknown":
        explains = not any(r.exceeds_drive for r in left)
        return "none" if is_small(left, material) and not changing and explains else "unknown"
    # Free runs near a large noise, such as that of a measured speed, do not show a large predicted part.
    far_off = any(r.nature(material) == "structured" and r.material**2 >= LEAST_SHARE for r in left)
    return "unknown" if changing or far_off else "none"


def unknown_above_drive(answer: Answer, left: Sequence[Remainder], problem: Problem) -> Answer:
    """The answer, ``unknown`` in place of ``none`` if its model leaves more than the drive force where none is judged.

    A remainder of few samples is not judged, and free runs of a log with a coarse position may end at its noise with
    any inertia. A residual as large as the drive force is what a model without any force but the drive leaves.
    """
    if answer.verdict != "none" or all(isfinite(r.material) for r in left):
        return answer
    relative = force_errors(answer.refit, problem.motion, problem.used)[2]
    if relative < 1 or not isfinite(relative):  # infinite where neither an input nor the inertia acts
        return answer
    given = {"relative": relative, "drive": driving_force_name(problem.system)}
    return replace(answer, verdict="unknown").noted(Fact.worded("unexplained", "above the drive", **given))


def unknown_for_a_candidate(answer: Answer, tried: Sequence[Ranked], material: float) -> Answer:
    """The answer, ``unknown`` in place of ``none`` if a candidate explains most of what the model leaves.

    Such a candidate fails the test of significance alone: the log has too few parts for the number of hypotheses, or
    few of them decide. It may not be named, but neither does the log show that nothing is missing.

    Args:
        tried: candidates of the first round. material: least share of the drive force that counts.
    """
    if answer.verdict != "none":
        return answer
    found = [r for r in tried if r.insignificant and r.evidence.share > LEAST_EXPLAINED and r.size >= material]
    if not found:
        return answer
    best = max(found, key=lambda r: r.evidence.share)
    fact = Fact.worded("unexplained", "in doubt", named=best.part.title, share=best.evidence.share)
    return replace(answer, verdict="unknown").noted(fact)

"""The answer with an effect that the forces of all joints of an arm show, where no joint's own forces show one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from codegen.base.significant import in_percent
from codegen.diagnosis.fit import credit
from codegen.diagnosis.fit.credit import evidence_of, random_signs
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.results import Fact
from codegen.diagnosis.selection.across_joints import found_across_joints
from codegen.diagnosis.selection.candidate_fits import every_part
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.ranking import led_by
from codegen.diagnosis.selection.significance import hypotheses
from codegen.diagnosis.verdict.answer import Answer


def credited_across_joints(
    search: Search,
    outcome: Outcome,
    answer: Answer,
    examined: Callable[[Outcome], tuple[Answer, Outcome]],
    material: float,
) -> tuple[Answer, Outcome]:
    """The answer with the effect of ``found_across_joints``; unchanged if there is none, or if a check refuses it.

    Free runs of all joints together must credit it too, and it is examined as other effects are: by its interval, and
    by held-out data on all joints and on its own. A machine that is simulated as a whole has no joints to be judged
    apart, so nothing is tried there. It takes the place of effects on single joints that were refused.
    """
    if search.rigid is None or search.system.degrees_of_freedom < 2:
        return answer, outcome
    found = found_across_joints(search, outcome.base, material)
    if found is None:
        return answer, outcome
    moved, values = found.found.values
    final = search.with_parts(outcome.base, moved, found.found.trial.parts, values)
    if not _credited_by_runs(search, outcome.base, final):
        return answer, outcome
    led = outcome.with_final(search, final, ())
    led = replace(led, first=tuple(led_by(found, outcome.first)), unexplained=False)
    second, led = examined(led)
    if second.verdict != "effect":
        return answer, outcome
    removed = in_percent(found.evidence.share)
    words = (
        f"The forces of all joints together show it: it removes {removed} of their squared residual. On its own joint "
        "refitted friction and masses take its place, which then fit worse at other joints"
    )
    return second.noted(Fact("evidence", words)), led


def _credited_by_runs(search: Search, base: Fit, final: Fit) -> bool:
    """Whether free runs of all joints together credit the fit, by a sign test for all candidates (Bonferroni)."""
    soft, before = search.with_noise_floor(base)
    shown = evidence_of(before, soft.fitted_again(final))
    many = hypotheses(every_part(search, ()))
    return shown.share >= credit.LEAST_SHARE and many * random_signs(shown.t) <= credit.ALPHA

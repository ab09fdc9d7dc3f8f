"""An effect on one joint of an arm that is shown by the forces of all joints, not by those of its own.

Candidates are judged at the joint on which they act. There the refitted friction and the masses of the links may take
the effect: a drive gain on its joint's torque is nearly a change of its inertia, gravity and friction. The links'
values then fit worse at another joint, whose forces contain the same masses. Here each candidate is fitted to the
force residual of all joints, with all values free, and is judged on the sum of its squares over all joints.
"""

from __future__ import annotations

from codegen.diagnosis.evidence.force_gain import force_gain
from codegen.diagnosis.evidence.residual_regression import remainders
from codegen.diagnosis.fit import credit
from codegen.diagnosis.fit.credit import evidence_of, random_signs
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.residual import residual_without_levels
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.starting_values import ForceStart
from codegen.diagnosis.selection.force_fits import ForceFits
from codegen.diagnosis.selection.force_selection import FITTED, drive_kept, fit_in_addition, judged
from codegen.diagnosis.selection.ranking import Ranked, twins
from codegen.diagnosis.selection.refusals import is_possible
from codegen.diagnosis.selection.significance import hypotheses


def found_across_joints(search: Search, base: Fit, material: float) -> Ranked | None:
    """The effect that the forces of all joints credit, clearly better than every rival on any joint; None if none.

    Only effects with one parameter are tried, since a curve on one joint can imitate a wrong mass at the others. The
    p-value counts all candidates on all joints (Bonferroni).

    Args:
        base: the refit of the declared structure by free runs, of an arm that is simulated joint by joint.
        material: share of the RMS of the drive force from which on a force matters.
    """
    fits = ForceFits(search, base)
    plain, candidates = fits.plain, fits.candidates
    start, begun = ForceStart(search.problem, plain, True, known=fits.by_links), []
    for part in candidates.parts:
        trial = plain.trial.with_part(part)
        found = start.best(trial, candidates.covered(part)) if len(part.names) == 1 else None
        if found is not None and (kept := drive_kept(fits, plain, trial, found[1])) > 0:
            begun.append((found[0] / kept**2, kept, found[1], trial))
    begun.sort(key=lambda one: one[0])
    chosen = [one for rank, one in enumerate(begun) if rank < FITTED or one[1] < 1 - credit.LEAST_SHARE]
    fitted = [fit_in_addition(fits, plain, trial, theta) for _, _, theta, trial in chosen]
    many = hypotheses(candidates.parts)
    ranked = [judged(fits, plain, f, many, everywhere=True) for f in fitted if is_possible(search, f)]
    ranked.sort(key=lambda r: (bool(r.why_not), r.found.cost))
    if not ranked or ranked[0].why_not:
        return None
    best = ranked[0].found
    same = {(best.part.kind, best.part.on), *twins(best.part, best)}
    others = (r.found for r in ranked[1:] if not r.why_not or r.unsure)
    rivals = [other for other in others if (other.part.kind, other.part.on) not in same]
    if not all(_is_better(search, best, rival) for rival in rivals):
        return None
    # A long log prefers one of two incomplete models by any small difference, which says nothing of the truth.
    alike = any(fits.nearly_alike(rival, best) for rival in rivals)
    return None if alike and not _is_complete(search, best, material) else ranked[0]


def _is_better(search: Search, best: Fit, rival: Fit) -> bool:
    """Whether the forces of all joints prefer a fit to a rival's by more than chance, each joint with its own noise."""
    shown = evidence_of(rival, best, floored=False)
    if random_signs(shown.t) > credit.TIE_LEVEL:
        return False
    one, other = (residual_without_levels(search.problem, fit.model) for fit in (best, rival))
    return force_gain(search.problem, other, one).p_of_rivals() <= credit.TIE_LEVEL


def _is_complete(search: Search, fit: Fit, material: float) -> bool:
    """Whether the motion and the time explain no material part of the force that a fit leaves on any joint."""
    left = remainders(fit.model, search.motion, search.problem.used)
    return not any(r.nature(material) == "structured" or r.is_changing(material) for r in left)

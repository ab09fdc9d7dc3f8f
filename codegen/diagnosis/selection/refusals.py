"""The tests that refuse a candidate, each with its reason in words.

A candidate is refused for too small a gain or force, for values that are impossible or that the log cannot show, if
another effect or refitted values explain it, and if the force residual contradicts the free runs. Two tests have
modules of their own: ``attenuated_noise.py`` and ``significance.py``.
"""

from collections.abc import Mapping

import numpy as np

from codegen.base.arrays import Array
from codegen.base.significant import in_percent
from codegen.diagnosis.evidence.force_gain import ForceCriterion
from codegen.diagnosis.evidence.reservations import is_level_or_line, never_passed, takes_the_level
from codegen.diagnosis.evidence.residual_regression import inertia_noise
from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.acceptance import Evidence, is_far, size_of
from codegen.diagnosis.fit.drive import drive_in_motion, drive_left, drive_shares, residual_at_drive
from codegen.diagnosis.fit.measure import driving_force_name
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import Part, with_effects, with_values
from codegen.diagnosis.results import FoundEffect, worded
from codegen.mechanics.system import System

LEAST_DRIVE = 0.1
"""Least RMS drive force with an effect over that without; less does not move the machine."""
CONTRADICTED = 1.5
"""Factor on the squared force residual from which on a candidate is refused, whatever free runs show."""
FORM_ERROR = 0.1
"""Least force of an effect over that of another one on the same coordinate that depends on the same variable."""


def why_refused(before: ForceCriterion, after: ForceCriterion, evidence: Evidence, size: float) -> str:
    """The first test that a candidate fails, in words; empty if it passes all.

    ``contradicted_by_force``, ``uncovered``, ``only_attenuates_noise`` and the test of significance come after these.
    """
    search, found = after.search, after.fit
    if evidence.gain <= 0:
        return "does not reduce the simulation error on held-out parts of the log"
    if evidence.share < acceptance.LEAST_SHARE:
        needed, removed = in_percent(acceptance.LEAST_SHARE), in_percent(evidence.share)
        return f"removes {removed} of the squared simulation error on held-out parts; {needed} is needed"
    if is_too_small(search, found, size):
        return too_small_in_words(search, found, size)
    return (
        impossible(search, found, before.fit.model)
        or absorbed_by_refit(before, after)
        or only_reduces_drive(before, after, evidence)
        or corrects_a_form(before, after)
    )


def is_too_small(search: Search, found: Fit, size: float) -> bool:
    """Whether a candidate of this size is no effect, whatever it explains."""
    return size < _least_size(search, found)


def least_force(problem: Problem) -> float:
    """Least force of an effect over the drive force: ``LEAST_SIZE``, or less where the user says that less matters."""
    return min(acceptance.LEAST_SIZE, max(problem.material, acceptance.LEAST_NET))


def _least_size(search: Search, found: Fit) -> float:
    return acceptance.LEAST_NET if found.trial.adds_states else least_force(search.problem)


def too_small_in_words(search: Search, found: Fit, size: float) -> str:
    share, least = in_percent(size), in_percent(_least_size(search, found))
    return f"is too small to matter: {share} of the {driving_force_name(search.system)}; {least} is needed"


def matters(search: Search, found: Fit, base: Fit) -> bool:
    """Whether a candidate is large enough, compared with the drive force, to be an effect."""
    return not is_too_small(search, found, relative_size(search, found, base))


def relative_size(search: Search, found: Fit, base: Fit) -> float:
    """Force of the effect over the drive force along the motion; if it is not defined, its change of the prediction.

    A fit to the force residual has no prediction. There the effect is evaluated with refitted friction levels, since it
    may be larger than the declared one.
    """
    part = found.part
    if found.of_forces:
        refitted = _refitted(search.system, found)
        richer = with_effects(refitted, [FoundEffect(part.kind, part.on, found.parameters, {})])
        without, with_it = (inverse_dynamics_residual(system, search.motion) for system in (refitted, richer))
        return search.drive.share(with_it - without)
    if found.trial.adds_states or not part.effect.admissible(search.system, part.place, found.parameters):
        return size_of(found, base)
    return force_share(search, found.part, found.parameters)


def force_share(search: Search, part: Part, values: Mapping[str, float]) -> float:
    """Force of an effect over the drive force along the motion."""
    richer = with_effects(search.system, [FoundEffect(part.kind, part.on, values, {})])
    return search.drive.share(inverse_dynamics_residual(richer, search.motion) - search.drive.residual)


def is_possible(search: Search, found: Fit) -> bool:
    """Whether the log covers the effect's period, and its values are possible (``impossible``)."""
    return not (uncovered(search, found.part, found.parameters) or impossible(search, found, search.system))


def impossible(search: Search, found: Fit, plain: System) -> str:
    """Objection to values out of the effect's bounds, or that the log cannot show; else empty.

    ``plain``: the model without the effect, whose friction levels are compared.
    """
    if not admissible(search.system, found):
        return "fits only with unphysical values"
    return (
        _unvarying(search, found.part, found.parameters)
        or acts_as_its_limit(search, found)
        or takes_the_level(search.problem, plain, found.model)
    )


def admissible(system: System, found: Fit) -> bool:
    """Whether the fitted values lie within the effect's bounds, in the declared system with the refitted ones."""
    values = found.parameters
    if not all(np.isfinite(v) for v in values.values()):
        return False
    return found.part.effect.admissible(_refitted(system, found), found.part.place, values)


def _refitted(system: System, found: Fit) -> System:
    """The declared system with the refitted values of a fit."""
    refitted_values = found.values[0].tolist()
    return with_values(system, dict(zip((s.name for s in found.trial.refitted_symbols), refitted_values, strict=True)))


def uncovered(search: Search, part: Part, values: Mapping[str, float]) -> str:
    """Objection if the log covers less than the effect's period; else empty."""
    if never_passed(search.system, search.motion, part, values):
        return "has a period longer than the distance that the log covers, so nothing shows that it repeats"
    return ""


def _unvarying(search: Search, part: Part, values: Mapping[str, float]) -> str:
    """Why the log cannot show that an effect varies, or that it is there at all; else empty."""
    if is_level_or_line(search.system, search.motion, part, values):
        return "varies only outside the speeds of the log, within which it is a level or a line"
    here = part.effect.coordinate(search.system, part.place)
    return part.effect.unseen(values, float(search.record.noise[here]))


def acts_as_its_limit(search: Search, found: Fit) -> str:
    """Objection if the last effect's force is that of a simpler one to within ``acceptance.LEAST_SIZE``; else empty.

    What refitted values and a constant force explain of the difference does not count. Example: a load behind a spring
    that is too soft to move it is an inertia error with two needless parameters. What the spring adds is nearly
    constant: its deflection at the start of the log, which is not logged.
    """
    part, refitted = found.part, _refitted(search.system, found)
    limit = part.effect.limit(refitted, part.place, found.parameters)
    if limit is None:
        return ""
    kind, values = limit
    *others, _ = [FoundEffect(p.kind, p.on, v, {}) for p, v in zip(found.trial.parts, found.values[1], strict=True)]
    simpler = with_effects(refitted, [*others, FoundEffect(kind, part.on, values, {})])
    difference = residual_at_drive(found.model, search.motion) - residual_at_drive(simpler, search.motion)
    own = search.drive.share(ForceCriterion(search, found).beyond_values(difference))
    if own >= acceptance.LEAST_SIZE:
        return ""
    own_share = f"{in_percent(own)} of the {driving_force_name(search.system)}"
    return f"acts as {kind}: what it adds to that and to a constant force is {own_share}"


def absorbed_by_refit(before: ForceCriterion, after: ForceCriterion) -> str:
    """Objection if refitted values explain the effect's force to within ``LEAST_NET``; else empty."""
    if after.fit.trial.adds_states:
        return ""
    net = before.search.drive.share(after.residual - before.residual)
    if net >= acceptance.LEAST_NET:
        return ""
    change = f"{in_percent(net)} of the {driving_force_name(before.search.system)}"
    return f"is absorbed by refitted values: it changes the refitted force by {change} only"


def only_reduces_drive(before: ForceCriterion, after: ForceCriterion, evidence: Evidence) -> str:
    """Objection to an effect that gains only by a reduction of the drive force; else empty.

    Let p be the constant factor by which the effect scales the drive force of a coordinate (a gain, friction in
    proportion to the drive), and q the remaining share of the drive force apart from p (dead zone, saturation). The
    tests with q skip coordinates whose drive force the effect does not reduce. Refused are

    - less than ``LEAST_DRIVE`` of the drive force: with a dead zone wider than the commands, only inertia remains to be
      explained, which slow motion hardly shows; not if the motion takes what is left (``_explains_its_drive``);
    - r² > ``CONTRADICTED`` (q² r₀² + (1 − q²) n²), with r and r₀ the RMS force residual with and without the effect and
      n the noise of M a. With a saturation far below the commands the free runs of a heavy machine end near the noise
      although almost no force is left: they continue at their start speed;
    - far from the noise, an effect with which neither r² nor the squared free-run error is ``LEAST_SHARE`` below what
      the factor q² alone gives;
    - an effect with which neither is that much below what p² alone gives, since p scales noise and structure alike.
    """
    motion = before.search.motion
    acting = drive_shares(after.fit.model, before.fit.model, motion, before.search.problem.used)
    least = float(np.min(acting))
    left, had = drive_left(after.fit.model, motion), drive_left(before.fit.model, motion)
    scales = left / had  # p
    if least < LEAST_DRIVE and not _explains_its_drive(after, acting, scales):
        return f"weakens the drive force to {in_percent(least)}: too little to move the machine"
    remaining = acting / scales  # q
    if _leaves_more(before, after, remaining, CONTRADICTED):
        return f"weakens the drive force to {in_percent(least)}, of which a larger share stays unexplained"
    small, far = 1 - acceptance.LEAST_SHARE, is_far(after.fit)
    by_runs = 1 - evidence.share > small * float(np.min(remaining)) ** 2
    if far and by_runs and _leaves_more(before, after, remaining, small):
        return f"weakens the drive force to {in_percent(least)}, of which it explains no larger share"
    scale = float(np.min(scales))
    if scale >= 1 - acceptance.LEAST_SHARE or 1 - evidence.share <= (1 - acceptance.LEAST_SHARE) * scale**2:
        return ""
    if after.over(before).left <= 1 - acceptance.LEAST_SHARE:
        return ""
    return f"weakens the drive force for the motion to {in_percent(left.min())}, of which it explains no larger share"


def _explains_its_drive(after: ForceCriterion, acting: Array, scales: Array) -> bool:
    """Whether the motion takes the drive force that an effect leaves, where that is little; not for a constant factor.

    A limit that commands exceed many times, as those of a stiff position loop after a step, leaves little of them, but
    that moves the machine: of what friction levels do not explain of it, ``acceptance.LEAST_SHARE`` is left at most.
    """
    search, model = after.search, after.fit.model
    for i in np.flatnonzero(acting < LEAST_DRIVE).tolist():
        used = search.problem.used[:, i]
        if scales[i] < 1 - acceptance.LEAST_SHARE or not used.any():
            return False
        drive = drive_in_motion(model, search.motion, used, i)
        if np.sum(after.without_levels[used, i] ** 2) > acceptance.LEAST_SHARE * np.sum(drive**2):
            return False
    return True


def _leaves_more(before: ForceCriterion, after: ForceCriterion, remaining: Array, times: float) -> bool:
    """Whether r² > times (q² r₀² + (1 − q²) min(n², r₀²)) on a coordinate whose drive force falls to q."""
    search = before.search
    for i, used in enumerate(search.problem.used.T):
        if used.any() and remaining[i] < 1 - acceptance.LEAST_SHARE:
            without, with_effect = (float(np.mean(c.without_levels[used, i] ** 2)) for c in (before, after))
            noise, share = inertia_noise(search.system, search.motion, i), float(remaining[i]) ** 2
            if with_effect > times * (share * without + (1 - share) * min(noise, without)):
                return True
    return False


def corrects_a_form(before: ForceCriterion, after: ForceCriterion) -> str:
    """Objection if a candidate adds little to another effect on the same coordinate that depends on the same variable.

    It may then only correct a misfit of the other's form. Else empty.
    """
    *others, part = after.fit.trial.parts
    *values, _ = after.fit.values[1]
    system = before.search.system
    here = part.effect.coordinate(system, part.place), part.effect.seen_over
    acting = ((p.effect.coordinate(system, p.place), p.effect.seen_over) for p in others)
    alike = [(p, v) for p, v, on in zip(others, values, acting, strict=True) if on == here]
    if not alike or after.fit.trial.adds_states:
        return ""
    net = before.search.drive.share(after.without_levels - before.without_levels)
    sizes = [(force_share(before.search, p, v), p) for p, v in alike]
    most, larger = max(sizes, key=lambda one: one[0])
    if net >= FORM_ERROR * most:
        return ""
    return worded("forms", net=net, most=most, kind=larger.kind, drive=driving_force_name(system))


def contradicted_by_force(before: ForceCriterion, after: ForceCriterion, share: float = 0.0) -> str:
    """Objection if a candidate makes the force residual significantly larger; else empty.

    Short free runs without drive, as with an inertia a thousand times too large, continue at the measured start speed.
    With wrong friction levels they fit better than any model that moves by its forces.

    Args:
        share: of the squared free-run residual that the candidate removes on held-out segments.
    """
    times = after.over(before).left
    if times < CONTRADICTED or before.over(after).p > acceptance.ALPHA:
        return ""
    if acceptance.free_runs_settle(after.fit, share, times):
        return ""
    return f"makes the squared residual force {times:.2g} times as large"

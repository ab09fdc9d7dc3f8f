"""Declared parameters that are wrong by far more than their tolerance, as the rival explanation of missing effects.

Forward selection keeps each toleranced parameter within a few tolerances, so that a missing effect is not hidden in
it. Where several parameters are wrong together (an unknown payload changes masses, inertias and weights at once), an
effect may imitate them. So where the refit ends at that limit, it is repeated with the tolerances as Gaussian prior
alone. If that explains more than the effects did, or as much with fewer changes, effects are sought in addition to it.
"""

from __future__ import annotations

import numpy as np

from codegen.diagnosis.forward_selection import BETTER, Outcome
from codegen.diagnosis.output_error import AT_END, WITHIN, Fit, segment_cost
from codegen.diagnosis.search import Search


def released(search: Search, base: Fit, outcome: Outcome) -> tuple[Search, Fit] | None:
    """The search without limits of toleranced parameters, and its refit.

    None where the refit did not end at a limit, or where no more than one effect explains the log as well.

    Args:
        base: the refit within the limits. outcome: of forward selection in addition to it.
    """
    freed = search.without_limits(base)
    if freed is None:
        return None
    rival = base if len(outcome.parts) > 1 else outcome.final
    return freed if is_better(*freed, search, rival) else None


def equal_parameter(search: Search, base: Fit, outcome: Outcome) -> str:
    """The parameter that explains the log as well as the one effect of an outcome, in words; empty for none.

    A mass that is declared too small by ten tolerances and an inertia error are one motion. The tolerance speaks for
    the effect; the reader may know better.
    """
    freed = search.without_limits(base) if len(outcome.parts) == 1 else None
    if freed is None:
        return ""
    fit = freed[1]
    gain = fit.tempering * (segment_cost(outcome.final.residual) - segment_cost(fit.residual))
    tolerances = np.abs(fit.theta[: len(search.moved)] - search.declared) * np.sqrt(search.prior_precision)
    (away,) = np.nonzero(tolerances >= AT_END * WITHIN)
    if len(away) != 1 or gain < -BETTER:
        return ""
    k, (part,) = int(away[0]), outcome.parts
    unit = search.system.units.get(search.moved[k], "1")
    behind = "" if unit == "1" else f" {unit}"
    return (
        f"the value {search.moved[k]} = {fit.theta[k]:.4g}{behind} in place of the declared {search.declared[k]:.4g}"
        f"{behind} ({tolerances[k]:.2g} tolerances away) explains the training log as well as {part.kind} on "
        f"{part.on} does"
    )


def is_better(free: Search, fit: Fit, search: Search, other: Fit) -> bool:
    """Whether a fit without limits explains the log better than one within them, for its number of changes.

    Both losses are tempered by the share of independent residuals, and ``BETTER`` nats are added for each change to the
    declared model: an effect, or a parameter ``WITHIN`` tolerances or more away.
    """
    gain = fit.tempering * (segment_cost(other.residual) - segment_cost(fit.residual))
    return gain + BETTER * (_changes(search, other) - _changes(free, fit)) > BETTER / 2


def _changes(search: Search, fit: Fit) -> int:
    change = fit.theta[: len(search.moved)] - search.declared
    away = np.abs(change) * np.sqrt(search.prior_precision) >= AT_END * WITHIN
    return int(away.sum()) + len(fit.runner.trial.parts)

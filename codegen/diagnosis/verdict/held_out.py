"""Comparison on held-out data of candidates that the training log cannot distinguish; some of them may be refused.

Two models may predict the same motion on the training log and different ones on the held-out log: a dead zone acts like
a constant force while the input stays on one side of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.estimate import BLOCKS, covariance
from codegen.diagnosis.evidence.force_gain import ForceGain, force_gain
from codegen.diagnosis.fit.acceptance import TIE_LEVEL
from codegen.diagnosis.fit.drive import residual_at_drive, residual_without_levels, without_values
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.signals import Motion
from codegen.diagnosis.fit.trial import model_of
from codegen.diagnosis.results import Fact
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.ranking import CLOSE
from codegen.diagnosis.verdict.admission import Measured, worsened

WITHIN = 2.0
"""A model is refused only if it would also be with any of its values changed by up to this many standard errors."""


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Held-out data, with the declared system, on which models with the values of the training log are compared."""

    problem: Problem
    measured: Measured

    def refused(self, fits: Sequence[Fit]) -> dict[int, tuple[int, float]]:
        """The refused of some fits to the training log: index → (index of a better fit, ratio of force residuals²).

        A fit is refused if another one has neither error more than 1 % larger and a significantly smaller force
        residual, at the level ``TIE_LEVEL`` over the number of comparisons. This must also hold after the refused fit's
        values are adjusted within ``WITHIN`` standard errors, since uncertain values cause errors on a larger range of
        motion. Loads behind springs are not judged, since they are not measured.
        """
        models = [fit.model for fit in fits]
        declared = self.problem.system.transmissions
        judged = [k for k, model in enumerate(models) if len(model.transmissions) == len(declared)]
        residuals = {k: residual_without_levels(self.problem, models[k]) for k in judged}
        level = TIE_LEVEL / max(1, len(judged) * (len(judged) - 1))
        found: dict[int, tuple[int, float]] = {}
        for k in judged:
            for j in judged:
                if j == k or k in found:
                    continue
                gain = force_gain(self.problem, residuals[k], residuals[j])
                if not is_preferred(gain, level) or worsened(self.measured(models[j]), self.measured(models[k])):
                    continue
                if is_preferred(force_gain(self.problem, self._within_errors(fits[k]), residuals[j]), level):
                    found[k] = j, 1 / max(gain.left, 1e-12)
        return found

    def _within_errors(self, fit: Fit) -> Array:
        """(N, n) least force residual of a fit if its values may change by ``WITHIN`` standard errors, levels freely.

        It is linear in the changes. The region is a box, which contains the joint confidence ellipsoid of that size.
        """
        motion, model = self.problem.motion, fit.model
        clusters = (0, BLOCKS) if len(fit.residual) > BLOCKS else (0,)
        deviations = np.sqrt(np.max([np.diag(covariance(fit, number)) for number in clusters], axis=0).clip(0.0))
        own = inverse_dynamics_residual(model, motion)
        free = [k for k in np.flatnonzero(deviations) if not fit.limited[k]]
        slopes = np.zeros((*own.shape, len(free)))
        for place, k in enumerate(free):
            theta = fit.theta.copy()
            theta[k] += deviations[k]
            slopes[:, :, place] = inverse_dynamics_residual(model_of(fit.trial, theta), motion) - own
        bound = np.full(len(free), WITHIN)
        residual = residual_at_drive(model, self.problem.motion)
        return without_values(self.problem, model, residual, slopes, (-bound, bound))


def is_preferred(gain: ForceGain, level: float) -> bool:
    """Whether the force residual prefers a model to a rival: significantly, and by a factor of more than ``CLOSE``."""
    return gain.left < 1 / CLOSE and gain.p_of_rivals() <= level


def without_refused(search: Search, outcome: Outcome, held_out: HeldOut) -> tuple[Outcome, tuple[Fact, ...]]:
    """The outcome without the tied candidates that held-out data refuse, if not all, and the facts on these."""
    fits: list[Fit] = [outcome.final, *(search.led_by(r.found, outcome.final) for r in outcome.rivals)]
    refused = held_out.refused(fits)
    kept = [k for k in range(len(fits)) if k not in refused]
    if not kept:
        return outcome, ()
    rivals = [outcome.rivals[k - 1] for k in kept[1:]]
    left = outcome.with_final(search, fits[kept[0]], rivals) if kept[0] else replace(outcome, rivals=tuple(rivals))
    return left, in_words(fits, refused)


def in_words(fits: Sequence[Fit], refused: Mapping[int, tuple[int, float]]) -> tuple[Fact, ...]:
    """Facts on the fits that held-out data refuse (``HeldOut.refused``), which are named by their first effects."""
    names = [part.title for part in (fit.trial.parts[0] for fit in fits)]
    pairs = [({"named": names[k], "other": names[j]}, times) for k, (j, times) in refused.items()]
    return tuple(Fact.said("not accepted", "refused tie", times=times, **named) for named, times in pairs)


def within(motion: Motion, window: slice) -> Motion:
    """A motion with only the samples in a window marked as usable."""
    usable = motion.usable.copy()
    usable[: window.start] = False
    usable[window.stop :] = False
    return replace(motion, usable=usable)

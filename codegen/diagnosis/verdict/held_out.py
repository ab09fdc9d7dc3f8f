"""Comparison on held-out data of candidates that the training log cannot distinguish; some of them may be refused.

Two models may predict the same motion on the training log and different ones on the held-out log: a dead zone acts as a
constant force while the input stays on one side of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.estimate import BLOCKS, covariance
from codegen.diagnosis.evidence.force_evidence import ForceGain, force_gain
from codegen.diagnosis.experiments.separation import in_place, led_by_rival
from codegen.diagnosis.fit.credit import TIE_LEVEL
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.residual import (
    Problem,
    inverse_dynamics_residual,
    residual_without_levels,
    residual_without_values,
)
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.signals import Motion
from codegen.diagnosis.fit.trial import model_of
from codegen.diagnosis.results import Fact
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.ranking import CLOSE
from codegen.diagnosis.verdict.answer import Measured, worsened

WITHIN = 2.0
"""Standard errors within which the values of a model may move before held-out data refuse it."""


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Data that no fit has seen: the declared system on their motion, and errors of a system there."""

    problem: Problem
    measured: Measured

    def refused(self, fits: Sequence[Fit]) -> dict[int, tuple[int, float]]:
        """Of fits to other data, those that are refused here, each with the index of one that refuses it.

        One is refused if another one makes neither error more than 1 % larger and leaves significantly less of the
        force residual, at the level ``TIE_LEVEL`` over the number of comparisons, also of what remains of it when the
        refused one's values move within ``WITHIN`` standard errors: a model whose values are open errs where the motion
        goes further. Loads behind springs are not judged, since they are not measured. With each goes its squared force
        residual over the other's.
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
                if not tells(gain, level) or worsened(self.measured(models[j]), self.measured(models[k])):
                    continue
                if tells(force_gain(self.problem, self._within_errors(fits[k]), residuals[j]), level):
                    found[k] = j, 1 / max(gain.left, 1e-12)
        return found

    def _within_errors(self, fit: Fit) -> Array:
        """(N, n) force residual of a fit less what levels explain and changes of its values within standard errors.

        To first order, each value on its own: that is more than their joint region allows.
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
        return residual_without_values(self.problem, model, slopes, (-bound, bound))


def tells(gain: ForceGain, level: float) -> bool:
    """Whether the force residual tells a model from a rival, by more than what models far from the noise may differ."""
    return gain.left < 1 / CLOSE and gain.p_of_rivals() <= level


def without_refused(search: Search, outcome: Outcome, held_out: HeldOut) -> tuple[Outcome, tuple[Fact, ...]]:
    """The outcome without those of its tied effects that held-out data refuse, if not all, and what is said of them."""
    fits: list[Fit] = [outcome.final, *(in_place(search, outcome, r) for r in outcome.rivals)]
    refused = held_out.refused(fits)
    kept = [k for k in range(len(fits)) if k not in refused]
    if not refused or not kept:
        return outcome, ()
    rivals = [outcome.rivals[k - 1] for k in kept[1:]]
    left = led_by_rival(search, outcome, fits[kept[0]], rivals) if kept[0] else replace(outcome, rivals=tuple(rivals))
    return left, in_words(fits, refused)


def in_words(fits: Sequence[Fit], refused: Mapping[int, tuple[int, float]]) -> tuple[Fact, ...]:
    """What is said of the fits that held-out data refuse (``HeldOut.refused``): the first effect of each tells them."""
    names = [f"{part.kind} on {part.on}" for part in (fit.trial.parts[0] for fit in fits)]
    return tuple(
        Fact(
            "not credited",
            f"{names[k]}, which fits the training log as well as {names[j]}, is refused: on held-out data it leaves "
            f"{times:.3g} times the squared residual force",
            "The errors of what is left are measured on the data that chose it, so they are slightly optimistic.",
        )
        for k, (j, times) in refused.items()
    )


def only(motion: Motion, window: slice) -> Motion:
    """A motion of which the samples outside a window are not used."""
    usable = motion.usable.copy()
    usable[: window.start] = False
    usable[window.stop :] = False
    return replace(motion, usable=usable)

"""Comparisons of models on held-out data: candidates that the training log does not distinguish, and the last check.

Two models may predict the same motion on the training log and different ones on the held-out log: a dead zone acts like
a constant force while the input stays on one side of it. So some of the tied candidates may be refused.

At last the model that would be written must be no worse than the declared one:

    force:  r > (1 + REFIT_WORSE) s r₀,   s = min(1, d/d₀)         free runs:  e > (1 + REFIT_WORSE) e₀

with r the RMS force residual on a coordinate, at each sample over the fraction of the drive force that friction leaves,
d the RMS of its drive force behind the actuators, e the free-run error of all coordinates and of each, and r₀, d₀, e₀
those of the declared model. The factor s is there because a model with a smaller drive force has smaller residuals too,
without being better: a saturation far below the logged inputs, with friction reduced to zero, left a third of the
residual of a screw drive, but 7.9 % of its drive force in place of 5.0 %.

A difference counts only if noise is no explanation: the excess of force √(r² − (s r₀)²) must be a material share of the
drive force, and the difference of squares must be significant by sign flips of blocks of the data; free-run errors must
be larger by the sign test of ``is_shown_worse``. If the errors of the free runs are as small as the noise, the model is
right, and the residual may be noise, which does not fall with the drive force: then s = 1. Unlike in ``reference_of``,
a material excess counts even with such free runs, and also with a load behind a spring.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.estimate import BLOCKS, covariance
from codegen.diagnosis.evidence.force_gain import ForceGain, force_gain
from codegen.diagnosis.fit.acceptance import SIGN_BLOCKS, TIE_LEVEL, p_of_sign_flips
from codegen.diagnosis.fit.drive import (
    residual_at_drive,
    residual_over_friction,
    residual_without_levels,
    without_values,
)
from codegen.diagnosis.fit.linear import rms
from codegen.diagnosis.fit.measure import drive_force
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.signals import Motion
from codegen.diagnosis.fit.trial import model_of
from codegen.diagnosis.results import ErrorFigures, Fact, worded
from codegen.diagnosis.selection.comparison import CLOSE
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.verdict.admission import REFIT_WORSE, RUN, Measured, is_shown_worse, refused_values, worsened
from codegen.diagnosis.verdict.answer import Answer
from codegen.mechanics.system import System

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
    fits: list[Fit] = [outcome.final, *(search.with_first_effect(r.found, outcome.final) for r in outcome.rivals)]
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
    return tuple(Fact.worded("not accepted", "refused tie", times=times, **named) for named, times in pairs)


def within(motion: Motion, window: slice) -> Motion:
    """A motion with only the samples in a window marked as usable."""
    usable = motion.usable.copy()
    usable[: window.start] = False
    usable[window.stop :] = False
    return replace(motion, usable=usable)


BLOCK_PERIODS = 2.0
"""Least length of a block, in periods of the cutoff: residuals of neighbouring blocks are then nearly independent."""
LEAST_BLOCKS = 5
"""Fewest blocks for the test of significance, since 2^−5 is below its level; with fewer a material excess counts."""


@dataclass(frozen=True, eq=False)
class FinalCheck:
    """Comparison of models with the declared one on held-out data.

    Attributes:
        near: whether the free runs of the accepted model end at the noise of the training log.
        material: share of the RMS of the drive force from which on a force matters.
    """

    held_out: HeldOut
    near: bool
    material: float

    def passed(self, answer: Answer) -> Answer:
        """The answer without what makes its written model worse: first its effects, then its refitted values."""
        declared = answer.figures[0]
        if answer.verdict == "effect" and (words := self.worse(answer.augmented, answer.figures[2], declared)):
            answer = answer.refused(words)
        if answer.adopted is not answer.refit or not (words := self.worse(answer.refit, answer.figures[1], declared)):
            return answer
        system = self.held_out.problem.system
        last = answer.figures[2] if answer.verdict == "ambiguous" else declared
        augmented = answer.augmented if answer.verdict == "ambiguous" else system
        plain = replace(answer, refit=system, augmented=augmented, figures=(declared, declared, last), errors=())
        not_written = Fact("spec.yaml", f"Refitted values are not written: with them {words}")
        return plain.noted(not_written, *refused_values(answer.refit, system))

    def worse(self, model: System, figures: ErrorFigures, declared: ErrorFigures) -> str:
        """By what a model is worse than the declared one, in words; empty if it is not."""
        names = [x.name for x in self.held_out.problem.system.positions]
        groups = [range(len(names)), *([i] for i in range(len(names)) if len(names) > 1)]
        for group in groups:
            its, own = figures.on(group), declared.on(group)
            by_run = worsened(its, own, REFIT_WORSE).get(RUN)
            if by_run is not None and is_shown_worse(its, own):
                on = names[group[0]] if len(group) < len(names) else ""
                return worded("worse in free runs", times=by_run, on=on)
        return self._worse_by_force(model)

    def _worse_by_force(self, model: System) -> str:
        """By what the force residual of a model is larger on the first coordinate where it is; empty if on none."""
        problem = self.held_out.problem
        system, motion = problem.system, problem.motion
        own, its = (residual_over_friction(s, motion) for s in (model, system))
        drive, its_drive = (motion.low_pass(drive_force(s, motion)) for s in (model, system))
        for i, used in enumerate(problem.used.T):
            if not used.any():
                continue
            size, its_size = rms(drive[used, i]), rms(its_drive[used, i])
            share = min(1.0, size / its_size) if its_size > 0 and not self.near else 1.0
            more = own[used, i] ** 2 - (share * its[used, i]) ** 2
            if not self._counts(more, rms(share * its[used, i]), size):
                continue
            left, before = rms(own[used, i]), rms(its[used, i])
            shares = (left / size, before / its_size) if size > 0 and its_size > 0 else None
            on, times = system.positions[i].name, left / max(before, 1e-300)
            return worded("worse by force", on=on, shares=shares, times=times)
        return ""

    def _counts(self, more: Array, before: float, drive: float) -> bool:
        """Whether an excess of squared residual force, sample by sample, is material and significant.

        ``before``: s r₀. On a coordinate without drive every excess of more than ``REFIT_WORSE`` is material.
        """
        excess = float(np.mean(more))
        if excess <= max(((1 + REFIT_WORSE) ** 2 - 1) * before**2, (self.material * drive) ** 2):
            return False
        blocks = self._blocks(len(more))
        return len(blocks) < LEAST_BLOCKS or p_of_sign_flips(np.array([more[b].sum() for b in blocks])) <= TIE_LEVEL

    def _blocks(self, samples: int) -> list[NDArray[np.int_]]:
        """Indices of so many samples in blocks of equal length."""
        motion = self.held_out.problem.motion
        count = int(samples * motion.sample_time * motion.cutoff_hz / BLOCK_PERIODS)
        return np.array_split(np.arange(samples), max(1, min(SIGN_BLOCKS, count)))

"""Candidates that tie on the training log, compared on held-out data, which may refuse some of them.

Two models may be one motion on the training log and two on the held-out one: a dead zone is a constant force while the
input stays on one side of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from codegen.diagnosis.answer import Measured, worsened
from codegen.diagnosis.credit import TIE_LEVEL
from codegen.diagnosis.force_evidence import ForceGain, force_gain
from codegen.diagnosis.forward_selection import Outcome
from codegen.diagnosis.output_error import Fit
from codegen.diagnosis.ranking import CLOSE
from codegen.diagnosis.residual import Problem, residual_without_levels
from codegen.diagnosis.search import Search
from codegen.diagnosis.separation import in_place
from codegen.diagnosis.signals import Motion
from codegen.mechanics.system import System


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Data that no fit has seen.

    Attributes:
        problem: the declared system on the held-out motion. measured: errors of a system there.
    """

    problem: Problem
    measured: Measured

    def refused(self, models: Sequence[System]) -> dict[int, tuple[int, float]]:
        """Of models that are fitted to other data, those that are refused here.

        One is refused if another one makes neither error more than 1 % larger and leaves significantly less of the
        force residual. The level is that of one comparison, and the fitted values are taken as exact. It does not judge
        loads behind springs, which are not measured.

        Returns:
            Index of a model → that of one that refuses it, and the squared force residual of the former over that of
            the latter.
        """
        declared = self.problem.system.transmissions
        judged = [k for k, model in enumerate(models) if len(model.transmissions) == len(declared)]
        residuals = {k: residual_without_levels(self.problem, models[k]) for k in judged}
        found: dict[int, tuple[int, float]] = {}
        for k in judged:
            for j in judged:
                if j == k or k in found:
                    continue
                gain = force_gain(self.problem, residuals[k], residuals[j])
                if tells(gain) and not worsened(self.measured(models[j]), self.measured(models[k])):
                    found[k] = j, 1 / max(gain.left, 1e-12)
        return found


def tells(gain: ForceGain) -> bool:
    """Whether the force residual tells a model from a rival, by more than what models far from the noise may differ."""
    return gain.left < 1 / CLOSE and gain.p_of_rivals <= TIE_LEVEL


def without_refused(search: Search, outcome: Outcome, held_out: HeldOut) -> tuple[Outcome, tuple[str, ...]]:
    """The outcome without those of its tied effects that held-out data refuse, and what is said of them.

    Unchanged where none of them is refused, or each of them.
    """
    fits: list[Fit] = [outcome.final, *(in_place(search, outcome, r) for r in outcome.rivals)]
    refused = held_out.refused([fit.model for fit in fits])
    kept = [k for k in range(len(fits)) if k not in refused]
    if not refused or not kept:
        return outcome, ()
    names = [f"{part.kind} on {part.on}" for part in (fit.trial.parts[0] for fit in fits)]
    words = tuple(
        f"{names[k]}, which ties with {names[j]} on the training log, is refused: on held-out data it leaves "
        f"{times:.3g} times the squared residual force"
        for k, (j, times) in refused.items()
    )
    rivals = tuple(outcome.rivals[k - 1] for k in kept[1:])
    return replace(outcome, final=fits[kept[0]], rivals=rivals), words


def only(motion: Motion, window: slice) -> Motion:
    """A motion of which the samples outside a window are not used."""
    usable = motion.usable.copy()
    usable[: window.start] = False
    usable[window.stop :] = False
    return replace(motion, usable=usable)

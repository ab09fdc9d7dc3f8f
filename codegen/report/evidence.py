"""Comparison of each named effect with a nonparametric regression of the force residual on the same variable.

An effect is convincing if its law follows the smooth curve and explains about as much of the variance. If the curve has
another shape or explains much more, the name may be wrong although the error decreases.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from codegen.base.arrays import Array, Flags
from codegen.diagnosis.diagnose import Models
from codegen.diagnosis.evidence import residual_regression
from codegen.diagnosis.fit.drive import residual_at_drive
from codegen.diagnosis.fit.residual import Problem, without_levels
from codegen.diagnosis.fit.trial import with_effects, with_values
from codegen.diagnosis.results import Diagnosis, FoundEffect
from codegen.diagnosis.verdict.against_regression import VARIABLES, acts_on
from codegen.effects import CATALOGUE
from codegen.mechanics.system import System
from codegen.report.series import Curve, bin_means, thin

BOTH_WAYS = ("position", "load")
"""Variables over which a residual may have a different shape in each direction of motion."""
ROWS_IN_BIN, FEWEST_BINS, MOST_BINS = 40, 16, 160
"""Mean number of samples in a bin of the drawn curves, and limits of the number of bins."""
NO_RESIDUAL = 1e-300
"""Lower limit of a sum of squares that is a divisor."""


@dataclass(frozen=True, eq=False)
class LawPanel:
    """One direction of motion, or both: samples, the smooth curve and the law's force, over the variable in SI."""

    direction: str
    samples: Curve
    smooth: Curve
    law: Curve


@dataclass(frozen=True, eq=False)
class LawEvidence:
    """One effect compared with a smooth curve.

    Attributes:
        coordinate: index.
        variable: that shows the effect best.
        smooth: R² of a smooth curve over the variable on the residual without the effect, cross-validated.
        law: R² of the effect's law on the same residual.
        left: R² of a smooth curve on the residual with the effect: the structure that the law does not explain.
    """

    kind: str
    on: str
    coordinate: int
    variable: str
    smooth: float
    law: float
    left: float
    panels: tuple[LawPanel, ...]


def law_evidence(diagnosis: Diagnosis, models: Models) -> tuple[LawEvidence, ...]:
    """The comparison for every effect of the verdict, with the others in the model, and for rivals of the first one.

    On the training log, to which the effects were fitted, with friction levels refitted to each residual.
    """
    accepted = diagnosis.verdict in ("effect", "ambiguous")
    values = {name: (augmented if accepted else refit) for name, (_, refit, augmented) in diagnosis.refitted.items()}
    bare = with_values(models.declared, values)
    named = list(models.named)

    def compared(effect: FoundEffect, others: list[FoundEffect], place: int) -> LawEvidence:
        with_it = [*others[:place], effect, *others[place:]]
        return _evidence(models.train, with_effects(bare, others), with_effects(bare, with_it), effect)

    evidence = [compared(effect, named[:k] + named[k + 1 :], k) for k, effect in enumerate(named)]
    if named:
        evidence += [compared(rival, named[1:], 0) for rival in diagnosis.rivals]
    return tuple(evidence)


def _evidence(problem: Problem, without: System, whole: System, effect: FoundEffect) -> LawEvidence:
    """The evidence of one effect; ``without``, ``whole``: the system without and with it."""
    motion, i = problem.motion, acts_on(effect, problem.system)
    variable = VARIABLES[CATALOGUE[effect.kind].seen_over]
    residuals = residual_at_drive(without, motion)
    used = residual_regression.sliding(without, motion, problem.used, i)
    before = without_levels(without, motion, used, residuals[:, i], i)
    after = without_levels(without, motion, used, residual_at_drive(whole, motion)[:, i], i)
    x = residual_regression.variables_of(without, motion, residuals, i)
    columns = residual_regression.remainder_columns(without, motion, residuals, used, i)(variable)
    sum_of_squares = max(float(np.sum(before[used] ** 2)), NO_RESIDUAL)
    directions = [("", used)]
    if variable in BOTH_WAYS:
        directions = [("forward", used & (x["speed"] > 0)), ("backward", used & (x["speed"] < 0))]
    fitted = residual_regression.smooth_curve(before, used, columns)
    return LawEvidence(
        kind=effect.kind,
        on=effect.on,
        coordinate=i,
        variable=variable,
        smooth=residual_regression.explained_over(before, used, [columns]),
        law=1 - float(np.sum(after[used] ** 2)) / sum_of_squares,
        left=residual_regression.explained_over(after, used, [columns]),
        # The force of the law is the difference of the two residuals.
        panels=tuple(_panel(way, rows, x[variable], (before, fitted, before - after)) for way, rows in directions),
    )


def _panel(direction: str, rows: Flags, x: Array, series: Sequence[Array]) -> LawPanel:
    """Samples thinned, and the two curves as means in bins, since many samples share one x."""
    samples, smooth, law = series
    kept = thin(np.flatnonzero(rows))
    bins = int(np.clip(rows.sum() // ROWS_IN_BIN, FEWEST_BINS, MOST_BINS))
    return LawPanel(
        direction,
        Curve(x[kept], samples[kept]),
        bin_means(x[rows], smooth[rows], bins),
        bin_means(x[rows], law[rows], bins),
    )

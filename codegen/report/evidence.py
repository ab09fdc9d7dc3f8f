"""Comparison of each named effect with a smooth regression curve over the same variable, on the force residual.

An effect is convincing where its law follows the curve and explains about as much. Where the curve has another shape or
explains much more, the name may be wrong although the error falls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from codegen.base.arrays import Array, Flags
from codegen.diagnosis.conclusion import acts_on
from codegen.diagnosis.diagnose import Models
from codegen.diagnosis.force_evidence import VARIABLES
from codegen.diagnosis.residual import Problem, residual_at_drive, without_levels
from codegen.diagnosis.residual_regression import explained_over, remainder_columns, sliding, smooth_curve, variables_of
from codegen.diagnosis.results import Diagnosis, FoundEffect
from codegen.diagnosis.trial import with_effects, with_values
from codegen.effects import CATALOGUE
from codegen.mechanics.system import System
from codegen.report.series import Curve, bin_means, thin

BOTH_WAYS = ("position", "load")
"""Variables over which a residual may have a different shape in each direction of motion."""
ROWS_IN_BIN, MOST_BINS = 40, 160


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
        coordinate: index. variable: over which the effect is seen best.
        smooth: share of the mean square of the residual without the effect that a smooth curve over the variable
            predicts on held-out parts.
        law: share of it that the effect explains.
        left: share of the residual with the effect that such a curve still predicts.
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
    """The comparison for every effect that the verdict names, given the others, and for rivals in place of the first.

    On the training log, to which the effects were fitted, with friction levels refitted to each residual.
    """
    credited = diagnosis.verdict in ("effect", "ambiguous")
    values = {name: (augmented if credited else refit) for name, (_, refit, augmented) in diagnosis.refitted.items()}
    bare = with_values(models.declared, values)
    named = list(models.named)
    found = [
        _evidence(models.train, with_effects(bare, named[:k] + named[k + 1 :]), with_effects(bare, named), one)
        for k, one in enumerate(named)
    ]
    for rival in diagnosis.rivals if named else ():
        others = named[1:]
        found.append(_evidence(models.train, with_effects(bare, others), with_effects(bare, [rival, *others]), rival))
    return tuple(found)


def _evidence(problem: Problem, without: System, whole: System, effect: FoundEffect) -> LawEvidence:
    motion, i = problem.motion, acts_on(effect, problem.system)
    variable = VARIABLES[CATALOGUE[effect.kind].seen_over]
    raw = residual_at_drive(without, motion)
    used = sliding(without, motion, problem.masks, i)
    before = without_levels(without, motion, used, raw[:, i], i)
    after = without_levels(without, motion, used, residual_at_drive(whole, motion)[:, i], i)
    x = variables_of(without, motion, raw, i)
    columns = remainder_columns(without, motion, raw, i)[variable]
    square = max(float(np.sum(before[used] ** 2)), 1e-300)
    ways = [("", used)]
    if variable in BOTH_WAYS:
        ways = [("forward", used & (x["speed"] > 0)), ("backward", used & (x["speed"] < 0))]
    fitted = smooth_curve(before, used, columns)
    return LawEvidence(
        kind=effect.kind,
        on=effect.on,
        coordinate=i,
        variable=variable,
        smooth=explained_over(before, used, [columns]),
        law=1 - float(np.sum(after[used] ** 2)) / square,
        left=explained_over(after, used, [columns]),
        panels=tuple(_panel(way, rows, x[variable], (before, fitted, before - after)) for way, rows in ways),
    )


def _panel(direction: str, rows: Flags, x: Array, series: Sequence[Array]) -> LawPanel:
    samples, smooth, law = series
    kept = thin(np.flatnonzero(rows))
    bins = int(np.clip(rows.sum() // ROWS_IN_BIN, 16, MOST_BINS))
    return LawPanel(
        direction,
        Curve(x[kept], samples[kept]),
        bin_means(x[rows], smooth[rows], bins),
        bin_means(x[rows], law[rows], bins),
    )

"""The last check of a model: on held-out data it may be worse neither than the declared model nor than the refit.

The held-out log does not choose; it can only refuse options, whose order the training log determined.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from codegen.diagnosis.adoption import SAME
from codegen.diagnosis.results import ErrorFigures
from codegen.mechanics.system import System

FORCE, RUN = "residual force", "error in free run"
REFIT_WORSE = 0.05
"""Share by which an effect may increase either error over the refit without it; noise can make that much."""


@dataclass(frozen=True, eq=False)
class Option:
    """A model that may be written.

    Attributes:
        words: description for a reader. values: of the refitted parameters.
    """

    words: str
    system: System
    values: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Admitted:
    """The first option that held-out data do not refuse.

    Attributes:
        option: None where all are refused; ``figures`` are then of the first.
        refusals: of the options before it, in words.
    """

    option: Option | None
    figures: ErrorFigures
    refusals: tuple[str, ...]


def admitted(
    options: Sequence[Option],
    declared: ErrorFigures,
    measured: Callable[[System], ErrorFigures],
    refit: ErrorFigures | None = None,
    most: float = REFIT_WORSE,
) -> Admitted:
    """Check the options in their order on held-out data.

    Args:
        refit: errors of the model without the effects; an option may exceed them by at most the share ``most``;
            where that is negative it must be better by so much.
    """
    refusals: list[str] = []
    first: ErrorFigures | None = None
    for option in options:
        figures = measured(option.system)
        first = first or figures
        references = (("the declared model", declared, SAME), ("the refit without the effect", refit, most))
        for model, other, share in references:
            worse = worsened(figures, other, share) if other is not None else {}
            if worse:
                refusals.append(f"on held-out data {option.words} would make {_list(worse)} than with {model}")
                break
        else:
            return Admitted(option, figures, tuple(refusals))
    if first is None:
        raise ValueError("no option was given")
    return Admitted(None, first, tuple(refusals))


def worsened(figures: ErrorFigures, declared: ErrorFigures, most: float = SAME) -> dict[str, float]:
    """Criterion → error over that of the declared model, where it is larger by more than a share ``most``."""
    ratios = {
        FORCE: _over(figures.force_rms_rows, declared.force_rms_rows),
        RUN: _over(figures.free_run_rmse_rows, declared.free_run_rmse_rows),
    }
    return {name: ratio for name, ratio in ratios.items() if ratio > 1 + most}


def _over(errors: Iterable[float], declared: Iterable[float]) -> float:
    """RMS over coordinates of the ratio of errors, so that units do not matter; NaN where none was measured."""
    ratios = [_ratio(a, b) for a, b in zip(errors, declared, strict=True) if not (np.isnan(a) or np.isnan(b))]
    return float(np.sqrt(np.mean(np.square(ratios)))) if ratios else float("nan")


def _ratio(error: float, declared: float) -> float:
    if not np.isfinite(declared):
        return 1.0 if not np.isfinite(error) else 0.0
    return error / declared if declared > 0 else float(error > 0) + 1.0


def _list(worse: Mapping[str, float]) -> str:
    def words(ratio: float) -> str:
        if not np.isfinite(ratio):
            return "diverge"
        if ratio > 2:
            return f"{ratio:.3g} times as large"
        return f"{100 * (ratio - 1):.2g} % larger" if ratio > 1 else f"only {100 * (1 - ratio):.2g} % smaller"

    return " and ".join(f"the {name} {words(ratio)}" for name, ratio in worse.items())

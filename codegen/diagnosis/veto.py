"""The last check of what is written: it may be worse on held-out data neither than the declared model nor the refit.

The held-out log chooses nothing. It can only refuse, from a short list that the training log put in order.
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
"""Share by which an effect may make either error larger than in the refit without it: noise, and no more."""


@dataclass(frozen=True, eq=False)
class Option:
    """A model that may be written.

    Attributes:
        words: what it is, for a reader. values: of what a refit may move.
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
) -> Admitted:
    """Go through the options in their order.

    Args:
        refit: of the model without the effects that the options have; an option may be no worse than it either, by
            more than ``REFIT_WORSE``.
    """
    refusals: list[str] = []
    first: ErrorFigures | None = None
    for option in options:
        figures = measured(option.system)
        first = first or figures
        for model, other, most in (("the declared model", declared, SAME), ("the refit without", refit, REFIT_WORSE)):
            worse = worsened(figures, other, most) if other is not None else {}
            if worse:
                refusals.append(f"on held-out data {option.words} would make {_list(worse)} than with {model}")
                break
        else:
            return Admitted(option, figures, tuple(refusals))
    if first is None:
        raise ValueError("no option was given")
    return Admitted(None, first, tuple(refusals))


def worsened(figures: ErrorFigures, declared: ErrorFigures, most: float = SAME) -> dict[str, float]:
    """Witness → error over that of the declared model, where it is larger by more than a share ``most``."""
    ratios = {
        FORCE: _over(figures.force_rms_rows, declared.force_rms_rows),
        RUN: _over(figures.free_run_rmse_rows, declared.free_run_rmse_rows),
    }
    return {name: ratio for name, ratio in ratios.items() if ratio > 1 + most}


def _over(errors: Iterable[float], declared: Iterable[float]) -> float:
    """RMS over coordinates of each error over the declared model's, so that no unit counts for more."""
    ratios = [_ratio(a, b) for a, b in zip(errors, declared, strict=True) if not (np.isnan(a) or np.isnan(b))]
    return float(np.sqrt(np.mean(np.square(ratios)))) if ratios else 1.0


def _ratio(error: float, declared: float) -> float:
    if not np.isfinite(declared):
        return 1.0 if not np.isfinite(error) else 0.0
    return error / declared if declared > 0 else float(error > 0) + 1.0


def _list(worse: Mapping[str, float]) -> str:
    return " and ".join(
        f"the {name} {100 * (ratio - 1):.2g} % larger" if np.isfinite(ratio) else f"the {name} diverge"
        for name, ratio in worse.items()
    )

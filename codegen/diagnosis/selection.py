"""Which candidates the data credit: held-out gain, consistency over blocks, and the free run as second witness."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis.candidates import Fit
from codegen.diagnosis.results import Candidate

Array = NDArray[np.float64]

LEAST_GAIN = 0.05
"""An effect removes at least this share of the squared residual on held-out blocks."""
LEAST_T = 2.0
LEAST_BLOCKS_WON = 0.8
WORST_FREE_RUN = 1.0
"""Free-run error of an accepted effect over that of the refit, at most."""
TIE_T = 1.0
TIE_GAIN = 0.97
"""A rival with this share of the best gain, not worse by TIE_T standard errors over blocks, cannot be told apart."""
WITNESSED = 4


@dataclass(frozen=True, eq=False)
class Ranked:
    """A fit with its evidence."""

    fit: Fit
    evidence: Candidate


def rank(base: Array, fits: list[Fit], free_run_ratio: Callable[[Fit], float], tolerance: float) -> list[Ranked]:
    """Fits by held-out error, best first, those that pass every test before those that do not.

    Args:
        base: (blocks,) held-out error of the refit.
        free_run_ratio: free-run error with the fit over that of the refit; asked for the few best only.
        tolerance: relative, within which a declared inertia or gain may be off without that being an effect.
    """
    ordered = sorted(fits, key=lambda f: float(f.held_out.sum()))
    ranked = []
    for position, fit in enumerate(ordered):
        gain, t, won = evidence(base, fit.held_out)
        ratio = free_run_ratio(fit) if position < WITNESSED and gain >= LEAST_GAIN else None
        why_not = _why_not(fit, gain, t, won / len(base), ratio, tolerance)
        ranked.append(
            Ranked(
                fit,
                Candidate(
                    fit.kind, fit.on, fit.parameters, gain, t, won, len(base), ratio, not why_not, why_not, fit.twins
                ),
            )
        )
    return sorted(ranked, key=lambda r: not r.evidence.accepted)


def evidence(base: Array, held_out: Array) -> tuple[float, float, int]:
    """(relative gain, t over blocks, blocks won)."""
    difference = base - held_out
    total = float(base.sum())
    spread = float(difference.std(ddof=1)) / np.sqrt(len(difference))
    t = float(difference.mean() / spread) if spread > 0 else 0.0
    return float(difference.sum() / total) if total > 0 else 0.0, t, int((difference > 0).sum())


def rivals(ranked: list[Ranked]) -> list[Ranked]:
    """Accepted candidates that the data do not tell from the best one, beyond its twins."""
    if not ranked or not ranked[0].evidence.accepted:
        return []
    best = ranked[0]
    same = {(best.fit.kind, best.fit.on), *best.fit.twins}
    found = []
    for other in ranked[1:]:
        if not other.evidence.accepted or (other.fit.kind, other.fit.on) in same:
            continue
        _, t, _ = evidence(other.fit.held_out, best.fit.held_out)
        if other.evidence.gain >= TIE_GAIN * best.evidence.gain and t < TIE_T:
            found.append(other)
    return found


def _why_not(fit: Fit, gain: float, t: float, won: float, free_run: float | None, tolerance: float) -> str:
    if gain <= 0:
        return "makes the error on held-out blocks no smaller"
    if gain < LEAST_GAIN:
        return f"removes less than {100 * LEAST_GAIN:.2g} % of the squared residual on held-out blocks"
    if t < LEAST_T or won < LEAST_BLOCKS_WON:
        return f"better on {100 * won:.0f} % of the held-out blocks only (t = {t:.2g})"
    if fit.kind == "input_gain" and abs(fit.parameters["gain"] - 1) <= 1.5 * tolerance:
        return "the gain is within the tolerance of the declared parameters"
    if free_run is None:
        return "not among the best"
    if free_run > WORST_FREE_RUN:
        return f"the free run gets worse by the factor {free_run:.3g}"
    return ""

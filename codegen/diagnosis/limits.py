"""Fitted parameters that end at a limit of their range, so that their value is no estimate."""

from __future__ import annotations

from collections.abc import Sequence

import sympy

from codegen.diagnosis.output_error import Fit
from codegen.effects import CATALOGUE
from codegen.mechanics.system import System

NEAR_BOUND = 1e-3
"""Distance that counts as at the bound: share of the range between two bounds, or of a single bound."""


def at_limit(fit: Fit) -> list[tuple[str, ...]]:
    """For each effect of a fit, its parameters at a bound of the catalogue or of the fit's reach."""
    trial = fit.runner.trial
    marks, k = [], len(trial.moved)
    for part, values in zip(trial.parts, trial.split(fit.theta)[1], strict=True):
        effect = CATALOGUE[part.kind].with_parameters(part.names)
        bounds = {p.name: (p.low, p.high) for p in effect.parameters}
        marked = [
            name
            for j, name in enumerate(part.names)
            if fit.limited[k + j] or _at_bound(values[name], *bounds.get(name, (None, None)))
        ]
        marks.append(tuple(marked))
        k += len(part.names)
    return marks


def levels_at_zero(declared: System, models: Sequence[System], levels: Sequence[sympy.Symbol]) -> tuple[str, ...]:
    """Friction levels that a fit has reduced to zero, the lowest value allowed."""
    return tuple(s.name for s in levels if float(declared.values[s]) and not all(float(m.values[s]) for m in models))


def _at_bound(value: float, low: float | None, high: float | None) -> bool:
    if low is not None and high is not None:
        return min(value - low, high - value) <= NEAR_BOUND * (high - low)
    return any(abs(value - end) <= NEAR_BOUND * abs(end) for end in (low, high) if end is not None)

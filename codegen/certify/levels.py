"""Range of a DFO's true friction level in a certificate, if the envelope gives none.

A DFO estimates the level, and its error matrix depends on the true one. A certificate at the declared level alone would
not hold for any other. So the level becomes a variable with a range about the declared one, and one V is searched for
the whole range.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import sympy

from codegen.analysis.analysis import Analysis

SHARES = (sympy.Rational(1, 5), sympy.Rational(1, 10), sympy.Rational(1, 20))
"""Half-widths of the range as shares of the declared level; the largest is used for which a V is found."""


def about_declared(analysis: Analysis, share: Any) -> Analysis:
    """The analysis with each true level a in [a₀ − share |a₀|, a₀ + share |a₀|], a₀ the declared one.

    Levels for which the envelope gives a range keep it.
    """
    assumed = analysis.dynamics.observer.assumed
    reach = {a: abs(assumed[a]) * share for a in _levels(analysis)}
    return _over(analysis, {a: (assumed[a] - r, assumed[a] + r) for a, r in reach.items()})


def levels_of(analysis: Analysis, content: Mapping[str, Any]) -> Analysis:
    """The analysis with the true levels in the ranges of a certificate (JSON object) of the same observer."""
    variables = content["variables"]
    found = {a: variables[a.name] for a in _levels(analysis) if a.name in variables}
    return _over(analysis, {a: (sympy.Rational(low), sympy.Rational(high)) for a, (low, high) in found.items()})


def _levels(analysis: Analysis) -> list[sympy.Symbol]:
    """The true levels of the estimated ones that have a declared value and no range in the envelope."""
    observer = analysis.dynamics.observer
    return [e.truth for e in observer.errors if e.truth in observer.assumed]


def _over(analysis: Analysis, ranges: Mapping[sympy.Symbol, tuple[Any, Any]]) -> Analysis:
    """The analysis with these true levels as variables of its matrices; its points keep the declared ones."""
    if not ranges:
        return analysis
    dynamics, points = analysis.dynamics, analysis.points
    observer = dynamics.observer
    declared = np.array([[float(observer.assumed[a]) for a in ranges]])
    columns = np.repeat(declared, len(points.values), axis=0)
    assumed = {s: value for s, value in observer.assumed.items() if s not in ranges}
    wider = replace(observer, assumed=assumed, level_ranges={**observer.level_ranges, **ranges})
    return replace(
        analysis,
        dynamics=replace(dynamics, observer=wider),
        points=replace(
            points,
            variables=(*points.variables, *ranges),
            values=np.hstack([points.values, columns]),
            ranges={**points.ranges, **ranges},
        ),
    )

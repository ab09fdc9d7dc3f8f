"""A DFO's true friction level as a variable of the claim, where the envelope gives no range for it.

The level is what the observer is to find: a claim for the declared number alone says nothing of any other. So the
error matrix, in which the level enters, is taken over a range about the declared one, and one V is searched for all
of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import sympy

from codegen.analysis.analysis import Analysis

Ranges = Mapping[sympy.Symbol, tuple[Any, Any]]
SHARES = (sympy.Rational(1, 5), sympy.Rational(1, 10), sympy.Rational(1, 20))
"""Of the declared level, above and below it: the largest is taken for which a V is found."""


def about_declared(analysis: Analysis, share: Any) -> dict[sympy.Symbol, tuple[Any, Any]]:
    """True level → (low, high), a share of the declared one to both sides; those with a range of their own excepted."""
    observer = analysis.dynamics.observer
    declared = {e.truth: observer.assumed[e.truth] for e in observer.errors if e.truth in observer.assumed}
    return {a: (value - abs(value) * share, value + abs(value) * share) for a, value in declared.items()}


def levels_of(analysis: Analysis, content: Mapping[str, Any]) -> dict[sympy.Symbol, tuple[Any, Any]]:
    """Declared level → the range that a certificate of the same observer has for it, exact."""
    variables, observer = content["variables"], analysis.dynamics.observer
    found = [e.truth for e in observer.errors if e.truth in observer.assumed and e.truth.name in variables]
    return {a: (sympy.Rational(variables[a.name][0]), sympy.Rational(variables[a.name][1])) for a in found}


def over_levels(analysis: Analysis, ranges: Ranges) -> Analysis:
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

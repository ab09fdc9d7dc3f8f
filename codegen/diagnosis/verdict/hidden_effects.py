"""Effects that a log cannot show, since errors of parameters with a tolerance together exert the same force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import norm

from codegen.base.arrays import Array
from codegen.base.significant import in_percent
from codegen.diagnosis.fit.acceptance import ALPHA
from codegen.diagnosis.fit.drive import residual_at_drive
from codegen.diagnosis.fit.force_rows import ForceRows, force_rows, information
from codegen.diagnosis.fit.linear import inverse, rms, solved
from codegen.diagnosis.fit.measure import Drive
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import Part, with_effects
from codegen.diagnosis.results import Fact, FoundEffect
from codegen.diagnosis.selection.candidate_fits import every_part
from codegen.diagnosis.selection.significance import hypotheses
from codegen.mechanics.system import System

STEP = 1e-3
"""Step of an effect's parameter for the slope of the residual over the drive, over ``Search.scales_of``."""
SAME_FORCE = 1e-6
"""1 − cosine of two forces along a log up to which they count as the same."""
MUCH = 0.5
"""Share of the size of an effect that may be hidden, down to which the knowledge of a value must reduce it."""
MOST_NAMED = 3
"""Most effects that are named, those with the largest force that may be hidden."""


def hidden_effects(search: Search, refit: System, material: float) -> list[Fact]:
    """Facts on effects that cannot be told from errors of parameters with a tolerance on this log.

    The force residual r is linear in the changes of levels and toleranced values, with slopes S, and of the one
    parameter s of an effect such as a gain, with slope d. Their information matrix and the vector of the best changes
    from the refit θ, with the prior information Π about the declared values θ₀, are

        A = Σ [S d]'[S d]/σ² + diag(Π, 0),   A (Δθ, Δs) = −Σ [S d]' r/σ² + (Π (θ₀ − θ), 0)

    with σ the RMS of r and the sums over independent samples. s has the variance (A⁻¹)_ss. An effect is named if its
    size at the level ``ALPHA`` over all candidates is ``material`` and would not be if the toleranced values were
    known. Each value is named with it whose knowledge alone would reduce that size to ``MUCH`` of it. An effect that is
    the same force as one of these values, as an added inertia and a mass, is left out: that value is refitted.

    Args:
        refit: the model that is written. material: share of the RMS drive force.
    """
    problem = search.problem
    if not problem.uncertain or refit.transmissions or search.rigid:  # each effect takes a residual of a whole arm
        return []
    every = every_part(search, ())
    level = float(norm.isf(ALPHA / 2 / hypotheses(every)))
    drive = Drive(refit, problem.motion)
    rows = force_rows(refit, problem, search.moved)
    found: list[tuple[float, Fact]] = []
    for part in every:
        slope = _slope(part, refit, search)
        if slope is None:
            continue
        force = drive.share(slope)
        hidden = _hidden(problem, refit, rows, slope, level, material / force) if force > 0 else None
        if hidden is not None:
            change, reach, names = hidden
            found.append((reach * force, _in_words(part, change, reach, names)))
    return [fact for _, fact in sorted(found, key=lambda one: -one[0])[:MOST_NAMED]]


def _in_words(part: Part, change: float, reach: float, names: Sequence[str]) -> Fact:
    """The fact on an effect with the best change of its parameter, the largest change from that, and the values."""
    (parameter,) = part.effect.parameters
    neutral, most = parameter.neutral or 0.0, abs(change) + reach
    size = f"an error of up to {in_percent(most / neutral)}" if neutral else f"{parameter.name} of up to {most:.2g}"
    ends = {"low": neutral + change - reach, "high": neutral + change + reach}
    return Fact.said("note", "hidden", named=part.title, size=size, names=list(names), parameter=parameter.name, **ends)


def _slope(part: Part, refit: System, search: Search) -> Array | None:
    """(N, n) slope of ``residual_at_drive`` by the one parameter of an effect that scales its force; None if none does.

    A smaller gain alone would make all of the other residual smaller, noise too.
    """
    neutral = part.effect.parameters[0].neutral
    if len(part.names) > 1 or neutral is None:
        return None
    step = STEP * float(search.scales_of(part)[0])
    found = FoundEffect(part.kind, part.on, {part.names[0]: neutral + step}, {})
    models = with_effects(refit, [found]), refit
    changed, own = (residual_at_drive(model, search.motion) for model in models)
    return np.asarray(changed - own) / step


def _hidden(
    problem: Problem,
    refit: System,
    rows: Sequence[ForceRows],
    slope: Array,
    level: float,
    least: float,
) -> tuple[float, float, list[str]] | None:
    """Best change of an effect's parameter, its largest change from that, and the names of the values that hide it.

    None if the log shows it. ``least``: material change of the parameter.
    """
    moving = np.flatnonzero(problem.used.any(axis=0))
    columns = [np.column_stack([r.slopes, slope[r.sample, i], r.residual]) for r, i in zip(rows, moving, strict=True)]
    if any(c[:, :-1].any() and not c[:, -1].any() for c in columns):  # without noise the information is infinite
        return None
    norms = np.linalg.norm(np.vstack(columns), axis=0)
    cosines = np.vstack(columns).T @ np.vstack(columns)[:, -2] / np.maximum(norms * norms[-2], 1e-300)
    places = [k for k, s in enumerate(problem.moved) if s in problem.uncertain]
    if max(abs(cosines[k]) for k in places) >= 1 - SAME_FORCE:
        return None
    extended = [replace(r, slopes=c) for r, c in zip(rows, columns, strict=True)]
    sizes = np.array([rms(r.residual) or 1.0 for r in rows])  # a coordinate at rest has no slopes either
    count = len(problem.moved)
    whole = information(extended, sizes, np.pad(problem.prior_information, (0, 2)))
    matrix, right = whole[:-1, :-1], -whole[:-1, -1]
    away = [float(problem.system.values[s] - refit.values[s]) for s in problem.moved]
    right[:count] += problem.prior_information @ away

    def reach(known: Sequence[int]) -> float:
        kept = [k for k in range(count + 1) if k not in known]
        return level * float(np.sqrt(inverse(matrix[np.ix_(kept, kept)])[-1, -1]))

    widest = reach([])
    if widest < least or reach(places) >= least:
        return None
    names = [problem.moved[k].name for k in places if reach([k]) <= MUCH * widest]
    return (float(solved(matrix, right)[-1]), widest, names) if names else None

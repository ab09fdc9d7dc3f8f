"""Every effect of the catalogue at every place it can sit, fitted with the friction levels on blocks of the log."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from codegen.diagnosis.gram import Grams
from codegen.diagnosis.problem import Problem
from codegen.effects import CATALOGUE, Effect
from codegen.effects.declare import effect_symbols, places_of
from codegen.effects.input_delay import InputDelay
from codegen.effects.start import Covered
from codegen.spec.functions import Sgn

Array = NDArray[np.float64]
Shape = dict[str, float]

KEPT_PERIODS = 4
STANDS_OUT = 2.0
"""The best period explains at least so many times what the next one does."""
LEAST_TURNS = 1.5
"""A periodic effect is looked for only if the log covers this many of its periods."""
DEPENDENT = 1e-6


@dataclass(frozen=True, eq=False)
class Fit:
    """One effect at one place, fitted.

    Attributes:
        effect, place, on: which and where.
        parameters: of the effect, in SI.
        refitted: friction levels, and parameters within their tolerance, fitted with it; by symbol name.
        held_out: (blocks,) sum of squared scaled residuals of each block under the fit to the others.
        training: the same for the fit to all blocks.
        twins: effects that cannot be told from it, (kind, on).
    """

    effect: Effect
    place: int
    on: str
    parameters: dict[str, float]
    refitted: dict[str, float]
    held_out: Array
    training: float
    twins: tuple[tuple[str, str], ...]

    @property
    def kind(self) -> str:
        return self.effect.kind


def all_places(problem: Problem) -> list[tuple[Effect, int, str]]:
    """(effect, index, name) for every place in the system."""
    system = problem.system
    found = []
    for effect in [e for e in CATALOGUE.values() if not e.refines]:
        for index, name in enumerate(places_of(effect, system)):
            if effect.applies(system, index):
                found.append((effect, index, name))
    return found


def fit_effect(problem: Problem, effect: Effect, place: int, on: str) -> Fit | None:
    """Fit one effect with the friction levels; None where it adds nothing that the data could show.

    The weights are linear; shape parameters are scanned coarsely, and the held-out error of each block uses the shape
    that the other blocks prefer, so that a rich search earns no credit by itself. Only the few periods that a
    periodic effect is tried at are picked on all blocks.
    """
    build = _delay_build(problem, place) if isinstance(effect, InputDelay) else _column_build(problem, effect, place)
    shapes = _shape_grid(problem, effect, place)
    tried: list[tuple[Shape, Grams]] = []
    for shape in shapes:
        grams = build(shape)
        if grams is not None:
            tried.append((shape, grams))
    if not tried:
        return None
    tried.sort(key=lambda pair: pair[1].error(pair[1].fit()))
    held_out = np.array([_best_of_others(tried, b) for b in range(len(tried[0][1].products))])
    shape, grams = _refine(tried[0], build)
    weights = grams.fit()
    first = len(problem.base_ridge)
    parameters = {"T": shape["T"]} if isinstance(effect, InputDelay) else effect.recover(list(weights[first:]), shape)
    if not effect.admissible(problem.system, place, parameters):
        return None
    return Fit(
        effect,
        place,
        on,
        parameters,
        problem.refitted(weights),
        held_out,
        grams.error(weights),
        tuple(effect.twins(problem.system, place)),
    )


def _best_of_others(tried: list[tuple[Shape, Grams]], block: int) -> float:
    """Held-out error of a block with the shape that fits the other blocks best."""
    scores = []
    for _, grams in tried:
        weights = grams.fit(block)
        scores.append((grams.error(weights) - grams.error(weights, block), grams.error(weights, block)))
    return min(scores)[1]


def _column_build(problem: Problem, effect: Effect, place: int) -> Callable[[Shape], Grams | None]:
    def build(shape: Shape) -> Grams | None:
        columns = problem.effect_columns(effect, place, shape)
        used = [columns[:, b.index >= 0, i] for i, b in enumerate(problem.blocks)]
        if not all(np.isfinite(u).all() for u in used) or not any(np.abs(u).max(initial=0.0) > 0 for u in used):
            return None
        grams = problem.grams(columns)
        return grams if grams.conditioning() > DEPENDENT else None

    return build


def _delay_build(problem: Problem, place: int) -> Callable[[Shape], Grams | None]:
    def build(shape: Shape) -> Grams | None:
        return problem.grams(np.empty((0, *problem.target.shape)), problem.delayed_target(place, shape["T"]))

    return build


def _refine(best: tuple[Shape, Grams], build: Callable[[Shape], Grams | None]) -> tuple[Shape, Grams]:
    """Polish a single shape parameter around its best grid point (in logarithm)."""
    shape, grams = best
    if len(shape) != 1:
        return best
    (name, value), found = next(iter(shape.items())), {}

    def error(log_value: float) -> float:
        candidate = build({name: float(np.exp(log_value))})
        if candidate is None:
            return float("inf")
        found[log_value] = candidate
        return candidate.error(candidate.fit())

    width = 0.02 if name == "period" else 0.3
    result = minimize_scalar(
        error, bounds=(np.log(value) - width, np.log(value) + width), method="bounded", options={"maxiter": 12}
    )
    if result.fun < grams.error(grams.fit()):
        return {name: float(np.exp(result.x))}, found[result.x]
    return best


def _shape_grid(problem: Problem, effect: Effect, place: int) -> list[Shape]:
    """Starting values of the shape parameters from what the log covers."""
    p = effect_symbols(effect, places_of(effect, problem.system)[place], problem.system)
    _, names = effect.regressors(problem.system, place, p)
    motion = problem.motion
    covered = Covered(
        duration=float(motion.time[-1] - motion.time[0]),
        sample_time=motion.sample_time,
        top_speed=float(np.quantile(np.abs(motion.velocities[motion.usable]), 0.95)),
        periods=lambda: [float(period) for period in _period_grid(problem, effect, place)],
    )
    return effect.starts(covered, ("T",) if isinstance(effect, InputDelay) else names)


def _period_grid(problem: Problem, effect: Effect, place: int) -> Array:
    """The periods that stand out in the refitted residual over position: peaks of a fine scan."""
    touched = (
        [k for k, entry in enumerate(problem.system.distribution.T.tolist()[place]) if entry != 0]
        if effect.sits_on == "contact"
        else [place]
    )
    i = touched[0]
    used = problem.blocks[i].index >= 0
    x = problem.motion.positions[used, i]
    left = problem.target - np.tensordot(problem.base.fit(), problem.base_columns, axes=1)
    y = left[used, i] * (np.sign(problem.motion.velocities[used, i]) if _follows_sign(problem, effect, place) else 1.0)
    span = float(np.ptp(x))
    if span <= 0 or len(x) < 50:
        return np.empty(0)
    highest = min(400.0, len(x) / 8)
    turns = np.arange(LEAST_TURNS, highest, 0.2) / span
    power = np.empty(len(turns))
    y = y - y.mean()
    for k, f in enumerate(turns):
        waves = np.column_stack([np.sin(2 * np.pi * f * x), np.cos(2 * np.pi * f * x)])
        weights, *_ = np.linalg.lstsq(waves.T @ waves, waves.T @ y, rcond=None)
        power[k] = weights @ (waves.T @ y)
    peaks = [k for k in range(len(power)) if power[k] == power[max(0, k - 3) : k + 4].max()]
    best = sorted(peaks, key=lambda k: -power[k])
    if not best or not _stands_out(best, turns, power):
        return np.empty(0)
    return np.array([1 / turns[k] for k in best[:KEPT_PERIODS]])


def _stands_out(best: list[int], turns: Array, power: Array) -> bool:
    """Whether the first peak is far above every other that is not its harmonic: else any period would do as well."""
    for k in best[1:]:
        ratio = max(turns[k], turns[best[0]]) / min(turns[k], turns[best[0]])
        if abs(ratio - round(ratio)) > 0.04 * ratio or round(ratio) == 1:
            return bool(power[best[0]] >= STANDS_OUT * power[k])
    return True


def _follows_sign(problem: Problem, effect: Effect, place: int) -> bool:
    p = effect_symbols(effect, places_of(effect, problem.system)[place], problem.system)
    columns, _ = effect.regressors(problem.system, place, p)
    return any(c.has(Sgn) for c in columns)

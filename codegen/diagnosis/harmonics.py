"""Cogging with several waves: which orders the force residual holds over position, and the effect that has them.

A sine is what the rounds try; a motor's slots, poles and eccentricity make a sum of them, which a free run of one sine
leaves too soon to be fitted. The sum is linear in its weights, so the force residual finds it first: orders one by one,
judged on blocks of the log that their weights were not fitted to. The free runs then refine it and decide.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from codegen.diagnosis.attempt import NEAR, SHORTEST, Found
from codegen.diagnosis.conclusion import force_agrees
from codegen.diagnosis.credit import evidence, held_out_losses, level, noise_loss
from codegen.diagnosis.measure import Window, force_errors
from codegen.diagnosis.models import with_effects, with_values
from codegen.diagnosis.output_error import Shot
from codegen.diagnosis.problem import Problem
from codegen.diagnosis.ranking import Ranked, chance, credible, weight_of
from codegen.diagnosis.residual import inverse_dynamics_residual
from codegen.diagnosis.results import FoundEffect
from codegen.diagnosis.rounds import Outcome, explained_share, pruned, worth_it
from codegen.diagnosis.search import Search
from codegen.diagnosis.trial import Part, part_of
from codegen.effects.cogging_harmonics import CoggingHarmonics
from codegen.effects.family import candidates, kinds_of
from codegen.effects.periodic import PERIOD
from codegen.mechanics.system import System

Array = NDArray[np.float64]

BLOCKS = 8
MOST_ORDER, MOST_WAVES = 120, 40
COVERED, TURNS = 0.9, 1.5
"""Share of a period that the log must cover, and periods that it must pass: a place is seen more than once."""
MULTIPLES = 6
"""A sine that was found may be a wave of a period up to so many times its own."""
LEAST_SHARE = 0.2
"""Of the squared force residual, on blocks held out: less is left to what else may be missing."""
WORTH = 0.003
"""Of that residual: what a wave more must explain."""
FAST = 3.0
"""Usual speeds: above, waves pass too fast to be seen, and what throws the machine so fast is no cogging."""
REACH = 1.5
"""Cutoffs of the coarse filter: a wave that passes faster than this at the usual speed is not seen."""


@dataclass(frozen=True, eq=False)
class Waves:
    """A sparse sum over one coordinate's force residual.

    Attributes:
        coordinate: index. period: SI.
        orders: rising. weights: (2 per order) of sine and cosine, of the effect e.
        share: of the squared residual that it removes on blocks held out.
    """

    coordinate: int
    period: float
    orders: tuple[int, ...]
    weights: Array
    share: float

    def effect(self, richer: CoggingHarmonics) -> CoggingHarmonics:
        """A richer form of a sine with these orders."""
        return richer.of_orders(self.orders)

    def parameters(self, richer: CoggingHarmonics) -> dict[str, float]:
        """Of that effect."""
        return self.effect(richer).values(self.period, [(float(a), float(b)) for a, b in self.weights.reshape(-1, 2)])


def with_harmonics(search: Search, outcome: Outcome, problem: Problem) -> tuple[Outcome, Search]:
    """The outcome with a cogging of several waves in place of what it has, where free runs credit that.

    Tried on every coordinate on which a sine stands or passed its tests alone, and on angles that turn often enough.
    Where the refit is far from the data, on short segments: a rotor in steep cogging leaves its motion soon.

    Returns:
        The outcome, and the search on whose segments its last fit is.
    """
    standing = search
    near, base, final = search, outcome.base, outcome.final
    if final is not base and not force_agrees(final, problem, _system(search, base), _system(search, final)):
        final = base  # what predicts by coasting need not be beaten
    if level(base) > NEAR:
        near = replace(search, record=search.shorter(SHORTEST), shorter=lambda share: search.shorter(SHORTEST * share))
        base, final = near.elsewhere(base), near.elsewhere(final)
    parts = final.runner.trial.parts
    for i, richer in _richer_forms(search.system).items():
        on = search.system.positions[i].name
        rest = [k for k, p in enumerate(parts) if not _is_sine(p, on, richer)]
        periods = sorted(_periods(search, outcome, problem, i, richer))
        best: Shot | None = None
        for kept in ([[], rest] if rest else [[]]) if periods else []:
            moved, system = _start(near, final, problem, kept)
            waves = _best(periods, system, problem, i)
            if waves is None:
                continue
            fitted = pruned(near, _fitted(near, final, moved, kept, waves, richer), MOST_ORDER, spared=1)
            if best is None or worth_it(near, best, fitted, MOST_ORDER):
                best = fitted
        if best is not None and credible(near, base, best, MOST_ORDER) and worth_it(near, final, best, MOST_ORDER):
            outcome, standing = _adopted(near, outcome, base, best), near
            final, parts = best, best.runner.trial.parts
    return outcome, standing


def _richer_forms(system: System) -> dict[int, CoggingHarmonics]:
    """For each coordinate the effect that has several waves."""
    return {place: effect for effect, place in candidates(system) if isinstance(effect, CoggingHarmonics)}


def _is_sine(part: Part, on: str, richer: CoggingHarmonics) -> bool:
    """Whether a part is the effect of one wave on a coordinate of which another is the richer form."""
    return part.on == on and richer.refines in kinds_of(part.kind)


def _best(periods: Sequence[float], system: System, problem: Problem, coordinate: int) -> Waves | None:
    """The waves of the period that explains most, the shorter of two that explain alike; None for a lone wave."""
    residual = inverse_dynamics_residual(system, problem.motion)[:, coordinate]
    tried = (regress(system, problem, -residual, coordinate, period) for period in periods)
    found = [waves for waves in tried if waves is not None]
    if not found:
        return None
    most = max(w.share for w in found)
    best = next(w for w in found if w.share >= most - WORTH)
    return best if best.share >= LEAST_SHARE and len(best.orders) > 1 else None


def _start(search: Search, shot: Shot, problem: Problem, kept: Sequence[int]) -> tuple[Array, System]:
    """Values of what every fit moves, those of the fit or as declared, and the system with them: the less wrong one.

    A refit that could not follow the motion may be further from the forces than what was declared.
    """
    fitted, window = shot.runner.trial.split(shot.theta)[0], Window(0, len(problem.motion.time))
    ways = [(values, _system(search, shot, kept, values)) for values in (fitted, search.declared)]
    return min(ways, key=lambda way: force_errors(way[1], problem.motion, problem.masks, window)[2])


def _system(search: Search, shot: Shot, kept: Sequence[int] | None = None, moved: Array | None = None) -> System:
    """The declared system with a fit's values and effects, or those of them that are kept, or other values."""
    trial = shot.runner.trial
    own, found = trial.split(shot.theta)
    named = {s.name: float(v) for s, v in zip(search.moved, own if moved is None else moved, strict=True)}
    chosen = range(len(found)) if kept is None else kept
    effects = [FoundEffect(trial.parts[k].kind, trial.parts[k].on, found[k], {}) for k in chosen]
    return with_effects(with_values(search.system, named), effects)


def _periods(
    search: Search, outcome: Outcome, problem: Problem, coordinate: int, richer: CoggingHarmonics
) -> Iterator[float]:
    """A whole turn of an angle, and multiples of the sines that were found."""
    system, motion = search.system, problem.motion
    x, used = motion.positions[:, coordinate], motion.usable[1:] & motion.usable[:-1]
    span, way = float(np.ptp(x[motion.usable])), float(np.abs(np.diff(x))[used].sum())
    on = system.positions[coordinate].name
    whole = [2 * np.pi] if system.position_units[coordinate] == "rad" else []
    trial = outcome.final.runner.trial
    ours = zip(trial.parts, trial.split(outcome.final.theta)[1], strict=True)
    sines = [v[PERIOD.name] for p, v in ours if _is_sine(p, on, richer)]
    sines += [
        r.found.parameters[PERIOD.name]
        for r in outcome.first
        if _is_sine(r.found.part, on, richer) and (not r.why_not or r.unsure) and not sines
    ]
    for period in {*whole, *(m * s for s in sines for m in range(1, MULTIPLES + 1))}:
        if COVERED * period <= span and TURNS * period <= way:
            yield float(period)


def regress(system: System, problem: Problem, force: Array, coordinate: int, period: float) -> Waves | None:
    """A sparse sum of sines and cosines of one period for a low-passed force along the motion.

    Offset and direction of motion stand beside the waves: a level that is a little off is none of them.

    Args:
        force: (N,) what the effect e must have been.
    """
    motion, rows = problem.motion, problem.masks.rows[:, coordinate]
    x, v = motion.positions[:, coordinate], motion.velocities[:, coordinate]
    usual = float(np.median(np.abs(v[rows]))) if rows.any() else 0.0
    if usual <= 0.0:
        return None
    rows = rows & (np.abs(v) <= FAST * usual)
    highest = min(MOST_ORDER, int(REACH * motion.cutoff_hz * period / usual))
    if highest < 1 or rows.sum() < 4 * highest * BLOCKS:
        return None
    turn = 2 * np.pi * x[:, None] * np.arange(1, highest + 1) / period
    waves = np.stack([np.sin(turn), np.cos(turn)], axis=2).reshape(len(x), -1)
    columns = motion.low_pass(np.column_stack([np.ones_like(x), np.sign(v), waves]))[rows]
    blocks = np.array_split(np.column_stack([columns, force[rows]]), BLOCKS)
    grams = np.stack([b.T @ b for b in blocks])
    orders, weights, share = _sparse(grams, highest)
    return Waves(coordinate, period, orders, weights, share) if orders else None


def _sparse(grams: Array, highest: int) -> tuple[tuple[int, ...], Array, float]:
    """Orders, their weights and the share explained on held-out blocks, from (blocks, columns + 1, columns + 1) sums.

    The first two columns stand in any sum; then come a sine and a cosine for each order; the force is the last.
    """
    whole = grams.sum(axis=0)
    start = _held_out(grams, [0, 1])
    chosen: list[int] = []
    best: tuple[float, tuple[int, ...]] = (start, ())
    orders_all = np.arange(1, highest + 1)
    both = np.stack([2 * orders_all, 2 * orders_all + 1], axis=1)
    own = np.linalg.pinv(whole[both[:, :, None], both[:, None, :]], rcond=1e-9, hermitian=True)
    for _ in range(min(MOST_WAVES, highest)):
        used = _columns(chosen)
        left = whole[:, -1] - whole[:, used] @ _solve(whole[np.ix_(used, used)], whole[used, -1])
        gains = np.einsum("ki,kij,kj->k", left[both], own, left[both])
        gains[[k - 1 for k in chosen]] = -np.inf
        chosen.append(int(np.argmax(gains)) + 1)
        error = _held_out(grams, _columns(chosen))
        if error < best[0] - WORTH * start * (len(chosen) - len(best[1])):
            best = (error, tuple(chosen))
    orders = tuple(sorted(best[1]))
    used = _columns(orders)
    weights = _solve(whole[np.ix_(used, used)], whole[used, -1])[2:]
    return orders, weights, 1 - best[0] / start if start > 0 else 0.0


def _pair(order: int) -> list[int]:
    return [2 * order, 2 * order + 1]


def _columns(orders: Sequence[int]) -> list[int]:
    return [0, 1, *(column for k in orders for column in _pair(k))]


def _held_out(grams: Array, used: Sequence[int]) -> float:
    """Squared error summed over blocks, each with weights from the others."""
    whole, error = grams.sum(axis=0), 0.0
    for block in grams:
        rest = whole - block
        weights = _solve(rest[np.ix_(used, used)], rest[used, -1])
        inner = block[np.ix_(used, used)]
        error += float(block[-1, -1] - 2 * weights @ block[used, -1] + weights @ inner @ weights)
    return error


def _solve(matrix: Array, right: Array) -> Array:
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    return np.asarray(np.linalg.lstsq(matrix / np.outer(size, size), right / size, rcond=1e-9)[0] / size)


def _fitted(
    search: Search, shot: Shot, moved: Array, kept: Sequence[int], waves: Waves, richer: CoggingHarmonics
) -> Shot:
    trial = shot.runner.trial
    found = trial.split(shot.theta)[1]
    part = part_of(waves.effect(richer), waves.coordinate, search.system)
    parts = [*(trial.parts[k] for k in kept), part]
    return search.exchanged(shot, moved, parts, [*(found[k] for k in kept), waves.parameters(richer)])


def _adopted(search: Search, outcome: Outcome, before: Shot, richer: Shot) -> Outcome:
    """The outcome with this fit as its last, and its waves among the candidates."""
    soft, base = search.softened(before)
    after = soft.rebased(richer)
    now, losses = held_out_losses(base), held_out_losses(after)
    one = evidence(now, losses, base.residual.shape[1], noise_loss(base) / len(now))
    found = Found(richer.runner.trial, richer)
    ratio, p = level(after) / level(base), chance(search, after, one, 1)
    ranked = Ranked(found, one, losses, ratio, weight_of(search, found, base), "", p=p)
    return replace(
        outcome,
        final=richer,
        first=(*outcome.first, ranked),
        rivals=(),
        explained=explained_share(search, before, richer),
        unexplained=False,
    )

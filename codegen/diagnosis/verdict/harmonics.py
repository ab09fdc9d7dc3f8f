"""Cogging with several harmonics: orders selected on the force residual over position, then fitted in free runs.

Cogging is a sum of sines by slots, poles and eccentricity; free runs with a single sine diverge too soon to be fitted.
The force residual is linear in the weights, so that orders are added one by one and judged on held-out blocks.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.force_gain import ForceCriterion, nested_evidence_of
from codegen.diagnosis.fit.acceptance import noise_ratio
from codegen.diagnosis.fit.linear import solved
from codegen.diagnosis.fit.measure import force_errors
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.residual import Problem, inverse_dynamics_residual
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.signals import low_pass
from codegen.diagnosis.fit.trial import Part, part_of
from codegen.diagnosis.selection.candidate_fits import NEAR, SHORTEST
from codegen.diagnosis.selection.comparison import runs_prefer
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.parsimony import BETTER, at_noise, force_speaks_for, pruned, worth_it
from codegen.diagnosis.selection.ranking import Ranked, credible
from codegen.diagnosis.selection.refusals import relative_size
from codegen.diagnosis.selection.significance import p_by_free_runs
from codegen.diagnosis.verdict.answer import force_agrees
from codegen.effects.periodic import PERIOD, CoggingHarmonics
from codegen.effects.register import candidates, kinds_of
from codegen.mechanics.system import System

BLOCKS = 8
MOST_ORDER, MOST_WAVES = 120, 40
COVERED, TURNS = 0.9, 1.5
"""Least share of a turn that the log covers, and least number of turns that the motion travels."""
REPEATS = 2.0
"""Least number of periods in the stroke, of a period that is no turn of an angle."""
MULTIPLES = 6
"""Largest multiple of a found sine's period that is tried as the period."""
LEAST_SHARE = 0.2
"""Least share of the squared force residual that is explained on held-out blocks."""
WORTH = 0.003
"""Least share of that residual that each further harmonic explains."""
FAST = 3.0
"""Multiple of the median speed above which samples are left out, since harmonics pass too fast."""
REACH = 1.5
"""Highest frequency of a harmonic at the median speed, in cutoffs of the coarse filter."""
DENSE = 2.2 * REACH * FAST
"""Least samples in a period of the cutoff: more than two in that of the fastest wave, so that none is aliased."""


@dataclass(frozen=True, eq=False)
class Waves:
    """Harmonics of one coordinate's force residual: orders, (2 per order) weights, and the share removed held-out."""

    period: float
    orders: tuple[int, ...]
    weights: Array
    share: float

    def parameters(self, richer: CoggingHarmonics) -> dict[str, float]:
        pairs = [(float(a), float(b)) for a, b in self.weights.reshape(-1, 2)]
        return richer.of_orders(self.orders).values(self.period, pairs)


def with_harmonics(search: Search, outcome: Outcome) -> tuple[Outcome, Search]:
    """The outcome with a cogging of several harmonics if free runs accept it, and the search of its last fit.

    Its segments are short if the refit is far from the data, since free runs of a rotor in steep cogging soon diverge.
    """
    final_search = near = search
    base, final = outcome.base, outcome.final
    if final is not base and not force_agrees(final, search.problem, base.model, final.model):
        final = base  # the force residual contradicts this fit: it is no reference
    if at_noise(final):
        return outcome, search
    if noise_ratio(base) > NEAR:
        near = search.on_shorter(SHORTEST)
        base, final = near.on_another_record(base), near.on_another_record(final)
    forms = {i: effect for effect, i in candidates(search.system) if isinstance(effect, CoggingHarmonics)}
    for i, effect in forms.items():  # a user's own form in place of the shipped one
        on = search.system.positions[i].name
        rest = [k for k, p in enumerate(final.trial.parts) if not _is_sine(p, on, effect)]
        periods = sorted(_periods(search, outcome, i, effect))
        if not periods:
            continue
        best: Fit | None = None
        for kept in [[], rest] if rest else [[]]:
            refitted_values, system = _start(near, final, kept)
            waves = _best(periods, system, search.problem, i)
            if waves is None:
                continue
            part = part_of(effect.of_orders(waves.orders), i, near.system)
            parts, values = [final.trial.parts[k] for k in kept], [final.values[1][k] for k in kept]
            richer = near.with_parts(final, refitted_values, [*parts, part], [*values, waves.parameters(effect)])
            fitted = pruned(near, richer, MOST_ORDER, spared=1)
            if best is None or worth_it(near, best, fitted, MOST_ORDER):
                best = fitted
        if best is not None and credible(near, base, best, MOST_ORDER) and _is_better(near, final, best):
            outcome, final_search, final = _adopted(near, outcome, base, best), near, best
    return outcome, final_search


def _is_better(search: Search, final: Fit, richer: Fit) -> bool:
    """Whether free runs prefer the fit with harmonics.

    With fewer effects than the other fit it is judged as a replacement: its cost is lower by ``BETTER``, free runs
    prefer it, and the force residual does not prefer the other. Otherwise it must explain a further effect's share.
    """
    if len(richer.trial.parts) >= len(final.trial.parts):
        return worth_it(search, final, richer, MOST_ORDER)
    better = richer.cost < final.cost - BETTER and runs_prefer(search, richer, final)
    return better and not force_speaks_for(ForceCriterion(search, final), richer)


def _is_sine(part: Part, on: str, richer: CoggingHarmonics) -> bool:
    """Whether a part is the single-sine form, on this coordinate, of the effect with harmonics."""
    return part.on == on and richer.refines in kinds_of(part.kind)


def _best(periods: Sequence[float], system: System, problem: Problem, coordinate: int) -> Waves | None:
    """The harmonics of the period that explains most, the shortest of equals; None for a single sine."""
    residual = inverse_dynamics_residual(system, problem.motion)[:, coordinate]
    tried = (regress(problem, -residual, coordinate, period) for period in periods)
    found = [waves for waves in tried if waves is not None]
    most = max((w.share for w in found), default=0.0)
    best = next((w for w in found if w.share >= most - WORTH), None)
    return best if best and best.share >= LEAST_SHARE and len(best.orders) > 1 else None


def _start(search: Search, fit: Fit, kept: Sequence[int]) -> tuple[Array, System]:
    """Refitted or declared values, whichever have the smaller force residual, and the system with the kept effects."""
    own, found = fit.values
    some = replace(fit.trial, parts=tuple(fit.trial.parts[k] for k in kept))
    ways = [(values, some.model(values, [found[k] for k in kept])) for values in (own, search.declared)]
    return min(ways, key=lambda way: force_errors(way[1], search.motion, search.problem.used)[2])


def _periods(search: Search, outcome: Outcome, coordinate: int, richer: CoggingHarmonics) -> Iterator[float]:
    """Periods to try: a whole turn of an angle, and multiples of single sines that were accepted."""
    system, motion = search.system, search.motion
    x, used = motion.positions[:, coordinate], motion.usable[1:] & motion.usable[:-1]
    span, travelled = float(np.ptp(x[motion.usable])), float(np.abs(np.diff(x))[used].sum())
    on = system.positions[coordinate].name
    whole = [2 * np.pi] if system.position_units[coordinate] == "rad" else []
    ours = zip(outcome.parts, outcome.final.values[1], strict=True)
    sines = [v[PERIOD.name] for p, v in ours if _is_sine(p, on, richer)]
    sines += [
        r.found.parameters[PERIOD.name] for r in outcome.first if _is_sine(r.part, on, richer) and r.grade and not sines
    ]
    for period in whole:
        if COVERED * period <= span and TURNS * period <= travelled:
            yield period
    for period in {m * s for s in sines for m in range(1, MULTIPLES + 1)}:
        if REPEATS * period <= span:
            yield float(period)


def regress(problem: Problem, force: Array, coordinate: int, period: float) -> Waves | None:
    """A sparse sum of sines and cosines of one period, with an offset and a friction level, fitted to a force (N,)."""
    motion, rows = problem.motion, problem.used[:, coordinate]
    x, v = motion.positions[:, coordinate], motion.velocities[:, coordinate]
    usual = float(np.median(np.abs(v[rows]))) if rows.any() else 0.0
    if usual <= 0.0:
        return None
    rows = rows & (np.abs(v) <= FAST * usual)
    highest = min(MOST_ORDER, int(REACH * motion.cutoff_hz * period / usual))
    if highest < 1 or rows.sum() < 4 * highest * BLOCKS:
        return None
    step = motion.step(DENSE)
    x, v, rows, force = x[::step], v[::step], rows[::step], force[::step]
    turn = 2 * np.pi * x[:, None] * np.arange(1, highest + 1) / period
    waves = np.stack([np.sin(turn), np.cos(turn)], axis=2).reshape(len(x), -1)
    columns = np.column_stack([np.ones_like(x), np.sign(v), waves])
    columns = low_pass(columns, motion.cutoff_hz, step * motion.sample_time)[rows]
    blocks = np.array_split(np.column_stack([columns, force[rows]]), BLOCKS)
    grams = np.stack([b.T @ b for b in blocks])
    orders, weights, share = _sparse(grams, highest)
    return Waves(period, orders, weights, share) if orders else None


def _sparse(grams: Array, highest: int) -> tuple[tuple[int, ...], Array, float]:
    """Orders, weights and the share explained on held-out blocks; orders are added by largest gain.

    From (blocks, columns + 1, columns + 1) Grams of offset, direction, sine and cosine of each order, and the force.
    The direction is left out where it predicts held-out blocks worse.
    """
    whole = grams.sum(axis=0)
    start, fixed = min((_held_out(grams, columns), columns) for columns in ([0], [0, 1]))
    chosen: list[int] = []
    best: tuple[float, tuple[int, ...]] = (start, ())
    orders_all = np.arange(1, highest + 1)
    both = np.stack([2 * orders_all, 2 * orders_all + 1], axis=1)
    own = np.linalg.pinv(whole[both[:, :, None], both[:, None, :]], rcond=1e-9, hermitian=True)
    for _ in range(min(MOST_WAVES, highest)):
        used = _columns(fixed, chosen)
        left = whole[:, -1] - whole[:, used] @ solved(whole[np.ix_(used, used)], whole[used, -1], 1e-9)
        gains = np.einsum("ki,kij,kj->k", left[both], own, left[both])
        gains[[k - 1 for k in chosen]] = -np.inf
        chosen.append(int(np.argmax(gains)) + 1)
        error = _held_out(grams, _columns(fixed, chosen))
        if error < best[0] - WORTH * start * (len(chosen) - len(best[1])):
            best = (error, tuple(chosen))
    orders = tuple(sorted(best[1]))
    used = _columns(fixed, orders)
    weights = solved(whole[np.ix_(used, used)], whole[used, -1], 1e-9)[len(fixed) :]
    return orders, weights, 1 - best[0] / start if start > 0 else 0.0


def _columns(fixed: Sequence[int], orders: Sequence[int]) -> list[int]:
    return [*fixed, *(column for k in orders for column in (2 * k, 2 * k + 1))]


def _held_out(grams: Array, used: Sequence[int]) -> float:
    """Squared error summed over blocks, each with weights fitted to the others."""
    whole, error = grams.sum(axis=0), 0.0
    for block in grams:
        rest = whole - block
        weights = solved(rest[np.ix_(used, used)], rest[used, -1], 1e-9)
        inner = block[np.ix_(used, used)]
        error += float(block[-1, -1] - 2 * weights @ block[used, -1] + weights @ inner @ weights)
    return error


def _adopted(search: Search, outcome: Outcome, before: Fit, richer: Fit) -> Outcome:
    """The outcome with a richer fit, and its effect among the candidates."""
    soft, base = search.with_noise_floor(before)
    after = soft.fitted_again(richer)
    one, ratio = nested_evidence_of(base, after), noise_ratio(after) / noise_ratio(base)
    ranked = Ranked(
        richer, one, ratio, relative_size(search, richer, base), "", p=p_by_free_runs(search, after, one, 1)
    )
    return replace(outcome.with_final(search, richer, ()), first=(*outcome.first, ranked))

"""Changes in time of the force balance: intervals in which a constant force, or another coefficient, explains more.

Held-out pieces of the log cannot show a single event; comparison with the residual in the rest of the log can (epidemic
changepoints). In each interval of blocks of the log the low-passed residual r is regressed on a constant (an
external force), the sign of the slip (another friction level), the row of M a (another inertia) or the slip velocity
(another viscous friction), with one coefficient inside and another outside. The interval and term that remove most of
Σr² are added to a joint regression, and the next are sought in its residual, while the two coefficients differ by at
least ``LEAST_Z`` standard deviations. These are of sums over blocks, so that the noise need not be white in a block.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.diagnosis.fit.linear import regressed
from codegen.diagnosis.results import Change, Term

MOST_BLOCKS = 600
LEAST_BLOCKS = 3
"""Most blocks of the log, and least blocks of an interval. A block is at least a period of the coarse cutoff."""
FEWEST = 16
"""Least number of blocks of a log that is tested."""
LEAST_Z = 6.0
"""Least difference in standard deviations; 600²/2 intervals times four terms need 5.8 for 1 % of false alarms."""
SURELY = 2.0
"""Least ratio of the difference to its bias by noise in the term, of which only an estimate is known."""
MOST_CHANGES = 12
AS_GOOD = 0.95
"""Share of the squares removed by the best term from which on an earlier term, a constant force first, is taken."""


@dataclass(frozen=True)
class ChangesInTime:
    """Changes in time, the share of Σr² that they explain, and that with unchanged coefficients in addition."""

    changes: tuple[Change, ...]
    share: float
    whole: float


def changes_in_time(
    residual: Array,
    rows: NDArray[np.bool_],
    terms: Mapping[Term, Array],
    time: Array,
    cutoff_hz: float,
    noise: Mapping[Term, float] | None = None,
) -> ChangesInTime:
    """Intervals in which terms of the force balance have another coefficient, the one that explains most first.

    Of a residual (N,) at the samples ``rows``, on terms (N,) with the same low-pass. ``noise``: mean square of the
    noise that a term has in common with the residual, such as of a measured acceleration; it biases the coefficient by
    −noise/power.
    """
    used = np.flatnonzero(rows)
    lasted = float(time[used[-1]] - time[used[0]]) if len(used) else 0.0
    count = min(MOST_BLOCKS, int(lasted * cutoff_hz))
    if count < FEWEST:
        return ChangesInTime((), 0.0, 0.0)
    block = np.minimum(((time[used] - time[used[0]]) * (count / lasted)).astype(int), count - 1)
    edges = time[used[0]] + np.arange(count + 1) * (lasted / count)
    columns = {name: term[used] for name, term in terms.items()}
    powers = {name: _sums(block, p**2, count) for name, p in columns.items()}
    y, always, counts = residual[used], list(columns.values()), np.bincount(block, minlength=count).astype(float)
    model, found, left = always, list[tuple[Term, int, int]](), regressed(y, np.column_stack(always))[1]
    spans = np.stack(np.triu_indices(count + 1, LEAST_BLOCKS))
    spans = spans[:, spans[1] - spans[0] <= count - LEAST_BLOCKS]
    while len(found) < MOST_CHANGES:
        best = {name: _best(_sums(block, p * left, count), powers[name], spans) for name, p in columns.items()}
        most = max(gain for gain, _ in best.values())
        if most <= 0:
            break
        name = next(one for one, (gain, _) in best.items() if gain >= AS_GOOD * most)
        start, stop = best[name][1]
        added = np.where((block >= start) & (block < stop), columns[name], 0.0)
        coefficients, after = regressed(y, np.column_stack([*model, added]))
        by_block, size = _sums(block, columns[name] * after, count), abs(coefficients[-1])
        in_term = (noise or {}).get(name, 0.0)
        bias, deviation = _uncertainty(by_block, powers[name], counts, in_term, slice(start, stop))
        surely = size - SURELY * abs(bias)
        if surely < LEAST_Z * deviation:
            if surely < size and len(columns) > 1:
                del columns[name]
                continue
            break
        model, left = [*model, added], after
        found.append((name, start, stop))
    coefficients, total = regressed(y, np.column_stack(model))[0], max(float(y @ y), 1e-300)
    forces = [c * column for c, column in zip(coefficients, model, strict=True)]
    own = coefficients[len(always) :]
    changes = [
        Change(name, float(edges[a]), float(edges[b]), float(c)) for (name, a, b), c in zip(found, own, strict=True)
    ]
    unchanged = y - np.sum(forces[: len(always)], axis=0)
    whole = 1 - float(left @ left) / total
    share = float(unchanged @ unchanged - left @ left) / total if found else 0.0
    return ChangesInTime(tuple(changes), min(max(0.0, share), whole), whole)


def _sums(block: NDArray[np.int_], values: Array, count: int) -> Array:
    """(count,) sum of values over each block."""
    return np.asarray(np.bincount(block, weights=values, minlength=count), dtype=np.float64)


def _best(sums: Array, powers: Array, spans: NDArray[np.int_]) -> tuple[float, tuple[int, int]]:
    """The largest reduction of Σr² by an interval's own coefficient, over one for the whole log, and the interval."""
    along, power = (np.concatenate([[0.0], np.cumsum(z)]) for z in (sums, powers))
    starts, stops = spans
    within, over = along[stops] - along[starts], power[stops] - power[starts]
    least = 1e-9 * float(power[-1])
    enough = (over > least) & (power[-1] - over > least)
    rest = np.where(enough, power[-1] - over, np.inf)
    gains = within**2 / np.where(enough, over, np.inf) + (along[-1] - within) ** 2 / rest
    k = int(np.argmax(gains))
    span = (int(starts[k]), int(stops[k])) if starts[k] else (int(stops[k]), len(sums))  # the later of two parts
    return float(gains[k] - along[-1] ** 2 / max(float(power[-1]), 1e-300)), span


def _uncertainty(sums: Array, powers: Array, counts: Array, noise: float, interval: slice) -> tuple[float, float]:
    """Bias by noise in the term, and standard deviation, of an interval's coefficient less that of the rest.

    By sums over blocks. The variance is at least that of all blocks, so that few blocks with little noise do not count.
    """
    inside = np.zeros(len(sums), dtype=bool)
    inside[interval] = True
    everywhere, whole = float((sums**2).sum()), max(float(powers.sum()), 1e-300)
    biases, variance = [], 0.0
    for part in (inside, ~inside):
        power = max(float(powers[part].sum()), 1e-300)
        biases.append(noise * float(counts[part].sum()) / power)
        variance += max(float((sums[part] ** 2).sum()), everywhere * power / whole) / power**2
    return biases[1] - biases[0], float(np.sqrt(variance))

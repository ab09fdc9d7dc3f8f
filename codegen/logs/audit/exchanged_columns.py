"""Preflight of the columns: exchanged columns, and velocities that were read as positions.

Other assignments of the columns are tried, also with positions that are integrals of their columns. A finding names an
assignment with which the balance of forces has a far smaller misfit than as read.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations, permutations

import numpy as np
from scipy.integrate import cumulative_trapezoid

from codegen.base.arrays import Array
from codegen.base.errors import Place
from codegen.base.significant import in_percent
from codegen.base.user_text import shown
from codegen.logs.audit.force_balance import Balance, Forces
from codegen.logs.log import Finding, Log
from codegen.logs.motion import Motion, low_pass, measured_motion
from codegen.spec.model import Spec
from codegen.spec.units import si_factor

FITS, BETTER = 0.25, 0.5
"""Largest misfit of another assignment that is accepted, and its largest ratio to the misfit as read."""
NEARLY = 0.05
"""Least misfit as read at which exchanged axes are tried. Up to ``FITS`` only axes are: if friction is large in both,
the motion of one axis may balance most of the forces of another one."""
FAR_BETTER = 0.1
"""Largest ratio of the misfit of another assignment to that as read, if that is below ``FITS`` or columns are
integrated."""
IN_ANY_ORDER, MOST_TRIED = 3, 70
"""Most variables of which all orders are tried (of more, pairs and axes), and most orders that are tried."""
UNSURE, ALL_FIT, MOST_ALIKE = 2.0, 0.01, 3
"""Orders are alternatives if their misfit is within a factor of the best or below a value; most that are reported."""
Order = tuple[int, ...]
"""Variable k takes the column of variable ``order[k]``."""


def exchanged_columns(log: Log, spec: Spec, balance: Balance, motion: Motion, forces: Forces) -> Iterator[Finding]:
    """A finding on the assignments of columns with which the forces balance, if they do not as read."""
    now = max(forces.misfit, velocity_mismatch(log, motion))
    if now <= NEARLY or log.intake.doubted:
        return
    names, values = values_of(log, spec)
    factors = np.array([_stated_factor(name, log, spec) for name in names])
    orders = _orders(len(spec.positions), len(spec.inputs), log.velocities is not None, axes_alone=now <= FITS)
    tried = []
    for order in orders:
        other = with_values(log, values[:, order] / factors[list(order)] * factors)
        left = _misfit(other, balance)
        if left is not None:
            tried.append((left, order))
    tried.sort(key=lambda one: one[0])
    enough = min(FITS, BETTER * now) if now > FITS else FAR_BETTER * now
    integrated = _integrated(log, balance) if now > FITS else (1.0, ())
    if integrated[0] <= min([FAR_BETTER * now, *(left for left, _ in tried)]):
        yield _velocity_as_position(log, spec, integrated[1], now, integrated[0])
        return
    if not tried or tried[0][0] > enough:
        return
    best = tried[0][0]
    alike = [order for left, order in tried if left <= max(UNSURE * best, ALL_FIT)]
    if len(alike) > MOST_ALIKE:
        return
    which, lines = [], []
    for order in alike:
        taken = {names[k]: names[source] for k, source in enumerate(order) if source != k}
        which.append(_listed(taken))
        entries = ", ".join(f"{name}: {log.intake.columns.get(source, '...')}" for name, source in taken.items())
        lines.append(f"`columns: {{{entries}}}`")
    words = (
        f"The columns of {', or those of '.join(which)} seem exchanged: as read, {in_percent(now)} of the squares stay "
        f"unbalanced; exchanged, {in_percent(best)}. "
        f"({' or '.join(lines)} in meta.yaml beside the log)"
    )
    yield Finding("problem", "columns", words, {"misfit": now, "misfit_mended": best})


def _listed(taken: dict[str, str]) -> str:
    """The exchanged variables in words; if they are exchanged in pairs, each pair: x and y, v and u."""
    if all(taken[source] == name for name, source in taken.items()):
        return ", ".join(f"{a} and {b}" for a, b in taken.items() if list(taken).index(a) < list(taken).index(b))
    return " and ".join(taken)


def _orders(n: int, m: int, velocities: bool, axes_alone: bool) -> Sequence[Order]:
    """Orders of n positions, their velocities where they are logged, and m inputs.

    Args:
        axes_alone: whether only exchanges of whole axes are returned.
    """
    count = n + n * velocities + m
    plain = tuple(range(count))
    if count <= IN_ANY_ORDER and not axes_alone:
        return [order for order in permutations(plain) if order != plain]
    kinds = [range(n), *([range(n, 2 * n)] if velocities else []), range(count - m, count)]
    moving = kinds[:-1]
    together = [kinds, moving] if m == n else [moving]
    axes = [[(kind[a], kind[b]) for kind in group] for group in together for a, b in combinations(range(n), 2)]
    alike = [[pair] for kind in kinds for pair in combinations(kind, 2)]
    slopes = [[(k, n + k) for k in range(n)]] if velocities else []
    others = [[pair] for pair in combinations(plain, 2)]
    wanted = axes if axes_alone else [*alike, *axes, *slopes, *others]
    return list(dict.fromkeys(_order(count, pairs) for pairs in wanted))[:MOST_TRIED]


def _order(count: int, pairs: Sequence[tuple[int, int]]) -> Order:
    """The order in which the variables of each pair are exchanged."""
    order = list(range(count))
    for a, b in pairs:
        order[a], order[b] = b, a
    return tuple(order)


def _integrated(log: Log, balance: Balance) -> tuple[float, tuple[int, ...]]:
    """The least misfit with the columns of one coordinate or of all integrated, and these coordinates.

    The integration constant is not known; the mean of the integral is set to zero.
    """
    if log.velocities is not None:
        return 1.0, ()
    n = log.positions.shape[1]
    found = []
    for group in dict.fromkeys([*((j,) for j in range(n)), tuple(range(n))]):
        positions = log.positions.copy()
        for j in group:
            for start, stop in log.segments:
                way = cumulative_trapezoid(log.positions[start:stop, j], initial=0) * log.sample_time
                positions[start:stop, j] = way - way.mean()
        left = _misfit(with_values(log, np.hstack([positions, log.inputs])), balance)
        if left is not None:
            found.append((left, group))
    return min(found, default=(1.0, ()))


def _velocity_as_position(log: Log, spec: Spec, which: Sequence[int], now: float, left: float) -> Finding:
    """The finding on coordinates whose columns are velocities."""
    some = [spec.coordinates[j] for j in which]
    columns = {c.name: shown(str(log.intake.columns.get(c.name, "..."))) for c in some}
    entries = ", ".join(f"{c.name}: COLUMN OF THE POSITION, {c.velocity}: {columns[c.name]}" for c in some)
    held = "its velocity" if len(some) == 1 else "their velocities"
    words = (
        f"The {'column' if len(some) == 1 else 'columns'} of {' and '.join(columns)} may hold {held}: as read, "
        f"{in_percent(now)} of the squares stay unbalanced; integrated, {in_percent(left)}. (`columns: {{{entries}}}` "
        "in meta.yaml beside the log; the position is integrated where the log has no other column)"
    )
    return Finding("problem", "columns", words, {"misfit": now, "misfit_mended": left})


def values_of(log: Log, spec: Spec) -> tuple[list[str], Array]:
    """Names and values (N, variables) of the positions, the velocities if they were logged, and the inputs."""
    names = [*spec.positions, *(spec.velocities if log.velocities is not None else ()), *(i.name for i in spec.inputs)]
    return names, np.hstack([log.positions, *([] if log.velocities is None else [log.velocities]), log.inputs])


def forces_of(log: Log, balance: Balance) -> tuple[Forces, float] | None:
    """The balance of forces and ``velocity_mismatch``; None if the velocities are not derivatives of the positions."""
    found = _along_slopes(log)
    return None if found is None else (balance.along(log, found[0]), found[1])


def _along_slopes(log: Log) -> tuple[Motion, float] | None:
    """The measured motion and ``velocity_mismatch``; None if the velocities are not derivatives of the positions."""
    motion = measured_motion(log)
    if not motion.usable.any() or (slope := velocity_mismatch(log, motion)) > FITS:
        return None
    return motion, slope


def _misfit(log: Log, balance: Balance) -> float | None:
    """The larger misfit, of the forces or of the velocities; None as for ``forces_of``."""
    found = _along_slopes(log)
    return None if found is None else max(balance.misfit(log, found[0]), found[1])


def with_values(log: Log, values: Array) -> Log:
    """The log with other values, in the order of ``values_of``."""
    n, m = log.positions.shape[1], log.inputs.shape[1]
    return replace(
        log,
        positions=values[:, :n],
        velocities=None if log.velocities is None else values[:, n : 2 * n],
        inputs=values[:, values.shape[1] - m :],
        encoder_step=None,
        intake=replace(log.intake, smallest_step=()),
    )


def velocity_mismatch(log: Log, motion: Motion) -> float:
    """Σ(v − ẋ)² / (Σv² + Σẋ²), low-passed, the largest of the coordinates; 0 if no velocity was logged."""
    if log.velocities is None:
        return 0.0
    smooth, _ = low_pass(log, log.velocities, motion.cutoff_hz)
    logged, slope = smooth[motion.usable], motion.velocities[motion.usable]
    whole = np.sum(logged**2 + slope**2, axis=0)
    apart = np.sum((logged - slope) ** 2, axis=0)
    return float(np.max(apart[whole > 0] / whole[whole > 0])) if np.any(whole > 0) else 0.0


def _stated_factor(name: str, log: Log, spec: Spec) -> float:
    """The factor that is stated for a variable, which it keeps when it takes another column."""
    about = log.description
    factor = about.stated_scale(name, spec)
    return factor * float(si_factor(about.units[name], Place(""))) if name in about.units else factor

"""Preflight of the columns: variables whose columns are exchanged.

Where motion and inputs do not fit the model, or a position not its measured velocity, the columns are tried in other
orders, and those that make them fit are told.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np

from codegen.base.errors import Place
from codegen.logs.audit_unit import BETTER, FITS
from codegen.logs.finding import Finding
from codegen.logs.log import Array, Log
from codegen.logs.motion import Motion, low_pass, measured_motion
from codegen.spec.model import Spec
from codegen.spec.units import si_factor

IN_ANY_ORDER, MOST_TRIED = 3, 60
"""Variables that are tried in any order, more of them by pairs; and most orders that are tried."""
UNSURE, SAME, MOST_ALIKE = 2.0, 0.01, 3
"""Orders that fit worse by no more than a factor, or all as well as this, are named together, if they are few."""


@dataclass(frozen=True)
class _Order:
    """Places of the columns in ``values``: variable k takes the column of variable ``taken[k]``."""

    taken: tuple[int, ...]
    left: float


def audit_columns(
    log: Log, spec: Spec, motion: Motion, left: float, left_of: Callable[[Log, Motion], float]
) -> Iterator[Finding]:
    """The orders of the columns in which the log fits, where it does not as it is read.

    Args:
        left: share of the squared forces that is unbalanced along ``motion``, that of the log.
        left_of: the same of another log along its motion.
    """
    now = max(left, _kinematic(log, motion))
    if now <= FITS or log.intake.doubted:
        return
    names = [*spec.positions, *(spec.velocities if log.velocities is not None else ()), *(i.name for i in spec.inputs)]
    values = _values(log)
    factors = np.array([_stated_factor(name, log, spec) for name in names])
    tried = []
    for order in _orders(len(names)):
        other = _with(log, values[:, order] / factors[list(order)] * factors)
        moved = measured_motion(other)
        if not moved.usable.any() or _kinematic(other, moved) > FITS:
            continue
        tried.append(_Order(order, max(left_of(other, moved), _kinematic(other, moved))))
    ranked = sorted(tried, key=lambda one: one.left)
    if not ranked or ranked[0].left > min(FITS, BETTER * now):
        return
    best = ranked[0].left
    alike = [one for one in ranked if one.left <= max(UNSURE * best, SAME)]
    if len(alike) > MOST_ALIKE:
        return
    columns = log.intake.columns
    which, lines = [], []
    for one in alike:
        moved_names = {names[k]: names[source] for k, source in enumerate(one.taken) if source != k}
        which.append(" and ".join(moved_names))
        entries = ", ".join(f"{name}: {columns.get(source, '...')}" for name, source in moved_names.items())
        lines.append(f"`columns: {{{entries}}}`")
    words = (
        f"The columns of {', or those of '.join(which)} seem exchanged: as the log is read, motion and inputs leave "
        f"{100 * now:.2g} % of the squares unbalanced, otherwise {100 * best:.2g} %. "
        f"({' or '.join(lines)} in a log description)"
    )
    yield Finding("problem", "columns", words, {"misfit": now, "misfit_exchanged": best})


def _orders(count: int) -> Sequence[tuple[int, ...]]:
    plain = tuple(range(count))
    if count <= IN_ANY_ORDER:
        return [order for order in permutations(plain) if order != plain]
    pairs = []
    for a, b in combinations(plain, 2):
        pairs.append(tuple(b if k == a else a if k == b else k for k in plain))
    return pairs[:MOST_TRIED]


def _values(log: Log) -> Array:
    """(N, ...) positions, velocities where they were logged, and inputs."""
    parts = [log.positions, *([] if log.velocities is None else [log.velocities]), log.inputs]
    return np.hstack(parts)


def _with(log: Log, values: Array) -> Log:
    n, m = log.positions.shape[1], log.inputs.shape[1]
    velocities = None if log.velocities is None else values[:, n : 2 * n]
    intake = replace(log.intake, smallest_step=())
    inputs = values[:, values.shape[1] - m :]
    return replace(log, positions=values[:, :n], velocities=velocities, inputs=inputs, encoder_step=None, intake=intake)


def _kinematic(log: Log, motion: Motion) -> float:
    """Σ(v − x')² over Σv² + Σx'², the largest of the coordinates, below the cut-off; 0 where no velocity was logged."""
    if log.velocities is None:
        return 0.0
    smooth, _ = low_pass(log, log.velocities, motion.cutoff_hz)
    said, seen = smooth[motion.usable], motion.velocities[motion.usable]
    whole = np.sum(said**2 + seen**2, axis=0)
    apart = np.sum((said - seen) ** 2, axis=0)
    return float(np.max(apart[whole > 0] / whole[whole > 0])) if np.any(whole > 0) else 0.0


def _stated_factor(name: str, log: Log, spec: Spec) -> float:
    """What is stated of the variable and not of its column, and stays with it when its column is another."""
    about = log.description
    factor = float(about.scale.get(name, spec.log.scale.get(name, 1.0)))
    return factor * float(si_factor(about.units[name], Place(""))) if name in about.units else factor

"""Declared values without a tolerance, one of which alone would explain a residual that no effect explains.

A payload on an arm changes inertia and weight of several coordinates at once. No effect of the catalogue does so; the
declared mass does. A value without a tolerance is exact by the spec, so it is not fitted; but it can be told. The force
residual is regressed on its slope by each such value, with the friction levels, on all coordinates together.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.diagnosis.credit import BLOCKS
from codegen.diagnosis.residual import ForceRows, Problem, force_rows
from codegen.mechanics.system import System
from codegen.spec.model import Spec

Array = NDArray[np.float64]

MOST = 0.8
"""Least share of the squared force residual that a value explains on held-out blocks of the training log."""


def explaining_values(spec: Spec, refit: System, problem: Problem) -> list[str]:
    """The declared value that explains most of the residual, in words for a remark; nothing where none explains it.

    Args:
        refit: the model whose residual no effect explains.
    """
    error = refit.equation_error
    own = [spec.symbol(p.name) for p in spec.parameters]
    taken = {*problem.levels, *problem.uncertain}
    fixed = [s for s in own if s not in taken and s in refit.values and refit.values[s] != 0 and error.has(s)]
    if not fixed:
        return []
    rows = force_rows(refit, problem, [*fixed, *problem.levels])
    levels = list(range(len(fixed), len(fixed) + len(problem.levels)))
    shares = [_explained(rows, [k, *levels], levels) for k in range(len(fixed))]
    best = int(np.argmax(shares))
    if shares[best] < MOST:
        return []
    return [_words(fixed[best], shares[best], _weights(rows, [best, *levels])[0], refit)]


def _words(symbol: sympy.Symbol, share: float, change: float, system: System) -> str:
    declared, unit = float(system.values[symbol]), system.units[symbol]
    behind = "" if unit == "1" else f" {unit}"
    return (
        f"the value {symbol.name} = {declared + change:.4g}{behind} in place of the declared {declared:.4g}{behind} "
        f"({100 * change / abs(declared):+.2g} %) would explain {100 * share:.0f} % of the squared residual force on "
        f"held-out blocks of the training log; the spec gives {symbol.name} no tolerance, with one it is fitted"
    )


def _explained(rows: Sequence[ForceRows], columns: Sequence[int], without: Sequence[int]) -> float:
    """Share of the squared residual, each coordinate in units of its own, that the first column explains beyond others.

    Args:
        columns: of the slopes. without: those that are fitted in any case.
    """
    ends = max(int(r.sample[-1]) for r in rows) + 1
    blocks = [np.minimum(r.sample * BLOCKS // ends, BLOCKS - 1) for r in rows]
    left = [0.0, 0.0]
    for held in range(BLOCKS):
        kept = [
            ForceRows(r.sample[b != held], r.residual[b != held], r.slopes[b != held]) for r, b in _of(rows, blocks)
        ]
        for k, some in enumerate((without, columns)):
            change = _weights(kept, some)
            for r, b in _of(rows, blocks):
                rest = r.residual[b == held] + r.slopes[b == held][:, list(some)] @ change
                left[k] += float(rest @ rest) / _power(r)
    return 1 - left[1] / left[0] if left[0] > 0 else 0.0


def _of(rows: Sequence[ForceRows], blocks: Sequence[NDArray[np.int_]]) -> list[tuple[ForceRows, NDArray[np.int_]]]:
    return list(zip(rows, blocks, strict=True))


def _power(rows: ForceRows) -> float:
    return max(float(rows.residual @ rows.residual), 1e-300)


def _weights(rows: Sequence[ForceRows], columns: Sequence[int]) -> Array:
    """Least-squares changes of these values, each coordinate's residual in units of its own."""
    size = [np.sqrt(_power(r)) for r in rows]
    slopes = np.vstack([r.slopes[:, list(columns)] / s for r, s in zip(rows, size, strict=True)])
    residual = np.concatenate([r.residual / s for r, s in zip(rows, size, strict=True)])
    return np.asarray(-np.linalg.lstsq(slopes, residual, rcond=1e-10)[0], dtype=np.float64)

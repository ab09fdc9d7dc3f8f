"""Standard errors from zero of a spike by least squares with the right structure; run beside the shared spike.py.

    drive = J v' + b v + F_c sgn v + offset (+ weight) + c · column of the effect

on motion filtered as by ``spike.py --check``. The standard error of c is that of the delete-one-block jackknife, so
residuals may be correlated within a block. A spike of size s is told from zero where s/σ(c) is above 1.96.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
import spike  # the shared script; its folder is on the path
from scipy.signal import butter, filtfilt

BLOCKS = 48
SPANNED = 1e-6
"""Share of a column's norm that the other columns leave of it, below which they span it: no log tells its size then."""


def deviations(kind: str, parameters: dict[str, float], args: argparse.Namespace, log: Path) -> tuple[float, float]:
    """(s/σ(c), abs(c)/σ(c)) of a spiked log: of the spike, and of all that the log has of the effect.

    Of a delay the column is dF/dt, to first order in the delay; a gain is told by the inertia, which it scales: both
    are of the spike then.
    """
    m = spike.Motion(spike.read(log), args)
    rows = np.flatnonzero(np.abs(np.interp(m.grid, m.t, m.v)) >= 2 * m.still)
    base = {"inertia_error": m.a, "viscous": m.v, "sign": m.s, "offset": np.ones_like(m.v)}
    if args.gravity:
        base |= {"sine": np.sin(m.x), "cosine": np.cos(m.x)}
    name = spike.STRENGTH[kind]
    size = parameters[name]
    match kind:
        case "input_gain":
            column = base.pop("inertia_error")
        case "input_delay":
            column = m.dF
        case "load_dependent_friction":
            column = np.abs(m.F) * m.s
        case _:
            base.pop({"coulomb_asymmetry": "offset"}.get(kind, kind), None)
            column = spike.drive(kind, {**parameters, "gain": args.gain, name: 1.0}, m) - m.F

    def low(values: np.ndarray) -> np.ndarray:
        on_grid = np.interp(m.grid, m.t, values)
        return np.asarray(filtfilt(*butter(4, 2 * m.cutoff / m.rate), on_grid)[rows])

    columns = np.array([*map(low, base.values()), low(column)]).T
    found, error = jackknife(columns, low(m.F))
    if not error < np.inf:
        return 0.0, 0.0
    if kind == "input_gain":
        return (abs(found * (size - 1)) / error,) * 2
    return abs(size) / error, abs(found) / error


def jackknife(columns: np.ndarray, drive: np.ndarray) -> tuple[float, float]:
    """The last column's coefficient by least squares and its standard error, infinite where the others span it."""
    scale = np.sqrt(np.mean(columns**2, axis=0))
    columns = columns / scale
    *_, last = columns.T
    others = columns[:, :-1]
    rest = last - others @ np.linalg.lstsq(others, last, rcond=None)[0]
    if np.linalg.norm(rest) < SPANNED * np.linalg.norm(last):
        return 0.0, np.inf
    parts = np.array_split(np.arange(len(drive)), BLOCKS)
    matrices = np.array([columns[k].T @ columns[k] for k in parts])
    vectors = np.array([columns[k].T @ drive[k] for k in parts])
    matrix, vector = matrices.sum(axis=0), vectors.sum(axis=0)
    without = np.array(
        [np.linalg.lstsq(matrix - a, vector - b, rcond=None)[0][-1] for a, b in zip(matrices, vectors, strict=True)]
    )
    error = float(np.sqrt((BLOCKS - 1) * np.var(without)))
    found = float(np.linalg.lstsq(matrix, vector, rcond=None)[0][-1])
    return found / float(scale[-1]), error / float(scale[-1])


def main() -> None:
    log, asked = Path(sys.argv[1]), json.loads(sys.argv[2])
    kind, parameters = asked.pop("kind"), asked.pop("parameters")
    print(json.dumps(deviations(kind, parameters, argparse.Namespace(still=None, **asked), log)))


if __name__ == "__main__":
    main()

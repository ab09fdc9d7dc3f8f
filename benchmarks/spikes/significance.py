"""Standard errors from zero of a spike by least squares with the right structure; run beside the shared spike.py.

    drive = J v' + b v + F_c sgn v + offset (+ weight) + c · column of the effect

on motion filtered as by ``spike.py --check``. The standard error of c is that of the delete-one-block jackknife, so
residuals may be correlated within a block. A spike of size s is told from zero where s/σ(c) is above 1.96.

Each other law is fitted in its place too, its period, Stribeck speed, time constant or delay by search on a grid, while
the spike's own shape is known. With S the squared residuals, N of them independent, and k the number of fitted values,
the law that was put in is preferred to another by

    N/2 log(S of the other/S) + k of the other − k        nats: a log-likelihood ratio with Akaike's penalty

N = 2 f T (1 − φ)/(1 + φ), with f the cutoff, T the time in motion, and φ the autocorrelation at lag 1/(2 f).
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import spike  # the shared script; its folder is on the path
from scipy.signal import butter, filtfilt

BLOCKS = 48
PERIODS = np.geomspace(1 / 40, 2.0, 40)
"""Of a wave that is tried as another law, over the stroke."""
SPEEDS = np.geomspace(0.02, 0.7, 8)
"""Stribeck speeds that are tried, over the top speed."""
TIMES = np.geomspace(0.03, 2.0, 8)
"""Time constants of a drift that are tried, over the length of the log."""
TERM = {"coulomb_asymmetry": "offset", "input_gain": "inertia_error"}
"""Kind whose force is that of a free term under another name."""
Law = tuple[list[np.ndarray], int]
"""Columns of the force balance, (N,) each, and the number of values that the law adds."""
DELAYS_S = np.geomspace(5e-4, 0.1, 24)
"""Delays and lags that are tried, s."""
SPANNED = 1e-6
"""Share of a column's norm that the other columns leave of it, below which they span it: no log tells its size then."""


class SpikedLog:
    """Terms of the force balance of a spiked log, low-passed, on a uniform grid of times.

    Attributes:
        m: the motion. rows: samples in motion. drive: (N,) drive force. base: name → (N,) the terms that are free.
        delay_s: of the machine, by which the drive force acts later than logged.
    """

    def __init__(self, kind: str, parameters: dict[str, float], args: argparse.Namespace, log: Path) -> None:
        self.m = m = spike.Motion(spike.read(log), args)
        self.kind, self.parameters = kind, {**parameters, "gain": args.gain}
        self.rows = np.flatnonzero(np.abs(np.interp(m.grid, m.t, m.v)) >= 2 * m.still)
        self.drive, self.delay_s = self.low(m.F), 0.0
        base = {"inertia_error": m.a, "viscous": m.v, "sign": m.s, "offset": np.ones_like(m.v)}
        if args.gravity:
            base |= {"sine": np.sin(m.x), "cosine": np.cos(m.x)}
        self.base = {name: self.low(column) for name, column in base.items() if name != TERM.get(kind, kind)}

    def low(self, values: np.ndarray) -> np.ndarray:
        m = self.m
        return np.asarray(filtfilt(*butter(4, 2 * m.cutoff / m.rate), np.interp(m.grid, m.t, values)))

    def column(self, kind: str, parameters: dict[str, float]) -> np.ndarray:
        """(N,) the force of a law for a unit of its strength."""
        match kind:
            case "input_gain":
                return self.low(self.m.a)
            case "input_delay":
                return self.low(self.m.dF)
            case "load_dependent_friction":
                return self.low(np.abs(self.m.F) * self.m.s)
        unit = {**parameters, spike.STRENGTH[kind]: 1.0}
        return self.low(spike.drive(kind, unit, self.m) - self.m.F)

    def deviations(self) -> tuple[float, float]:
        """(s/σ(c), abs(c)/σ(c)): of the spike, and of all that the log has of the effect.

        Of a delay the column is dF/dt, to first order in the delay; a gain is found from the inertia, which it scales:
        both are of the spike then.
        """
        size = self.parameters[spike.STRENGTH[self.kind]]
        columns = np.array([*self.base.values(), self.column(self.kind, self.parameters)]).T
        found, error = jackknife(columns[self.rows], self.drive[self.rows])
        if not error < np.inf:
            return 0.0, 0.0
        if self.kind == "input_gain":
            return (abs(found * (size - 1)) / error,) * 2
        return abs(size) / error, abs(found) / error

    def best_other(self, kinds: Sequence[str]) -> tuple[str, float]:
        """The best of other laws in place of the spike's, and the nats by which the spike's is preferred to it.

        Force that grows with the load, or changes sign with it, is taken with the load that the free terms predict:
        with the measured one, noise of the drive force would be on both sides. Beside other laws than a delay or a lag,
        the machine's own delay is free in all fits.
        """
        columns = np.array(list(self.base.values())).T
        weights = np.linalg.lstsq(columns[self.rows], self.drive[self.rows], rcond=1e-9)[0]
        self.m.F = np.interp(self.m.t, self.m.grid, columns @ weights)
        same = {self.kind, TERM.get(self.kind), *(kind for kind, term in TERM.items() if term == self.kind)}
        if self.kind not in LATE:
            same |= {*LATE}
            columns = list(self.base.values())
            self.delay_s = min((0.0, *DELAYS_S), key=lambda T: self.left(([self.at(T, c) for c in columns], 0))[0])
        own = min(map(self.left, self.laws(self.kind, True)))
        nats = {}
        for kind in sorted(set(kinds) - same):
            if TERM.get(kind, kind) not in self.base:
                left, _, fitted = min(map(self.left, self.laws(kind)))
                nats[kind] = own[1] / 2 * np.log(left / own[0]) + fitted - own[2]
        best = min(nats, key=lambda kind: nats[kind])
        return best, float(nats[best])

    def laws(self, kind: str, known: bool = False) -> Iterator[Law]:
        """A law at every shape; with ``known`` at the spike's own shape."""
        m, p = self.m, self.parameters
        if kind in LATE:
            for time in DELAYS_S:
                yield [LATE[kind](self, time, column) for column in self.base.values()], 1
            return
        if known:
            shapes = [[p]]
        elif kind in ("cogging", "position_dependent_friction"):
            waves = PERIODS * np.ptp(m.x)
            shapes = [[{"period": w, "phase": phase} for phase in (0.0, np.pi / 2)] for w in waves]
        elif kind == "gravity_imbalance":
            shapes = [[{"phase": phase} for phase in (0.0, np.pi / 2)]]
        elif kind == "stribeck":
            shapes = [[{"v_s": speed}] for speed in SPEEDS * np.percentile(np.abs(m.v), 99)]
        elif kind == "friction_drift":
            shapes = [[{"T": time}] for time in TIMES * np.ptp(m.t)]
        else:
            shapes = [[{"gain": p["gain"]}]]
        for shape in shapes:
            searched = 0 if known else len({*shape[0]} - {"gain", "phase"})
            columns = [*self.base.values(), *(self.column(kind, one) for one in shape)]
            yield [self.at(self.delay_s, column) for column in columns], len(shape) + searched

    def at(self, delay: float, column: np.ndarray) -> np.ndarray:
        """A column as the logged drive force shows it, which acts a delay later."""
        return column if not delay else np.interp(self.m.grid + delay, self.m.grid, column)

    def lagged(self, lag: float, column: np.ndarray) -> np.ndarray:
        """A column as the logged drive force shows it, which acts through a first-order lag."""
        return column + lag * self.m.rate * np.gradient(column)

    def left(self, law: Law) -> tuple[float, float, int]:
        """Squared residual of a law over the squared drive, number of independent residuals, and of fitted values."""
        columns, fitted = law
        every, drive = np.array(columns).T[self.rows], self.drive[self.rows]
        every = every / np.maximum(np.sqrt(np.mean(every**2, axis=0)), 1e-300)
        left = drive - every @ np.linalg.lstsq(every, drive, rcond=1e-9)[0]
        some = left[:: max(1, round(self.m.rate / (2 * self.m.cutoff)))]
        phi = float(np.clip(some[1:] @ some[:-1] / (some @ some), 0.0, 0.99))
        return float(left @ left / (drive @ drive)), len(some) * (1 - phi) / (1 + phi), fitted


LATE = {"input_delay": SpikedLog.at, "actuator_lag": SpikedLog.lagged}


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
    kind, parameters, kinds = asked.pop("kind"), asked.pop("parameters"), asked.pop("kinds")
    found = SpikedLog(kind, parameters, argparse.Namespace(still=None, **asked), log)
    names = "deviations", "found_deviations", "other", "nats"
    print(json.dumps(dict(zip(names, (*found.deviations(), *found.best_other(kinds)), strict=True))))


if __name__ == "__main__":
    main()

"""A spike by least squares with the right structure, over all training records; it imports the shared spike.py.

    drive = J v' + b v + F_c sgn v + offset (+ weight) + c · column of the effect

with one set of coefficients for all records, on motion filtered as by ``spike.py --check``; for one record the figures
of ``own`` and of the residuals are those that it prints, but for a load. The standard error of c is that of the
delete-one-block jackknife, so residuals may be correlated within a block, and no block goes over two records. A spike
of size s is significant where s/σ(c) is above 1.96.

A friction in proportion to the load is taken with the load that the free terms predict (two-stage least squares): with
the measured one the drive force would be on both sides. On an axis that is driven along its motion all the time,
abs(F) sgn v is F itself, and removes all of the residual, whatever the friction is.

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
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import spike  # the shared script; its folder is on the path
from scipy.signal import butter, filtfilt

PERIODS = np.geomspace(1 / 40, 2.0, 40)
"""Of a wave that is tried as another law, over the stroke."""
SPEEDS = np.geomspace(0.02, 0.7, 8)
"""Stribeck speeds that are tried, over the top speed."""
TIMES = np.geomspace(0.03, 2.0, 8)
"""Time constants of a drift that are tried, over the length of the log."""
TERM = {"coulomb_asymmetry": "offset", "input_gain": "inertia_error"}
"""Kind whose force is that of a free term under another name."""
Law = tuple[np.ndarray, int]
"""(N, k) columns of the force balance, and the number of values that the law adds."""
DELAYS_S = np.geomspace(5e-4, 0.1, 24)
"""Delays and lags that are tried, s."""
SPANNED = 1e-6
"""Share of a column's norm, outside the span of the others, below which its coefficient cannot be identified."""


class Record:
    """Terms of the force balance of one record, low-passed, on a uniform grid of times.

    Attributes:
        m: the motion. rows: samples in motion. drive: (N,) drive force. base: name → (N,) the terms that are free.
        load: as m.F, the force with which a load-dependent friction goes; the measured one until it is predicted.
    """

    def __init__(self, kind: str, args: argparse.Namespace, log: Path) -> None:
        self.m = m = spike.Motion(spike.read(log), args)
        self.rows = np.flatnonzero(np.abs(np.interp(m.grid, m.t, m.v)) >= 2 * m.still)
        self.drive, self.load = self.low(m.F), m.F
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
                return self.low(np.abs(self.load) * self.m.s)
        unit = {**parameters, spike.STRENGTH[kind]: 1.0}
        return self.low(spike.drive(kind, unit, self.m) - self.m.F)

    def at(self, delay: float, column: np.ndarray) -> np.ndarray:
        """A column as the logged drive force shows it, which acts a delay later."""
        return column if not delay else np.interp(self.m.grid + delay, self.m.grid, column)

    def lagged(self, lag: float, column: np.ndarray) -> np.ndarray:
        """A column as the logged drive force shows it, which acts through a first-order lag."""
        return column + lag * self.m.rate * np.gradient(column)


Columns = Callable[[Record], list[np.ndarray]]
LATE = {"input_delay": Record.at, "actuator_lag": Record.lagged}


class Experiment:
    """Records of one machine, all as they are or all with the spike.

    Attributes:
        kind, parameters: of the spike. drive: (N,) drive force of all samples in motion.
        delay_s: of the machine, by which the drive force acts later than logged.
    """

    def __init__(self, kind: str, parameters: dict[str, float], args: argparse.Namespace, logs: Sequence[Path]) -> None:
        self.kind, self.parameters = kind, {**parameters, "gain": args.gain}
        self.records = [Record(kind, args, log) for log in logs]
        self.drive = np.concatenate([record.drive[record.rows] for record in self.records])
        self.delay_s = 0.0
        weights = np.linalg.lstsq(self.matrix(_base), self.drive, rcond=1e-9)[0]
        for record in self.records:
            record.load = np.interp(record.m.t, record.m.grid, np.array(_base(record)).T @ weights)

    def matrix(self, columns: Columns) -> np.ndarray:
        """(N, k) the samples in motion of all records."""
        return np.vstack([np.array(columns(record)).T[record.rows] for record in self.records])

    def effect(self) -> np.ndarray:
        """(N, 1) the force of the spike's law for a unit of its strength."""
        return self.matrix(lambda record: [record.column(self.kind, self.parameters)])

    def deviations(self, blocks: int) -> tuple[float, float]:
        """(s/σ(c), abs(c)/σ(c)): of the spike, and of all that the records have of the effect.

        Of a delay the column is dF/dt, to first order in the delay; a gain is found from the inertia, which it scales:
        both are of the spike then.
        """
        size = self.parameters[spike.STRENGTH[self.kind]]
        columns = np.hstack([self.matrix(_base), self.effect()])
        found, error = jackknife(columns, self.drive, [len(record.rows) for record in self.records], blocks)
        if not error < np.inf:
            return 0.0, 0.0
        if self.kind == "input_gain":
            return (abs(found * (size - 1)) / error,) * 2
        return abs(size) / error, abs(found) / error

    def best_other(self, kinds: Sequence[str]) -> tuple[str, float]:
        """The best of other laws in place of the spike's, and the nats by which the spike's is preferred to it.

        Force that changes sign with the load is taken with the load that the free terms predict, too: with the measured
        one, noise of the drive force would be on both sides. Beside other laws than a delay or a lag, the machine's own
        delay is free in all fits.
        """
        for record in self.records:
            record.m.F = record.load
        same = {self.kind, TERM.get(self.kind), *(kind for kind, term in TERM.items() if term == self.kind)}
        if self.kind not in LATE:
            same |= {*LATE}
            self.delay_s = min((0.0, *DELAYS_S), key=lambda T: self.left((self.matrix(_late(Record.at, T)), 0))[0])
        own = min(map(self.left, self.laws(self.kind, True)))
        nats = {}
        for kind in sorted(set(kinds) - same):
            if TERM.get(kind, kind) not in self.records[0].base:
                left, _, fitted = min(map(self.left, self.laws(kind)))
                nats[kind] = own[1] / 2 * np.log(left / own[0]) + fitted - own[2]
        best = min(nats, key=lambda kind: nats[kind])
        return best, float(nats[best])

    def laws(self, kind: str, known: bool = False) -> Iterator[Law]:
        """A law at every shape; with ``known`` at the spike's own shape."""
        motions, p = [record.m for record in self.records], self.parameters
        if kind in LATE:
            for time in DELAYS_S:
                yield self.matrix(_late(LATE[kind], time)), 1
            return
        if known:
            shapes = [[p]]
        elif kind in ("cogging", "position_dependent_friction"):
            waves = PERIODS * np.ptp(np.concatenate([m.x for m in motions]))
            shapes = [[{"period": w, "phase": phase} for phase in (0.0, np.pi / 2)] for w in waves]
        elif kind == "gravity_imbalance":
            shapes = [[{"phase": phase} for phase in (0.0, np.pi / 2)]]
        elif kind == "stribeck":
            top = np.percentile(np.abs(np.concatenate([m.v for m in motions])), 99)
            shapes = [[{"v_s": speed}] for speed in SPEEDS * top]
        elif kind == "friction_drift":
            shapes = [[{"T": time}] for time in TIMES * max(np.ptp(m.t) for m in motions)]
        else:
            shapes = [[{"gain": p["gain"]}]]
        for shape in shapes:
            searched = 0 if known else len({*shape[0]} - {"gain", "phase"})
            yield self.matrix(partial(self._with, kind, shape)), len(shape) + searched

    def _with(self, kind: str, shape: Sequence[dict[str, float]], record: Record) -> list[np.ndarray]:
        columns = [*_base(record), *(record.column(kind, one) for one in shape)]
        return [record.at(self.delay_s, column) for column in columns]

    def left(self, law: Law) -> tuple[float, float, int]:
        """Squared residual of a law over the squared drive, number of independent residuals, and of fitted values."""
        columns, fitted = law
        every, drive = columns / np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-300), self.drive
        left = drive - every @ np.linalg.lstsq(every, drive, rcond=1e-9)[0]
        ends = np.cumsum([len(record.rows) for record in self.records])[:-1]
        steps = [max(1, round(record.m.rate / (2 * record.m.cutoff))) for record in self.records]
        some = np.concatenate([part[::step] for part, step in zip(np.split(left, ends), steps, strict=True)])
        phi = float(np.clip(some[1:] @ some[:-1] / (some @ some), 0.0, 0.99))
        return float(left @ left / (drive @ drive)), len(some) * (1 - phi) / (1 + phi), fitted


def _base(record: Record) -> list[np.ndarray]:
    return list(record.base.values())


def _late(shown: Callable[[Record, float, np.ndarray], np.ndarray], time: float) -> Columns:
    return lambda record: [shown(record, time, column) for column in record.base.values()]


def sizes(plain: Experiment, spiked: Experiment) -> dict[str, float]:
    """What ``spike.py --check`` prints of one record, for all: the effect's size as they are, and residuals.

    Times, motion and the force of a law other than a load-dependent friction are those of the records as they are, in
    both: the files are rounded.

    Returns:
        own, and the RMS residual in N or N·m: before the spike, after it, and after it with the effect in the model.
    """
    kind, base = plain.kind, plain.matrix(_base)
    both = list(zip(plain.records, spiked.records, strict=True))
    drive = np.concatenate([one.low(other.m.F)[one.rows] for one, other in both])
    if kind == "input_gain":  # a gain scales every coefficient
        base = np.hstack([base, plain.effect()])
    before, after = _rms_left(base, plain.drive), _rms_left(base, drive)
    found = {"residual_before": before, "residual_after": after}
    if kind == "input_gain":
        return {"own": 1.0, **found}
    if kind == "input_delay":
        return {"own": _delay(plain, base), **found}
    effect = plain.effect()
    own = np.linalg.lstsq(np.hstack([base, effect]), plain.drive, rcond=None)[0][-1]
    if kind == "load_dependent_friction":
        loads = [one.low(np.abs(other.load) * one.m.s)[one.rows] for one, other in both]
        effect = np.concatenate(loads)[:, None]
    return {"own": float(own), **found, "residual_with_effect": _rms_left(np.hstack([base, effect]), drive)}


def _rms_left(columns: np.ndarray, drive: np.ndarray) -> float:
    return float(np.sqrt(np.mean((drive - columns @ np.linalg.lstsq(columns, drive, rcond=None)[0]) ** 2)))


def _delay(plain: Experiment, base: np.ndarray) -> float:
    """The shift of the input with the least residual, at the vertex of a parabola, s."""
    shifts = np.linspace(-2.5, 2.5, 41) * plain.parameters["T"]
    left = []
    for shift in shifts:
        moved = [r.low(np.interp(r.m.t - shift, r.m.t, r.m.F))[r.rows] for r in plain.records]
        left.append(_rms_left(base, np.concatenate(moved)))
    k = int(np.clip(np.argmin(left), 2, len(shifts) - 3))
    curve = np.polyfit(shifts[k - 2 : k + 3], left[k - 2 : k + 3], 2)
    return float(-curve[1] / 2 / curve[0])


def jackknife(columns: np.ndarray, drive: np.ndarray, lengths: Sequence[int], blocks: int) -> tuple[float, float]:
    """The last column's coefficient by least squares and its standard error, infinite where the others span it.

    Args:
        lengths: of the records. Each is cut into a number of the ``blocks`` that is proportional to it, one at least.
    """
    scale = np.sqrt(np.mean(columns**2, axis=0))
    columns = columns / scale
    *_, last = columns.T
    others = columns[:, :-1]
    rest = last - others @ np.linalg.lstsq(others, last, rcond=None)[0]
    if np.linalg.norm(rest) < SPANNED * np.linalg.norm(last):
        return 0.0, np.inf
    records = np.split(np.arange(len(drive)), np.cumsum(lengths)[:-1])
    counts = [max(1, round(blocks * length / len(drive))) for length in lengths]
    parts = [part for rows, count in zip(records, counts, strict=True) for part in np.array_split(rows, count)]
    matrices = np.array([columns[k].T @ columns[k] for k in parts])
    vectors = np.array([columns[k].T @ drive[k] for k in parts])
    matrix, vector = matrices.sum(axis=0), vectors.sum(axis=0)
    without = np.array(
        [np.linalg.lstsq(matrix - a, vector - b, rcond=None)[0][-1] for a, b in zip(matrices, vectors, strict=True)]
    )
    error = float(np.sqrt((len(parts) - 1) * np.var(without)))
    found = float(np.linalg.lstsq(matrix, vector, rcond=None)[0][-1])
    return found / float(scale[-1]), error / float(scale[-1])


def main() -> None:
    asked = json.loads(sys.argv[1])
    kind, parameters, kinds = asked.pop("kind"), asked.pop("parameters"), asked.pop("kinds")
    blocks = asked.pop("blocks")
    plain, spiked = ([Path(log) for log in asked.pop(name)] for name in ("plain", "spiked"))
    args = argparse.Namespace(still=None, **asked)
    experiment = Experiment(kind, parameters, args, spiked)
    found = sizes(Experiment(kind, parameters, args, plain), experiment)
    names = "deviations", "found_deviations", "other", "nats"
    beside = zip(names, (*experiment.deviations(blocks), *experiment.best_other(kinds)), strict=True)
    print(json.dumps({**found, **dict(beside)}))


if __name__ == "__main__":
    main()

"""Data of the pictures: residuals, spectra and free-run errors of the models on the held-out data, thinned."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from codegen.base.arrays import Array, Flags, runs
from codegen.diagnosis.diagnose import Models
from codegen.diagnosis.evidence.residual_regression import predicted_load
from codegen.diagnosis.fit.drive import residual_at_drive
from codegen.diagnosis.fit.measure import free_run_series
from codegen.mechanics.system import System

MOST_POINTS = 4000
"""Most points of a scatter plot."""
BUCKETS = 900
"""Intervals of time, each drawn by its smallest and largest value."""
BINS = 32
"""Bins over a quantity, each drawn by its mean."""
BINS_OVER = {"position": 96}
"""More bins over position, where waves may be short."""
LEAST_IN_BIN = 20
"""Fewest samples of a bin whose mean is drawn."""
LONGEST_SEGMENT_S = 4.0
SHORTEST_SEGMENT = 64
SEGMENTS = 4
SHARE_IN_SEGMENTS = 0.6
BULK, BEYOND_BULK, HEADROOM = 0.99, 1.6, 1.06
"""Range of an axis of residuals: all samples, but at most 1.6 times the 99 % quantile of their magnitude, so that
outliers do not compress the curves; plus 6 %."""
SHOWN_CUTOFFS = 1.5
"""Highest frequency of a spectrum, as a multiple of the cutoff frequency of the residual's filter."""


@dataclass(frozen=True, eq=False)
class Curve:
    """Points (K,) of one model in one panel."""

    x: Array
    y: Array


@dataclass(frozen=True, eq=False)
class ModelResidual:
    """The force residual of one model on one coordinate, away from standstill.

    Attributes:
        over: variable → thinned samples, and means in bins of equal width, NaN in a bin with few samples.
        by_time: minimum and maximum of short intervals, NaN at standstill.
        spectrum: power spectral density (force²/Hz) over Hz; None if no interval of motion is long enough.
    """

    over: Mapping[str, tuple[Curve, Curve]]
    by_time: Curve
    spectrum: Curve | None


@dataclass(frozen=True, eq=False)
class CoordinateSeries:
    """Data of one coordinate's panels, in SI.

    Attributes:
        models: name of a model → its force residual.
        free_run: name of a model → predicted minus measured position over time, NaN where not finite.
        samples: number of samples in motion in the held-out window.
        limit: half the range of the residual's axis; a few isolated peaks may be outside.
        cutoff_hz: of the residual's low-pass filter.
    """

    name: str
    unit: str
    velocity: str
    force_unit: str
    models: Mapping[str, ModelResidual]
    free_run: Mapping[str, Curve]
    samples: int
    limit: float
    cutoff_hz: float


def held_out_series(models: Models, names: Sequence[str]) -> tuple[CoordinateSeries, ...]:
    """The data of the pictures, for each coordinate.

    ``names``: of the models that are compared; attributes of ``models``.
    """
    systems: list[System] = [getattr(models, name) for name in names]
    motion, used = models.test.motion, models.test.used
    window = models.window
    residuals = [residual_at_drive(system, motion)[window] for system in systems]
    runs = [free_run_series(system, motion, models.restart_s)[window] for system in systems]
    time = motion.time[window] - motion.time[window][0]
    load = predicted_load(models.refit, motion, residual_at_drive(models.refit, motion))
    over = {
        "velocity": motion.velocities[window],
        "position": motion.positions[window],
        "load": load[window],
        "acceleration": motion.accelerations[window],
    }
    coordinates = []
    for i, symbol in enumerate(models.refit.positions):
        rows = used[window, i]
        here = {name: values[:, i] for name, values in over.items()}
        residual_of = [_model_residual(r[:, i], rows, here, time, motion.cutoff_hz) for r in residuals]
        free_runs = [_envelope(time, r[:, i], motion.usable[window] & np.isfinite(r[:, i])) for r in runs]
        coordinates.append(
            CoordinateSeries(
                name=symbol.name,
                unit=models.refit.position_units[i],
                velocity=models.refit.velocities[i].name,
                force_unit=models.refit.force_unit(i),
                models=dict(zip(names, residual_of, strict=True)),
                free_run=dict(zip(names, free_runs, strict=True)),
                samples=int(rows.sum()),
                limit=half_range([r[rows, i] for r in residuals]),
                cutoff_hz=motion.cutoff_hz,
            )
        )
    return tuple(coordinates)


def _model_residual(
    residual: Array, rows: Flags, over: Mapping[str, Array], time: Array, cutoff_hz: float
) -> ModelResidual:
    kept = thin(np.flatnonzero(rows))
    period = float(time[1] - time[0])
    return ModelResidual(
        over={
            name: (Curve(x[kept], residual[kept]), bin_means(x[rows], residual[rows], BINS_OVER.get(name, BINS)))
            for name, x in over.items()
        },
        by_time=_envelope(time, residual, rows),
        spectrum=_spectrum(residual, rows, period, cutoff_hz),
    )


def thin(indices: NDArray[np.int_]) -> NDArray[np.int_]:
    """At most ``MOST_POINTS`` of the indices, evenly spread."""
    if len(indices) <= MOST_POINTS:
        return indices
    return np.asarray(indices[np.linspace(0, len(indices) - 1, MOST_POINTS).round().astype(int)])


def bin_means(x: Array, y: Array, bins: int = BINS) -> Curve:
    """Mean of y in bins of equal width over the inner 99 % of x."""
    if len(x) < LEAST_IN_BIN:
        return Curve(np.empty(0), np.empty(0))
    low, high = np.quantile(x, [0.005, 0.995])
    span = low, high if high > low else low + 1  # with edges in place of it, one infinite y is in all later bins
    (count, edges), (total, _) = np.histogram(x, bins, span), np.histogram(x, bins, span, weights=y)
    mean = np.where(count >= LEAST_IN_BIN, total / np.maximum(count, 1), np.nan)
    return Curve((edges[:-1] + edges[1:]) / 2, mean)


def _envelope(time: Array, values: Array, rows: Flags) -> Curve:
    """Minimum and maximum of each short interval, in order of time; NaN where unused."""
    shown = np.where(rows, values, np.nan)
    if len(time) <= 2 * BUCKETS:
        return Curve(time, shown)
    points: list[int] = []
    for part in np.array_split(np.arange(len(time)), BUCKETS):
        finite = part[rows[part]]
        if len(finite) == 0:
            points.append(int(part[0]))
            continue
        if not rows[part[0]]:
            points.append(int(part[0]))
        points += sorted({int(finite[np.argmin(shown[finite])]), int(finite[np.argmax(shown[finite])])})
    return Curve(time[points], shown[points])


def _spectrum(residual: Array, rows: Flags, period: float, cutoff_hz: float) -> Curve | None:
    """Welch's power spectral density over intervals without standstill, mean included; None if they are too short."""
    length = 1 << int(np.log2(max(LONGEST_SEGMENT_S / period, SHORTEST_SEGMENT)))
    while length >= SHORTEST_SEGMENT:
        long = [(a, b) for a, b in runs(rows) if b - a >= length]
        covered = sum(b - a for a, b in long)
        if covered >= max(SEGMENTS * length, SHARE_IN_SEGMENTS * rows.sum()):
            break
        length //= 2
    else:
        return None
    parts = [welch(residual[a:b], fs=1 / period, nperseg=length, detrend=False) for a, b in long]
    weights = np.array([b - a for a, b in long], dtype=np.float64)
    density = np.average([p for _, p in parts], axis=0, weights=weights)
    frequency = parts[0][0]
    shown = (frequency > 0) & (frequency <= SHOWN_CUTOFFS * cutoff_hz) & (density > 0)
    return Curve(frequency[shown], density[shown]) if shown.sum() > 2 else None


def half_range(residuals: Sequence[Array]) -> float:
    """Half the range of an axis of residuals; see ``BULK``."""
    sizes = [np.quantile(np.abs(r), [BULK, 1.0]) for r in residuals if len(r)]
    inner, outer = np.max(sizes, axis=0, initial=0.0).tolist() if sizes else (0.0, 0.0)
    return HEADROOM * min(outer, BEYOND_BULK * inner) or 1.0

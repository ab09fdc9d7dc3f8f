"""Speeds that a drive computes as differences of positions: which difference, and whether it is late.

(q(t) − q(t − n h))/(n h) is the speed at t − n h/2, n/2 rows late. In a force balance it looks like an input that
acts n/2 rows later, but the noise shows it: with white noise e of the positions it is (e_k − e_(k−n))/(n h), whose
autocorrelation is −1/2 at lag n.
"""

from __future__ import annotations

import numpy as np

from codegen.base.arrays import Array
from codegen.diagnosis.evidence.input_timing import LEAST_LEAD, SURE, USUAL, lead_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import low_pass
from codegen.logs import Finding, Log

MOST_ROWS = 40
"""Largest number of rows of a difference that is sought."""
NOISE_ABOVE = 0.1
"""Above this frequency, over the sample rate, a speed is taken as noise."""
AT_LAG, AT_OTHER_LAGS = (-0.62, -0.42), 0.32
"""Range of the autocorrelation at the lag of the difference, and its largest magnitude at other lags."""
OUTLIERS = 4.0
"""The noise is clipped at so many medians of its magnitude, so that impacts and spikes do not dominate."""
CENTRAL = 2
"""A difference over two rows may be a central one, which is not late, so it is left alone."""


def rows_of_difference(speed: Array, h: float) -> int:
    """Rows over which a logged speed (N,) is a difference of positions; 0 if its noise has another autocorrelation."""
    noise = speed - low_pass(speed, NOISE_ABOVE / h, h)
    cut = len(noise) // 20
    noise = noise[cut : len(noise) - cut]
    limit = OUTLIERS * float(np.median(np.abs(noise)))
    noise = np.clip(noise, -limit, limit)
    power = float(noise @ noise) / len(noise)
    if len(noise) < 10 * MOST_ROWS or not power:
        return 0
    by_lag = np.array([noise[k:] @ noise[:-k] / (len(noise) - k) / power for k in range(1, MOST_ROWS + 1)])
    n = int(np.argmin(by_lag))
    others = np.delete(by_lag, n)
    return n + 1 if AT_LAG[0] <= by_lag[n] <= AT_LAG[1] and np.abs(others).max() <= AT_OTHER_LAGS else 0


def late_speeds(problem: Problem, log: Log) -> tuple[float, tuple[Finding, ...]]:
    """Delay of the logged motion in rows, and the finding; 0 unless noise and inputs agree on it."""
    velocities = [v.name for v in problem.system.velocities]
    integrated = log.intake.integrated
    unknown = log.intake.resampled or log.velocities is None or not integrated or not all(integrated)
    if unknown or log.velocities is None or problem.system.actuators or set(velocities) & set(log.description.late):
        return 0.0, ()
    found = {rows_of_difference(column, log.sample_time) for column in log.velocities.T}
    n = found.pop()
    if found or n in (0, CENTRAL):
        return 0.0, ()
    leads = [lead_of(problem, k) for k in range(len(problem.system.inputs))]
    for lead in leads:
        if not (-lead.rows > max(SURE * lead.deviation, LEAST_LEAD) and lead.rows + n / 2 <= USUAL[-1] + LEAST_LEAD):
            return 0.0, ()
    names, by = ", ".join(velocities), f"{1e3 * n / 2 * log.sample_time:.3g} ms"
    key = ", ".join(f"{v}: {by}" for v in velocities)
    words = (
        f"The noise of {names} is that of a difference of positions over {n} {'row' if n == 1 else 'rows'}, which is "
        f"{by} late, and the motion follows the inputs at least as late. So the inputs are taken {by} later, as "
        f"`late: {{{key}}}` in meta.yaml beside the log would take the speed earlier. If the speed is not late, say "
        f"`late: {{{key.replace(by, '0 s')}}}`."
    )
    figures = {"rows": float(n), "lead": max(lead.rows for lead in leads)}
    return n / 2, (Finding("warning", f"timing of {names}", words, figures),)

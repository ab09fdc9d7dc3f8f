"""Start states of segments that a wrong model has shifted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from codegen.diagnosis.credit import noise_ratio
from codegen.diagnosis.output_error import polish, shooting_fit
from codegen.diagnosis.record import record_of
from codegen.diagnosis.residual import Problem
from codegen.diagnosis.search import search_on
from codegen.diagnosis.signals import smooth_motion
from tests.diagnosis.stage import log_of, stage, system_of


def test_shifted_start_states_return_to_the_measured_ones(tmp_path: Path) -> None:
    """A shift of a tenth of the speed is more than one linear step may undo, and turns the friction's sign."""
    spec = stage()
    log = log_of(spec, tmp_path, "log.csv")
    motion = smooth_motion(log)
    search = search_on(Problem(system_of(spec), motion, {}), lambda share: record_of(motion, log, share))
    right = search.refit()
    offsets = right.offsets.copy()
    offsets[::2, 1] += 0.1 * float(np.quantile(np.abs(motion.velocities), 0.95))
    shifted = shooting_fit(right.runner, right.theta, offsets, right.prior, 0)
    assert np.quantile(shifted.by_segment / shifted.residual.shape[1], 0.75) > 100
    found = polish(shifted, 4)
    assert noise_ratio(found) < 1.5
    assert found.cost < right.cost + 0.05 * abs(right.cost) and found.cost < 0.1 * shifted.cost
    again = polish(replace(right, offsets=right.offsets), 4)
    assert again.cost <= right.cost

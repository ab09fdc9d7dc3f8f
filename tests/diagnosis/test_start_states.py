"""Start states of segments that a wrong model has shifted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from codegen.diagnosis.fit.acceptance import noise_ratio
from codegen.diagnosis.fit.output_error import _restarted, polish, shooting_fit
from codegen.diagnosis.fit.record import Record, record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import smooth_motion
from tests.diagnosis.stage import TRAIN, log_of, stage, system_of


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


def test_a_start_state_is_compared_with_the_measured_one_beside_the_same_load(tmp_path: Path) -> None:
    """A load that is shaken at its resonance. Where one segment is run alone, its load is simulated for a second only.

    Late segments, when the load no longer shows how it began. One of them starts at rest, where friction holds it.
    """
    values, shaken = "{k: 800, c: 1, load_fraction: 0.6}", f"{TRAIN} + 0.01*sin(2*pi*6*t)*sin(2*pi*0.15*t)**20"
    spec = stage(f"[{{kind: compliance, on: x, parameters: {values}}}]", reference=shaken)
    log = log_of(spec, tmp_path, "log.csv")
    motion = smooth_motion(log)
    late = slice(38, None)

    def some(share: float) -> Record:
        whole = record_of(motion, log, share)
        return replace(whole, start=np.ascontiguousarray(whole.start[late]))

    search = search_on(Problem(system_of(spec), motion, {}), some)
    right = search.refit()
    assert len(right.offsets) > 14 and right.by_segment.max() < 9 * right.residual.shape[1]
    lost = 0
    for k, first in enumerate(right.runner.record.start):
        offsets = right.offsets.copy()
        offsets[k, 1] = -motion.velocities[first, 0]
        shifted = shooting_fit(right.runner, right.theta, offsets, right.prior, 0)
        lost += shifted.by_segment[k] > 9 * shifted.residual.shape[1] and bool(_restarted(shifted)[k].any())
    assert lost == 0

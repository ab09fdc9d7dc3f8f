"""A ladder of steady speeds as an expert fits it: the mean force of each log, and what a model says of it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

import stiction
from benchmarks.real.sets import DATA, SPECS, Diagnosed, spec_of
from codegen.diagnosis.fit.residual import inverse_dynamics_residual
from codegen.diagnosis.fit.signals import SHORTEST_TEST_S, Motion, smooth_motion
from codegen.diagnosis.fit.trial import with_values
from codegen.logs import Log, read_logs
from codegen.mechanics import System

FIRST = 0.1
"""Share of each log that is left out at its start."""


def mean_errors(set_name: str, run: Diagnosed, out: Path) -> list[float]:
    """RMS over the test logs of the mean residual force of each, in SI: declared, refit and augmented model.

    Args:
        out: folder of the diagnosis.
    """
    about, spec_file = SPECS / set_name / run.about, spec_of(set_name, run)
    declared = stiction.check(spec_file)
    found = json.loads((out / "diagnosis.json").read_text())
    refit = with_values(declared.system, {name: v["refit"] for name, v in found["values"].items()})
    augmented = stiction.check(out / "spec.yaml").system if found["effects"] else refit
    log = read_logs([DATA / set_name / file for file in run.test], declared.spec, description=about)
    motion = smooth_motion(log, found["data"]["cutoff_hz"], SHORTEST_TEST_S)
    return [_error(system, log, motion) for system in (declared.system, refit, augmented)]


def _error(system: System, log: Log, motion: Motion) -> float:
    residual = inverse_dynamics_residual(system, motion)[:, 0]
    means = []
    for start, stop in log.segments:
        inside = slice(start + round(FIRST * (stop - start)), stop)
        means.append(float(residual[inside][motion.usable[inside]].mean()))
    return float(np.sqrt(np.mean(np.square(means))))

"""Fits of candidates by forked processes are those of one process, bit by bit."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codegen.base import parallel
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection.candidate_fits import fit_candidates
from codegen.effects import CATALOGUE
from tests.diagnosis.stage import log_of, stage, system_of
from tests.slow_cases import slow_except

KINDS = ("viscous", "offset", "stribeck", "cogging", "compliance", "backlash", "saturation", "input_delay", "spring")
FEW = "offset", "cogging", "input_delay"


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux alone")
@pytest.mark.parametrize(("kinds", "least"), slow_except([(KINDS, 100), (FEW, 4)], [(FEW, 4)], several=True))
def test_fits_by_processes_are_those_of_one(
    kinds: tuple[str, ...], least: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Diagnoses of other tests fork nothing (``conftest.py``)."""
    backlash = "[{kind: backlash, on: x, parameters: {gap: 0.01, k: 6000, c: 60, load_fraction: 0.35}}]"
    log = log_of(stage(backlash), tmp_path, "train.csv")
    motion = smooth_motion(log)
    search = search_on(Problem(system_of(stage()), motion, {}), lambda share: record_of(motion, log, share))
    base = search.refit()
    parts = [part_of(CATALOGUE[kind], 0, search.system) for kind in kinds]
    delivered: list[int] = []
    results = parallel._Child.results

    def counted(child: Any) -> dict[int, Any]:
        found = results(child)
        delivered.append(len(found))
        return found

    monkeypatch.setattr(parallel._Child, "results", counted)
    found: dict[int, list[Fit]] = {}
    for processes in (1, 3):
        monkeypatch.setattr(parallel, "PROCESSES", processes)
        parallel.allow_processes(processes > 1)
        monkeypatch.setattr(parallel, "WORKERS", 1)
        found[processes] = fit_candidates(search, base, parts)
    parallel.allow_processes(False)
    assert len(delivered) >= 2 and sum(delivered) > least, "a child delivered nothing"
    assert [f.part for f in found[1]] == [f.part for f in found[3]]
    for one, other in zip(found[1], found[3], strict=True):
        for name in ("theta", "offsets", "unprojected", "residual", "slopes", "limited"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        assert one.cost == other.cost
        assert one.runner.shooter is other.runner.shooter and one.runner.record is other.runner.record

"""A play for which free runs from the refit's level and start states show no gain at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnosis.fit.acceptance import noise_ratio
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection.candidate_fits import fit_candidates
from codegen.diagnosis.selection.forward_selection import within_reach
from codegen.effects import CATALOGUE
from tests.diagnosis.stage import log_of, stage, system_of


def test_a_heavy_load_behind_a_play_is_found_along_the_measured_motion(tmp_path: Path) -> None:
    """70 % of the mass, with a friction of 9 N where the spec says 4."""
    true = {"gap": 0.012, "k": 20000.0, "c": 60.0, "load_fraction": 0.7}
    values = ", ".join(f"{name}: {value}" for name, value in true.items())
    log = log_of(stage(f"[{{kind: backlash, on: x, parameters: {{{values}}}}}]", level=9), tmp_path, "log.csv")
    motion = smooth_motion(log)
    search = search_on(Problem(system_of(stage()), motion, {}), lambda share: record_of(motion, log, share))
    search, base = within_reach(search)
    assert noise_ratio(base) > 50
    (found,) = fit_candidates(search, base, [part_of(CATALOGUE["backlash"], 0, search.system)])
    assert noise_ratio(found) < 2
    assert found.parameters["gap"] == pytest.approx(true["gap"], rel=0.01)
    assert found.parameters["load_fraction"] == pytest.approx(true["load_fraction"], rel=0.01)

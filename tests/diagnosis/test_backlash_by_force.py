"""Plays for which free runs from the refit's level and start states show no gain at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnosis.fit.acceptance import noise_ratio
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection.candidate_fits import every_part, fit_candidates
from codegen.diagnosis.selection.forward_selection import within_reach
from codegen.effects import CATALOGUE
from tests.diagnosis.stage import log_of, stage, system_of


def test_a_heavy_load_behind_a_play_is_found_along_the_measured_motion(tmp_path: Path) -> None:
    """70 % of the mass, with a friction of 9 N where the spec says 4."""
    check(tmp_path, {"gap": 0.012, "k": 20000.0, "c": 60.0, "load_fraction": 0.7}, level=9)


@pytest.mark.slow  # 4 s, since all candidates compete
def test_a_play_with_a_soft_contact_is_fitted_among_all_candidates(tmp_path: Path) -> None:
    """Its contact rings at 9 Hz and its start gains nothing in free runs, so six others were fitted in its place.

    A turntable with such a gear, 48 % of its drive force, was `unknown`.
    """
    check(tmp_path, {"gap": 0.01, "k": 1470.0, "c": 6.0, "load_fraction": 0.64}, level=4, alone=False)


def check(folder: Path, true: dict[str, float], level: float, alone: bool = True) -> None:
    """A stage with this play leads the candidates, with its values; ``alone``: whether it is the only one."""
    values = ", ".join(f"{name}: {value}" for name, value in true.items())
    log = log_of(stage(f"[{{kind: backlash, on: x, parameters: {{{values}}}}}]", level=level), folder, "log.csv")
    motion = smooth_motion(log)
    search = search_on(Problem(system_of(stage()), motion, {}), lambda share: record_of(motion, log, share))
    search, base = within_reach(search)
    assert noise_ratio(base) > 50
    parts = [part_of(CATALOGUE["backlash"], 0, search.system)] if alone else every_part(search, ())
    found, *_ = fit_candidates(search, base, parts)
    assert found.part.kind == "backlash" and noise_ratio(found) < 2
    assert found.parameters["gap"] == pytest.approx(true["gap"], rel=0.01)
    assert found.parameters["load_fraction"] == pytest.approx(true["load_fraction"], rel=0.01)

"""A rival of a later effect is a candidate that is accepted in its place, not any that free runs do not exclude."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection import parsimony
from codegen.diagnosis.selection.forward_selection import within_reach
from codegen.effects import CATALOGUE
from tests.diagnosis.stage import log_of, stage, system_of

WAVE = {"amplitude": 1.0, "period": 0.03, "phase": 0.5}


def test_a_rival_that_explains_as_much_in_the_effects_place_stays_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A wave of 30 mm beside a drag, and a force that nothing describes: the wobble of an encoder with that period is
    accepted in its place and ties, a spring is refused there.
    """
    effects = f"[{{kind: quadratic_drag, on: x, parameters: {{c: 6}}}}, {{kind: cogging, on: x, parameters: {WAVE}}}]"
    log, noise, steps = log_of(stage(effects), tmp_path, "log.csv"), 0.0, np.random.default_rng(5)
    disturbance = np.array([noise := 0.987 * noise + 0.16 * steps.standard_normal() for _ in log.time])
    log = replace(log, inputs=log.inputs + 1.2 * disturbance[:, None])
    motion = smooth_motion(log)
    search = search_on(Problem(system_of(stage()), motion, {}), lambda share: record_of(motion, log, share))
    search, base = within_reach(search)
    drag, wave, wobble, spring = (
        part_of(CATALOGUE[kind], 0, search.system)
        for kind in ("quadratic_drag", "cogging", "encoder_eccentricity", "spring")
    )
    current = search.with_parts(base, base.values[0], [drag, wave], [{"c": 6.0}, WAVE])
    assert current.parameters["period"] == pytest.approx(0.03, rel=0.02)
    monkeypatch.setattr(parsimony, "possible_replacements", lambda _, parts, k, among: [wobble, spring] if k else [])
    monkeypatch.setattr(parsimony, "tied_by_free_runs", lambda *_: True)
    monkeypatch.setattr(parsimony, "force_prefers", lambda *_: False)
    better, tied = parsimony.swapped(search, current, [])
    assert better is None
    assert [one.part for one in tied[1]] == [wobble]

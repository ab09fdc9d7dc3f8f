"""Models tie for what an effect leaves: the effect that all of them have may be credited alone."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from codegen.diagnosis.forward_selection import Outcome, common_effects
from codegen.diagnosis.trial import part_of
from codegen.effects import CATALOGUE
from tests.diagnosis.stage import log_of, stage
from tests.diagnosis.test_adoption import search_of

COGGING = "{{kind: cogging, on: x, parameters: {{amplitude: {size}, period: 0.05, phase: 0.3}}}}"
OFFSET = "{{kind: offset, on: x, parameters: {{f0: {push}}}}}"
EFFECTS = f"[{COGGING}, {OFFSET}]"


@pytest.mark.parametrize(("size", "push", "credited"), [(2.0, 0.1, True), (1.0, 1.2, False)])
def test_the_common_effect_stands_where_it_is_credited_alone(
    size: float, push: float, credited: bool, tmp_path: Path
) -> None:
    log = log_of(stage(EFFECTS.format(size=size, push=push)), tmp_path, "train.csv")
    search, _ = search_of(stage(), log)
    base = search.refit()
    parts = [part_of(CATALOGUE[kind], 0, search.system) for kind in ("offset", "cogging")]
    values = [{"f0": push}, {"amplitude": size, "period": 0.05, "phase": 0.3}]
    both = search.with_parts(base, base.theta, parts, values)
    rival: Any = SimpleNamespace()  # only its being there counts
    found = common_effects(search, Outcome(base, both, (rival,) * 20, (rival,), 1.0, len(search.record.start)))
    if not credited:
        assert found is None
        return
    assert found is not None and not found.rivals
    assert [p.kind for p in found.parts] == ["cogging"]
    assert found.final.runner.trial.split(found.final.theta)[1][0]["amplitude"] == pytest.approx(size, rel=0.05)
    assert common_effects(search, Outcome(base, both, (rival,), (), 1.0, len(search.record.start))) is None

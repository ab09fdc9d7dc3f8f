"""Models tie for what an effect leaves: the effect that all of them have may be accepted alone."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection.forward_selection import Outcome, common_effects
from codegen.effects import CATALOGUE
from tests.diagnosis.stage import log_of, stage
from tests.diagnosis.test_adoption import loose, search_of

COGGING = "{{kind: cogging, on: x, parameters: {{amplitude: {size}, period: 0.05, phase: 0.3}}}}"
OFFSET = "{{kind: offset, on: x, parameters: {{f0: {push}}}}}"
EFFECTS = f"[{COGGING}, {OFFSET}]"


def assert_cogging(found: Outcome, size: float) -> None:
    assert not found.rivals
    assert [p.kind for p in found.parts] == ["cogging"]
    values = found.final.runner.trial.split(found.final.theta)[1][0]
    assert values["amplitude"] == pytest.approx(size, rel=0.05)
    assert values["period"] == pytest.approx(0.05, rel=0.001)


@pytest.mark.parametrize(("size", "push", "accepted"), [(2.0, 0.1, True), (1.0, 1.2, False)])
def test_the_common_effect_stands_where_it_is_accepted_alone(
    size: float, push: float, accepted: bool, tmp_path: Path
) -> None:
    log = log_of(stage(EFFECTS.format(size=size, push=push)), tmp_path, "train.csv")
    search = search_of(stage(), log)
    base = search.refit()
    parts = [part_of(CATALOGUE[kind], 0, search.system) for kind in ("offset", "cogging")]
    values = [{"f0": push}, {"amplitude": size, "period": 0.05, "phase": 0.3}]
    both = search.with_parts(base, base.theta, parts, values)
    rival: Any = SimpleNamespace()  # only its being there counts
    found = common_effects(search, Outcome(base, both, (rival,) * 20, (rival,), 1.0))
    if not accepted:
        assert found is None
        return
    assert found is not None
    assert found[0] is search  # no parameter has a limit
    assert_cogging(found[1], size)
    assert common_effects(search, Outcome(base, both, (rival,), (), 1.0)) is None


def test_common_effects_are_fitted_beside_the_wrong_parameter_that_the_tied_ones_imitate(tmp_path: Path) -> None:
    """The machine has 2 kg and cogging; the spec says 1.6 kg to 3 %, and an inertia of 0.4 kg is the tied effect."""
    log = log_of(stage(f"[{COGGING.format(size=2.0)}]"), tmp_path, "train.csv")
    search = search_of(loose(1.6, "3%"), log)
    base = search.refit()
    parts = [part_of(CATALOGUE[kind], 0, search.system) for kind in ("inertia_error", "cogging")]
    both = search.with_parts(
        base, base.theta, parts, [{"delta": 0.4}, {"amplitude": 2.0, "period": 0.05, "phase": 0.3}]
    )
    rival: Any = SimpleNamespace()
    found = common_effects(search, Outcome(base, both, (rival,) * 20, (rival,), 1.0))
    assert found is not None
    assert_cogging(found[1], 2.0)
    mass = [s.name for s in search.refitted_symbols].index("m")
    assert found[1].final.theta[mass] == pytest.approx(2.0, rel=0.01)

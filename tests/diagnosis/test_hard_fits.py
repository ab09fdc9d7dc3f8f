"""Fits that a plain Gauss–Newton from the first start does not find, and intervals that know more than one fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.evidence.estimate import estimate
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection.forward_selection import find_effects
from codegen.effects import CATALOGUE
from codegen.spec import parse_spec
from tests.diagnosis.stage import STAGE, TEST, TRAIN, diagnosed, log_of, stage, system_of

PLAY = {"gap": 4e-4, "k": 3e4, "c": 90.0, "load_fraction": 0.6}


@pytest.mark.slow
def test_play_in_the_drive_is_found_though_the_loss_is_rough(tmp_path: Path) -> None:
    entry = ", ".join(f"{name}: {value}" for name, value in PLAY.items())
    diagnosis, _ = diagnosed(f"[{{kind: backlash, on: x, parameters: {{{entry}}}}}]", tmp_path)
    assert [e.kind for e in diagnosis.effects] == ["backlash"], diagnosis.sentence
    found = diagnosis.effects[0].parameters
    assert found["gap"] == pytest.approx(PLAY["gap"], rel=0.1)
    assert found["load_fraction"] == pytest.approx(PLAY["load_fraction"], rel=0.05)


@pytest.mark.slow
def test_a_compliance_is_not_called_play(tmp_path: Path) -> None:
    spring = "[{kind: compliance, on: x, parameters: {k: 8000, c: 20, load_fraction: 0.6}}]"
    diagnosis, _ = diagnosed(spring, tmp_path, noise=2e-6)
    assert [e.kind for e in diagnosis.effects] == ["compliance"], diagnosis.sentence


@pytest.mark.slow
def test_two_effects_are_found_where_each_bends_the_fit_of_the_other(tmp_path: Path) -> None:
    spring = "{kind: spring, on: x, parameters: {k: 25}}"
    waves = "{kind: position_dependent_friction, on: rail, parameters: {amplitude: 2.5, period: 0.21, phase: -2}}"
    diagnosis, _ = diagnosed(f"[{spring}, {waves}]", tmp_path)
    found = {e.kind: e.parameters for e in diagnosis.effects}
    assert set(found) == {"spring", "position_dependent_friction"}, diagnosis.sentence
    assert found["spring"]["k"] == pytest.approx(25, rel=0.02)
    assert found["position_dependent_friction"]["period"] == pytest.approx(0.21, rel=0.01)


def test_an_interval_knows_of_the_fit_on_shorter_segments(tmp_path: Path) -> None:
    """What the two fits differ by is one more deviation; the truth lies inside."""
    truth = 5.0
    plant = stage(f"[{{kind: viscous, on: rail, parameters: {{b: {truth}}}}}]", 4.5, TRAIN, noise=2e-5)
    spec = stage()
    system, log = system_of(spec), log_of(plant, tmp_path, "log.csv")
    motion = smooth_motion(log)
    search = search_on(Problem(system, motion, {}), lambda share: record_of(motion, log, share))
    base = search.refit()
    part = part_of(CATALOGUE["viscous"], 0, system)
    first = search.with_parts(base, base.theta, [part], [{"b": 0.8 * truth}])
    one, other = search.polished(first)
    assert other.runner.record.length == pytest.approx(0.6 * one.runner.record.length, rel=0.05)
    alone, both = (estimate(*fits).effects[0]["b"][1] for fits in ((one,), (one, other)))
    apart = abs(float(other.theta[-1] - one.theta[-1]))
    least, most = (np.hypot(alone[1] - alone[0], 2 * factor * apart) for factor in (1.96, 2.14))  # normal; 15 degrees
    assert apart > 0 and least * (1 - 1e-9) <= both[1] - both[0] <= most
    assert both[0] < truth < both[1]


def test_nothing_is_searched_where_only_a_refit_is_asked_for(tmp_path: Path) -> None:
    log = log_of(stage("[]", 4.5), tmp_path, "log.csv")
    motion, system = smooth_motion(log), system_of(stage())
    search = search_on(Problem(system, motion, {}), lambda share: record_of(motion, log, share))
    outcome = find_effects(
        search, search.refit(), lambda turn, share: pytest.fail("a candidate was tried"), refit_only=True
    )
    assert outcome.parts == () and outcome.base.theta[0] == pytest.approx(4.5, rel=0.01)


DAMPING, TOP = "parameters:\n", "  top: {value: 15, unit: N}\n"
SOFT_FILE = Path("soft.yaml")
SOFT = "top*tanh(w/top)"


@pytest.mark.slow
def test_a_drive_that_saturates_gradually_is_found(tmp_path: Path) -> None:
    """The plant's force is a hyperbolic tangent of the command; the catalogue's rounded limit is its nearest."""
    plain = STAGE.format(effects="[]", level=4.5, reference=TRAIN, duration=14.0, noise=0.0)
    train, test = (
        log_of(
            parse_spec(text.replace("w - b*v", f"{SOFT} - b*v").replace(DAMPING, DAMPING + TOP), SOFT_FILE),
            tmp_path,
            name,
        )
        for name, text in (("train.csv", plain), ("test.csv", plain.replace(TRAIN, TEST)))
    )
    spec = stage()
    diagnosis, _ = diagnose_log(spec, system_of(spec), train, test)
    assert [e.kind for e in diagnosis.effects] == ["saturation"], diagnosis.sentence
    found = diagnosis.effects[0].parameters
    assert found["limit"] == pytest.approx(15, rel=0.2) and 0.7 < found["rounding"] < 0.95
    assert diagnosis.augmented.force_rms < 0.2 * diagnosis.refit.force_rms

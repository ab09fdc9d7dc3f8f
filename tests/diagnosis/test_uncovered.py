"""A wave of which the log covers less than a period: it is not accepted, and neither is anything in its place."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import patch

import pytest

from codegen.diagnosis import free_runs
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.results import Diagnosis
from codegen.diagnosis.verdict import in_place
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import STAGE, among, diagnosed, log_of, system_of
from tests.slow_cases import slow_except

OF_POSITION = ("cogging", "spring", "hardening_spring", "offset", "position_dependent_friction")
"""The stage moves over 0.517 m."""
few = pytest.mark.parametrize(
    "kinds", slow_except([OF_POSITION, OF_POSITION[:3]], [OF_POSITION[:3]]), ids=["all", "few"]
)


PART_OF_A_TURN = "0.3 + 0.55*sin(2*pi*0.31*t) + 0.15*sin(2*pi*0.83*t)"
"""1.4 rad."""
OTHER_PART = "0.3 + 0.45*sin(2*pi*0.37*t + 1) + 0.2*sin(2*pi*0.21*t)"


def joint(force: str = "0", reference: str = PART_OF_A_TURN, duration: float = 14.0) -> Spec:
    """A joint with this torque over its position x, in N*m."""
    text = STAGE.format(effects="[]", level=4, reference=reference, duration=duration, noise=2e-5)
    units = {"unit: m}": "unit: rad}", "unit: N}": "unit: N*m}", "N*s/m": "N*m*s", "unit: kg}": "unit: kg*m^2}"}
    values = {"value: 2,": "value: 0.5,", "value: 6,": "value: 1.5,", "{w: 900}": "{w: 400}", "2e-6": "2e-5"}
    torque = {"mass_matrix:": "  one: {value: 1, unit: N*m}\nmass_matrix:", "b*v]": f"b*v + one*({force})]"}
    for old, new in (units | values | torque).items():
        text = text.replace(old, new)
    return parse_spec(text, Path("joint.yaml"))


def with_torque(force: str, folder: Path) -> Diagnosis:
    train = log_of(joint(force), folder, "train.csv")
    test = log_of(joint(force, OTHER_PART, 10.0), folder, "test.csv")
    spec = joint()
    with among("gravity_imbalance", "cogging"):
        return diagnose_log(spec, system_of(spec), train, test)[0]


def wave(period: float, phase: float = 0.3, kind: str = "cogging", on: str = "x") -> str:
    return f"[{{kind: {kind}, on: {on}, parameters: {{amplitude: 1.5, period: {period:g}, phase: {phase:g}}}}}]"


LONG = [(0.553, 0.3, True), (0.6, 0.3, True), (0.553, 1.6, False)]


@pytest.mark.parametrize(("period", "phase", "sum_named"), slow_except(LONG, LONG[:1], several=True))
def test_no_sum_of_other_effects_is_named_in_place_of_a_long_wave(
    period: float, phase: float, sum_named: bool, tmp_path: Path
) -> None:
    """A spring of -13 N/m and a hardening spring were named, or no effect at all."""
    diagnosis, _ = diagnosed(wave(period, phase), tmp_path, kinds=OF_POSITION)
    said = diagnosis.statement
    assert diagnosis.verdict == "unknown" and diagnosis.effects == ()
    assert said.headline == "Something is missing, perhaps cogging on x, but the log covers only part of its period."
    reason, *less = said.of("not accepted")
    assert f"covers only 0.51{8 if period > 0.553 else 7} m of the period of cogging, {period:g} m" in reason
    words = "It explains more than spring on x and hardening_spring on x together."
    assert less == ([words] if sum_named else [])
    assert said.of("next") == (f"Log a motion over at least {period:g} m on x, and diagnose again.",)


def test_a_long_wave_is_not_nothing(tmp_path: Path) -> None:
    """Of 2.1 % of the drive force the refitted level took so much that 1.9 % were left: "nothing to correct"."""
    of_friction = wave(0.553, kind="position_dependent_friction", on="rail")
    with patch.object(free_runs, "is_small", return_value=True):
        diagnosis, _ = diagnosed(of_friction, tmp_path, kinds=("position_dependent_friction", "offset"))
    assert diagnosis.verdict == "unknown"
    assert "perhaps position_dependent_friction on rail" in diagnosis.statement.headline


@few
def test_a_true_sum_is_named_beside_a_long_wave(kinds: tuple[str, ...], tmp_path: Path) -> None:
    plant = "[{kind: spring, on: x, parameters: {k: -13}}, {kind: hardening_spring, on: x, parameters: {k3: 160}}]"
    diagnosis, _ = diagnosed(plant, tmp_path, kinds=kinds)
    assert any("nothing shows that it repeats" in c.why_not for c in diagnosis.candidates)
    assert diagnosis.verdict == "effect" and {e.kind for e in diagnosis.effects} == {"spring", "hardening_spring"}


@few
def test_a_wave_that_the_log_covers_is_named(kinds: tuple[str, ...], tmp_path: Path) -> None:
    diagnosis, _ = diagnosed(wave(0.49), tmp_path, kinds=kinds)
    assert diagnosis.verdict == "effect" and [e.kind for e in diagnosis.effects] == ["cogging"]


@few
def test_a_wave_whose_period_is_unsure_refuses_no_other_effect(kinds: tuple[str, ...], tmp_path: Path) -> None:
    """Waves that imitate a spring within their period had intervals of 8 to 780 % of it: no stroke can be stated."""
    with patch.object(in_place, "SURE", 1e-9):
        diagnosis, _ = diagnosed(wave(0.57), tmp_path, kinds=kinds)
    assert diagnosis.verdict == "effect" and {e.kind for e in diagnosis.effects} == {"spring", "hardening_spring"}


def test_a_weight_over_part_of_a_turn_is_named(tmp_path: Path) -> None:
    diagnosis = with_torque("-3*sin(x + 0.5)", tmp_path)
    assert diagnosis.verdict == "effect" and [e.kind for e in diagnosis.effects] == ["gravity_imbalance"]


@pytest.mark.parametrize("is_sure", slow_except([True, False], [True]))
def test_another_torque_over_part_of_a_turn_is_no_weight(is_sure: bool, tmp_path: Path) -> None:
    """A weight was named, whose period of a turn needs no stroke, although another period explains far more."""
    with patch.object(in_place, "SURE", in_place.SURE if is_sure else 1e-9):
        diagnosis = with_torque("2*sin(1.9*x + 0.3)", tmp_path)
    assert diagnosis.verdict == "unknown" and diagnosis.effects == ()
    reason, less = diagnosis.statement.of("not accepted")
    assert "nothing shows that it repeats" in reason
    assert less == "It explains more than gravity_imbalance on x."
    assert "rad on x, and diagnose again" in diagnosis.statement.of("next")[0] or not is_sure
    assert is_sure or "Log a longer stroke on x" in " ".join(diagnosis.statement.of("next"))

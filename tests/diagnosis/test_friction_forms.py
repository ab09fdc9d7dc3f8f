"""Friction curves of other forms than the standard equations: one effect, under the standard name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from codegen.app.diagnose import diagnose
from codegen.diagnosis.diagnose import Models, diagnose_log
from codegen.diagnosis.evidence.reservations import is_level_or_line
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.results import Diagnosis
from codegen.effects import CATALOGUE
from codegen.spec import parse_spec
from tests.diagnosis.stage import STAGE, TEST, TRAIN, among, competing, log_of, stage, system_of
from tests.slow_cases import slow_except

SPEED: NDArray[np.float64] = np.linspace(0.04, 0.6, 200)
LAWS = {
    "square root": ("law: canudas, alpha_0: 2, alpha_1: 10, alpha_2: 0", 2 + 10 * np.sqrt(SPEED)),
    "proportional": ("law: canudas, alpha_0: 2, alpha_1: 0, alpha_2: 9", 2 + 9 * SPEED),
}


def diagnosed(plant: str, folder: Path) -> tuple[Diagnosis, Models]:
    """Diagnose the logs of a plant, given as the text of its spec, against the stage's spec."""
    train, test = (
        log_of(parse_spec(text, Path("stage.yaml")), folder, f"{name}.csv")
        for name, text in (("train", plant), ("test", plant.replace(TRAIN, TEST)))
    )
    spec = stage()
    return diagnose_log(spec, system_of(spec), train, test)


ALL: tuple[str, ...] = ()
OF_SPEED = ("viscous", "quadratic_drag")


@pytest.mark.parametrize(
    ("name", "kinds"),
    slow_except(
        [*((name, ALL) for name in LAWS), ("proportional", OF_SPEED)], [("proportional", OF_SPEED)], several=True
    ),
)
def test_friction_that_grows_with_speed_is_viscous(name: str, kinds: tuple[str, ...], tmp_path: Path) -> None:
    """The plant's contact has a law that the spec does not know; no second effect corrects the form of the first."""
    law, truth = LAWS[name]
    plain = STAGE.format(effects="[]", level=2.0, reference=TRAIN, duration=14.0, noise=1e-6)
    plain = plain.replace("law: coulomb, a: 2.0, unit: N", f"{law}, unit: N")
    with among(*kinds):
        diagnosis, models = diagnosed(plain, tmp_path)
    assert [e.kind for e in diagnosis.effects] == ["viscous"], diagnosis.sentence
    found = diagnosis.effects[0].parameters
    level = float(models.augmented.values[next(iter(models.train.levels))])
    assert ("v_s" in found) == (name == "square root")
    rise = found["b"] * found["v_s"] * np.log1p(SPEED / found["v_s"]) if "v_s" in found else found["b"] * SPEED
    rise += found.get("b_inf", 0.0) * SPEED
    assert np.abs(level + rise - truth).max() < 0.05 * truth.max()
    assert diagnosis.augmented.force_rms < 0.3 * diagnosis.refit.force_rms


OBSERVER = """observer:
  kind: gcfo
  velocity: estimated
  gains: {K_F: 20, K_v: 100}
  sample_time: 2 ms
envelope:
  x: [-0.5, 0.5]
  v: [-1, 1]
"""


@pytest.mark.slow
def test_viscous_friction_that_the_spec_declares_in_proportion_is_a_curve(tmp_path: Path) -> None:
    """The spec has 6 N·s/m of viscous friction, the machine 2 + 10 √|v| and none in proportion: the curve takes off
    what the spec has too much, and no negative drag is named.
    """
    law, truth = LAWS["square root"]
    plain = STAGE.format(effects="[]", level=2.0, reference=TRAIN, duration=14.0, noise=1e-6)
    plain = plain.replace("law: coulomb, a: 2.0, unit: N", f"{law}, unit: N").replace("w - b*v", "w")
    diagnosis, models = diagnosed(plain, tmp_path)
    assert [e.kind for e in diagnosis.effects] == ["viscous"], diagnosis.sentence
    p = diagnosis.effects[0].parameters
    level = float(models.augmented.values[next(iter(models.train.levels))])
    found = level + (6 + p["b_inf"]) * SPEED + p["b"] * p["v_s"] * np.log1p(SPEED / p["v_s"])
    assert np.abs(found - truth).max() < 0.05 * truth.max()


@pytest.mark.slow
def test_a_steep_stribeck_curve_is_found_and_its_observer_refused(tmp_path: Path) -> None:
    """Bo and Pavelescu's curve with an exponent of 0.6, whose slope is infinite at standstill: no observer is made for
    it, and the diagnosis is written all the same.
    """
    delta, width, exponent = 5.0, 0.1, 0.6
    law = f"law: bo_pavelescu, F_c: 4, F_s: {4 + delta}, alpha: {width}, n: {exponent}, F_v: 0"
    plain = STAGE.format(effects="[]", level=4.0, reference=TRAIN, duration=14.0, noise=1e-6)
    plain = plain.replace("law: coulomb, a: 4.0, unit: N", f"{law}, unit: N")
    for name, text in (("train", plain), ("test", plain.replace(TRAIN, TEST))):
        log_of(parse_spec(text, Path("stage.yaml")), tmp_path, f"{name}.csv")
    spec = tmp_path / "stage.yaml"
    spec.write_text(plain.replace(law, "law: coulomb, a: 4") + OBSERVER, encoding="utf-8")
    done = diagnose(spec, tmp_path / "train.csv", tmp_path / "test.csv", tmp_path / "found")
    assert [e.kind for e in done.diagnosis.effects] == ["stribeck"], done.diagnosis.sentence
    found = done.diagnosis.effects[0].parameters
    curve = found["delta"] * np.exp(-((SPEED / found["v_s"]) ** found.get("exponent", 2.0)))
    assert np.abs(curve - delta * np.exp(-((SPEED / width) ** exponent))).max() < 0.1 * delta
    assert found["exponent"] == pytest.approx(exponent, rel=0.15)
    assert done.diagnosis.certificate is not None
    assert "no code was generated: the error dynamics are not finite" in str(done.diagnosis.certificate.after)
    assert "exponent:" in (tmp_path / "found" / "spec.yaml").read_text("utf-8")


@pytest.mark.slow
def test_a_peak_that_differs_by_direction_is_one_effect(tmp_path: Path) -> None:
    """As in a worm gear: 2.5 N more than the level at standstill for u > 0, and 0.3 N more for u < 0."""
    truth = {"delta": 1.4, "v_s": 0.1, "d_delta": 1.1}
    effects = f"[{{kind: stribeck, on: rail, parameters: {{{', '.join(f'{k}: {v}' for k, v in truth.items())}}}}}]"
    plain = STAGE.format(effects=effects, level=2.0, reference=TRAIN, duration=14.0, noise=1e-6)
    diagnosis, _ = diagnosed(plain, tmp_path)
    assert [e.kind for e in diagnosis.effects] == ["stribeck"], diagnosis.sentence
    assert diagnosis.effects[0].parameters == pytest.approx(truth, rel=0.1)


@competing("load_dependent_friction", "viscous", "input_gain")
@pytest.mark.parametrize("name", slow_except(["mu", "mu_load"], ["mu_load"]))
def test_the_load_of_a_gear_is_the_force_on_either_side_of_its_friction(
    name: str, kinds: tuple[str, ...], tmp_path: Path
) -> None:
    """The drive force, or what friction leaves of it; the two differ where the load drives the motor back."""
    effects = f"[{{kind: load_dependent_friction, on: rail, parameters: {{{name}: 0.3}}}}]"
    plain = STAGE.format(effects=effects, level=2.0, reference=TRAIN, duration=14.0, noise=1e-6)
    plain = plain.replace("w - b*v", "w - b*v - k*x").replace("mass_matrix", "  k: {value: 60, unit: N/m}\nmass_matrix")
    train, test = (
        log_of(parse_spec(text, Path("stage.yaml")), tmp_path, f"{log}.csv")
        for log, text in (("train", plain), ("test", plain.replace(TRAIN, TEST)))
    )
    spec = parse_spec(plain.replace(effects, "[]"), Path("stage.yaml"))
    with among(*kinds):
        diagnosis, _ = diagnose_log(spec, system_of(spec), train, test)
    assert [e.kind for e in diagnosis.effects] == ["load_dependent_friction"], diagnosis.sentence
    assert diagnosis.effects[0].parameters == pytest.approx({name: 0.3}, rel=0.05)


@pytest.mark.parametrize(
    ("kind", "form", "v_s", "hidden"),
    [
        ("viscous", "b_inf", 4e-3, True),
        ("viscous", "b_inf", 0.02, False),
        ("viscous", "b_inf", 1.2, False),
        ("viscous", "b_inf", 4.0, True),
        ("stribeck", "exponent", 4e-3, False),
        ("stribeck", "d_delta", 4e-3, False),
        ("stribeck", "d_delta", 0.6, True),
    ],
)
def test_a_curve_must_vary_within_the_speeds_of_the_log(
    kind: str, form: str, v_s: float, hidden: bool, tmp_path: Path
) -> None:
    """The stage's top speed is about 0.8 m/s: 0.2 m at 0.4 Hz and 0.06 m at 1.1 Hz."""
    motion, system = smooth_motion(log_of(stage(), tmp_path, "log.csv")), system_of(stage())
    part = part_of(CATALOGUE[kind].with_parameters(["v_s", form]), 0, system)
    assert is_level_or_line(system, motion, part, {"v_s": v_s}) is hidden

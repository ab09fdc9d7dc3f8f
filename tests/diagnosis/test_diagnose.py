"""The whole diagnosis on logs whose truth is known, and its honesty about what was measured on what."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

import stiction
from codegen.diagnosis.diagnose import Models, diagnose_log
from codegen.diagnosis.reliability import reliability_of
from codegen.diagnosis.results import Diagnosis
from codegen.effects import CATALOGUE
from codegen.effects.register import load_effects
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import STAGE, TEST, TRAIN, among, competing, diagnosed, log_of, stage, system_of
from tests.expected_errors import refused
from tests.slow_cases import slow_except

TRUTHS = {
    "viscous": ("rail", {"b": 5.0}),
    "viscous_asymmetry": ("rail", {"d_b": 3.0}),
    "stribeck": ("rail", {"delta": 2.0, "v_s": 0.08}),
    "cogging": ("x", {"amplitude": 1.5, "period": 0.037, "phase": 0.8}),
    "quadratic_drag": ("x", {"c": 12.0}),
    "spring": ("x", {"k": 18.0}),
    "inertia_error": ("x", {"delta": 0.5}),
    "input_delay": ("w", {"T": 0.011}),
}


QUICK = ("spring",)


@pytest.mark.parametrize("kind", [k if k in QUICK else pytest.param(k, marks=pytest.mark.slow) for k in TRUTHS])
def test_one_undeclared_effect_is_named_with_its_parameters(kind: str, tmp_path: Path) -> None:
    on, parameters = TRUTHS[kind]
    entry = ", ".join(f"{name}: {value}" for name, value in parameters.items())
    diagnosis, models = diagnosed(f"[{{kind: {kind}, on: {on}, parameters: {{{entry}}}}}]", tmp_path)
    assert diagnosis.verdict == "effect", diagnosis.sentence
    assert [(e.kind, e.on) for e in diagnosis.effects] == [(kind, on)]
    assert diagnosis.reliability == reliability_of("effect", near=True)
    for name, value in parameters.items():
        assert diagnosis.effects[0].parameters[name] == pytest.approx(value, rel=0.05), name
    # The level, declared 4 and truly 4.5, is found beside it, and the error falls on a motion not trained on.
    assert float(models.augmented.values[models.train.levels[0]]) == pytest.approx(4.5, rel=0.03)
    assert diagnosis.augmented.force_rms < 0.5 * diagnosis.refit.force_rms
    assert diagnosis.augmented.free_run_rmse < 0.5 * diagnosis.refit.free_run_rmse


TWINS = {
    "coulomb_asymmetry": ("{kind: coulomb_asymmetry, on: rail, parameters: {d: 0.9}}", -0.9),
    "offset": ("{kind: offset, on: x, parameters: {f0: 1.2}}", 1.2),
}
ALL: tuple[str, ...] = ()
CONSTANT = (*TWINS, "viscous")


@pytest.mark.parametrize(
    ("kind", "kinds"),
    slow_except(
        [*((kind, ALL) for kind in TWINS), ("coulomb_asymmetry", CONSTANT)],
        [("coulomb_asymmetry", CONSTANT)],
        several=True,
    ),
)
def test_twins_are_both_named(kind: str, kinds: tuple[str, ...], tmp_path: Path) -> None:
    """While the stage slips, a constant force and unequal levels are one motion; either may come first."""
    entry, force = TWINS[kind]
    diagnosis, models = diagnosed(f"[{entry}]", tmp_path, kinds=kinds)
    assert diagnosis.verdict == "effect", diagnosis.sentence
    (found,) = diagnosis.effects
    names = {(found.kind, found.on), *found.also}
    assert names == {("offset", "x"), ("coulomb_asymmetry", "rail")} and kind in {name for name, _ in names}
    value = found.parameters["f0"] if found.kind == "offset" else -found.parameters["d"]
    assert value == pytest.approx(force, rel=0.03)
    assert float(models.augmented.values[models.train.levels[0]]) == pytest.approx(4.5, rel=0.03)
    assert diagnosis.augmented.force_rms < 0.5 * diagnosis.refit.force_rms


def test_only_a_wrong_level_is_no_effect(tmp_path: Path) -> None:
    diagnosis, models = diagnosed("[]", tmp_path)
    assert diagnosis.verdict == "none"
    assert diagnosis.effects == ()
    assert diagnosis.augmented == diagnosis.refit
    assert float(models.refit.values[models.train.levels[0]]) == pytest.approx(4.5, rel=0.02)
    assert diagnosis.refit.force_rms < diagnosis.declared.force_rms


@competing("friction_drift", "offset", "spring", "cogging", "input_gain", "viscous")
def test_a_force_that_is_no_effect_of_the_catalogue_is_unknown_and_not_nothing(
    kinds: tuple[str, ...], tmp_path: Path
) -> None:
    log = log_of(stage(), tmp_path, "train.csv")
    # A shaking foundation: 3 N at 2.9 Hz, which the log of the input does not hold.
    log.inputs[:, 0] -= 3.0 * np.sin(2 * np.pi * 2.9 * log.time) * (np.sin(2 * np.pi * 0.11 * log.time) > 0)
    spec = stage()
    with among(*kinds):
        diagnosis, models = diagnose_log(spec, system_of(spec), log)
    assert diagnosis.verdict == "unknown", diagnosis.sentence
    assert diagnosis.effects == () and diagnosis.as_json()["reliability"] is None
    assert parse_spec(models.spec_text, Path("spec.yaml")).effects == ()


@pytest.mark.slow
def test_a_force_at_one_place_only_is_unknown_though_most_of_the_log_fits(tmp_path: Path) -> None:
    """Half of the segments never meet it, so that the median error is the noise."""
    log = log_of(stage(), tmp_path, "train.csv")
    log.inputs[:, 0] -= 6.0 * np.exp(-(((log.positions[:, 0] - 0.1) / 0.01) ** 2))
    spec = stage()
    diagnosis, _ = diagnose_log(spec, system_of(spec), log)
    assert diagnosis.data["level_refit"] < 2.0
    assert diagnosis.verdict == "unknown", diagnosis.sentence
    assert 0.05 < diagnosis.data["share_far"] < 0.5
    assert f"in {100 * diagnosis.data['share_far']:.0f} % of it" in diagnosis.statement.of("evidence")[0]


BUMP = """
import sympy
from codegen.effects import Confusion, Effect, EffectParameter

class Bump(Effect):
    kind = "bump"
    sits_on = "coordinate"
    equation = "e = -p exp(-((x - c)/r)^2)"
    signature = "a push at one place"
    seen_over = "position"
    parameters = (
        EffectParameter("p", "{{F}}", "push", neutral=0.0),
        EffectParameter("c", "{{q}}", "its place", start=lambda covered: [{place}]),
        EffectParameter("r", "{{q}}", "its reach", low=0.0, start=lambda covered: [0.02]),
    )
    confused_with = (Confusion("cogging", "a second place"),)

    def add(self, system, place, p):
        x = system.positions[place]
        return system.with_force(place, -p["p"] * sympy.exp(-((x - p["c"]) / p["r"]) ** 2))

EFFECTS = [Bump()]
"""


@pytest.mark.slow
@pytest.mark.parametrize("place", [0.1, -0.1])
def test_a_user_s_effect_is_found_from_a_start_that_is_off(place: float, tmp_path: Path) -> None:
    """A push of 8 N within 3 cm of x = 0.08 is found from a start near by, and from the other side."""
    before = dict(CATALOGUE)
    path = tmp_path / "bump.py"
    path.write_text(BUMP.format(place=place))
    try:
        load_effects(path)
        diagnosis, _ = diagnosed("[{kind: bump, on: x, parameters: {p: 8, c: 0.08, r: 0.03}}]", tmp_path)
    finally:
        CATALOGUE.clear()
        CATALOGUE.update(before)
    assert [e.kind for e in diagnosis.effects] == ["bump"]
    assert diagnosis.effects[0].parameters == pytest.approx({"p": 8, "c": 0.08, "r": 0.03}, rel=0.01)


@pytest.mark.slow
def test_two_effects_are_found_one_after_the_other(tmp_path: Path) -> None:
    effects = "[{kind: spring, on: x, parameters: {k: 20}}, {kind: viscous, on: rail, parameters: {b: 6}}]"
    diagnosis, _ = diagnosed(effects, tmp_path)
    found = {e.kind: e.parameters for e in diagnosis.effects}
    assert set(found) == {"spring", "viscous"}
    assert found["spring"]["k"] == pytest.approx(20, rel=0.05)
    assert found["viscous"]["b"] == pytest.approx(6, rel=0.05)


@pytest.mark.slow
def test_gain_and_inertia_are_twins_where_nothing_else_acts(tmp_path: Path) -> None:
    lone = STAGE.replace("force: [w - b*v]", "force: [w]").replace("  b: {{value: 6, unit: N*s/m}}\n", "")

    def build(effects: str, level: float, reference: str) -> Spec:
        text = lone.format(effects=effects, level=level, reference=reference, duration=14, noise=0)
        return parse_spec(text, Path("stage.yaml"))

    plant = "[{kind: input_gain, on: w, parameters: {gain: 1.25}}]"
    train = log_of(build(plant, 4.5, TRAIN), tmp_path, "train.csv")
    spec = build("[]", 4.0, TRAIN)
    diagnosis, _ = diagnose_log(spec, system_of(spec), train, log_of(build(plant, 4.5, TEST), tmp_path, "test.csv"))
    (found,) = diagnosis.effects
    assert {(found.kind, found.on), *found.also} == {("input_gain", "w"), ("inertia_error", "x")}
    # 1.25 w = 2 a + λ is w = 1.6 a + λ/1.25.
    gain, delta = (found.parameters.get(name) for name in ("gain", "delta"))
    assert gain == pytest.approx(1.25, rel=0.01) if gain else delta == pytest.approx(-0.4, rel=0.03)


@pytest.mark.slow
def test_the_test_log_has_no_say_in_what_is_found(tmp_path: Path) -> None:
    plant = "[{kind: spring, on: x, parameters: {k: 18}}]"
    train = log_of(stage(plant), tmp_path, "train.csv")
    spec = stage()
    answers = []
    for name, reference in (("a.csv", TEST), ("b.csv", "0.1*sin(2*pi*0.9*t)")):
        test = log_of(stage(plant, 4.0, reference, 9.0), tmp_path, name)
        diagnosis, models = diagnose_log(spec, system_of(spec), train, test)
        answers.append(
            (diagnosis.verdict, diagnosis.effects, diagnosis.candidates, diagnosis.refitted, models.spec_text)
        )
    assert answers[0] == answers[1]
    assert answers[0][0] == "effect"
    # A log of another machine may refuse what was found; it cannot change what was looked at.
    other = log_of(stage("[]", 9.0, TEST, 9.0), tmp_path, "c.csv")
    assert diagnose_log(spec, system_of(spec), train, other)[0].candidates == answers[0][2]


@pytest.mark.slow
def test_without_a_test_log_the_held_out_end_has_no_say_either(tmp_path: Path) -> None:
    spec = stage()
    log = log_of(stage("[{kind: spring, on: x, parameters: {k: 18}}]", reference=TRAIN), tmp_path, "train.csv")
    first, _ = diagnose_log(spec, system_of(spec), log)
    log.inputs[-round(0.25 * log.size) :] *= 1.7
    second, _ = diagnose_log(spec, system_of(spec), log)
    assert first.candidates == second.candidates
    assert first.effects == second.effects
    assert second.augmented.force_rms > 3 * first.augmented.force_rms


@pytest.fixture(scope="module")
def sprung(tmp_path_factory: pytest.TempPathFactory) -> tuple[Diagnosis, Models]:
    return diagnosed("[{kind: spring, on: x, parameters: {k: 18.0}}]", tmp_path_factory.mktemp("sprung"))


def test_json_is_finite_and_complete(sprung: tuple[Diagnosis, Models]) -> None:
    diagnosis, _ = sprung
    content = diagnosis.as_json()
    assert {"verdict", "effects", "candidates", "error", "data"} <= set(content)
    assert set(content["error"]) == {"declared", "refit", "augmented"}
    assert content["effects"][0]["kind"] == "spring"
    assert [c["kind"] for c in content["candidates"]] == [c.kind for c in diagnosis.candidates]
    assert [c["form"] for c in content["candidates"]] == [c.form for c in diagnosis.candidates]
    assert all(np.isfinite(v) for v in asdict(diagnosis.augmented)["force_rms_rows"])


def test_the_augmented_spec_keeps_its_authors_words_and_holds_the_effect(sprung: tuple[Diagnosis, Models]) -> None:
    diagnosis, models = sprung
    text = models.spec_text
    for comment in ("# a stage", "# along the rail", "# from the data sheet", "# what diagnosis adds"):
        assert comment.lstrip("# ") in text, text
    again = parse_spec(text, Path("spec.yaml"))
    assert [(e.kind, e.on) for e in again.effects] == [("spring", ("x",))]
    assert float(again.effects[0].parameters["k"]) == pytest.approx(diagnosis.effects[0].parameters["k"], rel=1e-5)
    assert float(again.contacts[0].parameters["a"]) == pytest.approx(diagnosis.refitted["rail_a"][2], rel=1e-5)


def test_diagnosing_again_with_the_augmented_spec_finds_nothing_more(
    sprung: tuple[Diagnosis, Models], tmp_path: Path
) -> None:
    again = parse_spec(sprung[1].spec_text, Path("spec.yaml"))
    train = log_of(stage("[{kind: spring, on: x, parameters: {k: 18}}]", 4.5), tmp_path, "again.csv")
    second, _ = diagnose_log(again, system_of(again), train)
    assert second.verdict == "none", second.sentence


@pytest.mark.parametrize(("factor", "word"), [(-1.0, "flipped"), (20.0, "scale")])
def test_a_log_that_cannot_be_of_this_spec_gives_no_verdict_on_effects(
    factor: float, word: str, tmp_path: Path
) -> None:
    log = log_of(stage("[{kind: spring, on: x, parameters: {k: 18}}]"), tmp_path, "train.csv")
    log.inputs[:] *= factor
    spec = stage()
    diagnosis, models = diagnose_log(spec, system_of(spec), log)
    assert diagnosis.verdict == diagnosis.as_json()["verdict"] == "unfit"
    assert diagnosis.effects == diagnosis.candidates == ()
    assert diagnosis.statement.headline.startswith("No effect was tested")
    assert word in diagnosis.statement.of("log")[0]
    assert models.spec_text == spec.text


def test_the_training_log_is_no_test_log(tmp_path: Path) -> None:
    log_of(stage(), tmp_path, "train.csv")
    (tmp_path / "stage.yaml").write_text(stage().text)
    with refused("LOG014 train.csv"):
        stiction.diagnose(tmp_path / "stage.yaml", tmp_path / "train.csv", tmp_path / "train.csv", tmp_path / "out")
    assert not (tmp_path / "out").exists()

"""The tolerance of a declared effect: refitted as a parameter with that tolerance, written back, refused elsewhere."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from mechanics.robots import TWO_LINKS

from codegen.app.check import check_json
from codegen.app.derived import Derived
from codegen.base.errors import BadInput
from codegen.diagnosis.case import uncertain_values, values_of_zero
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.results import FoundEffect
from codegen.diagnosis.verdict.augment import augmented_text
from codegen.effects.declare import effect_deviations
from codegen.spec import Spec, parse_spec
from codegen.spec.motion import KinematicTree
from tests.diagnosis.stage import STAGE, TRAIN, log_of, stage, system_of

EFFECT = "{kind: viscous, on: rail, parameters: {b: 6}, tolerance: 20%}"


def staged(effects: str = "[]", b: str = "value: 6", force: str = "w - b*v") -> Spec:
    text = STAGE.format(effects=effects, level=4.0, reference=TRAIN, duration=14, noise=0)
    text = text.replace("b: {value: 6", f"b: {{{b}").replace("[w - b*v]", f"[{force}]")
    return parse_spec(text, Path("stage.yaml"))


def refit(spec: Spec, folder: Path) -> dict[str, float]:
    """The refitted values on a log of a stage whose damping is 7.5 N·s/m and whose level is 4.5 N."""
    log = log_of(stage("[{kind: viscous, on: rail, parameters: {b: 1.5}}]", 4.5), folder, "log.csv")
    system, deviations, _ = uncertain_values(spec, system_of(spec), log)
    motion = smooth_motion(log)
    search = search_on(Problem(system, motion, deviations), partial(record_of, motion, log))
    return {s.name: float(v) for s, v in zip(search.refitted_symbols, search.refit().theta, strict=True)}


def test_it_is_refitted_as_a_parameter_with_that_tolerance(tmp_path: Path) -> None:
    as_parameter = refit(staged(b="value: 6, tolerance: 20%"), tmp_path)
    as_effect = refit(staged(f"[{EFFECT}]", force="w"), tmp_path)
    assert as_effect == pytest.approx({"rail_a": as_parameter["rail_a"], "viscous_rail_b": as_parameter["b"]}, rel=1e-9)
    assert as_effect["viscous_rail_b"] == pytest.approx(7.5, rel=0.01)


def test_a_parameter_of_zero_is_refitted_within_a_tolerance_that_has_a_unit(tmp_path: Path) -> None:
    """A share of zero allows nothing, so b = 0 could only stay."""
    found = refit(staged(b="value: 0, tolerance: 8 N*s/m"), tmp_path)
    assert found["b"] == pytest.approx(7.5, rel=0.02)


def test_the_refitted_value_is_written_into_its_entry() -> None:
    second = "{kind: viscous, on: rail, parameters: {b: 1 N*s/m}, tolerance: 0.5}"
    spec = staged(f"[{EFFECT}, {second}]", force="w")
    system = system_of(spec)
    assert {s.name: size for s, size in effect_deviations(system, spec).items()} == {
        "viscous_rail_b": pytest.approx(1.2),
        "viscous_rail_2_b": pytest.approx(0.5),
    }
    written = parse_spec(augmented_text(spec, [], {"viscous_rail_2_b": 1.25}, system), Path("stage.yaml"))
    assert [float(e.parameters["b"]) for e in written.effects] == [6.0, 1.25]
    assert [e.tolerance for e in written.effects] == [0.2, 0.5]


def test_a_level_that_was_written_with_its_unit_is_replaced() -> None:
    text = stage().text.replace("a: 4.0,", "a: 4 N,")
    spec = parse_spec(text, Path("stage.yaml"))
    written = parse_spec(augmented_text(spec, [], {"rail_a": 4.5}, system_of(spec)), Path("stage.yaml"))
    assert text != stage().text and float(written.contacts[0].parameters["a"]) == 4.5


def test_a_tolerance_of_zero_is_told() -> None:
    spec = staged("[{kind: viscous, on: rail, parameters: {b: 0}, tolerance: 20%}]")
    (told,) = values_of_zero(spec)
    assert told.severity == "warning" and "b of viscous on rail" in told.words


def test_it_is_refused_where_a_refit_would_pass_the_limits_of_a_parameter() -> None:
    """Refitted on a log without these effects: delta = -1.1 and mu = -0.02, which a spec must not have."""
    for effect in (
        "{kind: stribeck, on: rail, parameters: {delta: 0.5, v_s: 0.05}, tolerance: 500 %}",
        "{kind: load_dependent_friction, on: rail, parameters: {mu: 0.05}, tolerance: 500 %}",
    ):
        with pytest.raises(BadInput, match=r"limits of (delta, v_s|mu)\b") as refused:
            system_of(staged(f"[{effect}]"))
        assert refused.value.code == "SPEC021" and "effects[0].tolerance" in str(refused.value)


def test_it_is_refused_where_a_refit_would_pass_the_friction_level() -> None:
    """Refitted on a log with an offset of 6 N above a level of 2 N: d = -6, which ``check`` refuses."""
    with pytest.raises(BadInput, match="friction level") as refused:
        system_of(staged("[{kind: coulomb_asymmetry, on: rail, parameters: {d: 2}, tolerance: 300 %}]"))
    assert refused.value.code == "SPEC021" and "effects[0].tolerance" in str(refused.value)


@pytest.mark.parametrize(("delta", "tolerance", "allowed"), [(0.8, 15, True), (0.8, 150, False), (-0.8, 15, False)])
def test_an_armature_has_a_tolerance_with_which_it_keeps_its_sign(delta: float, tolerance: int, allowed: bool) -> None:
    """A refit keeps the sign of a value that is more than one tolerance from zero (``CrossValidation.justified``)."""
    spec = staged(f"[{{kind: inertia_error, on: x, parameters: {{delta: {delta}}}, tolerance: {tolerance} %}}]")
    if allowed:
        assert list(effect_deviations(system_of(spec), spec).values()) == [pytest.approx(0.12)]
    else:
        with pytest.raises(BadInput, match="an inertia above 0"):
            system_of(spec)


@pytest.mark.parametrize(
    "effect",
    [
        "{kind: input_delay, on: w, parameters: {T: 0.002}, tolerance: 20%}",
        "{kind: stribeck, on: rail, parameters: {delta: 1, v_s: 0.1, exponent: 1.5}, tolerance: 20%}",
        "{kind: compliance, on: x, parameters: {k: 5000, c: 1, load_fraction: 0.5}, tolerance: 20%}",
    ],
)
def test_it_is_refused_where_a_refit_cannot_move_the_parameters(effect: str) -> None:
    with pytest.raises(BadInput) as refused:
        system_of(staged(f"[{effect}]"))
    assert refused.value.code == "SPEC021" and "tolerance" in str(refused.value)


def test_a_robot_files_damping_has_the_tolerance_that_the_spec_gives(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(TWO_LINKS)
    spec = parse_spec("name: arm\nurdf: {file: arm.urdf, tolerance: {damping: 40 %}}\n", tmp_path / "arm.yaml")
    assert isinstance(spec.form, KinematicTree) and spec.form.tolerance is None  # no link parameter is refitted
    system = system_of(spec)
    deviations = {s.name: size for s, size in effect_deviations(system, spec).items()}
    declared = {s.name: float(v) for s, v in system.values.items() if s.name.startswith("viscous")}
    assert declared and deviations == pytest.approx({name: 0.4 * value for name, value in declared.items()})
    name, value = next(iter(declared.items()))
    written = parse_spec(augmented_text(spec, [], {name: 2 * value}, system), tmp_path / "spec.yaml")
    again = {s.name: size for s, size in effect_deviations(system_of(written), written).items()}
    assert again == pytest.approx(deviations | {name: 0.8 * value})
    assert np.isclose(float(system_of(written).values[written.symbol(name)]), 2 * value)


def test_a_tolerance_of_more_than_the_value_is_written_out_as_it_is_read(tmp_path: Path) -> None:
    """It was written as the plain number 2.5, which a spec must not have."""
    (tmp_path / "arm.urdf").write_text(TWO_LINKS)
    spec = parse_spec("name: arm\nurdf: {file: arm.urdf, tolerance: {damping: 250 %}}\n", tmp_path / "arm.yaml")
    written = parse_spec(augmented_text(spec, [], {}, system_of(spec)), tmp_path / "spec.yaml")
    assert [e.tolerance for e in written.effects] == [2.5]


def test_a_tolerance_of_the_damping_is_checked_as_others_are(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(TWO_LINKS)
    with pytest.raises(BadInput) as refused:
        parse_spec("name: arm\nurdf: {file: arm.urdf, tolerance: {damping: 40}}\n", tmp_path / "arm.yaml")
    assert refused.value.code == "SPEC007"


def test_check_shows_the_tolerance_beside_the_value() -> None:
    said = check_json(Derived(staged(f"[{EFFECT}]", force="w")))
    assert said["values"]["viscous_rail_b"] == {"value": 6.0, "unit": "N*s/m", "tolerance": 0.2}
    assert "tolerance" not in said["values"]["rail_a"]


@pytest.mark.parametrize("block", [False, True])
def test_the_note_on_a_refitted_value_stands_behind_its_entry(block: bool) -> None:
    spec = staged(f"[{EFFECT}]", force="w")
    if block:
        listed = "\n  - kind: viscous\n    on: rail\n    parameters: {b: 6}\n    tolerance: 20%\nsimulation:"
        spec = parse_spec(re.sub(r" \[\{kind.*\nsimulation:", listed, spec.text), Path("stage.yaml"))
    text = augmented_text(spec, [], {"viscous_rail_b": 7.5}, system_of(spec))
    (line,) = [line for line in text.splitlines() if "refitted by diagnosis" in line]
    assert "b: 7.5" in line and line.rstrip().endswith("b refitted by diagnosis, was 6")
    assert line.index("}") < line.index("#")
    assert block or line.index("]") < line.index("#")
    assert float(parse_spec(text, Path("stage.yaml")).effects[0].parameters["b"]) == 7.5


FLOW_CONTACTS = "friction: {distribution: [[1]], contacts: [{name: rail, law: coulomb, a: 4.0, unit: N}]}"


def test_the_note_on_a_value_in_brackets_stands_behind_all_of_them() -> None:
    text = staged(f"[{EFFECT}]", force="w").text
    text = re.sub(r"friction:\n.*\n.*\n.*\n", f"{FLOW_CONTACTS} # of the data sheet\n# the next line\n", text)
    spec = parse_spec(text, Path("stage.yaml"))
    lines = augmented_text(spec, [], {"rail_a": 5.0}, system_of(spec)).splitlines()
    (k,) = [k for k, line in enumerate(lines) if "refitted by diagnosis" in line]
    written, _, note = lines[k].partition("#")
    assert written.strip() == FLOW_CONTACTS.replace("a: 4.0", "a: 5.0")
    assert note.strip() == "of the data sheet; a refitted by diagnosis, was 4.0"
    assert lines[k + 1] == "# the next line"


def test_a_note_keeps_the_comment_of_a_value_on_a_line_of_its_own() -> None:
    text = staged(f"[{EFFECT}]", force="w").text
    listed = "- name: rail\n      law: coulomb\n      a: 4.0 # measured cold\n      # of the old rail\n      unit: N"
    spec = parse_spec(re.sub(r"- \{name: rail.*", listed, text), Path("stage.yaml"))
    lines = augmented_text(spec, [], {"rail_a": 5.0}, system_of(spec)).splitlines()
    (k,) = [k for k, line in enumerate(lines) if "refitted by diagnosis" in line]
    assert " ".join(lines[k].split()) == "a: 5.0 # measured cold; a refitted by diagnosis, was 4.0"
    assert lines[k + 1].strip() == "# of the old rail"


def test_a_found_effect_is_added_to_the_declared_one_of_its_kind() -> None:
    """A second `viscous` entry was written next to the declared one: a reader had to add 6 and 1.5 N·s/m himself."""
    spec = staged("[{kind: viscous, on: rail, parameters: {b: 6 N*s/m}}]", force="w")
    found = FoundEffect("viscous", "rail", {"b": 1.5}, {"b": "N*s/m"})
    text = augmented_text(spec, [found], {"rail_a": 4.5}, system_of(spec))
    (effect,) = parse_spec(text, Path("stage.yaml")).effects
    assert float(effect.parameters["b"]) == 7.5 and "b changed by diagnosis, was 6 N*s/m" in text


def test_a_found_coupling_is_added_to_the_declared_one_in_either_order() -> None:
    """`on: [y, x]` and `on: [x, y]` are one place of an effect that acts between two coordinates."""
    text = (Path(__file__).parents[2] / "specs" / "two_mass.yaml").read_text("utf-8")
    declared = "effects: [{kind: coupling, on: [x2, x1], parameters: {c: 6}}]"
    spec = parse_spec(text.replace("effects: []", declared), Path("two.yaml"))
    found = FoundEffect("coupling", "x1, x2", {"c": 1.5}, {"c": "N*s/m"})
    (effect,) = parse_spec(augmented_text(spec, [found], {}, system_of(spec)), Path("two.yaml")).effects
    assert float(effect.parameters["c"]) == 7.5


@pytest.mark.parametrize(
    ("kind", "parameters"), [("viscous", {"b": 1.5, "v_s": 0.2}), ("stribeck", {"delta": 1.0, "v_s": 0.2})]
)
def test_effects_whose_sum_is_no_such_effect_have_their_own_entries(kind: str, parameters: dict[str, float]) -> None:
    """Two Stribeck curves of different widths, or a viscous line and a curve, are no third curve of the same form."""
    declared = {"viscous": "b: 6", "stribeck": "delta: 2, v_s: 0.05"}[kind]
    spec = staged(f"[{{kind: {kind}, on: rail, parameters: {{{declared}}}}}]", force="w")
    text = augmented_text(spec, [FoundEffect(kind, "rail", parameters, {})], {}, system_of(spec))
    assert [e.kind for e in parse_spec(text, Path("stage.yaml")).effects] == [kind, kind]

"""Every fault of a spec in one run: a line each, in the order of the file, and the exit status of one."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.base.errors import BadInput, brief
from codegen.spec import parse_spec
from tests.mechanics.forms import ARM_CONSTRAINTS, swapped

from .command import SPECS, stiction

ONE = (SPECS / "one_mass.yaml").read_text()


def spoilt(*pairs: tuple[str, str]) -> str:
    text = ONE
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def lines_told(folder: Path, text: str) -> list[int]:
    """The line of each message of ``stiction check``, which are all that it says."""
    path = folder / "s.yaml"
    path.write_text(text)
    result = stiction("check", path)
    assert result.code == 2 and result.out == ""
    told = result.err.splitlines()
    assert all(line.startswith(f"error: {path}:") and "; expected " in line for line in told)
    return [int(line.removeprefix(f"error: {path}:").partition(":")[0]) for line in told]


def changed_lines(text: str) -> list[int]:
    return [k for k, (a, b) in enumerate(zip(text.splitlines(), ONE.splitlines(), strict=True), 1) if a != b]


def test_faults_of_form(tmp_path: Path) -> None:
    text = spoilt(
        ("velocity: v, unit: m}", "velocty: v, unit: m}"),
        ("value: 1, unit: kg", "value: one, unit: kg"),
        ("velocity: estimated", "velocity: guessed"),
        ("sample_time: 0.001", "sampel_time: 0.001"),
    )
    assert lines_told(tmp_path, text) == changed_lines(text)


def test_a_value_of_the_wrong_type_hides_no_fault_of_names_and_units(tmp_path: Path) -> None:
    """A number with its unit under `value:` is the commonest slip; units and gains are checked all the same."""
    text = spoilt(
        ("x: {velocity: v, unit: m}", "x: {velocity: v, unit: mm}"),
        ("m: {value: 1, unit: kg}", "m: {value: 1 kg}"),
        ("K_F: 10, K_v: 100", "KF: 10, K_v: 100"),
        ("sample_time: 0.001", "sample_time: [0.001]"),
        ("v: [-5, 5]", "v: 5"),
    )
    assert lines_told(tmp_path, text) == changed_lines(text)


@pytest.mark.parametrize("unit", ["A", "N*m", "m^2", "1/s"])
def test_a_coordinate_that_is_no_position_is_told_at_its_unit(unit: str, tmp_path: Path) -> None:
    """Of a coordinate in A, the mass matrix was said to have a wrong unit."""
    text = spoilt(("velocity: v, unit: m}", f"velocity: v, unit: {unit}}}"))
    assert lines_told(tmp_path, text) == changed_lines(text)
    assert "expected m or rad" in stiction("check", tmp_path / "s.yaml").err


def test_a_wrong_word_in_the_observer_hides_no_fault_elsewhere(tmp_path: Path) -> None:
    """Which gains are known depends on the word, so that nothing else of the observer is reported."""
    text = spoilt(("m: {value: 1, unit: kg}", "m: {value: 1, unit: kgg}"), ("velocity: estimated", "velocity: guessed"))
    assert lines_told(tmp_path, text) == changed_lines(text)


def test_all_missing_sections_of_a_spec_that_is_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "s.yaml"
    path.write_text(ONE[: ONE.index("mass_matrix:")])
    result = stiction("check", path)
    assert result.code == 2
    friction, motion = result.err.splitlines()
    assert "`friction` is missing" in friction and "contacts" in friction and "[SPEC003]" in friction
    assert "`mass_matrix` is missing" in motion and "`force:`" in motion and "[SPEC003]" in motion
    path.write_text(ONE.replace("mass_matrix:", "mas_matrix:").replace("friction:\n", "frictoin:\n"))
    assert stiction("check", path).err.count("is missing") == 0, "misspelt is not missing"


def test_faults_of_names_units_and_numbers(tmp_path: Path) -> None:
    text = spoilt(
        ("name: one_mass", "name: one-mass"),
        ("value: 1, unit: kg", "value: 1, unit: kgg"),
        ("law: coulomb, a: 50, unit: N}", "law: coulomb, a: 50, unit: Nn}"),
    )
    assert lines_told(tmp_path, text) == changed_lines(text)


def test_faults_of_the_sections_behind_the_motion(tmp_path: Path) -> None:
    text = spoilt(
        ("  sample_time: 0.001\n", "  sample_time: -1\n"), ("  v: [-5, 5]", "  v: [5, -5]"), ("  - w\n", "  - w + z\n")
    )
    assert lines_told(tmp_path, text) == changed_lines(text)


def test_faults_of_a_contact_and_of_what_depends_on_it(tmp_path: Path) -> None:
    """A tolerance of a contact is said in one word, in the round that says the observer's faults too."""
    contact = "law: coulomb, a: 50, unit: N}"
    text = spoilt((contact, contact.replace("}", ", tolerance: 10%}")), ("sample_time: 0.001", "sample_time: -1"))
    assert lines_told(tmp_path, text) == changed_lines(text)
    text = spoilt(("law: coulomb, a: 50, unit: N}", "law: stribeck, a: fifty, d: x, unit: N}"))
    assert lines_told(tmp_path, text) == 2 * changed_lines(text)


@pytest.mark.parametrize(
    "other",
    [
        ("x_noise: [-5e-6, 5e-6]", "x_noise: [5e-6, -5e-6]"),
        ("x_noise:", "x_nois:"),
        ("encoder_step: {x: 1e-5}", "encoder_step: {x: -1}"),
        ("  sample_time: 0.001\n", "  sample_time: -1\n"),
    ],
)
def test_faults_of_laws_and_effects_beside_one_in_another_section(other: tuple[str, str], tmp_path: Path) -> None:
    for law in ("law: coulomb, aa: 50,", "law: coulom, a: 50,", "law: coulomb, a: -50,"):
        text = spoilt(("law: coulomb, a: 50,", law), ("effects: []", "effects: [{kind: viscos, on: [x]}]"), other)
        assert sorted({*lines_told(tmp_path, text)}) == changed_lines(text)


def test_a_fault_that_two_parts_see_is_told_once(tmp_path: Path) -> None:
    text = spoilt(("law: coulomb, a: 50, unit: N}", "law: coulomb, a: 50, unit: Nn}"))
    assert lines_told(tmp_path, text) == changed_lines(text)


def test_functions_raise_the_first_with_the_others_in_it() -> None:
    with pytest.raises(BadInput) as told:
        parse_spec(spoilt(("name: one_mass", "name: one-mass"), ("unit: kg", "unit: kgg")), Path("s.yaml"))
    assert told.value.found == "the name `one-mass`"
    assert [fault.found for fault in told.value.others] == ["unit `kgg`"]


def test_a_long_number_is_cut() -> None:
    assert brief(f"the constant {'1234567890' * 12}/7") == "the constant 123456789012 … 7890/7"
    assert brief(str(2**70)) == str(2**70)


def test_only_long_quotations_are_cut_not_what_stands_between_two() -> None:
    words = "the effects are curved over the slip speed, and the bound covers a constant; so long as this is so, use a"
    assert brief(f"run `certify`: {words} `law`") == f"run `certify`: {words} `law`"
    assert brief(f"`{'a' * 150}`") == f"`{'a' * 69} … {'a' * 19}`"


def test_twenty_faults_at_most_are_shown_and_the_rest_counted(tmp_path: Path) -> None:
    path = tmp_path / "s.yaml"
    many = "".join(f"  p{k}: {{value: a, unit: kg}}\n" for k in range(50))
    path.write_text(ONE.replace("parameters:\n", "parameters:\n" + many, 1))
    told = stiction("check", path).err.splitlines()
    assert len(told) == 21 and all(line.startswith("error: ") for line in told[:20])
    assert told[20] == "and 30 more, which are shown once these are corrected"


def test_unknown_words_of_every_section(tmp_path: Path) -> None:
    """A law, an effect and a gain, or a kind of observer, do not depend on each other."""
    effects = ("effects: []", "effects: [{kind: viscos, on: x, parameters: {b: 1}}]")
    law = ("law: coulomb, a: 50", "law: coulom, a: 50")
    text = spoilt(law, effects, ("K_F: 10, K_v: 100", "K_G: 10, K_w: 100"))
    lines = changed_lines(text)
    assert lines_told(tmp_path, text) == [*lines, lines[-1]]
    text = spoilt(law, effects, ("kind: cfo", "kind: cfoo"))
    assert lines_told(tmp_path, text) == changed_lines(text)
    result = stiction("generate", tmp_path / "s.yaml", "-o", tmp_path / "made")
    assert len(result.err.splitlines()) == 3


def test_unknown_parameters_of_laws_and_effects(tmp_path: Path) -> None:
    text = spoilt(("law: coulomb, a: 50", "law: coulomb, b: 50, c: 3"))
    (line,) = changed_lines(text)
    assert lines_told(tmp_path, text) == [line] * 3, "two that are unknown, and one that is missing"
    text = spoilt(("effects: []", "effects: [{kind: viscous, on: y}, {kind: viscous, on: z}]"))
    assert lines_told(tmp_path, text) == changed_lines(text) * 2
    text = spoilt(("effects: []", "effects: [{kind: cogging, on: x}]"))
    assert lines_told(tmp_path, text) == changed_lines(text) * 3
    text = spoilt(("effects: []", "effects: [{kind: cogging, on: x, parameters: {amplitud: 1, period: -1, phase: 0}}]"))
    assert lines_told(tmp_path, text) == changed_lines(text) * 3, "one unknown, one missing, one out of range"


def test_free_gains_are_no_obstacle(tmp_path: Path) -> None:
    law = ("law: coulomb, a: 50", "law: coulom, a: 50")
    text = spoilt(law, ("K_F: 10, K_v: 100", "K_G: {free: [1, 20]}, K_v: 100"))
    assert lines_told(tmp_path, text) == changed_lines(text)


TWO = (SPECS / "two_mass.yaml").read_text()


def test_faults_of_every_formula(tmp_path: Path) -> None:
    """A sign that formulas do not have, an unknown name and a term of another unit, each in an entry of its own."""
    wrong = {
        "[m1, 0]": "[m1², mm]",
        "[0, m2]": "[0, m2³]",
        "-(eta2 + eta3)*x1": "-(eta2 + eta4)*x1",
        "distribution: [[1, 0], [-1, 1]]": "distribution: [[1, 0], [-q, 1]]",
    }
    assert all(old in TWO for old in wrong)
    text = TWO
    for old, new in wrong.items():
        text = text.replace(old, new, 1)
    changed = [k for k, (a, b) in enumerate(zip(text.splitlines(), TWO.splitlines(), strict=True), 1) if a != b]
    assert len(changed) == 4
    assert lines_told(tmp_path, text) == [changed[0], *changed], "both entries of the first row"


def test_units_of_every_row(tmp_path: Path) -> None:
    text = TWO.replace("eta3*x2", "eta3*v2", 1).replace("eta3*x1 - ", "eta3*v1 - ", 1)
    changed = [k for k, (a, b) in enumerate(zip(text.splitlines(), TWO.splitlines(), strict=True), 1) if a != b]
    assert len(changed) == 2
    assert lines_told(tmp_path, text) == changed


def test_faults_of_every_energy(tmp_path: Path) -> None:
    text = (SPECS / "two_link_arm.yaml").read_text()
    spoilt_text = "\n".join(
        line.replace("**2", "²") if line.startswith("    - ") else line for line in text.splitlines()
    )
    lines = [k for k, line in enumerate(spoilt_text.splitlines(), 1) if line.startswith("    - ") and "²" in line]
    assert len(lines) > 1
    assert lines_told(tmp_path, spoilt_text) == lines


def test_faults_of_every_body_force_and_contact(tmp_path: Path) -> None:
    good = swapped("two_link_arm", ARM_CONSTRAINTS)
    wrong = {
        "y: b1*sin(theta1)": "y: b1*sine(theta1)",
        "inertia: I2": "inertia: m2",
        "x: l1*cos(theta1) + b2": "x: l1*cos(theta1) + bb",
        "y: -m1*gravity": "y: -m1*gravitty",
        "y: -m2*gravity": "y: -m2*l1",
        "bodies: upper,": "bodies: uper,",
        "bodies: [fore, upper], along: angle": "bodies: [fore, upper], along: angel",
    }
    text = good
    for old, new in wrong.items():
        assert old in text
        text = text.replace(old, new, 1)
    pairs = zip(text.splitlines(), good.splitlines(), strict=True)
    lines = [k for k, (a, b) in enumerate(pairs, 1) if a != b]
    assert len(lines) == len(wrong)
    (tmp_path / "good.yaml").write_text(good)
    assert stiction("check", tmp_path / "good.yaml").code == 0
    assert lines_told(tmp_path, text) == sorted(lines[:3]), "forces and contacts wait for the bodies that they name"
    for old, new in list(wrong.items())[:3]:
        text = text.replace(new, old, 1)
    assert lines_told(tmp_path, text) == lines[3:5]
    for old, new in list(wrong.items())[3:5]:
        text = text.replace(new, old, 1)
    assert lines_told(tmp_path, text) == lines[5:]

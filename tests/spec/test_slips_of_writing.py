"""Slips of writing that have one likely cause: the message says it, at the line, with what to write."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

import stiction
from codegen.base.errors import BadInput
from codegen.mechanics import build_system
from codegen.spec import parse_spec, read_spec
from codegen.spec.quantity import split_quantity
from codegen.spec.yaml_text import load_mapping
from tests.expected_errors import refused

from .faults import GOOD


def told(text: str) -> BadInput:
    with pytest.raises(BadInput) as caught:
        parse_spec(text, Path("slider.yaml"))
    return caught.value


def told_of_system(text: str) -> BadInput:
    with pytest.raises(BadInput) as caught:
        build_system(parse_spec(text, Path("slider.yaml")))
    return caught.value


def derived(tmp_path: Path, text: str) -> BadInput:
    """What ``derive`` refuses: gains are read once the observer is known."""
    (tmp_path / "slider.yaml").write_text(text)
    with pytest.raises(BadInput) as caught:
        stiction.derive(tmp_path / "slider.yaml")
    return caught.value


@pytest.mark.parametrize(
    ("text", "line", "quoted"),
    [
        ("columns: {phi: axes[0].pos, th: q}\n", 1, '`phi: "axes[0].pos"`'),
        ("columns: {th: q, phi: axes[0].pos}\n", 1, '`phi: "axes[0].pos"`'),
        ("columns:\n  {th: q,\n   phi: q[1]}\n", 3, '`phi: "q[1]"`'),
        ("columns: {q: a[0].b[1].c}\n", 1, '`q: "a[0].b[1].c"`'),
        ("columns: [t, q[0]]\n", 1, '`"q[0]"`'),
    ],
)
def test_brackets_in_braces_need_quotes(text: str, line: int, quoted: str) -> None:
    with refused("SPEC001") as fault:
        load_mapping(text, "meta.yaml")
    assert fault.value.place.line == line
    assert quoted in fault.value.expected
    assert "not closed" not in str(fault.value)
    written = quoted.strip("`")
    value = written.rpartition(": ")[2].strip('"')
    assert value in str(load_mapping(text.replace(value, f'"{value}"'), "meta.yaml")[0])


def test_a_slip_is_not_sought_in_a_long_line() -> None:
    """The pattern of a bracket in a value tries each of its letters as the first one; it took 10 s of this line."""
    start = time.process_time()
    with refused("SPEC001"):
        load_mapping(f"columns: {{q: {'a ' * 40_000}[0\n", "meta.yaml")
    assert time.process_time() - start < 5


@pytest.mark.parametrize("text", ["a: [1, 2\nb: 3\n", "a: {b: 1\nc: 2\n"])
def test_brackets_that_are_not_closed(text: str) -> None:
    with refused("SPEC001") as fault:
        load_mapping(text, "meta.yaml")
    assert "not closed" in fault.value.found


@pytest.mark.parametrize(
    ("old", "new", "line", "right"),
    [
        ("  mass: {value: 2, unit: kg}", "  mass:\n    value: 0,05\n    unit: kg", 10, "`0.05`"),
        ("  mass: {value: 2, unit: kg}", "  mass: 0,05 kg", 9, "`0.05 kg`"),
        ("sample_time: 0.001", "sample_time: 0,5 ms", 29, "`0.5 ms`"),
        ("sample_time: 0.001", "sample_time: 0,0005", 29, "`0.0005`"),
        ("w - k*x", "w - 0,05*k*x", 18, "`0.05`"),
        ("w - k*x", "w - k*x*sin(0,5*q)", 18, "`0.5`"),
        ("- [mass, 0]", "- ['1,5*mass', 0]", 15, "`1.5`"),
        (
            "    - {name: rail, law: coulomb, a: 5, unit: N}",
            "    - name: rail\n      a: 0,5\n      unit: N",
            24,
            "`0.5`",
        ),
        ("value: 2,", "value: 2, tolerance: '0,5%',", 9, "`0.5`"),
        ("  mass: {value: 2, unit: kg}", "  mass:\n    value: 1,000\n    unit: kg", 10, "`1000`"),
    ],
)
def test_a_decimal_comma(old: str, new: str, line: int, right: str) -> None:
    fault = told(GOOD.replace(old, new))
    assert "a decimal comma" in fault.found
    assert "a decimal point" in fault.expected
    assert right in fault.expected
    assert fault.place.line == line


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("a: 5,", "a: \N{FULLWIDTH DIGIT FIVE},"),
        ("value: 2,", "value: 1.\N{ARABIC-INDIC DIGIT FIVE},"),
        ("value: 2,", "value: 2, tolerance: \N{FULLWIDTH DIGIT FIVE}%,"),
        ("sample_time: 0.001", "sample_time: \N{DEVANAGARI DIGIT ONE} ms"),
        ("x: [-1, 1]", "x: [-1, \N{FULLWIDTH DIGIT ONE}]"),
    ],
)
def test_digits_of_another_script_are_refused(old: str, new: str) -> None:
    """A level of friction of full-width 5 N was 0 N: Python reads such digits, and none of them is one of 1 to 9."""
    assert GOOD.count(old) == 1
    text = GOOD.replace(old, new)
    fault = told(text)
    assert fault.code == "SPEC006" and " DIGIT " in fault.found
    assert fault.place.line == 1 + text[: text.index(new)].count("\n")


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("K_F: 10", "K_F: {free: 10, 100}", 28),
        ("K_F: 10", "K_F: {free: 10,100}", 28),
        ("  x: [-1, 1]", "  {x: -1, 1}", 31),
    ],
)
def test_a_range_without_brackets(old: str, new: str, line: int) -> None:
    assert GOOD.count(old) == 1
    assert {fault.place.line for fault in told(GOOD.replace(old, new)).all} == {line}


@pytest.mark.parametrize("text", ["a:\n  b: 1\n   c: 2\n  d: 3\n", "a:\n  b: 1 #\n   c: 2\n  d: 3\ne: 4\n"])
def test_a_later_key_that_is_indented_too_far_is_named_at_its_line(text: str) -> None:
    with refused("SPEC001") as fault:
        load_mapping(text, "meta.yaml")
    assert fault.value.place.line == 3


@pytest.mark.parametrize(("written", "bold"), [("*bold* text", True), ("*bold*", True), ("*name", False)])
def test_emphasis_is_text_in_quotes(written: str, bold: bool) -> None:
    fault = told(GOOD.replace("source: a test", f"source: {written}"))
    assert fault.place.line == 2 and fault.code == "SPEC002"
    assert ("a text that begins with `*`" in fault.found) == bold and '"*' in fault.expected


def test_a_comma_between_arguments_is_no_decimal_comma() -> None:
    fault = told(GOOD.replace("w - k*x", "w - hypot(3,4)*k"))
    assert "decimal" not in str(fault)
    assert "`hypot`" in fault.found


@pytest.mark.parametrize(
    ("rows", "words", "line"),
    [
        ("  - [mass, 0]\n  - [0]\n", "2 rows, of which row 2 has 1 entry", 16),
        ("  - [mass]\n  - [0, J]\n", "2 rows, of which row 1 has 1 entry", 15),
        ("  - [mass, 0, 0]\n  - [0]\n", "2 rows, of which row 1 has 3 entries, row 2 has 1 entry", 15),
        ("  - [mass]\n  - [0]\n", "2 rows of 1", 14),
    ],
)
def test_a_ragged_matrix_names_its_row(rows: str, words: str, line: int) -> None:
    fault = told(GOOD.replace("  - [mass, 0]\n  - [0, J]\n", rows))
    assert fault.found == words
    assert fault.place.line == line


@pytest.mark.parametrize(("written", "meant"), [("sign", "sgn"), ("fabs", "abs"), ("ln", "log"), ("sinn", "sin")])
def test_a_function_by_its_name_elsewhere(written: str, meant: str) -> None:
    assert told(GOOD.replace("w - k*x", f"w - k*x*{written}(q)")).nearest == meant


def test_an_unknown_gain_is_the_missing_one(tmp_path: Path) -> None:
    assert derived(tmp_path, GOOD.replace("K_F: 10, K_v", "K_2: 10, K_v")).nearest == "K_F"
    assert derived(tmp_path, GOOD.replace("K_F: 10, K_v", "K_F: 10, K_f")).nearest == "K_v"


@pytest.mark.parametrize(
    ("written", "quoted"), [("x^^2", "`^2`"), ("x^2 + 3*(x^^2)", "`^2)`"), ("x^2**v", "`2**v`"), ("x^v", "`x^v`")]
)
def test_a_power_is_quoted_as_it_is_written(written: str, quoted: str) -> None:
    found = told(GOOD.replace("w - k*x", f"w - {written}")).found
    assert quoted in found
    assert "****" not in found


def test_a_file_in_another_encoding_is_named_by_line(tmp_path: Path) -> None:
    path = tmp_path / "slider.yaml"
    path.write_bytes(GOOD.replace("source: a test", "source: Prüfstand").encode("windows-1252"))
    with refused("FILE006 slider.yaml:2") as fault:
        read_spec(path)
    assert "save it as UTF-8" in fault.value.expected


def test_unknown_keys_and_faults_of_units_come_in_one_run() -> None:
    """Keys were reported first, and units only once these were right."""
    text = """name: axis
coordinates: {x: {velocity: v, unit: m}}
inputs: {u: {unit: N}}
parameters: {m: {value: 79, unit: kgg}, b: {value: 3, unit: N*s/m, toleranc: 5%}}
mass_matrix: [[m]]
force: [u - b*v]
friction: {distribution: [[1]], contacts: [{name: guide, law: coulomb, a: 3, unit: N}]}
observer: {kind: gcfo, velocity: estimated, gains: {K_F: 600, K_v: 200}, sample_tim: 1 ms}
"""
    fault = told(text)
    found = {one.found for one in (fault, *fault.others)}
    assert found == {"unknown key `toleranc`", "unknown key `sample_tim`", "unit `kgg`"}


@pytest.mark.parametrize(
    ("old", "new", "shown"),
    [
        ("w - k*x", "w - k x", "SPEC010 `*`"),
        ("w - k*x", "w - 2x", "SPEC010 `*`"),
        ("w - k*x", "w - (k*(x + 1)", "SPEC010 `(`"),
        ("w - k*x", "w - k*x)", "SPEC010 `)`"),
        ("  x: [-1, 1]", "  x: 5 mm", "SPEC006 [low"),
        ("  x: [-1, 1]", "  x: [5, -5]", "SPEC007 [-5, 5]"),
        ("name: slider", "name: my-slider", "SPEC009 'my_slider'"),
    ],
)
def test_what_was_meant_is_shown(old: str, new: str, shown: str) -> None:
    assert old in GOOD
    with refused(shown):
        parse_spec(GOOD.replace(old, new, 1), Path("slider.yaml"))


def test_an_unknown_name_of_the_envelope_is_told_which_there_are() -> None:
    fault = told(GOOD.replace("  x: [-1, 1]", "  velocity: [-5, 5]"))
    assert fault.code == "SPEC008" and " v," in fault.expected and "x," in fault.expected


def test_a_tolerance_of_a_contact_is_none_by_any_name() -> None:
    for key in ("tol", "tolerance", "tolerence"):
        fault = told(GOOD.replace("name: rail, ", f"name: rail, {key}: 5%, "))
        assert fault.code == "SPEC004" and f"`{key}`" in fault.found and not fault.others


@pytest.mark.parametrize("space", ["\u00a0", "\u3000"])
def test_a_space_that_yaml_does_not_take_as_indentation(space: str) -> None:
    fault = told(GOOD.replace("  J: {", f"{space}{space}J: {{"))
    assert fault.place.line == 10
    assert f"U+{ord(space):04X}" in fault.found and "space" in fault.expected


def test_two_documents_in_a_file() -> None:
    fault = told(f"{GOOD}---\n{GOOD}")
    assert fault.found == "a second document, behind `---`"
    assert fault.place.line == len(GOOD.splitlines()) + 1


def test_a_parameter_of_an_effect_beside_its_kind() -> None:
    effect = "effects: [{kind: cogging, on: x, amplitude: 3}]\nobserver:"
    fault = told(GOOD.replace("observer:", effect))
    assert fault.place.key == "effects[0].amplitude"
    assert "`parameters: {amplitude: …}`" in fault.expected


def test_a_division_by_a_parameter_that_is_zero() -> None:
    fault = told_of_system(GOOD.replace("[mass, 0]", "[mass + J/r**2, 0]").replace("r: {value: 1,", "r: {value: 0,"))
    assert fault.place.line == 15
    assert "`J/r**2 + mass`" in fault.found and "r = 0 m" in fault.found


def test_a_colon_in_a_text_needs_quotes_and_no_comma() -> None:
    fault = told(GOOD.replace("source: a test", "source: own machine: a test"))
    assert fault.place.line == 2
    assert "comma" not in str(fault) and "quotes" in fault.expected


def test_an_entry_of_a_list_without_its_blank() -> None:
    fault = told(GOOD.replace("  - w - k*x\n  - -J*om/tau", "  - w - k*x\n  -J*om/tau"))
    assert fault.place.line == 19
    assert fault.found == "`-J*om/tau` without a blank behind the dash" and fault.expected == "`- J*om/tau`"


@pytest.mark.parametrize("written", ["1'200", "1 200.5", "50:1", "100/2"])
def test_a_number_that_is_none(written: str) -> None:
    fault = told(GOOD.replace("value: 2,", f"value: {written},"))
    assert "without a formula, unit or separators" in fault.expected and "beside it" not in fault.expected


def test_a_suggested_name_is_no_macro_either() -> None:
    """`fmi2Mass_` was suggested for `fmi2Mass`, and refused in its turn."""
    text = GOOD.replace("  mass: {", "  fmi2Mass: {")
    assert "macro" in told(text).found and told(text).nearest is None
    assert told(GOOD.replace("  mass: {", "  double: {")).nearest == "double_"


@pytest.mark.parametrize(
    ("good", "bad"),
    [
        ("{value: 30, unit: N/m}", "{value: 30,5, unit: N/m}"),
        ("{value: 30, unit: N/m}", "{value:30, unit: N/m}"),
        ("{value: 30, unit: N/m}", "{value=30, unit: N/m}"),
        ("{value: 30, unit: N/m}", "{value: 30, unit: N/m, tolerance: 2,5 %}"),
        ("gains: {K_F: 10,", "gains: {K_F: 10,5,"),
    ],
)
def test_a_key_that_is_no_name_is_told_how_keys_and_numbers_are_written(good: str, bad: str) -> None:
    """A decimal comma ends a value within braces, and the digits behind it are a key; so is `value:30`."""
    fault = told(GOOD.replace(good, bad))
    assert fault.place.line == 1 + GOOD[: GOOD.index(good)].count("\n")
    assert "a key is a name with `: ` behind it, and a number has a decimal point" in fault.expected


@pytest.mark.parametrize(
    ("good", "bad", "shape"),
    [
        ("mass_matrix:\n  - [mass, 0]\n  - [0, J]\n", "mass_matrix: mass\n", "`mass_matrix: [[m1, 0], [0, m2]]`"),
        (
            "mass_matrix:\n  - [mass, 0]\n  - [0, J]\n",
            "mass_matrix: [mass, 0; 0, J]\n",
            "`mass_matrix: [[m1, 0], [0, m2]]`",
        ),
        ("distribution: [[1, 0], [0, 1]]", "distribution: 1", "`distribution: [[1, 0], [0, 1]]`"),
        ("force:\n  - w - k*x\n  - -J*om/t0\n".replace("t0", "tau"), "force: w - k*x\n", "`force: [w - k*x]`"),
        ("gains: {K_F: 10, K_v: 100}", "gains: 10", "`gains: {K_F: 10, K_v: 100}`"),
        ("envelope:\n  x: [-1, 1]\n", "envelope:\n", "`envelope: {v: [-5, 5]}`"),
    ],
)
def test_a_list_or_mapping_is_shown_in_the_form_that_the_section_has(good: str, bad: str, shape: str) -> None:
    assert good in GOOD
    assert shape in told(GOOD.replace(good, bad)).expected


def test_a_fortran_exponent_is_no_unit() -> None:
    """`unit: d2` beside the value, as the message proposed, is refused in turn."""
    fault = told(GOOD.replace("{value: 30, unit: N/m}", "{value: 3.5d2, unit: N/m}"))
    assert fault.found == "`3.5d2`"
    assert fault.expected.startswith("a number alone, such as 350 or 3.5e-6")
    assert told(GOOD.replace("x: [-1, 1]", "x: [-1d-6, 1]")).found == "`-1d-6`"
    assert split_quantity("3 d") == ("3", "d")  # a day


def test_a_key_less_indented_than_those_below_is_told_of_indentation() -> None:
    fault = told(GOOD.replace("  velocity: estimated", "velocity: estimated"))
    assert "indentation" in fault.expected


def test_one_entry_is_in_the_singular_and_a_greek_name_is_told_which_letters() -> None:
    assert told(GOOD.replace("  - w - k*x\n", "")).found == "1 entry"
    assert "letters a to z" in told(GOOD.replace("  w: {unit: N}", "  τ: {unit: N}")).expected


@pytest.mark.parametrize(
    ("good", "bad", "place"),
    [
        ("  sample_time: 0.001\n", "sample_time: 0.001\n", "`sample_time:` belongs under `observer:` or `simulation:`"),
        ("envelope:\n  x: [-1, 1]", "  envelope: {x: [-1, 1]}", "`envelope:` belongs at the beginning of a line"),
        ("name: slider", "name: slider\nunit: kg", "one of cancellation, "),  # a key of entries, in no single section
    ],
)
def test_a_key_in_the_wrong_section_is_told_the_right_one(good: str, bad: str, place: str) -> None:
    fault = told(GOOD.replace(good, bad))
    words = [f.expected for f in (fault, *fault.others) if f.found.startswith("unknown key")]
    assert len(words) == 1
    assert place in words[0]
    assert ("belongs" in words[0]) == ("belongs" in place)


@pytest.mark.parametrize(
    ("good", "bad"),
    [("mass_matrix:", "m\u0430ss_matrix:"), ("name: slider", "name: slid\u0430r"), ("w - k*x", "\u0430 - k*x")],
)
def test_a_letter_that_only_looks_latin_is_named(good: str, bad: str) -> None:
    """A Cyrillic a is printed as a Latin one: `mass_matrix` would be an unknown key, with `mass_matrix` proposed."""
    assert "CYRILLIC SMALL LETTER A" in told(GOOD.replace(good, bad)).found


OBSERVED = """name: axis
coordinates: {x: {velocity: v, unit: m}}
inputs: {u: {unit: N}}
parameters: {m: {value: 79, unit: kg}}
mass_matrix: [[m]]
force: [u]
friction: {distribution: [[1]], contacts: [{name: guide, law: coulomb, a: 3, unit: N}]}
observer: {kind: gcfo, velocity: estimated, gains: {K_F: 600, K_v: 200}, sample_time: 1 ms}
"""


@pytest.mark.parametrize(
    ("written", "meant"), [("1 kHz", "1 ms"), ("500 Hz", "2 ms"), ("3 1/s", "333.333 ms"), ("2 ms^-1", "0.5 ms")]
)
def test_a_rate_for_a_sample_time_is_answered_with_the_time(written: str, meant: str) -> None:
    fault = told(OBSERVED.replace("1 ms", written))
    assert fault.nearest == meant and fault.code == "SPEC014"


@pytest.mark.parametrize("written", ["60 rpm", "3 rad/s", "-1 kHz", "0 Hz", "1 m"])
def test_no_time_is_proposed_for_what_is_no_rate_of_samples(written: str) -> None:
    """60 rpm was answered with 159 ms, as an angle is a number in SI."""
    fault = told(OBSERVED.replace("1 ms", written))
    assert fault.nearest is None and fault.code == "SPEC014"


def test_all_faults_of_the_observer_are_raised_together() -> None:
    """One was raised in a run, so that a new user ran `check` again for each."""
    other = OBSERVED.replace("1 ms", "1 kHz, h: s^, laws: {rail: {law: coulomb, a: 1}}")
    fault = told(other)
    keys = {str(one.place).split(": ")[-1] for one in (fault, *fault.others)}
    assert keys == {f"observer.{x}" for x in ("sample_time", "h", "laws.rail")}


def test_a_wrong_unit_of_a_coordinate_does_not_hide_the_observer_s_faults() -> None:
    fault = told(OBSERVED.replace("unit: m}", "unit: deg}").replace("1 ms", "1 kHz"))
    assert {one.code for one in (fault, *fault.others)} == {"SPEC014"} and len(fault.others) == 1


def test_a_parameter_in_percent_is_answered_with_its_number() -> None:
    fault = told(OBSERVED.replace("m: {value: 79, unit: kg}", "m: {value: 79, unit: kg}, eta: {value: 80, unit: '%'}"))
    assert fault.nearest == "value: 0.8, unit: 1" and fault.code == "SPEC013"

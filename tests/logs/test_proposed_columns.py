"""Columns that are called otherwise: which are proposed, and that the proposed lines read the log; units in names."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from slider_log import rows

from codegen.base.errors import BadInput
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.logs import read_log
from codegen.logs.audit.preflight import preflight
from codegen.spec.reader import parse_spec
from tests.expected_errors import matches, refused

MOTOR = """name: motor
coordinates: {phi: {velocity: om, unit: rad}}
inputs: {i: {unit: A}}
parameters: {J: {value: 2, unit: kg*m^2}, k: {value: 1, unit: N*m/A}}
mass_matrix: [[J]]
force: [k*i]
friction: {distribution: [[1]], contacts: [{name: bearing, a: 3, unit: N*m}]}
"""
PROPOSED = {
    "t,phi,current_A": {"i": "current_A"},
    "t,phi_deg,current_A": {"phi": "phi_deg", "i": "current_A"},
    "t,pos_deg,motor": {"phi": "pos_deg", "i": "motor"},
    "t,Angle,motorCurrent": {"phi": "Angle", "i": "motorCurrent"},
    "t,phi,Strom": {"i": "Strom"},
    "t,Ist_Lage,Ist_Strom,Temp": {"phi": "Ist_Lage", "i": "Ist_Strom"},
    "t,Soll_Lage,Ist_Lage,Strom": {"phi": "Ist_Lage", "i": "Strom"},
    "zeit_ms,phi,I": {"i": "I"},
    "clock_s,phi,i": {"t": "clock_s"},
    "t,ref_angle,angle [deg],i": {"phi": '"angle [deg]"'},
    "t,Position,Position Error,Target Pos,motorCurrent": {"phi": "Position", "i": "motorCurrent"},
    "t,phi,Current,current_limit": {"i": "Current"},
}
NOT_TOLD = ("t,phi,a,b", "t,phi,left_A,right_A", "t,phi,flow_mm", "t,phi,input_current,load", "t,phi,battery_A,load")
"""The last two have the current of the supply; of a servo, `u: input_volts` was proposed."""


@pytest.fixture
def motor():
    return parse_spec(MOTOR, Path("motor.yaml"))


def test_a_name_with_a_degree_sign_is_proposed_as_it_is_written(tmp_path, motor):
    """It was proposed as `angle [\\u00b0]`."""
    path = write(tmp_path, "t,angle [°],Strom [mA]")
    with refused("LOG003") as caught:
        read_log(path, motor)
    assert '`columns: {phi: "angle [°]", i: "Strom [mA]"}` in meta.yaml' in caught.value.expected


def test_a_letter_that_only_looks_like_that_of_the_symbol_is_named(tmp_path, motor):
    """The column and the symbol were printed the same, without a reason why the one is not the other."""
    with refused("LOG003 `\N{CYRILLIC SMALL LETTER BYELORUSSIAN-UKRAINIAN I}` CYRILLIC"):
        read_log(write(tmp_path, "t,phi,\N{CYRILLIC SMALL LETTER BYELORUSSIAN-UKRAINIAN I}"), motor)
    with refused("LOG003 `Prüfstrom`") as told:
        read_log(write(tmp_path, "t,phi,Prüfstrom"), motor)
    assert "LETTER" not in str(told.value)


def write(tmp_path: Path, header: str) -> Path:
    made = rows(2.0)
    columns = [made[name] for name in ("t", "x", "w", "w", "w")[: header.count(",") + 1]]
    lines = [",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)]
    path = tmp_path / "a.csv"
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


@pytest.mark.parametrize("header", PROPOSED)
def test_the_proposed_line_reads_the_log(tmp_path, motor, header):
    path = write(tmp_path, header)
    with refused("LOG003") as caught:
        read_log(path, motor)
    (line,) = re.findall(r"`(columns: \{.*?\})`", caught.value.expected)
    said = dict(re.findall(r'(\w+): ("[^"]*"|[^,}{]+)', line.removeprefix("columns: ")))
    assert said == PROPOSED[header]
    assert "did you mean" not in str(
        caught.value
    )  # the proposal is said once; --json has it as the nearest right thing
    assert caught.value.nearest in {said[symbol].strip('"') for symbol in said}
    (tmp_path / "meta.yaml").write_text(line + "\n")
    assert read_log(path, motor).size > 2
    (tmp_path / "meta.yaml").unlink()
    (option,) = re.findall(r", or `(--column .*?)` \(", caught.value.expected)
    words = shlex.split(option)
    assert words[::2] == ["--column"] * len(said)
    assert read_log(path, motor, columns=dict(word.split("=", 1) for word in words[1::2])).size > 2


def test_a_column_that_nothing_tells_is_asked_for_as_an_option_too(tmp_path, motor):
    """A description that is of another log is named, with the option that replaces it."""
    path = write(tmp_path, "t,phi,a,b,c")
    with refused("LOG003 `i` `--column i=...`"):
        read_log(path, motor)
    (tmp_path / "meta.yaml").write_text("columns: {i: Strom}\n")
    with refused("LOG003 `Strom` meta.yaml `--description`"):
        read_log(path, motor)
    with refused("LOG003 `Strom`") as caught:
        read_log(path, motor, columns={"i": "Strom"})
    assert "--description" not in caught.value.expected and "--column i=" not in caught.value.expected


def test_where_not_every_column_is_proposed_the_form_of_the_option_is_said(tmp_path, motor):
    """A log in German: the current is proposed by its unit, the angle by nothing."""
    with refused("LOG003 `phi` `i` `columns: {i: Strom_mA, phi: ...}` `--column phi=...` for each"):
        read_log(write(tmp_path, "t,Geber,Strom_mA,b"), motor)


def test_row_numbers_are_no_time(tmp_path, motor):
    """A log at 500 Hz with numbers of rows: asked for is the sample time, and the column is not offered as a time."""
    path = write(tmp_path, "Sample,pos_deg,current_A")
    with refused("LOG003") as caught:
        read_log(path, motor)
    assert matches(caught.value, "LOG003 `t` `sample_time: SECONDS` pos_deg current_A")
    assert "t: " not in caught.value.expected.partition("it has")[0]


@pytest.mark.parametrize("header", ["phi,axis.0.vel,i", "phi,Speed [rad.s],i"])
def test_a_speed_is_not_proposed_as_the_time(tmp_path, motor, header):
    """It was: as the only column left, or since `rad.s` has the dimension of a time."""
    path = write(tmp_path, header)
    with refused("LOG003") as caught:
        read_log(path, motor)
    assert "`columns: {t: ...}` (or `sample_time: SECONDS` in place of t)" in caught.value.expected


def test_row_numbers_are_no_position(tmp_path, motor):
    path = write(tmp_path, "t,om,i,Sample")
    with refused("LOG003") as caught:
        read_log(path, motor)
    assert "`columns: {phi: ...}`" in caught.value.expected and "`columns: {phi: none}`" in caught.value.expected


@pytest.mark.parametrize("header", NOT_TOLD)
def test_nothing_is_proposed_where_nothing_tells(tmp_path, motor, header):
    with pytest.raises(BadInput) as caught:
        read_log(write(tmp_path, header), motor)
    assert matches(caught.value, "LOG003 `i`") and "i: ..." in caught.value.expected and caught.value.nearest is None


def test_a_unit_that_nothing_reads_from_the_name_is_proposed_with_the_column(tmp_path, spec):
    path = write(tmp_path, "t,rail_inch,w")
    with refused("LOG003 `columns: {x: rail_inch}` `units: {x: inch}`"):
        read_log(path, spec)
    (tmp_path / "meta.yaml").write_text("columns: {x: rail_inch}\nunits: {x: inch}\n")
    assert abs(read_log(path, spec).positions).max() == pytest.approx(2.54e-3, rel=1e-3)


def test_a_speed_stands_for_its_position_beside_a_current_of_another_name(tmp_path, motor):
    with refused("LOG003 `i`") as caught:
        read_log(write(tmp_path, "t,om,current_A"), motor)
    assert "phi" not in caught.value.found
    log = read_log(tmp_path / "a.csv", motor, columns={"i": "current_A"})
    assert log.velocities is not None


def test_a_unit_of_a_name_is_told_where_it_makes_the_log_too_short(tmp_path, motor):
    """Seconds in a column called time_ms: the name is believed, and every message that rests on it says so."""
    log = read_log(write(tmp_path, "time_ms,phi,i"), motor)
    assert log.sample_time == pytest.approx(2e-6)
    assert len([note for note in log.notes if "time_ms" in note and "`units: {t: s}`" in note]) == 1
    findings = preflight(log, motor)
    assert any(f.topic == "reading" and "`time_ms`" in f.words for f in findings)
    with refused("LOG009 `time_ms`"):
        smooth_motion(log)
    (tmp_path / "meta.yaml").write_text("units: {t: s}\n")
    log = read_log(tmp_path / "a.csv", motor)
    assert log.sample_time == pytest.approx(2e-3) and not log.raw_data.inferred_units


TWO = """name: pair
coordinates: {phi: {velocity: om, unit: rad}, psi: {velocity: nu, unit: rad}}
inputs: {t_a: {unit: N*m}, t_b: {unit: N*m}}
parameters: {J: {value: 2, unit: kg*m^2}}
mass_matrix: [[J, 0], [0, J]]
force: [t_a, t_b]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts: [{name: left, a: 3, unit: N*m}, {name: right, a: 3, unit: N*m}]
"""


def written(folder: Path, names: tuple[str, ...], ending: str) -> Path:
    """The same five columns as a text table, arrays of NumPy, an object of lists or a list of records."""
    made = rows(2.0)
    columns = dict(zip(names, (made[name] for name in ("t", "x", "x", "w", "w")), strict=True))
    path = folder / f"a.{ending}"
    match ending:
        case "csv":
            lines = [",".join(f"{value:.9g}" for value in row) for row in zip(*columns.values(), strict=True)]
            path.write_text("\n".join([",".join(names), *lines]) + "\n")
        case "npz":
            np.savez(path, **columns)
        case "json":
            path.write_text(json.dumps({name: list(map(float, values)) for name, values in columns.items()}))
    return path


@pytest.mark.parametrize(
    ("names", "line"),
    [
        (("t", "a", "b", "c", "d"), "columns: {phi: ..., psi: ..., t_a: ..., t_b: ...}"),
        (("t", "pos1", "pos2", "tau1", "tau2"), "columns: {phi: pos1, psi: pos2, t_a: tau1, t_b: tau2}"),
        (("t", "pos_2", "pos_10", "tau_2", "tau_10"), "columns: {phi: pos_2, psi: pos_10, t_a: tau_2, t_b: tau_10}"),
        (("t", "q1", "q2", "u1", "u2"), "columns: {phi: q1, psi: q2, t_a: u1, t_b: u2}"),
        (("t", "q1", "q2", "c", "d"), "columns: {phi: q1, psi: q2, t_a: ..., t_b: ...}"),
        (("t", "q1", "q2", "u1_mV", "u2_mV"), "columns: {phi: q1, psi: q2, t_a: ..., t_b: ...}"),
        (("t", "ref_pos1", "ref_pos2", "u1", "u2"), "columns: {phi: ..., psi: ..., t_a: ..., t_b: ...}"),
    ],
)
def test_every_format_names_all_missing_columns_and_a_line_for_them(tmp_path, names, line):
    """A table of NumPy and of JSON named one at a time, where nothing told which columns they are."""
    pair, said = parse_spec(TWO, Path("pair.yaml")), set()
    for ending in ("csv", "npz", "json"):
        with refused("LOG003 `phi`, `psi`, `t_a`, `t_b`") as caught:
            read_log(written(tmp_path, names, ending), pair)
        assert f"`{line}` in meta.yaml" in caught.value.expected
        said.add(caught.value.expected)
    assert len(said) == 1


def test_a_table_without_names_is_asked_for_all_numbers(tmp_path):
    np.save(tmp_path / "a.npy", np.random.default_rng(1).normal(size=(3000, 5)))
    with refused("LOG003 {t: NUMBER, phi: NUMBER, `sample_time: SECONDS` NUMBER from 1 to 5"):
        read_log(tmp_path / "a.npy", parse_spec(TWO, Path("pair.yaml")))


def test_elements_of_lists_in_records_are_proposed_by_their_numbers(tmp_path):
    made = rows(2.0)
    records = [
        {"t": float(t), "axes": [{"pos": float(x), "trq": float(w)}, {"pos": float(x), "trq": float(w)}]}
        for t, x, w in zip(made["t"], made["x"], made["w"], strict=True)
    ]
    (tmp_path / "a.json").write_text(json.dumps(records))
    pair = parse_spec(TWO, Path("pair.yaml"))
    with refused("LOG003") as caught:
        read_log(tmp_path / "a.json", pair)
    (line,) = re.findall(r"`(columns: \{.*?\})`", caught.value.expected)
    assert line.startswith('columns: {phi: "axes[0].pos", psi: "axes[1].pos"')
    (tmp_path / "meta.yaml").write_text(line + "\n")
    assert read_log(tmp_path / "a.json", pair).size > 2


def test_a_unit_that_two_variables_have_assigns_its_column_to_neither(tmp_path: Path) -> None:
    """Motor and link are both in rad: a column in deg may be either, and so may the one that is left."""
    spec = parse_spec(
        MOTOR.replace("{phi:", "{psi: {velocity: om2, unit: rad}, phi:")
        .replace("[[J]]", "[[J, 0], [0, J]]")
        .replace("[k*i]", "[k*i, 0]")
        .replace("[[1]]", "[[1], [0]]"),
        tmp_path / "motor.yaml",
    )
    log = tmp_path / "log.csv"
    log.write_text("t,enc_motor,link_deg,i_mA\n" + "".join(f"{k / 1000},{k},{k},{k}\n" for k in range(300)))
    with pytest.raises(BadInput) as told:
        read_log(log, spec)
    assert "i: i_mA" in str(told.value)
    assert "psi: link_deg" not in str(told.value) and "phi: link_deg" not in str(told.value)
    assert "no other column is left" not in str(told.value)

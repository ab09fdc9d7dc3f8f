"""Units that a file states, where they cannot simply be applied."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from slider_log import TEXT, rows, write_csv

from codegen.logs import preflight, read_log
from codegen.spec import parse_spec
from codegen.spec.column_units import is_convertible, stated_unit
from tests.diagnosis.stage import stage

TIME = np.arange(3000) * 2e-3
ROWS = "".join(f"{t:.4f};{1e3 * 0.1 * np.sin(3 * t):.6f};1\n" for t in TIME)


@pytest.mark.parametrize("unit", ["Grad", "grad", "GRAD"])
def test_degrees_gons_and_billions_of_radians_are_not_told_apart(unit: str) -> None:
    assert not is_convertible(unit, "rad")
    assert is_convertible("deg", "rad")


@pytest.mark.parametrize(
    ("name", "bare", "unit"),
    [
        ("Angle (°) Run #1", "Angle Run #1", "°"),
        ("x [mm] Run 2", "x Run 2", "mm"),
        ("Current (A) Run #1", "Current Run #1", "A"),
        ("Drehmoment in Nm", "Drehmoment", "Nm"),
        ("Torque, Nm", "Torque", "Nm"),
        ("Angle (Degrees)", "Angle", "degrees"),
        ("Speed (1/min)", "Speed", "1/min"),
        ("n (r/min)", "n", "r/min"),
        ("n (U/min)", "n", "U/min"),  # no atomic mass
        ("Torque (%)", "Torque", "%"),
        ("Position (act)", "Position (act)", ""),
        ("Motor (U)", "Motor (U)", ""),
        ("x (Link)", "x (Link)", ""),  # no surveyor's link
        ("q (a)", "q (a)", ""),  # no year
        ("q (fb)", "q (fb)", ""),  # no femtobit
        ("dq/dt", "dq/dt", ""),  # no decitonne
        ("Time (h)", "Time", "h"),
        ("Motor (A) left", "Motor (A) left", ""),  # a letter may name a part of the machine
        ("Position, b", "Position, b", ""),  # not barn
        ("f(s) of q (deg) b", "f(s) of q (deg) b", ""),
        ("Force, Ch 01", "Force, Ch 01", ""),
        ("Current (0.01 A)", "Current", "0.01 A"),
        ("Torque (0.1 %)", "Torque", "0.1 %"),
    ],
)
def test_a_unit_within_a_name(name: str, bare: str, unit: str) -> None:
    """`Angle (°) Run #1` was read in rad without a word."""
    assert stated_unit(name) == (bare, unit)


def test_units_of_columns_in_an_expression_are_a_warning(tmp_path: Path) -> None:
    """The unit row said mm, and `-q` was taken in m without a word."""
    path, description = tmp_path / "log.csv", tmp_path / "meta.yaml"
    path.write_text("t;q;w\ns;mm;N\n" + ROWS, encoding="utf-8")
    description.write_text('columns: {x: "-q"}\n', encoding="utf-8")
    log = read_log(path, stage(), description=description)
    assert any("mm" in f.words and "scale" in f.words for f in log.raw_data.findings)
    assert any("Say `units: {x: m}` if it is" in f.words for f in log.raw_data.findings)
    description.write_text('columns: {x: "-1e-3*q"}\nunits: {x: m}\n', encoding="utf-8")
    assert not any(
        "computed from" in f.words for f in read_log(path, stage(), description=description).raw_data.findings
    )
    description.write_text('columns: {x: "-q"}\nscale: {x: 0.001}\n', encoding="utf-8")
    log = read_log(path, stage(), description=description)
    assert not any("computed from columns" in f.words for f in log.raw_data.findings)
    np.testing.assert_allclose(log.positions[:5, 0], -0.1 * np.sin(3 * TIME[:5]), atol=1e-9)


def test_an_index_in_brackets_is_no_unit(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t;state[2];w\n" + ROWS, encoding="utf-8")
    log = read_log(path, stage(), columns={"x": "state[2]"})
    assert not any("unit" in f.topic for f in log.raw_data.findings)


WHEEL = """name: wheel
coordinates: {x: {velocity: v, unit: rad}}
inputs: {w: {unit: N*m}}
parameters: {J: {value: 2, unit: kg*m^2}}
mass_matrix: [[J]]
force: [w]
friction: {distribution: [[1]], contacts: [{name: axle, law: coulomb, a: 4, unit: N*m}]}
"""


@pytest.mark.parametrize("unit", ["1/min", "min-1", "min⁻¹", "U/min"])
def test_revolutions_or_radians_in_a_minute_are_asked_for(tmp_path: Path, unit: str) -> None:
    """`Speed (min-1)` was read in rad/s without a word."""
    spec = parse_spec(WHEEL, tmp_path / "wheel.yaml")
    path = tmp_path / "log.csv"
    path.write_text(f"t;Speed ({unit});w\n" + ROWS, encoding="utf-8")
    (finding,) = read_log(path, spec, columns={"v": f"Speed ({unit})"}).raw_data.findings
    meant = "rev/min" if unit == "U/min" else "rpm"
    assert f"in `{unit}`" in finding.words and f"`units: {{v: {meant}}}`" in finding.words
    (tmp_path / "meta.yaml").write_text(f"units: {{v: {meant}}}\n", encoding="utf-8")
    log = read_log(path, spec, columns={"v": f"Speed ({unit})"})
    assert log.velocities is not None and not log.raw_data.findings
    np.testing.assert_allclose(log.velocities[:5, 0], np.pi / 30 * 100 * np.sin(3 * TIME[:5]), atol=1e-6)


@pytest.mark.parametrize(
    ("name", "factor"),
    [
        ("rpm", np.pi / 30),
        ("motor_rpm", np.pi / 30),
        ("motorRPM", np.pi / 30),
        ("turns", 1.0),
    ],
)
def test_a_column_that_is_called_by_its_unit_is_in_that_unit(tmp_path: Path, name: str, factor: float) -> None:
    """A logger printed `millis,rpm,pwm`: the speed was taken in rad/s; `motor_rpm` was converted."""
    spec = parse_spec(WHEEL, tmp_path / "wheel.yaml")
    path = tmp_path / "log.csv"
    path.write_text(f"millis;{name};w\n" + ROWS, encoding="utf-8")
    log = read_log(path, spec, columns={"t": "millis", "v": name})
    assert log.velocities is not None
    np.testing.assert_allclose(log.velocities[:5, 0], factor * 100 * np.sin(3 * TIME[:5]), atol=1e-6)
    assert any(f"as the name of `{name}` says" in note for note in log.notes) is (factor != 1)
    (tmp_path / "meta.yaml").write_text("scale: {v: 0.5}\n", encoding="utf-8")
    log = read_log(path, spec, columns={"t": "millis", "v": name})
    assert log.velocities is not None
    np.testing.assert_allclose(log.velocities[:5, 0], 50 * np.sin(3 * TIME[:5]), atol=1e-6)  # what is stated decides


@pytest.mark.parametrize(
    ("name", "unit"),
    [("v_deg_s", "deg"), ("v_deg_per_sec", "deg"), ("v_turns_per_s", "turn"), ("v_rps", "turn"), ("v_rad_s", "rad")],
)
def test_a_unit_of_speed_behind_a_name_is_converted(tmp_path: Path, name: str, unit: str) -> None:
    """`v_deg_s` was read in rad/s without a word."""
    spec = parse_spec(WHEEL, tmp_path / "wheel.yaml")
    path = tmp_path / "log.csv"
    path.write_text(f"timeMs;{name};w\n" + ROWS, encoding="utf-8")
    log = read_log(path, spec, columns={"v": name})
    factor = {"deg": np.pi / 180, "turn": 2 * np.pi, "rad": 1.0}[unit]
    assert log.velocities is not None
    np.testing.assert_allclose(
        log.velocities[:5, 0], factor * 100 * np.sin(3 * TIME[:5]), rtol=1e-5
    )  # of rounded times
    np.testing.assert_allclose(log.sample_time, (TIME[1] - TIME[0]) / 1000)


def test_the_size_of_a_count_in_a_name_is_asked_for(tmp_path: Path) -> None:
    """A drive writes `Position (10 um)` over its counts; `Force (500 N)` may be the range of a sensor."""
    path = tmp_path / "log.csv"
    path.write_text("t;Position (10 um);w\n" + ROWS, encoding="utf-8")
    (finding,) = read_log(path, stage(), columns={"x": "Position (10 um)"}).raw_data.findings
    assert finding.severity == "warning" and "`scale: {x: 10 um}`" in finding.words
    (tmp_path / "meta.yaml").write_text("scale: {x: 10 um}\n", encoding="utf-8")
    log = read_log(path, stage(), columns={"x": "Position (10 um)"})
    assert not log.raw_data.findings
    np.testing.assert_allclose(log.positions[:5, 0], 1e-5 * 100 * np.sin(3 * TIME[:5]), atol=1e-9)


@pytest.mark.parametrize(("name", "asked"), [("x (foot)", True), ("x (mm)", False), ("x [foot]", False)])
def test_a_word_that_is_also_a_rare_unit_is_converted_with_a_warning(tmp_path: Path, name: str, asked: bool) -> None:
    """The position of a robot's foot may be called `x (foot)`: a note among others was all that said so."""
    (tmp_path / "a.csv").write_text(f"t;{name};w\n" + ROWS, encoding="utf-8")
    log = read_log(tmp_path / "a.csv", stage())
    found = [f for f in log.raw_data.findings if f.topic == "unit of x"]
    assert [f.severity for f in found] == ["warning"] * asked
    assert not asked or ("converted to m" in found[0].words and "`units: {x: m}`" in found[0].words)
    factor = 1e-3 if name == "x (mm)" else 0.3048
    np.testing.assert_allclose(log.positions[:5, 0], factor * 100 * np.sin(3 * TIME[:5]), atol=1e-6)


@pytest.mark.parametrize(("units", "judged"), [("s,counts,%", False), ("s,m,%", True), ("s,counts,N", True)])
def test_no_scale_is_found_where_the_sizes_of_two_units_are_unknown(tmp_path: Path, units: str, judged: bool) -> None:
    """Forces cannot tell two unknown factors apart: the preflight named one of the two, which was wrong."""
    made, spec = rows(), parse_spec(TEXT, tmp_path / "slider.yaml")
    made["x"], made["w"] = made["x"] * (1e4 if "counts" in units else 1), made["w"] * (20 if "%" in units else 1)
    del made["v"]
    path = write_csv(tmp_path / "a.csv", made)
    path.write_text(path.read_text().replace("\n", f"\n{units}\n", 1))
    log = read_log(path, spec)
    topics = {f.topic: f for f in preflight(log, spec) if "scale" in f.topic}
    assert any(f.severity == "problem" for f in topics.values()) is judged
    if not judged:
        assert "before the units of w and x are stated" in topics["sign and scale of w"].words


@pytest.mark.parametrize(("name", "factor"), [("v [mm/s]", 1e-3), ("v / (m/s)", 1.0)])
def test_a_measured_speed_is_found_with_a_unit_behind_its_name(tmp_path: Path, name: str, factor: float) -> None:
    """As a position is: the speed was left unused without a word."""
    made, spec = rows(), parse_spec(TEXT, tmp_path / "slider.yaml")
    path = write_csv(tmp_path / "a.csv", {"t": made["t"], "x": made["x"], name: made["v"] / factor, "w": made["w"]})
    log = read_log(path, spec)
    assert log.velocities is not None
    np.testing.assert_allclose(log.velocities[:, 0], made["v"], atol=1e-8)


def test_a_voltage_with_the_name_of_a_speed_is_no_speed(tmp_path: Path) -> None:
    made, spec = rows(), parse_spec(TEXT, tmp_path / "slider.yaml")
    path = write_csv(tmp_path / "a.csv", {"t": made["t"], "x": made["x"], "v [V]": made["v"], "w": made["w"]})
    assert read_log(path, spec).velocities is None

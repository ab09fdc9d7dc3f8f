"""Columns that are not plain SI numbers: units, expressions, counters, files side by side, a speed alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from slider_log import LEVEL, TEXT, rows, write_csv

from codegen.base.errors import BadInput
from codegen.logs import preflight, read_log
from codegen.spec.reader import parse_spec
from tests.expected_errors import refused


def about(path, text):
    (path / "meta.yaml").write_text(text)


def found(log, spec):
    return {f.topic: f for f in preflight(log, spec)}


def test_units_by_name(tmp_path, spec):
    made = rows(2)
    table = {"t": made["t"] * 1e3, "x": made["x"] * 1e3, "v": made["v"] * 60, "w": made["w"] / 4.4482216152605}
    path = write_csv(tmp_path / "a.csv", table, fmt="%.17g")
    about(tmp_path, "units: {t: ms, x: mm, v: m/min, w: lbf}\n")
    log = read_log(path, spec)
    assert log.sample_time == 0.002 and np.allclose(log.positions[:, 0], made["x"], rtol=1e-12)
    assert np.allclose(log.velocities[:, 0], made["v"], rtol=1e-12)
    assert np.allclose(log.inputs[:, 0], made["w"], rtol=1e-12)
    about(tmp_path, "units: {t: ms, x: mm, v: m/min, w: lbf}\nscale: {w: -2}\n")
    assert np.allclose(read_log(path, spec).inputs[:, 0], -2 * made["w"], rtol=1e-12)
    for text, words in {
        "units: {x: deg}\n": r"meta\.yaml:1: units\.x: unit deg, of a pure number.*; expected a unit of x",
        "units: {w: mA}\n": r"unit mA, of A; .* in its place `scale: \{w: SIZE\}`, what one mA is in N",
        "units: {x: counts}\n": r"unit counts, .*; or in its place `scale: \{x: SIZE\}`, the size of one count in m",
        "units: {x: millimetre3}\n": r"meta\.yaml:1: units\.x: unit `millimetre3`",
        "units: {y: mm}\n": r"meta\.yaml:1: units\.y: unknown name `y`; expected one of t, x, v, w",
        "units: {w: [N]}\n": r"meta\.yaml:1: units.w: ",
    }.items():
        about(tmp_path, text)
        with pytest.raises(BadInput, match=words):
            read_log(path, spec)


def test_a_hexadecimal_number_of_more_than_64_bits_is_none(tmp_path, spec):
    """0xff... of 400 digits is beyond a double, of which Python raises OverflowError."""
    for digits in (400, 17):
        rows_ = "".join(f"{k},1,0x{'f' * (digits if k == 1 else 16)}\n" for k in range(50))
        (tmp_path / "a.csv").write_text(f"n,x,t\n{rows_}")
        with refused("LOG005 a.csv:3 t: `0xff"):
            read_log(tmp_path / "a.csv", spec, columns={"t": "t", "x": "x", "w": "n"})


def test_a_value_whose_square_is_no_double_is_zero(tmp_path, spec):
    """Positions of 1e-160 m ended `diagnose` in a division by zero, and those of 1e-200 m in a NaN."""
    made = rows(2)
    path = write_csv(tmp_path / "a.csv", {**made, "x": made["x"] * 1e-160, "w": made["w"] * 1e-25}, fmt="%.17g")
    log = read_log(path, spec)
    assert not log.positions.any()
    assert np.allclose(log.inputs[:, 0] * 1e25, made["w"])


def test_expressions_of_columns(tmp_path, spec):
    made = rows(2)
    table = {
        "t": made["t"],
        "x": made["x"],
        "load (raw)": made["w"] * 885 / 7,
        "volts": 0 * made["t"] + 7,
        "on": made["t"] > 1,
    }
    path = write_csv(tmp_path / "a.csv", table, fmt="%.17g")
    about(tmp_path, "columns: {w: load__raw_*volts/885*on}\n")
    assert np.allclose(read_log(path, spec).inputs[:, 0], made["w"] * (made["t"] > 1))
    about(tmp_path, "columns: {w: abs(load__raw_)/885 - sqrt(volts)*sgn(x)}\n")
    other = np.abs(made["w"]) / 7 - np.sqrt(7) * np.sign(made["x"])
    assert np.allclose(read_log(path, spec).inputs[:, 0], other)
    for text, words in {
        "w: lode*volts": r"meta\.yaml:1: columns\.w: unknown name `lode` in `lode\*volts`",
        "w: load*volts/0": r"meta\.yaml:1: columns\.w: |unknown name `load`",
        "w: volts/0": "divides by zero",
        "w: 2*3": r"no column `2\*3`",
        "w: __import__('os').system('x')": "no column",
        "w: volts**volts": "no column|exponent",
        "w: volts/(on - on)": "divides by zero|finite",
        "w: log(volts - 7)": "not finite",
    }.items():
        about(tmp_path, f'columns: {{"{text.split(": ")[0]}": "{text.split(": ", 1)[1]}"}}\n')
        with pytest.raises(BadInput, match=words):
            read_log(path, spec)


@pytest.mark.parametrize("bits", [16, 32])
def test_signed_numbers_stored_unsigned(tmp_path, spec, bits):
    made = rows(20)
    counts = np.round(made["w"] * 100)
    path = write_csv(tmp_path / "a.csv", {**made, "w": counts % 2**bits}, fmt="%.17g")
    about(tmp_path, "scale: {w: 0.01}\n")
    told = found(read_log(path, spec), spec)
    assert told["numbers of w"].severity == "problem" and f"Say `signed{bits}: [w]`" in told["numbers of w"].words
    assert told["numbers of w"].figures["share"] == pytest.approx(np.mean(counts < 0))
    assert "not judged" in told["sign and scale of w"].words and "flipped" not in str(told)
    about(tmp_path, f"scale: {{w: 0.01}}\nsigned{bits}: w\n")
    log = read_log(path, spec)
    assert np.allclose(log.inputs[:, 0], counts / 100) and "numbers of w" not in found(log, spec)
    about(tmp_path, f"signed{bits}: [ww]\n")
    with refused(f"LOG003 signed{bits}: `ww` t, x, v, w"):
        read_log(path, spec)


def test_numbers_that_are_large_are_not_blamed(tmp_path, spec):
    made = rows(20)
    for counts in (np.round(30000 + 9000 * made["w"] / 5), np.round(made["w"] * 1000), np.round(60000 + made["w"])):
        log = read_log(write_csv(tmp_path / "a.csv", {**made, "w": counts}), spec)
        assert ("numbers of w" in found(log, spec)) == (counts.min() > 50000)  # all near the end: may be, and is told


@pytest.mark.parametrize(("unit", "turn", "line"), [("deg", 360.0, "360"), ("rad", 2 * np.pi, "2*pi")])
def test_an_angle_that_wraps_is_unwrapped_by_a_turn_in_its_unit(tmp_path, unit, turn, line):
    """The jump seen in a sampled log was proposed: 6.219 rad of a column in degrees."""
    text = TEXT.replace("unit: m}", "unit: rad}").replace("unit: kg", "unit: kg*m^2").replace("unit: N}", "unit: N*m}")
    spec = parse_spec(text, Path("spun.yaml"))
    made = rows(20)
    x = (20 * made["t"] / (2 * np.pi) * turn) % turn
    path = write_csv(tmp_path / "b.csv", {"t": made["t"], f"motor angle [{unit}]": x, "w": made["w"]}, fmt="%.12g")
    columns = f"columns: {{x: 'motor angle [{unit}]'}}\n"
    about(tmp_path, columns)
    said = found(read_log(path, spec), spec)["jumps of x"].words
    proposed = said.partition("`unwrap: ")[2].partition("`")[0]
    assert proposed == f'{{"motor angle [{unit}]": {line}}}'
    about(tmp_path, f"{columns}unwrap: {proposed}\n")
    log = read_log(path, spec)
    assert np.allclose(np.diff(log.positions[:, 0]), 20 * log.sample_time, atol=1e-6)


def test_counters_that_start_anew(tmp_path, spec):
    made = rows(20)
    counts = np.round(made["x"] * 1e6 + 20_000)
    path = write_csv(tmp_path / "a.csv", {"t": made["t"], "x": counts % 65536, "w": made["w"]}, fmt="%.17g")
    about(tmp_path, "scale: {x: 1e-6}\n")
    told = found(read_log(path, spec), spec)
    assert "overflows. Say `unwrap: {x: 65536}`" in told["numbers of x"].words
    about(tmp_path, "scale: {x: 1e-6}\nunwrap: {x: 65536}\n")
    log = read_log(path, spec)
    assert np.allclose(np.diff(log.positions[:, 0]), np.diff(counts) * 1e-6)
    assert "numbers of x" not in found(log, spec)
    turned = {"t": made["t"], "x": (made["t"] * 0.7) % (2 * np.pi), "w": made["w"]}
    path = write_csv(tmp_path / "b.csv", turned, fmt="%.17g")
    (tmp_path / "meta.yaml").unlink()
    assert "`unwrap: {COLUMN: 6.282}`" in found(read_log(path, spec), spec)["jumps of x"].words
    about(tmp_path, "unwrap: {x: 2*pi}\n")
    assert np.allclose(np.diff(read_log(path, spec).positions[:, 0]), 0.7 * 0.002)
    for text in ("unwrap: {x: 0}\n", "unwrap: {x: a}\n", "unwrap: {x: 1/0}\n", "unwrap: [x]\n"):
        about(tmp_path, text)
        with refused("SPEC006 meta.yaml:1: unwrap"):
            read_log(path, spec)


def test_a_scale_may_be_an_expression_of_numbers(tmp_path, spec):
    """As of an encoder with 4096 counts in a revolution, whose scale has no short decimal."""
    made = rows(2)
    counts = np.round(made["x"] * 4096)
    path = write_csv(tmp_path / "a.csv", {"t": made["t"], "x": counts, "w": made["w"]}, fmt="%.17g")
    about(tmp_path, "scale: {x: -2*pi/4096}\n")
    assert np.allclose(read_log(path, spec).positions[:, 0], counts * (-np.pi / 2048), rtol=1e-12)
    for text in ("0*pi", "a", "1/0", "sqrt(0-1)", "log(0-1)", "exp(exp(9))", "10**9**9", "2*x", "[1]", "true", "''"):
        about(tmp_path, f"scale: {{x: {text}}}\n")
        with refused("SPEC006 meta.yaml:1: scale.x: "):
            read_log(path, spec)
    for text in ("sqrt(0-1)", "exp(exp(9))"):
        about(tmp_path, f"unwrap: {{x: {text}}}\n")
        with refused("SPEC006 meta.yaml:1: unwrap"):
            read_log(path, spec)


def test_a_scale_with_a_unit_is_the_size_of_one_count(tmp_path, spec):
    made = rows(2)
    counts = np.round(made["x"] / 1e-5)
    path = write_csv(tmp_path / "a.csv", {"t": made["t"], "x": counts, "w": made["w"]}, fmt="%.17g")
    about(tmp_path, "scale: {x: 10 um}\n")
    assert np.allclose(read_log(path, spec).positions[:, 0], counts * 1e-5, rtol=1e-12)
    for text, where in (("scale: {x: 10 us}", "scale.x"), ("units: {x: mm}\nscale: {x: 10 um}", "units.x")):
        about(tmp_path, f"{text}\n")
        with pytest.raises(BadInput) as told:
            read_log(path, spec)
        assert told.value.place.key == where


def test_counts_in_a_columns_name_ask_for_their_size(tmp_path, spec):
    made = rows(20)
    counts = np.round(made["x"] / 1e-5)
    path = write_csv(tmp_path / "a.csv", {"t": made["t"], "pos_counts": counts, "w": made["w"]}, fmt="%.17g")
    with pytest.raises(BadInput) as told:
        read_log(path, spec)
    said = "`columns: {x: pos_counts}`, and their size, such as `scale: {x: 10 um}` of counts of 10 um"
    assert told.value.expected.startswith(said)
    about(tmp_path, "columns: {x: pos_counts}\n")
    log = read_log(path, spec)
    (one,) = [f for f in preflight(log, spec) if "holds counts by its name" in f.words]
    assert (one.severity, one.topic) == (
        "warning",
        "unit of x",
    ) and "`scale: {x: 10 um}` of counts of 10 um" in one.words
    for size in ("10 um", "1", "1/100000"):
        about(tmp_path, f"columns: {{x: pos_counts}}\nscale: {{x: {size}}}\n")
        assert "unit of x" not in {f.topic for f in preflight(read_log(path, spec), spec)}


def test_stale_rows(tmp_path, spec):
    made = rows(20)
    late = np.arange(10000) // 4 * 4  # a bus with news every fourth row
    stale = {"t": made["t"], **{n: made[n][late] for n in "xvw"}}
    finding = found(read_log(write_csv(tmp_path / "a.csv", stale), spec), spec)["stale rows"]
    assert finding.severity == "warning" and finding.figures["share"] == pytest.approx(0.75, abs=0.001)
    still = {"t": made["t"], "x": np.where(made["t"] < 10, 0.1, 0.1 + made["x"]), "w": made["w"] * (made["t"] > 10)}
    finding = found(read_log(write_csv(tmp_path / "a.csv", still), spec), spec)["stale rows"]
    assert finding.severity == "info" and finding.figures["in_motion"] < 0.01


def test_a_speed_alone(tmp_path, spec):
    made = rows(20)
    path = write_csv(tmp_path / "a.csv", {n: made[n] for n in "tvw"}, fmt="%.17g")
    log = read_log(path, spec)
    assert np.allclose(log.positions[:, 0], made["x"] - made["x"][0], atol=1e-6)
    assert np.array_equal(log.velocities[:, 0], made["v"])
    assert any("the position is the integral of the measured speed v" in n for n in log.notes)
    assert found(log, spec)["sign and scale of w"].figures["factor"] == pytest.approx(1, abs=0.02)
    path = write_csv(tmp_path / "a.csv", {"t": made["t"], "pos": made["x"], "v": made["v"], "w": made["w"]})
    with refused("LOG003 `x` t, pos, v, w"):
        read_log(path, spec)  # a column is left that may be the position


def test_files_side_by_side(tmp_path, spec):
    made = rows(2)
    path = write_csv(tmp_path / "pos.csv", {"1": made["x"]} | {"y": made["x"]}, fmt="%.17g")
    np.savez(tmp_path / "force.npz", y=made["w"])
    text = "beside: {force: force.npz}\nsample_time: 0.002\ncolumns: {x: y, w: force.y}\n"
    about(tmp_path, text)
    log = read_log(path, spec)
    assert np.allclose(log.positions[:, 0], made["x"]) and np.allclose(log.inputs[:, 0], made["w"])
    assert log.sample_time == 0.002
    about(tmp_path, text.replace("force.y", "-force_y"))
    assert np.allclose(read_log(path, spec).inputs[:, 0], -made["w"])
    np.savez(tmp_path / "force.npz", y=made["w"][:-1])
    with refused("LOG011 force.npz: 999 1000 pos.csv"):
        read_log(path, spec)
    about(tmp_path, text.replace("force.npz", "none.npz"))
    with refused("FILE001 none.npz:"):
        read_log(path, spec)
    about(tmp_path, text.replace("force.npz", "pos.csv"))
    with refused("LOG014 beside.force: `pos.csv`"):
        read_log(path, spec)


def test_gravity_that_points_the_other_way_is_told_from_a_flipped_input(tmp_path, spec):
    made = rows(20)
    made["w"] = made["w"] + 40 * made["x"]  # a spring that the spec has with the wrong sign
    log = read_log(write_csv(tmp_path / "a.csv", made, fmt="%.12g"), spec)
    assert LEVEL and "flipped" not in found(log, spec)["sign and scale of w"].words

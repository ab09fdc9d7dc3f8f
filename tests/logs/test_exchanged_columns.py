"""Columns that were exchanged are told, with the right ones; logs with other faults are not taken for such."""

from __future__ import annotations

import re
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from slider_log import LEVEL, MASS, TEXT, rows, write_csv

from codegen.logs import preflight, read_log
from codegen.spec.reader import parse_spec
from tests.slow_cases import slow_except


@pytest.mark.parametrize("given", [p for p in permutations("xvw") if p != tuple("xvw")])
def test_exchanged_columns_are_named_with_the_right_ones(tmp_path, spec, given):
    """Whatever the order, the proposed lines give the log back as it was recorded."""
    path = write_csv(tmp_path / "a.csv", rows(20, 250))
    found = preflight(read_log(path, spec, columns=dict(zip("xvw", given, strict=True))), spec)
    (one,) = [f for f in found if f.topic == "columns"]
    assert one.severity == "problem" and not [f for f in found if f.topic.startswith(("scale", "sign"))]
    (line,) = re.findall(r"`(columns: \{.*?\})`", one.words)
    said = dict(re.findall(r"(\w+): (\w+)", line.removeprefix("columns: ")))
    assert said == {symbol: symbol for symbol, column in zip("xvw", given, strict=True) if symbol != column}


CRUDE = TEXT.replace(f"value: {MASS}", "value: 0.6").replace(f"a: {LEVEL}", "a: 0.9")


def two_tones() -> dict[str, np.ndarray]:
    """A motion with two frequencies: with one alone, the slope of a velocity is a multiple of the position."""
    one, other = rows(20, 250), rows(20, 250, frequency=1.3, amplitude=0.03)
    made = {name: one[name] + other[name] for name in "xv"}
    inertia = sum(r["w"] - LEVEL * np.sign(r["v"]) for r in (one, other))
    return {"t": one["t"], **made, "w": inertia + LEVEL * np.sign(made["v"])}


@pytest.mark.parametrize("given", [p for p in permutations("xvw") if p != tuple("xvw")])
def test_exchanged_columns_are_named_by_the_velocity_with_crude_values(tmp_path, given):
    """With declared values far from the machine's no columns balance the forces, and nothing was told."""
    path, spec = write_csv(tmp_path / "a.csv", two_tones()), parse_spec(CRUDE, Path("slider.yaml"))
    found = preflight(read_log(path, spec, columns=dict(zip("xvw", given, strict=True))), spec)
    (one,) = [f for f in found if f.topic == "columns"]
    assert one.severity == "problem" and "speeds differ from the slopes" in one.words
    (line,) = re.findall(r"`columns: \{(.*?)\}`", one.words)
    assert dict(re.findall(r"(\w+): (\w+)", line)) == {
        a: a for a, column in zip("xvw", given, strict=True) if a != column
    }


@pytest.mark.parametrize("wrong", [{}, {"v": -1.0}, {"v": 9.55}, {"x": -1.0}, {"x": 57.3}, {"w": -1.0}], ids=str)
def test_a_velocity_of_another_unit_or_sign_is_no_exchange(tmp_path, wrong):
    made = {name: wrong.get(name, 1.0) * column for name, column in two_tones().items()}
    path, spec = write_csv(tmp_path / "a.csv", made), parse_spec(CRUDE, Path("slider.yaml"))
    assert "columns" not in {f.topic for f in preflight(read_log(path, spec), spec)}


def test_a_scale_stays_with_its_variable(tmp_path, spec):
    """x is logged in mm, and the description says so of x, whatever column it takes."""
    made = rows(20, 250)
    del made["v"]
    path = write_csv(tmp_path / "a.csv", {**made, "x": 1e3 * made["x"]})
    (tmp_path / "meta.yaml").write_text("columns: {x: w, w: x}\nunits: {x: mm}\n")
    (one,) = [f for f in preflight(read_log(path, spec), spec) if f.topic == "columns"]
    assert "`columns: {x: x, w: w}`" in one.words


@pytest.mark.parametrize(
    "wrong",
    [{"w": -1.0}, {"w": 1e3}, {"x": 1e-3, "v": 1e-3}, {"x": -1.0, "v": -1.0}, {"x": 57.3}, {"w": 0.0}, {"t": 1e-3}],
    ids=str,
)
def test_another_fault_is_no_exchange(tmp_path, spec, wrong):
    made = rows(20, 250)
    path = write_csv(tmp_path / "a.csv", {name: wrong.get(name, 1.0) * column for name, column in made.items()})
    assert "columns" not in {f.topic for f in preflight(read_log(path, spec), spec)}


def test_a_model_that_lacks_most_of_the_force_is_no_exchange(tmp_path):
    """A spring of ten times the inertia's force that the spec does not have: nothing fits, and nothing is proposed."""
    made = rows(20, 250)
    del made["v"]
    made["w"] = made["w"] + 200 * made["x"]
    log = read_log(write_csv(tmp_path / "a.csv", made), spec := parse_spec(TEXT, Path("slider.yaml")))
    assert np.ptp(log.inputs) > 30
    assert "columns" not in {f.topic for f in preflight(log, spec)}


@pytest.mark.parametrize(("second", "offered"), [("m", ["x: y, y: x", "w: f, f: w"]), ("2.5*m", ["w: f, f: w"])])
def test_two_drives_whose_inputs_are_exchanged(tmp_path, second, offered):
    """Equal drives do not tell whether the positions or the inputs are exchanged, drives of different masses do."""
    text = """name: pair
coordinates: {x: {velocity: v, unit: m}, y: {velocity: u, unit: m}}
inputs: {w: {unit: N}, f: {unit: N}}
parameters: {m: {value: 2, unit: kg}}
mass_matrix: [[m, 0], [0, SECOND]]
force: [w, f]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts: [{name: first, a: 3, unit: N}, {name: second, a: 3, unit: N}]
""".replace("SECOND", second)
    one, other = rows(20, 250), rows(20, 250, frequency=0.8)
    weight = {"m": 1.0, "2.5*m": 2.5}[second]
    force = weight * (other["w"] - LEVEL * np.sign(other["v"])) + LEVEL * np.sign(other["v"])
    made = {"t": one["t"], "x": one["x"], "y": other["x"], "w": force, "f": one["w"]}
    pair = parse_spec(text, Path("pair.yaml"))
    log = read_log(write_csv(tmp_path / "a.csv", made), pair)
    (found,) = [f for f in preflight(log, pair) if f.topic == "columns"]
    assert sorted(re.findall(r"`columns: \{(.*?)\}`", found.words)) == sorted(offered)


PAIR = """name: pair
coordinates: {x: {velocity: v, unit: m}, y: {velocity: u, unit: m}}
inputs: {w: {unit: N}, f: {unit: N}}
parameters: {m: {value: 2, unit: kg}}
mass_matrix: [[m, 0], [0, 2.5*m]]
force: [w, f]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts: [{name: first, a: 3, unit: N}, {name: second, a: 3, unit: N}]
"""


def pair_rows(level: float = LEVEL) -> dict[str, np.ndarray]:
    """Two drives of 2 kg and 5 kg that move at frequencies of their own."""
    one, other = rows(20, 250), rows(20, 250, frequency=0.8)
    inertia = {"w": one["w"] - LEVEL * np.sign(one["v"]), "f": 2.5 * (other["w"] - LEVEL * np.sign(other["v"]))}
    forces = {"w": inertia["w"] + level * np.sign(one["v"]), "f": inertia["f"] + level * np.sign(other["v"])}
    return {"t": one["t"], "x": one["x"], "y": other["x"], "v": one["v"], "u": other["v"], **forces}


@pytest.mark.parametrize(
    "swap",
    [{"x": "y", "v": "u"}, {"x": "y", "v": "u", "w": "f"}, {"x": "v", "y": "u"}],
    ids=["coordinates", "axes", "positions and velocities"],
)
@pytest.mark.parametrize("level", slow_except([LEVEL, 8.0], [8.0]), ids="level {}".format)
def test_whole_axes_that_are_exchanged_are_told(tmp_path, swap, level):
    """With much friction exchanged axes leave less than a quarter of the squares unbalanced, and was not told."""
    given = {**swap, **{b: a for a, b in swap.items()}}
    pair = parse_spec(PAIR.replace("a: 3", f"a: {level:g}"), Path("pair.yaml"))
    path = write_csv(tmp_path / "a.csv", pair_rows(level))
    found = preflight(read_log(path, pair, columns=given), pair)
    (one,) = [f for f in found if f.topic == "columns"]
    assert one.severity == "problem" and not [f for f in found if f.topic.startswith(("scale", "sign"))]
    (line,) = re.findall(r"`columns: \{(.*?)\}`", one.words)
    assert dict(re.findall(r"(\w+): (\w+)", line)) == {symbol: symbol for symbol in given}
    assert not [f for f in preflight(read_log(path, pair), pair) if f.severity == "problem"]


@pytest.mark.parametrize("bound", [{"x": "v"}, {"y": "u"}, {"x": "v", "y": "u"}], ids=str)
def test_a_velocity_bound_as_a_position_is_told(tmp_path, bound):
    """It was answered with a wrong scale of the input, or not at all."""
    pair, made = parse_spec(PAIR, Path("pair.yaml")), pair_rows()
    speeds = {"a": made.pop("v"), "b": made.pop("u")}
    path = write_csv(tmp_path / "a.csv", {**made, **speeds})
    columns = {symbol: {"v": "a", "u": "b"}[velocity] for symbol, velocity in bound.items()}
    found = preflight(read_log(path, pair, columns=columns), pair)
    (one,) = [f for f in found if f.topic == "columns"]
    assert one.severity == "problem" and not [f for f in found if f.topic.startswith(("scale", "sign"))]
    assert all(f"{velocity}: {columns[symbol]}" in one.words for symbol, velocity in bound.items())


@pytest.mark.parametrize("lacking", [0.0, 2.0])
def test_a_model_without_much_of_a_force_is_no_velocity_as_position(tmp_path, lacking):
    """Of a machine of m a + d v = w, moved at one frequency, a spec without d has its force from the integral of x."""
    made = rows(20, 250)
    made["w"] = made["w"] + lacking * MASS * made.pop("v")
    spec = parse_spec(TEXT, Path("slider.yaml"))
    assert "columns" not in {f.topic for f in preflight(read_log(write_csv(tmp_path / "a.csv", made), spec), spec)}

"""Maps of cogging over a turn: read back as a firmware reads them, they cancel the force of the spec."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.app.command import is_one_message, stiction
from tests.machines import axis, effect

HARMONICS = effect("cogging_harmonics", "x", period=2 * np.pi / 7, sin_1=0.3, cos_1=0.1, sin_3=0.05, cos_3=-0.02)


def written(tmp_path: Path, to: str, name: str, *more: object, turns: bool = True, effects: str = HARMONICS) -> Path:
    path = tmp_path / "axis.yaml"
    path.write_text(axis(effects=effects, turns=turns)[0].text, "utf-8")
    done = stiction("export", path, "--to", to, "-o", tmp_path / name, *more)
    assert done.code == 0, done.err
    return tmp_path / name


def cogging(x: np.ndarray) -> np.ndarray:
    turn = 7 * x
    return 0.3 * np.sin(turn) + 0.1 * np.cos(turn) + 0.05 * np.sin(3 * turn) - 0.02 * np.cos(3 * turn)


def test_linear_interpolation_of_the_table_cancels_the_cogging(tmp_path: Path) -> None:
    path = written(tmp_path, "csv-map", "map.csv", "--counts", 1024)
    rows = np.loadtxt(path, delimiter=",", skiprows=sum(line[0] in "#c" for line in path.read_text().splitlines()))
    assert rows.shape == (1024, 4) and (rows[:, 0] == np.arange(1024)).all() and (rows[:, 3] == 0).all()
    x = np.random.default_rng(0).uniform(-20, 20, 5000)
    found = np.interp(x, rows[:, 1], rows[:, 2], period=2 * np.pi)
    left = np.abs(found + cogging(x)).max()
    # The error of linear interpolation: max |f''| Δ²/8.
    bound = (np.hypot(0.3, 0.1) * 49 + np.hypot(0.05, 0.02) * 441) * (2 * np.pi / 1024) ** 2 / 8
    assert left < bound
    said = next(line for line in path.read_text().splitlines() if "linear interpolation between counts;" in line)
    assert float(said.split("at most ")[1].split(",")[0]) == pytest.approx(left, rel=0.1)


def test_friction_that_repeats_is_a_column_of_its_own(tmp_path: Path) -> None:
    where = effect("position_dependent_friction", "rail", amplitude=0.5, period=0.2, phase=0.3)
    path = written(tmp_path, "csv-map", "map.csv", "--counts", 100, turns=False, effects=where)
    rows = np.loadtxt(path, delimiter=",", skiprows=sum(line[0] in "#c" for line in path.read_text().splitlines()))
    assert np.allclose(rows[:, 1], np.arange(100) * 0.002) and (rows[:, 2] == 0).all()
    assert np.allclose(rows[:, 3], 0.5 * np.sin(2 * np.pi * rows[:, 1] / 0.2 + 0.3), atol=1e-8)


def test_a_map_is_of_the_forces_and_takes_any_mass_matrix(tmp_path: Path) -> None:
    """It was refused beside a mass matrix that depends on the position, of which a map has no bodies."""
    text = axis(effects=HARMONICS, turns=True)[0].text
    assert "mass_matrix: [[m]]" in text
    (tmp_path / "axis.yaml").write_text(text.replace("mass_matrix: [[m]]", "mass_matrix: [[m*(2 + sin(x))]]"), "utf-8")
    made = stiction("export", tmp_path / "axis.yaml", "--to", "csv-map", "-o", tmp_path / "map.csv")
    assert made.code == 0, made.err
    refused = stiction("export", tmp_path / "axis.yaml", "--to", "mjcf", "-o", tmp_path / "axis.xml")
    assert is_one_message(refused) and "[SPEC036]" in refused.err
    plain = written(tmp_path, "csv-map", "plain.csv")
    rows = [
        [line for line in path.read_text().splitlines() if line[0] != "#"] for path in (tmp_path / "map.csv", plain)
    ]
    assert rows[0] == rows[1]


def test_odrive_s_lookup_cancels_the_cogging(tmp_path: Path) -> None:
    """The header compiled, and looked up as the firmware does: (int)(3600·turns), modulo 3600."""
    header = written(tmp_path, "odrive", "map.h", "--gear", 1)
    (tmp_path / "look.c").write_text(
        '#include <stdio.h>\n#include <stdlib.h>\n#include "map.h"\n'
        "int main(int n, char **a) { for (int k = 1; k < n; k++) { int i = (int)(atof(a[k]) * 3600.0) % 3600;\n"
        'printf("%.9g\\n", (double)stiction_cogging_map[i < 0 ? i + 3600 : i]); } return 0; }\n'
    )
    program = tmp_path / "look"
    subprocess.run(["cc", "-std=c99", "-Wall", "-Werror", "-o", program, tmp_path / "look.c"], check=True)
    turns = np.random.default_rng(1).uniform(0, 3, 400)
    out = subprocess.run([program, *map(repr, map(float, turns))], capture_output=True, text=True, check=True).stdout
    left = np.abs(np.array(out.split(), dtype=float) + cogging(2 * np.pi * turns))
    slope = np.hypot(0.3, 0.1) * 7 + np.hypot(0.05, 0.02) * 21
    assert left.max() < slope * 2 * np.pi / 3600 * 0.51
    assert "no interpolation between entries" in header.read_text()


def test_what_a_table_cannot_repeat_is_dropped(tmp_path: Path) -> None:
    alone = effect("cogging", "x", amplitude=0.4, period=1, phase=0)
    path = written(tmp_path, "csv-map", "map.csv", effects=f"{HARMONICS[:-1]}, {alone[1:]}")
    assert "dropped" in path.read_text() and "at most 0.4" in path.read_text()


@pytest.mark.parametrize("to", ["csv-map", "odrive"])
def test_a_map_of_nothing_is_refused(to: str, tmp_path: Path) -> None:
    """A wave that fits the joint's turn, and not the motor's behind a gear of 8; another that fits both."""
    path, out = tmp_path / "axis.yaml", tmp_path / f"map.{'csv' if to == 'csv-map' else 'h'}"
    path.write_text(axis(effects=HARMONICS, turns=True)[0].text, "utf-8")
    refused = stiction("export", path, "--to", to, "-o", out, "--gear", 8)
    assert is_one_message(refused) and "SPEC036" in refused.err and not out.exists()
    assert "waves over 6.28319 rad: no whole number" in refused.err and "motor" in refused.err
    assert stiction("export", path, "--to", to, "-o", out, "--gear", 7).code == 0


def test_a_gear_is_refused_by_what_has_no_map(tmp_path: Path) -> None:
    path = tmp_path / "axis.yaml"
    path.write_text(axis(turns=True)[0].text, "utf-8")
    for to, name in (("urdf", "axis.urdf"), ("mjcf", "axis.xml"), ("arduino", "axis")):
        refused = stiction("export", path, "--to", to, "-o", tmp_path / name, "--gear", 8)
        assert is_one_message(refused) and "--gear" in refused.err and "CALL002" in refused.err
        assert not (tmp_path / name).exists()


@pytest.mark.parametrize(
    ("to", "name", "more"),
    [
        ("arduino", "axis", ("--counts", "-3")),
        ("odrive", "map.h", ("--counts", "360", "--gear", "1")),
        ("urdf", "axis.urdf", ("--on", "x")),
        ("simulink", "axis", ("--on", "x")),
    ],
)
def test_an_option_of_maps_is_refused_by_what_does_not_read_it(to, name, more, tmp_path: Path) -> None:
    """`--to arduino --counts -3` was accepted, and the number left unused."""
    path = tmp_path / "axis.yaml"
    path.write_text(axis(turns=True)[0].text, "utf-8")
    refused = stiction("export", path, "--to", to, "-o", tmp_path / name, *more)
    assert is_one_message(refused) and more[0] in refused.err and "CALL002" in refused.err
    assert not (tmp_path / name).exists()


def test_maps_are_refused_where_there_is_none(tmp_path: Path) -> None:
    path = tmp_path / "axis.yaml"
    path.write_text(axis()[0].text, "utf-8")
    assert is_one_message(stiction("export", path, "--to", "csv-map", "-o", tmp_path / "map.csv"))
    path.write_text(axis(effects=effect("cogging", "x", amplitude=0.4, period=1, phase=0))[0].text, "utf-8")
    assert is_one_message(stiction("export", path, "--to", "odrive", "-o", tmp_path / "map.h", "--gear", "1"))
    for more in (("--counts", "0"), ("--on", "y")):
        assert is_one_message(stiction("export", path, "--to", "csv-map", "-o", tmp_path / "map.csv", *more))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["axis.yaml"]


def test_a_functional_mock_up_unit_is_a_target_of_generate(tmp_path: Path) -> None:
    path = tmp_path / "axis.yaml"
    path.write_text(axis()[0].text, "utf-8")
    refused = stiction("export", path, "--to", "fmu", "-o", tmp_path / "axis.fmu")
    assert is_one_message(refused) and "generate --target fmu" in refused.err and "CALL001" in refused.err


GEAR = 5


def test_behind_a_gear_the_map_is_the_motor_s(tmp_path: Path) -> None:
    """35 waves a turn of the joint are 7 a turn of the motor; its torque is a fifth, and its angle five times."""
    behind = effect("cogging", "x", amplitude=0.5, period=2 * np.pi / 35, phase=0.4)
    for gear in (GEAR, -GEAR):
        path = written(tmp_path, "odrive", f"map_{gear + 5}.h", "--gear", gear, effects=behind)
        numbers = re.findall(r"-?\d\.\d+e[-+]\d+(?=f)", path.read_text())
        entries = np.array(numbers, dtype=float)
        motor = (np.arange(3600) + 0.5) * 2 * np.pi / 3600
        joint = motor / gear
        power = entries * gear + 0.5 * np.sin(35 * joint + 0.4)  # torque on the joint by the map, and by the cogging
        assert np.abs(power).max() < 1e-5
    assert f"{-GEAR}*x" in path.read_text()


def test_odrive_s_map_is_refused_without_the_gear(tmp_path: Path) -> None:
    path = tmp_path / "axis.yaml"
    path.write_text(axis(effects=HARMONICS, turns=True)[0].text, "utf-8")
    refused = stiction("export", path, "--to", "odrive", "-o", tmp_path / "map.h")
    assert is_one_message(refused) and "--gear" in refused.err and "turn of the motor" in refused.err
    for gear in ("0", "nan", "inf"):
        assert is_one_message(stiction("export", path, "--to", "csv-map", "-o", tmp_path / "map.csv", "--gear", gear))


def test_weights_and_forces_of_the_model_are_left_out(tmp_path: Path) -> None:
    """Gravity in `force:`, at the cogging's own period too, and an imbalance are no cogging."""
    weight = effect("gravity_imbalance", "x", G=0.2, phase=0.1)
    both = weight[:-1] + ", " + effect("cogging", "x", amplitude=0.3, period=2 * np.pi, phase=0)[1:]
    path = tmp_path / "axis.yaml"
    text = axis(effects=both, turns=True)[0].text
    path.write_text(text.replace("force: [w - k*x]", "force: [w - k/20*sin(x) + k/30*sin(7*x)]"), "utf-8")
    done = stiction("export", path, "--to", "csv-map", "-o", tmp_path / "map.csv")
    assert done.code == 0, done.err
    rows = np.loadtxt(tmp_path / "map.csv", delimiter=",", comments=["#", "c"])
    assert np.allclose(rows[:, 2], -0.3 * np.sin(rows[:, 1]), atol=1e-8)
    assert done.out.count("a weight, or a term of `force:`") == 3
    path.write_text(text.replace(both, "[]").replace("force: [w - k*x]", "force: [w - k*sin(x)]"), "utf-8")
    refused = stiction("export", path, "--to", "csv-map", "-o", tmp_path / "other.csv")
    assert is_one_message(refused) and "a weight, or a term of `force:`" in refused.err


def test_a_fitted_period_is_taken_as_a_whole_number_of_waves(tmp_path: Path) -> None:
    near = effect("cogging", "x", amplitude=0.5, period=2 * np.pi / 14.003, phase=0.4)
    path = written(tmp_path, "csv-map", "map.csv", effects=near)
    rows = np.loadtxt(path, delimiter=",", comments=["#", "c"])
    left = np.abs(rows[:, 2] + 0.5 * np.sin(14.003 * rows[:, 1] + 0.4)).max()
    said = next(line for line in path.read_text().splitlines() if "taken as 14" in line)
    assert left <= float(said.split("at most ")[1].split(",")[0]) * 1.001 < 0.01


@pytest.mark.parametrize("more", [(), ("--gear", "1"), ("--gear", "5")])
def test_a_length_is_refused_for_odrive_at_once(more: tuple[str, ...], tmp_path: Path) -> None:
    """A user was sent from `--gear` missing to `--gear` of no angle, and back."""
    path, out = tmp_path / "axis.yaml", tmp_path / "map.h"
    path.write_text(axis(effects=effect("cogging", "x", amplitude=0.4, period=0.03, phase=0))[0].text, "utf-8")
    refused = stiction("export", path, "--to", "odrive", "-o", out, *more)
    assert is_one_message(refused) and "x in m with forces in N; expected an angle with torques" in refused.err
    assert "`--to csv-map` writes the table over x" in refused.err and "--gear" not in refused.err
    written = stiction("export", path, "--to", "csv-map", "-o", tmp_path / "map.csv")
    assert written.code == 0
    geared = stiction("export", path, "--to", "csv-map", "-o", tmp_path / "map.csv", "--gear", "5")
    assert is_one_message(geared) and "expected no --gear, since x is no angle" in geared.err

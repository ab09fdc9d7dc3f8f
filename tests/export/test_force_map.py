"""Maps of cogging over a turn: read back as a firmware reads them, they cancel the force of the spec."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.app.command import is_one_message, stiction

from .machines import effect, one

HARMONICS = effect("cogging_harmonics", "x", period=2 * np.pi / 7, sin_1=0.3, cos_1=0.1, sin_3=0.05, cos_3=-0.02)


def written(tmp_path: Path, to: str, name: str, *more: object, turns: bool = True, effects: str = HARMONICS) -> Path:
    path = tmp_path / "axis.yaml"
    path.write_text(one(effects=effects, turns=turns)[0].text, "utf-8")
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


def test_odrive_s_lookup_cancels_the_cogging(tmp_path: Path) -> None:
    """The header compiled, and looked up as the firmware does: (int)(3600·turns), modulo 3600."""
    header = written(tmp_path, "odrive", "map.h")
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
    path = written(tmp_path, "csv-map", "map.csv", effects=effect("cogging", "x", amplitude=0.4, period=1, phase=0))
    assert "dropped" in path.read_text() and "at most 0.4" in path.read_text()


def test_maps_are_refused_where_there_is_none(tmp_path: Path) -> None:
    path = tmp_path / "axis.yaml"
    path.write_text(one()[0].text, "utf-8")
    assert is_one_message(stiction("export", path, "--to", "csv-map", "-o", tmp_path / "map.csv"))
    path.write_text(one(effects=effect("cogging", "x", amplitude=0.4, period=1, phase=0))[0].text, "utf-8")
    assert is_one_message(stiction("export", path, "--to", "odrive", "-o", tmp_path / "map.h"))
    for more in (("--counts", "0"), ("--on", "y")):
        assert is_one_message(stiction("export", path, "--to", "csv-map", "-o", tmp_path / "map.csv", *more))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["axis.yaml"]

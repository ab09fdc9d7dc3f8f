"""Columns that a log states late: `late` in meta.yaml."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.base.errors import BadInput
from codegen.logs import read_log
from codegen.spec import Spec, parse_spec

H = 0.01
SPEC = """\
name: one
coordinates: {x: {velocity: v, unit: m}}
inputs: {w: {unit: N}}
parameters: {m: {value: 1, unit: kg}}
mass_matrix: [[m]]
force: [w]
friction: {distribution: [[1]], contacts: [{name: rail, law: coulomb, a: 1, unit: N}]}
observer: {kind: cfo, velocity: measured, gains: {K_F: 1}, sample_time: 10 ms}
"""


@pytest.fixture(scope="module")
def spec() -> Spec:
    return parse_spec(SPEC, Path("one.yaml"))


def written(folder: Path, meta: str, time: np.ndarray, **columns: np.ndarray) -> Path:
    path = folder / "run.csv"
    table = np.column_stack([time, *columns.values()])
    np.savetxt(path, table, delimiter=",", header=",".join(["t", *columns]), comments="", fmt="%.17g")
    (folder / "meta.yaml").write_text(meta)
    return path


def position(time: np.ndarray) -> np.ndarray:
    return 0.3 * time + 0.1


@pytest.mark.parametrize(("text", "late"), [("20 ms", 0.02), ("0.02", 0.02), ("-5 ms", -0.005)])
def test_a_position_is_brought_to_the_time_at_which_it_was_valid(
    tmp_path: Path, spec: Spec, text: str, late: float
) -> None:
    time = H * np.arange(50)
    path = written(tmp_path, f"late: {{x: {text}}}\n", time, x=position(time - late), w=np.cos(9 * time))
    log = read_log(path, spec)
    np.testing.assert_allclose(log.positions[:, 0], position(log.time), atol=1e-12)
    np.testing.assert_allclose(log.inputs[:, 0], np.cos(9 * log.time), atol=1e-12)
    assert log.size == 50 - (2 if late > 0 else 1)  # rows without a value at the ends are left out
    assert any("`late`" in note for note in log.notes)


def test_an_input_in_the_next_row_is_held_from_the_row_before(tmp_path: Path, spec: Spec) -> None:
    time, w = H * np.arange(50), np.random.default_rng(1).normal(size=50)
    path = written(tmp_path, "late: {w: 10 ms}\n", time, x=position(time), w=np.append(w[:1], w[:-1]))
    np.testing.assert_allclose(read_log(path, spec).inputs[:, 0], w[:49], atol=1e-12)
    (tmp_path / "meta.yaml").write_text("late: {w: 2.5 ms}\n")
    held = np.append(w[:1], w[:-1])
    np.testing.assert_allclose(read_log(path, spec).inputs[:, 0], 0.75 * held[:49] + 0.25 * held[1:], atol=1e-12)


def test_a_late_speed_is_moved_before_it_is_integrated(tmp_path: Path, spec: Spec) -> None:
    time = H * np.arange(200)
    path = written(tmp_path, "late: {v: 40 ms}\n", time, v=(time - 0.04) * 2, w=np.cos(9 * time))
    log = read_log(path, spec)
    np.testing.assert_allclose(log.positions[:, 0], log.time**2, atol=1e-12)


@pytest.mark.parametrize(
    ("meta", "words"),
    [
        ("late: {t: 1 ms}\n", "a coordinate, velocity or input"),
        ("late: {y: 1 ms}\n", "unknown name"),
        ("late: {w: 1 mm}\n", "mm"),
        ("late: {w: soon}\n", "expected a number"),
        ("late: [w]\n", "expected a mapping"),
        ("late: {w: 2 s}\n", "a time below the 0.49 s of the log"),
    ],
)
def test_what_is_no_lateness_is_refused(tmp_path: Path, spec: Spec, meta: str, words: str) -> None:
    time = H * np.arange(50)
    path = written(tmp_path, meta, time, x=position(time), w=np.cos(9 * time))
    with pytest.raises(BadInput, match="late") as refused:
        read_log(path, spec)
    assert words in str(refused.value)

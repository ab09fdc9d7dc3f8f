"""A format that is added as CONTRIBUTING.md says: one file, and one entry of the registry."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from slider_log import rows, write_csv

from codegen.logs import FORMATS, read_log
from codegen.logs.formats.source import Columns, LogFile
from codegen.spec import Spec
from tests.expected_errors import refused

MADE = {name: values[:2000] for name, values in rows().items()}


class DriveFile(LogFile):
    """A line of names, and rows of float64; all columns are loaded, in the order of the file."""

    expected = "a drive's log: a line of names, and rows of float64"

    def find(self) -> None:
        names, _, self._numbers = self.read_bytes().partition(b"\n")
        self.names = tuple(names.decode().split())

    def load(self, wanted: Sequence[str]) -> Columns:
        self.take(2 * len(self._numbers))
        return Columns(str(self.path), self.names, np.frombuffer(self._numbers, "<f8").reshape(-1, len(self.names)))


@pytest.fixture(autouse=True)
def drive_format(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(FORMATS, ".drv", DriveFile)  # type: ignore[arg-type]


def written(path: Path, columns: dict[str, np.ndarray]) -> Path:
    values = np.column_stack(list(columns.values())).astype("<f8")
    path.write_bytes(" ".join(columns).encode() + b"\n" + values.tobytes())
    return path


@pytest.mark.parametrize("order", [["t", "x", "v", "w"], ["w", "temperature", "v", "x", "t"]])
def test_columns_are_taken_by_name_whatever_else_is_loaded(tmp_path: Path, spec: Spec, order: list[str]) -> None:
    columns = MADE | {"temperature": np.full(len(MADE["t"]), 20.0)}
    ours = read_log(written(tmp_path / "a.drv", {name: columns[name] for name in order}), spec)
    same = read_log(write_csv(tmp_path / "a.csv", MADE, fmt="%.17g"), spec)
    assert np.array_equal(ours.positions, same.positions) and np.array_equal(ours.inputs, same.inputs)
    assert ours.velocities is not None and np.array_equal(ours.velocities, same.velocities)


def test_a_file_without_rows_is_refused(tmp_path: Path, spec: Spec) -> None:
    with refused("LOG009"):
        read_log(written(tmp_path / "a.drv", {name: values[:0] for name, values in MADE.items()}), spec)

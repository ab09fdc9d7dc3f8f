"""Units that a file states, where they cannot simply be applied."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.logs import read_log
from codegen.logs.column_names import is_convertible
from tests.diagnosis.stage import stage

TIME = np.arange(3000) * 2e-3
ROWS = "".join(f"{t:.4f};{1e3 * 0.1 * np.sin(3 * t):.6f};1\n" for t in TIME)


@pytest.mark.parametrize("unit", ["Grad", "grad", "GRAD"])
def test_degrees_gons_and_billions_of_radians_are_not_told_apart(unit: str) -> None:
    assert not is_convertible(unit, "rad")
    assert is_convertible("deg", "rad")


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

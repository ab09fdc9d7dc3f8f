"""A simulated log is in the units that the names of its columns state, so that every reader reads it back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.logs import read_log
from codegen.simulate.closed_loop import simulate
from codegen.simulate.loop_run import write_log
from codegen.spec import parse_spec
from codegen.spec.column_units import factor_in_name
from tests.diagnosis.stage import STAGE, TRAIN, system_of

COLUMNS = """\
log:
  columns: {t: "Zeit [ms]", x: "Weg [mm]", w: "Kraft (kN)"}
"""
TEXT = STAGE.format(effects="[]", level=4.0, reference=TRAIN, duration=4.0, noise=0.0)


def test_a_log_with_units_in_its_names_is_read_back(tmp_path: Path) -> None:
    spec = parse_spec(TEXT + COLUMNS, Path("stage.yaml"))
    run = simulate(spec, system_of(spec))
    path = tmp_path / "log.csv"
    write_log(path, spec, run)
    written = np.loadtxt(path, delimiter=",", skiprows=1)
    np.testing.assert_allclose(written[:, 0], 1e3 * run.time, rtol=1e-8)
    np.testing.assert_allclose(written[:, 1], 1e3 * run.positions[:, 0], rtol=1e-7, atol=1e-9)
    log = read_log(path, spec)
    np.testing.assert_allclose(log.time - log.time[0], run.time, atol=1e-9)
    np.testing.assert_allclose(log.positions, run.positions, rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(log.inputs, run.inputs, rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize(
    ("symbol", "name", "factor"),
    [("x", "x_mm", 1e-3), ("x", "Weg / um", 1e-6), ("x", "x", 1.0), ("x", "x [kg]", 1.0), ("t", "t_us", 1e-6)],
)
def test_the_factor_of_a_name(symbol: str, name: str, factor: float) -> None:
    assert factor_in_name(symbol, name, parse_spec(TEXT, Path("stage.yaml"))) == pytest.approx(factor)

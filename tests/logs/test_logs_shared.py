"""The practice logs and the measured ones that lie beside the project."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from codegen.logs import preflight, read_log
from codegen.spec.reader import parse_spec, read_spec
from tests.slow_cases import slow_except

SHARED = Path(__file__).resolve().parents[3] / "shared"
CASES = sorted((SHARED / "practice").glob("*/case_*"))
needs_shared = pytest.mark.skipif(not CASES, reason="the practice logs and measured data are not here")
few = CASES[::9]


@needs_shared
@pytest.mark.parametrize("tier", ["standard", "hard"])
@pytest.mark.parametrize("every", slow_except([6, 1], [6]))
def test_practice_logs(tier, every):
    for case in [c for c in CASES if c.parent.name == tier][::every]:
        spec = read_spec(case / "spec.yaml")
        log = read_log(case / "train.csv", spec)
        header = (case / "train.csv").open().readline().strip().split(",")
        table = np.loadtxt(case / "train.csv", delimiter=",", skiprows=1)
        wanted = [header.index(x) for x in spec.positions]
        assert np.array_equal(log.positions, table[:, wanted])
        assert np.array_equal(log.inputs, table[:, [header.index(i.name) for i in spec.inputs]])
        assert (log.velocities is not None) == (spec.velocities[0] in header)
        assert not log.notes
        assert not log.gaps and not log.raw_data.resampled
        evaluation = log.description.evaluation
        assert log.cutoff_hz and (evaluation.trim_s, evaluation.restart_s) == (1.0, 0.5)
        assert log.tolerance == (0.01 if tier == "hard" else None)
        truth = json.loads((case / "truth.json").read_text())
        steps = truth["noise"]["encoder_step"]
        assert log.encoder_step == pytest.approx(steps)
        assert log.raw_data.smallest_step == pytest.approx(steps, rel=1e-2)


@needs_shared
@pytest.mark.parametrize("case", slow_except(few, few[::3]) if few else [], ids=lambda c: f"{c.parent.name}-{c.name}")
def test_practice_preflight(case, tmp_path):
    spec = read_spec(case / "spec.yaml")
    assert not [f for f in preflight(read_log(case / "train.csv", spec), spec) if f.severity == "problem"]
    for factor, words in ((-1.0, "flipped"), (10.0, "off by a factor")):
        (tmp_path / "about.yaml").write_text(f"scale: {{{', '.join(f'{i.name}: {factor}' for i in spec.inputs)}}}\n")
        log = read_log(case / "train.csv", spec, description=tmp_path / "about.yaml")
        assert [f for f in preflight(log, spec) if f.severity == "problem" and words in f.words], words


GANTRY = """name: gantry
coordinates: {x: {velocity: v, unit: m}}
inputs: {u: {unit: V}}
parameters:
  M: {value: 95.1089, unit: kg}
  G: {value: 35.1507, unit: N/V}
  b: {value: 203.5034, unit: N*s/m}
mass_matrix: [[M]]
force: [G*u - b*v]
friction:
  distribution: [[1]]
  contacts: [{name: rail, a: 20.3935, unit: N}]
"""


@needs_shared
@pytest.mark.parametrize("name", ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"])
def test_gantry(name):
    path = SHARED / "data" / "emps" / name
    spec = parse_spec(GANTRY, Path("gantry.yaml"))
    log = read_log(path, spec, columns={"x": "qm", "u": "vir", "t": "t"})
    theirs = loadmat(path)
    assert np.array_equal(log.positions, theirs["qm"]) and np.array_equal(log.inputs, theirs["vir"])
    assert log.size == 24841 and log.sample_time == pytest.approx(0.001, rel=1e-7)
    found = {f.topic: f for f in preflight(log, spec)}
    assert found["sign and scale of u"].figures["factor"] == pytest.approx(1, abs=0.05)
    way = np.sign(np.diff(theirs["qg"][:, 0]))  # the reference is smooth: its own turns, without any filter
    way = way[way != 0]
    assert found["motion of x"].figures["reversals"] == (way[1:] != way[:-1]).sum()


MOTOR = """name: motor
coordinates: {th: {velocity: om, unit: rad}}
inputs: {i: {unit: A}}
parameters:
  J: {value: 2.5e-4, unit: kg*m^2}
  kt: {value: 0.055133, unit: N*m/A}
mass_matrix: [[J]]
force: [kt*i]
friction:
  distribution: [[1]]
  contacts: [{name: bearing, a: 0.02, unit: N*m}]
log:
  columns: {t: time_s, th: pos_counts, i: iq_A}
  scale: {th: 7.669903939428206e-4}
"""


@needs_shared
def test_motor():
    spec = parse_spec(MOTOR, Path("motor.yaml"))
    for path in sorted((SHARED / "data" / "odrive_cogging").glob("*.csv")):
        log = read_log(path, spec)
        table = np.loadtxt(path, delimiter=",", skiprows=1)
        assert log.raw_data.resampled and log.size * log.sample_time == pytest.approx(table[-1, 0], abs=0.01)
        at = np.interp(log.time, table[:, 0], table[:, 1] * 2 * np.pi / 8192)
        assert np.allclose(log.positions[:, 0], at, atol=1e-9)
        assert {f.topic for f in preflight(log, spec)} >= {"jitter", "motion of th", "sign and scale of i"}


PENDULUM = """name: double_pendulum
coordinates: {q1: {velocity: w1, unit: rad}, q2: {velocity: w2, unit: rad}}
inputs: {u1: {unit: N*m}, u2: {unit: N*m}}
parameters:
  I1: {value: 0.1, unit: kg*m^2}
  I2: {value: 0.02, unit: kg*m^2}
mass_matrix: [[I1, 0], [0, I2]]
force: [u1, u2]
friction:
  distribution: [[1, 0], [0, 1]]
  contacts: [{name: j1, a: 0.1, unit: N*m}, {name: j2, a: 0.1, unit: N*m}]
"""


PENDULUM_RUNS = [f"trajectory_{k:02d}" for k in range(6)]


@needs_shared
@pytest.mark.parametrize("name", slow_except(PENDULUM_RUNS, PENDULUM_RUNS[:2]))
def test_double_pendulum(name):
    spec = parse_spec(PENDULUM, Path("pendulum.yaml"))
    columns = {"t": "time", "q1": "pos_meas1", "q2": "pos_meas2", "w1": "vel_meas1", "w2": "vel_meas2"}
    columns |= {"u1": "tau_con1", "u2": "tau_con2"}
    path = SHARED / "data" / "dfki_double_pendulum" / f"{name}.csv"
    log = read_log(path, spec, columns=columns)
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    assert log.sample_time == pytest.approx(0.002, rel=1e-6) and log.velocities is not None
    for j in range(2):
        assert np.allclose(log.positions[:, j], np.interp(log.time, table[:, 0], table[:, 1 + j]), atol=1e-9)
    assert log.raw_data.smallest_step == pytest.approx((3.8148e-4, 3.8148e-4), rel=1e-3)
    assert preflight(log, spec)

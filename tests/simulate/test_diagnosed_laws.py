"""A diagnosis of machines whose law has a state, or is none that a plant runs: no crash, and no silence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import stiction
from tests.machines import SPRING_MASS

SIMULATION = """
simulation: {duration: 8, sample_time: 0.002, inputs: {w: 12*sin(5*t) + 5*sin(11.3*t)}}
"""
LAWS = {
    "lorentzian": "law: lorentzian, F_c: 2, F_s: 3, v_s: 0.2",
    "dahl": "law: dahl, a: 3, c: 200",
    "hess_soom_lag": "law: hess_soom_lag, F_c: 2, F_s: 3, v_s: 0.2, tau_L: 0.01",
    "ruina": "law: ruina, F_0: 3, a: 0.1, b: 0.05, L: 0.01, v_0: 0.1",
}


def spec(folder: Path, law: str) -> Path:
    path = folder / f"{law}.yaml"
    text = SPRING_MASS.replace("law: coulomb, a: {a}", LAWS[law]).format(m=2, k=20, b=0)
    path.write_text(text + SIMULATION, encoding="utf-8")
    return path


@pytest.mark.slow
@pytest.mark.parametrize(("plant", "law"), [("dahl", "dahl"), ("lorentzian", "hess_soom_lag"), ("lorentzian", "ruina")])
def test_diagnosis_goes_through_and_tells(tmp_path: Path, plant: str, law: str):
    log = stiction.simulate(spec(tmp_path, plant), tmp_path / "log.csv").path
    diagnosis = stiction.diagnose(spec(tmp_path, law), log, out=tmp_path / "out").diagnosis
    assert np.isfinite(diagnosis.refit.free_run_rmse)
    told = [words for words in diagnosis.findings["train"] if f"the law {law} at rail is not simulated" in words]
    assert len(told) == (law != "dahl")

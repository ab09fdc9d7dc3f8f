"""A simulated motion that leaves the envelope is told, and the shipped ones do not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.simulate.closed_loop import simulate
from codegen.simulate.loop_run import excursions
from tests.app.command import stiction
from tests.compiled.specs import SPECS
from tests.machines import one_mass

FREE = "simulation: {duration: 2, sample_time: 0.01, inputs: {w: 3}}"
LONG = ("two_mass", "two_link_arm", "emps")
"""A few seconds each."""


def test_how_far_and_when_by_hand() -> None:
    """A kilogram without friction under 3 N: v = 3 t, past 4.5 from t = 1.5 s on; at t = 1.99 s it is 5.97."""
    envelope = "envelope: {x: [-9, 9], v: [-1, 4.5], w: [-3, 3], v_dot: [-2, 2.5], x_noise: [-1, 1]}"
    spec, system = one_mass(m=1, k=0, b=0, a=0, more=f"{envelope}\n{FREE}")
    first, second = excursions(spec, simulate(spec, system))
    assert (first.name, second.name) == ("v", "v_dot") and (first.low, first.high) == (-1, 4.5)
    assert first.value == pytest.approx(5.97) and first.beyond == pytest.approx(1.47) and first.time == 1.99
    assert first.share == pytest.approx(49 / 200, abs=0.006) and second.beyond == pytest.approx(0.5)


def test_the_verb_warns_and_writes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = (SPECS / "one_mass.yaml").read_text(encoding="utf-8").replace("duration: 12", "duration: 2")
    Path("tame.yaml").write_text(text, encoding="utf-8")
    Path("wild.yaml").write_text(text.replace("61*sin", "610*sin"), encoding="utf-8")
    tame, wild = stiction("simulate", "tame.yaml", "-o", "t.csv"), stiction("simulate", "wild.yaml", "-o", "w.csv")
    assert (tame.code, tame.out.strip(), tame.err) == (0, "t.csv", "")
    assert wild.code == 0 and wild.out.strip() == "w.csv" and len(Path("w.csv").read_text().splitlines()) == 2001
    assert wild.err.startswith("warning: this motion leaves the spec's envelope") and "v reaches" in wild.err


def test_the_verb_says_which_share_is_cancelled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = (SPECS / "one_mass.yaml").read_text(encoding="utf-8").replace("duration: 12", "duration: 0.2")
    text = text.replace("simulation: ", "cancellation: {gain: 0.9}\nsimulation: ") + "  observer: true\n  cancel: 0.8\n"
    Path("s.yaml").write_text(text, encoding="utf-8")
    assert "cancels 0.72 of the friction estimate" in stiction("simulate", "s.yaml", "-o", "l.csv").err


SHIPPED = ("one_mass", "one_mass_domain", "rig", *(pytest.param(n, marks=pytest.mark.slow) for n in LONG))


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_machine_stays_where_its_certificate_speaks(name: str, tmp_path: Path) -> None:
    result = stiction("simulate", SPECS / f"{name}.yaml", "-o", tmp_path / "log.csv")
    assert (result.code, result.err) == (0, "")
    assert np.isfinite(np.genfromtxt(tmp_path / "log.csv", delimiter=",", skip_header=1)).all()

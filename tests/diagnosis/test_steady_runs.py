"""Records at one steady speed each, judged by their means: what is found below a ripple ten times as large."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import stiction
from codegen.diagnosis import diagnose
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.measure import measure
from codegen.diagnosis.fit.trial import Trial, part_of
from codegen.diagnosis.results import ErrorFigures
from codegen.diagnosis.steady import is_seen, is_static, means_of
from codegen.effects import CATALOGUE
from codegen.logs import read_logs
from tests.diagnosis.stage import system_of
from tests.slow_cases import slow_except

SPEC = """
name: screw
coordinates: {q: {velocity: v, unit: rad}}
inputs: {u: {unit: N*m}}
parameters:
  J: {value: 2e-6, unit: kg*m^2}
  b: {value: 0.02, unit: mN*m*s/rad, tolerance: 50%}
mass_matrix: [[J]]
force: [u - b*v]
friction: {distribution: [[1]], contacts: [{name: nut, law: coulomb, a: 0.003, unit: N*m}]}
log: {columns: {t: t, v: v, u: u}}
"""
LEVEL, SLOPE, RISE, SPEED = 3e-3, 2e-5, 8e-4, 3.0
TRAINED, HELD = (0.3, 1.0, 2.0, 3.5, 5.0, 8.0, 12.0, 18.0), (0.6, 1.5, 2.7, 4.2, 6.5, 10.0, 15.0, 20.0)
Array = NDArray[np.float64]


def record(
    file: Path, speed: float, rise: float, rng: np.random.Generator, both_ways: bool = True, slope: float = SLOPE
) -> Path:
    """500 rows at one speed: Coulomb, viscous and a Stribeck peak of this height, with waves in both columns.

    Unless ``both_ways``, the peak is there at positive speeds only.
    """
    rise = rise if both_ways or speed > 0 else 0.0
    t = 0.01 * np.arange(500)
    wave = np.sin(7 * speed * t + rng.uniform(0, 6))
    v = speed + 0.02 * wave + 0.01 * rng.standard_normal(len(t))
    u = np.sign(speed) * (LEVEL + rise * np.exp(-((speed / SPEED) ** 2))) + slope * speed
    u = u + 3e-4 * wave + 1e-4 * rng.standard_normal(len(t)) + 2e-5 * rng.standard_normal()
    np.savetxt(file, np.column_stack([t, v, u]), delimiter=",", header="t,v,u", comments="", fmt="%.9g")
    return file


def ladder(folder: Path, speeds: tuple[float, ...], rise: float, seed: int, *kind: Any) -> list[Path]:
    rng = np.random.default_rng(seed)
    return [record(folder / f"{seed}_{w * s:g}.csv", w * s, rise, rng, *kind) for s in speeds for w in (1, -1)]


def diagnosed(folder: Path, rise: float, tested: bool = True, both_ways: bool = True) -> dict[str, Any]:
    (folder / "spec.yaml").write_text(SPEC)
    train, test = ladder(folder, TRAINED, rise, 1, both_ways), ladder(folder, HELD, rise, 2, both_ways)
    result = stiction.diagnose(folder / "spec.yaml", train, test if tested else None, folder / "out")
    read: dict[str, Any] = json.loads((result.folder / "diagnosis.json").read_text())
    return read


def without_report(folder: Path, rise: float, both_ways: bool = True, slope: float = SLOPE) -> dict[str, Any]:
    """The content of diagnosis.json, without the pictures and pages beside it."""
    (folder / "spec.yaml").write_text(SPEC)
    spec = stiction.check(folder / "spec.yaml").spec
    train, test = (
        read_logs(ladder(folder, speeds, rise, seed, both_ways, slope), spec)
        for seed, speeds in ((1, TRAINED), (2, HELD))
    )
    return diagnose_log(spec, system_of(spec), train, test)[0].as_json()


@pytest.mark.parametrize("tested", slow_except([True, False], [True]))
def test_a_stribeck_peak_is_found_below_the_ripple(tmp_path: Path, tested: bool) -> None:
    found = diagnosed(tmp_path, RISE, tested)
    assert found["verdict"] == "effect"
    (effect,) = found["effects"]
    assert effect["kind"] == "stribeck"
    low, high = effect["intervals"]["delta"]
    assert low < RISE < high
    assert effect["parameters"]["v_s"] == pytest.approx(SPEED, rel=0.3)
    before, after = (found["error"][m]["residual_force_rms"] for m in ("declared", "augmented"))
    assert after < 0.25 * before and after < 6e-5  # the scatter of the means is 2e-5, the ripple 2e-4
    before, after = (found["error"][m]["free_run_position_rmse"] for m in ("declared", "augmented"))
    assert after < 0.7 * before  # by the mean input of a record; by the logged one the ripple decides
    assert "16 records" in found["sentence"] or not tested


def test_a_name_that_only_a_tolerance_prefers_is_ambiguous(tmp_path: Path) -> None:
    """Viscous friction is seven tolerances above the declared one, beside a Stribeck peak.

    Held near the declared value, it left a slope at high speeds that a quadratic drag explains better than the peak,
    and the drag was named. With viscous friction free the peak is better by far.
    """
    found = without_report(tmp_path, RISE, slope=9e-5)
    assert found["verdict"] == "ambiguous"
    assert found["sentence"].startswith(
        "Something is missing, but this log cannot tell quadratic_drag on q from stribeck on nut.\n"
    )
    (said,) = (fact["words"] for fact in found["facts"] if fact["words"].startswith("stribeck on nut fits with"))
    assert said == "stribeck on nut fits with b = 9.1e-05 N*m*s/rad, 7.1 tolerances from 2e-05."


@pytest.mark.slow
def test_a_peak_in_one_direction_only_is_found_as_such(tmp_path: Path) -> None:
    """As in a worm gear; a symmetric peak of half the height leaves half of it everywhere."""
    found = without_report(tmp_path, RISE, both_ways=False)
    assert found["verdict"] == "effect"
    (effect,) = found["effects"]
    assert effect["kind"] == "stribeck"
    forward, back = (effect["parameters"]["delta"] + s * effect["parameters"]["d_delta"] for s in (1, -1))
    assert forward == pytest.approx(RISE, rel=0.15) and abs(back) < 0.15 * RISE
    assert effect["parameters"]["v_s"] == pytest.approx(SPEED, rel=0.3)
    assert found["error"]["augmented"]["residual_force_rms"] < 6e-5


def test_a_ladder_without_a_peak_lacks_nothing(tmp_path: Path) -> None:
    found = without_report(tmp_path, 0.0)
    assert found["verdict"] == "none" and not found["effects"]


@pytest.mark.parametrize("rise", slow_except([RISE, 0.0], [RISE]))
def test_free_runs_of_steady_records_refuse_nothing(
    rise: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a screw drive a Stribeck peak reduced the held-out force errors to a third, and free runs refused it.

    Where friction falls with speed a run leaves its speed, whichever small residual is left. Here the free runs of all
    models but the declared one end three times as far off.
    """
    declared: list[object] = []

    def leaving(model: Any, *about: Any) -> ErrorFigures:
        declared[:] = declared or [model]
        found = measure(model, *about)
        rows = tuple(e if model is declared[0] else 3 * e + 1.0 for e in found.free_run_rmse_rows)
        return replace(found, free_run_rmse=max(rows), free_run_rmse_rows=rows)

    monkeypatch.setattr(diagnose, "measure", leaving)
    found = without_report(tmp_path, rise)
    assert [e["kind"] for e in found["effects"]] == (["stribeck"] if rise else [])
    before, after = (found["error"][m]["free_run_position_rmse"] for m in ("declared", "augmented"))
    assert after > before or not rise  # which is told all the same


def warmed_up(folder: Path, held_rise: float) -> dict[str, Any]:
    """The diagnosis with a peak and a drag in the training records, and a peak of ``held_rise`` alone in the others."""
    (folder / "spec.yaml").write_text(SPEC)
    spec = stiction.check(folder / "spec.yaml").spec
    files = ladder(folder, TRAINED, RISE, 1)
    for file in files:
        rows = np.loadtxt(file, delimiter=",", skiprows=1)
        rows[:, 2] += 1.5e-6 * rows[:, 1] * np.abs(rows[:, 1])
        np.savetxt(file, rows, delimiter=",", header="t,v,u", comments="", fmt="%.9g")
    train, test = (read_logs(some, spec) for some in (files, ladder(folder, HELD, held_rise, 2)))
    found: dict[str, Any] = diagnose_log(spec, system_of(spec), train, test)[0].as_json()
    return found


def test_a_further_effect_that_held_out_records_refuse_is_not_named(tmp_path: Path) -> None:
    """A worm gear was said to lack a drag too, with which the held-out records were predicted worse.

    Here friction in the training records rises at high speed, as when they warm up, and in the others it does not.
    """
    found = warmed_up(tmp_path, RISE)
    assert found["verdict"] == "effect" and [e["kind"] for e in found["effects"]] == ["stribeck"]
    (said,) = (fact["words"] for fact in found["facts"] if fact["topic"] == "not accepted")
    assert said.startswith("quadratic_drag on q, a further effect: on held-out data the residual force is")


def test_where_the_first_effect_is_refused_it_is_told_alone(tmp_path: Path) -> None:
    """It was told with the values that it has beside a second effect, which no held-out record had judged."""
    found = warmed_up(tmp_path, 0.0)
    assert found["verdict"] == "unknown"
    alone, (said,) = found["candidates"][0], (f["words"] for f in found["facts"] if f["topic"] == "not accepted")
    assert said.startswith(f"stribeck on nut (delta = {alone['parameters']['delta']:.2g} N*m, v_s = ")
    assert "on held-out data" in said and "further" not in said


def test_what_a_steady_speed_can_show_is_a_force_of_speed_alone(tmp_path: Path) -> None:
    """Not what the input makes: at an imposed speed the input is the friction, so any function of it explains it."""
    (tmp_path / "spec.yaml").write_text(SPEC)
    system = stiction.check(tmp_path / "spec.yaml").system
    assert is_static(system)
    seen = {
        kind
        for kind, effect in CATALOGUE.items()
        if not effect.refines
        and effect.sits_on in ("contact", "coordinate", "input")
        and effect.applies(system, 0)
        and is_seen(Trial(system, (part_of(effect, 0, system),), ()))
    }
    assert {"stribeck", "viscous", "offset", "quadratic_drag", "coulomb_asymmetry", "viscous_asymmetry"} <= seen
    assert not seen & {"load_dependent_friction", "input_gain", "saturation", "dead_zone", "cogging", "spring"}
    assert not seen & {"inertia_error", "friction_drift", "input_delay", "presliding", "position_dependent_friction"}


def turning_back(file: Path, rows: int = 500) -> Path:
    """A drive that starts, stops and turns back at 10 rad/s, without a Stribeck peak: its speed is not constant."""
    t = 0.01 * np.arange(rows)
    v = np.clip(30 * np.sin(2 * t), -10, 10)
    u = LEVEL * np.sign(v) + SLOPE * v
    np.savetxt(file, np.column_stack([t, v, u]), delimiter=",", header="t,v,u", comments="", fmt="%.9g")
    return file


def test_a_record_that_turns_back_is_no_steady_one(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(SPEC)
    spec = stiction.check(tmp_path / "spec.yaml").spec
    files = ladder(tmp_path, TRAINED, RISE, 1)
    means = means_of(read_logs(files, spec))
    assert means is not None and means.left_out == ()
    expected = [w * s for s in TRAINED for w in (1, -1)]
    assert means.speeds[:, 0] == pytest.approx(expected, rel=0.02, abs=0.01)
    assert means_of(read_logs(files[:6], spec)) is None
    among = means_of(read_logs([*files[:5], turning_back(tmp_path / "both.csv"), *files[5:]], spec))
    assert among is not None and among.left_out == ("both.csv",)
    assert np.array_equal(among.speeds, means.speeds) and np.array_equal(among.inputs, means.inputs)
    assert means_of(read_logs([*files, turning_back(tmp_path / "long.csv", 3000)], spec)) is None


def test_a_start_and_stop_among_steady_records_changes_no_verdict(tmp_path: Path) -> None:
    """With it all samples were judged, of which most of the residual is ripple, and the peak was not named."""
    (tmp_path / "spec.yaml").write_text(SPEC)
    spec = stiction.check(tmp_path / "spec.yaml").spec
    train, test = ladder(tmp_path, TRAINED, RISE, 1), ladder(tmp_path, HELD, RISE, 2)
    both = turning_back(tmp_path / "both.csv")
    logs = [read_logs(files, spec) for files in ([*train, both], test, [*test, both])]
    for tested in logs[1:]:
        found = diagnose_log(spec, system_of(spec), logs[0], tested)[0].as_json()
        assert [e["kind"] for e in found["effects"]] == ["stribeck"]
        (note,) = [f["words"] for f in found["facts"] if f["topic"] == "note"]
        assert "Each of the 16 records" in note and "both.csv does not" in note
        assert found["error"]["augmented"]["relative_force_error"] < 0.03

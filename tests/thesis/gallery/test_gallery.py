"""Figures against independent computations: closed forms, SciPy's integrator, hand-written sampled observers."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from codegen.simulate.loop_run import LoopRun
from codegen.thesis.gallery import rig, runs, servo
from codegen.thesis.gallery.build import MODULES, figure_specs, make_figure, run_gallery
from codegen.thesis.gallery.measures import hang_off
from codegen.thesis.gallery.page import KEPT, PAGE, gallery_page, is_of, read_kept, write_gallery
from codegen.thesis.gallery.rig import CHAPTER_3, NAMES
from codegen.thesis.gallery.runs import Runs, ideal_run, reference_of, servo_run
from codegen.thesis.gallery.setting import AS_DRAWN, Setting, with_observer, without_friction
from codegen.thesis.gallery.statement import read_figures
from tests.expected_errors import refused

ROOT = Path(__file__).parents[3]
CHAPTERS = {1: "12", 2: "345", 3: "234", 4: "3457", 5: "1", 6: "1", 7: "12", 8: "3456"}
WANTED = [f"{chapter}.{k}" for chapter, figures in CHAPTERS.items() for k in figures]
QUIET = Setting("quiet", noise=0.0)


def specs_of(number: str):
    return figure_specs(read_figures()[number])


def gallery_command(*options: str) -> subprocess.CompletedProcess[str]:
    """``stiction gallery`` in a process of its own, which may use several."""
    command = [sys.executable, "-m", "codegen.app.cli", "gallery", *options]
    return subprocess.run(
        command, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False
    )


def ideal_response(t):
    """Unit step of x'' = 200 (1 − x) − 20 x'."""
    return 1 - np.exp(-10 * t) * (np.cos(10 * t) + np.sin(10 * t))


def test_every_figure_has_specs_a_picture_and_a_measure_for_each_statement():
    assert list(read_figures()) == WANTED
    folder = ROOT / "docs" / "gallery"
    for number, text in read_figures().items():
        assert specs_of(number)
        module, made = MODULES[text.made.module], text.made
        named = (made.runs, made.draws, *(s.measure for s in text.statements))
        assert all(callable(getattr(module, name)) for name in named), number
        assert (folder / f"figure_{number.replace('.', '_')}.png").is_file()
    rows = [r for r in (folder / "README.md").read_text(encoding="utf-8").splitlines() if r.startswith("| [")]
    assert len(rows) == sum(len(text.statements) for text in read_figures().values())
    assert sum(p.stat().st_size for p in folder.iterdir()) < 4e6


def test_the_ideal_servo_moves_as_the_linear_system_does():
    run = ideal_run(specs_of("2.3")[0], AS_DRAWN)
    first = run.time < 1
    error = run.true_positions[first, 0] - ideal_response(run.time[first])
    assert np.max(np.abs(error)) < 0.02  # the input is held for 1 ms, and the first sample sees a reference of 0


def test_the_mass_sticks_where_an_event_integrator_lets_it():
    """SciPy slides the mass of figure 2.3 from rest until its velocity is zero again."""

    def rates(t, y):
        x, v = y
        return [v, 200 * (1 - x) - 20 * v - (40 + 20 * np.exp(-abs(v)) + 2 * abs(v))]

    def stops(t, y):
        return y[1] if t > 0.01 else 1.0

    stops.terminal = True
    x = solve_ivp(rates, (0, 1), [0, 0], events=stops, rtol=1e-10, atol=1e-12).y[0, -1]
    assert 200 * (1 - x) < 60  # the contact holds it there
    run = servo_run(specs_of("2.3")[0], QUIET, cancel=None)
    assert run.true_positions[990, 0] == pytest.approx(x, abs=3e-3)
    runs = Runs(specs_of("2.3"), QUIET, {"a": run, "ideal": ideal_run(specs_of("2.3")[0], QUIET)})
    assert servo.hang_off_without(runs).value == pytest.approx(1 - x, abs=6e-3)


def cfo_by_hand(run: LoopRun, k_F: float, mu: int, h: float):
    """(2.6)–(2.8) by explicit Euler over the measurements and inputs of a run, from no friction."""
    z, forces = k_F * abs(run.velocities[0, 0]) ** mu, []
    for v, w in zip(run.velocities[:, 0], run.inputs[:, 0], strict=True):
        forces.append((z - k_F * abs(v) ** mu) * np.sign(v))
        z += h * k_F * mu * abs(v) ** (mu - 1) * (w - forces[-1]) * np.sign(v)
    return np.array(forces)


@pytest.mark.parametrize(("place", "k_F", "mu"), [(1, 10, 1), (3, 10, 2)])
def test_the_loop_of_figure_2_4_is_the_printed_one(place: int, k_F: float, mu: int):
    run = servo_run(specs_of("2.4")[place], AS_DRAWN)
    by_hand = cfo_by_hand(run, k_F, mu, 1e-3)
    assert np.max(np.abs(run.friction_estimate[:, 0] - by_hand)) < 1e-7
    assert np.max(np.abs(by_hand)) > 40
    reference = np.where(np.sin(np.pi * run.time) > 0, 1, -1)
    servo = -200 * (run.positions[:, 0] - reference) - 20 * run.velocities[:, 0]
    between_jumps = np.abs(np.sin(np.pi * run.time)) > 1e-6
    assert np.max(np.abs(run.inputs[:, 0] - servo - by_hand)[between_jumps]) < 1e-7


@pytest.mark.slow
def test_higher_k_F_comes_closer_to_the_closed_form():
    t = np.arange(0, 1, 1e-3)
    runs = [servo_run(spec, AS_DRAWN) for spec in specs_of("2.4")[:3]]
    low, middle, high = [np.sqrt(np.mean((r.true_positions[:1000, 0] - ideal_response(t)) ** 2)) for r in runs]
    assert high < middle < low


def test_the_printed_gains_lie_on_the_stability_boundary_of_the_rig():
    """The TO's own update of (z_v, z) by hand: v̂ = z_v + k_v x, F̂ = z + k₂ v̂."""
    h, k_2, k_v = 0.01, -100.0, 100.0
    update = np.eye(2) + h * np.array([[-k_v - k_2, -1.0], [k_2 * k_2, k_2]])
    assert np.abs(np.linalg.eigvals(update)) == pytest.approx([1, 1], abs=1e-12)
    reading = rig.on_the_boundary(Runs(specs_of("8.4"), AS_DRAWN))
    assert dict(reading.parts)["spectral radius"] == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize(("delay", "radius"), [(0, 0.956), (1, 1.182)])
def test_a_servo_without_cancellation_is_the_linear_loop_of_an_estimate_in_time_and_of_a_late_one(delay, radius):
    """Plant under an exact hold, TO and servo (8.15) by hand, state (x, v, z_v, z, v̂ of the sample before)."""
    h, k_2, k_v, g_1, g_2 = 0.01, -100.0, 100.0, 200.0, 50.0
    spec = without_friction(with_observer(specs_of("8.4")[1], "to", CHAPTER_3))
    spec = replace(spec, simulation=replace(spec.required_simulation, encoder_step={}))
    run = servo_run(spec, QUIET, 0.0, spec, delay=delay)
    speed = np.array([k_v, 0, 1, 0, 0])
    force = np.array([0, 0, 0, 1, 0]) + k_2 * speed
    command = -g_1 * np.eye(5)[0] - g_2 * (np.eye(5)[4] if delay else speed)
    pushed = np.array([h**2 / 2, h, h, -h * k_2, 0])
    update = np.array([[1, h, 0, 0, 0], [0, 1, 0, 0, 0], [0, 0, 1, 0, 0], [0, 0, 0, 1, 0], speed])
    update[2] -= h * (force + k_v * speed)
    update[3] += h * k_2 * force
    update += np.outer(pushed, command)
    assert np.max(np.abs(np.linalg.eigvals(update))) == pytest.approx(radius, abs=5e-4)
    state, by_hand = np.zeros(5), []
    for r in reference_of(spec, 60):
        by_hand.append(state)
        state = update @ state + pushed * g_1 * r
    by_hand = np.array(by_hand)
    assert np.max(np.abs(by_hand[:, 0])) > 0.5
    assert run.true_positions[:60, 0] == pytest.approx(by_hand[:, 0], rel=1e-6, abs=1e-9)
    assert run.friction_estimate[:60, 0] == pytest.approx(by_hand @ force, rel=1e-6, abs=1e-7)


def test_hang_off_of_a_known_motion():
    time = np.arange(0, 8, 0.01)
    target = np.where(np.mod(time, 4) < 2, 1.0, -1.0)
    run = ideal_run(specs_of("2.3")[0], Setting("10 ms", step=0.01))
    made = replace(run, time=time, true_positions=(target * np.where(time < 4, 0.9, 0.7))[:, None])
    assert hang_off(made, target, 2.0, 0, 4) == pytest.approx(0.1)
    assert hang_off(made, target, 2.0, 4, 8) == pytest.approx(0.3)


def test_the_page_is_what_the_last_runs_gave_and_the_claims_ask():
    """No run: a changed claim, condition, setting or template shows here until `stiction gallery` has been run."""
    folder = ROOT / "docs" / "gallery"
    kept = read_kept(folder)
    assert [n for n, text in read_figures().items() if not is_of(kept[n], text)] == []
    assert (folder / PAGE).read_text(encoding="utf-8") == gallery_page(kept)


def test_readings_of_another_condition_or_setting_are_not_of_the_figure():
    text = read_figures()["8.4"]
    kept = read_kept(ROOT / "docs" / "gallery")["8.4"]
    assert is_of(kept, text)
    assert not is_of({**kept, "settings": kept["settings"][1:]}, text)
    assert not is_of({**kept, "rows": [{**kept["rows"][0], "condition": "> 2"}, *kept["rows"][1:]]}, text)


@pytest.mark.slow
def test_a_figure_is_the_same_bytes_twice_and_alone_leaves_the_table(tmp_path: Path):
    first, second = make_figure("1.1"), make_figure("1.1")
    assert first.picture == second.picture
    assert first.picture.startswith(b"\x89PNG") and b"Software" not in first.picture
    assert all(v.holds for v in first.verdicts)
    assert write_gallery([first], tmp_path) == (tmp_path / "figure_1_1.png", tmp_path / KEPT)
    assert not (tmp_path / "README.md").exists()
    assert list(read_kept(tmp_path)) == ["1.1"]
    shutil.copy(ROOT / "docs" / "gallery" / KEPT, tmp_path / KEPT)
    assert tmp_path / "README.md" in write_gallery([first], tmp_path)
    (tmp_path / "README.md").write_text("# My project\n")
    with refused("FILE004"):
        write_gallery([first], tmp_path)
    assert (tmp_path / "README.md").read_text() == "# My project\n"
    (tmp_path / KEPT).write_text("{", encoding="utf-8")
    with refused(f"FILE004 {KEPT}"):
        write_gallery([first], tmp_path)


def with_error(error: float):
    """A stand-in for ``pid_run``: a run that is off the ideal by so much all the time."""
    return SimpleNamespace(true_positions=np.full((5, 1), error))


@pytest.mark.parametrize("best", [(900.0, 30.0, 2000.0), (30000.0, 90.0, 300000.0)])
def test_the_tuned_pid_is_where_the_larger_of_both_distances_is_least(best, monkeypatch: pytest.MonkeyPatch):
    """In closed form, Δ of logarithms: a bowl 1 + Δ₁² + 3 Δ₂² + 2 Δ₃² with friction, a slope without."""
    spec = specs_of("2.4")[0]

    def run(spec, setting, ideal, gains, machine, seed, substeps):
        off = np.log(np.array(gains) / best)
        frictionless = machine.contacts[0].law_level.subs(machine.values) == 0
        return with_error(1 + 10 * max(0.0, off[1] + 0.7) if frictionless else 1 + off @ np.diag([1, 3, 2]) @ off)

    monkeypatch.setattr(runs, "pid_run", run)
    found = np.array(runs.tuned_pid(spec, AS_DRAWN, with_error(0.0)))
    crossing = (10 - np.sqrt(184)) / 6  # of 3 Δ₂² and 10 (Δ₂ + 0.7)
    assert np.log(found / best) == pytest.approx([0, crossing, 0], abs=0.15)


def test_figures_that_share_a_pid_have_one_machine_servo_and_sensors():
    def tuned_for(number: str):
        spec = specs_of(number)[1 if number.startswith("8") else 0]
        assert spec.observer is not None
        quiet = replace(spec.simulation, observer=False, cancel=None)
        frictionless = without_friction(replace(spec, observer=None, simulation=quiet))
        parts = (spec.observer.velocity, spec.observer.sample_time, spec.contacts if number < "8" else None)
        return (
            parts,
            quiet,
            frictionless.parameters,
            frictionless.force,
            frictionless.mass_matrix,
            frictionless.contacts,
        )

    pairs = [(number, text.made.pid_of) for number, text in read_figures().items() if text.made.pid_of]
    assert pairs == [("2.5", "2.4"), ("3.4", "3.3"), ("8.4", "8.3"), ("8.5", "8.3"), ("8.6", "8.3")]
    for number, other in pairs:
        assert tuned_for(number) == tuned_for(other)


def test_a_pid_without_an_optimum_is_not_called_tuned(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(runs, "pid_run", lambda *_: with_error(1.0))
    with pytest.raises(ValueError, match="no optimum of the PID's gains"):
        runs.tuned_pid(specs_of("2.4")[0], AS_DRAWN, with_error(0.0))


def rig_of(force, estimate, name: str = "TO") -> Runs:
    """Runs of the rig with given forces at 100 Hz, the velocity a sine of 4 s, the plates together after 8 s."""
    time = np.arange(0, 16, 0.01)
    v = np.sin(np.pi * (time + 0.005) / 2)
    columns = {"friction": force(time, v)[:, None], "true_velocities": v[:, None]}
    made = SimpleNamespace(time=time, friction_estimate=estimate(time, v)[:, None], **columns)
    names = [n + off for n in NAMES for off in ("", "_off")]
    return Runs(specs_of("8.3"), AS_DRAWN, dict.fromkeys(names, made), None, {"half": 8.0, "end": 16.0})


def test_overcompensation_is_weighed_by_the_force_and_leaves_out_the_start():
    def estimate(t, v):
        return np.where(np.mod(t, 8) < 4, 0, 1.2 * 10 * np.sign(v))

    found = rig.to_overcompensates(rig_of(lambda t, v: 10 * np.sign(v), estimate))
    assert found.value == pytest.approx(0.2, abs=1e-3)


@pytest.mark.parametrize(("width", "change"), [(1.0, 0.0), (3.0, 2.0)])
def test_the_area_of_the_loop_does_not_know_of_the_level(width: float, change: float):
    """F̂ = level sgn v + width cos: a loop of area π width for each cycle, whatever the level."""

    def estimate(t, v):
        late = t >= 8
        return np.where(late, 30, 10) * np.sign(v) + np.where(late, width, 1) * np.cos(np.pi * (t + 0.005) / 2)

    found = rig.loop_stays(rig_of(lambda t, v: v, estimate))
    assert found.value == pytest.approx(change, abs=0.02)


def test_a_setting_scales_gains_the_assumed_law_and_the_machine_but_not_the_machine_s_law():
    setting = Setting("all", slower=2, factors={"K_v": 0.4, "c": 1.5, "J": 2.0})
    rig, _, _, dfo, _ = (setting.applied(spec) for spec in specs_of("8.3"))
    assert rig.contacts[0].parameters["c"] == 20 and float(dfo.contacts[0].parameters["c"]) == 1.5
    assert float(dfo.observer.gains["K_v"]) == 20 and float(dfo.observer.gains["K_a"]) == -5
    assert rig.parameters[0].value == dfo.parameters[0].value == 2
    assert rig.simulation.duration == 32
    assert np.array_equal(reference_of(rig, 3200)[::2], reference_of(specs_of("8.3")[0], 1600))
    assert len(ideal_run(specs_of("8.3")[1], setting).time) == 3200


def test_a_number_that_is_not_finite_meets_no_condition():
    below, above = (
        next(s for text in read_figures().values() for s in text.statements if s.holds.startswith(sign))
        for sign in "<>"
    )
    for value in (np.nan, np.inf, -np.inf):
        assert not below.is_met(value) and not above.is_met(value)
    assert below.is_met(np.float64(-1e9)) is True and above.is_met(np.float64(1e9)) is True


@pytest.mark.slow
def test_an_unknown_figure_is_refused():
    with refused("CALL001 9.9"):
        run_gallery(["9.9"], print)
    done = gallery_command("--only", "2.6")
    assert done.returncode == 2
    assert "2.6" in done.stderr and "Traceback" not in done.stderr


@pytest.mark.slow
def test_the_whole_gallery_gives_the_verdicts_of_the_page(tmp_path):
    page = (ROOT / "docs" / "gallery" / "README.md").read_text(encoding="utf-8")
    rows = [line.split(" | ") for line in page.splitlines() if line.startswith("| [")]
    made = json.loads(gallery_command("-o", str(tmp_path), "--json").stdout)
    verdicts = [row["holds"] for figure in made["figures"].values() for row in figure["rows"]]
    assert verdicts == [row[4].startswith("holds") for row in rows]

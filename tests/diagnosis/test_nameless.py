"""Laws that no effect describes: a torque ripple that grows with the current is no friction, a slip no spring."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.results import Diagnosis
from codegen.diagnosis.selection.candidate_fits import every_part, fit_candidates
from codegen.diagnosis.selection.forward_selection import within_reach
from codegen.diagnosis.verdict import in_place
from codegen.diagnosis.verdict.in_place import Rival, nameless_rival
from codegen.effects import CATALOGUE
from codegen.effects.nameless import NAMELESS, effect_called
from codegen.logs import Log, read_log
from codegen.simulate.closed_loop import simulate
from codegen.simulate.loop_run import write_log
from codegen.spec import Spec, parse_spec
from tests.diagnosis.fakes import InRound, Placed
from tests.diagnosis.stage import TEST, TRAIN, among, log_of, stage, system_of
from tests.slow_cases import slow_except

LEVEL, PERIOD = 25.0, 0.06
"""Friction takes most of the drive force: the inertia takes 6 N at most, the damping 5 N."""
WAVE = f"{{amplitude: 5.0, period: {PERIOD}, phase: 0.4}}"
OF_POSITION = ("position_dependent_friction", "cogging", "offset")


def machine(effects: str = "", share: float = 0.0, reference: str = TRAIN, duration: float = 14.0) -> Spec:
    """The stage with a motor whose force is 1 + share·sin(2π x/period) times the commanded one."""
    text = stage(f"[{effects}]", LEVEL, reference, duration).text
    text = text.replace("  b: {", f"  p: {{value: {PERIOD}, unit: m}}\n  b: {{")
    return parse_spec(text.replace("[w - b*v]", f"[w*(1 + {share}*sin(2*pi*x/p)) - b*v]"), Path("stage.yaml"))


def diagnosed(folder: Path, effects: str = "", share: float = 0.0, reference: str = TRAIN) -> Diagnosis:
    train = log_of(machine(effects, share, reference), folder, "train.csv")
    test = log_of(machine(effects, share, TEST if reference == TRAIN else reference, 10.0), folder, "test.csv")
    spec = stage(level=LEVEL)
    with among(*OF_POSITION):
        return diagnose_log(spec, system_of(spec), train, test)[0]


def test_a_ripple_in_proportion_to_the_drive_force_is_not_named_as_friction(tmp_path: Path) -> None:
    diagnosis = diagnosed(tmp_path, share=0.2)
    assert diagnosis.verdict == "unknown" and not diagnosis.effects
    (reason,) = diagnosis.statement.of("not accepted")
    assert "in proportion to the drive force and periodic in position (amplitude 20" in reason
    assert f"period {PERIOD:.3g} m)" in reason
    assert "better than position_dependent_friction on rail" in reason
    assert any("under another load" in words for words in diagnosis.statement.of("next"))


TRUE = [("position_dependent_friction", "rail"), ("cogging", "x")]


@pytest.mark.parametrize(("kind", "on"), slow_except(TRUE, TRUE[:1], several=True))
def test_a_true_effect_over_position_keeps_its_name(kind: str, on: str, tmp_path: Path) -> None:
    diagnosis = diagnosed(tmp_path, f"{{kind: {kind}, on: {on}, parameters: {WAVE}}}")
    assert diagnosis.verdict == "effect" and [e.kind for e in diagnosis.effects] == [kind]


def test_no_spec_can_declare_a_force_without_a_name() -> None:
    assert not NAMELESS.keys() & CATALOGUE.keys()
    assert all(effect_called(kind) is effect for kind, effect in (NAMELESS | CATALOGUE).items())
    named = {kind for effect in CATALOGUE.values() for kind in effect.nameless}
    assert named == NAMELESS.keys() and not any(effect.nameless for effect in NAMELESS.values())


def test_a_rare_law_keeps_an_effect_from_its_name_only_where_it_fits_better(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cogging put into a pendulum's log of 13 segments fitted as well as a force in proportion to |drive|."""
    for name, value in {"tied_by_free_runs": True, "preferred_by_force": False}.items():
        monkeypatch.setattr(in_place, name, lambda *_, value=value: value)

    def counts(kind: str, is_better: bool) -> bool:
        monkeypatch.setattr(in_place, "runs_prefer", lambda *_: is_better)
        law: Any = InRound(found=SimpleNamespace(part=Placed(kind=kind)))
        return in_place._counts(law, law, law)

    assert not counts("load_wave", False) and counts("load_wave", True)
    assert counts("drive_force_wave", False) and counts("drive_force_over_position", False)


SLIPPING = """\
name: stage
coordinates:
  x: {velocity: v, unit: m}
  z: {velocity: u, unit: m}     # the load, which no log shows
inputs:
  w: {unit: N}
parameters:
  m: {value: 0.9, unit: kg}
  m_load: {value: 1.1, unit: kg}
  b: {value: 6, unit: N*s/m}
mass_matrix: [[m, 0], [0, m_load]]
force: [w - b*v, 0]
friction:
  distribution: [[1, 1], [0, -1]]
  contacts:
    - {name: rail, law: coulomb, a: 4, unit: N}
    - {name: belt, law: coulomb, a: 1.6, unit: N}
simulation:
  duration: 10
  sample_time: 0.002
  reference: {x: "0.2*sin(2*pi*0.4*t) + 0.06*sin(2*pi*1.1*t)"}
  position_gain: {w: 900}
  velocity_gain: {w: 30}
  encoder_step: {x: 2e-6, z: 2e-6}
"""
"""The stage with more than half of its inertia driven by friction, which holds up to 1.5 m/s^2."""


SPRING = "{kind: compliance, on: x, parameters: {k: 400, c: 3, load_fraction: 0.55}}"
DRAGGED = "{kind: compliance, on: x, parameters: {k: 2, c: 12, load_fraction: 0.55}}"
"""A load that little but a damper moves."""


def rival_of_compliance(log: Log) -> Rival | None:
    """The law without a name that the log prefers to a compliance, which is fitted to it in any case."""
    system, motion = system_of(stage()), smooth_motion(log)
    search, base = within_reach(search_on(Problem(system, motion, {}), lambda share: record_of(motion, log, share)))
    parts = [part for part in every_part(search, ()) if part.kind == "compliance"]
    return nameless_rival(search, fit_candidates(search, base, parts)[0])


def test_a_load_that_slips_is_not_one_behind_a_spring(tmp_path: Path) -> None:
    """The plant's friction is set-valued, and the law without a name is not."""
    plant = parse_spec(SLIPPING, Path("slipping.yaml"))
    write_log(tmp_path / "slipping.csv", plant, simulate(plant, system_of(plant)))
    found = rival_of_compliance(read_log(tmp_path / "slipping.csv", stage()))
    assert (
        found is not None
        and found.better
        and (found.part.kind, found.rival.part.kind)
        == (
            "compliance",
            "slipping_load",
        )
    )
    assert found.rival.parameters["load_fraction"] == pytest.approx(0.55, rel=0.2)
    assert found.rival.parameters["limit"] == pytest.approx(1.6, rel=0.2)


@pytest.mark.parametrize("effect", [SPRING, DRAGGED])
def test_a_load_behind_a_spring_or_a_damper_is_not_one_that_slips(effect: str, tmp_path: Path) -> None:
    assert rival_of_compliance(log_of(stage(f"[{effect}]", duration=10.0), tmp_path, "sprung.csv")) is None


LOADED = " - c*abs(w)*v"
DRAG = "{kind: quadratic_drag, on: x, parameters: {c: 10}}"
DAMPER = "{kind: viscous, on: rail, parameters: {b: 8}}"


def rival_of_damping(kind: str, plant: Spec, folder: Path, off: float = 1.0) -> Rival | None:
    """The law without a name that the log prefers to a damping of this kind, which is fitted to it in any case.

    ``off``: factor on the fitted coefficient, as where it is that of the force residual.
    """
    log = log_of(plant, folder, "damped.csv")
    system, motion = system_of(stage()), smooth_motion(log)
    search, base = within_reach(search_on(Problem(system, motion, {}), lambda share: record_of(motion, log, share)))
    parts = [part for part in every_part(search, ()) if part.kind == kind][:1]
    found = fit_candidates(search, base, parts)[0]
    if off == 1.0:
        return nameless_rival(search, found)
    theta = found.theta.copy()
    theta[-1] *= off
    unprojected = found.residual_of(found.runner, theta)
    moved = replace(found, theta=theta, unprojected=unprojected, residual=found.starts.project(unprojected))
    return nameless_rival(search, moved)


@pytest.mark.parametrize(("kind", "rival"), [("quadratic_drag", "drive_drag"), ("viscous", "drive_viscous")])
def test_a_damping_in_proportion_to_the_drive_force_is_no_drag(kind: str, rival: str, tmp_path: Path) -> None:
    text = stage(duration=10.0).text.replace("  b: {", "  c: {value: 0.5, unit: s/m}\n  b: {")
    plant = parse_spec(text.replace("[w - b*v]", f"[w - b*v{LOADED}]"), Path("loaded.yaml"))
    found = rival_of_damping(kind, plant, tmp_path)
    assert found is not None and found.better and found.rival.part.kind == rival
    assert found.rival.parameters["c"] == pytest.approx(0.5, rel=0.05)


@pytest.mark.parametrize("off", slow_except([1.0, 0.2], [0.2]))
@pytest.mark.parametrize(("kind", "effect"), [("quadratic_drag", DRAG), ("viscous", DAMPER)])
def test_a_true_damping_keeps_its_name(kind: str, effect: str, off: float, tmp_path: Path) -> None:
    """Also where its coefficient is not that of free runs, to which the law without a name is fitted."""
    assert rival_of_damping(kind, stage(f"[{effect}]", duration=10.0), tmp_path, off) is None

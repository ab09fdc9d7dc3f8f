"""A machine without inputs, as a pendulum that swings out: its forces are compared with mass times acceleration."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.evidence.residual_regression import remainders
from codegen.diagnosis.fit.measure import driving_force_name
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.results import Remainder
from codegen.diagnosis.verdict.wrong_values import explaining_values
from codegen.effects.declare import system_of
from codegen.logs import read_log
from codegen.spec import parse_spec
from tests.diagnosis.stage import among, competing
from tests.diagnosis.statements import statement_of
from tests.slow_cases import slow_except

J, MGL, LEVEL = 0.01, 0.3, 8e-4
STEP = 2 * np.pi / 16384

SPEC = f"""
name: swing
coordinates: {{q: {{velocity: w, unit: rad}}}}
inputs: {{}}
parameters:
  J: {{value: {J}, unit: kg*m^2}}
  mgl: {{value: {1.1 * MGL}, unit: N*m, tolerance: 20 %}}
mass_matrix: [[J]]
force: [-mgl*sin(q)]
friction:
  distribution: [[1]]
  contacts: [{{name: hinge, law: coulomb, a: {1.5 * LEVEL}, unit: N*m}}]
observer: {{kind: cfo, velocity: estimated, gains: {{K_F: 0.5, K_v: 50}}, sample_time: 5 ms}}
envelope: {{w: [-8, 8], q: [-2, 2]}}
"""


def swing_out(
    viscous: float,
    seconds: float,
    h: float = 0.005,
    start: float = 1.2,
    step: float = STEP,
    fine: int = 50,
    gusts: float = 0.0,
) -> str:
    """A log of t and q from rest at ``start`` rad, in steps of an encoder; integrated by small semi-implicit steps."""
    q, w, rows = start, 0.0, ["t,q"]
    for k in range(round(seconds / h)):
        rows.append(f"{k * h:.3f},{step * np.floor(q / step):.6f}")
        gust = gusts * (np.sin(7.3 * k * h) + np.sin(11.9 * k * h + 1))
        for _ in range(fine):
            push = gust - MGL * np.sin(q) - viscous * w
            w += h / fine * (push - LEVEL * np.tanh(w / 1e-3)) / J
            q += h / fine * w
    return "\n".join(rows) + "\n"


@competing("viscous", "spring", "quadratic_drag")
@pytest.mark.parametrize("viscous", slow_except((2e-3, 0.0), (2e-3,)))
def test_damping_is_found_in_a_free_swing(viscous: float, tmp_path: Path, kinds: tuple[str, ...]) -> None:
    spec = parse_spec(SPEC, tmp_path / "swing.yaml")
    (tmp_path / "log.csv").write_text(swing_out(viscous, 12.0))
    with among(*kinds):
        found, models = diagnose_log(spec, system_of(spec), read_log(tmp_path / "log.csv", spec))
    assert found.verdict == ("effect" if viscous else "none"), found.sentence
    assert [e.kind for e in found.effects] == (["viscous"] if viscous else [])
    if viscous:
        (b,) = found.effects[0].parameters.values()
        assert b == pytest.approx(viscous, rel=0.1)
    written = {s.name: float(v) for s, v in models.augmented.values.items()}
    assert written["mgl"] == pytest.approx(MGL, rel=0.02)
    # A tenth of the weight is a tenth of the force that turns the pendulum; there is no drive force to compare with.
    (changed,) = re.findall(r"changes\s+the\s+force\s+by\s+([\d.]+)\s+%", found.sentence)
    assert 5 < float(changed) < 15
    assert 0.0 < found.augmented.relative_force < 0.2
    refused = [c.why_not for c in found.candidates]
    assert "of the inertial force M a" in found.sentence
    assert not [words for words in (found.sentence, *refused) if "drive force" in words]


def test_a_file_named_like_the_force_keeps_its_name_where_no_input_drives_the_machine() -> None:
    """Its statement said "inertial force M a.csv": the noun was replaced in finished sentences."""
    said = statement_of(
        "none",
        Remainder(0.1, 0.11, 0.5, {"position": 0.5}),
        drive=driving_force_name(system_of(parse_spec(SPEC, Path("swing.yaml")))),
        changes=["from 1 s to 2 s of drive force.csv a force of +0.1 N acts that the model lacks"],
    ).text
    assert "from 1 s to 2 s of drive force.csv" in said.lower() and "11 % of the inertial force M a" in said


@pytest.mark.parametrize("start", [0.133, 0.141, 0.15, 0.128, 0.137, 0.155])
def test_rounding_by_a_coarse_encoder_is_noise_and_no_vibration(start: float, tmp_path: Path) -> None:
    """Near the cutoff it is strongest, as a vibration would be, and the weight has the same noise of the position."""
    right = SPEC.replace(f"value: {1.1 * MGL}", f"value: {MGL}").replace(f"a: {1.5 * LEVEL}", f"a: {LEVEL}")
    spec = parse_spec(right, tmp_path / "swing.yaml")
    (tmp_path / "log.csv").write_text(swing_out(0.0, 4.5, 0.01, start, 4 * STEP))
    problem = Problem(system_of(spec), smooth_motion(read_log(tmp_path / "log.csv", spec), 10.0), {})
    (left,) = remainders(problem.system, problem.motion, problem.used)
    assert left.share > 0.05  # of mass times acceleration
    assert left.over["ringing"] == left.over["frequency"] == 0.0
    assert left.nature(0.02) == "noise", left


def test_a_mass_that_scales_the_whole_equation_explains_nothing(tmp_path: Path) -> None:
    """A mass near zero, or below, leaves a residual force near zero whatever is lacking, but not the acceleration."""
    own = """  m: {value: 0.04, unit: kg}
  l2: {value: 0.25, unit: m^2, tolerance: 1 %}
  gl: {value: 7.5, unit: m^2/s^2, tolerance: 1 %}
"""
    text = SPEC.replace("[[J]]", "[[m*l2]]").replace("-mgl*sin(q)", "-m*gl*sin(q)")
    spec = parse_spec(re.sub("  J: .*\n  mgl: .*\n", own, text), tmp_path / "swing.yaml")
    (tmp_path / "log.csv").write_text(swing_out(0.0, 12.0, gusts=0.05))
    problem = Problem(system_of(spec), smooth_motion(read_log(tmp_path / "log.csv", spec)), {})
    assert explaining_values(spec, problem.system, problem) == []

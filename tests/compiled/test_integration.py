"""The four ways to step an observer: bits of C and twin, an error that moves as certified, an estimate that arrives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.analysis.analysis import analyse
from codegen.analysis.operating_points import evaluate
from codegen.certify.certify import Certificate, certify
from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.spec.reader import parse_spec
from tests.slow_cases import slow_except

from .build import Built, motion, same_bits
from .specs import SPECS, spec_text

STEPS = ("semi_implicit", "exponential", "implicit")
GAINS = {
    "cfo": "{K_F: 10, K_v: 100}",
    "to": "{K_1: -40, K_2: -6, K_v: 50}",
    "gcfo": "{K_F: [500, 700], K_v: [10, 14]}",
    "gto": "{K_1: [0, -3], K_2: [-200, -900], K_v: [10, 14]}",
    "mgto": "{K_1: [[0, 0], [0, 0]], K_2: [[-200, 0], [-90, -80]], K_v: [10, 14]}",
}
CASES = [
    (name, kind, step)
    for name, kinds in {"one_mass": ("cfo", "to"), "two_mass": ("gcfo", "gto", "mgto")}.items()
    for kind in kinds
    for step in STEPS
] + [("one_mass", "cfo measured", "implicit"), ("two_mass", "gcfo measured", "implicit")]


def text_of(name: str, kind: str, step: str, h: float = 0.001) -> str:
    """A shipped spec with another observer; velocity is estimated unless the kind says otherwise."""
    lines = spec_text(name).splitlines(keepends=True)
    start = next(i for i, line in enumerate(lines) if line.startswith("observer:"))
    end = next(i for i, line in enumerate(lines) if line.startswith("envelope:"))
    kind, _, velocity = kind.partition(" ")
    gains = GAINS[kind] if not velocity else "{K_F: 12}" if kind == "cfo" else "{K_F: [500, 700]}"
    made = f"observer: {{kind: {kind}, velocity: {velocity or 'estimated'}, gains: {gains}, sample_time: {h}, "
    return "".join([*lines[:start], made + f"integration: {step}}}\n", *lines[end:]])


# each observer and each step, on one machine or the other
QUICK = [c for c in CASES if c[0] == "one_mass" or c[2] == "implicit" or c[1:] == ("mgto", "exponential")]


@pytest.mark.parametrize(("name", "kind", "step"), slow_except(CASES, QUICK, several=True))
def test_the_error_moves_as_the_sampled_matrix_says(tmp_path: Path, name: str, kind: str, step: str) -> None:
    """Two observers see the same motion from states that differ: what is between them obeys Φ, for g is linear in v.

    Their C and their twin have the same bits, through standstill and chatter too.
    """
    text = text_of(name, kind, step)
    built = Built(tmp_path, text)
    rows = motion(built.program, 400)
    assert all(same_bits(a, b) for a, b in zip(built.c_run(rows), built.python_run(rows), strict=True))

    spec = parse_spec(text, Path("machine.yaml"))
    analysis = analyse(spec, build_observer(spec, build_system(spec)))
    dynamics, h = analysis.dynamics, 0.001
    change = evaluate(dynamics, dynamics.in_force(dynamics.sampled), analysis.points)[0]
    unit = np.eye(len(change))
    phi = np.linalg.inv(unit - h * change) if step == "implicit" else unit + h * change

    twin, n = built.twin, len(dynamics.observer.system.positions)
    speed = np.array([5.0, 2.0][:n])  # both contacts slip forwards, so levels are forces
    random = np.random.default_rng(3)
    names = [
        {"v": f"{s}_hat", "a": f"a_hat_{s}", "F": f"tracked_{s}"}[letter]
        for letter, s in (
            ("v", e.truth.name) if e.truth in dynamics.observer.system.velocities else e.truth.name.split("_", 1)
            for e in dynamics.observer.errors
        )
    ]
    estimates = []
    for spread in (0.0, 0.1):
        start = twin.Inputs(*([0.0] * len(twin.Inputs.__slots__)))
        state, rows = twin.init(built.parameters, start), []
        for field in (f.name for f in built.program.states if not f.name.endswith("_held")):
            setattr(state, field, getattr(state, field) + spread * random.normal())
        for k in range(40):
            given = [*(speed * h * k), *(speed if "measured" in kind else ()), 30.0]
            if k == 1:  # with v̂ near v the signs are those of the motion
                for field, v in zip(built.program.states[:n], speed, strict=False):
                    if "measured" not in kind:
                        setattr(state, field.name, getattr(state, field.name) + v)
            out = twin.step(state, built.parameters, twin.Inputs(*given))
            rows.append([getattr(out, name) for name in names])
        estimates.append(np.array(rows[2:]))
    error = estimates[0] - estimates[1]
    assert np.abs(error).max() > 1e-3
    expected = error[:-1] @ phi.T
    assert np.abs(error[1:] - expected).max() < 1e-10 * np.abs(error).max()


NONLINEAR = {
    "dfo": (SPECS / "thesis/one_mass_dfo_implicit.yaml").read_text(encoding="utf-8"),
    "gdfo": (SPECS / "thesis/two_mass_gdfo.yaml")
    .read_text(encoding="utf-8")
    .replace("sample_time: 1e-5\nenv", "sample_time: 0.001\n  integration: implicit\nenv"),
    "exponent": text_of("two_mass", "gcfo", "implicit").replace("kind: gcfo", "kind: gcfo, exponent: 2"),
}


@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("case", slow_except(list(NONLINEAR), ["dfo", "gdfo"]))
def test_two_newton_steps_have_the_same_bits_in_c_and_python(tmp_path: Path, case: str, precision: str) -> None:
    built = Built(tmp_path, NONLINEAR[case], precision)
    assert "second Newton step" in built.files[f"{built.program.name}.c"]
    rows = motion(built.program, 200)
    assert all(same_bits(a, b) for a, b in zip(built.c_run(rows), built.python_run(rows), strict=True))


SLOW = "{kind: cfo, velocity: estimated, gains: {K_F: 80, K_v: 60}, sample_time: 0.05, integration: %s}"


@pytest.mark.parametrize(("step", "stable"), [("euler", False), ("semi_implicit", False), ("implicit", True)])
def test_only_the_implicit_form_stands_a_long_sample_time(tmp_path: Path, step: str, stable: bool) -> None:
    """One mass at 50 ms under a constant push: K_v h = 3. Truth is the parabola x = (w − a) t²/2."""
    text = text_of("one_mass", "cfo", step)
    text = "\n".join(f"observer: {SLOW % step}" if line.startswith("observer:") else line for line in text.splitlines())
    built = Built(tmp_path, text)
    spec = parse_spec(text, Path("machine.yaml"))
    outcome = certify(spec, analyse(spec, build_observer(spec, build_system(spec))), {}, "none")
    assert isinstance(outcome, Certificate) == stable
    time = 0.05 * np.arange(400)
    rows = np.column_stack([0.5 * (60.0 - 44.0) * time**2, np.full(400, 60.0)])  # true level 44; 50 at the start
    found = built.python_run(rows)[0]
    level = found[:, [n for n, _, _ in built.program.outputs].index("a_hat_rail")]
    assert (abs(level[-1] - 44) < 1e-3) == stable


def test_the_reset_integrator_of_the_thesis_at_one_millisecond(tmp_path: Path) -> None:
    """Its slope c D1 is 1e5 1/s, so explicit Euler needs less than 2e-5 s; backward Euler takes fifty times that."""
    text = (Path(__file__).parents[2] / "specs/thesis/one_mass_dfo_implicit.yaml").read_text(encoding="utf-8")
    built = Built(tmp_path, text)
    time = 0.001 * np.arange(1000)
    rows = np.column_stack([0.5 * 8.0 * time**2 + 2.0 * time, np.full(1000, 58.0)])
    # sliding at u = 2 + 8 t under w = 58: the friction is w − 8 = 50
    runs = built.c_run(rows)[0], built.python_run(rows)[0]
    assert same_bits(*runs)
    force = runs[0][:, [n for n, _, _ in built.program.outputs].index("F_hat_rail")]
    assert np.isfinite(force).all()
    assert (
        abs(force[-1] - 50.0) < 0.05
    )  # f rises by 8/D1 a second, so the level must fall by 0.4 N/s: it lags at 11 1/s
    euler = text.replace("integration: implicit", "integration: euler")
    diverged = Built(tmp_path, euler).python_run(rows)[0]
    last = diverged[-1, [n for n, _, _ in built.program.outputs].index("F_hat_rail")]
    assert not abs(last - 50.0) < 5

"""Forces over one position that add up to a curve, of which the log shows an arc: the gas strut of a lid."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import curve_fit

from codegen.base.arrays import Array
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import with_effects
from codegen.diagnosis.results import Fact, FoundEffect
from codegen.diagnosis.verdict.over_positions import arc_of_a_curve, missing_curve
from codegen.diagnosis.verdict.wrong_values import explaining_values
from codegen.logs import read_log
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import system_of

LID = """\
name: lid
coordinates: {q: {velocity: w, unit: rad}}
inputs: {u: {unit: N*m}}
parameters:
  J: {value: 2, unit: kg*m^2, tolerance: 5 %}
  b: {value: 0.4, unit: N*m*s/rad, tolerance: 30 %}
mass_matrix: [[J]]
force: [u - b*w]
friction:
  distribution: [[1]]
  contacts:
    - {name: hinge, law: coulomb, a: 2, unit: N*m}
"""
NOISE = 0.05
"""N*m of the measured torque."""


def strut(q: Array) -> Array:
    """The torque of a strut of 300 N and 400 N/m, 0.35 m from the hinge, whose weight the spec has."""
    x, y = 0.35 * np.cos(q) - 0.1, 0.35 * np.sin(q) + 0.45
    length = np.hypot(x, y)
    force = 300.0 - 400.0 * (length - 0.55)
    return np.asarray(force * (0.35 * np.cos(q) * y - 0.35 * np.sin(q) * x) / length - 60.0 * np.cos(q))


def pair(q: Array, f0: float, size: float, phase: float) -> Array:
    return np.asarray(f0 - size * np.sin(q + phase))


def moved(folder: Path, torque: Callable[[Array], Array], stroke: float, text: str = LID) -> tuple[Spec, Problem]:
    """A machine on which this torque acts, with 2.3 N*m of friction, and its log by the equation of motion."""
    mass = 14.0 if "14, unit" in text else 2.0
    t, noise = np.arange(0.0, 20.0, 0.002), np.random.default_rng(1)
    rates, parts = 2 * np.pi * np.array([0.23, 0.371, 0.617]), np.array([0.5, 0.3, 0.2])
    turns = np.outer(rates, t) + np.array([[0.0], [1.0], [2.0]])
    scale = stroke / np.ptp(parts @ np.sin(turns))
    q, w, a = (
        scale * parts * s @ f for s, f in ((1, np.sin(turns)), (rates, np.cos(turns)), (-(rates**2), np.sin(turns)))
    )
    u = mass * a + 0.4 * w + 2.3 * np.sign(w) - torque(q) + NOISE * noise.standard_normal(len(t))
    rows = np.column_stack([t, q + 1e-6 * noise.standard_normal(len(t)), u])
    path, spec = folder / "log.csv", parse_spec(text, Path("machine.yaml"))
    np.savetxt(path, rows, delimiter=",", header="t,q,u", comments="")
    system = system_of(spec)
    tolerated = {s: {"J": 0.1, "b": 0.12}[s.name] for s in system.values if s.name in ("J", "b")}
    return spec, Problem(system, smooth_motion(read_log(path, spec)), tolerated)


def judged(
    folder: Path,
    torque: Callable[[Array], Array],
    stroke: float,
    named: Mapping[str, Mapping[str, float]] | None = None,
) -> tuple[Fact, Fact] | None:
    """The objection to these effects, a constant and a weight by default, of a lid on which this torque acts."""
    _, problem = moved(folder, torque, stroke)
    if named is None:
        q = np.linspace(-stroke / 2, stroke / 2, 101)
        f0, size, phase = curve_fit(pair, q, torque(q), [0.0, np.ptp(torque(q)), 0.5])[0]
        named = {"offset": {"f0": f0}, "gravity_imbalance": {"G": size, "phase": phase}}
    effects = [FoundEffect(kind, "hinge" if kind == "viscous" else "q", values, {}) for kind, values in named.items()]
    return arc_of_a_curve(problem, problem.system, with_effects(problem.system, effects), effects)


@pytest.mark.parametrize("stroke", [0.6, 0.9, 1.2])
def test_a_strut_is_no_offset_with_a_weight(stroke: float, tmp_path: Path) -> None:
    """They were named with certainty, 25 and 27 N*m, which nearly cancel over a stroke of 1.2 rad."""
    found = judged(tmp_path, strut, stroke)
    assert found is not None
    against, experiment = (fact.words for fact in found)
    assert f"a polynomial with 4 values describes {'better' if stroke > 1 else 'as well'}" in against
    assert "of 6.28 rad, and over that offset on q and gravity_imbalance on q add up to one curve" in against
    assert "6.28 rad on q" in experiment and "another mounting" in experiment


@pytest.mark.parametrize(("stroke", "is_told"), [(0.6, False), (2.0, True), (4.0, True), (7.0, True)])
@pytest.mark.parametrize("phase", [0.3, -1.0])
def test_a_true_pair_is_named_where_the_log_tells(phase: float, stroke: float, is_told: bool, tmp_path: Path) -> None:
    """On 0.6 rad a parabola is within 0.02 N*m of a constant with a weight."""
    assert (judged(tmp_path, lambda q: pair(q, 2.5, 6.0, phase), stroke) is None) == is_told


@pytest.mark.parametrize(("stroke", "is_told"), [(0.9, False), (3.0, True)])
def test_a_pair_that_cancels_needs_more(stroke: float, is_told: bool, tmp_path: Path) -> None:
    found = judged(tmp_path, lambda q: pair(q, 5.0, 6.0, 1.0), stroke)
    assert (found is None) == is_told


@pytest.mark.parametrize(
    "named",
    [
        {"gravity_imbalance": {"G": 6.0, "phase": 0.3}},
        {"offset": {"f0": 2.5}, "spring": {"k": 5.0}},
        {"gravity_imbalance": {"G": 6.0, "phase": 0.3}, "viscous": {"b": 0.1}},
    ],
    ids=["one", "no wave", "another variable"],
)
def test_other_effects_are_not_asked_about(named: Mapping[str, Mapping[str, float]], tmp_path: Path) -> None:
    assert judged(tmp_path, lambda q: pair(q, 2.5, 6.0, 0.3), 0.6, named) is None


def gas_spring(x: Array) -> Array:
    """A gas spring of 140 N that carries 14 kg on a stroke of 0.4 m."""
    return np.asarray(140.0 * (0.5 / (0.5 + x)) ** 1.2 - 14.0 * 9.81)


def test_a_gas_spring_is_told_by_its_curve_and_not_by_another_gravity(tmp_path: Path) -> None:
    """Told was "mainly a constant force", and the advice to give g a tolerance: g = -0.324 m/s^2 explained 95 %."""
    text = LID.replace("2, unit: kg*m^2", "14, unit: kg").replace("rad", "m").replace("N*m", "N")
    text = text.replace("[u - b*w]", "[u - b*w - J*g]").replace("  b:", "  g: {value: 9.81, unit: m/s^2}\n  b:")
    spec, problem = moved(tmp_path, gas_spring, 0.4, text)
    assert explaining_values(spec, problem.system, problem)
    found = missing_curve(problem, problem.system)
    assert found is not None and found.share > 0.99
    places, forces = (np.array(one) for one in zip(*found.points, strict=True))
    assert np.ptp(places) > 0.35 and forces == pytest.approx(gas_spring(places) + 14.0 * 9.81, abs=3.0)
    assert "A force over the position of q is missing: " in found.fact.words
    assert explaining_values(spec, problem.system, problem, found.share) == []


def test_a_curve_that_is_a_constant_or_small_is_not_told(tmp_path: Path) -> None:
    for torque in (lambda q: 5.0 + 0 * q, lambda q: 0.02 * q):
        assert missing_curve(moved(tmp_path, torque, 1.0)[1], system_of(parse_spec(LID, Path("lid.yaml")))) is None

"""Starts of a compliance, against the load behind a spring that made the log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import bilinear, cont2discrete, lfilter

from codegen.diagnosis.evidence.coverage import survey
from codegen.diagnosis.evidence.residual_regression import ringing
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.starting_values import _resonant_filter
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection.candidate_fits import CandidateFits, fit_candidates
from codegen.effects import CATALOGUE
from codegen.spec import parse_spec
from tests.diagnosis.stage import log_of, stage, system_of
from tests.diagnosis.test_adoption import search_of
from tests.diagnosis.test_force_start import search_in


@pytest.mark.parametrize(
    ("k", "c", "share"),
    [(2500.0, 4.0, 0.3), *(pytest.param(*p, marks=pytest.mark.slow) for p in ((300.0, 3.0, 0.5), (1000.0, 8.0, 0.8)))],
)
def test_the_residual_tells_frequency_and_share_of_a_load(tmp_path: Path, k: float, c: float, share: float) -> None:
    """ω = √(k/(ρM)) of the load against a held motor; grid points are a tenth apart."""
    lacking = f"[{{kind: compliance, on: x, parameters: {{k: {k}, c: {c}, load_fraction: {share}}}}}]"
    log = log_of(stage(lacking), tmp_path, "train.csv")
    system = system_of(stage())
    part = part_of(CATALOGUE["compliance"], 0, system)
    motion = smooth_motion(log)
    best = survey(system, motion).covered(part, [4.0], motion.measured.std(axis=0)).resonances()[0]
    found = best["k"] / best["load_fraction"]
    assert found**0.5 == pytest.approx((k / share) ** 0.5, rel=0.08)
    assert best["load_fraction"] == pytest.approx(share, abs=0.12)


def test_a_load_that_explains_the_force_residual_is_fitted_whatever_its_rank_by_free_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Free runs of an axis that rings gained more by six other candidates than by its spring, so it was left out."""
    lacking = "[{kind: compliance, on: x, parameters: {k: 2500, c: 4, load_fraction: 0.3}}]"
    log = log_of(stage(lacking), tmp_path, "train.csv")
    search = search_in(log)
    parts = [part_of(CATALOGUE[kind], 0, search.system) for kind in ("compliance", "offset", "stribeck")]
    monkeypatch.setattr("codegen.diagnosis.selection.candidate_fits.FITTED", 0)
    found = fit_candidates(search, search.refit(), parts)
    assert [fit.part.kind for fit in found] == ["compliance"]
    assert found[0].parameters == pytest.approx({"k": 2500, "c": 4, "load_fraction": 0.3}, rel=0.1)


def test_a_load_is_fitted_from_measured_start_states_where_its_force_suggests_it(tmp_path: Path) -> None:
    """The start states of a refit make up for the load that it lacks: from them a fit ended at a load of 0.3 %.

    Beside an offset, a compliance that the force residual gave to 1 % of its stiffness was not found at all.
    """
    lacking = "[{kind: compliance, on: x, parameters: {k: 60, c: 0.5, load_fraction: 0.57}}]"
    search = search_in(log_of(stage(lacking), tmp_path, "train.csv"))
    part = part_of(CATALOGUE["compliance"], 0, search.system)
    tried = CandidateFits(search, search.refit(), (part,))
    (found,) = tried.screened(tried.promising([0]))
    values = tried.trials[0].split(found.theta)[1][-1]
    assert values["k"] == pytest.approx(60, rel=0.4) and values["load_fraction"] == pytest.approx(0.57, abs=0.2)


PENDULUM = """\
name: pendulum
coordinates: {{q: {{velocity: v, unit: rad}}}}
inputs: {{w: {{unit: N*m}}}}
parameters: {{J: {{value: 0.036, unit: kg*m^2}}, G: {{value: 1.4, unit: N*m}}}}
mass_matrix: [[J]]
force: [w - G*sin(q)]
friction:
  distribution: [[1]]
  contacts: [{{name: pivot, law: coulomb, a: 0.19, unit: N*m}}]
effects: {effects}
simulation:
  duration: 20
  sample_time: 0.002
  reference: {{q: "0.9*sin(2*pi*0.13*t) + 0.35*sin(2*pi*0.61*t + 1) + 0.12*sin(2*pi*1.9*t)"}}
  position_gain: {{w: 20}}
  velocity_gain: {{w: 1.2}}
  encoder_step: {{q: 1e-4}}
  position_noise: {{q: 5e-4}}
"""


def test_a_load_that_gravity_moves_is_found_beside_an_effect_that_is_not_in_the_model(tmp_path: Path) -> None:
    """Beside a dead zone the fit of a pendulum's load ended at 1 % of the inertia, and cogging was named for both.

    The load answers to its weight as well as to the acceleration of the motor.
    """
    load = {"k": 3.7, "c": 0.0104, "load_fraction": 0.41}
    values = ", ".join(f"{name}: {value}" for name, value in load.items())
    lacking = f"{{kind: compliance, on: q, parameters: {{{values}}}}}"
    lacking = f"[{{kind: dead_zone, on: w, parameters: {{width: 0.055}}}}, {lacking}]"
    plant, spec = (parse_spec(PENDULUM.format(effects=some), Path("pendulum.yaml")) for some in (lacking, "[]"))
    search = search_of(spec, log_of(plant, tmp_path, "train.csv"))
    base, part = search.refit(), part_of(CATALOGUE["compliance"], 0, search.system)
    (found,) = fit_candidates(search, base, [part])
    assert found.parameters["load_fraction"] == pytest.approx(load["load_fraction"], abs=0.1)
    assert found.cost < search.with_parts(base, base.values[0], [part], [load]).cost


def test_ringing_after_few_moves_is_told_and_noise_is_not(tmp_path: Path) -> None:
    """A load that a blow sets ringing twice in a log of 14 s: few held-out pieces hold nearly all of what it makes."""
    clean = log_of(stage(), tmp_path, "train.csv")
    problem = Problem(system_of(stage()), smooth_motion(clean), {})
    motion, rows = problem.motion, problem.used[:, 0]
    generator = np.random.default_rng(4)
    acceleration = 0.2 * motion.low_pass(generator.standard_normal((len(motion.time), 1)))[:, 0]
    for blow in (4.1, 9.3):
        acceleration[np.abs(motion.time - blow) < 0.02] += 50.0
    frequency, ratio, share, inertia = 2 * np.pi * 6.0, 0.03, 0.5, 2.0
    b, a = cont2discrete(([1, 0, 0], [1, 2 * ratio * frequency, frequency**2]), motion.sample_time, "bilinear")[:2]
    load = motion.low_pass(lfilter(b.ravel(), a, acceleration)[:, None])[:, 0]
    noise = motion.low_pass(generator.standard_normal((len(motion.time), 1)))[:, 0]
    told = ringing(noise - share * inertia * load, rows, acceleration, inertia, motion)
    expected = 1 - np.sum(noise[rows] ** 2) / np.sum((noise - share * inertia * load)[rows] ** 2)
    assert told == pytest.approx(expected, abs=0.15) and expected > 0.5
    assert ringing(noise, rows, acceleration, inertia, motion) == 0.0


@pytest.mark.parametrize("sample_time", [1e-3, 1 / 1500, 4e-3, 0.0123])
def test_the_filter_of_a_load_is_the_bilinear_transform(sample_time: float) -> None:
    """In the same bits as SciPy's, whose polynomials take a millisecond for each of 120 filters."""
    for frequency, ratio in ((1.3, 0.03), (57.1, 0.12), (411.7, 0.4)):
        expected = bilinear([1.0, 0.0, 0.0], [1.0, 2 * ratio * frequency, frequency**2], 1 / sample_time)
        found = _resonant_filter(frequency, ratio, sample_time)
        assert [one.tobytes() for one in found] == [one.tobytes() for one in expected]

"""Intervals of a fit: errors that neighbours share, effects that act like a declared parameter, forms they exclude."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from codegen.diagnosis.evidence.estimate import (
    BLOCKS,
    Estimate,
    covariance,
    estimate,
    wave_intervals,
    widened_by,
)
from codegen.diagnosis.fit.output_error import Fit, Prior
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import Part, part_of
from codegen.diagnosis.results import Interval
from codegen.diagnosis.selection.force_fits import ForceFits
from codegen.diagnosis.verdict.examination import _by_both
from codegen.effects import CATALOGUE
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import log_of, stage, system_of
from tests.diagnosis.test_adoption import search_of
from tests.slow_cases import drawn

Array = NDArray[np.float64]

MANY = 1_000_000
"""Degrees of freedom at which Student's distribution is the normal one."""


@dataclass(frozen=True)
class Line:
    """What the covariance needs of a fit: a line through the origin, fitted to segments of one residual each."""

    residual: Array
    slopes: Array
    prior: Prior
    theta: Array


@drawn(500, 2000)
def test_an_error_that_neighbouring_segments_share_widens_the_standard_error(draws: int) -> None:
    """Estimates of one slope over draws of an autoregressive error scatter by what the clusters say."""
    rng, segments, phi = np.random.default_rng(7), 480, 0.8
    column, size = np.ones(segments), 0.05
    prior = Prior(np.zeros((1, 1)), *np.zeros((5, 1)))
    found, alone, clustered = [], [], []
    for _ in range(draws):
        noise = lfilter([1.0], [1.0, -phi], size * rng.standard_normal(segments))
        slope = float(column @ noise) / segments
        fit = Line((noise - slope)[:, None], column[None, :, None], prior, np.array([slope]))
        found.append(slope)
        alone.append(float(np.sqrt(covariance(cast(Fit, fit))[0, 0])))
        clustered.append(float(np.sqrt(covariance(cast(Fit, fit), BLOCKS)[0, 0])))
    scatter = float(np.std(found))
    assert float(np.mean(alone)) < 0.5 * scatter
    assert float(np.mean(clustered)) == pytest.approx(scatter, rel=0.15)


PENDULUM = """\
name: pendulum
coordinates:
  q: {{velocity: v, unit: rad}}
inputs:
  w: {{unit: N*m}}
parameters:
  J: {{value: 0.1, unit: kg*m^2}}
  W: {{value: {weight}, unit: N*m, tolerance: 1%}} # weight times its lever
mass_matrix: [[J]]
force: ["w - W*sin(q)"]
friction:
  distribution: [[1]]
  contacts:
    - {{name: pivot, law: coulomb, a: 0.1, unit: N*m}}
effects: {effects}
simulation:
  duration: 16
  sample_time: 0.002
  reference: {{q: "2.2*sin(2*pi*0.31*t) + 0.4*sin(2*pi*0.97*t)"}}
  position_gain: {{w: 30}}
  velocity_gain: {{w: 2}}
  encoder_step: {{q: 1e-7}}
"""
DECLARED, TRUE = 3.0, 3.03


def pendulum(weight: float, effects: str = "[]") -> Spec:
    return parse_spec(PENDULUM.format(weight=weight, effects=effects), Path("pendulum.yaml"))


@pytest.mark.parametrize(("start", "G", "phase"), [(DECLARED, 0.5, 0.6), (1.028 * DECLARED, 0.05, 1.5)])
def test_an_unbalance_is_known_no_better_than_the_weight_that_acts_like_it(
    start: float, G: float, phase: float, tmp_path: Path
) -> None:
    """W sin q and G cos(phase) sin q are one force: the log tells their sum, and the tolerance of W, 0.03 N·m, alone
    divides it. So W is the declared one, wherever the fit began, and G cos(phase) errs by that tolerance.
    """
    plant = pendulum(TRUE, f"[{{kind: gravity_imbalance, on: q, parameters: {{G: {G}, phase: {phase}}}}}]")
    search = search_of(pendulum(DECLARED), log_of(plant, tmp_path, "train.csv"))
    base = search.refit()
    part = part_of(CATALOGUE["gravity_imbalance"], 0, search.system)
    weight = [s.name for s in search.refitted_symbols].index("W")
    theta = base.theta.copy()
    theta[weight] = start
    sine, cosine = G * np.cos(phase) + TRUE - start, G * np.sin(phase)
    values = {"G": float(np.hypot(sine, cosine)), "phase": float(np.arctan2(cosine, sine))}
    fit, _ = search.polished(search.with_parts(base, theta, [part], [values]))
    found = fit.runner.trial.split(fit.theta)[1][0]
    assert fit.theta[weight] == pytest.approx(DECLARED, rel=5e-4)
    whole = fit.theta[weight] + found["G"] * np.cos(found["phase"])
    assert whole == pytest.approx(TRUE + G * np.cos(phase), rel=1e-3)
    tolerance = 0.01 * DECLARED
    errors = np.sqrt(np.diag(covariance(fit)))
    assert errors[weight] == pytest.approx(tolerance, rel=0.02)
    assert errors[-2] == pytest.approx(abs(tolerance * np.cos(found["phase"])), rel=0.05)
    assert errors[-1] == pytest.approx(tolerance * np.sin(found["phase"]) / found["G"], rel=0.05)


def test_the_interval_of_a_wave_is_the_range_of_an_ellipse() -> None:
    """Weights of a cosine and a sine, (0.2, 0.3), of which an unknown weight blurs the first by 0.3: the size is not
    zero. Compared with the nearest and farthest of a million points on the ellipse of 1.96 deviations.
    """
    weights, spread = np.array([0.2, 0.3]), np.diag([0.3**2, 0.01**2])
    size, phase = float(np.hypot(*weights)), float(np.arctan2(weights[1], weights[0]))
    to_polar = np.array([[np.cos(phase), np.sin(phase)], [-np.sin(phase) / size, np.cos(phase) / size]])
    (low, high), (first, last) = wave_intervals(size, to_polar @ spread @ to_polar.T, MANY)
    angles = np.random.default_rng(3).uniform(0, 2 * np.pi, 1_000_000)
    x, y = 0.2 + 1.96 * 0.3 * np.cos(angles), 0.3 + 1.96 * 0.01 * np.sin(angles)
    assert (low, high) == pytest.approx((np.hypot(x, y).min(), np.hypot(x, y).max()), rel=1e-3)
    assert low > 0.27
    turns = np.arctan2(y, x)
    assert (phase + first, phase + last) == pytest.approx((turns.min(), turns.max()), abs=1e-3)
    mirrored = wave_intervals(-size, np.diag([-1, 1]) @ to_polar @ spread @ to_polar.T @ np.diag([-1, 1]), MANY)
    assert mirrored[0] == pytest.approx((low, high)) and mirrored[1] == pytest.approx((first, last))


@pytest.mark.parametrize(("deviations", "absent"), [(2.4, True), (2.5, False)])
def test_a_wave_is_absent_where_the_joint_region_of_its_weights_holds_zero(deviations: float, absent: bool) -> None:
    """Both weights are zero: a chi-squared of two degrees of freedom, whose 95 % quantile is 2.448²."""
    (low, high), turn = wave_intervals(0.1, np.diag([(0.1 / deviations) ** 2, 1.0]), MANY)
    assert (low == 0.0) == absent == (turn == (-np.pi, np.pi))
    assert high >= 0.17


def parts_of(kind: str, names: tuple[str, ...]) -> tuple[Part, ...]:
    form = next(f for f in CATALOGUE[kind].forms if tuple(p.name for p in f.parameters) == names)
    return (part_of(form, 0, system_of(stage())),)


def both(
    own: float, half: float, other: float, half2: float, kind: str = "viscous", name: str = "b", share: float = 1.0
) -> Interval:
    """The interval of one parameter by two criteria, each value ± half."""
    one, two = (Estimate({}, ({name: (v, (v - h, v + h))},)) for v, h in ((own, half), (other, half2)))
    return widened_by(one, two, parts_of(kind, (name,)), {0: share}).effects[0][name][1]


def test_an_interval_reaches_the_estimate_of_the_other_criterion() -> None:
    assert both(2.0, 0.1, 2.0, 0.3) == pytest.approx((1.9, 2.1))
    low, high = both(2.0, 0.1, 2.05, 0.3)  # the difference may be chance
    assert (2.0 - low, high - 2.0) == pytest.approx((float(np.hypot(0.1, 0.05)),) * 2, rel=0.05)
    low, high = both(2.0, 0.01, 2.4, 0.01)  # it is none
    assert low < 1.6 and high > 2.4
    assert both(2.0, 0.1, 3.0, 0.1, share=0.0) == pytest.approx((1.9, 2.1))  # of a fit that leaves only noise


@drawn(300, 2000)
def test_intervals_hold_two_biased_criteria_and_no_more_than_that(draws: int) -> None:
    """Each of two criteria has a bias of its own, ten times its noise: 95 % intervals without it hold few truths."""
    rng, truth, bias, noise = np.random.default_rng(5), 40.0, 1.0, 0.1
    half, held, alone = 2.13 * noise, 0, 0
    for _ in range(draws):
        one, two = truth + bias * rng.standard_normal(2) + noise * rng.standard_normal(2)
        low, high = both(one, half, two, half)
        held, alone = held + (low <= truth <= high), alone + (abs(one - truth) <= half)
    assert alone < 0.25 * draws
    assert 0.7 * draws < held < 0.99 * draws  # one difference tells little of the size of a bias


@pytest.mark.parametrize(("own", "other"), [(0.5, 3.0), (-0.5, -3.0), (3.0, 0.5)])
def test_a_difference_in_size_alone_leaves_the_sign(own: float, other: float) -> None:
    low, high = both(own, 0.1, other, 0.1)
    assert low * own > 0 and high * own > 0 and low <= other <= high


def test_criteria_of_different_sign_leave_the_sign_open() -> None:
    low, high = both(0.5, 0.1, -0.4, 0.1)
    assert low < -0.4 < 0 < high


def test_an_interval_stays_within_the_bounds_of_its_parameter() -> None:
    low, high = both(5000.0, 400.0, 900.0, 100.0, "presliding", "sigma")
    assert 0 < low < 900 and high > 5400


@pytest.mark.parametrize("own", [3.14, -3.14, 0.5])
def test_phases_that_differ_by_nearly_a_turn_are_near_each_other(own: float) -> None:
    """An encoder's zero half a turn off gives +π by one criterion and −π by the other."""
    wave = parts_of("cogging", ("amplitude", "period", "phase"))
    near = own + 0.01 - (2 * np.pi if own > 3 else 0.0)
    one, two = (Estimate({}, ({"phase": (v, (v - 0.02, v + 0.02))},)) for v in (own, near))
    low, high = widened_by(one, two, wave, {0: 1.0}).effects[0]["phase"][1]
    assert (own - low, high - own) == pytest.approx((float(np.hypot(0.02, 0.01)),) * 2)


@pytest.mark.parametrize(("sigma", "wider"), [(1e6, False), (300.0, True)])
def test_a_misfit_of_the_form_widens_the_interval_and_noise_does_not(sigma: float, wider: bool, tmp_path: Path) -> None:
    """Stiff presliding is friction that sticks; soft presliding, not in the model, biases viscous friction by force."""
    effects = (
        "[{kind: viscous, on: rail, parameters: {b: 2.0}}, "
        f"{{kind: presliding, on: rail, parameters: {{sigma: {sigma:g}}}}}]"
    )
    search = search_of(stage(), log_of(stage(effects), tmp_path, "train.csv"))
    base = search.refit()
    part = part_of(CATALOGUE["viscous"].forms[0], 0, search.system)
    final = search.with_parts(base, base.values[0], [part], [{"b": 2.0}])
    fit, other = search.polished(final)
    own = estimate(fit, other)
    both = _by_both(search, base, final, fit, own)
    (value, alone), (_, found) = own.effects[0]["b"], both.effects[0]["b"]
    force = ForceFits(search, base).fit(fit.trial, fit.theta).values[1][0]["b"]
    assert (found != alone) is wider
    if wider:
        assert not alone[0] < force < alone[1]
        assert found[0] < min(2.0, force) and found[1] > max(2.0, force) and 0 < found[0] < value


@pytest.mark.parametrize("segments", [7, 12])
def test_the_force_residual_is_fitted_beside_free_runs_of_the_searchs_own_segments(segments: int) -> None:
    """Harmonics found on shorter segments: the base had 150 start states, the record of the search 706 segments."""
    again: list[Any] = []
    record = SimpleNamespace(at_rest=np.zeros((12, 2)))
    search: Any = SimpleNamespace(record=record, on_another_record=lambda fit: again.append(fit) or "fitted again")
    base: Any = SimpleNamespace(offsets=np.zeros((segments, 2)))
    used: Any = Search.on_its_record(search, base)
    assert (used, again) == ((base, []) if segments == 12 else ("fitted again", [base]))

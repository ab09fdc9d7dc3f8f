"""Feasible gains against closed forms by hand: where they end, with what margin, what fails, what is suggested."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.analysis.error_dynamics import derive_error_dynamics
from codegen.analysis.feasibility.axes import gain_axes, unit_notes
from codegen.analysis.feasibility.gain_dynamics import GainDynamics
from codegen.analysis.feasibility.noise import NoiseModel, position_noise
from codegen.analysis.operating_points import operating_points
from codegen.app.derived import Derived
from codegen.base.errors import BadInput
from codegen.spec import parse_spec
from tests.expected_errors import refused
from tests.spec.faults import GOOD

from .gain_specs import MASS, assessed, estimated_cfo, radius, spec_of

EXACT = 1e-3


def test_measured_cfo_is_stable_up_to_two_masses_over_the_sample_time() -> None:
    """e⁺ = (1 − h k_F/m) e: stable for 0 < h k_F/m < 2."""
    report = assessed(spec_of("{K_F: {free: [1, 1e5]}}"))
    ((low, high),) = report.sampled["K_F"]
    assert low == 1
    assert high == pytest.approx(2 * MASS / 0.001, rel=EXACT)
    assert report.continuous["K_F"] == ((1, pytest.approx(1e5)),)
    (line,) = report.region.boundary["sampled"]  # over K_F and h
    gain, period = np.array(line).T
    np.testing.assert_allclose(gain * period, 2 * MASS, rtol=EXACT)
    assert len(line) > 20
    assert report.region.boundary["continuous"] == ()


def test_margins_of_the_measured_cfo_and_eigenvalues_on_both_sides() -> None:
    report = assessed(spec_of("{K_F: 100}"))
    assert report.chosen is not None
    gain, period = report.chosen.margins
    assert (gain.name, period.name) == ("K_F", "sample time")
    assert gain.up == pytest.approx(2 * MASS / 0.001 / 100, rel=EXACT)
    assert period.up == pytest.approx(gain.up, rel=EXACT)
    assert gain.down is None
    assert gain.at_up == pytest.approx(-1, abs=0.01)
    assert report.chosen.decay_rate == pytest.approx(-np.log(1 - 0.001 * 100 / MASS) / 0.001)


@pytest.mark.parametrize("h", ["0.001", "0.01"])
def test_cfo_with_velocity_observer_at_the_boundary_by_eigenvalues(h: str) -> None:
    """s² + k_v s + k_F k_v/m, Euler: 0 < h k_F/m < 1 with complex poles, and k_v h < 2 + k_F k_v h²/(2 m)."""
    report = assessed(spec_of("{K_F: {free: [1, 1e5]}, K_v: {free: [1, 1e4]}}", velocity="estimated", h=h))
    step = float(h)
    vertices = [point for line in report.region.boundary["sampled"] for point in line]
    assert len(vertices) > 40
    for k_F, k_v in vertices:
        size = [radius(estimated_cfo(k_F * a, k_v * b, step)) for a in (0.999, 1, 1.001) for b in (0.999, 1, 1.001)]
        assert min(size) < 1 < max(size)
        by_hand = (h_term := step * k_F / MASS) < 1 + EXACT and k_v * step * (1 - h_term / 2) < 2 * (1 + EXACT)
        assert by_hand
    for i, k_F in list(enumerate(report.region.x_values))[::6]:
        for j, k_v in list(enumerate(report.region.y_values))[::6]:
            assert report.region.radius[i, j] == pytest.approx(radius(estimated_cfo(k_F, k_v, step)), rel=1e-9)


def test_margins_hold_just_inside_and_fail_just_outside() -> None:
    report = assessed(spec_of("{K_F: 40, K_v: 300}", velocity="estimated"))
    assert report.chosen is not None
    k_F, k_v, together, period = report.chosen.margins
    for factor, of in ((k_F.up, (1, 0, 0)), (k_v.up, (0, 1, 0)), (together.up, (1, 1, 0)), (period.up, (0, 0, 1))):
        assert factor is not None

        def at(f: float, of: tuple[int, int, int] = of) -> float:
            scale = [f**p for p in of]
            return radius(estimated_cfo(40 * scale[0], 300 * scale[1], 0.001 * scale[2]))

        assert at(factor / (1 + EXACT)) < 1 < at(factor * (1 + EXACT))
    assert k_F.down is None
    assert k_v.down is None


@pytest.mark.parametrize(("low", "high"), [(-1e5, -1)])
def test_tracking_observer_with_measured_velocity(low: float, high: float) -> None:
    """e⁺ = (1 + h K_2/m) e: stable for −2 m/h < K_2 < 0; the axis runs over −K_2."""
    report = assessed(spec_of(f"{{K_2: {{free: [{low}, {high}]}}}}", kind="to"))
    (axis,) = report.axes
    assert axis.negative
    assert report.sampled["K_2"] == ((1, pytest.approx(2 * MASS / 0.001, rel=EXACT)),)
    assert report.suggested is not None
    assert -2 * MASS / 0.001 / 2 < report.suggested.gains["K_2"] < 0


def test_a_wrong_sign_is_infeasible_with_condition_and_numbers() -> None:
    """TO, velocity observer: Ψ = [[−k_v, −1/m], [−k_v k_2…]]; K_2 > 0 makes c0 = −k_v K_2/m negative."""
    report = assessed(spec_of("{K_2: {free: [1, 100]}, K_v: 50}", kind="to", velocity="estimated"))
    assert report.suggested is None
    assert report.sampled["K_2"] == ()
    failure = report.infeasible
    assert failure is not None
    assert failure.which == "continuous"
    assert failure.largest_sample_time == 0
    (condition,) = failure.conditions
    assert condition.label == "c0"
    assert condition.value == pytest.approx(-50 * failure.gains["K_2"] / MASS, rel=1e-6)
    assert failure.eigenvalue.real > 0


def test_too_long_a_sample_time_is_infeasible_and_says_which_would_do() -> None:
    report = assessed(spec_of("{K_F: {free: [100, 1000]}}", h="0.1"))
    failure = report.infeasible
    assert failure is not None
    assert failure.which == "sampled"
    assert failure.gains == {"K_F": pytest.approx(100)}
    assert failure.eigenvalue == pytest.approx(1 - 0.1 * 100 / MASS)
    assert [c.label for c in failure.conditions] == ["p(z=-1)"]
    assert failure.largest_sample_time == pytest.approx(2 * MASS / 100)


def test_where_it_fails_is_named() -> None:
    """With μ = 2 the error does not decay at zero slip: Ψ has the eigenvalue 0 at v = 0."""
    report = assessed(spec_of("{K_F: {free: [1, 100]}}", more="exponent: 2"))
    assert report.infeasible is not None
    assert report.infeasible.point["v"] == 0
    assert report.infeasible.eigenvalue == pytest.approx(0)


def test_the_suggestion_keeps_its_own_rule() -> None:
    report = assessed(spec_of("{K_F: {free: [1, 1e5]}, K_v: {free: [1, 1e4]}}", velocity="estimated"))
    chosen, suggestion = report.suggested, report.suggestion
    assert chosen is not None
    assert suggestion is not None
    assert suggestion.rule == "fastest"
    assert chosen.noise_share is not None
    assert chosen.noise_share <= 0.05
    k_F, k_v = chosen.gains["K_F"], chosen.gains["K_v"]
    assert all(radius(estimated_cfo(k_F * a, k_v * b, 0.001)) < 1 for a, b in ((2, 1), (0.5, 1), (1, 2), (1, 0.5)))
    good = (report.noise_share <= 0.05) & (report.region.radius < 1)
    for i, j in np.argwhere(good):
        p, q = report.region.x_values[i], report.region.y_values[j]
        wide = [radius(estimated_cfo(p * a, q * b, 0.001)) < 1 for a, b in ((2, 1), (0.5, 1), (1, 2), (1, 0.5))]
        assert not all(wide) or report.region.decay_rate[i, j] <= chosen.decay_rate / 0.97


def test_where_no_gain_is_quiet_the_product_decides_and_says_so() -> None:
    coarse = "simulation: {duration: 1, sample_time: 0.01, encoder_step: {x: 0.01}}"
    report = assessed(spec_of("{K_F: {free: [100, 1000]}}", simulation=coarse))
    assert report.suggestion is not None
    assert report.suggestion.rule == "product"
    assert report.noise.given == ("x",)
    assert report.noise.rms == (pytest.approx(0.01 / np.sqrt(12)),)


def test_one_entry_of_a_matrix_may_be_free_and_axes_may_be_named() -> None:
    from pathlib import Path

    from codegen.spec import parse_spec

    text = (Path(__file__).parents[2] / "specs" / "two_mass.yaml").read_text()
    free = parse_spec(text.replace("K_F: [500, 700]", "K_F: [{free: [10, 1e4]}, 700]"), Path("two_mass.yaml"))
    report = assessed(free, ("h", "K_F_between"))
    assert [a.name for a in report.axes] == ["K_F_between"]
    assert (report.region.x.name, report.region.y.name) == ("h", "K_F_between")
    assert report.suggested is not None
    assert report.suggested.gains["K_F_ground"] == 700
    with refused("CALL001 --over: `K_x` K_F_between"):
        assessed(free, ("h", "K_x"))


@pytest.mark.parametrize("gains", ["{K_F: {free: [5, 1]}}", "{K_F: {fre: [1, 5]}}", "{K_F: {free: [1]}}"])
def test_a_bad_range_is_told(gains: str) -> None:
    with pytest.raises(BadInput, match=r"observer\.gains\.K_F"):
        spec_of(gains)


def test_one_free_number_for_gains_of_different_units_is_noted() -> None:
    scalar, listed = "K_F: {free: [0.1, 1000]}", "K_F: [{free: [0.1, 1000]}, {free: [0.1, 1000]}]"

    def notes(gain: str) -> tuple[str, ...]:
        machine = Derived(parse_spec(GOOD.replace("K_F: 10", gain), Path("slider.yaml")))
        observer = machine.nominal.observer
        return unit_notes(gain_axes(machine.spec, observer), observer)

    (note,) = notes(scalar)
    assert "K_F_rail in N*s/m, K_F_hinge in N*m*s/rad" in note
    assert f"`{listed}`" in note
    assert notes(listed) == notes("K_F: 10") == ()


def test_noise_near_standstill_is_that_of_one_direction_of_slip() -> None:
    """Friction changes the speed of a mass of 0.1 g by 500 m/s in a sample; below that the noise was another.

    The error dynamics of a mass do not depend on its speed, so the noise is the same at every point.
    """
    path = Path(__file__).parents[2] / "specs" / "one_mass.yaml"
    text = path.read_text("utf-8").replace("m: {value: 1,", "m: {value: 1e-4,").replace("v: [-5, 5]", "v: [-900, 900]")
    spec = parse_spec(text.replace("{K_F: 10, K_v: 100}", "{K_F: 0.05, K_v: 100}"), path)
    observer = Derived(spec).nominal.observer
    dynamics = GainDynamics(symbolic := derive_error_dynamics(observer), operating_points(symbolic, spec))
    rms = NoiseModel(observer, spec, position_noise(spec)).rms(dynamics.settings())[0]
    assert len(rms) > 5 and rms.min() > 0 and np.isfinite(rms).all()
    np.testing.assert_allclose(rms, rms[:1].repeat(len(rms), axis=0), rtol=1e-9)

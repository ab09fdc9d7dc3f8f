"""Cross-validated losses of a fit, by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from codegen.diagnosis.fit import output_error
from codegen.diagnosis.fit.output_error import BLOCKS, Fit, Prior, Starts, segment_losses, segment_weights

SEGMENTS, SAMPLES = 64, 40
EIGHTH = SEGMENTS // BLOCKS


def fit_with(second: np.ndarray) -> Fit:
    """A linear model fitted to noise: the first parameter acts everywhere, the second by these slopes (S, K)."""
    draw = np.random.default_rng(5)
    residual, slopes = draw.normal(size=(SEGMENTS, SAMPLES)), np.stack([draw.normal(size=(SEGMENTS, SAMPLES)), second])
    runner: Any = SimpleNamespace(trial=SimpleNamespace(parts=()))
    prior = Prior(
        np.zeros((2, 2)), np.full(2, np.inf), np.zeros(2), np.ones(2), np.full(2, np.inf), np.full(2, -np.inf)
    )
    starts = Starts(np.zeros((SEGMENTS, SAMPLES, 0)), np.zeros((SEGMENTS, 0, SAMPLES)), np.zeros((SEGMENTS, 0)))
    limited = np.zeros(2, dtype=bool)
    return Fit(runner, np.zeros(2), np.zeros((0, 0)), residual, residual, slopes, starts, prior, limited)


def one_step_without(fit: Fit, block: int, count: int) -> np.ndarray:
    """(count,) least squares for the first parameters on the segments outside a block, by NumPy's lstsq."""
    kept = np.array_split(np.arange(SEGMENTS), BLOCKS)
    rest = np.concatenate([b for k, b in enumerate(kept) if k != block])
    roots = np.sqrt(segment_weights(fit.residual))[rest, None]
    columns = (fit.slopes[:count, rest] * roots).reshape(count, -1).T
    return cast(np.ndarray, np.linalg.lstsq(columns, (fit.residual[rest] * roots).ravel(), rcond=None)[0])


@pytest.mark.parametrize("block", [0, 3, 7])
def test_a_block_is_predicted_by_the_fit_to_the_others(block: int) -> None:
    fit = fit_with(np.random.default_rng(6).normal(size=(SEGMENTS, SAMPLES)))
    step, here = one_step_without(fit, block, 2), slice(block * EIGHTH, (block + 1) * EIGHTH)
    expected = segment_losses(fit.residual[here] - np.tensordot(step, fit.slopes[:, here], axes=1))
    np.testing.assert_allclose(fit.held_out_losses[here], expected, rtol=1e-5)


def test_what_one_block_alone_shows_stays_as_that_block_has_it() -> None:
    """A saturation reached once: elsewhere its slope is that of rounding, and by that it would move without end."""
    second = 1e-12 * np.random.default_rng(7).normal(size=(SEGMENTS, SAMPLES))
    second[:EIGHTH] = 50.0
    fit = fit_with(second)
    step = one_step_without(fit, 0, 1)
    expected = segment_losses(fit.residual[:EIGHTH] - step[0] * fit.slopes[0, :EIGHTH])
    np.testing.assert_allclose(fit.held_out_losses[:EIGHTH], expected, rtol=1e-5)


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
@pytest.mark.parametrize("rough", [False, True])
def test_a_value_at_its_limit_stays_there(rough: bool, order: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    """An axis with a lag and a wrong inertia, its mass at the limit of its tolerance beside the lag: without the limit
    only noise was left on held-out segments, so no second effect was sought, though the fit left twice the noise.
    """
    fit = fit_with(np.random.default_rng(6).normal(size=(SEGMENTS, SAMPLES)))
    fit = replace(fit, residual=fit.residual + 5.0 * fit.slopes[1], limited=np.array([False, True])[order])
    step, here = one_step_without(fit, 0, 1), slice(0, EIGHTH)
    expected = segment_losses(fit.residual[here] - step[0] * fit.slopes[0, here])
    pulled = replace(fit.prior, precision=np.diag(1e6 * fit.limited), centre=1.0 * fit.limited)
    fit = replace(fit, slopes=fit.slopes[order], prior=pulled)
    if rough:

        def run(theta: np.ndarray, offsets: np.ndarray) -> np.ndarray:
            return fit.residual - np.tensordot(theta, fit.slopes, axes=1)

        parts = (SimpleNamespace(effect=SimpleNamespace(rough=True)),)
        fit = replace(fit, runner=cast(Any, SimpleNamespace(trial=SimpleNamespace(parts=parts), run=run)))
        monkeypatch.setattr(output_error, "mean_residuals", lambda runner, residual: residual)
    np.testing.assert_allclose(fit.held_out_losses[here], expected, rtol=1e-5)


@pytest.mark.parametrize("truth", [1.0, 0.0])
def test_where_the_loss_is_not_smooth_a_block_is_simulated_after_the_step(
    truth: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A backlash beside an asymmetry, at its true values: by its slopes, a step of 1 % of a stiffness trebled the loss
    of a block, which free runs did not show, and the effect lost half of its gain.

    ``truth``: share of the step by the slopes of which free runs change; with none the step is not taken.
    """
    fit = fit_with(np.random.default_rng(6).normal(size=(SEGMENTS, SAMPLES)))
    wrong = 400.0 * fit.slopes[1, :EIGHTH]  # in one block, of a difference that passes a jump
    slopes = fit.slopes.copy()
    slopes[1, :EIGHTH] = wrong

    def run(theta: np.ndarray, offsets: np.ndarray) -> np.ndarray:
        change = np.tensordot(theta, fit.slopes, axes=1)
        return fit.residual - truth * change + (1 - truth) * np.abs(change)

    parts = (SimpleNamespace(effect=SimpleNamespace(rough=True)),)
    runner: Any = SimpleNamespace(trial=SimpleNamespace(parts=parts), run=run)
    monkeypatch.setattr(output_error, "mean_residuals", lambda runner, residual: residual)
    rough = replace(fit, runner=runner, slopes=slopes)
    step, here = one_step_without(rough, 0, 2), slice(0, EIGHTH)
    after = segment_losses(run(step, np.zeros(0)))
    taken = after[EIGHTH:].sum() < segment_losses(fit.residual)[EIGHTH:].sum()
    assert taken == bool(truth)
    expected = after[here] if taken else segment_losses(fit.residual)[here]
    np.testing.assert_allclose(rough.held_out_losses[here], expected, rtol=1e-5)
    assert np.abs(replace(fit, slopes=slopes).held_out_losses[here] / expected - 1).max() > 0.1


def test_a_fit_of_the_force_residual_is_never_simulated() -> None:
    """A backlash in a diagnosis by the force residual: its blocks were compared with free runs of other sizes."""

    def run(theta: np.ndarray, offsets: np.ndarray) -> np.ndarray:
        raise AssertionError("a free run for a force")

    smooth = fit_with(np.random.default_rng(6).normal(size=(SEGMENTS, SAMPLES)))
    parts = (SimpleNamespace(effect=SimpleNamespace(rough=True)),)
    runner: Any = SimpleNamespace(trial=SimpleNamespace(parts=parts), run=run)
    rough = replace(smooth, runner=runner, of_forces=True)
    np.testing.assert_array_equal(rough.held_out_losses, smooth.held_out_losses)

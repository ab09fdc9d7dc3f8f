"""Cross-validated losses of a fit, by hand."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from codegen.diagnosis.fit.output_error import BLOCKS, Fit, Prior, Starts, segment_losses, segment_weights

SEGMENTS, SAMPLES = 64, 40
EIGHTH = SEGMENTS // BLOCKS


def fit_with(second: np.ndarray) -> Fit:
    """A linear model fitted to noise: the first parameter acts everywhere, the second by these slopes (S, K)."""
    draw = np.random.default_rng(5)
    residual, slopes = draw.normal(size=(SEGMENTS, SAMPLES)), np.stack([draw.normal(size=(SEGMENTS, SAMPLES)), second])
    nothing: Any = None
    prior = Prior(np.zeros(2), np.zeros(2), np.ones(2), np.full(2, np.inf), np.full(2, -np.inf))
    starts = Starts(np.zeros((0, 0, 0)), np.zeros((0, 0, 0)), np.zeros((0, 0)))
    limited = np.zeros(2, dtype=bool)
    return Fit(nothing, np.zeros(2), np.zeros((0, 0)), residual, residual, slopes, starts, prior, limited)


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

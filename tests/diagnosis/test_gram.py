"""Fits and held-out errors from Gram matrices against numpy's least squares on the rows themselves."""

from __future__ import annotations

import numpy as np

from codegen.diagnosis.gram import cut_blocks, gram


def _data(seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(seed)
    columns = generator.normal(size=(3, 600, 2))
    target = 2 * columns[0] - 0.7 * columns[1] + 0.1 * generator.normal(size=(600, 2))
    return target, columns


def test_blocks_are_contiguous_and_cover_the_usable_samples() -> None:
    usable = np.ones(100, dtype=bool)
    usable[40:55] = False
    blocks = cut_blocks(usable, 2, 5)
    used = blocks.index[blocks.index >= 0]
    assert len(used) == 43
    assert (np.diff(used) >= 0).all()
    assert set(used) == set(range(5))
    assert (blocks.index[~usable] == -1).all()


def test_fit_and_held_out_error_equal_numpy_on_rows() -> None:
    target, columns = _data()
    blocks = [cut_blocks(np.ones(600, dtype=bool), 1, 6)] * 2
    scale = np.array([2.0, 0.5])
    grams = gram(target, columns, np.zeros(3), blocks, scale)
    rows = (columns / scale).reshape(3, -1).T
    right = (target / scale).ravel()
    expected, *_ = np.linalg.lstsq(rows, right, rcond=None)
    np.testing.assert_allclose(grams.fit(), expected, rtol=1e-9)
    block_of_row = np.repeat(blocks[0].index, 2)
    for b in range(6):
        others = block_of_row != b
        weights, *_ = np.linalg.lstsq(rows[others], right[others], rcond=None)
        left = right[~others] - rows[~others] @ weights
        np.testing.assert_allclose(grams.held_out()[b], left @ left, rtol=1e-9)


def test_ridge_equals_added_rows() -> None:
    target, columns = _data(1)
    blocks = [cut_blocks(np.ones(600, dtype=bool), 1, 4)] * 2
    grams = gram(target, columns, np.array([0.0, 50.0, 0.0]), blocks, np.ones(2))
    rows = np.vstack([columns.reshape(3, -1).T, [[0, np.sqrt(50.0), 0]]])
    expected, *_ = np.linalg.lstsq(rows, np.append(target.ravel(), 0.0), rcond=None)
    np.testing.assert_allclose(grams.fit(), expected, rtol=1e-9)


def test_conditioning_sees_a_column_that_adds_nothing() -> None:
    target, columns = _data(2)
    blocks = [cut_blocks(np.ones(600, dtype=bool), 1, 4)] * 2
    independent = gram(target, columns, np.zeros(3), blocks, np.ones(2)).conditioning()
    columns = np.concatenate([columns, columns[:1] + columns[1:2]])
    assert independent > 0.5
    assert gram(target, columns, np.zeros(4), blocks, np.ones(2)).conditioning() < 1e-12

"""What disturbances and a start reach in random linear systems, against their responses over thousands of samples."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.linalg import solve_discrete_lyapunov

from codegen.base.arrays import Array
from codegen.certify.bound.reach import REST, Reach

SAMPLES = 4000
COUNTS = [5, 20, 60, 200]


def system(seed: int, errors: int) -> tuple[Reach, Array, Array]:
    """A system of so many errors with a slowest eigenvalue of 0.98, its disturbances' columns and their sizes."""
    draw = np.random.default_rng(seed)
    step = draw.normal(size=(errors, errors))
    step *= 0.98 / np.abs(np.linalg.eigvals(step)).max()
    gamma = 0.985
    p = solve_discrete_lyapunov(step.T / gamma, np.diag(draw.uniform(0.1, 10, errors)))
    assert np.linalg.eigvalsh(gamma**2 * p - step.T @ p @ step).min() > 0
    inverse = np.linalg.inv(p)
    entry = np.linalg.inv(inverse - step @ inverse @ step.T / gamma) / (1 - gamma)
    return Reach(step, p, inverse, gamma, entry), draw.normal(size=(errors, 4)), draw.uniform(0, 2, 4)


def responses(step: Array) -> Array:
    """Φ^k for k = 0, 1, ..., (SAMPLES, m, m)."""
    powers = [np.eye(len(step))]
    for _ in range(SAMPLES - 1):
        powers.append(powers[-1] @ step)
    return np.array(powers)


@pytest.mark.parametrize(("seed", "errors"), [(1, 2), (2, 3), (3, 5), (4, 8)])
def test_the_sum_and_its_remainder_contain_the_whole_response(seed: int, errors: int) -> None:
    reach, columns, size = system(seed, errors)
    whole = np.abs(responses(reach.step) @ columns).sum(axis=0)
    summed, rest, samples = reach.sums(np.eye(errors), columns, [size])
    assert samples < SAMPLES / 2
    assert (summed <= whole * (1 + 1e-8)).all() and (whole <= summed + rest).all()
    assert (rest @ size <= REST * (1 + 1e-8) * (summed @ size)).all()
    # The first such number of samples: after one sample less the remainder was larger, of some row.
    fewer = np.abs(responses(reach.step)[: samples - 1] @ columns).sum(axis=0)
    row = reach.widths(np.linalg.matrix_power(reach.step, samples - 1))
    assert (row * float(reach.lengths(columns) @ size) > REST * (fewer @ size)).any()


@pytest.mark.parametrize(("seed", "errors"), [(1, 2), (2, 3), (3, 5), (4, 8)])
def test_no_start_in_the_box_leaves_its_level(seed: int, errors: int) -> None:
    """V is largest at a corner of the box; where disturbances keep it larger, the level is theirs."""
    reach, columns, size = system(seed, errors)
    start = np.random.default_rng(seed).uniform(0, 3, errors)
    corners = np.array(list(product((-1, 1), repeat=errors))) * start
    largest = max(float(corner @ reach.p @ corner) for corner in corners)
    quiet = reach.level_of(start, columns, 0 * size)
    assert largest <= quiet <= errors * largest
    kept = float(reach.lengths(columns) @ size) ** 2
    assert reach.level_of(0 * start, columns, size) == pytest.approx(kept, rel=1e-9)


@pytest.mark.parametrize(("seed", "errors"), [(1, 2), (2, 3), (3, 5), (4, 8)])
def test_no_disturbance_leaves_the_invariant_ellipsoid(seed: int, errors: int) -> None:
    """In the direction c the ellipsoid e'Pe ≤ S² extends to S√(c'P⁻¹c). After a step it is S√(c'ΦP⁻¹Φ'c) + Σ_j |c'b_j|
    d_j, no more than before for the worst c (of a convex function of c, ascent along its gradients finds it)."""
    reach, columns, size = system(seed, errors)
    radius = float(reach.lengths(columns) @ size)
    assert radius < float(np.sqrt(np.sum(columns * (reach.p @ columns), axis=0)) @ size) / (1 - reach.gamma)
    for level in (radius, 3 * radius):
        rows, shares = np.random.default_rng(seed).normal(size=(500, errors)), list[float]()
        for _ in range(100):
            carried, pushed = reach.widths(rows @ reach.step), rows @ columns
            share = (level * carried + np.abs(pushed) @ size) / (level * reach.widths(rows))
            shares.append(float(share.max()))
            image = rows @ reach.step @ reach.inverse @ reach.step.T
            rows = (level * image / carried[:, None] + np.sign(pushed) * size @ columns.T) @ reach.p
        assert shares[0] <= shares[-1] <= 1


@pytest.mark.parametrize("scale", [0.01, 1.0, 100.0])
@pytest.mark.parametrize(("seed", "errors"), [(1, 2), (2, 3), (3, 5), (4, 8)])
def test_after_a_start_no_sample_is_above_the_bound_from_there_on(seed: int, errors: int, scale: float) -> None:
    """The worst at a sample is attained: by the signs of the response, and the corner of the start in its direction."""
    reach, columns, size = system(seed, errors)
    start = scale * np.random.default_rng(seed).uniform(0.1, 3, errors)
    powers = responses(reach.step)
    driven = np.abs(powers @ columns) @ size
    for i, row in enumerate(np.eye(errors)):
        before = np.concatenate([[0.0], np.cumsum(driven[:-1, i])])
        worst = before + np.abs(powers[:, i]) @ start
        level = reach.level_of(start, columns, size)
        bounds = reach.later(row, columns * size, COUNTS, start, level)
        assert bounds == sorted(bounds, reverse=True)
        assert all(worst[k:].max() <= bound for k, bound in zip(COUNTS, bounds, strict=True))
        tail = before[COUNTS[-1]] + float(
            np.sqrt(powers[COUNTS[-1], i] @ reach.inverse @ powers[COUNTS[-1], i] * level)
        )
        assert bounds[-1] == pytest.approx(tail, rel=1e-8)

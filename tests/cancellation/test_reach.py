"""Which friction can be cancelled, against NumPy's ranks and projections, and by hand where x decides."""

from __future__ import annotations

import numpy as np
import pytest

from codegen.cancellation import reach
from codegen.mechanics.build import build_system
from tests.expected_errors import refused
from tests.machines import machine_text, read
from tests.slow_cases import slow_except

from .equations import random_mass, random_matrix


def found(M, B, U, weight="mass_inverse", envelope="", kind="gto"):
    spec = read(machine_text(M, B, U, "{}", kind, envelope))
    return reach(spec, build_system(spec), weight)


@pytest.mark.parametrize("seed", slow_except(range(24), range(8)))
def test_verdicts_are_those_of_ranks_and_projections(seed):
    generator = np.random.default_rng(seed)
    n, r, p = generator.integers(2, 5), generator.integers(1, 5), generator.integers(1, 5)
    B = random_matrix(generator, n, r, generator.integers(1, min(n, r) + 1))
    U = generator.integers(-1, 2, (n, p))
    U[0, np.all(U == 0, axis=0)] = 1
    M = np.diag(generator.integers(1, 6, n)) if seed % 2 else np.array(random_mass(generator, n))
    for weight, W in (
        ("mass_inverse", np.linalg.inv(M)),
        ("identity", np.eye(n)),
        ("acceleration", np.linalg.inv(M @ M)),
    ):
        result = found(M.tolist(), B.tolist(), U.tolist(), weight)
        assert result.exact and result.rank == np.linalg.matrix_rank(B)
        columns = np.hstack([U, np.eye(n)])
        for verdict, d in zip((*result.contacts, *result.coordinates), columns.T, strict=True):
            joined = np.linalg.matrix_rank(np.column_stack([B, d]))
            touched = np.abs(B.T @ W @ d).max() > 1e-9
            expected = "perfect" if joined == result.rank else "partial" if touched else "none"
            u = np.linalg.lstsq(np.linalg.cholesky(W).T @ B, np.linalg.cholesky(W).T @ d, rcond=None)[0]
            rest = B @ u - d
            assert (verdict.kind, verdict.joined_rank) == (expected, joined)
            assert verdict.share[0] == pytest.approx(1 - (rest @ W @ rest) / (d @ W @ d), abs=1e-9)
        rank = np.linalg.matrix_rank
        assert result.together == p - (rank(np.hstack([B, U])) - rank(B))


def test_section_5_4_and_its_note_2():
    result = found([[10, 0], [0, 50]], [[0], [1]], [[1, 0], [-1, 1]])
    assert [v.kind for v in result.contacts] == ["partial", "perfect"]
    assert [v.kind for v in result.coordinates] == ["none", "perfect"]
    # of the pair ±F on the masses the input takes the share on the bottom mass: (1/50) / (1/10 + 1/50)
    assert result.contacts[0].share == pytest.approx((1 / 6, 1 / 6))
    reduction = result.reduction
    assert (reduction.undriven, reduction.lost, reduction.contacts) == (("x1",), ("c1",), ("c2",))
    assert reduction.input_matrix.tolist() == [[1]] and reduction.distribution.tolist() == [[1]]


def test_note_2_misses_what_a_rank_sees():
    result = found([[1, 0], [0, 1]], [[1], [1]], [[1, 1], [1, -1]])
    assert result.reduction.lost == ()
    assert [v.kind for v in result.contacts] == ["perfect", "none"]


def test_two_contacts_that_can_only_be_cancelled_together():
    result = found([[1, 0], [0, 1]], [[1], [1]], [[1, 0], [0, 1]])
    assert [v.kind for v in result.contacts] == ["partial", "partial"]
    assert result.cancellable == () and result.together == 1


def test_the_weight_decides_what_cannot_be_touched():
    M, B, U = [[2, 1], [1, 2]], [[1], [0]], [[0], [1]]
    assert found(M, B, U, "identity").contacts[0].kind == "none"
    assert found(M, B, U, "mass_inverse").contacts[0].kind == "partial"


@pytest.mark.parametrize(
    ("B", "direction", "kind", "exact"),
    [
        ([["sin(x1)"], ["cos(x1)"]], [["2*sin(x1)"], ["2*cos(x1)"]], "perfect", True),
        ([["sin(2*x1)"], ["cos(x1)"]], [["2*sin(x1)"], ["1"]], "perfect", True),
        ([["sin(x1)"], ["cos(x1)"]], [["cos(x1)"], ["-sin(x1)"]], "none", True),
        ([["sin(x1)"], ["cos(x1)"]], [["cos(x1)"], ["sin(x1)"]], "partial", True),
        (
            [["sin(x1 + x2)"], ["1"]],
            [["sin(x1)*cos(x2) + cos(x1)*sin(x2)"], ["sin(x1)**2 + cos(x1)**2"]],
            "perfect",
            True,
        ),
        ([["exp(x1)"], ["1"]], [["exp(2*x1)"], ["exp(x1)"]], "perfect", False),
        ([["x1"], ["1"]], [["x1 + 0.000001"], ["1"]], "partial", True),
    ],
)
def test_ranks_hold_for_every_position_or_say_that_they_were_sampled(B, direction, kind, exact):
    result = found([[1, 0], [0, 1]], B, direction, "identity")
    assert (result.contacts[0].kind, result.exact) == (kind, exact)


def test_a_force_that_is_not_linear_in_an_input_is_refused():
    text = machine_text([[1]], [["1"]], [[1]], kind="gto").replace("(1)*w1", "abs(w1)")
    with refused("SPEC027 x1 w1 sgn(w1) B(x)"):
        reach(read(text), build_system(read(text)), "identity")

"""Strongly connected components against SciPy's."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from codegen.program.schedule import strong_components


@given(st.integers(0, 2**49 - 1))
def test_the_same_nodes_are_together(bits: int) -> None:
    count = 7
    edges = {divmod(k, count) for k in range(count**2) if bits >> k & 1}
    rows, columns = np.array(sorted(edges), dtype=int).reshape(-1, 2).T
    matrix = coo_matrix((np.ones(len(edges)), (rows, columns)), shape=(count, count))
    theirs = connected_components(matrix, connection="strong")[1]
    ours = np.array(strong_components(count, edges))
    assert ((ours[:, None] == ours) == (theirs[:, None] == theirs)).all()


def test_a_long_chain_needs_no_stack() -> None:
    length = 100_000
    assert len(set(strong_components(length, [(k, k + 1) for k in range(length - 1)]))) == length
    assert len(set(strong_components(length, [(k, (k + 1) % length) for k in range(length)]))) == 1

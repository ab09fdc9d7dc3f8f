"""Note 2 of section 5.3: removal of coordinates without input and of the contacts that act on them."""

from __future__ import annotations

from dataclasses import dataclass

import sympy

from codegen.mechanics.system import Matrix, System


@dataclass(frozen=True)
class Reduction:
    """B̄ ū = Ū F̄ₙ (5.16).

    Attributes:
        undriven: coordinates whose row of B is zero (i₁ … iₗ).
        lost: contacts that act on one of these (j₁ … jₛ): their friction cannot be cancelled perfectly.
        coordinates, contacts: the remaining ones; rows of B̄ and Ū, columns of Ū.
        input_matrix, distribution: B̄ and Ū.
    """

    undriven: tuple[str, ...]
    lost: tuple[str, ...]
    coordinates: tuple[str, ...]
    contacts: tuple[str, ...]
    input_matrix: Matrix
    distribution: Matrix


def reduce(system: System, input_matrix: Matrix) -> Reduction:
    """Steps 1 to 3 of note 2: they remove contacts that act where no input does.

    A remaining contact may still be unreachable, where B has dependent rows without a zero row; see ``reach``.

    Args:
        input_matrix: B, n by inputs.
    """
    B, U = sympy.Matrix(input_matrix), sympy.Matrix(system.distribution)
    undriven = [i for i in range(B.rows) if all(e == 0 for e in B.row(i))]
    lost = [j for j in range(U.cols) if any(U[i, j] != 0 for i in undriven)]
    rows = [i for i in range(B.rows) if i not in undriven]
    columns = [j for j in range(U.cols) if j not in lost]
    positions, names = [x.name for x in system.positions], [c.name for c in system.contacts]
    return Reduction(
        tuple(positions[i] for i in undriven),
        tuple(names[j] for j in lost),
        tuple(positions[i] for i in rows),
        tuple(names[j] for j in columns),
        Matrix(B.extract(rows, list(range(B.cols)))),
        Matrix(U.extract(rows, columns)),
    )

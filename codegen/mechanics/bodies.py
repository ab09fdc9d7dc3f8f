"""Bodies side by side: their positions and masses in one vector, and the contacts between them by Lemma A.1."""

from __future__ import annotations

from collections.abc import Sequence

import sympy

from codegen.mechanics.sparse import diagonal, sparse
from codegen.mechanics.system import Matrix
from codegen.spec.model import Contact
from codegen.spec.motion import Body


def body_axes(bodies: Sequence[Body]) -> list[tuple[str, str]]:
    """(body, direction) for each row of what follows."""
    return [(body.name, direction) for body in bodies for direction in body.positions]


def body_positions(bodies: Sequence[Body]) -> Matrix:
    """x̄, k by 1: (A.41), body by body instead of direction by direction."""
    return Matrix([position for body in bodies for position in body.positions.values()])


def body_masses(bodies: Sequence[Body]) -> Matrix:
    """M̄ = diag of masses and moments of inertia, k by k: (A.5), (A.43)."""
    return diagonal(body.weight(direction) for body in bodies for direction in body.positions)


def body_distribution(bodies: Sequence[Body], contacts: Sequence[Contact]) -> Matrix:
    """Ū, k by contacts, of Lemma A.1, with columns for the contacts that exist (A.36) alone.

    A contact of bodies i and j slides by u = v_i − v_j, against the ground by u = v_i: its column has +1 at i and −1
    at j, times the contact's share of each direction. A contact without bodies has a column of zeros.
    """
    row = {axis: i for i, axis in enumerate(body_axes(bodies))}
    entries: dict[tuple[int, int], sympy.Expr] = {}
    for k, contact in enumerate(contacts):
        if contact.sliding is None:
            continue
        first, second = contact.sliding.bodies
        for direction, share in contact.sliding.along.items():
            for body, sign in ((first, 1), (second, -1)):
                if (body, direction) in row:  # the ground does not move
                    at = row[body, direction], k
                    entries[at] = entries.get(at, sympy.S.Zero) + sign * share
    return sparse(len(row), len(contacts), entries)

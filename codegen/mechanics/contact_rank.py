"""More contacts than degrees of freedom: when the friction of single contacts cannot be identified."""

from __future__ import annotations

from codegen.base.errors import BadInput
from codegen.mechanics.sampling import rank, sampled_values
from codegen.mechanics.system import Matrix
from codegen.spec.model import Spec

BY_COORDINATE = ("to", "gto")
"""Observers of the force on each coordinate; every other estimates each contact by itself."""


def dependent_contacts(spec: Spec, distribution: Matrix) -> tuple[str, ...]:
    """The first contact whose column of U depends on those before it everywhere in the envelope, with these.

    Returns:
        Names of the contacts, the dependent one last; () where U has full column rank at almost every position.
    """
    points = sampled_values(spec)
    if rank(distribution, points) == distribution.cols:
        return ()
    for k in range(distribution.cols):
        if rank(distribution[:, : k + 1], points) > k:
            continue
        # Those without which the rest would be independent are the ones that take part.
        alone = [j for j in range(k) if rank(_without(distribution[:, : k + 1], j), points) == k]
        return tuple(spec.contacts[j].name for j in (*alone, k))
    return ()


def refuse_dependent_contacts(spec: Spec, distribution: Matrix) -> None:
    """Raise BadInput where an observer of each contact would act on contacts that slide dependently.

    Its error decays at K_F U'M⁻¹U (4.19), which is singular when the rank of U is below the number of contacts: a
    combination of levels that gives no force never shows in the motion. An observer of the force on each coordinate
    (GTO) does not need to tell contacts apart.
    """
    if spec.observer is None or spec.observer.kind in BY_COORDINATE:
        return
    names = dependent_contacts(spec, distribution)
    if not names:
        return
    count, motions = len(spec.contacts), rank(distribution, sampled_values(spec))
    found = (
        f"{spec.observer.kind} on {count} contacts that slide in {motions} independent ways: the slip of "
        f"{names[-1]} follows from that of {' and '.join(names[:-1])}, so U'M^-1 U is singular and no gain tells "
        "their friction apart"
    )
    raise BadInput(
        spec.place("observer.kind"), found, "contacts that slide independently, or gto", "gto", code="SPEC019"
    )


def _without(matrix: Matrix, column: int) -> Matrix:
    kept = [j for j in range(matrix.cols) if j != column]
    return Matrix(matrix[:, kept])

"""Solution method for the best input: inputs used, factorisation of B, and proof that it is regular in the envelope."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, islice
from typing import Any

import numpy as np
import sympy

from codegen.base.errors import BadInput
from codegen.cancellation.optimum import SINGULAR
from codegen.cancellation.reach import Reach
from codegen.cancellation.regular import Regularity, keeps_rank
from codegen.cancellation.weight import whitener
from codegen.mechanics.system import Matrix
from codegen.spec.model import CancellationChoice, Spec
from codegen.spec.numerics import numerical

MOST_CHOICES = 200


class RankFalls(BadInput):
    """The best input is unbounded in the envelope: the rank of B falls somewhere, or could not be proven constant."""


@dataclass(frozen=True)
class Plan:
    """Rank factorisation B = C R, with C of full column rank and R of full row rank, everywhere in the envelope.

    Attributes:
        contacts: indices of the contacts whose friction is to be cancelled.
        columns: C, n by rank; the identity where B has full row rank, else columns of B, or coefficients of its rows.
        mixing: R, rank by inputs; the identity where B has full column rank; rows of B where its columns lose rank.
        pivots: the only inputs used, by Appendix B; None for the smallest input.
        condition: the worst condition number of the weighted C over points of the envelope, next to that of R.
        damping: λ of (B'WB + λ I), or 0.
        proven: whether the rank is proven to hold in the whole envelope.
    """

    contacts: tuple[int, ...]
    columns: Matrix
    mixing: Matrix
    pivots: tuple[int, ...] | None
    condition: float
    damping: float
    proven: bool


@numerical("the best input")
def make_plan(spec: Spec, choice: CancellationChoice, found: Reach) -> Plan:
    """Choose the solution method.

    Raises:
        BadInput: where no input acts, or no contact can be cancelled.
        RankFalls: where the rank of B falls, or may fall, in the envelope, and there is no damping.
    """
    B, rank = sympy.Matrix(found.input_matrix), found.rank
    place = spec.place("cancellation")
    if rank == 0:
        raise BadInput(place, "no input that acts on any coordinate", "a force that the inputs enter", code="SPEC027")
    contacts = _contacts(spec, choice, found)
    if choice.damping:
        weighted = _weighted(found, B)
        size = float(np.linalg.norm(weighted, ord=2, axis=(1, 2)).max())
        return Plan(
            contacts, Matrix(B), Matrix(sympy.eye(B.cols)), None, np.inf, float(choice.damping) ** 2 * size**2, True
        )
    pivots = _pivots(found) if choice.method == "appendix_b" or rank < min(B.shape) else tuple(range(B.cols))
    chosen = B[:, list(pivots)]
    if choice.method == "appendix_b":
        inputs = ", ".join(found.system.inputs[j].name for j in pivots)
        proven = _require_regular(spec, found, chosen, f"an input matrix of {inputs} alone")
        return Plan(contacts, Matrix(chosen), Matrix(sympy.eye(rank)), pivots, _condition(found, chosen), 0.0, proven)
    if rank == B.rows:
        proven = _require_regular(spec, found, B)
        return Plan(contacts, Matrix(sympy.eye(rank)), Matrix(B), None, _condition(found, B), 0.0, proven)
    if rank == B.cols:
        proven = _require_regular(spec, found, B)
        return Plan(contacts, Matrix(B), Matrix(sympy.eye(rank)), None, _condition(found, B), 0.0, proven)
    columns, mixing, proven = _factors(spec, found, chosen)
    return Plan(contacts, Matrix(columns), Matrix(mixing), None, _condition(found, columns), 0.0, proven)


def _factors(spec: Spec, found: Reach, chosen: Any) -> tuple[Any, Any, bool]:
    """C, R and whether they are proven regular, where B has neither full row rank nor full column rank.

    C are columns of B, or R are rows of it: the chosen ones may lose rank where B does not.
    """
    B = sympy.Matrix(found.input_matrix)
    if _regular(found, chosen).proven:
        return chosen, _coefficients(chosen, B), True
    rows = B[list(_farthest(found, B.T)), :]
    if _regular(found, rows).proven:
        return _coefficients(rows.T, B.T).T, rows, True
    _require_regular(spec, found, B)
    fault = f"an input matrix that keeps its rank {found.rank}, while no {found.rank} of its columns or rows do"
    return chosen, _coefficients(chosen, B), _require_regular(spec, found, chosen, f"{fault}: columns")


def _contacts(spec: Spec, choice: CancellationChoice, found: Reach) -> tuple[int, ...]:
    names = [c.name for c in found.system.contacts]
    if choice.contacts == "all":
        return tuple(range(len(names)))
    place = spec.place("cancellation.contacts")
    if spec.observer is not None and spec.observer.kind in ("to", "gto"):
        observed = f"{spec.observer.kind}, which estimates the force on each coordinate and not that of each contact"
        raise BadInput(
            place,
            f"single contacts, which {observed} does not estimate",
            "`contacts: all`, or gcfo, gdfo or mgto",
            "mgto",
            code="SPEC027",
        )
    chosen = found.cancellable if choice.contacts == "cancellable" else choice.contacts
    if not chosen:
        raise BadInput(
            place, "no contact whose friction the inputs can cancel perfectly", "`contacts: all`", "all", code="SPEC027"
        )
    return tuple(names.index(name) for name in chosen)


def _pivots(found: Reach) -> tuple[int, ...]:
    """The inputs, as many as the rank, whose columns of B keep the largest least singular value in the envelope."""
    return _farthest(found, sympy.Matrix(found.input_matrix))


def _farthest(found: Reach, matrix: Any) -> tuple[int, ...]:
    best, chosen = -1.0, tuple(range(found.rank))
    for columns in islice(combinations(range(matrix.cols), found.rank), MOST_CHOICES):
        singular = np.linalg.svd(found.numbers(Matrix(matrix[:, list(columns)])), compute_uv=False)
        worst = float(singular[:, -1].min())
        if worst > best * (1 + SINGULAR):
            best, chosen = worst, columns
    return chosen


def _coefficients(chosen: Any, B: Any) -> Any:
    """R of B = C R, entry by entry in lowest terms."""
    gram = chosen.T * chosen
    solved = gram.inv(method="ADJ") * chosen.T * B
    return solved.applyfunc(lambda entry: sympy.simplify(sympy.cancel(entry)))


def _regular(found: Reach, matrix: Any) -> Regularity:
    return keeps_rank(matrix, found.rank, found.system.values, found.variables, found.ranges)


def _require_regular(spec: Spec, found: Reach, matrix: Any, what: str = "an input matrix") -> bool:
    """Raise RankFalls where the solution would divide by zero somewhere in the envelope."""
    regular = _regular(found, matrix)
    if regular.proven:
        return True
    if regular.falls_at is not None:
        at = ", ".join(f"{name} = {value:.4g}" for name, value in regular.falls_at.items())
        fault = f"{what} whose rank {found.rank} falls at {at}"
    else:
        fault = f"{what} that could not be proven to keep its rank {found.rank} in the envelope"
    expected = "an envelope in which the rank stays, or `damping: 0.01`, which bounds the input where it falls"
    raise RankFalls(spec.place("cancellation"), f"{fault}: the best input has no bound there", expected)


def _weighted(found: Reach, matrix: Any) -> Any:
    masses = found.numbers(found.system.mass_matrix)
    return np.array([whitener(found.weight, m) @ b for m, b in zip(masses, found.numbers(Matrix(matrix)), strict=True)])


def _condition(found: Reach, matrix: Any) -> float:
    """The worst over the envelope; the weight matters only where a force remains."""
    numbers = found.numbers(Matrix(matrix)) if found.rank == matrix.rows else _weighted(found, matrix)
    return float(np.linalg.cond(numbers).max())

"""Rank factorisation B = C R for the cancelling input: the inputs used, and proof of constant rank in the envelope."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations, islice
from math import comb
from typing import Any

import numpy as np
import sympy
from scipy import optimize

from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.cancellation.optimum import SINGULAR, best_inputs, whitener
from codegen.cancellation.reach import Reach
from codegen.certify.cover import some_is_nonzero
from codegen.mechanics.casadi_form import at_points, function_of
from codegen.mechanics.compact import compact
from codegen.mechanics.system import Matrix
from codegen.observers import OBSERVERS
from codegen.spec.model import CancellationChoice, Spec
from codegen.spec.numerics import numerical

MOST_CHOICES = 200
"""Most subsets of columns that are compared."""
NEGLIGIBLE = 1e-9
"""Share of a direction's length below which a deviation from it counts as rounding."""
MOST_MINORS = 40
"""Most minors of the size of the rank; for a matrix with more, constant rank is not proven."""
VANISHING = 1e-7
"""Share of the largest singular value below which one counts as zero."""
STARTS = 5
"""Number of local minimisations of a singular value, from the sampled points at which it is smallest."""


class RankFalls(BadInput):
    """The rank of B falls somewhere in the envelope, or is not proven constant: the best input is unbounded there."""


@dataclass(frozen=True)
class Plan:
    """Rank factorisation B = C R, with C of full column rank and R of full row rank, everywhere in the envelope.

    Attributes:
        contacts: indices of the contacts whose friction is to be cancelled.
        columns: C, n by rank: the identity if B has full row rank, else columns of B, or coefficients of its rows.
        mixing: R, rank by inputs: the identity if B has full column rank, or rows of B if its columns lose rank.
        pivots: the inputs used, by Appendix B; None for the solution of least norm.
        condition: the largest condition number over points of the envelope, of the matrix that is inverted.
        damping: λ of (B'WB + λ I)⁻¹ (Tikhonov regularisation), or 0.
        proven: whether the rank is proven constant in the whole envelope.
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
    """The rank factorisation of a spec's B for its choice of method, contacts and damping.

    Raises:
        BadInput: if no input acts, or the friction of no contact can be cancelled.
        RankFalls: if the rank of B falls, or may fall, in the envelope, and there is no damping.
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
    of_inputs = choice.method == "appendix_b"
    pivots = tuple(range(B.cols))
    if of_inputs or rank < min(B.shape):
        pivots = _best_conditioned_columns(found, B)
    chosen, unit = B[:, list(pivots)], sympy.eye(rank)
    if of_inputs:
        inputs = ", ".join(found.system.inputs[j].name for j in pivots)
        proven = _require_regular(spec, found, chosen, f"an input matrix of {inputs} alone")
        columns, mixing, held = chosen, unit, chosen
    elif rank in B.shape:
        proven = _require_regular(spec, found, B)
        columns, mixing, held = (unit, B, B) if rank == B.rows else (B, unit, B)
    else:
        columns, mixing, proven = _factors(spec, found, chosen)
        held = columns
    used, condition = pivots if of_inputs else None, _condition(found, held)
    return Plan(contacts, Matrix(columns), Matrix(mixing), used, condition, 0.0, proven)


def _factors(spec: Spec, found: Reach, chosen: Any) -> tuple[Any, Any, bool]:
    """C, R and whether their ranks are proven constant, for a B with neither full row rank nor full column rank.

    Either C are columns of B, or R are rows of B: those chosen may lose rank at a point where B does not.
    """
    B = sympy.Matrix(found.input_matrix)
    if _regular(found, chosen).proven:
        return chosen, _coefficients(chosen, B), True
    rows = B[list(_best_conditioned_columns(found, B.T)), :]
    if _regular(found, rows).proven:
        return _coefficients(rows.T, B.T).T, rows, True
    _require_regular(spec, found, B)
    fault = f"an input matrix that keeps its rank {found.rank}, while no {found.rank} of its columns or rows do"
    return chosen, _coefficients(chosen, B), _require_regular(spec, found, chosen, f"{fault}: columns")


def _contacts(spec: Spec, choice: CancellationChoice, found: Reach) -> tuple[int, ...]:
    """Indices of the contacts to be cancelled. Raises BadInput if the observer does not estimate them, or for none."""
    names = [c.name for c in found.system.contacts]
    if choice.contacts == "all":
        return tuple(range(len(names)))
    place = spec.place("cancellation.contacts")
    if spec.observer is not None and not OBSERVERS[spec.observer.kind].by_contact:
        of_sums = f"single contacts with `kind: {spec.observer.kind}`, which estimates the force on each coordinate"
        by_contact = [name for name, kind in OBSERVERS.items() if kind.by_contact and not kind.general]
        raise BadInput(
            place,
            f"{of_sums} and not that of each contact",
            f"`contacts: all`, or an observer of each contact: {', '.join(by_contact)}",
            "mgto",
            code="SPEC027",
        )
    chosen = found.cancellable if choice.contacts == "cancellable" else choice.contacts
    if not chosen:
        raise BadInput(
            place, "no contact whose friction the inputs can cancel perfectly", "`contacts: all`", "all", code="SPEC027"
        )
    return tuple(names.index(name) for name in chosen)


def _best_conditioned_columns(found: Reach, matrix: Any) -> tuple[int, ...]:
    """Of all subsets of rank(B) columns, the one whose smallest singular value over the envelope is the largest."""
    best, chosen = -1.0, tuple(range(found.rank))
    for columns in islice(combinations(range(matrix.cols), found.rank), MOST_CHOICES):
        singular = np.linalg.svd(found.numbers(Matrix(matrix[:, list(columns)])), compute_uv=False)
        worst = float(singular[:, -1].min())
        if worst > best * (1 + SINGULAR):
            best, chosen = worst, columns
    return chosen


def _coefficients(chosen: Any, B: Any) -> Any:
    """The R of B = C R, R = (C'C)⁻¹C'B, entry by entry in lowest terms."""
    gram = chosen.T * chosen
    solved = gram.inv(method="ADJ") * chosen.T * B
    return solved.applyfunc(lambda entry: sympy.simplify(sympy.cancel(entry)))


def _regular(found: Reach, matrix: Any) -> Regularity:
    return keeps_rank(matrix, found.rank, found.system.values, found.variables, found.ranges)


def _require_regular(spec: Spec, found: Reach, matrix: Any, what: str = "an input matrix") -> bool:
    """True if the rank of ``matrix`` is proven constant in the envelope; RankFalls otherwise."""
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
    """V · matrix, V'V = W, at the points of the envelope."""
    masses = found.numbers(found.system.mass_matrix)
    return np.array([whitener(found.weight, m) @ b for m, b in zip(masses, found.numbers(Matrix(matrix)), strict=True)])


def _condition(found: Reach, matrix: Any) -> float:
    """The largest condition number over points of the envelope; weighted if a force may remain."""
    numbers = found.numbers(Matrix(matrix)) if found.rank == matrix.rows else _weighted(found, matrix)
    return float(np.linalg.cond(numbers).max())


@dataclass(frozen=True)
class Regularity:
    """Whether a rank is proven constant over the envelope, and a point (variable → value) where it is lower, if any."""

    proven: bool
    falls_at: Mapping[str, float] | None = None


def keeps_rank(
    matrix: Any,
    rank: int,
    values: Mapping[sympy.Symbol, Any],
    variables: tuple[sympy.Symbol, ...],
    ranges: tuple[tuple[float, float], ...],
) -> Regularity:
    """Whether a matrix over parameters and ``variables`` has its generic ``rank`` at every point of the ranges.

    Proof by interval arithmetic: the ranges are bisected until on each box the interval of some minor (the determinant
    of a rank-by-rank submatrix) excludes zero. It is not tried for more than ``MOST_MINORS`` minors.
    """
    inside = sympy.Matrix(matrix).subs(dict(values))
    used = tuple(v for v in variables if v in inside.free_symbols)
    if not used or rank == 0:
        return Regularity(True)
    bounds = [ranges[variables.index(v)] for v in used]
    falls = _rank_deficient_point(inside, rank, used, bounds)
    if falls is not None:
        return Regularity(False, falls)
    if comb(inside.rows, rank) * comb(inside.cols, rank) > MOST_MINORS:
        return Regularity(False)
    return Regularity(some_is_nonzero(_minors(inside, rank), used, bounds))


def _minors(matrix: Any, rank: int) -> list[Any]:
    """The nonzero rank-by-rank minors."""
    rows, columns = range(matrix.rows), range(matrix.cols)
    found = [
        compact(matrix.extract(list(i), list(j)).det(method="berkowitz"))
        for i in combinations(rows, rank)
        for j in combinations(columns, rank)
    ]
    return [m for m in found if m != 0]


def _rank_deficient_point(
    matrix: Any, rank: int, variables: tuple[sympy.Symbol, ...], bounds: list[tuple[float, float]]
) -> dict[str, float] | None:
    """A point at which the ``rank``-th singular value nearly vanishes, by minimisation from several starts; or None."""
    function = function_of(Matrix(matrix), variables)

    def singular_values(points: Any) -> Any:
        return np.linalg.svd(np.nan_to_num(at_points(function, points)), compute_uv=False)

    box = np.array(bounds)
    spread = np.random.default_rng(2).uniform(box[:, 0], box[:, 1], (400, len(box)))
    ends = np.array(np.meshgrid(*[(low, (low + high) / 2, high) for low, high in box[:6]])).reshape(len(box[:6]), -1).T
    tried = np.vstack([spread, np.hstack([ends, np.tile(box[6:].mean(axis=1), (len(ends), 1))])])
    singular = singular_values(tried)
    size = float(singular[:, 0].max())

    def smallest(point: Any) -> float:
        return float(singular_values(point[None, :])[0, rank - 1])

    for start in tried[np.argsort(singular[:, rank - 1])[:STARTS]]:
        found = optimize.minimize(smallest, start, method="Nelder-Mead", bounds=bounds, options={"xatol": 1e-12})
        if found.fun <= VANISHING * size:
            return {v.name: float(p) for v, p in zip(variables, found.x, strict=True)}
    return None


@dataclass(frozen=True)
class RemainingFriction:
    """Friction that remains with cancellation, for a perfect estimate and gain 1.

    Attributes:
        gains: K at the centre of the envelope, inputs by contacts: ū = K F̄.
        force: B K − U there, coordinates by contacts: the force that remains for each contact.
        may_feed_energy: contacts whose remaining force is not purely dissipative somewhere in the envelope: it is not
            −c d with c ≥ 0 for the contact's direction d, so for some motion its power is positive. The best input
            leaves −(I − P) d, with P d the reachable part of d, which is a multiple of d only where P d is d or 0.
            These are therefore the contacts cancelled in part, and, with damping, reachable ones whose remaining force
            is not parallel to d.
    """

    gains: Array
    force: Array
    may_feed_energy: tuple[str, ...]


def remaining_friction(found: Reach, plan: Plan) -> RemainingFriction:
    """K and the remaining friction at the centre of the envelope, and the contacts that may feed energy in it."""
    system = found.system
    B, U, M = (found.numbers(m) for m in (found.input_matrix, system.distribution, system.mass_matrix))
    gains = _gains(found, plan, B[0], M[0], U[0])
    feeding = {found.contacts[j].name for j in plan.contacts if found.contacts[j].kind == "partial"}
    if plan.damping:
        for b, m, u in zip(B, M, U, strict=True):
            rest = b @ _gains(found, plan, b, m, u) - u
            feeding |= {v.name for j, v in enumerate(found.contacts) if not _is_dissipative(rest[:, j], u[:, j])}
    ordered = tuple(v.name for v in found.contacts if v.name in feeding)
    return RemainingFriction(gains, B[0] @ gains - U[0], ordered)


def _gains(found: Reach, plan: Plan, B: Array, M: Array, U: Array) -> Array:
    """K at one operating point, inputs by contacts; zero for contacts that are not to be cancelled."""
    gains, chosen = np.zeros((B.shape[1], U.shape[1])), list(plan.contacts)
    if plan.damping:
        white = whitener(found.weight, M)
        regular = (white @ B).T @ (white @ B) + plan.damping * np.eye(B.shape[1])
        gains[:, chosen] = np.linalg.solve(regular, (white @ B).T @ white @ U[:, chosen])
    else:
        gains[:, chosen] = best_inputs(B, M, U[:, chosen], found.weight, plan.pivots)
    return gains


def _is_dissipative(rest: Any, direction: Any) -> bool:
    """Whether a remaining force is −c d with c ≥ 0, for the direction d of a contact's friction."""
    size = float(direction @ direction)
    if size == 0:
        return True
    share = -float(rest @ direction) / size
    off = np.linalg.norm(rest + share * direction)
    return bool(share >= -NEGLIGIBLE and off <= NEGLIGIBLE * np.sqrt(size))

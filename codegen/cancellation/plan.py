"""Solution method for the best input: inputs used, factorisation of B, and proof that it is regular in the envelope."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
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
from codegen.certify.prefix import rational_text, to_prefix
from codegen.checker import verify
from codegen.mechanics.casadi_form import at_points, function_of
from codegen.mechanics.compact import compact
from codegen.mechanics.system import Matrix
from codegen.spec.model import CancellationChoice, Spec
from codegen.spec.numerics import numerical

MOST_CHOICES = 200
NOTHING = 1e-9
MOST_MINORS = 40
"""A matrix with more minors of the size of its rank is not proven."""
MOST_BOXES = 4000
"""Boxes that are examined before the proof is given up."""
VANISHING = 1e-7
"""A singular value below this share of the largest one counts as zero."""
STARTS = 5
"""Local minimisations of the singular value, from the best of the sampled points."""

Box = tuple[tuple[Fraction, Fraction], ...]


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
    of_inputs = choice.method == "appendix_b"
    pivots = tuple(range(B.cols))
    if of_inputs or rank < min(B.shape):  # the inputs whose columns keep the largest least singular value
        pivots = _farthest(found, B)
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


def _farthest(found: Reach, matrix: Any) -> tuple[int, ...]:
    """The columns, as many as the rank of B, whose least singular value over the envelope is the largest."""
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


@dataclass(frozen=True)
class Regularity:
    """Constancy of a rank over the envelope.

    Attributes:
        proven: the rank is the same everywhere in it.
        falls_at: variable → value where the rank falls; None where no such point was found.
    """

    proven: bool
    falls_at: Mapping[str, float] | None = None


def keeps_rank(
    matrix: Any,
    rank: int,
    values: Mapping[sympy.Symbol, Any],
    variables: tuple[sympy.Symbol, ...],
    ranges: tuple[tuple[float, float], ...],
) -> Regularity:
    """Whether ``matrix`` has ``rank``, its generic one, at every point of the ranges.

    The envelope is bisected until on each box the enclosure of some minor, the determinant of a rank-by-rank submatrix,
    excludes zero.

    Args:
        matrix: n by m over parameters and ``variables``.
        values: of the parameters, exact.
    """
    inside = sympy.Matrix(matrix).subs(dict(values))
    used = tuple(v for v in variables if v in inside.free_symbols)
    if not used or rank == 0:
        return Regularity(True)
    bounds = [ranges[variables.index(v)] for v in used]
    falls = _falls(inside, rank, used, bounds)
    if falls is not None:
        return Regularity(False, falls)
    try:
        return Regularity(_proven(_minors(inside, rank), used, bounds))
    except (TypeError, verify.Refused):
        return Regularity(False)


def _minors(matrix: Any, rank: int) -> list[Any]:
    rows, columns = range(matrix.rows), range(matrix.cols)
    if comb(matrix.rows, rank) * comb(matrix.cols, rank) > MOST_MINORS:
        raise TypeError("too many minors")
    found = [
        compact(matrix.extract(list(i), list(j)).det(method="berkowitz"))
        for i in combinations(rows, rank)
        for j in combinations(columns, rank)
    ]
    return [m for m in found if m != 0]


def _proven(minors: list[Any], variables: tuple[sympy.Symbol, ...], bounds: list[tuple[float, float]]) -> bool:
    known = [v.name for v in variables]
    values = [verify.parse(to_prefix(m), known, "minor")[1] for m in minors]
    ends = [tuple(Fraction(rational_text(sympy.Rational(b))) for b in pair) for pair in bounds]
    boxes: list[Box] = [tuple((low, high) for low, high in ends)]
    for _ in range(MOST_BOXES):
        if not boxes:
            return True
        box = boxes.pop()
        if not any(_away_from_zero(value, dict(zip(known, box, strict=True))) for value in values):
            boxes += _halves(box, ends)
    return False


def _away_from_zero(value: Any, box: dict[str, tuple[Fraction, Fraction]]) -> bool:
    try:
        low, high = value(box)
    except verify.Refused:
        return False
    return bool(low > 0 or high < 0)


def _halves(box: Box, ends: list[Any]) -> list[Box]:
    widths = [(high - low) / (end[1] - end[0]) for (low, high), end in zip(box, ends, strict=True)]
    k = widths.index(max(widths))
    low, high = box[k]
    middle = (low + high) / 2
    return [(*box[:k], part, *box[k + 1 :]) for part in ((low, middle), (middle, high))]


def _falls(
    matrix: Any, rank: int, variables: tuple[sympy.Symbol, ...], bounds: list[tuple[float, float]]
) -> dict[str, float] | None:
    """A point at which the last of the ``rank`` singular values nearly vanishes, searched for from several starts."""
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
class Leftover:
    """Remaining friction for a perfect estimate and gain 1.

    Attributes:
        gains: K at the centre of the envelope, inputs by contacts: ū = K F̄.
        force: B K − U there, coordinates by contacts: the remaining force.
        pushing: contacts whose remainder may feed energy somewhere in the envelope: it is no non-positive multiple of
            the contact's direction d, so for some motion it acts along the slip. The best input leaves −(I − P) d, with
            P d the reachable part of d: a multiple of d only where P d is d or 0. So these are the contacts cancelled
            in part, and with damping also reachable ones whose remainder is not parallel to d.
    """

    gains: Array
    force: Array
    pushing: tuple[str, ...]


def leftover(found: Reach, plan: Plan) -> Leftover:
    """K and the remaining friction at the centre of the envelope, and the contacts that may feed energy in it."""
    system = found.system
    B, U, M = (found.numbers(m) for m in (found.input_matrix, system.distribution, system.mass_matrix))
    gains = _gains(found, plan, B[0], M[0], U[0])
    pushing = {found.contacts[j].name for j in plan.contacts if found.contacts[j].kind == "partial"}
    if plan.damping:
        for b, m, u in zip(B, M, U, strict=True):
            rest = b @ _gains(found, plan, b, m, u) - u
            pushing |= {v.name for j, v in enumerate(found.contacts) if not _brakes(rest[:, j], u[:, j])}
    return Leftover(gains, B[0] @ gains - U[0], tuple(v.name for v in found.contacts if v.name in pushing))


def _gains(found: Reach, plan: Plan, B: Array, M: Array, U: Array) -> Array:
    gains, chosen = np.zeros((B.shape[1], U.shape[1])), list(plan.contacts)
    if plan.damping:
        white = whitener(found.weight, M)
        regular = (white @ B).T @ (white @ B) + plan.damping * np.eye(B.shape[1])
        gains[:, chosen] = np.linalg.solve(regular, (white @ B).T @ white @ U[:, chosen])
    else:
        gains[:, chosen] = best_inputs(B, M, U[:, chosen], found.weight, plan.pivots)
    return gains


def _brakes(rest: Any, direction: Any) -> bool:
    size = float(direction @ direction)
    if size == 0:
        return True
    share = -float(rest @ direction) / size
    off = np.linalg.norm(rest + share * direction)
    return bool(share >= -NOTHING and off <= NOTHING * np.sqrt(size))

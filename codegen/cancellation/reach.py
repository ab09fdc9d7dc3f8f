"""Reachability of friction forces by the inputs: cancelled perfectly, in part, or not at all, by matrix ranks."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import sympy
from sympy.polys.matrices import DomainMatrix

from codegen.base.errors import BadInput
from codegen.cancellation.optimum import removed_share, weighted_rank_form
from codegen.mechanics import sampling
from codegen.mechanics.sampling import numbers_over, position_range
from codegen.mechanics.system import Matrix, NonlinearInput, System
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical

POINTS, FOR_RANKS = 64, 12
"""Number of random points of the envelope, and how many of them give the rank of a matrix without an exact form."""
LONGEST = 3000
"""Most operations in a matrix whose rank is computed exactly: elimination over rational functions is expensive."""


@dataclass(frozen=True)
class Ranks:
    """Generic ranks of matrices of one system: the ranks at almost every position.

    Attributes:
        values: of the parameters, exact.
        points: of the envelope, symbol → value, for matrices that have no exact form.
    """

    values: dict[sympy.Symbol, Any]
    points: list[dict[sympy.Symbol, Any]]

    def rank(self, matrix: Any) -> int:
        """The rank at almost every point of the envelope."""
        form = self._exact(matrix)
        return int(form.rank()) if form is not None else sampling.rank(Matrix(matrix), self.points)

    def is_exact(self, matrices: Iterable[Any]) -> bool:
        """Whether the ranks of these matrices are computed exactly, not at sampled points."""
        return all(self._exact(m) is not None for m in matrices)

    def _exact(self, matrix: Any) -> DomainMatrix | None:
        """The matrix over the field of rational functions; None if it has no such form, or is too large."""
        matrix = sympy.Matrix(matrix).subs(self.values)
        if 0 in matrix.shape:
            return DomainMatrix.from_Matrix(matrix).to_field()
        if sympy.count_ops(matrix) > LONGEST:
            return None
        algebraic = matrix.applyfunc(_algebraic)
        if algebraic.atoms(sympy.Function) or not all(e.is_rational_function() for e in algebraic):
            return None
        form = DomainMatrix.from_Matrix(algebraic).to_field()
        domain = form.domain
        # Coefficients must be rational numbers: floats and roots would not be exact.
        return form if domain.is_QQ or (domain.is_Composite and domain.domain in (sympy.QQ, sympy.ZZ)) else None


def _algebraic(entry: Any) -> Any:
    """An entry as a rational function of t = tan(q/2): sin q = 2t/(1 + t²), cos q = (1 − t²)/(1 + t²).

    So sin² + cos² = 1 is an identity, which would be missing with independent symbols for sine and cosine.
    """
    if not entry.has(sympy.sin, sympy.cos, sympy.tan):
        return entry
    expanded = sympy.expand_trig(entry.rewrite(sympy.tan, sympy.sin) if entry.has(sympy.tan) else entry)
    halves: dict[Any, Any] = {}
    for call in expanded.atoms(sympy.sin, sympy.cos):
        angle = call.args[0]
        if not angle.is_Symbol:
            continue
        t = sympy.Symbol(f"{angle.name}__tangent", real=True)
        halves[call] = 2 * t / (1 + t**2) if call.func is sympy.sin else (1 - t**2) / (1 + t**2)
    return expanded.subs(halves)


@dataclass(frozen=True)
class Verdict:
    """Whether the friction at one contact, or a friction force on one coordinate, can be cancelled.

    Attributes:
        kind: ``perfect`` (its direction is in the range of B), ``partial``, or ``none`` (B'W direction = 0).
        joined_rank: rank [B direction].
        undriven: coordinates on which the friction acts, but no input.
        share: smallest and largest share of r'W r that the best input removes, over points of the envelope.
    """

    name: str
    kind: Literal["perfect", "partial", "none"]
    joined_rank: int
    undriven: tuple[str, ...]
    share: tuple[float, float]


@dataclass(frozen=True)
class Reach:
    """Which friction the inputs of a system can cancel.

    Attributes:
        weight: W, as in ``weighted_rank_form``.
        input_matrix: B(x), n by inputs.
        rank: of B at almost every point of the envelope.
        exact: whether the ranks are exact, not from sampled points.
        constant: whether B, U and M depend on parameters only.
        together: dimension of the space of friction vectors F̄ with U F̄ in the range of B. It may exceed the number of
            contacts that can be cancelled one by one, if several unreachable forces have a reachable sum.
        contacts, coordinates: a verdict for the friction at each contact, and for a force on each coordinate.
        variables, ranges: positions on which B, U and M depend, and their ranges in the envelope.
    """

    system: System
    weight: str
    input_matrix: Matrix
    rank: int
    exact: bool
    constant: bool
    together: int
    contacts: tuple[Verdict, ...]
    coordinates: tuple[Verdict, ...]
    reduction: Reduction
    variables: tuple[sympy.Symbol, ...]
    ranges: tuple[tuple[float, float], ...]

    @property
    def cancellable(self) -> tuple[str, ...]:
        """Contacts whose friction can be cancelled perfectly, one by one."""
        return tuple(v.name for v in self.contacts if v.kind == "perfect")

    @property
    def points(self) -> Any:
        """Points of the envelope, the centre first; points by variables."""
        return _points(self.ranges)

    def numbers(self, matrix: Any) -> Any:
        """A matrix over parameters and ``variables`` at ``points``; points by n by m."""
        return numbers_over(matrix, self.system.values, self.variables, self.points)


def input_matrix_of(spec: Spec, system: System) -> Matrix:
    """The input matrix B of a system; BadInput if the force is not affine in the inputs, or B depends on a velocity."""
    B = system.input_matrix
    if isinstance(B, NonlinearInput):
        expected = "a force g = g0(x, v) + B(x) w (5.2); chapter 5 cancels friction by inputs that enter linearly"
        raise BadInput(spec.place("force"), B.reason, expected, code="SPEC027")
    moving = [v.name for v in system.velocities if v in B.free_symbols]
    if moving:
        found = f"the effect of an input on the force depends on the velocity {moving[0]}"
        raise BadInput(spec.place("force"), found, "B(x), of positions and parameters", code="SPEC027")
    return B


@numerical("what the inputs reach")
def reach(spec: Spec, system: System, weight: str) -> Reach:
    """Which friction forces the inputs of a system can cancel.

    A force with direction d can be cancelled perfectly if rank [B d] = rank B (d is in the range of B), the condition
    U₂F̄ = 0 of section 5.3.1 for one force. It cannot be reduced at all if B'W d = 0: the best input is then zero.
    Raises BadInput if the system has no input matrix B(x).
    """
    B, U, M = input_matrix_of(spec, system), system.distribution, system.mass_matrix
    variables = tuple(sorted((B.free_symbols | U.free_symbols | M.free_symbols) - set(system.values), key=str))
    units = {x: (x.name, unit) for x, unit in zip(system.positions, system.position_units, strict=True)}
    ranges = tuple(position_range(spec, *units[x]) for x in variables)
    # Without the centre, which is often a special position (q = 0) with a lower rank; without variables, the one point.
    generic = _points(ranges)[: 1 + FOR_RANKS][-FOR_RANKS:]
    points = [dict(system.values) | dict(zip(variables, at, strict=True)) for at in generic]
    ranks = Ranks(dict(system.values), points)
    rank = ranks.rank(B)
    joined = Matrix(sympy.Matrix.hstack(sympy.Matrix(B), sympy.Matrix(U)))  # [B U]
    full = rank == B.rows
    # The F̄ with U F̄ in the range of B are a space of dimension (columns of U) − (rank [B U] − rank B).
    unreachable = 0 if full else ranks.rank(joined) - rank
    result = Reach(
        system=system,
        weight=weight,
        input_matrix=B,
        rank=rank,
        exact=ranks.is_exact([B] if full else [joined, M]),
        constant=not variables,
        together=U.cols - unreachable,
        contacts=(),
        coordinates=(),
        reduction=reduce(system, B),
        variables=variables,
        ranges=ranges,
    )
    at_points = result.numbers(B), result.numbers(M)
    contacts, coordinates = [c.name for c in system.contacts], [x.name for x in system.positions]
    of_contacts = _verdicts(result, ranks, U, contacts, at_points)
    of_coordinates = _verdicts(result, ranks, Matrix(sympy.eye(B.rows)), coordinates, at_points)
    return replace(result, contacts=of_contacts, coordinates=of_coordinates)


def _verdicts(
    found: Reach, ranks: Ranks, directions: Any, names: list[str], at_points: tuple[Any, Any]
) -> tuple[Verdict, ...]:
    """The verdict on a force along each column of ``directions``; ``at_points``: B and M at the points."""
    B, M, n = found.input_matrix, found.system.mass_matrix, found.input_matrix.rows
    forces = found.numbers(directions)
    shares = np.array([removed_share(b, m, f, found.weight) for b, m, f in zip(*at_points, forces, strict=True)])
    positions = [x.name for x in found.system.positions]
    result = []
    for j, name in enumerate(names):
        direction = Matrix(directions[:, j])
        joined = found.rank
        if found.rank < n:
            joined = ranks.rank(sympy.Matrix.hstack(sympy.Matrix(B), sympy.Matrix(direction)))
        kind: Literal["perfect", "partial", "none"] = "perfect"
        if joined > found.rank:
            # B'W d = 0 if this block matrix, which contains no inverse, has its least possible rank.
            form, least = weighted_rank_form(found.weight, sympy.Matrix(M), sympy.Matrix(B), sympy.Matrix(direction))
            kind = "none" if B.cols == 0 or ranks.rank(form) == least else "partial"
        acts_on = {positions[i] for i in range(n) if direction[i] != 0}
        undriven = tuple(x for x in found.reduction.undriven if x in acts_on)
        share = np.clip(shares[:, j], 0, 1)
        result.append(Verdict(name, kind, joined, undriven, (float(share.min()), float(share.max()))))
    return tuple(result)


def _points(ranges: tuple[tuple[float, float], ...]) -> Any:
    """The centre of the ranges and random points in them, (points, variables); without variables (1, 0)."""
    bounds = np.array(ranges).reshape(-1, 2)
    spread = np.random.default_rng(1).uniform(bounds[:, 0], bounds[:, 1], (POINTS, len(bounds)))
    return np.vstack([bounds.mean(axis=1), spread]) if ranges else np.zeros((1, 0))


@dataclass(frozen=True)
class Reduction:
    """The reduced problem B̄ ū = Ū F̄ₙ (5.16), without the coordinates on which no input acts.

    Attributes:
        undriven: coordinates whose row of B is zero (i₁ … iₗ).
        lost: contacts that act on one of these (j₁ … jₛ): their friction cannot be cancelled perfectly.
        coordinates: the remaining ones, rows of B̄ and Ū.
        contacts: the remaining ones, columns of Ū.
        input_matrix, distribution: B̄ and Ū.
    """

    undriven: tuple[str, ...]
    lost: tuple[str, ...]
    coordinates: tuple[str, ...]
    contacts: tuple[str, ...]
    input_matrix: Matrix
    distribution: Matrix


def reduce(system: System, input_matrix: Matrix) -> Reduction:
    """Steps 1 to 3 of note 2: the contacts that act on coordinates without an input are removed.

    A remaining contact may still be unreachable, if B has dependent rows and no zero row; see ``reach``.
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

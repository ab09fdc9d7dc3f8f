"""Decomposition of Ψ: block-triangular form, and modal form where gains and masses allow it.

A block-triangular Ψ has the eigenvalues of its diagonal blocks, so each block has conditions of its own order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy

from codegen.analysis.conditions import Condition
from codegen.analysis.error_dynamics import ErrorDynamics
from codegen.analysis.polynomials import expand_products
from codegen.base.arrays import Array
from codegen.base.exact_numbers import eigenvalues, first_largest
from codegen.mechanics.sparse import each, scaled, sparse
from codegen.mechanics.system import Matrix

LAMBDA = sympy.Symbol("lambda", real=True)


@dataclass(frozen=True)
class Modes:
    """A Ψ in modal form, whose conditions are signs of gains and whose polynomial is a product over modes.

    With N = G O'M⁻¹O, G symmetric, all eigenvalues λ of N are real and as many are positive as of G, so that Ψ = −N is
    Hurwitz if and only if G > 0. With the velocity observer and M K_v symmetric, P = diag(M K_v, G⁻¹) gives PΨ + Ψ'P =
    −2 diag(K_v M K_v, 0); by the inertia theorem (Ostrowski–Schneider, Chen–Wimmer) Ψ is Hurwitz if and only if P > 0,
    that is K_v > 0 and G > 0: for any number of degrees of freedom and any M(x) that commutes with K_v.

    Attributes:
        product: N in words, as in K_F U' M^-1 U.
        conditions: on the gains, necessary and sufficient.
        uniform: whether K_v is k_v I (or velocity is measured), so that each λ gives one mode: s + λ, or
            s² + k_v s + k_v λ.
        frictionless: n less the number of contacts, with a velocity observer: each such motion adds a
            factor s + k_v.
        velocity_gain: the symbol of k_v, or None.
        smallest, largest: λ over the operating points.
        jury: conditions on the explicit Euler step, over every λ; () where λ is no single mode or A is not Ψ.
        sample_time: the largest of explicit Euler by the closed form, s, the smallest over the operating points; None
            where there is no closed form.
    """

    product: str
    conditions: tuple[Condition, ...]
    uniform: bool
    frictionless: int
    velocity_gain: sympy.Symbol | None
    smallest: float
    largest: float
    jury: tuple[Condition, ...]
    sample_time: float | None


def find_modes(dynamics: ErrorDynamics, continuous: Array, h: float) -> Modes | None:
    """The modal form of an observer's Ψ, if it has this form exactly; else None.

    Args:
        continuous: Ψ in force errors at the operating points, points by m by m.
        h: the sample time, s.
    """
    observer = dynamics.observer
    form = observer.cascade
    if form is None:
        return None
    (n, contacts), k_v = form.onto.shape, form.velocity_gain
    absent = {s: 0 for s, value in observer.gains.items() if value == 0}
    psi = dynamics.in_force(dynamics.jacobian).subs(absent)
    inverse = dynamics.inverse_mass_matrix
    turn = observer.signs if observer.level_errors else [sympy.S.One] * form.gain.rows
    into = scaled(turn, Matrix(form.gain), turn) * Matrix(form.weight) * Matrix(form.onto.T)
    by_force = inverse * Matrix(form.onto)
    if k_v is not None:
        k_v = Matrix(k_v)
        upper, lower = Matrix.hstack(-k_v, -by_force), Matrix.hstack(into * k_v, sparse(contacts, contacts, {}))
        expected = Matrix.vstack(upper, lower)
    else:
        expected = -into * by_force
    if any(e != 0 for e in each(psi - dynamics.tidied(expected), expand_products)):
        return None
    if not _symmetric(form.gain, observer.gains) or not (form.weight.is_Identity or form.gain.is_diagonal()):
        return None
    uniform = k_v is None or _uniform(k_v, observer.gains)
    diagonal = k_v is not None and k_v.is_diagonal() and observer.system.mass_matrix.is_diagonal()
    if not uniform and not diagonal:
        return None
    product = -continuous if k_v is None else continuous[:, n:, :n] @ -continuous[:, :n, n:]
    first = k_v[0, 0] if k_v is not None and uniform else None
    k = float(observer.gains[first]) if first is not None else 1.0
    sampled = np.linalg.eigvals(product).real
    if sampled.shape[1] < 2 or np.abs(sampled).min() <= 1e-12 * np.abs(sampled).max():
        return None  # a single mode, dependent contacts, or an h with zero slope at zero slip
    lowest, highest = first_largest(-sampled.min(axis=1)), first_largest(sampled.max(axis=1))
    ends = np.sort([eigenvalues(product[lowest]).real.min() / k, eigenvalues(product[highest]).real.max() / k])
    smallest, largest = (float(end) for end in ends)  # sorted: a negative k_v reverses them
    alone = uniform and dynamics.in_force(dynamics.sampled).subs(absent) == psi
    conditions = [] if k_v is None else _positive(k_v, "K_v", observer.gains)
    conditions += _positive(form.gain, form.label, observer.gains)
    frictionless = n - contacts if k_v is not None else 0
    # The limit is monotonic in λ: smallest at one end of its range.
    limits = [_sample_time(x, None if first is None else k) for x in (smallest, largest) if x > 0 and k > 0]
    settled = alone and len(limits) == 2
    return Modes(
        product=form.words,
        conditions=tuple(conditions),
        uniform=uniform,
        frictionless=frictionless,
        velocity_gain=first,
        smallest=smallest,
        largest=largest,
        jury=_jury(first, k, h, ends, frictionless) if alone else (),
        sample_time=min([*limits, 2 / k] if frictionless else limits) if settled else None,
    )


def _jury(gain: sympy.Symbol | None, k: float, h: float, ends: Array, frictionless: int) -> tuple[Condition, ...]:
    """Jury conditions of δ + λ, or of δ² + k_v δ + k_v λ and δ + k_v, with the least value over every λ.

    Each is monotonic in λ, so its least value is at one end of the range.
    """
    step = sympy.Symbol("h", real=True)
    if gain is None:
        return (
            Condition("J:1", LAMBDA, float(ends.min())),
            Condition("J:2", 2 - step * LAMBDA, float((2 - h * ends).min())),
        )
    conditions = [
        ("J:c0", gain * LAMBDA, k * ends),
        ("J:c1", gain * (1 - step * LAMBDA), k * (1 - h * ends)),
        ("p(z=-1)", 4 - 2 * step * gain + step**2 * gain * LAMBDA, 4 - 2 * h * k + h * h * k * ends),
    ]
    found = tuple(Condition(name, e, float(values.min())) for name, e, values in conditions)
    return (*found, Condition("J:k_v", 2 - step * gain, 2 - h * k)) if frictionless else found


def _sample_time(x: float, k_v: float | None) -> float:
    """The largest h of explicit Euler: 2/λ for s + λ; 1/λ, or 2/|s| of the faster real root, for s² + k_v s + k_v λ."""
    if k_v is None:
        return 2 / x
    discriminant = k_v * k_v - 4 * k_v * x
    return 1 / x if discriminant < 0 else 4 / (k_v + math.sqrt(discriminant))


def _symmetric(gain: Matrix, values: Any) -> bool:
    numbers = gain.subs(values)
    return bool(numbers == numbers.T)


def _uniform(gain: Matrix, values: Any) -> bool:
    numbers = gain.subs(values)
    return bool(numbers.is_diagonal() and len({numbers[i, i] for i in range(numbers.rows)}) == 1)


def _positive(gain: Matrix, label: str, values: Any) -> list[Condition]:
    """G > 0: each diagonal entry, or every leading minor where G is full."""
    if gain.is_diagonal():
        entries = [gain[i, i] for i in range(gain.rows)]
        return [Condition(str(e), e, float(e.subs(values))) for e in entries]
    minors = [gain[:k, :k].det(method="berkowitz") for k in range(1, gain.rows + 1)]
    return [Condition(f"{label}:{k}", e, float(e.subs(values))) for k, e in enumerate(minors, 1)]

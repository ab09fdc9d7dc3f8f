"""Modal decomposition of Ψ into first- or second-order modes, one for each eigenvalue of G O'M⁻¹O.

For certain structures of gains and masses; the stability conditions are then on the gains alone.
"""

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
    """Modal form of Ψ: it is Hurwitz if and only if gain matrices are positive definite.

    Let N = G O'M⁻¹O with G symmetric (``Cascade``).

    - Measured velocity, Ψ = −N: the eigenvalues λ of N are real and as many are positive as of G, so Ψ is Hurwitz if
      and only if G > 0.
    - Estimated velocity, M K_v symmetric: P = diag(M K_v, G⁻¹) satisfies PΨ + Ψ'P = −2 diag(K_v M K_v, 0). By the
      inertia theorem (Ostrowski–Schneider, Chen–Wimmer) Ψ is Hurwitz if and only if P > 0, that is K_v > 0 and G > 0:
      for any number of degrees of freedom and any M(x) that commutes with K_v.

    Attributes:
        product: N as text, such as K_F U' M^-1 U.
        conditions: necessary and sufficient conditions on the gains.
        uniform: whether K_v = k_v I or the velocity is measured. Each λ is then one mode, with the characteristic
            polynomial s² + k_v s + k_v λ or s + λ.
        frictionless: with an estimated velocity, n minus the number of contacts; each such direction of motion has a
            mode s + k_v.
        velocity_gain: the symbol of k_v, or None.
        smallest, largest: range of λ over the operating points.
        jury: Jury conditions of the explicit Euler step for every λ in the range; () if not ``uniform`` or A ≠ Ψ.
        sample_time: stability limit of explicit Euler over the operating points in closed form, s; None if there is no
            closed form.
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
    """The modal form of an observer's Ψ; None if Ψ is not exactly of this form.

    ``continuous``: Ψ in force errors at the operating points, points by m by m.
    """
    observer = dynamics.observer
    form = observer.cascade
    if form is None:
        return None
    (n, contacts), k_v = form.onto.shape, form.velocity_gain
    absent = {s: 0 for s, value in observer.gains.items() if value == 0}
    psi = dynamics.in_force(dynamics.jacobian).subs(absent)
    inverse = dynamics.inverse_mass_matrix
    signs = observer.signs if observer.level_errors else [sympy.S.One] * form.gain.rows
    force_by_velocity = scaled(signs, Matrix(form.gain), signs) * Matrix(form.weight) * Matrix(form.onto.T)  # G D O'
    acceleration_by_force = inverse * Matrix(form.onto)  # M⁻¹O
    if k_v is not None:
        k_v = Matrix(k_v)
        upper = Matrix.hstack(-k_v, -acceleration_by_force)
        lower = Matrix.hstack(force_by_velocity * k_v, sparse(contacts, contacts, {}))
        expected = Matrix.vstack(upper, lower)
    else:
        expected = -force_by_velocity * acceleration_by_force
    if any(e != 0 for e in each(psi - dynamics.normal_form(expected), expand_products)):
        return None
    gain_values = form.gain.subs(observer.gains)
    if gain_values != gain_values.T or not (form.weight.is_Identity or form.gain.is_diagonal()):
        return None
    numbers = sympy.eye(1) if k_v is None else k_v.subs(observer.gains)
    uniform = bool(numbers == numbers[0, 0] * sympy.eye(numbers.rows))
    diagonal = k_v is not None and k_v.is_diagonal() and observer.system.mass_matrix.is_diagonal()
    if not uniform and not diagonal:
        return None
    product = -continuous if k_v is None else continuous[:, n:, :n] @ -continuous[:, :n, n:]  # N, or N k_v
    gain = k_v[0, 0] if k_v is not None and uniform else None
    k = float(observer.gains[gain]) if gain is not None else 1.0
    by_point = np.linalg.eigvals(product).real
    if by_point.shape[1] < 2 or np.abs(by_point).min() <= 1e-12 * np.abs(by_point).max():
        return None  # a single mode, dependent contacts, or a correction h(u) of the tracker with h'(0) = 0
    lowest, highest = first_largest(-by_point.min(axis=1)), first_largest(by_point.max(axis=1))
    ends = np.sort([eigenvalues(product[lowest]).real.min() / k, eigenvalues(product[highest]).real.max() / k])
    smallest, largest = (float(end) for end in ends)  # sorted: a negative k_v reverses them
    # Whether the step is I + hΨ, mode by mode.
    euler_modes = uniform and dynamics.in_force(dynamics.sampled).subs(absent) == psi
    conditions = [] if k_v is None else _positive(k_v, "K_v", observer.gains)
    conditions += _positive(form.gain, form.label, observer.gains)
    frictionless = n - contacts if k_v is not None else 0
    # The largest stable h is monotonic in λ, so its minimum is at an end of the range.
    limits = [_sample_time(x, None if gain is None else k) for x in (smallest, largest) if x > 0 and k > 0]
    closed_form = euler_modes and len(limits) == 2
    return Modes(
        product=form.words,
        conditions=tuple(conditions),
        uniform=uniform,
        frictionless=frictionless,
        velocity_gain=gain,
        smallest=smallest,
        largest=largest,
        jury=_jury(gain, k, h, ends, frictionless) if euler_modes else (),
        sample_time=min([*limits, 2 / k] if frictionless else limits) if closed_form else None,
    )


def _jury(gain: sympy.Symbol | None, k: float, h: float, ends: Array, frictionless: int) -> tuple[Condition, ...]:
    """Jury conditions of δ + λ, or of δ² + k_v δ + k_v λ and δ + k_v, with δ = (z − 1)/h; values are minima over λ.

    Each is monotonic in λ, so its minimum is at an end of the range.
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
    of_modes = tuple(Condition(name, e, float(values.min())) for name, e, values in conditions)
    return (*of_modes, Condition("J:k_v", 2 - step * gain, 2 - h * k)) if frictionless else of_modes


def _sample_time(eigenvalue: float, k_v: float | None) -> float:
    """The stability limit of explicit Euler for one mode, s.

    2/λ for s + λ. For s² + k_v s + k_v λ: 1/λ if the roots are complex, else 2/|s| of the faster root.
    """
    if k_v is None:
        return 2 / eigenvalue
    discriminant = k_v * k_v - 4 * k_v * eigenvalue
    return 1 / eigenvalue if discriminant < 0 else 4 / (k_v + math.sqrt(discriminant))


def _positive(gain: Matrix, label: str, values: Any) -> list[Condition]:
    """Conditions of G > 0: its diagonal entries if it is diagonal, else its leading principal minors (Sylvester)."""
    if gain.is_diagonal():
        entries = [gain[i, i] for i in range(gain.rows)]
        return [Condition(str(e), e, float(e.subs(values))) for e in entries]
    minors = [gain[:k, :k].det(method="berkowitz") for k in range(1, gain.rows + 1)]
    return [Condition(f"{label}:{k}", e, float(e.subs(values))) for k, e in enumerate(minors, 1)]

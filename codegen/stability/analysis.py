"""Error dynamics → what a person reads: the characteristic polynomial, gain conditions, margins over the envelope."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np
import sympy

from codegen.errors import BadInput
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import Matrix
from codegen.observers.equations import Observer
from codegen.spec.model import Spec
from codegen.stability.conditions import Condition, positive_parameters, reduce_conditions
from codegen.stability.error_dynamics import ErrorDynamics, derive_error_dynamics
from codegen.stability.operating_points import OperatingPoints, evaluate, operating_points
from codegen.stability.polynomials import characteristic_polynomial, jury, routh_hurwitz

SYMBOLIC_ORDER = 4


@dataclass(frozen=True)
class Analysis:
    """The stability of one observer at the spec's gains.

    Attributes:
        dynamics: Ψ and the sampled matrix.
        polynomial: coefficients of |sI − Ψ| in force errors, highest first; None above the fourth order.
        routh, jury: conditions > 0, necessary and sufficient; () above the fourth order.
        points: where numbers were taken.
        spectral_abscissa: largest real part of Ψ's eigenvalues over the points, 1/s.
        spectral_radius: largest |z| of the sampled matrix over the points, at the spec's sample time.
        largest_sample_time: of explicit Euler at these gains, the smallest over the points, s; 0 if Ψ is not Hurwitz.
        worst: the point of the largest spectral radius.
    """

    dynamics: ErrorDynamics
    polynomial: tuple[Any, ...] | None
    routh: tuple[Condition, ...]
    jury: tuple[Condition, ...]
    points: OperatingPoints
    spectral_abscissa: float
    spectral_radius: float
    largest_sample_time: float
    worst: dict[str, float]

    @property
    def stable(self) -> bool:
        """Whether the sampled error is stable at every point looked at."""
        return self.spectral_radius < 1


def analyse(spec: Spec, observer: Observer) -> Analysis:
    """Derive the error dynamics and read them off over the envelope.

    Raises:
        BadInput: where they are not finite somewhere in the envelope.
    """
    dynamics = derive_error_dynamics(observer)
    points = operating_points(dynamics, spec)
    h = float(observer.sample_time)
    continuous = evaluate(dynamics, dynamics.in_force(dynamics.jacobian), points)
    sampled = evaluate(dynamics, dynamics.in_force(dynamics.sampled), points)
    finite = np.isfinite(continuous).all(axis=(1, 2)) & np.isfinite(sampled).all(axis=(1, 2))
    if not finite.all():
        at = ", ".join(f"{s} = {v:.4g}" for s, v in zip(points.variables, points.values[~finite][0], strict=True))
        found = f"the error dynamics are not finite at {at or 'every point'}"
        raise BadInput(spec.place("envelope"), found, "a force and gains whose slopes are finite in the whole envelope")
    eigenvalues = np.linalg.eigvals(continuous)
    radii = np.abs(1 + h * np.linalg.eigvals(sampled)).max(axis=1)
    worst = int(radii.argmax())
    polynomial, routh, conditions = _symbolic(dynamics, continuous, sampled, h)
    return Analysis(
        dynamics=dynamics,
        polynomial=polynomial,
        routh=routh,
        jury=conditions,
        points=points,
        spectral_abscissa=float(eigenvalues.real.max()),
        spectral_radius=float(radii[worst]),
        largest_sample_time=_largest_sample_time(eigenvalues),
        worst={s.name: float(points.values[worst, k]) for k, s in enumerate(points.variables)},
    )


def _largest_sample_time(eigenvalues: Any) -> float:
    """Explicit Euler is stable for h < −2 Re λ/|λ|² at each eigenvalue λ."""
    if (eigenvalues.real >= 0).any():
        return 0.0
    return float((-2 * eigenvalues.real / np.abs(eigenvalues) ** 2).min())


def _symbolic(
    dynamics: ErrorDynamics, continuous: Any, sampled: Any, h: float
) -> tuple[Any, tuple[Condition, ...], tuple[Condition, ...]]:
    """Polynomial and conditions: written out in the gains up to second order, in the coefficients c above it."""
    order = dynamics.jacobian.rows
    if order > SYMBOLIC_ORDER:
        return None, (), ()
    c = [sympy.Integer(1), *[sympy.Symbol(f"c{k}", real=True) for k in range(order - 1, -1, -1)]]
    period = sympy.Symbol("h", real=True)
    routh, step = routh_hurwitz(c), jury(c, period)
    of_jacobian = characteristic_polynomial(dynamics.in_force(dynamics.jacobian))
    of_sampled = characteristic_polynomial(dynamics.in_force(dynamics.sampled))
    positive = positive_parameters(dynamics.observer.system.values)
    written = reduce_conditions(_written(routh, c, of_jacobian), positive)
    known = positive | {period} | {e for _, e in written}
    later = reduce_conditions(_written(step, c, of_sampled), known)
    return tuple(of_jacobian), _valued(written, routh, c, continuous, h), _valued(later, step, c, sampled, h)


def _written(raw: Sequence[tuple[str, Any]], c: Sequence[Any], coefficients: Sequence[Any]) -> list[tuple[str, Any]]:
    """Coefficients put in where that can be read: all at low order, else only where a condition is one."""
    values = dict(zip(c[1:], coefficients[1:], strict=True))
    return [(name, e.subs(values) if len(c) <= 3 or e in values else e) for name, e in raw]


def _valued(
    written: Sequence[tuple[str, Any]], raw: Sequence[tuple[str, Any]], c: Sequence[Any], matrices: Any, h: float
) -> tuple[Condition, ...]:
    """Each condition with its smallest value over the points, from the coefficients of the numeric matrices."""
    symbols = casadi.SX.sym("c", len(c) - 1)
    names = {s: symbols[k] for k, s in enumerate(c[1:])} | {sympy.Symbol("h", real=True): casadi.SX(h)}
    column = Matrix([e for _, e in raw])
    function = casadi.Function("conditions", [symbols], [casadi.densify(to_casadi(column, names))])
    coefficients = np.array([np.poly(m)[1:] for m in matrices]).T
    values = np.asarray(function.map(coefficients.shape[1])(coefficients)).reshape(len(raw), -1).min(axis=1)
    smallest = dict(zip([name for name, _ in raw], values, strict=True))
    return tuple(Condition(name, e, float(smallest[name])) for name, e in written)

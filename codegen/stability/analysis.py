"""Error dynamics → what a person reads: the characteristic polynomial, gain conditions, margins over the envelope."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from codegen.errors import BadInput
from codegen.observers.equations import Observer
from codegen.observers.shape import refuse_infinite_slope
from codegen.spec.model import Spec
from codegen.stability.conditions import Condition
from codegen.stability.error_dynamics import ErrorDynamics, derive_error_dynamics
from codegen.stability.factors import Factor, factor_conditions
from codegen.stability.modes import Modes, find_modes
from codegen.stability.operating_points import OperatingPoints, evaluate, operating_points, rates_for_neighbours


@dataclass(frozen=True)
class Analysis:
    """The stability of one observer at the spec's gains.

    Attributes:
        dynamics: Ψ and the sampled matrix.
        factors: |sI − Ψ| in force errors as a product over the blocks that Ψ falls apart into.
        modes: where the conditions are signs of gains whatever the order, and the polynomial a product over modes.
        routh, jury: conditions > 0, necessary and sufficient; () where a block is above the fourth order.
        points: where numbers were taken.
        spectral_abscissa: largest real part of Ψ's eigenvalues over the points, 1/s.
        spectral_radius: largest |z| of the step over the points, at the spec's sample time.
        largest_sample_time: of explicit Euler at these gains, the smallest over the points, s; 0 if Ψ is not Hurwitz.
        worst: the point of the largest spectral radius.
        radii: largest |z| of the step at each point.
        implicit_rate: least −Re λ over the eigenvalues λ of A, where the step is implicit; 0 elsewhere, 1/s.
    """

    dynamics: ErrorDynamics
    factors: tuple[Factor, ...]
    modes: Modes | None
    points: OperatingPoints
    spectral_abscissa: float
    spectral_radius: float
    largest_sample_time: float
    worst: dict[str, float]
    radii: Any
    implicit_rate: float = 0.0

    @property
    def polynomial(self) -> tuple[Any, ...] | None:
        """Coefficients of |sI − Ψ|, highest first, where Ψ is one block of up to the fourth order."""
        return self.factors[0].polynomial if len(self.factors) == 1 else None

    @property
    def routh(self) -> tuple[Condition, ...]:
        """Routh–Hurwitz conditions of Ψ."""
        if self.modes is not None:
            return self.modes.conditions
        return _all(self.factors, [f.routh for f in self.factors])

    @property
    def jury(self) -> tuple[Condition, ...]:
        """Jury conditions of the explicit Euler step."""
        if self.modes is not None and self.modes.jury:
            return self.modes.jury
        return _all(self.factors, [f.jury for f in self.factors])

    @property
    def stable(self) -> bool:
        """Whether the sampled error is stable at every point looked at."""
        return self.spectral_radius < 1


def analyse(spec: Spec, observer: Observer, conditions: bool = True) -> Analysis:
    """Derive the error dynamics and read them off over the envelope.

    Args:
        conditions: whether to write the gain conditions too, which can be long.

    Raises:
        BadInput: where they are not finite somewhere in the envelope.
    """
    refuse_infinite_slope(spec)
    dynamics = rates_for_neighbours(derive_error_dynamics(observer), spec.envelope)
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
    of_step = np.linalg.eigvals(sampled)
    radii = np.abs(dynamics.multipliers(of_step, h)).max(axis=1)
    worst = int(radii.argmax())
    return Analysis(
        dynamics=dynamics,
        factors=factor_conditions(dynamics, continuous, sampled, h) if conditions else (),
        modes=find_modes(dynamics, continuous, h) if conditions else None,
        points=points,
        spectral_abscissa=float(eigenvalues.real.max()),
        spectral_radius=float(radii[worst]),
        largest_sample_time=_largest_sample_time(eigenvalues),
        worst={s.name: float(points.values[worst, k]) for k, s in enumerate(points.variables)},
        radii=radii,
        implicit_rate=float(-of_step.real.max()) if dynamics.implicit else 0.0,
    )


def _largest_sample_time(eigenvalues: Any) -> float:
    """Explicit Euler is stable for h < −2 Re λ/|λ|² at each eigenvalue λ."""
    if (eigenvalues.real >= 0).any():
        return 0.0
    return float((-2 * eigenvalues.real / np.abs(eigenvalues) ** 2).min())


def _all(factors: tuple[Factor, ...], conditions: list[tuple[Condition, ...]]) -> tuple[Condition, ...]:
    """The conditions of all blocks; none where a block has none, since the rest would not suffice."""
    return tuple(c for block in conditions for c in block) if all(f.polynomial for f in factors) else ()

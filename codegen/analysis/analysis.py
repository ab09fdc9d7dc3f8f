"""Stability analysis of an observer: characteristic polynomial, gain conditions, and figures over the envelope."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from codegen.analysis.conditions import Condition, Factor, factor_conditions
from codegen.analysis.error_dynamics import ErrorDynamics
from codegen.analysis.modes import Modes, find_modes
from codegen.analysis.operating_points import OperatingPoints, OverEnvelope, dynamics_over_envelope
from codegen.base.exact_numbers import eigenvalues, first_largest
from codegen.base.shown import Shown
from codegen.observers.equations import Observer
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical


@dataclass(frozen=True, eq=False)
class Deciding:
    """Matrices at the operating points that decide the figures of an analysis.

    Attributes:
        slowest, fastest: Ψ with the largest spectral abscissa, and with the smallest limit of the sample time.
        widest: A with the largest |z| of a step. implicit: A with the largest real part of an eigenvalue.
    """

    slowest: Any
    fastest: Any
    widest: Any
    implicit: Any


@dataclass(frozen=True, repr=False)
class Analysis(Shown):
    """The stability of one observer at the spec's gains.

    Attributes:
        spec: for messages.
        dynamics: Ψ and the sampled matrix.
        over: the matrices from which ``factors`` and ``modes`` are derived when first asked for, which can take long;
            None: no conditions are asked for.
        worst: the point of the largest spectral radius.
        radii: largest |z| of the step at each point, to ten digits.
        deciding: the matrices, m by m, from which the figures below are computed.
        free: names of gains that the spec leaves free: their numbers are examples.
    """

    spec: Spec
    dynamics: ErrorDynamics
    over: OverEnvelope | None
    points: OperatingPoints
    worst: dict[str, float]
    radii: Any
    deciding: Deciding
    free: tuple[str, ...] = ()

    @property
    def summary(self) -> Mapping[str, object]:
        observer = self.dynamics.observer
        return {
            "observer": f"{observer.kind} ({observer.velocity} velocity)",
            "errors": ", ".join(e.symbol.name for e in observer.errors),
            "stable": "yes" if self.stable else "no",
            "spectral abscissa": f"{self.spectral_abscissa:.4g} 1/s",
            "spectral radius of a step": self.spectral_radius,
            "largest sample time": f"{self.largest_sample_time:.4g} s",
        }

    @cached_property
    def spectral_abscissa(self) -> float:
        """Largest real part of Ψ's eigenvalues over the points, 1/s."""
        return float(eigenvalues(self.deciding.slowest).real.max())

    @cached_property
    def spectral_radius(self) -> float:
        """Largest |z| of the step over the points, at the spec's sample time."""
        h = float(self.dynamics.observer.sample_time)
        return float(np.abs(self.dynamics.multipliers(eigenvalues(self.deciding.widest), h)).max())

    @cached_property
    def largest_sample_time(self) -> float:
        """Of explicit Euler at these gains, the smallest over the points, s; 0 if Ψ is not Hurwitz."""
        return float(largest_euler_steps(eigenvalues(self.deciding.fastest)[None])[0])

    @cached_property
    def implicit_rate(self) -> float:
        """Least −Re λ over the eigenvalues λ of A, where the step is implicit; 0 elsewhere, 1/s."""
        return float(-eigenvalues(self.deciding.implicit).real.max()) if self.dynamics.implicit else 0.0

    @cached_property
    def factors(self) -> tuple[Factor, ...]:
        """|sI − Ψ| in force errors as a product over the diagonal blocks of a block-triangular Ψ, with conditions."""
        return () if self.over is None else _factors(self.spec, self.over)

    @cached_property
    def modes(self) -> Modes | None:
        """The modal form, where the conditions are signs of gains for any order; else None."""
        return None if self.over is None else _modes(self.spec, self.over)

    @property
    def polynomial(self) -> tuple[Any, ...] | None:
        """Coefficients of |sI − Ψ|, highest first, where Ψ is one block of up to the fourth order."""
        return self.factors[0].polynomial if len(self.factors) == 1 else None

    @property
    def routh(self) -> tuple[Condition, ...]:
        """Routh–Hurwitz conditions of Ψ > 0, necessary and sufficient; () where a block is above the fourth order."""
        if self.modes is not None:
            return self.modes.conditions
        return _all(self.factors, [f.routh for f in self.factors])

    @property
    def jury(self) -> tuple[Condition, ...]:
        """Jury conditions of the explicit Euler step, alike."""
        if self.modes is not None and self.modes.jury:
            return self.modes.jury
        return _all(self.factors, [f.jury for f in self.factors])

    @property
    def stable(self) -> bool:
        """Whether the sampled error is stable at every sampled point."""
        return self.spectral_radius < 1


def analyse(
    spec: Spec, observer: Observer, conditions: bool = True, differential: ErrorDynamics | None = None
) -> Analysis:
    """Derive the error dynamics, evaluate them over the envelope and judge them.

    Args:
        conditions: whether the symbolic gain conditions and the modal form may be asked for.
        differential: as of ``derive_error_dynamics``.

    Raises:
        BadInput: where the error dynamics are not finite somewhere in the envelope.
    """
    return judge(spec, dynamics_over_envelope(spec, observer, differential), conditions)


QUANTITY = "the error dynamics over the envelope"


@numerical(QUANTITY)
def judge(spec: Spec, at: OverEnvelope, conditions: bool = True) -> Analysis:
    """As ``analyse``, from dynamics that are already derived and evaluated; ``spec`` is for messages."""
    dynamics, points, continuous, sampled, index = at.dynamics, at.points, at.continuous, at.sampled, at.index
    h = float(dynamics.observer.sample_time)
    of_psi, of_step = np.linalg.eigvals(continuous), np.linalg.eigvals(sampled)
    largest = np.abs(dynamics.multipliers(of_step, h)).max(axis=1)
    radii = np.array([float(f"{r:.10g}") for r in largest])[index]
    worst = first_largest(largest[index])  # of unrounded values: equal radii may round differently
    return Analysis(
        spec=spec,
        dynamics=dynamics,
        over=at if conditions else None,
        points=points,
        worst={s.name: float(points.values[worst, k]) for k, s in enumerate(points.variables)},
        radii=radii,
        deciding=Deciding(
            slowest=continuous[first_largest(of_psi.real.max(axis=1))],
            fastest=continuous[first_largest(-largest_euler_steps(of_psi))],
            widest=sampled[index[worst]],
            implicit=sampled[first_largest(of_step.real.max(axis=1))],
        ),
    )


@numerical(QUANTITY)
def _factors(spec: Spec, at: OverEnvelope) -> tuple[Factor, ...]:
    h = float(at.dynamics.observer.sample_time)
    return factor_conditions(at.dynamics, at.continuous, at.sampled, h)


@numerical(QUANTITY)
def _modes(spec: Spec, at: OverEnvelope) -> Modes | None:
    return find_modes(at.dynamics, at.continuous, float(at.dynamics.observer.sample_time))


def largest_euler_steps(values: Any) -> Any:
    """At each point the largest stable h of explicit Euler, the least −2 Re λ/|λ|² over the eigenvalues."""
    stable = (values.real < 0).all(axis=1)
    squares = np.where(values == 0, 1.0, values.real**2 + values.imag**2)
    return np.where(stable, (-2 * values.real / squares).min(axis=1), 0.0)


def _all(factors: tuple[Factor, ...], conditions: list[tuple[Condition, ...]]) -> tuple[Condition, ...]:
    """The conditions of all blocks; none where a block has none, since the others would not be sufficient."""
    return tuple(c for block in conditions for c in block) if all(f.polynomial for f in factors) else ()

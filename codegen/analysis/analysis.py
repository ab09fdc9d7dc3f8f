"""Stability analysis of an observer: characteristic polynomial, gain conditions, eigenvalues over the envelope."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from codegen.analysis.conditions import BlockConditions, Condition, block_conditions
from codegen.analysis.error_dynamics import ErrorDynamics
from codegen.analysis.modes import Modes, find_modes
from codegen.analysis.operating_points import EvaluatedDynamics, OperatingPoints, dynamics_over_envelope
from codegen.base.exact_numbers import eigenvalues, first_largest
from codegen.base.result import Shown
from codegen.observers.equations import Observer
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical


@dataclass(frozen=True, repr=False)
class Analysis(Shown):
    """The stability of one observer at the spec's gains.

    Attributes:
        spec: for messages.
        dynamics: Ψ and the sampled matrix A, symbolic.
        evaluated: Ψ and A at the points, from which ``blocks`` and ``modes`` are derived on first use, which can take
            long; None if no conditions are needed.
        points: the operating points in the envelope.
        worst: variable → its value, in SI, at the point of the largest spectral radius.
        radii: (points,) largest |z| of the step at each point, to ten digits.
        deciding: name of a measure below → the Ψ or A, m by m, at the operating point where the measure is worst.
        free: names of gains that the spec leaves free; their numbers are examples.
    """

    spec: Spec
    dynamics: ErrorDynamics
    evaluated: EvaluatedDynamics | None
    points: OperatingPoints
    worst: dict[str, float]
    radii: Any
    deciding: Mapping[str, Any]
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
        """max Re λ over the eigenvalues λ of Ψ and the points, 1/s."""
        return float(eigenvalues(self.deciding["spectral_abscissa"]).real.max())

    @cached_property
    def spectral_radius(self) -> float:
        """max |z| over the eigenvalues z of the map e[k] → e[k+1] and the points, at the spec's sample time."""
        h = float(self.dynamics.observer.sample_time)
        return float(np.abs(self.dynamics.multipliers(eigenvalues(self.deciding["spectral_radius"]), h)).max())

    @cached_property
    def largest_sample_time(self) -> float:
        """Stability limit of explicit Euler, min −2 Re λ/|λ|² over the points, s; 0 if Ψ is not Hurwitz."""
        return float(largest_euler_steps(eigenvalues(self.deciding["largest_sample_time"])[None])[0])

    @cached_property
    def implicit_rate(self) -> float:
        """min −Re λ over the eigenvalues λ of A and the points, of an implicit step, 1/s; 0 for other steps."""
        return float(-eigenvalues(self.deciding["implicit_rate"]).real.max()) if self.dynamics.implicit else 0.0

    @cached_property
    def blocks(self) -> tuple[BlockConditions, ...]:
        """Polynomial and conditions of each diagonal block of Ψ in force errors, which is block-triangular."""
        return () if self.evaluated is None else _blocks(self.spec, self.evaluated)

    @cached_property
    def modes(self) -> Modes | None:
        """The modal form of Ψ, whose conditions are definiteness of gains for any order; None if Ψ has none."""
        return None if self.evaluated is None else _modes(self.spec, self.evaluated)

    @property
    def polynomial(self) -> tuple[Any, ...] | None:
        """Coefficients of |sI − Ψ|, highest first; None if Ψ has several blocks or an order above four."""
        return self.blocks[0].polynomial if len(self.blocks) == 1 else None

    @property
    def routh(self) -> tuple[Condition, ...]:
        """Routh–Hurwitz conditions of Ψ, necessary and sufficient; () if a block has an order above four."""
        if self.modes is not None:
            return self.modes.conditions
        return self._all([block.routh for block in self.blocks])

    @property
    def jury(self) -> tuple[Condition, ...]:
        """Jury conditions of the explicit step, necessary and sufficient; () if a block has an order above four."""
        if self.modes is not None and self.modes.jury:
            return self.modes.jury
        return self._all([block.jury for block in self.blocks])

    def _all(self, conditions: list[tuple[Condition, ...]]) -> tuple[Condition, ...]:
        """The conditions of all blocks; none if a block has none, since those of the others are not sufficient."""
        return tuple(c for block in conditions for c in block) if all(b.polynomial for b in self.blocks) else ()

    @property
    def stable(self) -> bool:
        """Whether the sampled error is stable at every sampled point."""
        return self.spectral_radius < 1


def analyse(
    spec: Spec, observer: Observer, conditions: bool = True, differential: ErrorDynamics | None = None
) -> Analysis:
    """The stability analysis of an observer over the envelope; BadInput if the error dynamics are not finite there.

    Args:
        conditions: whether the symbolic gain conditions and the modal form are available.
        differential: as of ``derive_error_dynamics``.
    """
    return judge(spec, dynamics_over_envelope(spec, observer, differential), conditions)


QUANTITY = "the error dynamics over the envelope"


@numerical(QUANTITY)
def judge(spec: Spec, at: EvaluatedDynamics, conditions: bool = True) -> Analysis:
    """The analysis of error dynamics that are already derived and evaluated; ``spec`` is for messages."""
    dynamics, points, continuous, sampled, index = at.dynamics, at.points, at.continuous, at.sampled, at.index
    h = float(dynamics.observer.sample_time)
    of_psi, of_step = np.linalg.eigvals(continuous), np.linalg.eigvals(sampled)
    largest = np.abs(dynamics.multipliers(of_step, h)).max(axis=1)
    radii = np.array([float(f"{r:.10g}") for r in largest])[index]
    worst = first_largest(largest[index])  # of unrounded values: equal radii may round differently
    return Analysis(
        spec=spec,
        dynamics=dynamics,
        evaluated=at if conditions else None,
        points=points,
        worst={s.name: float(points.values[worst, k]) for k, s in enumerate(points.variables)},
        radii=radii,
        deciding={
            "spectral_abscissa": continuous[first_largest(of_psi.real.max(axis=1))],
            "largest_sample_time": continuous[first_largest(-largest_euler_steps(of_psi))],
            "spectral_radius": sampled[index[worst]],
            "implicit_rate": sampled[first_largest(of_step.real.max(axis=1))],
        },
    )


@numerical(QUANTITY)
def _blocks(spec: Spec, at: EvaluatedDynamics) -> tuple[BlockConditions, ...]:
    return block_conditions(at.dynamics, at.continuous, at.sampled)


@numerical(QUANTITY)
def _modes(spec: Spec, at: EvaluatedDynamics) -> Modes | None:
    return find_modes(at.dynamics, at.continuous, float(at.dynamics.observer.sample_time))


def largest_euler_steps(values: Any) -> Any:
    """The stability limit of explicit Euler, h = min −2 Re λ/|λ|², from eigenvalues (points, m); (points,) in s.

    0 where an eigenvalue has no negative real part.
    """
    stable = (values.real < 0).all(axis=1)
    squares = np.where(values == 0, 1.0, values.real**2 + values.imag**2)
    return np.where(stable, (-2 * values.real / squares).min(axis=1), 0.0)

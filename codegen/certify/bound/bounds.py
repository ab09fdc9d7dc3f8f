"""Results of the error bounds: of each friction error, and of an observer with a domain also through reversals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class DomainBound:
    """Error bounds of an observer that updates its level in a domain only (slip speeds above ``slip_speed``).

    Attributes:
        inside: on the friction error while the code's output ``in_domain`` is set; None if ``slip_speed`` is too low.
        everywhere: on the level error at every sample, for any slip.
        velocity: on the error of the estimated slip velocity at every sample, in the slip's unit/s.
        least_slip_speed: lower limit of the domain's ``slip_speed``, above which there is a bound.
        innovation: on |x[k] − (x + h v̂)[k−1]| in the domain.
    """

    inside: float | None
    everywhere: float
    velocity: float
    least_slip_speed: float
    innovation: float


@dataclass(frozen=True)
class Reversal:
    """Bound on the error of a contact's level after a reversal, as proved of the C (checker/reversal.py).

    Attributes:
        samples: number of samples of the reversal; before the first, every error is within its long-run bound.
        turns: largest number of sign changes of the estimated slip in these samples.
        left: bound on the error after them, in its unit.
    """

    samples: int
    turns: int
    left: float


@dataclass(frozen=True)
class ErrorBound:
    """The bound on one friction error as a function of time since the last reversal.

    Attributes:
        name, unit: of the error component, such as e_a_rail in N.
        steady: limit of the bound long after a reversal.
        parts: disturbance → its part of ``steady``: noise, displacement, velocity, friction, acceleration, rounding.
        start: |error| that is assumed at time 0 after a reversal. True and estimated slip then have the new sign, a law
            with a state has reached its level, and all other errors are within their ``steady``.
        starts: the assumed |error| of every component at time 0, in the observer's order.
        after: (0, ``start``), then pairs (time in s, bound from then on), which fall to ``steady``. Before the first of
            these an error that oscillates may exceed ``start``, and the bound may be larger than that.
        worst: exact worst case of the first-order system over the samples that were summed; below ``steady``.
        slip_speed, slip_unit: least slip speed at which true and estimated slip have the same sign, and at which an
            observer with a domain updates its level.
        domain: bounds through reversals if the spec has a ``domain``, or the reason why there are none.
        percent: kind of model error (mass, input gain, sample time) → increase of ``steady`` by one percent of it.
        largest_model_error: kind of model error → the largest relative error, up to 1, for which ``domain`` has a
            bound.
        of_code: ``steady`` as proved of the C (checker/ellipsoid.py); None if it is not proved.
        after_of_code: ``after`` as proved of the C. If ``reversal`` or ``always`` is proved, it starts from the errors
            that this gives, else from the assumed ``starts``.
        reversal: bound after a reversal as proved of the C; None if it is not proved.
        largest: bound on |friction|, by the envelope's range of its level or by the law; None if not known.
        always: proved of the C, for trackers: bound in the long run for any friction within ``largest`` at each sample,
            including stick, reversals and chatter; ``after_of_code`` is from the last such sample on then. None if it
            is not proved.
        without_noise: positions whose noise was taken as zero, since the envelope has no range for it.
    """

    name: str
    unit: str
    steady: float
    parts: dict[str, float]
    start: float
    starts: tuple[float, ...]
    after: tuple[tuple[float, float], ...]
    worst: float
    slip_speed: float
    slip_unit: str
    domain: DomainBound | str | None = None
    percent: Mapping[str, float] = field(default_factory=dict)
    largest_model_error: Mapping[str, float] = field(default_factory=dict)
    largest: float | None = None
    of_code: float | None = None
    after_of_code: tuple[tuple[float, float], ...] = ()
    reversal: Reversal | None = None
    always: float | None = None
    without_noise: tuple[str, ...] = ()

    @property
    def stated(self) -> float:
        """The limit of the bound: ``of_code`` if it is proved, else ``steady``."""
        return self.steady if self.of_code is None else self.of_code

    @property
    def largest_part(self) -> str:
        """The cause of the largest of ``parts``."""
        return max(self.parts, key=self.parts.__getitem__)

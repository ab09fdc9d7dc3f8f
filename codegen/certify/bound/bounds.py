"""What is bounded of the friction errors, as results: for each contact, and in a domain through reversals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class DomainBound:
    """The bounds of a guarded observer.

    Attributes:
        inside: on the friction error where the code says ``in_domain``; None where ``slip_speed`` is too low.
        everywhere: on the level error at every sample, whatever the slip does.
        velocity: on the error of the slip velocity at every sample, in the slip's unit/s.
        least_slip_speed: that the domain must have.
        innovation: the largest |x − (x + h v̂) of the sample before| inside.
    """

    inside: float | None
    everywhere: float
    velocity: float
    least_slip_speed: float
    innovation: float


@dataclass(frozen=True)
class ErrorBound:
    """The bound for one friction error.

    Attributes:
        name, unit: of the error component, as e_a_rail in N.
        steady: long after a reversal.
        parts: cause → its share of ``steady``: noise, displacement, velocity, friction, acceleration, rounding.
        start: |error| that is assumed at time 0, when the slip has its new sign in truth and estimate, and a law with a
            state has come to its level; every other error is taken to be within its own ``steady``.
        starts: the same of every error, in the order of the observer's.
        after: (time in s, bound) from ``start`` on, falling to ``steady``.
        worst: the exact worst case of the first-order system over the samples summed, below ``steady``.
        slip_speed, slip_unit: the least slip speed at which truth and estimate have one sign, and a guard learns.
        domain: what holds through reversals, where the spec asks for a ``domain``; or why nothing does.
        percent: what the model is off by (mass, input gain, sample time) → what the first percent adds to ``steady``.
        stands: the same → the share by which it may be off before the domain is lost; up to 1.
        of_code: the same as ``steady``, proved of the C itself (checker/ellipsoid.py); None where it is not.
        after_of_code: the same as ``after``, proved so.
        largest: what friction is at most, by the envelope's range of its level or the law; None if not known.
        always: in the long run whatever friction within ``largest`` does at each sample, stick, turns and chatter among
            it, proved of the code; None where it is not. after_always: (time, bound) since such a sample, as ``after``.
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
    stands: Mapping[str, float] = field(default_factory=dict)
    largest: float | None = None
    of_code: float | None = None
    after_of_code: tuple[tuple[float, float], ...] = ()
    always: float | None = None
    after_always: tuple[tuple[float, float], ...] = ()

    @property
    def stated(self) -> float:
        """``steady``, or the one that is proved of the C, where there is one."""
        return self.steady if self.of_code is None else self.of_code

    @property
    def largest_part(self) -> str:
        """The cause of the largest of ``parts``."""
        return max(self.parts, key=self.parts.__getitem__)

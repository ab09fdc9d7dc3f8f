"""Results of the error bounds: of each friction error, and of an observer with a domain also through reversals."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import ROUND_CEILING
from fractions import Fraction

from codegen.base.result import Shown
from codegen.base.significant import rounded_to


@dataclass(frozen=True)
class DomainBound:
    """Error bounds of an observer that updates its level in a domain only (slip speeds above ``slip_speed``).

    Attributes:
        inside: bound on the friction error while the code's output ``in_domain`` is set; None if ``slip_speed`` is at
            most ``least_slip_speed``.
        everywhere: bound on the level error at every sample, for any slip.
        velocity: bound on the error of the estimated slip velocity, in the slip's unit/s; at every sample, but for the
            first ``restart`` after the start and after invalid samples.
        start: largest error of the estimated slip velocity there from which it is within ``velocity`` afterwards.
        restart: number of these samples, in which the level is held.
        least_slip_speed: the ``slip_speed`` of a domain above which ``inside`` exists.
        innovation: bound on |x[k] − (x + h v̂)[k−1]| in the domain.
    """

    inside: float | None
    everywhere: float
    velocity: float
    start: float
    restart: int
    least_slip_speed: float
    innovation: float


@dataclass(frozen=True)
class Reversal:
    """Bound on the error of a contact's level after a reversal, as proved of the C (checker/reversal.py).

    Attributes:
        samples: number of samples that the reversal takes; at its start every error is within its long-run bound.
        turns: largest number of sign changes of the estimated slip in these samples.
        left: bound on the error at its end, in the unit of the error.
    """

    samples: int
    turns: int
    left: float


@dataclass(frozen=True)
class SlipSpeed:
    """The slip speed of a contact above which the bounds on friction errors hold, in the contact's own unit.

    They need of every contact that its slip u and the estimate û have the same sign. If |u − û| ≤ E, then |u| > E or
    |û| > E gives sgn û = sgn u. E is a bound in the long run, and holds while no slip has reversed. A law with a state
    must slide besides: |u| has to be above ``sliding`` then.

    Attributes:
        contact, unit: name of the contact, and unit of the speeds: that of its slip per second.
        error: E.
        more: added to E: the ``slip_speed`` of a domain, below which the observer does not update its level, or 0.
        sliding: the speed from which on a law with a state slides; 0 for other laws.
        above: the bounds hold while the slip stays above this speed, and their times count from the first sample above
            it: only the law's slope above it is counted; 0 if the slope over all speeds is.
        fastest: the largest |u| in the envelope; infinite without a range of a velocity that counts.
    """

    contact: str
    unit: str
    error: float
    more: float
    sliding: float
    above: Fraction = Fraction(0)
    fastest: float = math.inf

    @property
    def reached(self) -> bool:
        """Whether some slip in the envelope is above the threshold; else a bound that needs it holds nowhere there."""
        return self.fastest > self.threshold

    @property
    def threshold(self) -> float:
        """The speed: E + ``more``, or ``sliding`` or ``above`` if one is larger."""
        return max(self.error + self.more, self.sliding, float(self.above))

    @property
    def seen(self) -> float:
        """The speed of the estimate above which ``watch`` compares it: the slip is then faster than ``above`` too."""
        return max(self.threshold, float(self.above) + self.error if self.above else 0.0)


@dataclass(frozen=True, repr=False)
class ErrorBound(Shown):
    """The bound on one friction error as a function of time since the last reversal.

    Attributes:
        name, unit: of the error component, such as e_a_rail in N.
        steady: limit of the bound long after a reversal.
        parts: disturbance → its part of ``steady``: noise, displacement, velocity, friction, acceleration, rounding.
        start: bound on |error| that is assumed at time 0, the end of a reversal: when true and estimated slip have the
            new sign, a law with a state has reached its level, and all other errors are within their ``steady``.
        starts: the assumed |error| of every component at time 0, in the observer's order.
        after: pairs (time in s since the start, bound from then on), which decrease to ``steady``. The bound at the
            first of these times may be above ``start``, since the error may oscillate. If ``reversal`` or ``always`` is
            proved, the start is within the errors that this gives, else within ``starts``.
        worst: largest error of the first-order system that disturbances within their bounds attain in the samples that
            were summed; below ``steady``, which also bounds the remainder of the sum.
        slip_speeds: of every contact, in the order of the system, the speed that its slip must exceed.
        domain: bounds through reversals if the spec has a ``domain``, or the reason why there are none.
        percent: kind of model error (mass, input gain, sample time) → increase of ``steady`` by one percent of it.
        largest_model_error: kind of model error → the largest relative error, up to 1, for which ``domain`` has a
            bound.
        proved: whether ``steady``, ``after`` and the slip speeds are proved of the C (checker/ellipsoid.py).
        reversal: bound after a reversal as proved of the C; None if it is not proved.
        largest: bound on |friction|, by the envelope's range of its level or by the law; None if not known.
        level: declared |friction| where sliding begins.
        always: for trackers, proved of the C: long-run bound at every sample, for any friction within ``largest``,
            through stick, reversals and chatter; ``after`` then starts when every contact slides in one direction.
            None if it is not proved.
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
    slip_speeds: tuple[SlipSpeed, ...]
    domain: DomainBound | str | None = None
    percent: Mapping[str, float] = field(default_factory=dict)
    largest_model_error: Mapping[str, float] = field(default_factory=dict)
    largest: float | None = None
    level: float = 0.0
    proved: bool = False
    reversal: Reversal | None = None
    always: float | None = None
    without_noise: tuple[str, ...] = ()

    @property
    def summary(self) -> Mapping[str, object]:
        limit = rounded_to(self.steady, 4, ROUND_CEILING)
        return {"error": self.name, "long after a reversal at most": f"{limit} {self.unit}"}

    @property
    def friction(self) -> float:
        """The |friction| with which the bound is compared: ``largest``, or the declared level where it is not known."""
        return self.level if self.largest is None else self.largest

    @property
    def useless(self) -> bool:
        """Whether the friction itself is not larger than the bound: an estimate of zero would be as good."""
        return 0 < self.friction <= self.steady

    @property
    def largest_part(self) -> str:
        """The cause of the largest of ``parts``."""
        return max(self.parts, key=self.parts.__getitem__)

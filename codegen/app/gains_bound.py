"""The certified bound on the friction error at suggested gains, and at the same gains divided by powers of two.

With fast gains, the motion within a sample makes the bound larger than the friction itself. ``stiction gains`` then
suggests slower gains.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from codegen.analysis.analysis import analyse
from codegen.analysis.feasibility.axes import GainAxis
from codegen.analysis.feasibility.gains import Feasibility
from codegen.analysis.feasibility.suggest import USEFUL, Suggestion
from codegen.app.derived import Derived
from codegen.base.result import named
from codegen.certify.bound.bounds import ErrorBound
from codegen.certify.bound.error_bound import error_bounds
from codegen.certify.bound.error_response import error_response
from codegen.certify.certify import certify
from codegen.certify.outcome import Certificate
from codegen.spec.free_gains import with_gains

DIVISORS = (1, 2, 4, 8, 16, 32)
OWN = 0
"""In the place of a divisor: the spec's own gains."""


@dataclass(frozen=True)
class GainBound:
    """The certified bound at one set of gains.

    Attributes:
        divisor: by which the gains that the rule chose are divided; or ``OWN``.
        gains: axis → value.
        decay_rate: certified, 1/s.
        bound: on the friction error long after a reversal, of the contact for which it is the largest share.
    """

    divisor: int
    gains: Mapping[str, float]
    decay_rate: float
    bound: ErrorBound

    @property
    def share(self) -> float:
        """The bound over the friction."""
        return self.bound.steady / self.bound.friction if self.bound.friction else 0.0

    @property
    def content(self) -> dict[str, Any]:
        """The JSON object."""
        return {
            **named(self, "gains_divided_by=divisor numbers=gains certified_rate=decay_rate"),
            "bound": {**named(self.bound, "of=name unit steady"), "share": self.share},
        }


def bounds_at(machine: Derived, axes: Sequence[GainAxis], suggestion: Suggestion) -> tuple[GainBound, ...]:
    """The bound at the gains that the rule chose; if it is not useful, also the first useful one, or the least; or ().

    Slower gains whose bound is still not below the friction are not among them: they cost speed for nothing.
    Bounds are known if the error dynamics are the same at every operating point and the envelope has the ranges.
    """
    if isinstance(error_response(machine.nominal.observer), str):
        return ()
    found: list[GainBound] = []
    for divisor in DIVISORS:
        one = bound_at(machine, axes, suggestion.over(divisor), divisor)
        if one is None:
            break
        found.append(one)
        if one.share <= USEFUL:
            break
    if not found:
        return ()
    best = min(found, key=lambda one: (one.share > USEFUL, one.share if one.share > USEFUL else one.divisor))
    return (found[0],) if best is found[0] or best.share >= 1 else (found[0], best)


def why_no_bound(report: Feasibility, bounds: Sequence[GainBound]) -> str:
    """Why no bound in newtons is known for an observer at any gains and envelope; empty if one is known."""
    found = "" if bounds else error_response(report.observer)
    return found if isinstance(found, str) else ""


def bound_at(
    machine: Derived, axes: Sequence[GainAxis], numbers: Mapping[str, float], divisor: int
) -> GainBound | None:
    """The bound at these numbers of the axes; None outside the range of a free gain, or if no bound is certified."""
    if any(axis.chosen is None and not axis.low <= numbers[axis.name] <= axis.high for axis in axes):
        return None
    entries = {at: weight * numbers[axis.name] for axis in axes for at, weight in axis.entries.items()}
    there = machine.with_spec(with_gains(machine.spec, entries))
    analysis = analyse(there.spec, there.observer, False)
    certificate = certify(there.spec, analysis, {}, "", further=False)
    if not isinstance(certificate, Certificate):
        return None
    bounds = error_bounds(there.spec, analysis, certificate)
    if isinstance(bounds, str):
        return None
    largest = max(bounds, key=lambda b: b.steady / b.friction if b.friction else 0.0)
    return GainBound(divisor, numbers, certificate.decay_rate, largest)

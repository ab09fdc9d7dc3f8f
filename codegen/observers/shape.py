"""The monotone function h of the slip speed in a (G)CFO's level estimate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from codegen.base.errors import BadInput
from codegen.base.exact_numbers import geometric
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import System
from codegen.spec.functions import Magnitude
from codegen.spec.model import Spec, symbol

LARGEST_EXPONENT = 8
SPEED = symbol("s")
SAMPLES = 400


@dataclass(frozen=True)
class Shape:
    """h(s) and its slope; s^μ in the thesis (2.6), any h with h' > 0 for s > 0 in the error dynamics.

    Attributes:
        expression: over the slip speed symbol ``s``.
    """

    expression: Any

    def value(self, slip: Any) -> Any:
        """h(|u|)."""
        return self.expression.subs(SPEED, Magnitude(slip))

    def slope(self, slip: Any) -> Any:
        """h'(|u|)."""
        return self.expression.diff(SPEED).subs(SPEED, Magnitude(slip))

    @property
    def exponent(self) -> Any:
        """μ where h is s^μ, else None."""
        base, power = self.expression.as_base_exp()
        return power if base == SPEED and power.is_number else None


def read_shape(spec: Spec, system: System) -> Shape:
    """The spec's ``h``, or s^μ of its ``exponent``.

    Raises:
        BadInput: for an exponent that is not positive or above 8, or an h that does not rise with the slip speed in the
            envelope (or up to 10 where that has no range), with the speed at which it fails.
    """
    choice = spec.observer
    assert choice is not None
    if choice.shape is None:
        if not 0 < choice.exponent <= LARGEST_EXPONENT:
            wanted = f"a positive number up to {LARGEST_EXPONENT}"
            raise BadInput(spec.place("observer.exponent"), f"exponent {choice.exponent}", wanted, code="SPEC007")
        return Shape(SPEED**choice.exponent)
    shape = Shape(choice.shape)
    place = spec.place("observer.h")
    if not choice.shape.has(SPEED):
        raise BadInput(place, f"h = {choice.shape}", "an expression that rises with the slip speed s", code="SPEC022")
    top = _top_speed(spec, system)
    speeds = np.concatenate([geometric(1e-6, 1, SAMPLES), np.linspace(0, 1, SAMPLES)[1:]]) * top
    slopes = [float(to_casadi(shape.expression.diff(SPEED), {SPEED: s})) for s in speeds]
    for s, slope in zip(speeds, slopes, strict=True):
        if not slope > 0:
            found = f"h = {choice.shape}, whose slope at s = {s:.3g} is {slope:.3g}"
            raise BadInput(
                place, found, f"a function that rises up to the envelope's top slip speed {top:.3g}", code="SPEC022"
            )
    return shape


def refuse_infinite_slope(spec: Spec) -> None:
    """Raise BadInput where the envelope contains rest and h has an infinite slope there, so that Ψ is unbounded."""
    choice = spec.observer
    if choice is None or not choice.kind.endswith("cfo"):
        return
    if not all(low <= 0 <= high for low, high in (spec.envelope.get(v, (-1, 1)) for v in spec.velocities)):
        return
    shape = Shape(SPEED**choice.exponent if choice.shape is None else choice.shape)
    if not np.isfinite(float(to_casadi(shape.expression.diff(SPEED), {SPEED: 0.0}))):
        key = "exponent" if choice.shape is None else "h"
        found = f"h(s) = {shape.expression}, whose slope is infinite at rest"
        raise BadInput(
            spec.place(f"observer.{key}"),
            found,
            "a finite slope (exponent 1 or more), or velocities that are never 0",
            code="SPEC033",
        )


def _top_speed(spec: Spec, system: System) -> float:
    ends = [spec.envelope.get(v.name, (-10, 10)) for v in system.velocities]
    return max(1e-3, *[max(abs(float(lo)), abs(float(hi))) for lo, hi in ends]) * max(1, len(ends))

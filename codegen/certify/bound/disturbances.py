"""Bounds δ on the disturbances of the error dynamics (``error_response``), from the envelope and a model error."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import sympy

from codegen.certify.bound.error_response import Response
from codegen.certify.bound.friction_bounds import fastest_slip, largest_in_envelope, sliding
from codegen.certify.certificate_text import fraction, rational_above
from codegen.friction.law import DynamicLaw
from codegen.mechanics.system import System
from codegen.observers.equations import ErrorVariable, Observer
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import Spec

Sizes = dict[str, list[Fraction]]
"""Disturbance → bounds on its magnitude in a sample, for each coordinate or each friction error."""


@dataclass(frozen=True)
class ModelError:
    """Relative error of the model: the machine's quantity is (1 + p) times the model's, p of either sign.

    Attributes:
        mass: p of M(x) as a whole; gain: of the inputs' effect on the machine; time: of every sample's length.
    """

    mass: Fraction = Fraction(0)
    gain: Fraction = Fraction(0)
    time: Fraction = Fraction(0)


EXACT = ModelError()
"""No model error."""


def disturbances(
    spec: Spec, observer: Observer, response: Response, off: ModelError = EXACT, above: Sequence[Fraction] = ()
) -> Sizes | str:
    """Bounds on each disturbance of one sample of length h; or, in words, the range that is missing for one.

    d_x (``displacement``), d_v (``velocity``) and ΔF (``friction``) are defined in ``error_response``:

        |d_x| ≤ h² a/2,    |d_v| ≤ h² j/2 + h ε,    |ΔF| ≤ h |dF/du| |u'|

    with v and a the largest speed and acceleration in the envelope, v̂' the acceleration of the model, u a slip, and j a
    bound on the jerk, |∂v̂'/∂x| v + |∂v̂'/∂v| a + |∂v̂'/∂F| |F'|. ``noise`` is that of the positions, ``acceleration`` is
    a + ε. ε bounds the error of v̂'; it is the sum over

    - noise in the non-affine forces: their slope times the noise;
    - M = (1 + p) M̂: p v', at the same forces;
    - inputs that act by (1 + p) B: p M⁻¹ B w;
    - samples of (1 + p) h: by the clock of the code the machine moves at (1 + p) v with acceleration (1 + p)² v', which
      is (2p + p²) v' more, and its forces are those of v: p |∂v̂'/∂v| v.

    Inputs are assumed constant during a sample; a change within a sample is not included.

    Args:
        above: of each contact, the speed below which |u| never is, 0 for any speed; by default any.
    """
    system, h = observer.system, fraction(observer.sample_time)
    if reason := unbounded_effect(system):
        return reason
    # Bounds on |∂v̂'/∂x| and |∂v̂'/∂w| by the non-affine forces.
    slopes = [largest_slopes(spec, observer, part, off) for part in response.nonaffine]
    if missing := next((x for x in slopes if isinstance(x, str)), ""):
        return missing
    n = len(system.positions)
    rows = sympy.Matrix(len(slopes), n + len(system.inputs), [e for row in slopes for e in row])
    nonaffine = response.by_nonaffine.applyfunc(abs) * rows
    by_position, by_input = nonaffine[:, :n], response.by_input.applyfunc(abs) + nonaffine[:, n:]
    if missing := _missing_range(spec, system, off, [*response.by_position, *by_position], response.by_velocity):
        return missing

    def largest(names: Iterable[str]) -> list[Fraction]:
        """The largest magnitudes in the envelope, 0 for a variable without a range."""
        return [fraction(largest_in_envelope(spec, name, sympy.S.Zero)) for name in names]

    scale = 1 + off.time
    acceleration = largest(f"{v}_dot" for v in system.velocities)
    speeds, inputs = largest(v.name for v in system.velocities), largest(w.name for w in system.inputs)
    noise = largest(f"{x}_noise" for x in system.positions)
    by_clock, speeds_by_clock = [scale * scale * a for a in acceleration], [scale * s for s in speeds]
    contact_rates = _contact_rates(spec, observer, [scale * a for a in acceleration], above)
    if isinstance(contact_rates, str):
        return contact_rates
    coordinate_rates = [dot(observer.distribution.row(i), contact_rates) for i in range(n)]
    jerk = [
        dot(response.by_position.row(i), speeds_by_clock)
        + dot(by_position.row(i), speeds_by_clock)
        + dot(response.by_velocity.row(i), by_clock)
        + dot(response.by_force.row(i), coordinate_rates)
        for i in range(n)
    ]
    model = [
        (off.mass + scale * scale - 1) * a
        + dot(by_position.row(i), noise)
        + off.time * dot(response.by_velocity.row(i), speeds)
        + off.gain * dot(by_input.row(i), inputs)
        for i, a in enumerate(acceleration)
    ]
    return {
        "noise": noise,
        "displacement": [h * h * a / 2 for a in by_clock],
        "velocity": [h * h * j / 2 + h * e for j, e in zip(jerk, model, strict=True)],
        "acceleration": [a + e for a, e in zip(by_clock, model, strict=True)],
        "friction": [h * of_friction(observer, e, contact_rates) for e in observer.errors[n:]],
        "rounding": [Fraction(0)] * len(observer.errors),
    }


def _missing_range(
    spec: Spec, system: System, off: ModelError, by_position: Iterable[Any], by_velocity: Iterable[Any]
) -> str:
    """The range that the envelope lacks for a bound, in words; empty if none. The slopes are of the acceleration."""
    unbounded = any(v.name not in spec.envelope for v in system.velocities)
    if unbounded and any(by_position):
        return "the force depends on position, and then the bound needs a range of every velocity in the envelope"
    if off.gain and any(w.name not in spec.envelope for w in system.inputs):
        return "the envelope has no range for every input"
    if unbounded and off.time and any(by_velocity):
        return "the force depends on velocity, and then the bound needs a range of every velocity in the envelope"
    return ""


def _contact_rates(
    spec: Spec, observer: Observer, acceleration: Sequence[Fraction], above: Sequence[Fraction]
) -> list[Fraction] | str:
    """Bounds |dF/du| |u'| on the rate of each contact's friction; or, in words, the law whose slope has no bound."""
    rates = []
    for c, contact in enumerate(observer.system.contacts):
        least = above[c] if above else Fraction(0)
        slides = sliding(observer, contact, (least, fraction(fastest_slip(spec, observer, c))) if least else None)
        if slides is None:
            return f"the law {contact.law.name} at {contact.name} can be arbitrarily steep over speed"
        rates.append(slides.slope * dot(observer.distribution.col(c), acceleration))
    return rates


def of_friction(observer: Observer, error: ErrorVariable, by_contact: Sequence[Fraction]) -> Fraction:
    """A bound for the friction of one error: that of its contact c, or Σ_c |U_ic| bound_c on its coordinate i."""
    if error.contact is not None:
        return by_contact[error.contact]
    return dot(observer.distribution.row(error.coordinate), by_contact)


def largest_slopes(spec: Spec, observer: Observer, part: Any, off: ModelError) -> list[Any] | str:
    """Upper bounds on |∂f/∂x| and |∂f/∂w| over the envelope, f = ``part``, by the triangle inequality; or why not.

    Positions include their measurement noise, and inputs the gain error of ``off``.
    """
    system, unknown = observer.system, []
    if part.has(Sgn):
        return f"the force jumps where {next(iter(part.atoms(Sgn))).args[0]} changes its sign"

    def end(name: str) -> Any:
        return largest_in_envelope(spec, name, sympy.S.Zero)

    ranges = {x: end(x.name) + end(f"{x}_noise") for x in system.positions if x.name in spec.envelope}
    ranges |= {w: end(w.name) * (1 + sympy.Rational(off.gain)) for w in system.inputs if w.name in spec.envelope}

    def largest(e: Any) -> Any:
        """A bound on |e|; 0, and an entry in ``unknown``, if none is known."""
        if e.is_number:
            return sympy.Rational(rational_above(abs(e)))
        if e in observer.signs or e.func in (sympy.sin, sympy.cos, Sgn):
            return sympy.Integer(1)
        if e in ranges:
            return ranges[e]
        if e.func is Magnitude:
            return largest(e.args[0])
        if e.is_Add or e.is_Mul:
            return e.func(*map(largest, e.args))
        if e.is_Pow and e.exp.is_Integer and e.exp > 0:
            return largest(e.base) ** e.exp
        unknown.append(f"the envelope has no range for {e}" if e.is_Symbol else f"no bound of {e} is known")
        return sympy.Integer(0)

    bounds = [largest(part.diff(x)) for x in (*system.positions, *system.inputs)]
    return f"the force is not linear in position and input, and {unknown[0]}" if unknown else bounds


def unbounded_effect(system: System) -> str:
    """Description of a part of the system whose effect on the error has no bound; empty if there is none."""
    for transmission in system.transmissions:
        return f"{system.positions[transmission.coordinate]} moves a load behind a spring"
    for contact in system.contacts:
        law = contact.law
        if isinstance(law, DynamicLaw) and law.in_sliding(contact.law_parameters) is None:
            return f"the law {law.name} at {contact.name} has a state, so that friction depends on more than the slip"
    for x in system.sensor_errors:
        return f"the sensor of {x} reads wrong, and the effect of this on the error is not bounded"
    return ""


def with_rounding(sizes: Sizes, response: Response, positions: Fraction, states: list[Fraction]) -> Sizes:
    """The bounds with rounding errors of each position and of each state in a step added."""
    if not states:
        return sizes
    errors = [dot(response.estimate_by_state.row(i), states) for i in range(len(states))]
    return sizes | {"noise": [s + positions for s in sizes["noise"]], "rounding": errors}


def dot(row: Any, sizes: Sequence[Fraction]) -> Fraction:
    """Σ_j |row_j| sizes_j, the largest value of row · w for |w_j| ≤ sizes_j."""
    return sum((abs(fraction(e)) * s for e, s in zip(row, sizes, strict=True)), Fraction(0))

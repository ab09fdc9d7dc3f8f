"""Response of the error to disturbances: position noise, acceleration within a sample, and changes of friction.

With ẽ the error that the estimates would have without noise in this sample, by explicit steps and exact numbers,

    ẽ[k+1] = Φ ẽ[k] + N n[k] + X d_x[k] + V d_v[k] + A a[k] + ΔF[k],    e[k] = ẽ[k] − D n[k],

n the position noise, d_v = v[k+1] − v[k] − h a[k], ΔF the change of friction in a sample, and
d_x = x[k+1] − x[k] − h v[k], or − h v[k+1] for a semi-implicit observer: of this motion its error is free.
All hold for an observer that is affine in states and positions while no slip turns: constant M and U, g affine in v,
h(s) = s. For others there is no such response, and no bound. Terms of g that are not affine in x, such as gravity on a
tilting axis or cogging, are computed by the observer at the measured position: the difference to the true position
adds to d_v.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import sympy

from codegen.certify.prefix import upwards
from codegen.friction.law import DynamicLaw, ZeroMemoryLaw
from codegen.mechanics.sparse import jacobian, scaled
from codegen.mechanics.system import ContactFriction, Matrix, System
from codegen.observers.equations import Observer
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import Spec, symbol

Sizes = dict[str, list[Fraction]]
"""Cause → the largest disturbance of each position, velocity or friction in a sample."""
STEP = symbol("h")
SLOPES = {
    "by_position": "the slope of g in x",
    "by_velocity": "the slope of g in v",
    "by_input": "the slope of g in the inputs",
}


@dataclass(frozen=True)
class Response:
    """Matrices of exact numbers, m the number of error components, n of coordinates.

    Attributes:
        step: Φ, m by m.
        noise: N, m by n; ``direct``: D, m by n.
        displacement: X, m by n; velocity: V, m by n.
        acceleration: A, what the acceleration adds at e = 0, m by n (zero for Euler and semi-implicit steps).
        by_position, by_velocity, by_force: slopes of the model's acceleration in x, v and the friction on coordinates.
        by_input: in the inputs, n by inputs.
        curved: parts of forces that are not affine in positions or inputs, over these and signs; they are in none of
            the slopes. of_curved: slopes of the model's acceleration in them, n by parts.
        by_state: |slope| of every error in every state, m by m.
    """

    step: Matrix
    noise: Matrix
    direct: Matrix
    displacement: Matrix
    velocity: Matrix
    acceleration: Matrix
    by_position: Matrix
    by_velocity: Matrix
    by_force: Matrix
    by_input: Matrix
    by_state: Matrix
    of_curved: Matrix
    curved: tuple[Any, ...] = ()


def error_response(observer: Observer) -> Response | str:
    """The response in force errors, or why there is none: what is not affine, or not explicit."""
    system, numbers = observer.system, {**observer.values, STEP: observer.sample_time}
    if observer.velocity == "measured":
        return "the observer measures velocity, and a bound is known for estimated velocity alone"
    if observer.integration == "implicit":
        return "the step is implicit, and a bound is known for euler and semi_implicit"
    if observer.kind in ("dfo", "gdfo"):
        return "the friction state of a DFO is no linear error"
    mass = system.mass_matrix.xreplace(numbers)
    if varying := _names(mass):
        return f"M depends on {varying}, and a bound is known for a constant M"
    if varying := _names(system.distribution.xreplace(numbers)):
        return f"the friction distribution U depends on {varying}, and a bound is known for a constant U"
    inverse = mass.inv()
    signs = dict(zip(_slips(observer), observer.signs, strict=True))
    a = sympy.Matrix([sympy.Dummy(f"a{k}", real=True) for k in range(mass.rows)])
    values: dict[Any, Any] = {}
    model = sympy.zeros(mass.rows, 1)
    estimates: list[Any] = []
    curved = Curved(observer)
    for equation in observer.equations:
        expression = equation.expression.xreplace(numbers)
        expression = expression.replace(Sgn, lambda u: signs.get(u, Sgn(u)))
        expression = expression.replace(Magnitude, lambda u: signs[u] * u if u in signs else Magnitude(u))
        expression = curved.without(expression, equation.form == "mass_solve").xreplace(values)
        if equation.form == "mass_solve":
            model, expression = inverse * expression, a
        values.update(zip(equation.symbols, expression, strict=True))
        estimates += list(expression) if equation.state is not None else []
    known = dict(zip(a, model, strict=True))
    found, rates = sympy.Matrix(estimates), observer.rates.xreplace(numbers).xreplace(values)
    z, x, h = sympy.Matrix(observer.states), sympy.Matrix(system.positions), observer.sample_time
    stepped = rates.xreplace(known)

    turn = [1 if e.contact is None or not observer.level_errors else observer.signs[e.contact] for e in observer.errors]
    from_state, from_position = jacobian(found, z), jacobian(found, x)
    n, m = mass.rows, len(estimates)
    onto_velocity = sympy.eye(m)[:, :n]
    # x[k+1] − x[k] − h v[k] = d_x + h (h a[k] + d_v[k]) with d_x about v[k+1]
    late = -h * from_position if observer.integration == "semi_implicit" else sympy.zeros(m, n)
    plain, to_state, by_state = [1] * max(m, n), from_state.inv(), jacobian(model, z)
    # The truth as a state: v̂ = v and ẽ = 0, so z = v − (the rest of the estimate); only slopes in a count here.
    if curved.parts and (observer.domain is not None or rates.free_symbols & curved.parts.keys()):
        return "g is not affine in x; with a domain, or with states that use g directly, no bound is known"
    matrices = {
        "step": scaled(turn, from_state * (sympy.eye(m) + h * jacobian(stepped, z)) * to_state, turn),
        "noise": scaled(turn, -h * from_state * jacobian(stepped, x), plain),
        "direct": scaled(turn, from_position, plain),
        "displacement": scaled(turn, -from_position, plain),
        "velocity": scaled(turn, onto_velocity + late, plain),
        "acceleration": scaled(turn, h * (onto_velocity + late) - h * from_state * jacobian(rates, a), plain),
        "by_position": jacobian(model, x) - by_state * to_state * from_position,
        "by_velocity": (by_state * to_state)[:, :n],
        "by_force": -inverse,
        "by_state": from_state.subs(dict.fromkeys(observer.signs, 1)).applyfunc(abs),
        "by_input": jacobian(model, system.inputs) if system.inputs else sympy.zeros(n, 0),
        "of_curved": jacobian(model, [*curved.parts]) if curved.parts else sympy.zeros(n, 0),
    }
    tidy = {
        name: Matrix(matrix.applyfunc(lambda e: _signs_gone(e, observer.signs))) for name, matrix in matrices.items()
    }
    left = {name: e for name, matrix in tidy.items() for e in matrix if not e.is_Rational}
    if not left:
        return Response(**tidy, curved=tuple(curved.parts.values()))
    if observer.integration == "exponential":
        return "the step is exponential, and a bound is known for euler and semi_implicit"
    varies = [words for name, words in SLOPES.items() if name in left and left[name].free_symbols]
    if varies or any(e.free_symbols for e in left.values()):
        what = varies[0] if varies else "the slope of h"
        return f"{what} is no constant, and a bound is known for g affine in v, and h(s) = s"
    return "a number of the step is not rational"


class Curved:
    """The parts of an observer's forces that are not affine in positions or inputs, and hold no state.

    If any of them depends on a position, all terms of g in positions count as one part, affine ones too: the claim
    (``forces: measured``) then speaks of one force at the measured positions.

    Attributes:
        parts: symbol in place of a part → the part.
    """

    def __init__(self, observer: Observer) -> None:
        numbers = {**observer.values, STEP: observer.sample_time}
        self._positions = {*observer.system.positions}
        self._measured = self._positions | {*observer.system.inputs}
        self._known = self._measured | {*observer.signs}
        self.parts: dict[sympy.Dummy, Any] = {}
        every = [e for equation in observer.equations for e in equation.expression.xreplace(numbers)]
        self._whole = any(e.free_symbols & self._positions for row in every for e in self._curved(row, False))

    def without(self, expression: Matrix, is_force: bool) -> Matrix:
        """Expressions over states and measurements with a symbol in place of each one's curved part."""
        return Matrix(expression.applyfunc(lambda e: self._without(e, is_force and self._whole)))

    def _without(self, expression: Any, whole: bool) -> Any:
        curved = self._curved(expression, whole)
        if not curved:
            return expression
        part = sympy.Dummy("curved", real=True)
        self.parts[part] = sum(curved)
        return sympy.expand(expression) - self.parts[part] + part

    def _curved(self, expression: Any, whole: bool) -> list[Any]:
        """Its terms without states that are not affine; if ``whole``, all of its terms with positions."""
        terms = [e for e in sympy.Add.make_args(sympy.expand(expression)) if e.free_symbols <= self._known]
        return [e for e in terms if not self._is_affine(e) or (whole and e.free_symbols & self._positions)]

    def _is_affine(self, e: Any) -> bool:
        _, rest = e.as_independent(*self._measured, as_Add=False)
        return bool(rest.is_Symbol or not rest.free_symbols)


def largest_slopes(spec: Spec, observer: Observer, part: Any, off: ModelError) -> list[Any] | str:
    """At least the magnitude of a part's slope in each position and input over the envelope, or why there is none.

    Positions are as they are measured, noise included, and inputs as a machine of this model error has them.
    """
    system, missing = observer.system, []
    if part.has(Sgn):
        return f"g jumps where {next(iter(part.atoms(Sgn))).args[0]} changes its sign"

    def end(name: str) -> Any:
        return max((abs(sympy.Rational(e)) for e in spec.envelope.get(name, ())), default=sympy.Integer(0))

    ranges = {x: end(x.name) + end(f"{x}_noise") for x in system.positions if x.name in spec.envelope}
    ranges |= {w: end(w.name) * (1 + sympy.Rational(off.gain)) for w in system.inputs if w.name in spec.envelope}

    def largest(e: Any) -> Any:
        if e.is_number:
            return abs(e) if e.is_Rational else upwards(abs(float(e)) * (1 + 1e-12), DIGITS)
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
        missing.append(f"the envelope has no range for {e}" if e.is_Symbol else f"no bound of {e} is known")
        return sympy.Integer(0)

    found = [largest(part.diff(x)) for x in (*system.positions, *system.inputs)]
    return f"g is not affine, and {missing[0]}" if missing else found


def _names(expressions: Iterable[Any]) -> str:
    """The symbols in expressions, sorted; empty without any. A computed one has names in its text alone."""
    return ", ".join(sorted({s.name for e in expressions for s in e.free_symbols}))


def _slips(observer: Observer) -> tuple[Any, ...]:
    """The symbols of the estimated slips."""
    return next((tuple(e.symbols) for e in observer.equations if e.name == "slip_velocity"), observer.signs)


def _signs_gone(expression: Any, signs: tuple[sympy.Symbol, ...]) -> Any:
    """s² = 1. Where a sign is left all the same, there is no one response for both."""
    expanded = sympy.expand(expression)
    for s in signs:
        if expanded.has(s) and expanded.is_polynomial(s):
            expanded = sympy.rem(expanded, s**2 - 1, s)
    return expanded


@dataclass(frozen=True)
class ModelError:
    """By which share a machine is above its model: 1/100 is a percent, of either sign.

    Attributes:
        mass: of M(x), all of it; gain: of the inputs' effect; time: of every sample's length.
    """

    mass: Fraction = Fraction(0)
    gain: Fraction = Fraction(0)
    time: Fraction = Fraction(0)


EXACT = ModelError()
DIGITS = 12
"""Of a slope that is not rational, rounded up."""


def disturbances(spec: Spec, observer: Observer, response: Response, off: ModelError = EXACT) -> Sizes | str:
    """δ of every cause, m, m/s and the friction's unit a sample; or what the envelope lacks for it.

    With M = (1 + p) M̂ the model's acceleration is by p v' off at the same forces, and with an input that acts by
    B(1 + p) by p M⁻¹Bw. Samples of h(1 + p) are, by the clock of the code, a machine that moves at v(1 + p) and changes
    that by v'(1 + p)², which is (2p + p²) v' more, under forces of v. Each is a velocity of h times that in a sample.
    Inputs are held from sample to sample: what they move within one is not in it.
    """
    system, h = observer.system, fraction(observer.sample_time)
    if said := left_out(system):
        return said
    slower = 1 + off.time
    slopes = [largest_slopes(spec, observer, part, off) for part in response.curved]
    if missing := next((x for x in slopes if isinstance(x, str)), ""):
        return missing
    n, weights = len(system.positions), response.of_curved.applyfunc(abs)
    bounds = weights * sympy.Matrix(len(slopes), n + len(system.inputs), [e for row in slopes for e in row])
    beyond, by_input = bounds[:, :n], response.by_input.applyfunc(abs) + bounds[:, n:]

    def largest(name: str) -> Fraction | None:
        ends = spec.envelope.get(name)
        return None if ends is None else max(abs(fraction(e)) for e in ends)

    true = [largest(f"{v}_dot") or Fraction(0) for v in system.velocities]
    acceleration = [slower * slower * a for a in true]
    speed = [largest(v.name) for v in system.velocities]
    if any((*response.by_position, *beyond)) and None in speed:
        return "g depends on x, and the envelope has no range for every velocity"
    speeds = [s or Fraction(0) for s in speed]
    pushed = [largest(w.name) for w in system.inputs]
    if off.gain and None in pushed:
        return "the envelope has no range for every input"
    if off.time and any(response.by_velocity) and None in speed:
        return "g depends on v, and the envelope has no range for every velocity"
    slips = system.distribution.subs(observer.values)
    rates, contacts = [], []
    for c, contact in enumerate(system.contacts):
        slides = sliding(observer, contact)
        if slides is None:
            return f"the law {contact.law.name} at {contact.name} has no bound on its slope"
        contacts.append(slower * slides.slope * dot(slips.col(c), true))
    onto = [dot(slips.row(i), contacts) for i in range(slips.rows)]
    for error in observer.errors[len(acceleration) :]:
        if error.contact is not None:
            rates.append(contacts[error.contact])
        elif error.coordinate is not None:
            rates.append(onto[error.coordinate])
    jerk = [
        dot(response.by_position.row(i), [slower * s for s in speeds])
        + dot(beyond.row(i), [slower * s for s in speeds])
        + dot(response.by_velocity.row(i), acceleration)
        + dot(response.by_force.row(i), onto)
        for i in range(len(acceleration))
    ]
    noise = [largest(f"{x}_noise") or Fraction(0) for x in system.positions]
    more = [
        (off.mass + slower * slower - 1) * a
        + dot(beyond.row(i), noise)
        + off.time * dot(response.by_velocity.row(i), speeds)
        + off.gain * dot(by_input.row(i), [w or Fraction(0) for w in pushed])
        for i, a in enumerate(true)
    ]
    return {
        "noise": noise,
        "displacement": [h * h * a / 2 for a in acceleration],
        "velocity": [h * h * j / 2 + h * m for j, m in zip(jerk, more, strict=True)],
        "acceleration": [a + m for a, m in zip(acceleration, more, strict=True)],
        "friction": [h * r for r in rates],
        "rounding": [Fraction(0)] * len(observer.errors),
    }


@dataclass(frozen=True)
class Sliding:
    """A contact's law in sliding of one sign, in the contact's units.

    Attributes:
        slope: bound on |dF/du|, exact or rounded up, of a law with a state once that has come to its level.
        level: declared, where sliding begins; speed: from which on a law with a state slides, 0 for others.
    """

    slope: Fraction
    level: Fraction
    speed: Fraction


def sliding(observer: Observer, contact: ContactFriction) -> Sliding | None:
    """What the law says of sliding; None where its slope has no bound. One that is not rational is rounded up."""
    law, values = contact.law, {k: observer.values[s] for k, s in contact.law_parameters.items()}
    found = law.in_sliding(values) if isinstance(law, DynamicLaw) else (sympy.Integer(0), law.slope_bound(values))
    if found is None or not getattr(found[1], "is_finite", False):
        return None
    slope = found[1] if found[1].is_Rational else upwards(float(found[1]) * (1 + 1e-12), DIGITS)
    begun = law.level(found[0], values) if isinstance(law, DynamicLaw) else contact.level_at_rest or sympy.Integer(0)
    level = abs(begun.xreplace(observer.values))
    exact = level if level.is_Rational else sympy.Rational(float(level) * (1 + 1e-12))
    return Sliding(fraction(slope), fraction(exact), fraction(found[0]))


def largest_friction(spec: Spec, observer: Observer) -> list[Fraction | None]:
    """At least |friction| of each contact at any slip in the envelope, rest included; None where no bound is known.

    Of a law without memory that is the level at rest and what its slope adds up to the fastest slip, or the largest end
    of the envelope's ``a_NAME`` if it has one, since that is of the level in motion; for a law of states, its force at
    the ends of their ranges, with that end for the level that it is a multiple of.
    """
    system, found = observer.system, list[Fraction | None]()
    slips = system.distribution.subs(observer.values)

    def end(name: str) -> Any:
        return max((abs(sympy.Rational(e)) for e in spec.envelope.get(name, ())), default=sympy.oo)

    for c, contact in enumerate(system.contacts):
        law, values = contact.law, {k: observer.values[s] for k, s in contact.law_parameters.items()}
        reach = [0 if u == 0 else abs(u) * end(v.name) for u, v in zip(slips.col(c), system.velocities, strict=True)]
        fastest = sum(reach, sympy.Integer(0))
        ranged = f"a_{contact.name}" in spec.envelope
        if ranged and not isinstance(law, DynamicLaw):
            rest = contact.level_at_rest
            most = sympy.Max(end(f"a_{contact.name}"), 0 if rest is None else rest.xreplace(observer.values))
        elif (contact.extra_level != 0 and not ranged) or slips.col(c).free_symbols:
            most = sympy.oo
        elif isinstance(law, DynamicLaw):
            scaled = {law.scale: end(f"a_{contact.name}")} if ranged and law.scale else {}
            most = _force_of_states(law, values | scaled, fastest)
        elif isinstance(law, ZeroMemoryLaw) and contact.level_at_rest is not None:
            slope, s = law.slope_bound(values), sympy.Symbol("s", positive=True)
            slow = law.level(s, values).replace(Sgn, lambda _: sympy.Integer(1)).subs(s, 0)
            most = sympy.Max(slow, contact.level_at_rest.xreplace(observer.values))
            most += slope * fastest if slope != 0 else 0
        else:
            most = sympy.oo
        exact = most if most.is_Rational or not most.is_finite else upwards(float(most) * (1 + 1e-12), DIGITS)
        found.append(fraction(exact) if exact.is_finite else None)
    return found


def _force_of_states(law: DynamicLaw, values: Any, fastest: Any) -> Any:
    """The largest |λ| of a law whose force is a multiple of one state; oo for another."""
    if len(law.states) != 1 or not fastest.is_finite:
        return sympy.oo
    u, z = sympy.symbols("u z", real=True)
    force = sympy.expand(law.force(u, (z,), values))
    slope = force.diff(z)
    if slope.free_symbols or force != slope * z:
        return sympy.oo
    ((low, high),) = law.state_range(fastest, values)
    return abs(slope) * sympy.Max(abs(low), abs(high))


def left_out(system: System) -> str:
    """What the system holds that no size here bounds, in words; empty where there is nothing."""
    for transmission in system.transmissions:
        return f"{system.positions[transmission.coordinate]} moves a load behind a spring"
    for contact in system.contacts:
        law = contact.law
        if isinstance(law, DynamicLaw) and law.in_sliding(contact.law_parameters) is None:
            return f"the law {law.name} at {contact.name} has a state, which changes friction beside the slip"
    for x in system.sensor_errors:
        return f"the sensor of {x} reads wrong, and what that makes of noise is not bounded"
    return ""


def with_rounding(sizes: Sizes, response: Response, positions: Fraction, states: list[Fraction]) -> Sizes:
    """The sizes with what rounding adds: to every position, and to the errors by every state in a step."""
    if not states:
        return sizes
    errors = [dot(response.by_state.row(i), states) for i in range(len(states))]
    return sizes | {"noise": [s + positions for s in sizes["noise"]], "rounding": errors}


def dot(row: Any, sizes: Sequence[Fraction]) -> Fraction:
    """Σ |row| sizes."""
    return sum((abs(fraction(e)) * s for e, s in zip(row, sizes, strict=True)), Fraction(0))


def fraction(value: Any) -> Fraction:
    """A SymPy rational."""
    exact = sympy.Rational(value)
    return Fraction(int(exact.p), int(exact.q))

"""Sign-symmetric coordinates of a DFO's sampled error dynamics: a proof for f > 0 holds for f < 0 too.

Let f be the friction state of a contact, u its slip velocity, e_a the error of its level, and σ = sgn f. Written over
(σf, σu, σ du/dt), with σ e_a in place of e_a, the error matrix A is the same for σ = 1 and σ = −1, for each contact.
One family of matrices thus covers both directions of sliding. When f changes its sign, the component σ e_a does too.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import sympy

from codegen.analysis.analysis import Analysis
from codegen.analysis.error_dynamics import ErrorDynamics, derive_step
from codegen.analysis.polynomials import expand_products
from codegen.certify.family import Family, build_family, range_of, signed_slips
from codegen.mechanics.sparse import scaled
from codegen.mechanics.system import Matrix
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol

Box = Mapping[sympy.Symbol, tuple[Any, Any]]
"""Variable → (low, high), exact."""
POINTS = 3
"""Number of random rational points at which the symmetry of A is checked."""


@dataclass(frozen=True)
class ContactAxes:
    """The variables of a contact multiplied by σ = sgn f, with their largest magnitudes in the envelope.

    Attributes:
        name: of the contact.
        state, slip, slip_rate: the symbols of σf, σu and σ du/dt.
        largest_state, largest_slip: the largest |f| and |u|, exact.
        largest_rate: the largest |du/dt|, exact; None if the envelope does not bound it.
        least_state: the least |f|, exact; zero if the range of f contains zero.
    """

    name: str
    state: sympy.Symbol
    slip: sympy.Symbol
    slip_rate: sympy.Symbol
    largest_state: Any
    largest_slip: Any
    largest_rate: Any
    least_state: Any

    @property
    def symbols(self) -> tuple[sympy.Symbol, sympy.Symbol, sympy.Symbol]:
        """The symbols of σf, σu and σ du/dt."""
        return self.state, self.slip, self.slip_rate


@dataclass(frozen=True)
class AlongFriction:
    """The sampled error dynamics of a DFO in sign-symmetric coordinates.

    Attributes:
        dynamics: the error dynamics, written over ``axes``.
        axes: one for each contact.
        kinks: the arguments of |·| and sgn in the law: linear in the friction states; the law is piecewise, with the
            pieces separated by their zeros.
        levels: true level → (low, high), exact, for the levels that are variables of A.
    """

    dynamics: ErrorDynamics
    axes: tuple[ContactAxes, ...]
    kinks: tuple[Any, ...]
    levels: Box = field(default_factory=dict)
    _known: dict[Any, tuple[Family, dict[Any, sympy.Symbol]]] = field(default_factory=dict, repr=False)

    def at(self, sample_time: Any) -> AlongFriction:
        """The same error dynamics at another sample time, exact, s."""
        return replace(self, dynamics=self.dynamics.at(sample_time), _known={})

    def family(self, box: Box) -> Family:
        """The family of error matrices over a box; signs that are constant on the box are put in as numbers.

        Args:
            box: variable → (low, high); the ranges of ``levels`` are added.

        Raises:
            NotEnclosable: as ``build_family``.
        """
        box = {**self.levels, **box}
        # The family's expressions depend on the signs of slips and kinks on the box.
        slips, ends = [box[axis.slip] for axis in self.axes], [range_of(x, box) for x in self.kinks]
        pattern: tuple[Any, ...] = tuple((low >= 0, high <= 0) for low, high in slips)
        pattern += tuple((low >= 0, high <= 0, low > 0, high < 0, high <= -low) for low, high in ends)
        if pattern not in self._known:
            self._known[pattern] = self._built(box)
        family, parts = self._known[pattern]
        ranges = {**box, **{p: (sympy.Integer(0), min(map(abs, range_of(x, box)))) for x, p in parts.items()}}
        return replace(family, variables={v: ranges.get(v, ends) for v, ends in family.variables.items()})

    def _built(self, box: Box) -> tuple[Family, dict[Any, sympy.Symbol]]:
        """The family, and kink x → the symbol of its positive part (``_without_kinks``)."""
        signs = dict(zip(self.dynamics.observer.signs, self.axes, strict=True))
        known = {
            s: sympy.Integer(1 if box[axis.slip][0] >= 0 else -1)
            for s, axis in signs.items()
            if box[axis.slip][0] >= 0 or box[axis.slip][1] <= 0
        }
        single, parts = {axis.slip: s for s, axis in signs.items()}, dict[Any, sympy.Symbol]()
        slopes = {
            name: _without_kinks(signed_slips(e.xreplace(known), single), box, parts)
            for name, e in self.dynamics.slopes.items()
        }
        ranges = {part: (sympy.Integer(0), sympy.Integer(1)) for part in parts.values()}
        return build_family(replace(self.dynamics, slopes=slopes), {**box, **ranges}), parts


def envelope_along(analysis: Analysis) -> Box | None:
    """The envelope in sign-symmetric coordinates; None if it contains a friction state of zero.

    It has no range of an acceleration that the envelope does not bound.
    """
    observer, ranges = analysis.dynamics.observer, analysis.points.ranges
    rates = {v: symbol(f"{v.name}_dot") for v in observer.system.velocities}
    box: dict[sympy.Symbol, tuple[Any, Any]] = {}
    for k, slip in enumerate(observer.system.slip_velocity.subs(observer.values)):
        axis = _axes(analysis, k)
        low, high = ranges[symbol(f"f_{axis.name}")]
        if low <= 0 <= high:
            return None
        sign = 1 if low > 0 else -1
        for name, of in ((axis.slip, slip), (axis.slip_rate, slip.subs(rates))):
            if of.free_symbols <= set(ranges):
                box[name] = range_of(sign * of, ranges)
        box[axis.state] = (axis.least_state, axis.largest_state)
    return box


def along_friction(analysis: Analysis) -> AlongFriction | None:
    """The error dynamics of a DFO in sign-symmetric coordinates, or None if they have no such form.

    Conditions: the step is explicit, M is constant, the distribution matrix U is constant and invertible, and A has the
    symmetry, which is checked in exact numbers at random rational points.
    """
    observer = analysis.dynamics.observer
    system = observer.system
    distribution = observer.distribution
    free = distribution.free_symbols | system.mass_matrix.subs(observer.values).free_symbols
    square = distribution.rows == distribution.cols
    if not observer.truth_ranges or analysis.dynamics.implicit or free or not square or distribution.det() == 0:
        return None
    axes = tuple(_axes(analysis, k) for k in range(len(system.contacts)))
    plain = derive_step(observer, longest=0)
    dynamics = _in_axes(plain, axes, distribution.T.inv())
    known = {v for axis in axes for v in axis.symbols} | {sympy.Symbol("h", real=True)}
    known |= {*dynamics.slopes, *dynamics.inverse_mass, *observer.signs, *observer.values, *observer.level_ranges}
    entries = [dynamics.sampled, *dynamics.slopes.values()]
    if any(not e.free_symbols <= known for e in entries) or not _symmetric(dynamics, axes):
        return None
    slopes = {s: e.xreplace(observer.values) for s, e in dynamics.slopes.items()}
    return AlongFriction(replace(dynamics, slopes=slopes), axes, _kinks(slopes.values()), observer.level_ranges)


def _axes(analysis: Analysis, contact: int) -> ContactAxes:
    """The variables of one contact, with the magnitudes that follow from the ranges of the envelope."""
    observer, ranges = analysis.dynamics.observer, analysis.points.ranges
    system = observer.system
    name, slip = system.contacts[contact].name, system.slip_velocity[contact].subs(observer.values)
    states = (*ranges[symbol(f"f_{name}")],)
    rates = {v: symbol(f"{v.name}_dot") for v in system.velocities}
    bounded = all(rates[v] in ranges for v in slip.free_symbols)

    def reach(of: Mapping[Any, Any]) -> Any:
        """Σ |∂u/∂v| max |v|, or with v' in place of v by ``of``: velocity → symbol."""
        return sum(abs(slip.coeff(v)) * max(map(abs, ranges[of.get(v, v)])) for v in slip.free_symbols)

    return ContactAxes(
        name,
        symbol(f"f_{name}_along"),
        symbol(f"slip_{name}_along"),
        symbol(f"slip_{name}_dot_along"),
        max(map(abs, states)),
        reach({}),
        reach(rates) if bounded else None,
        sympy.Integer(0) if states[0] <= 0 <= states[1] else min(map(abs, states)),
    )


def _in_axes(dynamics: ErrorDynamics, axes: tuple[ContactAxes, ...], inverse: Matrix) -> ErrorDynamics:
    """The error dynamics with velocities v[k], v[k+1] and friction states in the axes; ``inverse`` is U'⁻¹, u = U'v."""
    observer, h = dynamics.observer, sympy.Symbol("h", real=True)
    velocities = observer.system.velocities
    slips, rates = (sympy.Matrix([getattr(a, part) for a in axes]) for part in ("slip", "slip_rate"))
    now = dict(zip(velocities, inverse * slips, strict=True))
    later = dict(zip(velocities, inverse * (slips + h * rates), strict=True))
    written = {**now, **{n: later[v] for n, v in dynamics.next_velocity.items()}}
    written |= {symbol(f"f_{a.name}"): a.state for a in axes}
    sampled = Matrix(dynamics.sampled.xreplace(written).applyfunc(expand_products))
    slopes = {s: e.xreplace(written) for s, e in dynamics.slopes.items()}
    return replace(dynamics, sampled=sampled, slopes=slopes, next_velocity={})


def _kinks(expressions: Iterable[Any]) -> tuple[Any, ...]:
    """The arguments of |·| and sgn that are linear, other than a single symbol such as a slip."""
    found = {atom.args[0] for e in expressions for atom in e.atoms(Magnitude, Sgn) if not atom.args[0].is_Symbol}
    return tuple(sorted((x for x in found if sympy.Poly(x, *x.free_symbols).is_linear), key=str))


def _without_kinks(expression: Any, box: Box, parts: dict[Any, sympy.Symbol]) -> Any:
    """The expression with every |x| replaced: by ±x if the sign of x is constant on the box, else with a new variable.

    |x| = −x + 2p with the positive part p = max(x, 0), or |x| = x + 2p with p = max(−x, 0), whichever p is smaller.
    In a dead zone, x + |x| then becomes 2p; interval arithmetic would not cancel x with the x in |x|. New p are added
    to ``parts``, by x.
    """
    for x in _kinks([expression]):
        low, high = range_of(x, box)
        if low < 0 < high:
            part = parts.setdefault(x, symbol(f"positive{len(parts) + 1}"))
            expression = expression.subs(Magnitude(x), (-x if high <= -low else x) + 2 * part)
        else:
            expression = expression.subs(Magnitude(x), x if low >= 0 else -x)
    return sympy.expand(expression)


def _symmetric(dynamics: ErrorDynamics, axes: tuple[ContactAxes, ...]) -> bool:
    """Whether A is the same for both signs of every σ, checked in exact numbers at ``POINTS`` random points."""
    observer, generator = dynamics.observer, random.Random(3)
    values = {**observer.values, sympy.Symbol("h", real=True): observer.sample_time}
    mass = observer.system.mass_matrix.subs(observer.values).inv()
    values |= {w: mass[i, j] for w, (i, j) in dynamics.inverse_mass.items()}
    flips = [k for k, e in enumerate(observer.errors) if e.of == "level"]

    slopes = {s: e.xreplace(values) for s, e in dynamics.slopes.items()}
    sampled = dynamics.sampled.xreplace(values)

    def at(point: Mapping[Any, Any]) -> Matrix:
        signed = {**point, **{s: sympy.sign(point[a.slip]) for s, a in zip(observer.signs, axes, strict=True)}}
        return Matrix(sampled.xreplace({**signed, **{s: e.xreplace(signed) for s, e in slopes.items()}}))

    drawn = [v for a in axes for v in a.symbols] + [*observer.level_ranges]
    for _ in range(POINTS):
        point = {v: sympy.Rational(generator.choice((-1, 1)) * generator.randrange(1, 3000), 1000) for v in drawn}
        here = at(point)
        for axis, level in zip(axes, flips, strict=True):
            other = {v: -x if v in axis.symbols else x for v, x in point.items()}
            flip_signs = [-1 if k == level else 1 for k in range(dynamics.sampled.rows)]
            if at(other) != scaled(flip_signs, here, flip_signs):
                return False
    return True

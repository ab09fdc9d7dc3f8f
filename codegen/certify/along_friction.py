"""A DFO's sampled error in variables times the sign of the friction state: a proof for f > 0 holds for f < 0 too.

With σ the sign of a contact's friction state f, its slip u and u̇: over (σf, σu, σu̇) and with σ e_a in place of the
level error, A is the same matrix for both signs of every σ. So both directions of sliding are one family, and where f
passes zero that component of the error changes its sign.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import sympy

from codegen.analysis.analysis import Analysis
from codegen.analysis.error_dynamics import ErrorDynamics, derive_step
from codegen.analysis.polynomials import expand_products
from codegen.certify.family import Family, build_family, signed_slips
from codegen.mechanics.sparse import scaled
from codegen.mechanics.system import Matrix
from codegen.observers.equations import Observer
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol

Box = Mapping[sympy.Symbol, tuple[Any, Any]]
POINTS = 3


@dataclass(frozen=True)
class ContactAxes:
    """A contact's variables times the sign σ of its friction state, and how far the envelope lets them go.

    Attributes:
        state, slip, slip_rate: the symbols of σf, σu and σ du/dt.
        largest_state, largest_slip: of |f| and |u|, exact.
        largest_rate: of |du/dt|, exact; None where the envelope does not bound it.
        least_state: of |f|, exact: zero unless the envelope leaves zero out.
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
        """Of the state, the slip and its rate."""
        return self.state, self.slip, self.slip_rate


@dataclass(frozen=True)
class AlongFriction:
    """A DFO's sampled error over ``axes``, one for each contact.

    Attributes:
        kinks: expressions, linear in the friction states, at whose zeros the law changes its form.
        levels: true level → (low, high), exact, of those that are variables too.
    """

    dynamics: ErrorDynamics
    axes: tuple[ContactAxes, ...]
    kinks: tuple[Any, ...]
    levels: Box = field(default_factory=dict)
    _known: dict[Any, tuple[Family, dict[Any, sympy.Symbol]]] = field(default_factory=dict, repr=False)

    def at(self, sample_time: Any) -> AlongFriction:
        """The same at another sample time, exact, s."""
        return replace(self, dynamics=self.dynamics.at(sample_time), _known={})

    def over(self, observer: Observer) -> AlongFriction:
        """The same for an observer with other ranges of the same levels; families are written once for both."""
        assert observer.level_ranges.keys() == self.levels.keys()
        return replace(self, dynamics=replace(self.dynamics, observer=observer), levels=observer.level_ranges)

    def family(self, box: Box) -> Family:
        """The family over ranges of the variables; signs of slips and of kinks come from these where they are known.

        Raises:
            NotEnclosable: as ``build_family``.
        """
        box = {**self.levels, **box}
        pattern = self._pattern(box)
        if pattern not in self._known:
            self._known[pattern] = self._built(box)
        family, parts = self._known[pattern]
        ranges = {**box, **{p: (sympy.Integer(0), min(map(abs, range_of(x, box)))) for x, p in parts.items()}}
        return replace(family, variables={v: ranges.get(v, ends) for v, ends in family.variables.items()})

    def _pattern(self, box: Box) -> tuple[Any, ...]:
        """What decides how the family is written."""
        slips = [(box[axis.slip][0] >= 0, box[axis.slip][1] <= 0) for axis in self.axes]
        ends = [range_of(x, box) for x in self.kinks]
        return (*slips, *((low >= 0, high <= 0, low > 0, high < 0, high <= -low) for low, high in ends))

    def _built(self, box: Box) -> tuple[Family, dict[Any, sympy.Symbol]]:
        signs = dict(zip(self.dynamics.observer.signs, self.axes, strict=True))
        known = {}
        for s, axis in signs.items():
            low, high = box[axis.slip]
            if low >= 0 or high <= 0:
                known[s] = sympy.Integer(1 if low >= 0 else -1)
        single = {axis.slip: s for s, axis in signs.items()}
        slopes = {name: signed_slips(e.xreplace(known), single) for name, e in self.dynamics.slopes.items()}
        parts: dict[Any, sympy.Symbol] = {}
        slopes = {name: _without_kinks(e, box, parts) for name, e in slopes.items()}
        ranges = {part: (sympy.Integer(0), sympy.Integer(1)) for part in parts.values()}
        return build_family(replace(self.dynamics, slopes=slopes), {**box, **ranges}), parts


def envelope_along(analysis: Analysis) -> Box | None:
    """The envelope itself in the axes, the acceleration where it is bounded; None if a friction state may be zero."""
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
    """The error of an explicit step in these variables, or None where it has no such form.

    It has where the step is explicit, the mass matrix constant and U constant and invertible, and where the symmetry
    is found at random rational points, exactly.
    """
    observer = analysis.dynamics.observer
    system = observer.system
    distribution = system.distribution.subs(observer.values)
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
    observer, ranges = analysis.dynamics.observer, analysis.points.ranges
    system = observer.system
    name, slip = system.contacts[contact].name, system.slip_velocity[contact].subs(observer.values)
    states = (*ranges[symbol(f"f_{name}")],)
    rates = {v: symbol(f"{v.name}_dot") for v in system.velocities}
    bounded = all(rates[v] in ranges for v in slip.free_symbols)

    def reach(of: Mapping[Any, Any]) -> Any:
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
    """Velocities, those one sample later and friction states written in the axes; ``inverse`` is U'⁻¹."""
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
    """The arguments of |·| and sgn other than a slip itself."""
    found = {atom.args[0] for e in expressions for atom in e.atoms(Magnitude, Sgn) if not atom.args[0].is_Symbol}
    return tuple(sorted((x for x in found if sympy.Poly(x, *x.free_symbols).is_linear), key=str))


def range_of(x: Any, box: Box) -> tuple[Any, Any]:
    """Of a linear expression."""
    inside = sorted(x.free_symbols, key=str)
    ends = [x.xreplace(dict(zip(inside, corner, strict=True))) for corner in product(*(box[v] for v in inside))]
    return min(ends), max(ends)


def _without_kinks(expression: Any, box: Box, parts: dict[Any, sympy.Symbol]) -> Any:
    """|x| as x or −x where the box knows the sign of x, else as −x + 2p with p the positive part of x, or x + 2p.

    In a dead zone x then cancels, which interval arithmetic would not see.

    Args:
        parts: x → p, which is added to; p is from 0 to the lesser of the sizes that x has at its ends.
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
    """Whether A is the same for both signs of every σ, in exact numbers at points drawn at random."""
    observer, dice = dynamics.observer, random.Random(3)
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
        point = {v: sympy.Rational(dice.choice((-1, 1)) * dice.randrange(1, 3000), 1000) for v in drawn}
        here = at(point)
        for axis, level in zip(axes, flips, strict=True):
            other = {v: -x if v in axis.symbols else x for v, x in point.items()}
            turn = [-1 if k == level else 1 for k in range(dynamics.sampled.rows)]
            if at(other) != scaled(turn, here, turn):
                return False
    return True

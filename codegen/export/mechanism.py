"""Multibody description of a System: bodies on joints, and force elements along lines.

A line is a linear combination y = Σ c_i x_i of coordinates: a single joint, the slip of a contact between two bodies,
or the displacement of a motor that drives several joints. An element with the force f along a line exerts c_i f on
coordinate i. Elements are springs, dampers, friction, periodic forces and actuators.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import sympy

from codegen.base.errors import BadInput
from codegen.friction import ZeroMemoryLaw
from codegen.mechanics.build import build_system
from codegen.mechanics.system import TIME, ContactFriction, Matrix, System, with_loads
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import Spec
from codegen.spec.motion import KinematicTree

Direction = tuple[float, ...]
SPEED = sympy.Symbol("s", positive=True)
"""The speed along a line, in the expressions of its friction."""
HIGHEST = 3
"""Highest power of the position of a spring, and of the velocity of a damper."""
SYMMETRIC = 1e-12
"""Largest relative difference of k_ij and k_ji that count as equal."""
NO_JUMP = 1e-9
"""Relative difference of two levels up to which they count as equal."""


@dataclass(frozen=True)
class Wave:
    """A periodic force along a line: amplitude·sin(rate·y + phase)."""

    amplitude: float
    rate: float
    phase: float


@dataclass(frozen=True)
class LineFriction:
    """Friction of one contact along a line, in the units of the line.

    Attributes:
        level: friction level in steady sliding, over SPEED only.
        bristles: (σ0, σ1) of a law of LuGre's form, else None.
        has_states: whether the law has states or another memory.
        at_rest: level at standstill if it differs from that of slow sliding; else None.
    """

    contact: str
    law: str
    level: sympy.Expr
    bristles: tuple[float, float] | None
    has_states: bool
    at_rest: float | None = None


@dataclass
class Line:
    """All force elements along one line y.

    Attributes:
        constant: constant force.
        stiffness, damping: coefficients k_j, d_j of the forces −Σ k_j y^(j+1) and −Σ d_j |y'|^(j+1) sgn(y'), j from 0.
        gap: full width of the play (backlash) in which the spring does not act.
    """

    direction: Direction
    constant: float = 0.0
    stiffness: list[float] = field(default_factory=lambda: [0.0] * HIGHEST)
    damping: list[float] = field(default_factory=lambda: [0.0] * HIGHEST)
    waves: list[Wave] = field(default_factory=list)
    frictions: list[LineFriction] = field(default_factory=list)
    gap: float = 0.0

    @property
    def level(self) -> sympy.Expr:
        """Friction and damping force against the motion, over SPEED."""
        damping = [sympy.Float(d) * SPEED ** (j + 1) for j, d in enumerate(self.damping) if d]
        return sympy.Add(*[f.level for f in self.frictions]) + sympy.Add(*damping)

    def spring(self, way: sympy.Expr) -> sympy.Expr:
        """Σ k_j y^(j+1) at y = ``way``; the spring force is its negative."""
        return sympy.Add(*[sympy.Float(k) * way ** (j + 1) for j, k in enumerate(self.stiffness) if k])


@dataclass(frozen=True)
class Drive:
    """An actuator: its force along a line is the command after delay, lag and limit.

    Attributes:
        index: of the input.
        direction: of the line; the coefficients include the gain.
        limit: of the command, or None.
        delay, lag: s.
        dead_zone: largest part of a command that is lost, also to a threshold; in the input's unit, before the gain.
        rounded: whether the limit is a rounded saturation.
        order: number of equal lags in series.
    """

    index: int
    direction: Direction
    limit: float | None
    delay: float
    lag: float | None
    dead_zone: float
    rounded: bool
    order: int


@dataclass(frozen=True)
class OtherForce:
    """A force along a line that none of the elements above represents.

    Attributes:
        where: in words, such as ``the force on x``.
        force: over coordinates, velocities, inputs, time and SPEED; for friction the force against the motion.
        friction: the contact to whose level it belongs, or "".
    """

    direction: Direction
    where: str
    force: sympy.Expr
    friction: str = ""


@dataclass(frozen=True)
class Mechanism:
    """A machine as bodies, lines, drives and other forces.

    Attributes:
        system: with one more coordinate for each load behind a spring.
        tree: the bodies of a robot file; None for one body per coordinate.
        lines: one for each direction.
    """

    spec: Spec
    system: System
    tree: KinematicTree | None
    lines: tuple[Line, ...]
    drives: tuple[Drive, ...]
    other_forces: tuple[OtherForce, ...]

    @cached_property
    def inertias(self) -> tuple[float, ...]:
        """(n,) constant inertias of the bodies, the diagonal of M; with a tree, those added at the joints.

        Raises BadInput if M is not constant and diagonal.
        """
        mass = self.system.mass_matrix.applyfunc(lambda e: _numeric(e, self.system))
        if mass.free_symbols or not mass.is_diagonal():
            shape = "one that depends on the position" if mass.free_symbols else "one with couplings"
            found = f"the mass matrix of {self.system.name}: {shape}"
            expected = (
                "`urdf:` with a robot file, or a constant diagonal mass matrix (each coordinate the position of a body "
                "of its own, as `topology:` has it); a simulator's model is made of bodies"
            )
            raise BadInput(self.spec.place("mass_matrix"), found, expected, code="SPEC036")
        return tuple(float(mass[i, i]) for i in range(mass.rows))

    def joint_line(self, index: int) -> Line | None:
        """The line of a single coordinate; None if nothing acts along it."""
        return next((line for line in self.lines if coordinate_of(line.direction) == index), None)


def unit_direction(index: int, n: int) -> Direction:
    """The direction of the line y = x_index, (n,)."""
    return tuple(float(i == index) for i in range(n))


def coordinate_of(direction: Direction) -> int | None:
    """The index i of a line y = x_i; None for another line."""
    n = len(direction)
    return next((i for i in range(n) if direction == unit_direction(i, n)), None)


def mechanism_of(spec: Spec, system: System) -> Mechanism:
    """The multibody description of a machine.

    ``system``: of the spec, with its declared effects. Raises BadInput if the direction of a contact depends on the
    position, or what was added to a robot file belongs to no body of it.
    """
    tree = spec.form if isinstance(spec.form, KinematicTree) else None
    if tree is not None:
        if tree.base_parameters:
            found = "`urdf:` with base_parameters, which belong to no single body"
            expected = "the masses and inertias in the robot file itself"
            raise BadInput(spec.place("urdf"), found, expected, code="SPEC036")
        if system.transmissions:
            found = "a load behind a spring on a joint of a robot file"
            raise BadInput(spec.place("effects"), found, "a joint of its own for it in the robot file", code="SPEC036")
        # The simulator computes the dynamics of the tree: only forces and inertias added by spec and effects remain.
        without_effects = build_system(spec)
        added_force = Matrix(system.force - without_effects.force + Matrix(spec.force))
        system = replace(
            system, force=added_force, mass_matrix=Matrix(system.mass_matrix - without_effects.mass_matrix)
        )
    # Without its play, the spring to a load is a linear term of g; the play is stored in the spring's line.
    gaps = [float(t.gap.subs(system.values)) for t in system.transmissions]
    motors = [t.coordinate for t in system.transmissions]
    n = len(system.positions)
    without_play = tuple(replace(t, gap=sympy.S.Zero) for t in system.transmissions)
    system = with_loads(replace(system, transmissions=without_play))
    elements = _Elements(spec, system)
    for k, (motor, gap) in enumerate(zip(motors, gaps, strict=True)):
        if gap:
            ends = {motor: 1.0, n + k: -1.0}  # with_loads puts the loads after the n coordinates
            elements.line(tuple(ends.get(i, 0.0) for i in range(len(system.positions)))).gap = gap
    lines, drives, other_forces = elements.lines.values(), elements.drives, elements.other_forces
    return Mechanism(spec, system, tree, tuple(lines), tuple(drives), tuple(other_forces))


def _exact_values(system: System) -> dict[sympy.Symbol, Any]:
    """Parameter → its value, a float as the decimal that it is printed as."""
    return {s: sympy.Rational(repr(v)) if isinstance(v, float) else v for s, v in system.values.items()}


def _numeric(expression: Any, system: System) -> Any:
    """An expression with the values of the system's parameters, expanded."""
    return sympy.expand(sympy.sympify(expression).subs(_exact_values(system)))


class _Elements:
    """The forces of a system sorted into elements along lines, drives and other forces."""

    def __init__(self, spec: Spec, system: System) -> None:
        self.spec, self.system = spec, system
        self.n = len(system.positions)
        self.lines: dict[Direction, Line] = {}
        self.drives: list[Drive] = []
        self.other_forces: list[OtherForce] = []
        self._smooth_forces()
        for index, contact in enumerate(system.contacts):
            self._contact(index, contact)

    def line(self, direction: Direction) -> Line:
        """The line of a direction, created on first use."""
        return self.lines.setdefault(direction, Line(direction))

    def _smooth_forces(self) -> None:
        """Sort the terms of g: gains of inputs, springs, dampers, elements along one coordinate, and other forces.

        A term is a constant factor times a shape, the part that depends on x, v, w or t.
        """
        x, v, w = self.system.positions, self.system.velocities, self.system.inputs
        gains = sympy.zeros(self.n, len(w))
        springs, dampers = sympy.zeros(self.n, self.n), sympy.zeros(self.n, self.n)
        rest: list[sympy.Expr] = [sympy.S.Zero] * self.n
        for i in range(self.n):
            for term in sympy.Add.make_args(_numeric(self.system.force[i], self.system)):
                factor, shape = term.as_independent(*x, *v, *w, TIME)
                if shape in w:
                    gains[i, w.index(shape)] += factor
                elif shape in x:
                    springs[i, x.index(shape)] += factor
                elif shape in v:
                    dampers[i, v.index(shape)] += factor
                elif not self._along_coordinate(i, float(factor), shape):
                    rest[i] += term
        self._linear_elements(springs, x, "stiffness", rest)
        self._linear_elements(dampers, v, "damping", rest)
        for j in range(len(w)):
            self._drive(j, gains[:, j])
        for i in range(self.n):
            if rest[i] != 0:
                where = f"the force on {x[i].name}"
                self.other_forces.append(OtherForce(unit_direction(i, self.n), where, rest[i]))

    def _along_coordinate(self, i: int, factor: float, shape: sympy.Expr) -> bool:
        """Add a term of row i to the line of coordinate i, if it is one of its elements; False otherwise.

        Elements are a constant force, nonlinear springs and dampers, and periodic forces.
        """
        x, v = self.system.positions[i], self.system.velocities[i]
        springs = {x**power: power - 1 for power in range(2, HIGHEST + 1)}
        dampers = {v * Magnitude(v): 1, v**2 * Sgn(v): 1, v**3: 2, v * Magnitude(v) ** 2: 2}
        wave = wave_of(factor, shape, x)
        if not (shape == 1 or shape in springs or shape in dampers or wave is not None):
            return False
        line = self.line(unit_direction(i, self.n))
        if wave is not None:
            line.waves.append(wave)
        elif shape == 1:
            line.constant += factor
        elif shape in springs:
            line.stiffness[springs[shape]] -= factor
        else:
            line.damping[dampers[shape]] -= factor
        return True

    def _linear_elements(
        self, matrix: Any, symbols: tuple[sympy.Symbol, ...], kind: str, rest: list[sympy.Expr]
    ) -> None:
        """Add linear forces of x or v as springs or dampers between two coordinates, and on each coordinate.

        A symmetric pair of entries +k is an element along x_i − x_j, a pair −k one along x_i + x_j, so that no element
        between two coordinates is negative. Such an element also contributes |k| to both diagonal entries, which is
        subtracted there.

        Args:
            matrix: (n, n) of the force matrix·symbols.
            kind: the attribute of ``Line``.
            rest: (n,) forces that no element represents; unsymmetric pairs are added to it.
        """
        own = [-matrix[i, i] for i in range(self.n)]
        for i in range(self.n):
            for j in range(i):
                k = matrix[i, j]
                if abs(float(k - matrix[j, i])) > SYMMETRIC * abs(float(k)):
                    rest[i] += matrix[i, j] * symbols[j]
                    rest[j] += matrix[j, i] * symbols[i]
                elif k != 0:
                    sign = 1.0 if k > 0 else -1.0
                    direction = tuple(1.0 if m == j else -sign if m == i else 0.0 for m in range(self.n))
                    getattr(self.line(direction), kind)[0] += abs(float(k))
                    own[i], own[j] = own[i] - abs(k), own[j] - abs(k)
        for i, k in enumerate(own):
            if k != 0:
                getattr(self.line(unit_direction(i, self.n)), kind)[0] += float(k)

    def _drive(self, index: int, gains: Any) -> None:
        """Add the actuator of an input, whose effective value has the gains (n, 1) on the coordinates.

        The actuator's own gain is included in the direction, so its limit and dead zone are divided by it.
        """
        chain = self.system.actuator(index)
        lost = chain.dead_zone + sum(chain.thresholds)
        delay, gain, dead = (float(e.subs(self.system.values)) for e in (chain.delay, chain.gain, lost))
        limits = [float(e.height.subs(self.system.values)) for e in chain.limits]
        lag = None if chain.lag is None else float(chain.lag.subs(self.system.values))
        direction = tuple(gain * float(b) for b in gains)
        limit = min(limits) / gain if limits else None
        rounded = any(e.rounding != 0 for e in chain.limits)
        self.drives.append(Drive(index, direction, limit, delay, lag, dead / gain, rounded, chain.order))

    def _contact(self, index: int, contact: ContactFriction) -> None:
        """Add the friction of a contact along its line.

        λ is split into a part that is odd in the direction of slip, a friction level, and an even part, another force.
        On a line along one coordinate y the slip is c y', with c the entry of U, and the force on y is −c λ. So the
        level and its argument have the factor ``scale`` = |c|, and other forces also the sign of c.
        """
        column = [_numeric(e, self.system) for e in self.system.distribution[:, index]]
        if any(e.free_symbols for e in column):
            place = self.spec.place("friction.distribution")
            found = f"the contact {contact.name}, whose direction changes with the position"
            raise BadInput(place, found, "a distribution of numbers", code="SPEC036")
        direction = tuple(float(e) for e in column)
        moved = [i for i, c in enumerate(direction) if c != 0]
        scale, sign = 1.0, 1.0
        if len(moved) == 1:
            scale, sign = abs(direction[moved[0]]), float(direction[moved[0]] > 0) * 2 - 1
            direction = unit_direction(moved[0], self.n)
        slip = contact.slip
        speed = scale * SPEED if scale != 1 else SPEED

        def at(side: int) -> sympy.Expr:
            """λ at SPEED along the line, for slip in the positive or the negative direction."""
            exact = contact.force.xreplace({Magnitude(slip): speed, Sgn(slip): sympy.Integer(side), slip: side * speed})
            return _numeric(exact.xreplace({Sgn(speed): sympy.S.One, Magnitude(speed): speed}), self.system)

        odd, even = sympy.expand((at(1) - at(-1)) / 2), sympy.expand((at(1) + at(-1)) / 2)
        level, where = sympy.S.Zero, f"the contact {contact.name}"
        for term in sympy.Add.make_args(odd):
            if term.free_symbols <= {SPEED}:
                level += scale * term
            elif term != 0:
                self.other_forces.append(OtherForce(direction, where, scale * term, contact.name))
        for term in sympy.Add.make_args(even):
            if not term.free_symbols:
                self.line(direction).constant -= sign * scale * float(term)
            else:
                self.other_forces.append(OtherForce(direction, where, -sign * scale * term))
        numbers = {name: _exact_values(self.system)[s] for name, s in contact.law_parameters.items()}
        bristles = contact.law.bristles(numbers)
        pair = None if bristles is None else (float(bristles[0]) * scale**2, float(bristles[1]) * scale**2)
        states = not isinstance(contact.law, ZeroMemoryLaw)
        friction = LineFriction(contact.name, contact.law.name, level, pair, states, self._jump(contact, scale))
        self.line(direction).frictions.append(friction)

    def _jump(self, contact: ContactFriction, scale: float) -> float | None:
        """The level at rest, if it differs from the limit of the level at low speed; else None."""
        resting = contact.level_at_rest
        if resting is None or not isinstance(contact.law, ZeroMemoryLaw):
            return None
        rest = scale * float(_numeric(resting, self.system))
        own = sympy.expand(scale * _numeric(contact.law_level.xreplace({Magnitude(contact.slip): SPEED}), self.system))
        slow = float(own.xreplace({Sgn(SPEED): sympy.S.One}).subs(SPEED, 0))
        return rest if abs(rest - slow) > NO_JUMP * max(abs(rest), abs(slow)) else None


def wave_of(factor: float, shape: sympy.Expr, x: sympy.Symbol) -> Wave | None:
    """factor·shape as a wave of positive rate, if shape is a sine or cosine of a linear function of x; else None."""
    if not isinstance(shape, (sympy.sin, sympy.cos)):
        return None
    angle = sympy.expand(shape.args[0])
    rate = angle.coeff(x, 1)
    rest = sympy.expand(angle - rate * x)
    if rate.free_symbols or rest.free_symbols or rate == 0:
        return None
    phase = float(rest) + (float(sympy.pi) / 2 if isinstance(shape, sympy.cos) else 0.0)
    return Wave(factor, float(rate), phase) if rate > 0 else Wave(-factor, -float(rate), -phase)

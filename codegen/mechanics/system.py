"""The mechanical system M(x) v' = g(x, v, w) − U λ as SymPy matrices, and the changes that effects make to it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import sympy
from sympy import ImmutableMatrix

from codegen.base.errors import Place
from codegen.friction import FrictionLaw
from codegen.mechanics.actuator import Actuator, Stage, Transmission
from codegen.mechanics.compact import compact
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol
from codegen.spec.units import dimension, parse_unit

if TYPE_CHECKING:
    Matrix = Any  # SymPy has no types
else:
    Matrix = ImmutableMatrix


TIME = symbol("t")
"""Time from the start of the log, or from an observer's first sample, in s."""
LONGEST_SLOPE = 200
"""Largest number of operations of an entry of ∂g/∂w that is simplified by ``cancel``."""


@dataclass(frozen=True)
class ContactFriction:
    """Friction at one contact: λ = sgn(u)·(level(|u|) + extra_level) + extra_force.

    Attributes:
        slip: the symbol of the slip velocity u in the expressions below.
        law: the declared law.
        law_parameters: name of a law parameter → its symbol.
        extra_level, extra_force: terms added by declared effects, over ``slip``, positions, inputs and time.
    """

    name: str
    unit: str
    slip_unit: str
    slip: sympy.Symbol
    law: FrictionLaw
    law_parameters: Mapping[str, sympy.Symbol]
    extra_level: sympy.Expr = sympy.S.Zero
    extra_force: sympy.Expr = sympy.S.Zero

    @property
    def law_level(self) -> sympy.Expr:
        """The declared law's level over |slip|."""
        return self.law.level(Magnitude(self.slip), self.law_parameters)

    @property
    def plant_level(self) -> sympy.Expr:
        """The level of a set-valued law in a plant, with the level that effects add."""
        return self.law.plant_level(Magnitude(self.slip), self.law_parameters) + self.extra_level

    @property
    def level_at_rest(self) -> sympy.Expr | None:
        """The declared law's level at u = 0; None where it is not finite there, as with ln|u|."""
        level = self.law_level.subs(self.slip, 0)
        return None if level.has(sympy.zoo, sympy.oo, -sympy.oo, sympy.nan) else level

    @property
    def known_force(self) -> sympy.Expr:
        """The part of λ from declared effects: sgn(u)·extra_level + extra_force, which no observer estimates."""
        return Sgn(self.slip) * self.extra_level + self.extra_force

    @property
    def force(self) -> sympy.Expr:
        """λ(u) for u ≠ 0."""
        return Sgn(self.slip) * self.law_level + self.known_force


@dataclass(frozen=True)
class NonlinearInput:
    """Evidence that g(x, v, w) is not linear in the inputs, so that there is no input matrix B.

    Attributes:
        coordinate: the first coordinate whose force is not linear in the inputs.
        input: the input w of which ∂g/∂w depends on the inputs.
        slope: that ∂g/∂w on that coordinate.
    """

    coordinate: str
    input: str
    slope: sympy.Expr

    @property
    def reason(self) -> str:
        """The evidence in words, for the ``found`` of a BadInput."""
        return f"the force on {self.coordinate} is not linear in {self.input}: its slope is {self.slope}"


@dataclass(frozen=True)
class System:
    """The equation of motion.

    Attributes:
        positions, velocities, inputs: symbols of x, v and w, in order.
        mass_matrix: M(x), n by n.
        force: g(x, v, w), n by 1, with the forces of declared effects. An input symbol here, and in ``contacts``, is
            the effective input, behind the actuator.
        distribution: U(x), n by contacts (A.1); slip velocities are U' v.
        contacts: one per column of U.
        values: parameter symbol → exact value in SI.
        units: parameter symbol → unit.
        actuators: input → model of its actuator, from command to effective input, where one is declared.
        sensor_errors: position → error of its sensor (measured less true), a function of the true position; only for
            sensors with an error.
        transmissions: springs between motors and loads. M, g and U are those of the rigid machine; ``with_loads``
            gives the system with motors and loads as separate coordinates.
        effect_forces: coordinate index → the part of g that effects add, which acts at the motor of such a coordinate.
    """

    name: str
    positions: tuple[sympy.Symbol, ...]
    velocities: tuple[sympy.Symbol, ...]
    inputs: tuple[sympy.Symbol, ...]
    position_units: tuple[str, ...]
    input_units: tuple[str, ...]
    mass_matrix: Matrix
    force: Matrix
    distribution: Matrix
    contacts: tuple[ContactFriction, ...]
    values: Mapping[sympy.Symbol, Any]
    units: Mapping[sympy.Symbol, str]
    actuators: Mapping[sympy.Symbol, Actuator] = field(default_factory=dict)
    sensor_errors: Mapping[sympy.Symbol, sympy.Expr] = field(default_factory=dict)
    transmissions: tuple[Transmission, ...] = ()
    effect_forces: Mapping[int, sympy.Expr] = field(default_factory=dict)

    @property
    def degrees_of_freedom(self) -> int:
        """n, the number of coordinates."""
        return len(self.positions)

    @property
    def x(self) -> Matrix:
        """The positions, n by 1."""
        return Matrix(self.positions)

    @property
    def v(self) -> Matrix:
        """The velocities, n by 1."""
        return Matrix(self.velocities)

    @cached_property
    def slip_velocity(self) -> Matrix:
        """The slip velocities u = U' v, contacts by 1."""
        return Matrix(self.distribution.T * self.v)

    @property
    def slip_position(self) -> Matrix:
        """The slip positions s = U' x, contacts by 1."""
        return Matrix(self.distribution.T * self.x)

    @property
    def input_matrix(self) -> Matrix | NonlinearInput:
        """The input matrix B of g = g₀(x, v) + B(x, v) w, n by inputs, with w the commands.

        If g is not linear in w, a NonlinearInput that names the coordinate and the input.
        """
        static = {w: a.static(w) for w, a in self.actuators.items() if a.lag is None}
        return _input_matrix(_over(self.force, static), self.positions, self.inputs)

    def actuator(self, index: int) -> Actuator:
        """The actuator model of an input; that of a direct input if none is declared."""
        return self.actuators.get(self.inputs[index], Actuator())

    def commanded(self, expression: Any) -> Any:
        """An expression over effective inputs, rewritten over the delayed commands.

        The symbol of an effective input behind a lag or a threshold is kept, since there the effective input is no
        function of the present command, or the command does not follow from it (``Actuator.has_inverse``).
        """
        return _over(expression, {w: a.static(w) for w, a in self.actuators.items() if a.has_inverse})

    def known_friction(self, slip: Matrix) -> Matrix:
        """Friction forces of the declared effects at slip velocities ``slip``, contacts by 1."""
        return Matrix([c.known_force.subs(c.slip, u) for c, u in zip(self.contacts, slip, strict=True)])

    @property
    def declared_force(self) -> Matrix:
        """g without the forces that effects add to it, n by 1."""
        return Matrix([g - self.effect_forces.get(i, 0) for i, g in enumerate(self.force)])

    @cached_property
    def drive_force(self) -> Matrix:
        """g(x, v, w) − g(x, v, 0), n by 1: the part of g due to the inputs."""
        return Matrix(self.force - self.force.subs(dict.fromkeys(self.inputs, 0)))

    @property
    def modelled_force(self) -> Matrix:
        """g − U λ_known, n by 1, with λ_known the friction of declared effects: all forces that are not estimated."""
        return Matrix(self.force - self.distribution * self.known_friction(self.slip_velocity))

    @cached_property
    def equation_error(self) -> Matrix:
        """The equation error g − M a − U λ, n by 1, over x, v, w and accelerations a; zero on a motion of the model.

        w are the delayed commands; for an input behind a lag or a threshold it is the effective input.
        """
        slip = self.slip_velocity
        friction = Matrix([c.force.subs(c.slip, u) for c, u in zip(self.contacts, slip, strict=True)])
        error = self.force - self.mass_matrix * Matrix(self.accelerations) - self.distribution * friction
        return Matrix(self.commanded(error))

    @cached_property
    def contact_coordinates(self) -> tuple[int, ...]:
        """Index, for each contact, of the coordinate on which it acts most: the largest |entry| of its column of U."""
        return tuple(self._largest(self.distribution[:, k]) for k in range(len(self.contacts)))

    @cached_property
    def driven_coordinates(self) -> tuple[int, ...]:
        """Index, for each input, of the coordinate that it drives most: the largest |entry| of ∂g/∂w."""
        return tuple(self._largest(row.diff(w) for row in self.force) for w in self.inputs)

    def _largest(self, entries: Iterable[sympy.Expr]) -> int:
        """Index of the largest |entry| at the declared values; an entry that depends on the state counts as 1."""
        numbers = [sympy.sympify(e).subs(self.values) for e in entries]
        sizes = [abs(float(e)) if e.is_number else 1.0 for e in numbers]
        return sizes.index(max(sizes))

    @property
    def accelerations(self) -> tuple[sympy.Symbol, ...]:
        """Symbols for v'."""
        return tuple(symbol(f"{v.name}_dot") for v in self.velocities)

    def force_unit(self, coordinate: int) -> str:
        """Unit of the generalised force on a coordinate: N for a length, N*m for an angle.

        An exception is a coordinate on which a contact acts directly with friction in another unit, such as A for a
        motor of unknown torque constant: then all forces on the coordinate are in that unit.
        """
        usual = "N" if self.position_units[coordinate] == "m" else "N*m"
        for k, contact in enumerate(self.contacts):
            if abs(self.distribution[coordinate, k]) == 1:
                own, theirs = (dimension(parse_unit(unit, Place(""))) for unit in (contact.unit, usual))
                return usual if own == theirs else contact.unit
        return usual

    def contact_index(self, name: str) -> int:
        """Index of the contact with this name; ValueError if there is none."""
        return [c.name for c in self.contacts].index(name)

    def position_index(self, name: str) -> int:
        """Index of the position with this name; ValueError if there is none."""
        return [x.name for x in self.positions].index(name)

    # Changes that effects make; each method returns a new system.

    def with_parameters(self, values: Mapping[sympy.Symbol, Any], units: Mapping[sympy.Symbol, str]) -> System:
        """Add parameters: symbol → exact value in SI, and symbol → unit."""
        return replace(self, values={**self.values, **values}, units={**self.units, **units})

    def with_force(self, coordinate: int, expression: sympy.Expr) -> System:
        """Add a generalised force to a coordinate, positive in the direction of +x; it acts at the motor of a load."""
        force = self.force.as_mutable()
        force[coordinate] += expression
        added = {**self.effect_forces, coordinate: self.effect_forces.get(coordinate, 0) + expression}
        return replace(self, force=Matrix(force), effect_forces=added)

    def with_inertia(self, coordinate: int, expression: sympy.Expr) -> System:
        """Add an inertia to a coordinate, on the diagonal of M."""
        mass = self.mass_matrix.as_mutable()
        mass[coordinate, coordinate] += expression
        return replace(self, mass_matrix=Matrix(mass))

    def with_level(self, contact: int, expression: sympy.Expr) -> System:
        """Add to a contact's level; ``expression`` is over the contact's slip symbol, positions, inputs and TIME."""
        return self._with_contact(contact, extra_level=self.contacts[contact].extra_level + expression)

    def with_contact_force(self, contact: int, expression: sympy.Expr) -> System:
        """Add to a contact's force λ (positive opposes u > 0)."""
        return self._with_contact(contact, extra_force=self.contacts[contact].extra_force + expression)

    def with_stage(self, index: int, stage: Stage, *parameters: sympy.Expr) -> System:
        """Add a stage to an input's actuator model; the order of the stages is that of ``Actuator``."""
        chain = self.actuator(index).with_stage(stage, *parameters)
        return replace(self, actuators={**self.actuators, self.inputs[index]: chain})

    def with_law(self, contact: int, law: FrictionLaw, parameters: Mapping[str, sympy.Symbol]) -> System:
        """Replace the friction law of a contact."""
        return self._with_contact(contact, law=law, law_parameters=parameters)

    def with_sensor_error(self, coordinate: int, expression: sympy.Expr) -> System:
        """Add an error to a coordinate's sensor: it measures x + ``expression``, a function of the true position x."""
        x = self.positions[coordinate]
        total = self.sensor_errors.get(x, sympy.S.Zero) + expression
        return replace(self, sensor_errors={**self.sensor_errors, x: total})

    def with_transmission(self, transmission: Transmission) -> System:
        """Add a spring between the motor and the load of a coordinate; the load has a share of its inertia."""
        return replace(self, transmissions=(*self.transmissions, transmission))

    def _with_contact(self, index: int, **change: Any) -> System:
        """The system with some fields of a contact changed."""
        contacts = list(self.contacts)
        contacts[index] = replace(contacts[index], **change)
        return replace(self, contacts=tuple(contacts))


def _over(expression: Any, static: Mapping[sympy.Symbol, sympy.Expr]) -> Any:
    """An expression with each effective input replaced by its expression over the command, ``static``."""
    if not static:
        return expression
    if isinstance(expression, sympy.MatrixBase):
        return expression.applyfunc(lambda entry: _over(entry, static))
    # An arm's computed terms contain no input; a substitution would go through all their arguments.
    terms = sympy.Add.make_args(sympy.sympify(expression))
    return sympy.Add(*[t.subs(static, simultaneous=True) if t.has(*static) else t for t in terms])


def _input_matrix(
    force: Any, positions: Sequence[sympy.Symbol], inputs: Sequence[sympy.Symbol]
) -> Matrix | NonlinearInput:
    """B = ∂g/∂w, coordinates by inputs, or the first entry that shows that g(x, v, w) is not linear (affine) in w."""
    slopes = sympy.zeros(len(positions), len(inputs))
    for i, position in enumerate(positions):
        for j, entry in enumerate(inputs):
            slope = force[i].diff(entry)
            if slope.has(*inputs):
                slope = compact(slope)
            if slope.has(*inputs) and sympy.count_ops(slope) <= LONGEST_SLOPE:
                slope = sympy.cancel(slope)  # a quotient in which w cancels
            # a discontinuity in w is not seen in the slope: that of ``sgn`` is zero
            steps = [f for f in force[i].atoms(sympy.Function) if f.has(entry)]
            if slope.has(*inputs) or steps:
                return NonlinearInput(position.name, entry.name, slope)
            slopes[i, j] = slope
    return Matrix(slopes)


def with_loads(system: System) -> System:
    """The system in two-mass form: for each transmission a load coordinate x_load is appended.

    The load has the inertia ρ M_ii, the motor (1 − ρ) M_ii, and the transmission's force acts between them. Declared
    forces on the coordinate that depend on neither velocity nor input, such as gravity, act at the load; forces that
    effects add, such as cogging, act at the motor.
    """
    for transmission in system.transmissions:
        system = _with_load(system, transmission)
    return replace(system, transmissions=())


def _with_load(system: System, transmission: Transmission) -> System:
    """The system with the load coordinate of one transmission."""
    i = transmission.coordinate
    x, v = system.positions[i], system.velocities[i]
    x_load, v_load = symbol(f"{x}_load"), symbol(f"{v}_load")
    share = transmission.load_fraction
    mass = sympy.diag(system.mass_matrix, share * system.mass_matrix[i, i])
    mass[i, i] = (1 - share) * system.mass_matrix[i, i]
    still = system.declared_force[i].subs(dict.fromkeys((*system.inputs, *system.velocities), 0))
    between = transmission.force(x - x_load, v - v_load)
    force = sympy.Matrix([*system.force, still.subs(x, x_load) + between])
    force[i] += -still - between
    return replace(
        system,
        positions=(*system.positions, x_load),
        velocities=(*system.velocities, v_load),
        position_units=(*system.position_units, system.position_units[i]),
        mass_matrix=Matrix(mass),
        force=Matrix(force),
        distribution=Matrix(system.distribution.col_join(sympy.zeros(1, len(system.contacts)))),
    )

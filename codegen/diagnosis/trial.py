"""A model under test: the declared system with effects at their places, and the parameters that a fit estimates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.diagnosis.joint_shooter import JointShooter
from codegen.diagnosis.sensor import Sensors
from codegen.diagnosis.shooting import Record, Shooter, term_symbols
from codegen.diagnosis.structure import Structures, states
from codegen.effects import CATALOGUE, Effect
from codegen.effects.added import added
from codegen.effects.coordinate import Coordinate
from codegen.effects.declare import effect_symbols, places_of
from codegen.effects.register import is_own
from codegen.mechanics.system import System
from codegen.simulate.drive import Chains

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Part:
    """One effect at one place.

    Attributes:
        kind, place, on: as in the catalogue.
        names: of its parameters, in order.
        symbols: of its parameters in the changed System.
        coordinates: transformations of its parameters in a fit.
    """

    kind: str
    place: int
    on: str
    names: tuple[str, ...]
    symbols: tuple[sympy.Symbol, ...]
    coordinates: tuple[Coordinate, ...]

    @cached_property
    def effect(self) -> Effect:
        return CATALOGUE[self.kind].with_parameters(self.names)

    @property
    def form(self) -> str:
        """The parameters that the usual form of the effect does not have, as words; empty for the usual form."""
        kind = CATALOGUE[self.kind]
        usual = {p.name for p in kind.forms[0].parameters}
        return ", ".join(name for name in self.names if name not in usual and len(kind.forms) > 1)

    def inward(self, values: Mapping[str, float]) -> Array:
        """Parameters → the unbounded coordinates of a fit."""
        return np.array([c.inward(values[name]) for name, c in zip(self.names, self.coordinates, strict=True)])

    def outward(self, inner: Array) -> dict[str, float]:
        """The inverse of ``inward``, in the effect's normal form."""
        named = zip(self.names, self.coordinates, inner, strict=True)
        return self.effect.normal_form({name: c.outward(float(q)) for name, c, q in named})


def part_of(effect: Effect, place: int, system: System) -> Part:
    """The part that puts an effect of the catalogue at a place of a system."""
    on = places_of(effect, system)[place]
    names = tuple(p.name for p in effect.parameters)
    symbols = effect_symbols(effect, on, system)
    coordinates = tuple(p.coordinate for p in effect.parameters)
    if is_own(effect.kind):
        added(effect, system, place, symbols, f"{effect.kind} on {on}")
    return Part(effect.kind, place, on, names, tuple(symbols[n] for n in names), coordinates)


@dataclass(frozen=True, eq=False)
class Trial:
    """A system with parts.

    Attributes:
        system: as declared.
        parts: in the order in which they were found.
        moved: friction levels and toleranced parameters, which every fit estimates.
    """

    system: System
    parts: tuple[Part, ...]
    moved: tuple[sympy.Symbol, ...]

    @cached_property
    def changed(self) -> System:
        """The system with all parts; their symbols have placeholder values."""
        system = self.system
        for part in self.parts:
            units = dict.fromkeys(part.symbols, "1")
            system = system.with_parameters({s: sympy.Integer(1) for s in part.symbols}, units)
            system = part.effect.add(system, part.place, dict(zip(part.names, part.symbols, strict=True)))
        return system

    @property
    def symbols(self) -> tuple[sympy.Symbol, ...]:
        """All estimated symbols: levels and toleranced parameters, then those of the parts."""
        return (*self.moved, *(s for part in self.parts for s in part.symbols))

    @cached_property
    def free(self) -> tuple[sympy.Symbol, ...]:
        """The symbols that are arguments of the compiled terms."""
        within = term_symbols(self.changed, self.system)
        return (*self.moved, *(s for part in self.parts for s in part.symbols if s in within))

    @cached_property
    def adds_states(self) -> bool:
        """Whether the last part adds states to the free run; its force then cannot be computed from the log alone."""
        return states(self.changed) > states(replace(self, parts=self.parts[:-1]).changed)

    def with_part(self, part: Part) -> Trial:
        return replace(self, parts=(*self.parts, part))

    def split(self, theta: Array) -> tuple[Array, list[dict[str, float]]]:
        """(values of ``moved``, parameters of each part) from a fit's vector."""
        k, found = len(self.moved), []
        for part in self.parts:
            found.append(part.outward(theta[k : k + len(part.names)]))
            k += len(part.names)
        return theta[: len(self.moved)], found

    def theta(self, moved: Array, parameters: Sequence[Mapping[str, float]]) -> Array:
        """The inverse of ``split``."""
        return np.concatenate([moved, *(p.inward(v) for p, v in zip(self.parts, parameters, strict=True))])

    def numbers(self, theta: Array) -> Array:
        """The values of ``symbols``."""
        moved, found = self.split(theta)
        return np.concatenate([moved, *([v[n] for n in p.names] for p, v in zip(self.parts, found, strict=True))])

    @cached_property
    def chains(self) -> Chains:
        return Chains(self.changed, self.symbols)

    @cached_property
    def sensors(self) -> Sensors:
        return Sensors(self.changed, self.symbols)

    @cached_property
    def structures(self) -> Structures:
        return Structures(self.changed, self.symbols)


@dataclass(frozen=True, eq=False)
class Runner:
    """Free-run simulation of one trial on one record.

    Attributes:
        model: index of the trial in ``shooter``.
    """

    trial: Trial
    shooter: Shooter | JointShooter
    model: int
    record: Record
    substeps: int

    def run(self, theta: Array, offsets: Array, gain: float = 1.0) -> Array:
        """Predicted measurements (S, L, n); each segment starts ``offsets`` (S, 2n) from the smoothed state.

        For an arm whose joints are compared one by one: (S joints, L, 1), with offsets (S joints, 2).

        Args:
            gain: on all inputs.
        """
        trial, record = self.trial, self.record
        numbers = trial.numbers(theta)
        found = self.shooter.run(
            self.model,
            numbers[self._arguments],
            trial.structures.at(numbers),
            record,
            self._drive(numbers) if gain == 1.0 else gain * self._drive(numbers),
            self.substeps,
            trial.sensors.true(record.states, numbers) + record.of_segments(offsets),
        )
        return record.by_row(trial.sensors.measured(found, numbers))

    def hidden(self) -> Array:
        """States that are not logged, as by ``Shooter.hidden``, for the trial without parts."""
        trial, none = self.trial, np.zeros(0)
        structure = trial.structures.at(none)
        assert isinstance(self.shooter, Shooter)  # an arm is never separated here
        return self.shooter.hidden(self.model, none, structure, self.record, self._drive(none), self.substeps)

    @cached_property
    def _arguments(self) -> list[int]:
        """Indices of the compiled code's arguments among the trial's symbols."""
        place = {s: k for k, s in enumerate(self.trial.symbols)}
        return [place[s] for s in self.trial.free]

    def _drive(self, numbers: Array) -> Array:
        record = self.record
        return self.trial.chains.act(record.commands, numbers, record.sample_time, self.substeps)

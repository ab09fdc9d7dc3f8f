"""A model on trial: the declared system with effects at their places, and every number in it that a fit may move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.diagnosis.chain import Chain
from codegen.diagnosis.shooting import Record, Shooter, Structure
from codegen.effects import CATALOGUE, Effect
from codegen.effects.declare import effect_symbols, places_of
from codegen.effects.periodic import PHASE_NAME as PHASE
from codegen.effects.periodic import Periodic
from codegen.mechanics.actuator import Actuator
from codegen.mechanics.system import System

Array = NDArray[np.float64]

CHAIN = {
    "input_delay": {"T": "delay"},
    "input_gain": {"gain": "gain"},
    "dead_zone": {"width": "width"},
    "saturation": {"limit": "limit"},
    "actuator_lag": {"tau": "tau"},
}
"""Effects on an input: parameter → field of ``Chain``."""
STRUCTURE = {
    "presliding": ("sigma",),
    "compliance": ("k", "c", "load_fraction"),
    "backlash": ("gap", "k", "c", "load_fraction"),
}
"""Effects that add states: they have their place in the C of the free runs."""
ROUGH = ("backlash",)
"""Effects whose loss is rough: a load hits the end of its play a sample sooner or later."""
SENSOR = {"encoder_eccentricity": ("amplitude", "period", "phase")}
BETWEEN = ("load_fraction",)
"""Parameters between 0 and 1."""


@dataclass(frozen=True)
class Part:
    """One effect at one place.

    Attributes:
        kind, place, on: as in the catalogue.
        names: of its parameters, in order.
        symbols: of those, where the effect is a change of the System; else empty.
        positive: the parameters that must be positive.
        size: of a wave, the parameter that is found together with its phase; else empty.
    """

    kind: str
    place: int
    on: str
    names: tuple[str, ...]
    symbols: tuple[sympy.Symbol, ...] = ()
    positive: tuple[str, ...] = ()
    size: str = ""

    def inward(self, values: Mapping[str, float]) -> Array:
        """Parameters → the unbounded coordinates of a fit: logarithms of what is positive, logits of shares."""
        return np.array([self._inward(name, values[name]) for name in self.names])

    def outward(self, inner: Array) -> dict[str, float]:
        values = {name: self.outward_one(name, float(q)) for name, q in zip(self.names, inner, strict=True)}
        if self.size:
            flipped = values[self.size] < 0
            values[self.size] = abs(values[self.size])
            values[PHASE] = float((values[PHASE] + (2 if flipped else 1) * np.pi) % (2 * np.pi) - np.pi)
        return values

    @property
    def reach(self) -> Array:
        """How far a fit may go from where it starts: a factor of 150 for what is positive, a fifth for a period."""
        free = [5.0 if name in self.positive or name in BETWEEN else np.inf for name in self.names]
        return np.array([0.2 if name == "period" else r for name, r in zip(self.names, free, strict=True)])

    def _inward(self, name: str, value: float) -> float:
        if name in BETWEEN:
            return float(np.log(value / (1 - value)))
        return float(np.log(value)) if name in self.positive else float(value)

    def outward_one(self, name: str, inner: float) -> float:
        if name in BETWEEN:
            return float(1 / (1 + np.exp(-inner)))
        return float(np.exp(min(inner, 300.0))) if name in self.positive else inner


def part_of(effect: Effect, place: int, system: System) -> Part:
    """The part that puts an effect of the catalogue at a place of a system."""
    on = places_of(effect, system)[place]
    names = tuple(p.name for p in effect.parameters)
    positive = tuple(p.name for p in effect.parameters if p.low == 0.0 and p.neutral in (None, 1.0))
    beside = effect.kind in CHAIN or effect.kind in STRUCTURE or effect.kind in SENSOR
    symbols = () if beside else tuple(effect_symbols(effect, on, system)[n] for n in names)
    size = effect.size if isinstance(effect, Periodic) else ""
    return Part(effect.kind, place, on, names, symbols, positive, size)


@dataclass(frozen=True, eq=False)
class Trial:
    """A system with parts.

    Attributes:
        system: as declared; ``changed`` has the parts that are changes of a System.
        parts: in the order in which they were found.
        moved: friction levels and parameters with a tolerance, which every fit moves.
    """

    system: System
    parts: tuple[Part, ...]
    moved: tuple[sympy.Symbol, ...]

    @cached_property
    def changed(self) -> System:
        system = self.system
        for part in self.parts:
            if part.symbols:
                effect = CATALOGUE[part.kind]
                units = dict.fromkeys(part.symbols, "1")
                system = system.with_parameters({s: sympy.Integer(1) for s in part.symbols}, units)
                effect = effect.with_parameters(part.names)
                system = effect.add(system, part.place, dict(zip(part.names, part.symbols, strict=True)))
        return system

    @property
    def free(self) -> tuple[sympy.Symbol, ...]:
        """The symbols that are arguments of the compiled terms."""
        return (*self.moved, *(s for part in self.parts for s in part.symbols))

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


@dataclass(frozen=True, eq=False)
class Runner:
    """Free runs of one trial on one record.

    Attributes:
        model: of the trial in ``shooter``.
        declared: input → fields of the ``Chain`` that the system itself has.
    """

    trial: Trial
    shooter: Shooter
    model: int
    record: Record
    substeps: int
    declared: Mapping[str, Mapping[str, float]]

    def run(self, theta: Array, offsets: Array, gain: float = 1.0) -> Array:
        """Predicted measurements (S, L, n), the segments started ``offsets`` (S, 2n) off the smoothed state.

        Args:
            gain: on all inputs.
        """
        trial, record = self.trial, self.record
        moved, found = trial.split(theta)
        values = np.concatenate(
            [moved, *([v[n] for n in p.names] for p, v in zip(trial.parts, found, strict=True) if p.symbols)]
        )
        sensors = [(p.place, v) for p, v in zip(trial.parts, found, strict=True) if p.kind in SENSOR]
        states = record.states
        for place, v in sensors:
            states = _true_state(states, place, v)
        positions = self.shooter.run(
            self.model,
            values,
            self._structure(found),
            record,
            gain * self._drive(found),
            self.substeps,
            states + offsets,
        )
        for place, v in sensors:
            positions[..., place] += _wave(positions[..., place], v)
        return positions

    def hidden(self) -> Array:
        """(S, contacts + 2) of the trial without parts: deflection z of each contact, load position and velocity."""
        drive, structure = self._drive(()), declared_structure(self.trial.system)
        return self.shooter.hidden(self.model, np.zeros(0), structure, self.record, drive, self.substeps)

    def _drive(self, found: Sequence[Mapping[str, float]]) -> Array:
        record, columns = self.record, []
        for i, w in enumerate(self.trial.system.inputs):
            fields = dict(self.declared.get(w.name, {}))
            for part, values in zip(self.trial.parts, found, strict=True):
                if part.kind in CHAIN and part.place == i:
                    fields |= _joined(fields, {field: values[name] for name, field in CHAIN[part.kind].items()})
            columns.append(Chain(**fields).act(record.commands[:, i], record.sample_time, self.substeps))
        return np.ascontiguousarray(np.column_stack(columns))

    def _structure(self, found: Sequence[Mapping[str, float]]) -> Structure:
        structure = declared_structure(self.trial.system)
        for part, v in zip(self.trial.parts, found, strict=True):
            if part.kind == "presliding":
                sigma = list(structure.sigma)
                sigma[part.place] = v["sigma"]
                structure = replace(structure, sigma=tuple(sigma))
            elif part.kind in STRUCTURE:
                structure = replace(
                    structure,
                    split=part.place,
                    load_fraction=v["load_fraction"],
                    stiffness=v["k"],
                    damping=v["c"],
                    gap=v.get("gap", 0.0),
                )
        return structure


def declared_structure(system: System) -> Structure:
    """What the system itself has beyond M, g and U λ, in numbers."""

    def number(expression: sympy.Expr) -> float:
        return float(sympy.sympify(expression).subs(system.values))

    sigma = [number(c.law_parameters["sigma"]) if c.law.name == "presliding" else 0.0 for c in system.contacts]
    for t in system.transmissions:
        return Structure(
            tuple(sigma), t.coordinate, number(t.load_fraction), number(t.stiffness), number(t.damping), number(t.gap)
        )
    return Structure(tuple(sigma))


def declared_chain(actuator: Actuator, values: Mapping[sympy.Symbol, float]) -> dict[str, float]:
    """Fields of the ``Chain`` that a system's actuator is, in numbers."""

    def number(expression: sympy.Expr) -> float:
        return float(sympy.sympify(expression).subs(values))

    fields = {"delay": number(actuator.delay), "gain": number(actuator.gain), "width": number(actuator.dead_zone)}
    if actuator.limits:
        fields["limit"] = min(number(limit) for limit in actuator.limits)
    return fields | ({"tau": number(actuator.lag)} if actuator.lag is not None else {})


def _joined(fields: Mapping[str, float], more: Mapping[str, float]) -> dict[str, float]:
    """Two of a kind act one after the other: delays and dead zones add up, gains multiply, the smaller limit holds."""
    sums = {name: fields.get(name, 0.0) + more[name] for name in more if name in ("delay", "width", "tau")}
    gain = {"gain": fields.get("gain", 1.0) * more["gain"]} if "gain" in more else {}
    limit = {"limit": min(fields.get("limit", np.inf), more["limit"])} if "limit" in more else {}
    return sums | gain | limit


def _wave(x: Array, v: Mapping[str, float]) -> Array:
    with np.errstate(invalid="ignore"):  # a run that diverged is counted as such elsewhere
        return np.asarray(v["amplitude"] * np.sin(2 * np.pi * x / v["period"] + v["phase"]))


def _true_state(states: Array, place: int, v: Mapping[str, float]) -> Array:
    """The state that an eccentric encoder measures as ``states``."""
    states, n = states.copy(), states.shape[1] // 2
    measured = states[:, place].copy()
    for _ in range(8):
        states[:, place] = measured - _wave(states[:, place], v)
    slope = 2 * np.pi / v["period"] * v["amplitude"] * np.cos(2 * np.pi * states[:, place] / v["period"] + v["phase"])
    states[:, n + place] /= np.where(np.abs(1 + slope) > 0.2, 1 + slope, 1.0)
    return states

"""Settings of a figure: choices that the thesis does not state, such as noise, sample time, drive and gains.

The statements about a figure are checked in several settings, so that a verdict does not depend on one choice.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import sympy

from codegen.base.arrays import Array
from codegen.base.errors import Place
from codegen.simulate.sensors import Sensors
from codegen.spec.expression import exact_number, parse_expression
from codegen.spec.model import ObserverChoice, Spec, symbol

LEVELS = ("a", "a1", "a2", "a4", "F_c", "F_s")
"""Parameters of friction laws that are levels of force."""


@dataclass(frozen=True)
class Setting:
    """A choice of the conditions that the thesis does not state.

    Attributes:
        name: in words, for the table.
        noise: RMS of the white noise on every measurement, in SI; None for that of the spec.
        hold: time for which a value of the noise is held, s; its bandwidth is then about 0.44/hold. With 0 each sample
            has a value of its own.
        step: sample time of observer and controller, s; None for that of the spec.
        inputs: input → expression of t that drives an open loop, in place of the spec's; None for the spec's own.
        seed: of the noise.
        levels: factor on the machine's friction, in figures that use it.
        delay: samples between an estimate and its use, in figures that use it.
        slower: factor on the time of the reference and on the duration.
        factors: name of a machine's parameter, of an observer's gain or of a parameter of the law that the observer
            assumes → factor on it.
    """

    name: str
    noise: float | None = None
    hold: float = 0.0
    step: float | None = None
    inputs: Mapping[str, str] | None = None
    seed: int = 0
    levels: float = 1.0
    delay: int = 0
    slower: float = 1.0
    factors: Mapping[str, float] = field(default_factory=dict)

    def applied(self, spec: Spec) -> Spec:
        """The spec with this setting's sample time, drive and factors.

        Simulation and observer get the same sample time. Factors on a law's parameters are of the observer's law, so
        that a spec without an observer keeps its laws.
        """
        simulation, there = spec.required_simulation, Place(self.name)
        given = {k: parse_expression(v, there).symbolic({"t": symbol("t")}) for k, v in (self.inputs or {}).items()}
        step = self.step or simulation.sample_time
        late = {symbol("t"): symbol("t") / exact_number(repr(self.slower), there)}
        simulation = replace(
            simulation,
            sample_time=step,
            duration=self.slower * simulation.duration,
            inputs={**simulation.inputs, **given},
            reference={k: v.subs(late) for k, v in simulation.reference.items()},
        )
        parameters = tuple(replace(p, value=self._scaled(p.name, p.value)) for p in spec.parameters)
        spec = replace(spec, simulation=simulation, parameters=parameters)
        choice = spec.observer
        if choice is None:
            return spec
        gains = {k: self._scaled(k, v) for k, v in choice.gains.items()}
        contacts = [
            replace(c, parameters={k: self._scaled(k, v) for k, v in c.parameters.items()}) for c in spec.contacts
        ]
        choice = replace(choice, sample_time=exact_number(repr(step), there), gains=gains)
        return replace(spec, contacts=tuple(contacts), observer=choice)

    def _scaled(self, name: str, value: Any) -> Any:
        """A number, or each number of a list, times the factor of its name; a number may be text."""
        if name not in self.factors:
            return value
        if isinstance(value, list | tuple):
            return [self._scaled(name, part) for part in value]
        there = Place(self.name)
        factor = exact_number(repr(self.factors[name]), there)
        # A gain is kept as the text of a decimal.
        return repr(float(exact_number(value, there) * factor)) if isinstance(value, str) else value * factor

    def sensors(self, spec: Spec, tachometer: bool) -> Sensors:
        """The sensors of an applied spec: the spec's encoder, and the setting's noise on position and velocity."""
        simulation = spec.required_simulation
        given = max(simulation.position_noise.values(), default=0.0)
        rms = np.full(len(spec.positions), given if self.noise is None else self.noise)
        step = np.array([simulation.encoder_step.get(name, 0.0) for name in spec.positions])
        held = max(1, round(self.hold / simulation.sample_time))
        return HeldNoise(rms, step, rms if tachometer else np.zeros_like(rms), tachometer, held)


AS_DRAWN = Setting("as drawn")


@dataclass(frozen=True)
class HeldNoise(Sensors):
    """Sensors whose noise is held for ``held`` samples: the same RMS with less bandwidth."""

    held: int = 1

    def noise(self, count: int, n: int, seed: int) -> tuple[Array, Array]:
        """Noise of positions and velocities, (count, n) each, of which each value is held; see ``Sensors.noise``."""
        positions, velocities = super().noise(count // self.held + 1, n, seed)
        return np.repeat(positions, self.held, axis=0)[:count], np.repeat(velocities, self.held, axis=0)[:count]


def with_observer(spec: Spec, kind: str, gains: Mapping[str, object], velocity: str = "") -> Spec:
    """The spec with another observer at the same sample time; gains as in a spec."""
    choice = spec.required_observer
    other = ObserverChoice(kind, velocity or choice.velocity, dict(gains), choice.sample_time, sympy.S.One)
    return replace(spec, observer=other)


def without_friction(spec: Spec) -> Spec:
    """The spec with a Coulomb level of zero at every contact: a frictionless machine."""
    zero = {"a": exact_number("0", Place("level"))}
    return replace(spec, contacts=tuple(replace(c, law="coulomb", parameters=zero) for c in spec.contacts))


def from_zero(spec: Spec) -> Spec:
    """The spec with every friction level at zero, so that an observer made from it starts without friction."""
    zero = dict.fromkeys(LEVELS, exact_number("0", Place("level")))
    levels = [{name: zero.get(name, value) for name, value in c.parameters.items()} for c in spec.contacts]
    contacts = zip(spec.contacts, levels, strict=True)
    return replace(spec, contacts=tuple(replace(c, parameters=own) for c, own in contacts))

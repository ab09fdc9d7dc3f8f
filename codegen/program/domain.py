"""Guarded level update of a (G)CFO in generated code, and the output that states whether the estimate is in its domain.

While the estimated slip is fast and keeps its sign, the step is that of the observer's equations. Otherwise the level
is held within the range of the true one, so that a chattering sign of v̂ has no effect. For level updates with a
constant sign, the level is evaluated with the sign d of the step that updated it:

    â[k] = z[k] − K_F d[k] û[k],    d[k+1] = g[k] s[k],    z[k+1] = â[k] + g[k] (K_F |û[k]| + h dz_F/dt[k]),

g = 1 where |û| is above the domain's slip speed and s is not −d, else 0; where g = 0, â is clipped to the level's
range. Only abs and sgn are used, which every output language has.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi
import sympy

from codegen.mechanics.casadi_form import to_casadi
from codegen.observers.equations import Domain, Equation, Observer
from codegen.program.lost_sample import held
from codegen.program.model import Block, Field, State
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol


class Guard:
    """Blocks, parameters and states that a domain adds to the program of an observer on one contact."""

    def __init__(self, observer: Observer, domain: Domain, names: dict[sympy.Symbol, Any]) -> None:
        self.observer, self.domain, self.names = observer, domain, names
        system = observer.system
        self.contact, self.position = system.contacts[0], system.positions[0]
        unit, name = self.contact.unit, self.contact.name
        self.parameters = [
            self._field(
                "slip_speed", f"{self.contact.slip_unit}/s", "least slip speed of the domain", domain.slip_speed
            ),
            self._field(f"a_low_{name}", unit, "least level", domain.level[0]),
            self._field(f"a_high_{name}", unit, "largest level", domain.level[1]),
            self._field("settle_samples", "1", "samples until the estimate is in its domain", domain.samples),
        ]
        self.fields = [
            self._field(f"direction_{name}", "1", "sign with which the level was updated, or 0"),
            self._field("samples_slid", "1", "samples since the level is updated, counted up to settle_samples"),
        ]
        if domain.innovation is not None:
            length = system.position_units[0]
            self.parameters.append(
                self._field("largest_innovation", length, "of the measured position, in the domain", domain.innovation)
            )
            self.fields.append(self._field(f"{self.position}_predicted", length, "position predicted for this sample"))

    def level(self, equation: Equation) -> list[Block]:
        """The blocks that replace the equation of the level estimate."""
        assert self.observer.cascade is not None
        slip, sign = (next(e for e in self.observer.equations if e.name == n) for n in ("slip_velocity", "slip_sign"))
        self.slip, self.sign, self.gain = slip.symbols[0], sign.symbols[0], self.observer.cascade.gain[0, 0]
        state, estimate, unit = (equation.state or [None])[0], equation.symbols[0], self.contact.unit
        speed, low, high = (symbol(n) for n in ("slip_speed", *(f"a_{e}_{self.contact.name}" for e in ("low", "high"))))
        direction = symbol(f"direction_{self.contact.name}")
        learning, read = symbol("learning"), symbol(f"a_read_{self.contact.name}")
        turned = self.sign * direction
        fast = _above(Magnitude(self.slip) - speed)
        kept = 1 - (Magnitude(turned) - turned) / 2
        cut = (low + high + Magnitude(read - low) - Magnitude(read - high)) / 2
        return [
            self._block("learning", learning, fast * kept, "1", "1 where the level is learnt"),
            self._block("level_read", read, state - self.gain * direction * self.slip, unit, "(4.11)"),
            self._block(equation.name, estimate, read + (1 - learning) * (cut - read), unit, equation.source, True),
        ]

    def verdict(self, period: Field) -> list[Block]:
        """Whether this sample's estimate is in the domain; to be called when all estimates are known."""
        slid, least, inside = symbol("samples_slid"), symbol("settle_samples"), symbol("learning")
        blocks = []
        if self.domain.innovation is not None:
            predicted, largest = symbol(f"{self.position}_predicted"), symbol("largest_innovation")
            calm = 1 - _above(Magnitude(self.position - predicted) - largest)
            blocks.append(self._block("calm", symbol("calm"), calm, "1", "1 where the innovation is small"))
            inside *= symbol("calm")
        counted = (slid + 1 + least - Magnitude(slid + 1 - least)) / 2
        estimate = self.observer.equations[0].symbols[0]
        following = [symbol("learning") * self.sign, inside * counted, self.position + symbol("h") * estimate]
        names = {**self.names, symbol("h"): period.symbol}
        way = period.symbol * next(iter(held([estimate]).values()))  # h v̂ with the velocity estimate that is held
        zero, x = casadi.SX(0), self.names[self.position]
        kept = [f.symbol for f in self.fields]
        initial, carried, resumed = [zero, zero, x], [kept[0], zero, kept[-1] + way], [zero, zero, x + way]
        self.states = [
            State(f, to_casadi(e, names), *values)
            for f, e, *values in zip(self.fields, following, initial, carried, resumed, strict=False)
        ]
        settled = _above(slid - least + sympy.Rational(1, 2))
        source = "1 where the certificate's bound holds, if its assumptions do"
        return [*blocks, self._block("in_domain", symbol("in_domain"), inside * settled, "1", source, True)]

    def guarded(self, states: list[State], rates: Any, period: Field) -> list[State]:
        """The observer's states with the guarded level among them, and those of the guard.

        Args:
            rates: SX of dz/dt, a row a state.
        """
        level = next(e for e in self.observer.equations if e.name == "friction_level")
        assert level.state is not None
        at = list(self.observer.states).index(level.state[0])
        learnt = to_casadi(self.gain * Magnitude(self.slip), self.names) + period.symbol * rates[at]
        following = self.names[level.symbols[0]] + self.names[symbol("learning")] * learnt
        resumed = held(level.symbols)[level.symbols[0]]  # without direction (d = 0)
        changed = replace(states[at], following=following, resumed=resumed)
        return [*states[:at], changed, *states[at + 1 :], *self.states]

    def _field(self, name: str, unit: str, meaning: str, value: Any = None) -> Field:
        field = Field(name, unit, meaning, None if value is None else float(value))
        self.names[symbol(name)] = field.symbol
        return field

    def _block(
        self, name: str, element: sympy.Symbol, expression: Any, unit: str, source: str, output: bool = False
    ) -> Block:
        block = Block(name, (element.name,), to_casadi(expression, self.names), (unit,), source, output)
        self.names[element] = block.symbols
        return block


def _above(difference: Any) -> Any:
    """1 where a number is above zero, else 0."""
    return (Sgn(difference) + Magnitude(Sgn(difference))) / 2

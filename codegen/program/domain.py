"""Conditional update of the friction level of a (G)CFO, and the flag that says whether the estimate is in its domain.

While the estimated slip velocity û is large and keeps its sign s, the step is that of the observer's equations, with
â = z − K_F |û|. Otherwise the level is held, clipped to the range of the true one, so that a chattering sign of v̂ has
no effect. A step therefore stores the sign d with which it updated the level, and the next one evaluates |û| as d û:

    â[k] = z[k] − K_F d[k] û[k],    d[k+1] = g[k] s[k],    z[k+1] = â[k] + g[k] (K_F |û[k]| + h dz_F/dt[k]),

g = 1 (the level is updated) where |û| is above the domain's slip speed, s is not −d and r = 0, else 0 (it is held).
After a step with g = 0, d is 0 and z is â itself. r counts down to 0, r[k+1] = max(r[k] − 1, 0), from R at the start
and after invalid samples. There the velocity may be far from its estimate: the level is held for R samples, in which
the error of û decays whatever the level is (certify/bound/domain_bound.py).

Every output language has abs and sgn, and step code without branches runs in SIMD lanes too. Hence
1{x > 0} = (sgn x + |sgn x|)/2, min(x, c) = (x + c − |x − c|)/2, and x clipped to low…high is
(low + high + |x − low| − |x − high|)/2.
"""

from dataclasses import replace
from typing import Any

import casadi
import sympy

from codegen.mechanics.casadi_form import to_casadi
from codegen.observers.equations import Domain, Equation, Observer
from codegen.program.invalid_samples import held_outputs
from codegen.program.model import Block, Field, State
from codegen.spec.functions import Magnitude, Sgn
from codegen.spec.model import symbol


class Guard:
    """Blocks, parameters and states that a domain adds to the program of an observer with one contact.

    The methods are called in the order ``level``, ``verdict``, ``guarded``: each uses symbols that the one before adds.
    """

    def __init__(self, observer: Observer, domain: Domain, names: dict[sympy.Symbol, Any]) -> None:
        """The guard's parameters and states, whose SX are added to ``names``, those of the program so far."""
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
            self._field("restart_samples", "1", "samples in which the level is held at a start", domain.restart),
        ]
        self.fields = [
            self._field(f"direction_{name}", "1", "sign with which the level was updated, or 0"),
            self._field("samples_held", "1", "samples for which the level is held after a start"),
            self._field("samples_slid", "1", "samples since the level is updated, counted up to settle_samples"),
        ]
        if domain.innovation is not None:
            length = system.position_units[0]
            self.parameters.append(
                self._field("largest_innovation", length, "of the measured position, in the domain", domain.innovation)
            )
            self.fields.append(self._field(f"{self.position}_predicted", length, "position predicted for this sample"))

    def level(self, equation: Equation) -> list[Block]:
        """The blocks of g, of â before clipping and of â; they replace the equation of the level estimate."""
        assert self.observer.cascade is not None
        by_name = {e.name: e for e in self.observer.equations}
        self.slip, self.sign = by_name["slip_velocity"].symbols[0], by_name["slip_sign"].symbols[0]
        self.gain = self.observer.cascade.gain[0, 0]
        state, estimate, unit = (equation.state or [None])[0], equation.symbols[0], self.contact.unit
        name = self.contact.name
        slip_speed, low, high = symbol("slip_speed"), symbol(f"a_low_{name}"), symbol(f"a_high_{name}")
        direction, updated, level = symbol(f"direction_{name}"), symbol("learning"), symbol(f"a_read_{name}")
        same_sign = self.sign * direction  # −1 after a reversal, 0 where the level was held, else 1
        is_fast = _above_zero(Magnitude(self.slip) - slip_speed)
        not_reversed = 1 - (Magnitude(same_sign) - same_sign) / 2
        restarted = 1 - _is_at_least(symbol("samples_held"), 1)
        clipped = (low + high + Magnitude(level - low) - Magnitude(level - high)) / 2
        chosen = level + (1 - updated) * (clipped - level)
        return [
            self._block("learning", updated, is_fast * not_reversed * restarted, "1", "1 where the level is learnt"),
            self._block("level_read", level, state - self.gain * direction * self.slip, unit, "(4.11)"),
            self._block(equation.name, estimate, chosen, unit, equation.source, True),
        ]

    def verdict(self, period: Field) -> list[Block]:
        """The blocks of the flag ``in_domain``: whether this sample's estimate is in the domain.

        In the domain, the level is updated, and the innovation |x − (x + h v̂) of the sample before| is small where the
        domain bounds it, in this sample and in the ``settle_samples`` before. Called when all estimates have symbols.
        """
        samples, needed, inside = symbol("samples_slid"), symbol("settle_samples"), symbol("learning")
        blocks = []
        if self.domain.innovation is not None:
            predicted, largest = symbol(f"{self.position}_predicted"), symbol("largest_innovation")
            calm = 1 - _above_zero(Magnitude(self.position - predicted) - largest)
            blocks.append(self._block("calm", symbol("calm"), calm, "1", "1 where the innovation is small"))
            inside *= symbol("calm")
        settled = _is_at_least(samples, needed)
        velocity = self.observer.equations[0].symbols[0]
        names = {**self.names, symbol("h"): period.symbol}
        held_step = period.symbol * next(iter(held_outputs([velocity]).values()))  # h v̂ of the held velocity estimate
        zero, x = casadi.SX(0), self.names[self.position]
        restart, predicted_now = self.names[symbol("restart_samples")], self.fields[-1].symbol
        # In the order of the fields; without a bound on the innovation there is no fourth one, and zip leaves it out.
        direction, left = symbol("learning") * self.sign, symbol("samples_held")
        following = [
            direction,
            left - _is_at_least(left, 1),
            inside * (samples + 1 - settled),
            self.position + symbol("h") * velocity,
        ]
        initial = [zero, restart, zero, x]
        predicted = [zero, restart, zero, predicted_now + held_step]
        resumed = [zero, restart, zero, x + held_step]
        self.states = [
            State(field, to_casadi(expression, names), *values)
            for field, expression, *values in zip(self.fields, following, initial, predicted, resumed, strict=False)
        ]
        source = "1 where the certificate's bound holds, if its assumptions do"
        return [*blocks, self._block("in_domain", symbol("in_domain"), inside * settled, "1", source, True)]

    def guarded(self, states: list[State], rates: Any, period: Field) -> list[State]:
        """The observer's states, z of the level with the conditional update, then the guard's own."""
        level = next(e for e in self.observer.equations if e.name == "friction_level")
        assert level.state is not None
        index = list(self.observer.states).index(level.state[0])
        update = to_casadi(self.gain * self.sign * self.slip, self.names) + period.symbol * rates[index]
        sign, direction = self.names[self.sign], self.states[0].following
        following = self.names[level.symbols[0]] + casadi.substitute(update, sign, direction)  # it is linear in s
        last = held_outputs(level.symbols)[level.symbols[0]]  # z = â, since d is 0 after invalid samples
        guarded = replace(states[index], following=following, predicted=last, resumed=last)
        return [*states[:index], guarded, *states[index + 1 :], *self.states]

    def _field(self, name: str, unit: str, meaning: str, value: Any = None) -> Field:
        """A field of a generated struct; its SX is added to ``names``."""
        field = Field(name, unit, meaning, None if value is None else float(value))
        self.names[symbol(name)] = field.symbol
        return field

    def _block(
        self, name: str, element: sympy.Symbol, expression: Any, unit: str, source: str, output: bool = False
    ) -> Block:
        """A block of one element; its SX is added to ``names``."""
        block = Block(name, (element.name,), to_casadi(expression, self.names), (unit,), source, output)
        self.names[element] = block.symbols
        return block


def _is_at_least(count: Any, least: Any) -> Any:
    """1 where a whole number is at least another, else 0; the half keeps the sign away from 0."""
    return (1 + Sgn(count - least + sympy.Rational(1, 2))) / 2


def _above_zero(number: Any) -> Any:
    """1 where a number is above zero, else 0."""
    return (Sgn(number) + Magnitude(Sgn(number))) / 2

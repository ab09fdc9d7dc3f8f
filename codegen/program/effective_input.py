"""Actuator chain of an input in generated code: past samples and a lag are states, the effective input is a block."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi
import sympy

from codegen.base.errors import BadInput
from codegen.mechanics.actuator import decayed
from codegen.mechanics.casadi_form import to_casadi
from codegen.observers.equations import Observer
from codegen.program.model import Block, Field

LONGEST_DELAY = 1000


@dataclass(frozen=True)
class EffectiveInput:
    """Additions of an actuator chain to a program; states, next_state and initial correspond to each other."""

    blocks: tuple[Block, ...] = ()
    states: tuple[Field, ...] = ()
    next_state: tuple[Any, ...] = ()
    initial: tuple[Any, ...] = ()


def effective_input(
    observer: Observer, index: int, command: Field, period: Field, names: dict[sympy.Symbol, Any]
) -> EffectiveInput:
    """The mean effective input over the coming sample; it replaces the input's symbol in ``names``.

    The command is held between samples, so over [t_k, t_k+1) a delayed command has two values. A lag is integrated
    exactly; after a fractional delay, for the mean of the two. Before the first sample its command is assumed to have
    been held.

    Raises:
        BadInput: if the delay is longer than ``LONGEST_DELAY`` samples.
    """
    system = observer.system
    w, chain = system.inputs[index], system.actuator(index)
    if w not in system.actuators:
        return EffectiveInput()

    def static(value: Any) -> Any:
        return to_casadi(chain.static(w), {**names, w: value})

    whole, share = _samples(observer, w, chain.delay)
    past = [
        Field(f"{w}_past_{k}", command.unit, f"{w} of {k} samples before", casadi.SX.sym(f"{w}_past_{k}"))
        for k in range(1, whole + (2 if share else 1))
    ]
    line = [f.symbol for f in (command, *past)]
    driven = static(line[whole])
    if share:
        driven = (1 - float(share)) * driven + float(share) * static(line[whole + 1])
    states, next_state, initial = [*past], line[:-1], [command.symbol for _ in past]
    blocks = []
    if chain.lag is not None:
        lagging = casadi.SX.sym(f"{w}_driven")
        blocks.append(_block(f"{w}_driven", "input_before_lag", lagging, driven, command.unit, _words(chain.delay, w)))
        fields = [_lagged(w, command.unit, k + 1, chain.order) for k in range(chain.order)]
        steps = to_casadi(chain.lag, names) / period.symbol
        decay = casadi.exp(-1 / steps)
        errors = [lag.symbol - lagging for lag in fields]
        left = decayed(errors, 1 / steps, decay)
        if len(fields) == 1:
            driven = lagging + errors[0] * (steps * (1 - decay))
        else:
            driven = lagging + steps * sum(before - after for before, after in zip(errors, left, strict=True))
        states += fields
        next_state += [lagging + error for error in left]
        initial += [static(command.symbol) for _ in fields]
    symbol = casadi.SX.sym(f"{w}_effective")
    source = "mean over the sample" if chain.lag is not None else _words(chain.delay, w)
    blocks.append(_block(f"{w}_effective", "effective_input", symbol, driven, command.unit, source))
    names[w] = symbol
    return EffectiveInput(tuple(blocks), tuple(states), tuple(next_state), tuple(initial))


def held_input(observer: Observer, index: int, command: Field, names: dict[sympy.Symbol, Any]) -> EffectiveInput:
    """The input held since the last sample, which moved the machine to the present measurement.

    It is the effective input; at the first sample, that of a command held for long.
    """
    w, chain = observer.system.inputs[index], observer.system.actuator(index)
    settled = to_casadi(chain.static(w), {**names, w: command.symbol})
    field = Field(f"{w}_held", command.unit, f"{w} since the sample before", casadi.SX.sym(f"{w}_held"))
    now, names[w] = names[w], field.symbol
    return EffectiveInput((), (field,), (now,), (settled,))


def _lagged(w: sympy.Symbol, unit: str, place: int, order: int) -> Field:
    """The state of one of so many equal lags in series."""
    name = f"{w}_lagged" if order == 1 else f"{w}_lagged_{place}"
    words = f"{w} behind its lag" if order == 1 else f"{w} behind lag {place} of {order}"
    return Field(name, unit, words, casadi.SX.sym(name))


def _block(element: str, name: str, symbol: Any, expression: Any, unit: str, source: str) -> Block:
    return Block(name, (element,), symbol, expression, (unit,), source)


def _words(delay: Any, w: sympy.Symbol) -> str:
    return f"{w}(t - T)" if delay != 0 else "declared effects"


def _samples(observer: Observer, w: sympy.Symbol, delay: Any) -> tuple[int, Any]:
    """A delay in whole samples and the remaining share of a sample."""
    values: Mapping[sympy.Symbol, Any] = observer.system.values
    ratio = sympy.Rational(delay.subs(values)) / observer.sample_time
    whole = int(sympy.floor(ratio))
    if whole > LONGEST_DELAY:
        where, found = f"effect input_delay on {w}", f"a delay of {whole} samples"
        raise BadInput(where, found, f"at most {LONGEST_DELAY}", about=f"input_delay_{w}_T", code="SPEC007")
    return whole, ratio - whole

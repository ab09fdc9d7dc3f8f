"""Sensor and actuator models in the generated code: the true position and the effective input.

The true position is the reading without the sensor's error, the effective input the command after delay and lag. Both
are blocks that replace the symbols; past samples and lags are states.
"""

from typing import Any

import casadi
import sympy

from codegen.base.errors import BadInput
from codegen.mechanics.actuator import decayed
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.system import System
from codegen.observers.equations import Observer
from codegen.program.model import Block, Field, State

LONGEST_DELAY = 1000
"""In samples."""
STEPS = 4
"""Newton steps; with |η'| < 1/2, required by the catalogue, the remaining error is below 1e-13 of the period."""


def true_positions(system: System, names: dict[sympy.Symbol, Any]) -> list[Block]:
    """Blocks of the true positions x, from x_measured = x + η(x), for each sensor with an error η.

    Newton's method, with the initial guess x_measured − η(x_measured). x replaces the reading in ``names``.
    """
    blocks = []
    for x, unit in zip(system.positions, system.position_units, strict=True):
        error = system.sensor_errors.get(x)
        if error is None:
            continue
        reading, slope = names[x], error.diff(x)
        found = reading - to_casadi(error, names)
        for _ in range(STEPS):
            here = {**names, x: found}
            found = found - (found + to_casadi(error, here) - reading) / (1 + to_casadi(slope, here))
        blocks.append(Block("true_position", (f"{x}_true",), found, (unit,), "x_measured = x + eta(x)"))
        names[x] = blocks[-1].symbols
    return blocks


def effective_input(
    observer: Observer, index: int, command: Field, period: Field, names: dict[sympy.Symbol, Any]
) -> tuple[list[Block], list[State]]:
    """Blocks and states of the effective input, averaged over [t_k, t_k+1); it replaces the command in ``names``.

    The command is held between samples, so a command delayed by a fraction of a sample has two values in that interval.
    A lag is integrated exactly, for the mean of the two. The command is assumed constant before the first sample.
    Raises BadInput if the delay is longer than ``LONGEST_DELAY`` samples.
    """
    system = observer.system
    w, chain = system.inputs[index], system.actuator(index)
    if w not in system.actuators:
        return [], []

    def static(value: Any) -> Any:
        return to_casadi(chain.static(w), {**names, w: value})

    def block(element: str, name: str, expression: Any, source: str) -> Block:
        return Block(name, (element,), expression, (command.unit,), source)

    whole, share = _samples(observer, w, chain.delay)
    count = whole + (1 if share else 0)
    past = [Field(f"{w}_past_{k}", command.unit, f"{w} of {k} samples before") for k in range(1, count + 1)]
    line = [f.symbol for f in (command, *past)]
    driven = static(line[whole])
    if share:
        driven = (1 - float(share)) * driven + float(share) * static(line[whole + 1])
    states = [State(f, before, command.symbol, f.symbol) for f, before in zip(past, line, strict=False)]
    blocks, source = [], f"{w}(t - T)" if chain.delay != 0 else "declared effects"
    if chain.lag is not None:
        blocks.append(block(f"{w}_driven", "input_before_lag", driven, source))
        source, lagging = "mean over the sample", blocks[0].symbols
        fields = [_lagged(w, command.unit, k + 1, chain.order) for k in range(chain.order)]
        steps = to_casadi(chain.lag, names) / period.symbol
        decay = casadi.exp(-1 / steps)
        errors = [lag.symbol - lagging for lag in fields]
        left = decayed(errors, 1 / steps, decay)
        if len(fields) == 1:
            driven = lagging + errors[0] * (steps * (1 - decay))
        else:
            driven = lagging + steps * sum(before - after for before, after in zip(errors, left, strict=True))
        states += [
            State(f, lagging + error, static(command.symbol), f.symbol) for f, error in zip(fields, left, strict=True)
        ]
    blocks.append(block(f"{w}_effective", "effective_input", driven, source))
    names[w] = blocks[-1].symbols
    return blocks, states


def held_input(observer: Observer, index: int, command: Field, names: dict[sympy.Symbol, Any]) -> State:
    """State with the effective input of the last sample, which led to the present measurement.

    At the first sample: the effective input after a constant command.
    """
    w, chain = observer.system.inputs[index], observer.system.actuator(index)
    settled = to_casadi(chain.static(w), {**names, w: command.symbol})
    field = Field(f"{w}_held", command.unit, f"{w} since the sample before")
    now, names[w] = names[w], field.symbol
    return State(field, now, settled, field.symbol)


def _lagged(w: sympy.Symbol, unit: str, place: int, order: int) -> Field:
    """The state of the lag at ``place`` in a series of ``order`` equal first-order lags."""
    if order == 1:
        return Field(f"{w}_lagged", unit, f"{w} behind its lag")
    return Field(f"{w}_lagged_{place}", unit, f"{w} behind lag {place} of {order}")


def _samples(observer: Observer, w: sympy.Symbol, delay: Any) -> tuple[int, Any]:
    """A delay as a number of whole samples, and the remaining fraction of a sample."""
    ratio = sympy.Rational(delay.subs(observer.system.values)) / observer.sample_time
    whole = int(sympy.floor(ratio))
    if whole > LONGEST_DELAY:
        where, found = f"effect input_delay on {w}", f"a delay of {whole} samples"
        raise BadInput(where, found, f"at most {LONGEST_DELAY}", about=f"input_delay_{w}_T", code="SPEC007")
    return whole, ratio - whole

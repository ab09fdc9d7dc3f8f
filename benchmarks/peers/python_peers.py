"""The two masses' step in Python: our twin, floats, numpy, SymPy's lambdify, numba; each runs over rows of inputs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import sympy

from benchmarks.measure.build import Missing
from benchmarks.model import NUDGE, Model
from benchmarks.peers import two_mass_by_hand as by_hand
from codegen.spec.functions import Magnitude, Sgn
from tests.twin import load_twin

Run = Callable[[np.ndarray], list[Any]]
"""From rows of inputs to the outputs of every step, in whatever form the peer gives them."""


def first(rows: np.ndarray) -> list[float]:
    """The state that every peer begins with."""
    start = [-10.0 * rows[0][0], -10.0 * rows[0][1], 10.0, 20.0]
    return [float(v) + NUDGE * (k + 1) for k, v in enumerate(start)]


def twin(model: Model) -> Run:
    """Our twin; a new object of inputs and of outputs each step."""
    module = load_twin(model.files()["__init__.py"], model.name)

    def run(rows: np.ndarray) -> list[Any]:
        parameters, state = module.Parameters(), module.State(*first(rows))
        return [module.step(state, parameters, module.Inputs(*row), module.Outputs()) for row in rows.tolist()]

    return run


def floats(model: Model) -> Run:
    def run(rows: np.ndarray) -> list[Any]:
        state, found = first(rows), []
        for row in rows.tolist():
            outputs = [0.0] * 8
            by_hand.scalar_step(state, by_hand.CONSTANTS, row, outputs)
            found.append(outputs)
        return found

    return run


def numba_step(model: Model) -> Run:
    """Called from Python at every step. Raises Missing where numba is not installed."""
    step = compiled(by_hand.scalar_step)

    def run(rows: np.ndarray) -> list[Any]:
        state, found = np.array(first(rows)), []
        for row in rows:
            outputs = np.empty(8)
            step(state, by_hand.CONSTANTS, row, outputs)
            found.append(outputs)
        return found

    return run


def numba_loop(model: Model) -> Run:
    """The whole loop compiled too. Raises Missing where numba is not installed."""
    step = compiled(by_hand.scalar_step)

    @compiled
    def loop(state: Any, constants: Any, rows: Any, outputs: Any) -> None:
        for k in range(rows.shape[0]):
            step(state, constants, rows[k], outputs[k])

    def run(rows: np.ndarray) -> list[Any]:
        outputs = np.zeros((len(rows), 8))
        loop(np.array(first(rows)), by_hand.CONSTANTS, rows, outputs)
        return [outputs]

    return run


def compiled(function: Any) -> Any:
    """A function compiled by numba. Raises Missing where numba is not installed."""
    try:
        import numba
    except ImportError:
        raise Missing("not installed: `pip install numba`") from None
    return numba.njit(function)


def vectors(model: Model) -> Run:
    def run(rows: np.ndarray) -> list[Any]:
        start = np.array(first(rows))
        z_v, z, found = start[:2], start[2:], []
        for row in rows:
            z_v, z, outputs = by_hand.vector_step(z_v, z, row[:2], row[2])
            found.append(outputs)
        return found

    return run


def lambdified(model: Model) -> Run:
    """The observer's equations put into each other, and SymPy's lambdify with its elimination of subexpressions."""
    observer = model.observer
    values: dict[Any, Any] = {s: float(v) for s, v in observer.values.items()}
    for equation in observer.equations:
        expression = equation.expression.subs(values)
        if equation.form == "mass_solve":
            expression = observer.system.mass_matrix.subs(values).inv() * expression
        values |= dict(zip(equation.symbols, expression, strict=True))
    rates = observer.rates.subs(values)
    following = [z + float(observer.sample_time) * rates[i] for i, z in enumerate(observer.states)]
    by_name = {s.name: e for s, e in values.items()}
    inputs = [*observer.system.positions, *observer.system.inputs]
    words = {Sgn.__name__: lambda u: (u > 0) - (u < 0), Magnitude.__name__: abs}
    results = following + [by_name[name] for name in model.output_names]
    step = sympy.lambdify([*observer.states, *inputs], results, modules=[words, "math"], cse=True)
    states = len(following)

    def run(rows: np.ndarray) -> list[Any]:
        state, found = first(rows), []
        for row in rows.tolist():
            result = step(*state, *row)
            state = result[:states]
            found.append(result[states:])
        return found

    return run


def as_table(found: list[Any], names: tuple[str, ...]) -> np.ndarray:
    """The outputs of a run as an array, (samples, outputs)."""
    plain = [[getattr(o, name) for name in names] if hasattr(o, "__slots__") else o for o in found]
    return np.array(plain, dtype=float).reshape(-1, len(names))

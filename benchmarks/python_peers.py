"""The two masses' step in Python: our twin, floats, numpy, SymPy's lambdify, numba; each a function from rows to outputs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import sympy

from benchmarks.model import NUDGE, Model
from benchmarks.peer import Missing
from benchmarks.peers import two_mass_python as by_hand
from codegen.replay.twin import load_twin
from codegen.spec.functions import Magnitude, Sgn

Run = Callable[[np.ndarray], np.ndarray]


def first(rows: np.ndarray) -> list[float]:
    """The state that every peer begins with."""
    start = [-10.0 * rows[0][0], -10.0 * rows[0][1], 10.0, 20.0]
    return [float(v) + NUDGE * (k + 1) for k, v in enumerate(start)]


def twin(model: Model) -> Run:
    module = load_twin(model.files()["__init__.py"], model.name)
    names = model.output_names

    def run(rows: np.ndarray) -> np.ndarray:
        parameters, outputs = module.Parameters(), module.Outputs()
        inputs = [module.Inputs(*row) for row in rows.tolist()]
        state = module.State(*first(rows))
        found = []
        for row in inputs:
            module.step(state, parameters, row, outputs)
            found.append([getattr(outputs, name) for name in names] if run.record else None)  # type: ignore[attr-defined]
        return np.array(found, dtype=float) if run.record else rows  # type: ignore[attr-defined]

    run.record = True  # type: ignore[attr-defined]
    return run


def _stepped(step: Any, constants: Any, convert: Callable[[Any], Any]) -> Run:
    def run(rows: np.ndarray) -> np.ndarray:
        state, outputs = convert(first(rows)), convert([0.0] * 8)
        table = rows.tolist() if isinstance(state, list) else rows
        found = []
        for row in table:
            step(state, constants, row, outputs)
            if run.record:  # type: ignore[attr-defined]
                found.append(list(outputs))
        return np.array(found)

    run.record = True  # type: ignore[attr-defined]
    return run


def floats(model: Model) -> Run:
    return _stepped(by_hand.scalar_step, by_hand.CONSTANTS, list)


def numba_step(model: Model) -> Run:
    """Called from Python at every step.

    Raises:
        Missing: where numba is not installed.
    """
    return _stepped(compiled(), by_hand.CONSTANTS, np.array)


def compiled() -> Any:
    """The step of floats, compiled by numba."""
    try:
        import numba
    except ImportError:
        raise Missing("not installed: `pip install numba`") from None
    return numba.njit(by_hand.scalar_step)


def numba_loop(model: Model) -> Run:
    """The whole loop compiled too.

    Raises:
        Missing: where numba is not installed.
    """
    step = compiled()
    import numba

    @numba.njit
    def loop(state: Any, constants: Any, rows: Any, outputs: Any) -> None:
        for k in range(rows.shape[0]):
            step(state, constants, rows[k], outputs[k])

    def run(rows: np.ndarray) -> np.ndarray:
        outputs = np.zeros((len(rows), 8))
        loop(np.array(first(rows)), by_hand.CONSTANTS, rows, outputs)
        return outputs

    return run


def vectors(model: Model) -> Run:
    def run(rows: np.ndarray) -> np.ndarray:
        start = np.array(first(rows))
        z_v, z, found = start[:2], start[2:], []
        for row in rows:
            z_v, z, outputs = by_hand.vector_step(z_v, z, row[:2], row[2])
            found.append(outputs)
        return np.array(found)

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
    outputs = [by_name[name] for name in model.output_names]
    inputs = [*observer.system.positions, *observer.system.inputs]
    words = {"Sgn": lambda u: (u > 0) - (u < 0), "Magnitude": abs}
    words |= {Sgn.__name__: words["Sgn"], Magnitude.__name__: abs}
    step = sympy.lambdify([*observer.states, *inputs], following + outputs, modules=[words, "math"], cse=True)

    def run(rows: np.ndarray) -> np.ndarray:
        state, found = first(rows), []
        for row in rows.tolist():
            result = step(*state, *row)
            state = result[:4]
            found.append(result[4:])
        return np.array(found)

    return run

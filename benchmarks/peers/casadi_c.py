"""The step as one CasADi function, from the observer's equations, and the C that CasADi writes for it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi

from benchmarks.measure.build import Peer
from benchmarks.model import NUDGE, Model
from benchmarks.text import render
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.solve import factorised

SOLVERS: dict[str, Callable[[Any, Any], Any]] = {
    "solve": casadi.solve,
    "ldl": lambda mass, right: factorised(mass).solve(right),
}
"""CasADi's own; and our unrolled LDLᵀ handed to it as expressions."""
NAME, INTEGER = "casadi_step", "long long"


@dataclass(frozen=True)
class Step:
    """(state, inputs[, parameters]) → (next state, outputs), as SX; ``baked``: whether parameters are numbers in it."""

    state: Any
    inputs: Any
    parameters: Any
    next_state: Any
    outputs: Any
    baked: bool = False

    def function(self, **options: Any) -> Any:
        arguments = [self.state, self.inputs] if self.baked else [self.state, self.inputs, self.parameters]
        return casadi.Function(NAME, arguments, [self.next_state, self.outputs], options)


def step_of(model: Model, solver: str = "solve", baked: bool = False) -> Step:
    """The step, built as a user of CasADi would: equations in order, M a = r by ``solver``."""
    program, observer = model.program, model.observer
    fields = (*program.parameters, *program.states, *program.inputs)
    symbols = {f.name: casadi.SX(f.value) if baked and f.value is not None else casadi.SX.sym(f.name) for f in fields}
    system = observer.system
    known = [*observer.values, *observer.states, *system.positions, *system.velocities, *system.inputs]
    numbers = {s.name: float(v) for s, v in observer.values.items()}
    names: dict[Any, Any] = {s: symbols.get(s.name, numbers.get(s.name, 0.0)) for s in known}
    parts: dict[str, Any] = {}
    for equation in observer.equations:
        value = casadi.densify(to_casadi(equation.expression, names))
        if equation.form == "mass_solve":
            value = casadi.densify(SOLVERS[solver](to_casadi(system.mass_matrix, names), value))
        split = casadi.vertsplit(value) if value.shape[0] > 1 else [value]
        names.update(zip(equation.symbols, split, strict=True))
        parts |= {s.name: part for s, part in zip(equation.symbols, split, strict=True)}
    rates = to_casadi(observer.rates, names)
    state, inputs, parameters = (
        casadi.vertcat(*[symbols[f.name] for f in part])
        for part in (program.states, program.inputs, program.parameters)
    )
    outputs = casadi.vertcat(*[parts[name] for name in model.output_names])
    return Step(state, inputs, parameters, state + symbols["sample_time"] * rates, outputs, baked)


def first_state(model: Model, row: Sequence[float] | None = None, nudge: float = NUDGE) -> list[float]:
    """The state that every peer begins with: the observer's at a row of inputs, by default the first, and the nudge."""
    observer = model.observer
    names = {s: casadi.SX(float(v)) for s, v in observer.values.items()}
    inputs = dict(zip((f.name for f in model.program.inputs), model.rows()[0] if row is None else row, strict=True))
    symbols = (*observer.system.positions, *observer.system.velocities, *observer.system.inputs)
    names |= {s: casadi.SX(inputs.get(s.name, 0.0)) for s in symbols}
    initial = casadi.evalf(casadi.densify(to_casadi(observer.initial, names))).full().ravel()
    return [float(v) + nudge * (k + 1) for k, v in enumerate(initial)]


def casadi_source(function: Any, real: str = "double") -> str:
    """The C of a CasADi function."""
    with tempfile.TemporaryDirectory() as folder:
        generator = casadi.CodeGenerator(f"{NAME}.c", {"casadi_real": real, "casadi_int": INTEGER})
        generator.add(function)
        generator.generate(f"{folder}/")
        return (Path(folder) / f"{NAME}.c").read_text(encoding="utf-8")


def work_sizes(function: Any) -> dict[str, int]:
    """Lengths of the arrays that a caller of CasADi's C brings; C has no empty ones."""
    return {
        "arg": max(function.sz_arg(), 3),
        "res": max(function.sz_res(), 2),
        "iw": max(function.sz_iw(), 1),
        "w": max(function.sz_w(), 1),
    }


def casadi_peer(model: Model, title: str, solver: str = "solve", baked: bool = False, **options: Any) -> Peer:
    """CasADi's C of a model's step with a loop around it.

    Args:
        baked: with the parameters as numbers.
        options: of ``casadi.Function``.
    """
    values = [f.value or 0.0 for f in model.program.parameters]
    return compiled_step(step_of(model, solver, baked), title, first_state(model), values, **options)


def compiled_step(
    step: Step, title: str, first: Sequence[float], values: Sequence[float], limit: float = 60.0, **options: Any
) -> Peer:
    """CasADi's C of a step with a loop around it, in which the two states change places."""
    function = step.function(**options)
    width, outputs = step.inputs.shape[0], step.outputs.shape[0]
    words = {"step": NAME, "width": width, "outputs": outputs, "integer": INTEGER, "sizes": work_sizes(function)}
    loop = render("loop_casadi.c.j2", **words, first=first, values=values)
    return Peer(title, {f"{NAME}.c": casadi_source(function), "loop.c": loop}, NAME, width, outputs, limit=limit)

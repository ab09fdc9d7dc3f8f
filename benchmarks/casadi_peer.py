"""The step as one CasADi function, from the observer's equations, and the C that CasADi writes for it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi

from benchmarks.model import NUDGE, Model
from benchmarks.peer import Peer
from benchmarks.text import render
from codegen.mechanics.casadi_form import to_casadi
from codegen.mechanics.solve import solve_symmetric

SOLVERS: dict[str, Callable[[Any, Any], Any]] = {"solve": casadi.solve, "ldl": solve_symmetric}
"""CasADi's own; and our unrolled LDLᵀ handed to it as expressions."""
INTEGER = "long long"


@dataclass(frozen=True)
class Step:
    """(state, inputs[, parameters]) → (next state, outputs), as SX.

    Attributes:
        baked: whether parameters are numbers in it.
    """

    state: Any
    inputs: Any
    parameters: Any
    next_state: Any
    outputs: Any
    baked: bool

    @property
    def arguments(self) -> list[Any]:
        return [self.state, self.inputs] if self.baked else [self.state, self.inputs, self.parameters]

    def function(self, **options: Any) -> Any:
        return casadi.Function("casadi_step", self.arguments, [self.next_state, self.outputs], options)


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
    state = casadi.vertcat(*[symbols[f.name] for f in program.states])
    following = state + symbols["sample_time"] * rates
    return Step(
        state,
        casadi.vertcat(*[symbols[f.name] for f in program.inputs]),
        casadi.vertcat(*[symbols[f.name] for f in program.parameters]),
        following,
        casadi.vertcat(*[parts[name] for name in model.output_names]),
        baked,
    )


def first_state(model: Model) -> list[float]:
    """The state that every peer begins with: the observer's at the first row, and NUDGE."""
    observer = model.observer
    names = {s: casadi.SX(float(v)) for s, v in observer.values.items()}
    row = dict(zip((f.name for f in model.program.inputs), model.rows()[0], strict=True))
    symbols = (*observer.system.positions, *observer.system.velocities, *observer.system.inputs)
    names |= {s: casadi.SX(row.get(s.name, 0.0)) for s in symbols}
    initial = casadi.evalf(casadi.densify(to_casadi(observer.initial, names))).full().ravel()
    return [float(v) + NUDGE * (k + 1) for k, v in enumerate(initial)]


def casadi_source(function: Any, real: str = "double") -> str:
    """The C of a CasADi function."""
    with tempfile.TemporaryDirectory() as folder:
        generator = casadi.CodeGenerator("casadi_step.c", {"casadi_real": real, "casadi_int": INTEGER})
        generator.add(function)
        generator.generate(f"{folder}/")
        return (Path(folder) / "casadi_step.c").read_text(encoding="utf-8")


def casadi_peer(
    model: Model, title: str, solver: str = "solve", baked: bool = False, limit: float = 60.0, **options: Any
) -> Peer:
    """CasADi's C of a model's step with a loop around it."""
    values = [f.value or 0.0 for f in model.program.parameters]
    return compiled_step(step_of(model, solver, baked), title, first_state(model), values, limit, **options)


def compiled_step(step: Step, title: str, first: list[float], values: list[float], limit: float, **options: Any) -> Peer:
    """CasADi's C of a step with a loop around it: states change places from step to step."""
    function = step.function(**options)
    work = max(function.sz_w(), 1)
    states, width, outputs = step.state.shape[0], step.inputs.shape[0], step.outputs.shape[0]
    head = f"""
int casadi_step(const double **arg, double **res, {INTEGER} *iw, double *w, int mem);
static double parameters[] = {{{_numbers(values)}}};
static const double first[] = {{{_numbers(first)}}};
static double states[2][{states}], outputs[{outputs}], work[{work}];
static const double *arg[{max(function.sz_arg(), 3)}];
static double *res[{max(function.sz_res(), 2)}];
static {INTEGER} iw[{max(function.sz_iw(), 1)}];
""".strip()
    loop = render(
        "loop.c.j2",
        step="casadi_step",
        about=title,
        head="#include <string.h>\n" + head,
        start="(void)row;\nmemcpy(states[0], first, sizeof first);\narg[0] = states[0];\nres[0] = states[1];\n"
        "arg[2] = parameters;\nres[1] = outputs;",
        call="arg[1] = row;\ncasadi_step(arg, res, iw, work, 0);\n"
        "double *now = res[0];\nres[0] = (double *)arg[0];\narg[0] = now;",
        keep="memcpy(target, outputs, sizeof outputs);",
        width=width,
        outputs=outputs,
    )
    files = {"casadi_step.c": casadi_source(function), "loop.c": loop}
    return Peer(title, files, "casadi_step", width, outputs, limit=limit)


def _numbers(values: Any) -> str:
    return ", ".join(repr(float(v)) for v in values)

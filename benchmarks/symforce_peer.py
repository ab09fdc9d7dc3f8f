"""The step as a SymForce function: the same scalar operations rebuilt in SymForce's symbols, and its C++."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

import casadi

from benchmarks.casadi_peer import Step, first_state, step_of
from benchmarks.model import Model
from benchmarks.peer import MACHINE, Missing, Peer
from benchmarks.text import render

CPP_FLAGS = ("-std=c++17", "-O2", "-DNDEBUG", "-ffp-contract=off", *MACHINE)


def eigen_include() -> Path:
    """Eigen's headers, which CasADi's wheel carries."""
    for place in (Path(casadi.__file__).parent / "include" / "eigen3", Path("/usr/include/eigen3")):
        if (place / "Eigen" / "Core").exists():
            return place
    raise Missing("Eigen's headers are not here")


def rebuild(step: Step) -> tuple[list[Any], list[Any], list[Any], list[Any], list[Any]]:
    """State, inputs, parameters, next state and outputs as SymForce scalars, operation by operation.

    Raises:
        Missing: where SymForce is not installed.
    """
    try:
        import symforce.symbolic as sf
    except ImportError:
        raise Missing("not installed: `pip install symforce`") from None
    groups = [
        [sf.Symbol(f"{name}{k}") for k in range(vector.shape[0])]
        for name, vector in (("s", step.state), ("u", step.inputs), ("p", step.parameters))
    ]
    calls = {
        casadi.OP_SIN: sf.sin,
        casadi.OP_COS: sf.cos,
        casadi.OP_TANH: sf.tanh,
        casadi.OP_FABS: abs,
        casadi.OP_SIGN: lambda a: sf.sign(a),
        casadi.OP_NEG: lambda a: -a,
        casadi.OP_SQ: lambda a: a * a,
        casadi.OP_TWICE: lambda a: 2 * a,
        casadi.OP_INV: lambda a: 1 / a,
        casadi.OP_ADD: lambda a, b: a + b,
        casadi.OP_SUB: lambda a, b: a - b,
        casadi.OP_MUL: lambda a, b: a * b,
        casadi.OP_DIV: lambda a, b: a / b,
    }
    function = step.function(cse=True)
    register: dict[int, Any] = {}
    results: list[dict[int, Any]] = [{}, {}]
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        target, source = function.instruction_output(k), function.instruction_input(k)
        if operation == casadi.OP_INPUT:
            register[target[0]] = groups[source[0]][source[1]]
        elif operation == casadi.OP_CONST:
            value = function.instruction_constant(k)
            register[target[0]] = sf.S(int(value)) if value == int(value) else sf.S(float(value))
        elif operation == casadi.OP_OUTPUT:
            results[target[0]][target[1]] = register[source[0]]
        else:
            register[target[0]] = calls[operation](*[register[r] for r in source])
    sizes = (step.next_state.shape[0], step.outputs.shape[0])
    following, outputs = ([sf.S(found.get(k, 0)) for k in range(n)] for found, n in zip(results, sizes, strict=True))
    return (*groups, following, outputs)  # type: ignore[return-value]


def symforce_header(step: Step) -> str:
    """The C++ header that SymForce generates."""
    state, inputs, parameters, following, outputs = rebuild(step)
    os.environ.setdefault("SYMFORCE_SYMBOLIC_API", "symengine")
    import symforce.symbolic as sf
    from symforce import codegen
    from symforce.values import Values

    def vector(entries: list[Any]) -> Any:
        return sf.Matrix(entries)

    generator = codegen.Codegen(
        inputs=Values(state=vector(state), row=vector(inputs), parameters=vector(parameters)),
        outputs=Values(following=vector(following), outputs=vector(outputs)),
        config=codegen.CppConfig(use_eigen_types=True),
        name="symforce_step",
    )
    with tempfile.TemporaryDirectory() as folder:
        made = generator.generate_function(output_dir=folder, skip_directory_nesting=True)
        return next(Path(p) for p in made.generated_files if p.suffix == ".h").read_text(encoding="utf-8")


def symforce_peer(model: Model, title: str, limit: float = 60.0) -> Peer:
    """SymForce's C++ of the step with a loop around it."""
    step = step_of(model, "ldl")
    header = symforce_header(step)
    values = [f.value for f in model.program.parameters]
    sizes = {key: v.shape[0] for key, v in (("S", step.state), ("U", step.inputs), ("P", step.parameters), ("Y", step.outputs))}
    text = render("symforce_loop.cpp.j2", **sizes, first=first_state(model), values=values)
    return Peer(
        title,
        {"symforce_step.h": header, "loop.cpp": text},
        "symforce_call",
        sizes["U"],
        sizes["Y"],
        "g++",
        (*CPP_FLAGS, f"-I{eigen_include()}"),
        limit=limit,
    )

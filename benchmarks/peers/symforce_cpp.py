"""The step as a SymForce function: the same scalar operations rebuilt in SymForce's symbols, and its C++."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import casadi

from benchmarks.measure.build import MACHINE, Missing, Peer
from benchmarks.model import Model
from benchmarks.peers.casadi_c import Step, first_state, step_of
from benchmarks.peers.eigen import eigen_include
from benchmarks.text import render

FLAGS = ("-std=c++17", "-O2", "-DNDEBUG", "-ffp-contract=off", *MACHINE)
PARTS = ("state", "row", "parameters")


@cache
def symbolic() -> Any:
    """SymForce's symbolic module, over SymEngine. Raises Missing where SymForce is not installed."""
    os.environ.setdefault("SYMFORCE_SYMBOLIC_API", "symengine")
    try:
        import symforce
    except ImportError:
        raise Missing("not installed: `pip install symforce`") from None
    symforce.set_epsilon_to_number()
    import symforce.symbolic as sf

    return sf


def operations(sf: Any) -> dict[int, Callable[..., Any]]:
    """CasADi's operation → SymForce's."""
    return {
        casadi.OP_SIN: sf.sin,
        casadi.OP_COS: sf.cos,
        casadi.OP_TANH: sf.tanh,
        casadi.OP_FABS: abs,
        casadi.OP_SIGN: sf.sign,
        casadi.OP_NEG: lambda a: -a,
        casadi.OP_SQ: lambda a: a * a,
        casadi.OP_TWICE: lambda a: 2 * a,
        casadi.OP_INV: lambda a: 1 / a,
        casadi.OP_ADD: lambda a, b: a + b,
        casadi.OP_SUB: lambda a, b: a - b,
        casadi.OP_MUL: lambda a, b: a * b,
        casadi.OP_DIV: lambda a, b: a / b,
    }


def rebuild(step: Step) -> tuple[dict[str, list[Any]], list[Any], list[Any]]:
    """The step in SymForce's scalars, operation by operation: symbols of ``PARTS``, next state, outputs."""
    sf = symbolic()
    calls = operations(sf)
    groups = [
        [sf.Symbol(f"{letter}{k}") for k in range(vector.shape[0])]
        for letter, vector in zip("sup", (step.state, step.inputs, step.parameters), strict=True)
    ]
    function = step.function(cse=True)
    register: dict[int, Any] = {}
    results: tuple[dict[int, Any], dict[int, Any]] = ({}, {})
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
    return dict(zip(PARTS, groups, strict=True)), following, outputs


def symforce_header(step: Step) -> str:
    """The C++ header that SymForce generates. Raises Missing where SymForce is not installed."""
    sf = symbolic()
    from symforce import codegen
    from symforce.values import Values

    inputs, following, found = rebuild(step)
    generator = codegen.Codegen(
        inputs=Values(**{part: sf.Matrix(symbols) for part, symbols in inputs.items()}),
        outputs=Values(following=sf.Matrix(following), outputs=sf.Matrix(found)),
        config=codegen.CppConfig(use_eigen_types=True),
        name="symforce_step",
    )
    with tempfile.TemporaryDirectory() as folder:
        made = generator.generate_function(output_dir=folder, skip_directory_nesting=True)
        return next(Path(p) for p in made.generated_files if p.suffix == ".h").read_text(encoding="utf-8")


def symforce_peer(model: Model, title: str) -> Peer:
    """SymForce's C++ of the step with a loop around it. Raises Missing where SymForce or Eigen is not installed."""
    step = step_of(model, "ldl")
    header = symforce_header(step)
    values = [f.value for f in model.program.parameters]
    lengths = (step.state.shape[0], step.inputs.shape[0], step.parameters.shape[0], step.outputs.shape[0])
    sizes = dict(zip("SUPY", lengths, strict=True))
    text = render("symforce_loop.cpp.j2", **sizes, first=first_state(model), values=values)
    files = {"symforce_step.h": header, "loop.cpp": text}
    flags = (*FLAGS, f"-I{eigen_include()}")
    return Peer(title, files, "symforce_call", sizes["U"], sizes["Y"], "g++", flags)

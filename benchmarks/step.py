"""One observer step: our generated C against CasADi's generated C of the same function, in one process.

Run with ``python -m benchmarks.step``; prints nanoseconds for orientation and the ratio, which is the figure.
"""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

import casadi
from rich.console import Console
from rich.table import Table

from codegen import pipeline
from codegen.emit.package import emit_sources, make_header
from codegen.program import Program, build_program
from codegen.resources import resource_folder

HARNESS = Path(__file__).with_name("step_harness.c")


def casadi_function(program: Program) -> casadi.Function:
    """The step as one CasADi function (state, parameters, inputs) → (next state, outputs)."""
    vectors = [
        casadi.vertcat(*[f.symbol for f in fields]) for fields in (program.states, program.parameters, program.inputs)
    ]
    results = [casadi.vertcat(*program.next_state), casadi.vertcat(*[b.symbols for b in program.blocks if b.output])]
    for block in reversed(program.blocks):
        results = [casadi.substitute(r, block.symbols, block.expression) for r in results]
    return casadi.Function("casadi_step", vectors, [casadi.cse(r) for r in results])


def measure(program: Program, sources: dict[str, str]) -> tuple[float, float]:
    """(ours, CasADi's) nanoseconds a step, the best of nine rounds."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in sources.items():
            (folder / file).write_text(text)
        function = casadi_function(program)
        generator = casadi.CodeGenerator("casadi_step.c")
        generator.add(function)
        generator.generate(f"{folder}/")
        sizes = {
            "NAME": program.name,
            "STATES": len(program.states),
            "PARAMETERS": len(program.parameters),
            "INPUTS": len(program.inputs),
            "OUTPUTS": len(program.outputs),
            "WORK": function.sz_w(),
            "VALUES": ",".join(repr(p.value) for p in program.parameters),
        }
        flags = [f"-D{key}={value}" for key, value in sizes.items()]
        files = [str(HARNESS), str(folder / f"{program.name}.c"), str(folder / "casadi_step.c")]
        command = ["cc", "-O2", "-std=gnu99", *flags, *files, "-lm", "-o", str(folder / "run")]
        subprocess.run(command, check=True)
        done = subprocess.run([str(folder / "run")], check=True, capture_output=True, text=True)
        ours, theirs, _ = done.stdout.split()
        return float(ours), float(theirs)


def main() -> None:
    table = Table("spec", "ours, ns", "CasADi, ns", "ours / CasADi")
    for path in sorted(resource_folder("specs").glob("*.yaml")):
        model = pipeline.check(path)
        if model.observer is None:
            continue
        program = build_program(model.observer)
        sources = emit_sources(program, make_header(path.name, model.spec.sha256, ""))
        ours, theirs = measure(program, sources)
        table.add_row(model.spec.name, f"{ours:.1f}", f"{theirs:.1f}", f"{ours / theirs:.2f}")
    Console().print(table)


if __name__ == "__main__":
    main()

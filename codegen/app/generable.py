"""What ``stiction generate`` refuses of a spec before it comes to the proof; no file is printed for it."""

from __future__ import annotations

from codegen.app.derived import Derived
from codegen.emit.c import c_language
from codegen.observers.shape import refuse_infinite_slope
from codegen.program import Program, lower
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical
from codegen.spec.places import placed


def refuse_ungenerable(machine: Derived) -> None:
    """Raise BadInput, at its line, for what ``generate`` would refuse before it comes to the proof."""
    program = machine.program
    assert machine.header
    _refuse_unprintable(machine.spec, program)
    refuse_infinite_slope(machine.spec)


@numerical("the generated step")
def _refuse_unprintable(spec: Spec, program: Program) -> None:
    with placed(spec):
        code = lower(program)
        literal = c_language(program).literal  # every language refuses the same numbers
        for value in (*(f.value or 0.0 for f in program.parameters), *code.derived_values):
            literal(value)
        for node in code.nodes:
            if node.kind == "number":
                literal(node.value)

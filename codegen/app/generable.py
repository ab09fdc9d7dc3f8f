"""What ``stiction generate`` refuses of a spec before it comes to the proof; no file is printed for it."""

from __future__ import annotations

from codegen.certify.prefix import rational_text
from codegen.emit.c import c_view
from codegen.emit.entries import parameters_of
from codegen.emit.header import Header, make_header
from codegen.emit.python import python_view
from codegen.observers import Observer
from codegen.observers.shape import refuse_infinite_slope
from codegen.program import build_program, lower
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical
from codegen.spec.places import placed


def header_of(spec: Spec, options: str = "") -> Header:
    """The header of a spec's files; ``options`` are the command's, with a space before each.

    Raises:
        BadInput: for a file whose name generated files cannot print.
    """
    envelope = {name: (rational_text(low), rational_text(high)) for name, (low, high) in spec.envelope.items()}
    return make_header(spec.path.name, spec.sha256, spec.source, spec.robot, options, envelope)


@numerical("the generated step")
def refuse_ungenerable(spec: Spec, observer: Observer) -> None:
    """Raise BadInput, at its line, for what ``generate`` would refuse before it comes to the proof."""
    with placed(spec):
        if spec.cancellation is not None:
            from codegen.cancellation import with_cancellation  # with scipy.optimize, which few specs need

            observer = with_cancellation(spec, observer)
        program = build_program(observer, spec.code)
        header_of(spec)
        code = lower(program)
        for view, language in (c_view(program, code), python_view(program, code)):
            for entry in parameters_of(program):
                for value in entry.values:
                    language.literal(value)
            assert view is not None
    refuse_infinite_slope(spec)

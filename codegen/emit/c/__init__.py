"""C99 in double or single precision: the observer, a complete example, and files that build them."""

from __future__ import annotations

from typing import Any

from codegen.base.text import render
from codegen.emit.entries import inputs_of, outputs_of, parameters_of, states_of
from codegen.emit.header import Header
from codegen.emit.language import Language
from codegen.emit.writer import Style, Writer
from codegen.program import Code, Program
from codegen.program.model import LARGEST

FUNCTIONS = ("sin", "cos", "tan", "exp", "log", "sqrt", "tanh", "pow")


def c_language(program: Program) -> Language:
    """C's words; in single precision those of ``float``, so that no double helper is linked."""
    single = program.precision == "single"
    end = "f" if single else ""
    calls = {name: name + end for name in FUNCTIONS} | {"abs": f"fabs{end}", "sign": f"{program.name}_sign"}
    return Language(calls, single, f"{{digits}}{end}")


def struct_formats(lane: str) -> dict[str, str]:
    """How a field of each struct is written; ``lane`` is the index of a lane or empty."""
    return {struct: f"{struct}->{{name}}{lane}" for struct in ("parameters", "state", "inputs", "outputs")}


def c_words(program: Program, code: Code, header: Header) -> dict[str, Any]:
    """What every template of C needs beside the writer of its lines."""
    language = c_language(program)
    single = language.single
    return {
        "program": program,
        "code": code,
        "header": header,
        "literal": language.literal,
        "real": "float" if single else "double",
        "magnitude": language.calls["abs"],
        "largest": language.literal(LARGEST[program.precision]),
        "largest_shown": f"{LARGEST[program.precision]:.0e}",
        "parameters": parameters_of(program),
        "states": states_of(program),
        "inputs": inputs_of(program),
        "outputs": outputs_of(program),
        "parameter_count": len(program.parameters) + len(code.derived),
    }


def emit_c(program: Program, code: Code, header: Header) -> dict[str, str]:
    """NAME.h, NAME.c, example_main.c, CMakeLists.txt and NAME.mk.

    Raises:
        BadInput: for a number that C has no literal for.
    """
    words = c_words(program, code, header)
    declared = f"const {words['real']} {{name}}"
    style = Style(c_language(program), struct_formats(""), "{name}", "{name}", declared, declares=True, indent=4)
    words["text"] = Writer(program, code, style)
    return {
        f"{program.name}.h": render("c/observer.h.j2", **words),
        f"{program.name}.c": render("c/observer.c.j2", **words),
        "example_main.c": render("c/example_main.c.j2", **words),
        "CMakeLists.txt": render("c/CMakeLists.txt.j2", **words),
        f"{program.name}.mk": render("c/observer.mk.j2", **words),
    }

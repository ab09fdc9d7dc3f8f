"""Printer of C99 in double or single precision: the observer, a complete example, and files that build them."""

from typing import Any

from codegen.base.text import render
from codegen.emit.expression import Language
from codegen.emit.header import Header
from codegen.emit.writer import Style, template_words
from codegen.program import Code, Program

FUNCTIONS = ("sin", "cos", "tan", "exp", "log", "sqrt", "tanh", "pow")


def c_language(program: Program) -> Language:
    """Function names and literals of C; in single precision those of ``float``: no double function is linked."""
    single = program.precision == "single"
    end = "f" if single else ""
    calls = {name: name + end for name in FUNCTIONS} | {"abs": f"fabs{end}", "sign": f"{program.name}_sign"}
    return Language(calls, single, f"{{digits}}{end}")


def c_words(
    program: Program, code: Code, header: Header, lane: str, local: str, declares_locals: bool
) -> dict[str, Any]:
    """The variables of the C templates.

    Args:
        lane: index after every struct field, such as ``[lane]``; empty for one observer.
        local: format of a local variable, with {name}.
        declares_locals: whether a local of the function is declared where it is assigned.
    """
    language = c_language(program)
    structs = {struct: f"{struct}->{{name}}{lane}" for struct in ("parameters", "state", "inputs", "outputs")}
    indent = 8 if lane else 4
    style = Style(language, structs, local, "{name}", f"const {program.real} {{name}}", declares_locals, indent)
    return template_words(program, code, header, style, program.real) | {"magnitude": language.calls["abs"]}


def emit_c(program: Program, code: Code, header: Header) -> dict[str, str]:
    """NAME.h, NAME.c, example_main.c, CMakeLists.txt and NAME.mk.

    Raises BadInput for a number that no C literal expresses.
    """
    words = c_words(program, code, header, "", "{name}", declares_locals=True)
    return {
        f"{program.name}.h": render("c/observer.h.j2", **words),
        f"{program.name}.c": render("c/observer.c.j2", **words),
        "example_main.c": render("c/example_main.c.j2", **words),
        "CMakeLists.txt": render("c/CMakeLists.txt.j2", **words),
        f"{program.name}.mk": render("c/observer.mk.j2", **words),
    }

"""The Python twin: the same operations in the same order on plain floats, or on NumPy's float32."""

from __future__ import annotations

from codegen.base.text import render
from codegen.emit.expression import Language
from codegen.emit.header import Header
from codegen.emit.writer import Style, template_words
from codegen.program import Code, Program

FUNCTIONS = ("sin", "cos", "tan", "exp", "log", "sqrt", "pow", "sign")


def python_language(program: Program) -> Language:
    """Python's words; a function that raises where C gives inf or NaN has one that does not."""
    single = program.precision == "single"
    calls = {name: f"_{name}" for name in FUNCTIONS} | {"abs": "abs", "tanh": "math.tanh", "quotient": "_quotient"}
    if single:
        calls = {name: f"_{name}" for name in (*FUNCTIONS, "tanh")} | {"abs": "abs"}
    return Language(calls, single, "float32({digits})" if single else "{digits}", "(", ")", narrows=single)


def emit_python(program: Program, code: Code, header: Header) -> dict[str, str]:
    """__init__.py.

    Raises:
        BadInput: for a number that Python has no literal for.
    """
    language = python_language(program)
    structs = {struct: f"{struct}.{{name}}" for struct in ("parameters", "state", "outputs")}
    structs["inputs"] = "float32(inputs.{name})" if language.single else "inputs.{name}"
    style = Style(language, structs, "{name}", "{name}", "{name}", declares=False, indent=4)
    real = "float32" if language.single else "float"
    words = template_words(program, code, header, style, real)
    return {"__init__.py": render("python/observer.py.j2", **words)}

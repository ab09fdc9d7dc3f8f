"""Printer of the Python twin: the operations of the C in the same order, on Python floats or NumPy's float32."""

from codegen.base.text import render
from codegen.emit.expression import Language
from codegen.emit.header import Header
from codegen.emit.writer import Style, template_words
from codegen.program import Code, Program

FUNCTIONS = ("sin", "cos", "tan", "exp", "log", "sqrt", "pow", "sign")


def python_language(program: Program) -> Language:
    """Function names and literals of Python; where C gives inf or NaN and ``math`` raises, a function of the twin."""
    single = program.precision == "single"
    calls = {name: f"_{name}" for name in FUNCTIONS} | {"abs": "abs", "tanh": "math.tanh", "quotient": "_quotient"}
    if single:
        calls = {name: f"_{name}" for name in (*FUNCTIONS, "tanh")} | {"abs": "abs"}
    return Language(calls, single, "float32({digits})" if single else "{digits}", "(", ")")


def emit_python(program: Program, code: Code, header: Header) -> dict[str, str]:
    """The module ``__init__.py``. Raises BadInput for a number that no literal of the precision expresses."""
    language = python_language(program)
    structs = {struct: f"{struct}.{{name}}" for struct in ("parameters", "state", "outputs")}
    structs["inputs"] = "float32(inputs.{name})" if language.single else "inputs.{name}"
    style = Style(language, structs, "{name}", "{name}", "{name}", declares_locals=False, indent=4)
    real = "float32" if language.single else "float"
    words = template_words(program, code, header, style, real)
    return {"__init__.py": render("python/observer.py.j2", **words)}

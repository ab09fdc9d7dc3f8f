"""Code generation: Program → source files. Adding a printer: a folder with its function, and its name in PRINTERS."""

from collections.abc import Callable

from codegen.emit.c import emit_c
from codegen.emit.header import Header
from codegen.emit.python import emit_python
from codegen.emit.simd import emit_simd
from codegen.program import Code, Program

PRINTERS: dict[str, Callable[[Program, Code, Header], dict[str, str]]] = {
    "c": emit_c,
    "python": emit_python,
    "simd": emit_simd,
}
ALWAYS = ("c", "python")

__all__ = ["ALWAYS", "PRINTERS"]

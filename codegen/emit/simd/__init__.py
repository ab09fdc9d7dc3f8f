"""C that steps many observers at once: every field an array over lanes, one loop that a compiler turns into vectors."""

from __future__ import annotations

from codegen.base.text import render
from codegen.emit.c import c_language, c_words, struct_formats
from codegen.emit.header import Header
from codegen.emit.writer import Style, Writer
from codegen.program import Code, Program

LANES = 16


def emit_simd(program: Program, code: Code, header: Header) -> dict[str, str]:
    """NAME_lanes.h and NAME_lanes.c."""
    language = c_language(program)
    real = "float" if language.single else "double"
    # Code without loops of its own is one loop over the lanes, with its locals in registers.
    local = "{name}[lane]" if program.arrays else "{name}"
    style = Style(
        language,
        struct_formats("[lane]"),
        local,
        "{name}",
        f"const {real} {{name}}",
        declares=not program.arrays,
        indent=8,
    )
    words = c_words(program, code, header) | {"text": Writer(program, code, style), "lanes": LANES}
    return {
        f"{program.name}_lanes.h": render("simd/lanes.h.j2", **words),
        f"{program.name}_lanes.c": render("simd/lanes.c.j2", **words),
    }

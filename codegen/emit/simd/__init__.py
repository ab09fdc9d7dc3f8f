"""C that steps many observers at once: every field an array over lanes, one loop that a compiler turns into vectors."""

from __future__ import annotations

from codegen.base.text import render
from codegen.emit.c import c_words
from codegen.emit.header import Header
from codegen.program import Code, Program

LANES = 16


def emit_simd(program: Program, code: Code, header: Header) -> dict[str, str]:
    """NAME_lanes.h and NAME_lanes.c."""
    # Code without loops of its own is one loop over the lanes, with its locals in registers.
    local = "{name}[lane]" if program.arrays else "{name}"
    words = c_words(program, code, header, "[lane]", local, declares=not program.arrays) | {"lanes": LANES}
    return {
        f"{program.name}_lanes.h": render("simd/lanes.h.j2", **words),
        f"{program.name}_lanes.c": render("simd/lanes.c.j2", **words),
    }

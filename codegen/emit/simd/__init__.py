"""Printer of SIMD C: many observers stepped at once, each field an array over lanes, in loops that vectorise."""

from codegen.base.text import render
from codegen.emit.c import c_words
from codegen.emit.header import Header
from codegen.program import Code, Program

LANES = 16
"""Default number of observers that a step computes."""


def emit_simd(program: Program, code: Code, header: Header) -> dict[str, str]:
    """NAME_lanes.h and NAME_lanes.c."""
    # Code without array loops is printed as one loop over the lanes, with its locals in registers.
    local = "{name}[lane]" if program.arrays else "{name}"
    words = c_words(program, code, header, "[lane]", local, declares_locals=not program.arrays) | {"lanes": LANES}
    return {
        f"{program.name}_lanes.h": render("simd/lanes.h.j2", **words),
        f"{program.name}_lanes.c": render("simd/lanes.c.j2", **words),
    }

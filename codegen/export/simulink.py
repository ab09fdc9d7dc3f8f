"""The generated C as a block of Simulink: a level-2 C MEX S-function around it."""

from __future__ import annotations

from codegen.base.text import render
from codegen.emit.entries import inputs_of, outputs_of
from codegen.export.arduino import manifest
from codegen.export.controller import Controller


def simulink_block(controller: Controller, header: list[str]) -> dict[str, str]:
    """NAME_sfun.c, NAME.h, NAME.c, the script that builds them, a README and the manifest."""
    program, name = controller.program, controller.program.name
    words = {
        "program": program,
        "name": name,
        "header": header,
        "inputs": inputs_of(program),
        "outputs": outputs_of(program),
        "period": repr(controller.period),
        "claim": controller.claim,
    }
    files = {
        f"{name}_sfun.c": render("export/simulink/sfun.c.j2", **words),
        f"{name}.h": controller.sources[f"{name}.h"],
        f"{name}.c": controller.sources[f"{name}.c"],
        f"build_{name}.m": render("export/simulink/build.m.j2", **words),
        "README.md": render("export/simulink/README.md.j2", **words),
    }
    return files | {"manifest.json": manifest(files)}

"""The generated C in single precision as a library for the Arduino IDE and PlatformIO."""

from __future__ import annotations

import json

from codegen.base.files import sha256
from codegen.base.text import render
from codegen.base.version import VERSION
from codegen.emit.entries import inputs_of, outputs_of
from codegen.export.controller import Controller


def arduino_library(controller: Controller, header: list[str]) -> dict[str, str]:
    """library.properties, library.json, src/NAME.h, src/NAME.c, an example, a README and the manifest."""
    program, name = controller.program, controller.program.name
    words = {
        "program": program,
        "name": name,
        "version": VERSION,
        "header": header,
        "inputs": inputs_of(program),
        "outputs": outputs_of(program),
        "period": f"{round(controller.period * 1e6)}",
        "claim": controller.claim,
    }
    package = {
        "name": f"stiction_{name}",
        "version": VERSION,
        "description": f"Friction observer {program.kind} of {name}, generated",
        "frameworks": "*",
        "platforms": "*",
        "headers": f"{name}.h",
        "build": {"flags": ["-ffp-contract=off"]},
    }
    files = {
        "library.properties": render("export/arduino/library.properties.j2", **words),
        "library.json": json.dumps(package, indent=2) + "\n",
        f"src/{name}.h": controller.sources[f"{name}.h"],
        f"src/{name}.c": controller.sources[f"{name}.c"],
        f"examples/{name}_serial/{name}_serial.ino": render("export/arduino/example.ino.c.j2", **words),
        "README.md": render("export/arduino/README.md.j2", **words),
    }
    return files | {"manifest.json": manifest(files)}


def manifest(files: dict[str, str]) -> str:
    """By it a later run knows that the files are ours."""
    hashes = {name: sha256(text) for name, text in sorted(files.items())}
    return json.dumps({"tool": {"name": "stiction", "version": VERSION}, "files": hashes}, indent=2) + "\n"

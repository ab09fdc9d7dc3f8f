"""Program and certificate → the files of generated/NAME/."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from codegen.emit.printer import PYTHON, C
from codegen.emit.view import view
from codegen.files import sha256
from codegen.program import Program
from codegen.text import render
from codegen.version import VERSION


@dataclass(frozen=True)
class Header:
    """What the head of every generated file says; no date, so that the same spec gives the same bytes.

    Attributes:
        spec_sha256: of the spec with the robot file that it names.
        robot: that file's name and hash.
    """

    spec_file: str
    spec_sha256: str
    source: str
    version: str
    command: str
    robot: tuple[str, str] | None = None


def make_header(spec_file: str, spec_sha256: str, source: str, robot: tuple[str, str] | None = None) -> Header:
    return Header(spec_file, spec_sha256, source, VERSION, f"stiction generate {spec_file}", robot)


def emit_sources(program: Program, header: Header) -> dict[str, str]:
    """The C and Python sources, by file name."""
    c = view(program, C, "parameters->{name}", "state->{name}", "inputs->{name}")
    python = view(program, PYTHON, "parameters.{name}", "state.{name}", "inputs.{name}")
    common: dict[str, Any] = {"program": program, "header": header, "literal": C.literal}
    return {
        f"{program.name}.h": render("c/observer.h.j2", view=c, **common),
        f"{program.name}.c": render("c/observer.c.j2", view=c, **common),
        "example_main.c": render("c/example_main.c.j2", **common),
        "__init__.py": render("python/observer.py.j2", view=python, **common),
    }


def emit_readme(program: Program, header: Header, certificate: Any) -> str:
    """How to call what was generated; ``certificate`` is a dict, or the words of a refusal."""
    refused = certificate if isinstance(certificate, str) else None
    return render(
        "text/generated_readme.md.j2", program=program, header=header, certificate=certificate, refused=refused
    )


def emit_manifest(header: Header, files: dict[str, str]) -> str:
    """Hashes of the spec and of every file beside the manifest."""
    robot = {"robot": dict(zip(("file", "sha256"), header.robot, strict=True))} if header.robot else {}
    content = {
        "tool": {"name": "stiction", "version": header.version, "command": header.command},
        "spec": {"file": header.spec_file, "sha256": header.spec_sha256},
        **robot,
        "files": {name: sha256(text) for name, text in sorted(files.items())},
    }
    return json.dumps(content, indent=2) + "\n"

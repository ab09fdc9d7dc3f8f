"""What a generated header declares beside the Program's fields, read from its text: wrappers fit the C as it is."""

from __future__ import annotations

import re

from codegen.program import Program

FAULT = "fault"


def has_fault(header: str) -> bool:
    """Whether the generated header has an int ``fault`` among its fields."""
    return re.search(rf"^\s*int {FAULT};", header, re.MULTILINE) is not None


def has_prepare(program: Program, header: str) -> bool:
    """Whether the generated header declares NAME_prepare, which derives constants from parameters."""
    return re.search(rf"\b{re.escape(program.name)}_prepare\s*\(", header) is not None


def real_type(header: str) -> str:
    """The C type of a real field: ``double``, or ``float`` in single precision."""
    return "float" if re.search(r"^\s*float \w+;", header, re.MULTILINE) else "double"

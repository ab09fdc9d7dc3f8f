"""What ``--json`` prints: one JSON object on standard output, whose ``format`` names what it is."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from numbers import Integral, Real
from typing import Annotated, Any

import typer

from codegen.base.files import named_path
from codegen.base.shown import json_text
from codegen.base.terminal import output

AsJson = Annotated[bool, typer.Option("--json", help="print JSON")]


def written(what: str, help: str) -> Any:
    """The option -o of a verb: the file or folder that it writes."""
    return typer.Option("-o", "--output", parser=named_path, metavar=what, help=help)


def print_json(content: object) -> None:
    """Print a result as JSON."""
    output.print(json_text(plain(content)), end="")


def plain(value: object) -> Any:
    """The same of dicts, lists, numbers and text alone; a number that is not finite is None."""
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, Integral):
        return int(value)
    if isinstance(value, Real):
        return float(value) if math.isfinite(value) else None
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, Iterable):
        return [plain(inner) for inner in value]
    return str(value)

"""The option ``--json`` and what it prints: one JSON object, whose ``format`` names its content and version."""

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
    """The option -o of a verb, which names the file or folder to write; ``what`` is its placeholder in the help."""
    return typer.Option("-o", "--output", parser=named_path, metavar=what, help=help)


def print_json(content: object) -> None:
    """Print a result as JSON."""
    output.print(json_text(plain(content)), end="")


def plain(value: object) -> Any:
    """A value made of what JSON has: dicts, lists, numbers, text and None; None for a number that is not finite."""
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

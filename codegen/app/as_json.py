"""The option ``--json``: one JSON object, whose ``format`` names its content and version."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from codegen.base.files import named_path
from codegen.base.result import json_text, plain
from codegen.base.terminal import output

AsJson = Annotated[bool, typer.Option("--json", help="print JSON")]


def written(what: str, help: str) -> Any:
    """The option -o of a verb, for the file or folder to write; ``what`` is its placeholder in the help."""
    return typer.Option("-o", "--output", parser=named_path, metavar=what, help=help)


def print_json(content: object) -> None:
    """Print a result as JSON."""
    output.print(json_text(plain(content)), end="")

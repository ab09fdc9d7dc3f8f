"""Arguments and options of verbs, and ``--json``: one JSON object, whose ``format`` names its content and version."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from codegen.base.files import named_path
from codegen.base.result import json_text, plain
from codegen.base.terminal import output


def argument(what: str, help: str | None = None) -> Any:
    """An argument of a verb; ``what`` is its placeholder in the help. A file is read, or refused, by the verb."""
    return typer.Argument(metavar=what, help=help, readable=False)


def option(names: str, what: str | None, help: str) -> Any:
    """An option of a verb, with its names separated by blanks; ``what``: None for a flag or a placeholder by type."""
    return typer.Option(*names.split(), metavar=what, help=help, readable=False)


def written(what: str, help: str) -> Any:
    """The option -o of a verb, for the file or folder to write."""
    return typer.Option("-o", "--output", parser=named_path, metavar=what, help=help)


AsJson = Annotated[bool, option("--json", None, "print JSON")]


def print_json(content: object) -> None:
    """Print a result as JSON."""
    output.print(json_text(plain(content)), end="")

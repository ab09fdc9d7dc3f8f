"""The verbs that list the registries and write their pages: ``laws`` and ``effects``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from codegen.text import render

pages = typer.Typer()
output = Console(soft_wrap=True, highlight=False, markup=False, emoji=False)


@pages.command()
def laws(
    out: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="write laws.md and its pictures here")
    ] = None,
) -> None:
    """List the friction laws, or write their page with a picture of each."""
    from codegen.report.laws import law_groups, write_laws  # with matplotlib, a second that other verbs need not pay

    if out is None:
        output.print(render("text/laws.txt.j2", groups=law_groups()), end="")
    else:
        output.print(str(write_laws(out)))


@pages.command()
def effects(
    out: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="write effects.md and its pictures here")
    ] = None,
) -> None:
    """List the effects that a model may lack, or write their page with a picture of each."""
    from codegen.report.effects import (
        effect_views,
        write_effects,
    )  # SciPy and the simulator cost a second that the other verbs need not pay

    if out is None:
        output.print(render("text/effects.txt.j2", effects=effect_views()), end="")
    else:
        output.print(str(write_effects(out)))

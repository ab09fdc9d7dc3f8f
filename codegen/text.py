"""Jinja: every text the project writes comes from templates/, and a name that is not given is an error."""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from codegen.resources import resource_folder


@cache
def environment(escape: bool = False) -> Environment:
    """The one Jinja environment; ``escape`` for HTML."""
    made = Environment(
        loader=FileSystemLoader(resource_folder("templates")),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=escape,
    )
    made.filters["zip2"] = lambda a, b: list(zip(a, b, strict=True))
    made.filters["zip3"] = lambda a, b, c: list(zip(a, b, c, strict=True))
    made.filters["column_widths"] = lambda rows: [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    made.filters["decimal"] = lambda exact: f"{float(Fraction(exact)):.6g}"
    return made


def render(template: str, **values: Any) -> str:
    """The text of a template.

    Raises:
        jinja2.UndefinedError: for a name that the template uses and the caller did not give.
    """
    return environment(template.endswith(".html.j2")).get_template(template).render(**values)

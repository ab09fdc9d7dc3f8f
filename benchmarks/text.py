"""Text of the benchmarks: templates, and parts of a page between two markers."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader

from codegen.base.errors import BadInput
from codegen.base.text import environment, language_of


@cache
def _environment(language: str) -> Environment:
    """The environment of the project for a language, with the filters and checks that it has, on other templates."""
    return environment(language).overlay(loader=FileSystemLoader(Path(__file__).parent / "templates"))


def render(template: str, **values: Any) -> str:
    """The text of a template of ``benchmarks/templates``."""
    return _environment(language_of(template)).get_template(template).render(**values)


def replaced(page: str, part: str, markers: tuple[str, str], name: str) -> str:
    """A page, called ``name`` in messages, with another part between its markers.

    Raises BadInput if the page has not exactly one pair of markers.
    """
    begin, end = markers
    if page.count(begin) != 1 or page.count(end) != 1 or page.index(begin) > page.index(end):
        raise BadInput(name, "no part to replace", f"`{begin}` and behind it `{end}`, once each")
    return f"{page.split(begin)[0]}{begin}\n{part}{end}{page.split(end)[1]}"

"""Rendering of Jinja templates, one environment for each target language.

Every text that the project writes comes from templates/; a variable that a template uses and the caller does not give
is an error. A template's file name gives its language (``observer.c.j2``: C). The environment of that language prints
text from a user through the language's function in ``codegen.base.user_text``: no template can forget to sanitise it.
"""

import marshal
import sys
from collections.abc import Callable
from decimal import ROUND_CEILING, ROUND_FLOOR
from functools import cache, partial
from numbers import Number
from pathlib import Path
from typing import Any

import jinja2
from jinja2 import FileSystemLoader, StrictUndefined, Undefined
from markupsafe import Markup

from codegen.base.compiler import cached
from codegen.base.resources import resource_folder
from codegen.base.significant import in_percent, instant, rounded_to, with_deserved_digits
from codegen.base.terminal import output
from codegen.base.user_text import PRINTED, UserText, comment_text, terminal_text

LANGUAGES = {
    ".c.j2": "c",
    ".h.j2": "c",
    ".py.j2": "python",
    "CMakeLists.txt.j2": "cmake",
    ".mk.j2": "make",
    ".md.j2": "markdown",
    ".html.j2": "html",
    ".xml.j2": "xml",
    ".smt2.j2": "smt",
    ".tex.j2": "latex",
    ".txt.j2": "terminal",
}
"""End of a template's name → its language; the first that fits."""
WORDS = "words"
"""Language of all other templates: sentences that a template of a language above then prints."""
ESCAPED = ("html", "xml")
"""Languages whose environment escapes all that it prints."""
CODE = ("c", "python", "cmake", "make", "smt")
"""Languages of code. Their strings are made of checked names, units and numbers, so a control character in one is a
fault of the project, not of the user."""


def language_of(template: str) -> str:
    """The target language of a template, from the ending of its file name."""
    return next((language for end, language in LANGUAGES.items() if template.endswith(end)), WORDS)


class Environment(jinja2.Environment):
    """An environment whose templates are compiled to Python once for a user, and read from the cache afterwards."""

    def compile(
        self, source: Any, name: Any = None, filename: Any = None, raw: bool = False, defer_init: bool = False
    ) -> Any:
        """The code of a template, as by Jinja."""
        compiled: Any = super().compile
        given = source, name, filename, raw, defer_init
        if raw or not isinstance(source, str):
            return compiled(*given)
        parts = ["template", sys.version, jinja2.__version__, *map(str, given), *_printing_sources()]
        return marshal.loads(cached(parts, lambda: marshal.dumps(compiled(*given)), "template"))


@cache
def _printing_sources() -> tuple[str, ...]:
    """The text of the modules by which Jinja prints the constants of a template when it compiles it."""
    return tuple(
        Path(__file__).with_name(name).read_text(encoding="utf-8")
        for name in ("text.py", "significant.py", "user_text.py")
    )


@cache
def environment(language: str = WORDS) -> Environment:
    """The one Jinja environment of a language; those of HTML and XML escape all that they print."""
    made = Environment(
        loader=FileSystemLoader(resource_folder("templates")),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=language in ESCAPED,
        finalize=_printer(language),
    )
    # Filters; "comment" is for XML, "up" and "down" print a bound rounded outwards.
    made.filters["zip2"] = lambda a, b: list(zip(a, b, strict=True))
    made.filters["zip3"] = lambda a, b, c: list(zip(a, b, c, strict=True))
    made.filters["column_widths"] = lambda rows: [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    made.filters["by_interval"] = with_deserved_digits
    made.filters["in_percent"] = in_percent
    made.filters["comment"] = lambda line: Markup(comment_text(line))
    made.filters["instant"] = instant
    made.filters["up"] = partial(rounded_to, rounding=ROUND_CEILING)
    made.filters["down"] = partial(rounded_to, rounding=ROUND_FLOOR)
    # Most characters in a line of a fact, beside its label of 18 characters: 96, or fewer on a narrow screen.
    made.globals["width_of_facts"] = lambda: max(20, min(96, output.width - 18)) if output.is_terminal else 96
    return made


def _printer(language: str) -> Callable[[Any], Any]:
    """The function that Jinja calls on every ``{{ value }}`` of a template in this language (its ``finalize``)."""
    sanitised = PRINTED.get(language)

    def printed(value: Any) -> Any:
        if isinstance(value, UserText) and sanitised is not None:
            return sanitised(value.raw)
        if isinstance(value, UserText):
            raise TypeError(
                f"a template in the language `{language}` prints text of a user, and PRINTED in base/user_text.py has "
                "no function for that language; LANGUAGES in base/text.py gives a template's language by its ending"
            )
        if isinstance(value, Undefined):
            return str(value)  # raises: a name that was not given
        if language in CODE:
            return _checked_code(value)
        if language == "terminal":
            return terminal_text(str(value))
        if language in ESCAPED and isinstance(value, str) and not isinstance(value, Markup):
            return PRINTED[language](value)
        return value

    return printed


def _checked_code(value: Any) -> Any:
    """The value, if it may be printed in code: a number, or lines of printable text. Raises TypeError otherwise."""
    if isinstance(value, str) and all(line.isprintable() for line in value.split("\n")):
        return value
    if isinstance(value, Number):
        return value
    raise TypeError(f"a template of code was given {value!r:.80}, which is neither a checked text nor a number")


def render(template: str, **values: Any) -> str:
    """The text of a template.

    Raises:
        jinja2.UndefinedError: for a name that the template uses and the caller did not give.
        TypeError: where text of a user would be printed in a language that has no function for it.
    """
    return environment(language_of(template)).get_template(template).render(**values)

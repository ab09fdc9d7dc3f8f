"""Base classes of results: a one-line ``repr`` for the console, an HTML table for a notebook."""

import json
import math
import textwrap
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from numbers import Integral, Real
from typing import Any, ClassVar

from codegen.base.errors import brief

LONGEST_VALUE = 60
"""Characters of a value in a ``repr``."""
LONGEST_REPR = 220
"""Characters of a ``repr``, without the number of the values that are left out."""


class Shown(ABC):
    """A result with a short ``repr`` and an HTML table, both of its ``summary``."""

    @property
    @abstractmethod
    def summary(self) -> Mapping[str, object]:
        """The few figures that ``repr`` and the table show: label → text or number."""

    def __repr__(self) -> str:
        """The summary on one line; long sentences are cut between words, and values without a place are counted."""
        shown = f"<{type(self).__name__}: "
        values = [f"{name} {_cut(value)}" for name, value in _texts(self)]
        for k, value in enumerate(values):
            if k and len(shown) + len(value) > LONGEST_REPR:
                return f"{shown}, {len(values) - k} more>"
            shown += f"{', ' if k else ''}{value}"
        return f"{shown}>"

    def _repr_html_(self) -> str:
        from codegen.base.text import render  # Jinja, which a console does not need

        return render("text/result.html.j2", kind=type(self).__name__, rows=_texts(self))


class Result(Shown):
    """Typed result of a verb, which can be printed as text or as JSON.

    Attributes:
        template: name of its text template.
    """

    template: ClassVar[str]

    @property
    @abstractmethod
    def content(self) -> Mapping[str, Any]:
        """The JSON object that the command prints with ``--json``."""

    @property
    def view(self) -> Mapping[str, Any]:
        """Variables of the text template."""
        return {"result": self}

    def text(self, **options: object) -> str:
        """The result in words."""
        from codegen.base.text import render

        return render(f"text/{self.template}.txt.j2", **self.view, **options)


def named(source: object, names: str) -> dict[str, Any]:
    """Some attributes of an object as a dict for JSON; ``names``: with blanks between, ``key=name`` for another key."""
    pairs = (word.rpartition("=") for word in names.split())
    return {key or name: getattr(source, name) for key, _, name in pairs}


def json_text(content: object) -> str:
    """The text of a JSON file with this content."""
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def plain(value: object) -> Any:
    """The value in JSON's types: dicts, lists, numbers, text and None; a number that is not finite becomes None."""
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


def _texts(shown: Shown) -> list[tuple[str, str]]:
    """(label, value as text) of each entry of a summary; floats to four digits."""
    values = shown.summary.items()
    return [(name, f"{value:.4g}" if isinstance(value, float) else str(value)) for name, value in values]


def _cut(value: str) -> str:
    """A printable text without its last words, if it is long; of one long word, such as a path, the middle is cut."""
    whole = brief(value, 10 * LONGEST_VALUE)
    cut = textwrap.shorten(whole, LONGEST_VALUE, placeholder=" …", break_long_words=False, break_on_hyphens=False)
    return brief(whole, LONGEST_VALUE) if cut == "…" else cut

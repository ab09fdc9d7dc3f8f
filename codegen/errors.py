"""The one exception that bad input raises: where, what stood there, what was expected, the nearest right thing."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches

LONGEST_QUOTE = 120


@dataclass(frozen=True)
class Place:
    """A spot in a user's file.

    Attributes:
        file: the file's name as the user gave it.
        line: line number counted from 1, or None where the format has no lines.
        key: the path inside the file, such as ``friction.contacts[0].law``.
    """

    file: str
    line: int | None = None
    key: str = ""

    def __str__(self) -> str:
        spot = self.file if self.line is None else f"{self.file}:{self.line}"
        return f"{spot}: {self.key}" if self.key else spot


class BadInput(Exception):
    """Input that cannot be used, told so that its author can mend it.

    Args:
        place: where it stands.
        found: what stood there, in a few words.
        expected: what would have been right.
        nearest: the closest right thing, if there is one.
        about: the name in the generated code that it is about, where ``place`` could not be known.
    """

    def __init__(
        self, place: Place | str, found: str, expected: str, nearest: str | None = None, about: str | None = None
    ) -> None:
        self.place = place if isinstance(place, Place) else Place(place)
        self.found, self.expected, self.nearest, self.about = found, expected, nearest, about
        message = f"{self.place}: {brief(found)}; expected {expected}"
        super().__init__(f"{message} (did you mean {nearest!r}?)" if nearest else message)


def brief(text: str) -> str:
    """The same with what is quoted in it, or a number, cut in its middle where it is long."""
    return re.sub(rf"`[^`]{{{LONGEST_QUOTE},}}`|\d{{{LONGEST_QUOTE},}}", lambda m: f"{m[0][:70]} … {m[0][-20:]}", text)


def nearest_name(word: str, known: Iterable[str]) -> str | None:
    """The known name most like ``word``, or None when nothing is close."""
    matches = get_close_matches(word, list(known), n=1, cutoff=0.6)
    return matches[0] if matches else None

"""BadInput, the exception for every fault of a user's input, and the nearest name to a misspelt one."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import SequenceMatcher
from typing import ParamSpec, TypeVar

Given = ParamSpec("Given")
Result = TypeVar("Result")

LONGEST_QUOTE = 120
"""Characters of what a message quotes."""
LONGEST_NUMBER = 25
"""Digits of a number that a message shows in full."""
LONGEST_PART = 200
"""Characters of where, of what was found, and of the nearest right thing; three times that of what was expected."""
LIKE = 0.66
"""Least share of letters, in their order, that a suggested name has in common with the written one: two of three."""


@dataclass(frozen=True)
class Place:
    """A location in a user's file.

    Attributes:
        file: the file's name as the user gave it.
        line: line number counted from 1, or None where the format has no lines.
        key: the path inside the file, such as ``friction.contacts[0].law``.
    """

    file: str
    line: int | None = None
    key: str = ""

    def __str__(self) -> str:
        file = brief(self.file)
        spot = file if self.line is None else f"{file}:{self.line}"
        return f"{spot}: {brief(self.key)}" if self.key else spot


PlaceOf = Callable[[str], Place]
"""Key of a file → its file and line."""


class BadInput(Exception):
    """Input that cannot be used: where, what was found, what was expected, and the nearest valid name or value.

    Args:
        place: location in the file, or the name of a file or option.
        found: what was found there, in a few words.
        expected: what would have been valid, in a few words.
        nearest: the valid name or value that was probably meant, if there is one.
        about: the name in the generated code that the error concerns, where the location in the spec was not known.
        code: a key of ``error_codes.CODES``; it stays when the words change.

    Attributes:
        others: further errors of the same file, found at the same time.
    """

    def __init__(
        self,
        place: Place | str,
        found: str,
        expected: str,
        nearest: str | None = None,
        about: str | None = None,
        code: str = "",
    ) -> None:
        self.others: tuple[BadInput, ...] = ()
        self.place = place if isinstance(place, Place) else Place(place)
        self.found, self.expected, self.nearest, self.about, self.code = found, expected, nearest, about, code
        super().__init__(self._message)

    def __reduce__(self) -> tuple[object, ...]:
        """With all attributes, so that an error of a worker reaches the caller of a pool of processes."""
        return _restored, (type(self), self.args, vars(self))

    @property
    def _message(self) -> str:
        message = f"{self.place}: {brief(self.found)}; expected {brief(self.expected, 3 * LONGEST_PART)}"
        return f"{message} (did you mean {brief(self.nearest)!r}?)" if self.nearest else message

    def reword(self, placed: Callable[[Place], Place], said: Callable[[str], str]) -> None:
        """Change the place, and the words of what was found and expected."""
        self.place, self.found, self.expected = placed(self.place), said(self.found), said(self.expected)
        self.args = (self._message,)

    @property
    def parts(self) -> dict[str, str | int | None]:
        """The parts of the message, for JSON: code, file, line, key, found, expected, nearest."""
        at = self.place
        where = {"file": brief(at.file), "line": at.line, "key": brief(at.key)}
        words = {"found": brief(self.found), "expected": brief(self.expected, 3 * LONGEST_PART)}
        return {"code": self.code, **where, **words, "nearest": brief(self.nearest) if self.nearest else None}

    def at(self, place: Place) -> BadInput:
        """The same fault, reported at another place."""
        return BadInput(place, self.found, self.expected, self.nearest, self.about, code=self.code)

    @property
    def all(self) -> tuple[BadInput, ...]:
        """This fault and the others, in the order of their lines; those without a line last."""
        return tuple(sorted((self, *self.others), key=lambda f: (f.place.line is None, f.place.line or 0)))


def _restored(kind: type[BadInput], args: tuple[object, ...], attributes: dict[str, object]) -> BadInput:
    error = kind.__new__(kind, *args)
    error.__dict__.update(attributes)
    return error


class Faults:
    """Collector of BadInput errors: they are noted one by one and raised together."""

    def __init__(self) -> None:
        self.noted: list[BadInput] = []

    @contextmanager
    def noting(self) -> Iterator[None]:
        """A context within which BadInput is noted and not raised: for a check that later checks do not depend on."""
        try:
            yield
        except BadInput as fault:
            self.noted.append(fault)

    def result(self, read: Callable[Given, Result], *given: Given.args, **named: Given.kwargs) -> Result | None:
        """The result of ``read``; None if it raises BadInput, which is noted."""
        try:
            return read(*given, **named)
        except BadInput as fault:
            self.noted.append(fault)
            return None

    def raise_noted(self) -> None:
        """Raise the first noted error, with the rest in its ``others``; nothing where none was noted."""
        if self.noted:
            first, *others = {str(one): one for fault in self.noted for one in (fault, *fault.others)}.values()
            first.others = tuple(others)
            raise first


def brief(text: str, longest: int = LONGEST_PART) -> str:
    """The text on one line of printable characters; long quotations and numbers in it are shortened."""
    short = text if len(text) <= 20 * longest else f"{text[: 10 * longest]} … {text[-longest:]}"
    printable = "".join(c if c.isprintable() else " " if c.isspace() else _escaped(c) for c in short)
    numbered = re.sub(rf"\d{{{LONGEST_NUMBER + 1},}}", lambda m: f"{m[0][:12]} … {m[0][-4:]}", printable)
    cut = (f"{q[:70]} … {q[-20:]}" if len(q) > LONGEST_QUOTE + 1 else q for q in re.findall(r"`[^`]*`", numbered))
    quoted = re.sub(r"`[^`]*`", lambda _: next(cut), numbered)  # in pairs: what stands between two quotations is kept
    return quoted if len(quoted) <= longest else f"{quoted[: longest - 43]} … {quoted[-40:]}"


def _escaped(character: str) -> str:
    r"""The escape of a character that cannot be printed; of a file name's byte that is not UTF-8, that byte (\xff)."""
    code = ord(character)
    return f"\\x{code - 0xDC00:02x}" if 0xDC80 <= code <= 0xDCFF else character.encode("unicode_escape").decode()


def refuse_unknown(
    name: str, known: Iterable[str], place: Place | str, what: str, expected: str | None = None, *, code: str
) -> None:
    """Raise BadInput unless a name is a known one.

    Args:
        what: words in front of the name in the message, such as ``unknown contact``; "" for none.
        expected: what the message says was expected; by default the known names.
    """
    names = list(known)
    if name not in names:
        expected = expected or f"one of {', '.join(names)}"
        nearest = nearest_name(name, names)
        raise BadInput(place, f"{what} `{name}`".lstrip(), expected, nearest, code=code)


def nearest_name(word: str, known: Iterable[str]) -> str | None:
    """The known name most like ``word``, by ``difflib``; None where none is like it.

    Upper and lower case, a doubled letter, and a number at the end of one of the two names do not count. A name that
    is longer or shorter by more than a third is not alike. Of two letters, which have no two in three, one is enough if
    it is at its place, and only in one known name. The first three letters or more of a single known name are enough.
    """
    if len(word) > LONGEST_QUOTE:
        return None
    known = list(known)
    likeness: dict[str, tuple[float, float, int]] = {}
    for name in known:
        numbered = _NUMBER.sub("", name) == word or _NUMBER.sub("", word) == name
        one, other = ("", "") if numbered else (_without_repeats(word.lower()), _without_repeats(name.lower()))
        like = SequenceMatcher(None, one, other).ratio()
        if like >= LIKE and abs(len(one) - len(other)) <= max(len(name), len(word)) // 3:
            same_case = sum(a.isupper() == b.isupper() for a, b in zip(word, name, strict=False))
            likeness[name] = like, SequenceMatcher(None, word, name).ratio(), same_case
    found = max(likeness, key=likeness.__getitem__, default=None)
    return found or _like_two_letters(word, known) or _abbreviated(word, known)


def _abbreviated(word: str, known: Iterable[str]) -> str | None:
    """The only known name that begins with a word of at least three letters: ``tolerance`` for ``tol``."""
    begun = [name for name in known if name.lower().startswith(word.lower())] if len(word) > 2 else []
    return begun[0] if len(begun) == 1 else None


def _like_two_letters(word: str, known: Iterable[str]) -> str | None:
    """The only known name of two letters with one of a word of two letters at its place: ``mc`` for ``nc``."""
    if len(word) != 2 or not word.isalpha():
        return None
    found = [
        name for name in known if len(name) == 2 and name.isalpha() and (name[0] == word[0]) != (name[1] == word[1])
    ]
    return found[0] if len(found) == 1 else None


_NUMBER = re.compile(r"(?<=\w)_?\d+$")
"""Number at the end of a name."""


def _without_repeats(word: str) -> str:
    """The word with repeated letters reduced to one."""
    return re.sub(r"(.)\1+", r"\1", word)

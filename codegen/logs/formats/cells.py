"""Cells of a line of text: how a line is split into them, and which are numbers, missing values, dates or times."""

import csv
import re
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime

from codegen.base.errors import BadInput, Place
from codegen.logs.formats.text_lines import EXPECTED

SEPARATORS = (",", ";", "\t", "|")
COMMENT_MARKS = "#%/"
COMMENT = re.compile(
    r"\s*+(#(?!(n/a|nan|nv|value!|wert!|div/0!))|%|//|(?=[^|+]*[|+])(?=.*---)[\s|+:=-]++$)", re.IGNORECASE
)
"""Beginning of a comment, but not of a row whose first value is missing; or a rule such as ``|---|---|``."""
MINUS = "\N{MINUS SIGN}"
_NO_VALUE = (
    "na n/a n.a. nan nat null (null) nil none missing undef undefined invalid bad <na> - -- --- . ? \\n "
    "#n/a #nan #nv #value! #wert! #div/0!"
)
_NOT_FINITE = "nan(ind) 1.#ind 1.#qnan 1.#inf 1.#j ∞"
MISSING = {"", *_NO_VALUE.split(), *(f"{sign}{word}" for sign in ("", "-") for word in _NOT_FINITE.split())}
WORDS = {"true": 1.0, "false": 0.0}
NUMBER = re.compile(
    r"[+-]?(\d++\.?\d*+([eE][+-]?\d+)?|\.\d+([eE][+-]?\d+)?|inf|infinity|nan)\Z", re.ASCII | re.IGNORECASE
)
_HEX = re.compile(r"0[xX][0-9a-fA-F]{1,16}\Z", re.ASCII)
_DIGITS = re.compile(r"[+-]?(\d+|[.,]\d+)([.,]\d+)*(e[+-]?\d+)?\Z", re.ASCII | re.IGNORECASE)
"""A number with any separators of decimals and thousands."""
_DECIMAL_COMMA = r"(\d*,(\d{1,2}|\d{4,})|0?,\d{3}|\d{4,},\d{3}|\d+,\d+[eE][+-]?\d+)"
"""A number whose comma cannot separate thousands."""
_DATE = r"\d\d?[./-](?:\d\d?|[a-z]{3})[./-]\d{4}|\d{4}/\d\d?/\d\d?|[a-z]{3} +\d\d?|\d\d-\d\d"
"""A date in another order than ISO 8601's, with the month in letters, or without its year."""
_STAMP = re.compile(
    rf"(?:(?P<day>\d{{4}}-\d\d-\d\d)[T _]|(?:{_DATE}),?[ /]|\d+ days? )?"
    r"(?:(?P<hour>\d\d?):)?(?P<minute>\d\d?):(?P<second>\d\d)(?:[.,;:](?P<part>\d+(?:[.,]\d{3})?))?[ ]?"
    r"(?P<half>[AP]M)?(?P<zone>Z|[+-]\d\d:?\d\d)?\Z",
    re.ASCII | re.IGNORECASE,
)
"""Date and time of day by ISO 8601; a time of day, behind a date in another form or not; or minutes and seconds."""
_BASIC = re.compile(r"(\d{4})(\d\d)(\d\d)[T_-](\d\d)(\d\d)(\d\d)")
"""The basic form of ISO 8601, ``20260304T235958``."""


def delimiter_of(line: str) -> str:
    """The most frequent separator in a line; a comma if there is none."""
    return max(SEPARATORS, key=line.count)


def fields(text: str, delimiter: str, place: Place) -> list[str]:
    """The fields of a line, by blanks where ``delimiter`` is empty; raises BadInput if it cannot be split."""
    if not delimiter:
        return [part.strip('"') for part in text.split()]
    try:
        return next(csv.reader([text], delimiter=delimiter, skipinitialspace=True), [""])
    except csv.Error as error:
        raise BadInput(place, f"a line that cannot be split ({error})", EXPECTED, code="LOG001") from None


def all_fields(line: str, delimiter: str) -> list[str]:
    """The fields of any line; empty if it cannot be split."""
    try:
        return fields(line, delimiter, Place(""))
    except BadInput:
        return []


def filled_fields(line: str, delimiter: str) -> list[str]:
    """The fields of any line, without empty ones at its end."""
    found = all_fields(line, delimiter)
    while len(found) > 1 and not found[-1].strip():
        found.pop()
    return found


def is_row(line: str) -> bool:
    """Whether a plain line can be a row: not blank, and no comment."""
    return bool(line.strip()) and not COMMENT.match(line)


def significant(lines: Sequence[str]) -> Iterator[int]:
    """Indices of the lines that are neither blank nor a comment."""
    return (i for i, line in enumerate(lines) if is_row(line))


def is_number(text: str) -> bool:
    """Whether a text is a number, with any separators of decimals and thousands."""
    plain = text.strip().replace(MINUS, "-")
    return (NUMBER.match(plain) or _HEX.match(plain) or _DIGITS.match(plain)) is not None


def is_missing(text: str) -> bool:
    """Whether a text stands for a missing value."""
    return text.strip().lower() in MISSING


def is_value(text: str) -> bool:
    """Whether a text is a number, a missing value or a time."""
    return is_number(text) or is_missing(text) or stamp(text) is not None


def value_of(text: str, begun: datetime | None = None) -> float | None:
    """The number of a text, NaN for a missing value; of a column of times the seconds since ``begun``.

    Returns:
        None for another text; where all are times, also for a number.
    """
    if begun is None and NUMBER.match(text):
        return float(text)
    word = text.lower()
    if word in MISSING:
        return float("nan")
    if begun is not None:
        return seconds_since(begun, text)
    return float(int(text, 16)) if _HEX.match(text) else WORDS.get(word)


def decimal_sign(lines: Sequence[str], delimiter: str) -> str:
    """The decimal separator: a comma, a point, or empty if all commas may separate thousands.

    It is a comma if some comma cannot separate thousands. In a comma-separated file only quoted numbers count.
    """
    edge = re.escape(delimiter) if delimiter else r"\s"
    blanks = rf"[^\S{edge}]*+"  # but those that separate columns, such as tabs
    before, behind = rf'(?:^|[{edge}"]){blanks}[+-]?', rf'{blanks}(?=$|[{edge}"])'
    point = re.compile(rf"{before}\d*\.\d+{behind}", re.ASCII)
    sign = ","
    if delimiter == ",":
        before, behind, sign = r'"\s*[+-]?', r'\s*"', '"'
    clear = re.compile(f"{before}{_DECIMAL_COMMA}{behind}", re.ASCII)
    either = re.compile(rf"{before}\d{{1,3}},\d{{3}}{behind}", re.ASCII)
    found = "."
    for k, line in enumerate(lines):
        if sign in line:
            if clear.search(line):
                return "." if any(point.search(other) for other in lines[: k + 1] if "." in other) else ","
            found = "" if found and either.search(line) else found
    return found


def stamp(text: str) -> datetime | None:
    """A date and time of day by ISO 8601, UTC by default, or a time of day on a fixed day; None for another text.

    Of a date in another order only the time of day is taken, since 03/04 is ambiguous.
    """
    found = _matched(text)
    if found is None or (found["hour"] is None and not found["part"]):
        return None
    hour = int(found["hour"] or 0)
    if found["half"]:
        hour = hour % 12 + (12 if found["half"].upper() == "PM" else 0)
    part = re.sub(r"\D", "", found["part"] or "0")[:6]
    clock = f"{hour:02d}:{int(found['minute']):02d}:{found['second']}.{part:0<6}"
    try:
        at = datetime.fromisoformat(f"{found['day'] or '2000-01-01'}T{clock}{(found['zone'] or '').upper()}")
    except ValueError:
        return None
    return at if at.tzinfo else at.replace(tzinfo=UTC)


def seconds_since(begun: datetime, text: str) -> float | None:
    """Seconds from a stamp to that in a text, also past midnight where it has no date; None for another text."""
    at = stamp(text)
    if at is None:
        return None
    passed = (at - begun).total_seconds()
    return passed + restart_period(text) if passed < 0 else passed


def restart_period(text: str) -> float:
    """Seconds after which a stamp repeats: a day, or an hour if it has no hours; 0 with a date by ISO 8601."""
    found = _matched(text)
    if found is None or found["day"]:
        return 0.0
    return 86_400.0 if found["hour"] else 3600.0


def _matched(text: str) -> re.Match[str] | None:
    """The parts of a stamp; None for another text."""
    return _STAMP.match(text.strip()) or _STAMP.match(_BASIC.sub(r"\1-\2-\3T\4:\5:\6", text.strip(), count=1))

"""Dates and times of day as texts: their forms, and the seconds between two of them."""

from __future__ import annotations

import re
from datetime import UTC, datetime

_NO_DIGIT = re.compile(r"\D")
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


def _matched(text: str) -> re.Match[str] | None:
    """The parts of a stamp; None for another text."""
    return _STAMP.match(text.strip()) or _STAMP.match(_BASIC.sub(r"\1-\2-\3T\4:\5:\6", text.strip(), count=1))


def seconds_since(begun: datetime | None, text: str) -> float | None:
    """Seconds from a stamp to that in a text, also past midnight where it has no date; None for another text."""
    at = None if begun is None else stamp(text)
    if begun is None or at is None:
        return None
    passed = (at - begun).total_seconds()
    return passed + restart_period(text) if passed < 0 else passed


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
    clock = f"{hour:02d}:{int(found['minute']):02d}:{found['second']}.{_NO_DIGIT.sub('', found['part'] or '0')[:6]:0<6}"
    try:
        at = datetime.fromisoformat(f"{found['day'] or '2000-01-01'}T{clock}{(found['zone'] or '').upper()}")
    except ValueError:
        return None
    return at if at.tzinfo else at.replace(tzinfo=UTC)


def restart_period(text: str) -> float:
    """Seconds after which a stamp repeats: a day, or an hour if it has no hours; 0 with a date by ISO 8601."""
    found = _matched(text)
    if found is None or found["day"]:
        return 0.0
    return 86_400.0 if found["hour"] else 3600.0

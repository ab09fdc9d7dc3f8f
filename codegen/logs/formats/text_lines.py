"""Decoding of text files to lines: UTF-8, UTF-16 with a byte order mark, or Windows-1252; whole or in pieces."""

import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE, getincrementaldecoder
from collections.abc import Iterator
from itertools import chain

from codegen.base.errors import BadInput, Place

EXPECTED = "a CSV log: a header line with names, then rows of numbers"
_COLOUR = re.compile(r"\x1b\[[\d;]*[A-Za-z]", re.ASCII)
"""A terminal's code for a colour."""
LONGEST_LINE = 1_000_000
"""Most bytes of a line."""
LINES_SEARCHED = 1000
"""Lines at the start of a file among which the first rows of numbers must be."""


def text_of(file: str, data: bytes, before: int = 0) -> tuple[str, tuple[str, ...]]:
    """The text with every line end as ``\\n``, and notes on how it was read."""
    wanted = f"{EXPECTED}, in UTF-8"
    notes: list[str] = []
    size = len(data)
    text = None
    _refuse_long_line(file, data.rstrip(b"\0"), before)
    if data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        try:
            text = data.decode("utf-16")
            notes.append("the file is in UTF-16")
        except UnicodeDecodeError:
            pass
    if text is None:
        data = data.rstrip(b"\0")
        if len(data) < size:
            notes.append(f"{size - len(data)} zero bytes at the end, as a loss of power leaves them, are not read")
        zero = data.find(b"\0")
        if zero >= 0:
            place = Place(file, before + data.count(b"\n", 0, zero) + 1)
            raise BadInput(place, f"byte {zero} is zero: binary data or UTF-16", wanted, code="LOG001")
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            line = before + data.count(b"\n", 0, error.start) + 1
            if re.search(rb"[\x00-\x08\x0e-\x1f\x7f\x81\x8d\x8f\x90\x9d]", data):  # not printable in Windows-1252
                found = f"byte {error.start} is not UTF-8"
                raise BadInput(Place(file, line), found, wanted, code="LOG001") from None
            text = data.decode("cp1252")
            notes.append(f"line {line} is not UTF-8: the file is read as Windows-1252")
    if "\x1b[" in text:
        text = _COLOUR.sub("", text)
    return text.replace("\r\n", "\n").replace("\r", "\n").replace("\n\ufeff", "\n"), tuple(notes)  # of joined files


def _refuse_long_line(file: str, data: bytes, before: int) -> None:
    """Raise BadInput for a line of more than ``LONGEST_LINE`` bytes, before the bytes are decoded and copied."""
    start = 0
    while len(data) - start > LONGEST_LINE:
        most = start + LONGEST_LINE + 1
        end = max(data.rfind(mark, start, most) for mark in (b"\n", b"\r"))
        if end < 0:
            line = before + (data.count(b"\n", 0, start) or data.count(b"\r", 0, start)) + 1
            expected = f"{EXPECTED}; at most {LONGEST_LINE} bytes a line"
            raise BadInput(Place(file, line), f"a line of more than {LONGEST_LINE} bytes", expected, code="LOG010")
        start = end + 1


def lines_of(given: Iterator[bytes], file: str, notes: list[str]) -> Iterator[list[str]]:
    """The whole lines of each piece of a file; at the end also an incomplete last line.

    Args:
        given: the bytes, as they arrive.
        notes: notes on how the bytes are read are added to this list, each once.
    """
    rest, before = b"", 0
    for piece in _in_utf8(given, file, notes):
        if b"\0" in piece:
            raise BadInput(file, "a zero byte: binary data, or what a loss of power leaves", EXPECTED, code="LOG001")
        end = piece.rfind(b"\n") + 1
        if not end:
            rest += piece
        else:
            text, words = text_of(file, rest + piece[:end], before)
            notes += [word for word in words if word not in notes]
            lines = text.split("\n")[:-1]
            before += len(lines)
            yield lines
            rest = piece[end:]
        _refuse_long_line(file, rest, before)
    if rest:
        text, words = text_of(file, rest, before)
        notes += [word for word in words if word not in notes]
        yield text.removesuffix("\n").split("\n")


def _in_utf8(given: Iterator[bytes], file: str, notes: list[str]) -> Iterator[bytes]:
    """The pieces as they are, or converted to UTF-8 if they begin with the mark of UTF-16, with a note."""
    head = b""
    while len(head) < len(BOM_UTF16_LE) and (piece := next(given, None)) is not None:
        head += piece
    if not head.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        yield from chain([head], given)
        return
    if (note := "the file is in UTF-16") not in notes:
        notes.append(note)
    decoder = getincrementaldecoder("utf-16")()
    try:
        for piece in chain([head], given):
            yield decoder.decode(piece).encode("utf-8")
        yield decoder.decode(b"", True).encode("utf-8")
    except UnicodeError:  # half a letter at the end, or half of a pair
        raise BadInput(file, "bytes that are not text in UTF-16, as their mark says", EXPECTED, code="LOG001") from None

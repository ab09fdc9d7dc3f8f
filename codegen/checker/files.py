"""Files that a certificate or a person names: regular files of a stated size and nothing else; and the form of JSON."""

import errno
import json
import os
import stat
from collections.abc import Callable
from pathlib import Path
from reprlib import repr as brief
from typing import Any

MAX_FILE = 50_000_000


def read(path: Path, largest: int = MAX_FILE) -> bytes:
    """The bytes of a regular file, at most ``largest``; nothing waits for the writer of a pipe. Raises OSError."""
    with open(path, "rb", opener=lambda name, flags: os.open(name, flags | getattr(os, "O_NONBLOCK", 0))) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise OSError(errno.EINVAL, "no regular file", str(path))
        content = file.read(largest + 1)
        if content is None:  # some files of /proc count as regular and wait like a pipe
            raise OSError(errno.EAGAIN, "nothing to read", str(path))
    if len(content) > largest:
        raise OSError(errno.EFBIG, f"more than {largest} bytes", str(path))
    return content


class Refused(Exception):
    """The certificate does not hold, or is not written as its format demands; the message says what and where."""


def demand(condition: bool, fault: str) -> None:
    if not condition:
        raise Refused(fault)


def parsed(text: str | bytes) -> Any:
    """JSON in UTF-8 without a byte order mark, with numbers as the bytes that are written. Raises ValueError.

    Refused is an object in which a key appears twice, since readers could take different values of it.
    """
    bare, text = str.encode, text if isinstance(text, str) else text.decode()

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        demand(len(dict(pairs)) == len(pairs), f"a key appears twice in an object: {brief([key for key, _ in pairs])}")
        return dict(pairs)

    return json.loads(text, object_pairs_hook=once, parse_int=bare, parse_float=bare, parse_constant=bare)


def kind(raw: Any) -> str:
    """Words for what JSON is."""
    kinds = {dict: "an object", list: "a list", str: "a text", bytes: "a number", type(None): "null"}
    return kinds.get(type(raw), "true or false")


def named(names: Any, form: dict[str, Any]) -> bool:
    """Whether these are the names of a form; those with a ? behind them may be missing."""
    return {x for x in form if x[-1:] != "?"} <= {*names} <= {x.rstrip("?") for x in form}


def as_text(raw: Any, form: str | None, where: str) -> Any:
    demand(form is None or type(raw) is str, f"{where}: expected is a text, found {kind(raw)}")
    return raw


def conform(raw: Any, form: Any, where: str, leaf: Callable[[Any, Any, str], Any] = as_text) -> Any:
    """JSON, if it is of a form: [form] a list, {key: form} an object; or Refused, with the place.

    An object has just the keys that the form has (``named``), or if its only one is "" or in capitals, any for which
    ``leaf`` takes that. A text for a list would be read as one of its characters.

    Args:
        leaf: (what is neither a list nor an object by its form, the form, the place) -> its value, or Refused. By
            default "" is a text, and None is anything.
    """
    if not isinstance(form, (list, dict)):
        return leaf(raw, form, where)
    demand(type(raw) is type(form), f"{where}: expected is {kind(form)}, found {kind(raw)}")
    if form == [""] and leaf is as_text and all(type(x) is str for x in raw):  # fast: of this form are most lists
        return raw
    if isinstance(form, list):
        return [conform(x, form[0], f"{where}[{i}]", leaf) for i, x in enumerate(raw)]
    if (free := next(iter(form))) == free.upper():
        return {leaf(k, free, where): conform(x, form[free], f"{where}.{brief(k)[1:-1]}", leaf) for k, x in raw.items()}
    of = {x.rstrip("?"): part for x, part in form.items()}
    wrong = {x for x in raw.keys() ^ of.keys() if x in raw or f"{x}?" not in form}
    demand(not wrong, f"{where}: fields are not so named, missing or extra: {brief(wrong)}")
    return {k: conform(x, of[k], f"{where}.{k}", leaf) for k, x in raw.items()}

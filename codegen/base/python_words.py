"""Messages of a verb that is called from Python: its arguments in place of the command's options.

A message is written for the command, ``--plant: …``. Where no command is running, the verb rewrites it:
``simulate(): `plant`: …``, and ``columns={"x": "…"}`` for ``--column x=…``. A whole command in quotes, such as
```stiction gains axis.yaml```, is left as it is.
"""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import fields, is_dataclass
from inspect import signature
from shlex import split
from typing import Any, get_args, get_type_hints

from codegen.base.errors import BadInput, Place

_OF_A_COMMAND: ContextVar[bool] = ContextVar("of a command", default=False)
"""Whether a command is running, whose messages name options."""
_OTHER_NAMES = {"fmi": "version", "from": "source", "check": "check_only"}
"""Option → argument, where neither is the other or its plural."""
_QUOTED_COMMAND = r"`stiction [^`]*`"
_VALUE = r"""(?:'[^']*'|"[^"]*"|[^'"`])*|[^`]*"""
"""The value of an option between backquotes; a name within quotation marks may have a backquote itself."""
_OPTION = re.compile(
    rf"{_QUOTED_COMMAND}|`--(?P<quoted>[a-z][a-z-]*)(?:[ =](?P<value>{_VALUE}))?`"
    r"|(?<![\w-])--(?P<bare>[a-z][a-z-]*)(?: (?P<last>[\w.-]+)(?=$|;))?"
)


@contextmanager
def within_command() -> Iterator[None]:
    """A context in which messages name the options of the command."""
    token = _OF_A_COMMAND.set(True)
    try:
        yield
    finally:
        _OF_A_COMMAND.reset(token)


@contextmanager
def in_words_of_caller(work: Callable[..., object]) -> Iterator[None]:
    """A context in which a verb runs: its errors name the verb's arguments, unless a command called it."""
    try:
        yield
    except BadInput as fault:
        if not _OF_A_COMMAND.get():
            reword(fault, work)
        raise


def reword(fault: BadInput, work: Callable[..., object]) -> None:
    """Put a verb's arguments in place of the command's options, in a fault and the further ones that it holds."""
    arguments = _arguments(work)

    def placed(place: Place) -> Place:
        option = re.fullmatch(r"--([a-z-]+)", place.file)
        name = option[1] if option else place.file.lower() if place.file.isupper() else ""
        if found := _argument(name, arguments):
            owner, argument = found
            return Place(f"{owner}(): `{argument}`", place.line, said(place.key))
        return Place(place.file, place.line, said(place.key))

    def said(text: str) -> str:
        return _OPTION.sub(replaced, text)

    def replaced(found: re.Match[str]) -> str:
        option, value = found["quoted"] or found["bare"], found["value"] or found["last"]
        known = _argument(option, arguments) if option else None
        if known is None:
            return found[0]
        argument, kind = known[1], arguments[known[1]][1]
        if value and "=" in value:
            try:
                words = split(f"--{option} {value}")
            except ValueError:  # a quotation mark without its end: a text of the user, and no option of ours
                return found[0]
            pairs = [word.partition("=") for word in words if "=" in word]
            given = f"{argument}={{{', '.join(f'{_text(name)}: {_text(column)}' for name, _, column in pairs)}}}"
        elif value:
            given = f'{argument}="{value}"'
        elif kind is bool:
            given = f"{argument}=True"
        else:
            return f"`{argument}`"
        return f"`{given}`" if found["quoted"] else given

    for one in (fault, *fault.others):
        one.reword(placed, said)


Arguments = dict[str, tuple[str, Any]]
"""Argument → the function or class that takes it, and its type."""


def _arguments(work: Callable[..., object]) -> Arguments:
    """The arguments of a verb, and those of the dataclasses that it takes as an argument."""
    hints = get_type_hints(work)
    found: Arguments = {}
    for name in signature(work).parameters:
        found[name] = work.__name__, hints.get(name)
    for hint in hints.values():
        for kind in get_args(hint):
            if isinstance(kind, type) and is_dataclass(kind):
                found = {field.name: (kind.__name__, None) for field in fields(kind)} | found
    return found


def _text(words: str) -> str:
    """Words as a literal of Python, in the quotes of the docs."""
    return repr(words) if '"' in words or "\\" in words else f'"{words}"'


def _argument(option: str, arguments: Arguments) -> tuple[str, str] | None:
    """(function or class, argument) of an option; None where it has no counterpart."""
    name = option.replace("-", "_")
    chosen = next((n for n in (name, f"{name}s", _OTHER_NAMES.get(name, "")) if n and n in arguments), None)
    return (arguments[chosen][0], chosen) if chosen else None

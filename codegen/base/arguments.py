"""Check of a verb's arguments by the annotations of its signature, and the words for what was given and expected.

A mistake of the caller is so reported as his, with the arguments that the verb has, and not as an internal error.
"""

from __future__ import annotations

import inspect
import os
import types
from collections.abc import Callable, Mapping, Sequence, Set
from contextlib import suppress
from numbers import Integral, Real
from pathlib import Path
from typing import Any, Union, get_args, get_origin, get_type_hints

from codegen.base.errors import BadInput, nearest_name

_NAMES: dict[Any, tuple[type | tuple[type, ...], str]] = {
    Path: (os.PathLike, "a path (text or a Path)"),
    str: (str, "text"),
    bool: (Integral, "True or False"),
    int: (Integral, "a whole number"),
    float: (Real, "a number"),
    Mapping: (Mapping, "a mapping"),
    Sequence: ((Sequence, Set), "a list"),
}
"""Type of an annotation → (admissible type of an argument, its name in messages). A class that is not here stands for
itself; other annotations are not checked."""


def refuse_wrong_arguments(work: Callable[..., object], given: tuple[object, ...], named: Mapping[str, object]) -> None:
    """Raise where arguments do not fit a verb's signature.

    Raises:
        TypeError: for a missing argument, or one that the verb does not have.
        BadInput: for an argument of another type than its annotation says, or a function that takes other arguments.
    """
    signature = inspect.signature(work)
    try:
        bound = signature.bind(*given, **named)
    except TypeError as error:
        unknown = next((n for n in named if n not in signature.parameters), None)
        known = _known(signature, unknown) if unknown or "missing" not in str(error) else ""
        words = f"got an unexpected keyword argument {unknown!r}" if unknown else error
        raise TypeError(f"{work.__name__}(): {words}{known}") from None
    try:
        hints = get_type_hints(work)
    except NameError:  # of a type that is imported for the type checker alone
        return
    for name, value in bound.arguments.items():
        if name in hints and not _fits(value, hints[name]):
            raise BadInput(f"{work.__name__}(): `{name}`", _found(value), _words(hints[name]), code="CALL001")


def _known(signature: inspect.Signature, unknown: str | None) -> str:
    """The arguments that a verb has, after an unknown one or too many, and the one that was probably meant.

    The first one of most verbs, ``source``, is the machine itself where the verb is a method.
    """
    first, *others = signature.parameters
    known = others if first == "source" else [first, *others]
    nearest = nearest_name(unknown, known) if unknown else None
    meant = f" (did you mean {nearest!r}?)" if nearest else ""
    return f"; it has {', '.join(known) or 'no arguments'}{meant}"


def _found(value: object) -> str:
    """The type of a value in words; for a list or mapping also that of its first element that is no text or path."""
    if isinstance(value, str) and not value:
        return "an empty text"
    if inspect.isroutine(value):
        with suppress(ValueError):
            return f"a function with the arguments {str(inspect.signature(value)).partition(' ->')[0]}"
    parts = value.values() if isinstance(value, Mapping) else value if isinstance(value, list | tuple | Set) else ()
    inner = next((_type(part) for part in parts if not isinstance(part, str | os.PathLike)), None)
    return f"an object of the type {_type(value)}" + (f" with {one(inner)} in it" if inner else "")


def _type(value: object) -> str:
    """The name of a value's type, with the library in front of it: ``numpy.ndarray``."""
    library = type(value).__module__.partition(".")[0]
    return type(value).__name__ if library in ("builtins", "codegen") else f"{library}.{type(value).__name__}"


def one(noun: str) -> str:
    """A noun with its indefinite article."""
    return f"{'an' if noun[0] in 'aeioAEIO' else 'a'} {noun}"


def _alternatives(hint: Any) -> tuple[Any, ...]:
    """The members of a union, or the annotation alone."""
    return get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)


def _fits(value: object, hint: Any) -> bool:
    """Whether a value has a type that the annotation allows; entries of lists and mappings are checked too.

    An empty text is no path: ``Path("")`` is the working directory.
    """
    kinds = _alternatives(hint)
    if Path in kinds and isinstance(value, str) and not value:
        return False
    return any(_fits_one(value, one) for one in kinds)


def _fits_one(value: object, hint: Any) -> bool:
    """As ``_fits``, for an annotation that is no union."""
    kind, inner = get_origin(hint) or hint, get_args(hint)
    if kind is Callable:
        return callable(value) and _takes(value, inner[0])
    if kind is bool and (type(value).__module__, type(value).__name__.rstrip("_")) == ("numpy", "bool"):
        return True  # which NumPy does not register as an Integral
    if kind in (int, float) and isinstance(value, bool):
        return False
    known = _NAMES[kind][0] if kind in _NAMES else kind
    if kind is Any or not isinstance(known, type | tuple):
        return True
    if not isinstance(value, known) or (kind is Sequence and isinstance(value, str | bytes)):
        return False
    if kind is Mapping and isinstance(value, Mapping):
        return all(_fits(k, inner[0]) and _fits(v, inner[1]) for k, v in value.items())
    if kind is Sequence and isinstance(value, Sequence | Set):
        return all(_fits(part, inner[0]) for part in value)
    return True


def _takes(function: Callable[..., object], arguments: Any) -> bool:
    """Whether a function can be called with so many arguments; True where Python does not tell."""
    try:
        inspect.signature(function).bind(*arguments)
    except ValueError:  # no signature, as of some functions of a compiled library
        return True
    except TypeError:
        return False
    return True


def _words(hint: Any) -> str:
    """The types that an annotation allows, in words: ``a path (text or a Path), or a list``."""
    parts = _alternatives(hint)
    words = []
    for part in parts:
        kind, inner = get_origin(part) or part, get_args(part)
        if part is type(None) or (part is str and Path in parts):
            continue
        if kind in (Mapping, Sequence):
            each = " and ".join(dict.fromkeys(_words(one) for one in inner))
            words.append(f"{_NAMES[kind][1]} of such" if each in words else f"{_NAMES[kind][1]} of {each}")
        elif kind is Callable:
            words.append(f"a function of {' and '.join(map(_words, inner[0]))}")
        else:
            words.append(_NAMES[kind][1] if kind in _NAMES else getattr(kind, "_in_words", one(kind.__name__)))
    return " or ".join([*words, *(["None"] if type(None) in parts else [])])

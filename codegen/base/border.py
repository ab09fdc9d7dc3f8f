"""Decorators of the verbs: an exception that a verb does not declare becomes an InternalError, its ``__cause__``.

Arguments that do not fit a verb's signature are reported as a mistake of the caller, not as an internal error.

Within a verb BLAS runs on one thread. So the rounding of its sums, and decisions that depend on it, are the same for
any number of cores. It also is faster: with several threads a diagnosis, whose matrices are small, took 2.7 times the
processor time on a busy machine.
"""

from __future__ import annotations

import inspect
import os
import types
from collections.abc import Callable, Mapping, Sequence, Set
from functools import wraps
from numbers import Integral, Real
from pathlib import Path
from traceback import extract_tb
from typing import Any, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

from codegen.base.errors import BadInput, InternalError, Place

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
        BadInput: for an argument of another type than its annotation says.
    """
    try:
        bound = inspect.signature(work).bind(*given, **named)
    except TypeError as error:
        raise TypeError(f"{work.__name__}(): {error}") from None
    try:
        hints = get_type_hints(work)
    except NameError:  # of a type that is imported for the type checker alone
        return
    for name, value in bound.arguments.items():
        if name in hints and not _fits(value, hints[name]):
            raise BadInput(f"{work.__name__}(): `{name}`", _found(value), _words(hints[name]), code="CALL001")


def _found(value: object) -> str:
    """The type of a value in words; for a list or mapping also that of its first element that is no text or path."""
    parts = value.values() if isinstance(value, Mapping) else value if isinstance(value, list | tuple | Set) else ()
    inner = next((type(part).__name__ for part in parts if not isinstance(part, str | os.PathLike)), None)
    return f"an object of the type {type(value).__name__}" + (f" with {_one(inner)} in it" if inner else "")


def _one(noun: str) -> str:
    """A noun with its indefinite article."""
    return f"{'an' if noun[0] in 'aeioAEIO' else 'a'} {noun}"


def _alternatives(hint: Any) -> tuple[Any, ...]:
    """The members of a union, or the annotation alone."""
    return get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)


def _fits(value: object, hint: Any) -> bool:
    """Whether a value has a type that the annotation allows; entries of lists and mappings are checked too."""
    return any(_fits_one(value, one) for one in _alternatives(hint))


def _fits_one(value: object, hint: Any) -> bool:
    """As ``_fits``, for an annotation that is no union."""
    kind, inner = get_origin(hint) or hint, get_args(hint)
    if kind is Callable:
        return callable(value)
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
            words.append("a function")
        else:
            words.append(_NAMES[kind][1] if kind in _NAMES else getattr(kind, "_in_words", _one(kind.__name__)))
    return " or ".join([*words, *(["None"] if type(None) in parts else [])])


Given = ParamSpec("Given")
Result = TypeVar("Result")
OURS = (BadInput, InternalError, BrokenPipeError)
"""Exceptions that every verb may raise."""
OWN_CODE: set[str] = set()
"""Files with Python code of the user, as named by him; an error in it is an input that cannot be used."""


def fault_of_own_code(error: Exception) -> BadInput | None:
    """An error that was raised in the user's own code, or below it, as BadInput with the line there; else None."""
    lines = [frame for frame in extract_tb(error.__traceback__) if frame.filename in OWN_CODE]
    if not lines:
        return None
    place = Place(lines[-1].filename, lines[-1].lineno)
    expected = "code that runs, as in docs/effects.md, an effect of your own"
    return BadInput(place, f"{type(error).__name__}: {error}", expected, code="EFFECT001")


def verb_that_raises(
    *meant: type[Exception],
) -> Callable[[Callable[Given, Result]], Callable[Given, Result]]:
    """A decorator of a verb: every exception but those it declares becomes an InternalError with it as its cause.

    KeyboardInterrupt and SystemExit pass. Arguments that do not fit the verb's signature are refused before its work.

    Args:
        meant: the exceptions other than BadInput that the verb declares.
    """

    passed: tuple[type[Exception], ...] = (*OURS, *meant)

    def border(work: Callable[Given, Result]) -> Callable[Given, Result]:
        @wraps(work)
        def bordered(*given: Given.args, **named: Given.kwargs) -> Result:
            from threadpoolctl import threadpool_limits

            refuse_wrong_arguments(work, given, named)
            try:
                with threadpool_limits(limits=1, user_api="blas"):
                    return work(*given, **named)
            except passed:
                raise
            except Exception as error:
                if own := fault_of_own_code(error):
                    raise own from error
                files = [
                    os.fspath(value) for value in (*given, *named.values()) if isinstance(value, str | os.PathLike)
                ]
                raise InternalError(work.__name__, files, error) from error

        return bordered

    return border


def verb(work: Callable[Given, Result]) -> Callable[Given, Result]:
    """Decorator of a verb that declares no exception but BadInput; see ``verb_that_raises``."""
    return verb_that_raises()(work)

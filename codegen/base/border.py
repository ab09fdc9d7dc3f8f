"""Decorators of the verbs: an exception that a verb does not declare becomes an InternalError, its ``__cause__``.

Arguments that do not fit a verb's signature are reported as a mistake of the caller, not as an internal error. What a
function or iterator of the caller raises (``progress``, ``tell``) leaves the verb as it is: he may end the verb by it.

Within a verb BLAS runs on one thread. So the rounding of its sums, and decisions that depend on it, are the same for
any number of cores. It also is faster: with several threads a diagnosis, whose matrices are small, took 2.7 times the
processor time on a busy machine.
"""

from __future__ import annotations

import inspect
import os
import types
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from contextlib import suppress
from functools import wraps
from numbers import Integral, Real
from pathlib import Path
from traceback import extract_tb
from typing import Any, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

from codegen.base.errors import BadInput, InternalError, Place, nearest_name

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
        known = "" if "missing" in str(error) else _known(signature, named)
        raise TypeError(f"{work.__name__}(): {error}{known}") from None
    try:
        hints = get_type_hints(work)
    except NameError:  # of a type that is imported for the type checker alone
        return
    for name, value in bound.arguments.items():
        if name in hints and not _fits(value, hints[name]):
            raise BadInput(f"{work.__name__}(): `{name}`", _found(value), _words(hints[name]), code="CALL001")


def _known(signature: inspect.Signature, named: Mapping[str, object]) -> str:
    """The arguments that a verb has, after an unknown one or too many, and the one that was probably meant."""
    known = [name for name in signature.parameters if name != "source"]
    unknown = next((name for name in named if name not in signature.parameters), None)
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
    return f"an object of the type {_type(value)}" + (f" with {_one(inner)} in it" if inner else "")


def _type(value: object) -> str:
    """The name of a value's type, with the library in front of it: ``numpy.ndarray``."""
    library = type(value).__module__.partition(".")[0]
    return type(value).__name__ if library in ("builtins", "codegen") else f"{library}.{type(value).__name__}"


def _one(noun: str) -> str:
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


def _in_order(value: object) -> object:
    """A set of texts or paths as a list in their order: its own order differs from process to process."""
    return sorted(value, key=os.fspath) if isinstance(value, set | frozenset) else value


class _RaisedByCaller(BaseException):
    """An exception of the caller's own code on its way through a verb, none of whose handlers is meant for it."""

    def __init__(self, given: _OfCaller, error: Exception) -> None:
        super().__init__()
        self.given, self.error = given, error


class _OfCaller:
    """A function or an iterator that the caller of a verb gave."""

    def __init__(self, given: Any) -> None:
        self._given = given

    def __call__(self, *values: object) -> object:
        try:
            return self._given(*values)
        except Exception as error:
            raise _RaisedByCaller(self, error) from None

    def __iter__(self) -> _OfCaller:
        return self

    def __next__(self) -> object:
        try:
            return next(self._given)
        except StopIteration:
            raise
        except Exception as error:
            raise _RaisedByCaller(self, error) from None


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
            theirs = [v for v in (*given, *named.values()) if callable(v) or isinstance(v, Iterator)]
            marked = {id(v): _OfCaller(v) for v in theirs if not isinstance(v, _OfCaller)}  # those of a verb around are
            values: Any = [marked.get(id(value), _in_order(value)) for value in given]
            options: Any = {name: marked.get(id(value), _in_order(value)) for name, value in named.items()}
            try:
                with threadpool_limits(limits=1, user_api="blas"):
                    return work(*values, **options)
            except _RaisedByCaller as told:
                if told.given not in marked.values():
                    raise  # through a verb around this one, whose caller gave the function
                raised = told.error
            except passed:
                raise
            except Exception as error:
                if own := fault_of_own_code(error):
                    raise own from error
                files = [
                    os.fspath(value) for value in (*given, *named.values()) if isinstance(value, str | os.PathLike)
                ]
                raise InternalError(work.__name__, files, error) from error
            raise raised  # here, so that it has no context of ours

        return bordered

    return border


def verb(work: Callable[Given, Result]) -> Callable[Given, Result]:
    """Decorator of a verb that declares no exception but BadInput; see ``verb_that_raises``."""
    return verb_that_raises()(work)

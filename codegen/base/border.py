"""Decorator of the verbs: it checks arguments, limits BLAS to one thread, and reports errors in a user's own code.

With one thread the rounding of sums in BLAS, and decisions that depend on it, are the same for any number of cores. It
also is faster: with several threads a diagnosis, whose matrices are small, took 2.7 times the processor time on a busy
machine.
"""

import os
import sys
from collections.abc import Callable, Mapping, Sequence, Set
from functools import lru_cache, wraps
from inspect import signature
from numbers import Integral, Real
from pathlib import Path
from traceback import extract_tb
from types import NoneType, UnionType
from typing import Any, ParamSpec, Protocol, TypeVar, Union, get_args, get_origin, get_type_hints, runtime_checkable

from codegen.base.errors import BadInput, Place, nearest_name
from codegen.base.python_words import in_words_of_caller

Given = ParamSpec("Given")
Result = TypeVar("Result")
OWN_CODE: set[str] = set()
"""Files with Python code of the user, as named by him; an error in it is an input that cannot be used."""


@runtime_checkable
class Arrays(Protocol):
    """Arrays by name: a mapping, a DataFrame of pandas, or what ``numpy.load`` makes of an archive."""

    def keys(self) -> Any: ...

    def __getitem__(self, name: Any, /) -> Any: ...


def verb(work: Callable[Given, Result]) -> Callable[Given, Result]:
    """A decorator that refuses arguments of a wrong type, and reports an error in the user's own code as BadInput.

    Other exceptions pass as they are: those of the tool, and those of a function that the caller gave, such as
    ``progress``.
    """

    @wraps(work)
    def bordered(*given: Given.args, **named: Given.kwargs) -> Result:
        refuse_wrong_arguments(work, given, named)
        values: Any = [_in_order(value) for value in given]
        options: Any = {name: _in_order(value) for name, value in named.items()}
        with _pools(len(sys.modules)).limit(limits=1, user_api="blas"), in_words_of_caller(work):
            try:
                return work(*values, **options)
            except BadInput:
                raise
            except Exception as error:
                if own := _fault_of_own_code(error):
                    raise own from error
                raise

    return bordered


@lru_cache(maxsize=1)
def _pools(modules: int) -> Any:
    """The threads of the libraries that this process has loaded, found anew once there are further modules."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def _fault_of_own_code(error: Exception) -> BadInput | None:
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


_KINDS: dict[Any, tuple[type | tuple[type, ...], str]] = {
    Path: (os.PathLike, "a path"),
    str: (str, "text"),
    bool: (bool, "True or False"),
    int: (Integral, "a whole number"),
    float: (Real, "a number"),
    Mapping: (Mapping, "a mapping"),
    Sequence: ((Sequence, Set), "a list"),
    Arrays: (Arrays, 'arrays by name, as {"t": t, "x": x}'),
    Callable: (Callable, "a function"),  # type: ignore[dict-item]
    NoneType: (NoneType, "None"),
}
"""Annotation → admissible types of an argument, and its name in messages. Other classes stand for themselves."""


def refuse_wrong_arguments(work: Callable[..., object], given: tuple[object, ...], named: Mapping[str, object]) -> None:
    """Raise BadInput for an argument of another type than its annotation says, and TypeError for an unknown one.

    Missing arguments are left to the call itself, which raises Python's own TypeError.
    """
    known = [name for name in signature(work).parameters if name != "self"]
    unknown = next((name for name in named if name not in known), None)
    if unknown is not None:
        nearest = nearest_name(unknown, known)
        meant = f" (did you mean {nearest!r}?)" if nearest else ""
        words = f"{work.__name__}() got an unexpected keyword argument {unknown!r}; expected one of {', '.join(known)}"
        raise TypeError(words + meant)
    try:
        bound = signature(work).bind(*given, **named)
    except TypeError:
        return
    hints = get_type_hints(work)
    for name, value in bound.arguments.items():
        if name in hints and not _fits(value, hints[name]):
            raise BadInput(f"{work.__name__}(): `{name}`", _found(value), _words(hints[name]), code="CALL001")


def _fits(value: object, hint: Any) -> bool:
    """Whether a value has a type that the annotation allows; entries of lists and mappings are checked too."""
    kind, inner = get_origin(hint) or hint, get_args(hint)
    if kind in (Union, UnionType):
        if Path in inner and isinstance(value, str) and not value:
            return False  # ``Path("")`` would be the working directory
        return any(_fits(value, one) for one in inner)
    wanted = _KINDS[kind][0] if kind in _KINDS else kind
    if kind is bool and _name(type(value)) in ("numpy.bool", "numpy.bool_"):
        return True
    if not isinstance(value, wanted) or (kind in (int, float) and isinstance(value, bool)):
        return False
    if kind is Mapping and isinstance(value, Mapping):
        return all(_fits(key, inner[0]) and _fits(entry, inner[1]) for key, entry in value.items())
    if kind is Sequence and isinstance(value, Sequence | Set):
        return not isinstance(value, str | bytes) and all(_fits(entry, inner[0]) for entry in value)
    return True


def _found(value: object) -> str:
    """The type of a value in words, with its library, and the types of a list's or mapping's entries."""
    if isinstance(value, str) and not value:
        return "an empty text"
    entries = value.values() if isinstance(value, Mapping) else value if isinstance(value, list | tuple | Set) else ()
    types = f" of {', '.join(sorted({_name(type(entry)) for entry in entries}))}" if entries else ""
    return f"an object of the type {_name(type(value))}{types}"


def _name(kind: type) -> str:
    library = kind.__module__.partition(".")[0]
    return kind.__qualname__ if library in ("builtins", "codegen") else f"{library}.{kind.__qualname__}"


def _words(hint: Any) -> str:
    """The types that an annotation allows, in words: ``a path or a list of paths``."""
    kind, inner = get_origin(hint) or hint, get_args(hint)
    if kind in (Union, UnionType):
        shown = [one for one in inner if not (one is str and Path in inner)]
        each = [_words(one) for one in shown]
        if len(each) > 2 and get_origin(shown[-1]) is Sequence:
            return f"{', '.join(each[:-1])}, or a list of these"
        return " or ".join(each)
    entered = dict.fromkeys(map(_words, inner)) if kind in (Mapping, Sequence) else ()
    entries = " and ".join(f"{one[2:]}s" if one.startswith("a ") else one for one in entered)
    words = _KINDS[kind][1] if kind in _KINDS else getattr(kind, "in_words", f"the type {kind.__name__}")
    return f"{words} of {entries}" if entries else words

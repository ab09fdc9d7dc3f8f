"""Decorators of the verbs: an exception that a verb does not declare becomes an InternalError, its ``__cause__``.

What a function or iterator of the caller raises (``progress``, ``tell``) leaves the verb as it is: he may end the verb
by it.

Within a verb BLAS runs on one thread. So the rounding of its sums, and decisions that depend on it, are the same for
any number of cores. It also is faster: with several threads a diagnosis, whose matrices are small, took 2.7 times the
processor time on a busy machine.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from functools import wraps
from traceback import extract_tb
from typing import Any, ParamSpec, TypeVar

from codegen.base.arguments import refuse_wrong_arguments
from codegen.base.errors import BadInput, InternalError, Place
from codegen.base.python_words import in_words_of_caller

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
                with threadpool_limits(limits=1, user_api="blas"), in_words_of_caller(work):
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

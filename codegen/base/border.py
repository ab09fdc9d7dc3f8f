"""Decorators of the verbs: an exception that a verb does not declare becomes an InternalError with it as its cause.

Within a verb BLAS runs on one thread. So its sums, and what is decided by them, do not depend on the number of cores;
and on a busy machine the small matrices of a diagnosis do not wait for each other (2.7 times the processor time).
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

from codegen.base.arguments import refuse_wrong_arguments
from codegen.base.errors import BadInput, InternalError

Given = ParamSpec("Given")
Result = TypeVar("Result")
OURS = (BadInput, InternalError, BrokenPipeError)


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
            refuse_wrong_arguments(work, given, named)
            try:
                with threadpool_limits(limits=1, user_api="blas"):
                    return work(*given, **named)
            except passed:
                raise
            except Exception as error:
                files = [
                    os.fspath(value) for value in (*given, *named.values()) if isinstance(value, str | os.PathLike)
                ]
                raise InternalError(work.__name__, files, error) from error

        return bordered

    return border


def verb(work: Callable[Given, Result]) -> Callable[Given, Result]:
    """A verb that raises BadInput alone."""
    return verb_that_raises()(work)

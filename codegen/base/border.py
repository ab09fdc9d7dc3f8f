"""Decorator of the verbs: it checks arguments, limits BLAS to one thread, and reports errors in a user's own code.

With one thread the rounding of sums in BLAS, and decisions that depend on it, are the same for any number of cores. It
also is faster: with several threads a diagnosis, whose matrices are small, took 2.7 times the processor time on a busy
machine.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from functools import lru_cache, wraps
from traceback import extract_tb
from typing import Any, ParamSpec, TypeVar

from codegen.base.arguments import refuse_wrong_arguments
from codegen.base.errors import BadInput, Place
from codegen.base.python_words import in_words_of_caller

Given = ParamSpec("Given")
Result = TypeVar("Result")
OWN_CODE: set[str] = set()
"""Files with Python code of the user, as named by him; an error in it is an input that cannot be used."""


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

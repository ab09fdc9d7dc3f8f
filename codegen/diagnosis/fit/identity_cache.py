"""Cache of a function's last results, by the identity of its arguments."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import wraps
from threading import Lock
from typing import Any, ParamSpec, TypeVar

import numpy as np

OF_MODELS = 12
"""Cached results of a function of a model and a motion; a diagnosis compares three models on two motions."""

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def identity_cache(most: int) -> Callable[[Callable[Arguments, Result]], Callable[Arguments, Result]]:
    """A decorator that keeps a function's last results, at most so many.

    Arguments are compared by identity, numbers by value, since models, motions and fits are never changed and comparing
    them is slow. Arrays in a result are read-only. The arguments are kept as long as the result.
    """

    def decorated(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
        kept: OrderedDict[Hashable, tuple[Any, Result]] = OrderedDict()
        lock = Lock()

        @wraps(function)
        def remembered(*arguments: Arguments.args, **named: Arguments.kwargs) -> Result:
            values = (*arguments, *named.values())
            key = (*named, *(a if isinstance(a, (bool, int, float)) else id(a) for a in values))
            with lock:
                if key in kept:
                    kept.move_to_end(key)
                    return kept[key][1]
            result = function(*arguments, **named)
            if isinstance(result, np.ndarray):
                result.setflags(write=False)
            with lock:
                kept[key] = values, result
                while len(kept) > most:
                    kept.popitem(last=False)
            return result

        return remembered

    return decorated

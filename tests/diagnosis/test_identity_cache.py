"""Results that are kept: the function's own, by the identity of its arguments, and no more than so many."""

from __future__ import annotations

import numpy as np
import pytest

from codegen.diagnosis.fit.identity_cache import identity_cache


def test_the_same_objects_are_asked_once_and_equal_ones_again() -> None:
    calls: list[float] = []

    @identity_cache(4)
    def doubled(values: np.ndarray, factor: float = 2.0) -> np.ndarray:
        calls.append(factor)
        return factor * values

    one, other = np.ones(3), np.ones(3)
    assert doubled(one) is doubled(one)
    assert len(calls) == 1
    assert np.array_equal(doubled(other), doubled(one)) and len(calls) == 2
    assert np.array_equal(doubled(one, 3.0), 3 * one) and np.array_equal(doubled(one, factor=4.0), 4 * one)
    assert doubled(one, factor=4.0) is doubled(one, factor=4.0)
    assert calls == [2.0, 2.0, 3.0, 4.0]


def test_the_oldest_result_goes_and_an_object_keeps_its_place_while_its_result_is_kept() -> None:
    calls: list[int] = []

    @identity_cache(2)
    def size(values: list[int]) -> int:
        calls.append(len(values))
        return len(values)

    for k in range(50):  # objects that are gone would leave their identity to the next one
        assert size([0] * k) == k
    first, second, third = [1], [1, 2], [1, 2, 3]
    assert [size(v) for v in (first, second, third, second, first)] == [1, 2, 3, 2, 1]
    assert calls[50:] == [1, 2, 3, 1]


def test_a_kept_array_cannot_be_written_to() -> None:
    kept = identity_cache(1)(lambda n: np.zeros(n))(3)
    with pytest.raises(ValueError, match="read-only"):
        kept[0] = 1.0


def test_what_fails_is_not_kept() -> None:
    answers = iter([ValueError("first"), None])

    @identity_cache(2)
    def once(key: int) -> int:
        if (error := next(answers)) is not None:
            raise error
        return key

    with pytest.raises(ValueError, match="first"):
        once(5)
    assert once(5) == 5

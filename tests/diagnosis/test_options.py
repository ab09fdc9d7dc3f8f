"""The order in which models may be written, where some of them have the same values."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from codegen.diagnosis.evidence.adoption import Refit
from codegen.diagnosis.verdict import admission

DECLARED, FITTED, WITHOUT = 4.0, 3.0, 0.0


@pytest.mark.parametrize(
    ("values", "levels", "order"),
    [
        (DECLARED, DECLARED, [DECLARED, WITHOUT]),  # the effect explains all: nothing is refitted
        (FITTED, DECLARED, [FITTED, DECLARED, WITHOUT]),
        (FITTED, FITTED, [FITTED, WITHOUT, DECLARED]),
    ],
)
def test_the_values_that_suit_the_effect_come_first(
    values: float, levels: float, order: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(admission, "with_values", lambda system, chosen: chosen["a"])
    one = np.array
    refit = Refit(("a",), one([DECLARED]), one([values]), one([0.1]), one([levels]), (), ())
    system: Any = SimpleNamespace()
    options = admission.options_of(system, refit, {"a": WITHOUT})
    assert [model for _, model in options] == order
    names: dict[Any, str] = {model: name for name, model in options}
    assert names[DECLARED] == "declared values"


def test_values_of_the_other_criteria_come_before_the_levels_and_never_beside_an_effect(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(admission, "with_values", lambda system, chosen: chosen["a"])
    one = np.array
    others = (("simulation alone", one([2.0])), ("residual force alone", one([5.0])))
    refit = Refit(("a",), one([DECLARED]), one([FITTED]), one([0.1]), one([3.5]), (), (), others)
    system: Any = SimpleNamespace()
    assert admission.options_of(system, refit) == [
        ("refitted values", FITTED),
        ("values refitted by simulation alone", 2.0),
        ("values refitted by residual force alone", 5.0),
        ("refitted friction levels alone", 3.5),
        ("declared values", DECLARED),
    ]
    with_effect = [model for _, model in admission.options_of(system, refit, {"a": WITHOUT})]
    assert with_effect == [FITTED, 3.5, WITHOUT, DECLARED]


@pytest.mark.parametrize(
    ("chosen", "words"),
    [
        ("declared values", "No refitted values are written: "),
        ("values refitted by residual force alone", "Refitted values and values refitted by simulation alone are not"),
    ],
)
def test_what_is_written_is_not_said_to_be_refused(chosen: str, words: str) -> None:
    figures: Any = SimpleNamespace()
    options = ("refitted values", "values refitted by simulation alone")
    refusals = tuple(admission.Refusal(name, "as declared", {admission.FORCE: 1.2}) for name in options)
    model: Any = SimpleNamespace()
    (fact,) = admission.Admitted((chosen, model), figures, refusals).remarks
    assert fact.words.startswith(words) and fact.words.endswith(f"Written instead: {chosen}.")

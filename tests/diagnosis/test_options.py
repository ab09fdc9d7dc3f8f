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

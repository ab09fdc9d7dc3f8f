"""How the effects of a fit are replaced and removed, whatever the fit is to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import pytest

from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import ModelFits
from codegen.diagnosis.fit.trial import Trial, part_of
from codegen.effects import CATALOGUE
from tests.diagnosis.stage import stage, system_of

LEVEL = 4.0


@dataclass(frozen=True, eq=False)
class Start:
    """A fit that is where it was started."""

    trial: Trial
    theta: np.ndarray

    values, part, parameters = Fit.values, Fit.part, Fit.parameters


class Starts(ModelFits):
    def begun_by(self, fit: Any, trial: Trial, theta: np.ndarray) -> Any:
        return Start(trial, theta)


def effects_in(fit: Any) -> dict[str, float]:
    """Kind → value of its one parameter, in the order of the effects."""
    return {part.kind: next(iter(v.values())) for part, v in zip(fit.trial.parts, fit.values[1], strict=True)}


@pytest.fixture(scope="module")
def three() -> Any:
    """Offset, spring and viscous friction, beside a level of 4 N."""
    system = system_of(stage())
    level = next(s for s in system.values if s.name == "rail_a")
    forms = (CATALOGUE["offset"], CATALOGUE["spring"], CATALOGUE["viscous"].with_parameters(["b"]))
    parts = tuple(part_of(form, 0, system) for form in forms)
    trial = Trial(system, parts, (level,))
    return Start(trial, trial.theta(np.array([LEVEL]), [{part.names[0]: 1.0 + k} for k, part in enumerate(parts)]))


def test_another_effect_takes_the_place_of_one_and_the_others_keep_place_and_values(three: Any) -> None:
    drag = part_of(CATALOGUE["quadratic_drag"].with_parameters(["c"]), 0, three.trial.system)
    found = Starts().replaced(three, {1: (drag, {drag.names[0]: 9.0})})
    assert list(effects_in(found).items()) == [("offset", 1.0), ("quadratic_drag", 9.0), ("viscous", 3.0)]
    assert found.values[0] == [LEVEL]


def test_a_rival_leads_in_place_of_the_first_effect(three: Any) -> None:
    drag = part_of(CATALOGUE["quadratic_drag"].with_parameters(["c"]), 0, three.trial.system)
    rival = Trial(three.trial.system, (drag,), three.trial.refitted_symbols)
    one = cast(Any, Start(rival, rival.theta(np.array([7.0]), [{drag.names[0]: 9.0}])))
    found = Starts().with_first_effect(one, three)
    assert list(effects_in(found)) == ["quadratic_drag", "spring", "viscous"]
    assert found.values[0] == [LEVEL]  # the levels are those of the fit that goes on


def test_effects_are_eliminated_one_at_a_time_each_judged_beside_those_that_are_left(three: Any) -> None:
    asked: list[list[str]] = []

    def needless(fit: Any) -> int | None:
        asked.append(list(effects_in(fit)))
        return {3: 1, 2: 0}.get(len(fit.trial.parts))

    found = Starts().eliminated(three, needless)
    assert asked == [["offset", "spring", "viscous"], ["offset", "viscous"], ["viscous"]]
    assert effects_in(found) == {"viscous": 3.0}
    kept = Starts().eliminated(three, lambda fit: None)
    assert kept is three

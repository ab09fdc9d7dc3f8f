"""Which change of the machine separates two models: against pairs of which mechanics says what does and what cannot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.experiments.discrimination import Discrimination, Model
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import search_on
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.fit.trial import Trial, part_of
from codegen.diagnosis.results import Separation, SetupTried
from codegen.effects import CATALOGUE
from codegen.spec import parse_spec
from tests.diagnosis.stage import log_of, stage, system_of

Rival = tuple[str, dict[str, float], float]
"""Kind, its parameters, and the Coulomb level that goes with it."""


def separations(one: Rival, other: Rival, folder: Path, duration: float = 6.0) -> dict[str, float]:
    """Words of each change → separation of two models that a stage without viscous friction ties; the first is true."""
    kind, parameters, level = one
    on = {"contact": "rail", "input": "w"}.get(CATALOGUE[kind].sits_on, "x")
    written = ", ".join(f"{name}: {value}" for name, value in parameters.items())
    plant = stage(f"[{{kind: {kind}, on: {on}, parameters: {{{written}}}}}]", level, duration=duration, noise=1e-5)
    plant = parse_spec(plant.text.replace("value: 6,", "value: 0,"), Path("plant.yaml"))
    spec = parse_spec(stage().text.replace("value: 6,", "value: 0,"), Path("spec.yaml"))
    log = log_of(plant, folder, "log.csv")
    system, motion = system_of(spec), smooth_motion(log)
    search = search_on(Problem(system, motion, {}), lambda share: record_of(motion, log, share))

    def model(kind: str, parameters: dict[str, float], level: float) -> Model:
        part = part_of(CATALOGUE[kind], 0, system)
        theta = np.array([level, *(parameters[name] for name in part.names)])
        return Model(Trial(system, (part,), search.moved), theta, np.zeros(len(theta)))

    told: list[tuple[str, float]] = []
    tried = Discrimination(search, log, [model(*one), model(*other)]).tried(lambda *now: told.append(now))
    assert len({what for what, _ in told}) == len(told) >= len(tried)
    assert [share for _, share in told] == [k / len(told) for k in range(len(told))]
    assert [t.separation for t in tried] == sorted((t.separation for t in tried), reverse=True)
    return {t.what: t.separation for t in tried}


def of(found: dict[str, float], *words: str) -> float:
    """The largest separation of the changes whose words hold one of these."""
    return max(separation for text, separation in found.items() if any(word in text for word in words))


@pytest.mark.slow
def test_another_mounting_tells_weight_from_asymmetry_and_no_motion_does(tmp_path: Path) -> None:
    """A constant force and a friction that is larger one way are one and the same until the machine is turned."""
    found = separations(("offset", {"f0": 1.2}, 4.5), ("coulomb_asymmetry", {"d": -1.2}, 4.5), tmp_path)
    same = of(found, "nothing changed", "speed", "more on x", "force of")
    assert same < 1
    assert of(found, "upside down") > 50
    assert of(found, "temperature") > 5  # the asymmetry is friction and changes with it, weight does not


@pytest.mark.slow
def test_a_payload_or_a_load_tells_the_gain_of_the_drive_from_inertia(tmp_path: Path) -> None:
    """κ·w = m·a + F_c is w = (m/κ)·a + F_c/κ: only a mass or force that is known has another share."""
    gain = ("input_gain", {"gain": 1.1}, 4.5)
    found = separations(gain, ("inertia_error", {"delta": 2 / 1.1 - 2}, 4.5 / 1.1), tmp_path)
    same = of(found, "nothing changed", "speed")
    assert same < 2  # the two residuals are r and r/κ: a tenth of the noise, over all independent samples
    assert of(found, "more on x") > 4 * same and of(found, "force of") > 4 * same
    assert not any("upside down" in words for words in found)


@pytest.mark.slow
def test_the_speed_tells_two_laws_of_speed_apart(tmp_path: Path) -> None:
    """b·v and c·v|v| bend apart over a wider range of speeds more than the same range shows again."""
    found = separations(("viscous", {"b": 3.0}, 4.5), ("quadratic_drag", {"c": 5.0}, 4.8), tmp_path, 9.0)
    assert of(found, "twice the speed") > 1.5 * of(found, "nothing changed")
    assert of(found, "twice the speed") > of(found, "half the speed")


@pytest.mark.parametrize(("best", "again", "chosen"), [(30.0, 2.0, True), (30.0, 20.0, False), (8.0, 1.0, False)])
def test_a_change_is_proposed_where_it_separates_enough_and_more_than_the_same_again(
    best: float, again: float, chosen: bool
) -> None:
    tried = (SetupTried("load", "a load", best, 1.0), SetupTried("none", "the same", again, 1.0))
    told = Separation((), (), None, {}, 10.0, tried)
    assert (told.change is tried[0]) is chosen
    assert (told.as_json()["change"] is not None) is chosen and len(told.as_json()["changes"]) == 2

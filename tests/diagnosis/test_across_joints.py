"""A gain of a drive of an arm that refitted links take at its own joint shows in the forces of the other joint."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import pytest
from mechanics.robots import TWO_LINKS

from codegen.diagnosis.case import case_of
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.record import record_of
from codegen.diagnosis.fit.search import Search, search_on
from codegen.diagnosis.fit.trial import Part
from codegen.diagnosis.results import MATERIAL
from codegen.diagnosis.selection import candidate_fits, force_selection
from codegen.diagnosis.selection.candidate_fits import every_part
from codegen.diagnosis.selection.force_fits import ForceFits
from codegen.diagnosis.selection.force_selection import judged, judged_in_addition
from codegen.diagnosis.selection.ranking import Ranked
from codegen.diagnosis.selection.significance import hypotheses
from codegen.diagnosis.verdict import force_led
from codegen.diagnosis.verdict.force_led import accepted_across_joints, found_across_joints
from codegen.spec import parse_spec
from tests.diagnosis.stage import log_of, system_of

ARM = """name: arm
urdf: {file: arm.urdf, tolerance: {mass: 20 %, centre_of_mass: 20 %, inertia: 40 %, damping: 50 %}}
friction:
  contacts:
    - {name: q_1, law: coulomb, a: 0.4, unit: N*m}
    - {name: q_2, law: coulomb, a: 0.7, unit: N*m}
log: {cutoff_hz: 20}
"""
KNOWN = "{kind: spring, on: [q_1], parameters: {k: 25}}"
"""With all masses free, 0.85 of one drive force is 1/0.85 of the other one's; a spring that is known decides."""
MOTION = """simulation:
  duration: 15
  sample_time: 0.002
  reference: {q_1: "0.9*sin(1.3*t) + 0.3*sin(3.7*t) - 1.2", q_2: "0.8*sin(2.1*t) + 0.3*sin(5*t)"}
  position_gain: {w_q_1: 300, w_q_2: 120}
  velocity_gain: {w_q_1: 40, w_q_2: 12}
  position_noise: {q_1: 1e-5, q_2: 1e-5}
"""
GAIN = "{kind: input_gain, on: [w_q_2], parameters: {gain: 0.85}}"


@cache
def refitted(known: str, lacking: str) -> tuple[Search, Fit]:
    """The search, and the refit of the arm with the ``known`` effect to the log of one that has another one too."""
    texts = [f"effects: [{', '.join(filter(None, effects))}]\n" for effects in ((known, lacking), (known,))]
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "arm.urdf").write_text(TWO_LINKS)
        plant, spec = (parse_spec(ARM + t, folder / "arm.yaml") for t in (texts[0] + MOTION, texts[1]))
        log = log_of(plant, folder, "log.csv")
        case = case_of(spec, system_of(spec), log, None, MATERIAL)
        search = search_on(case.problem, lambda share: record_of(case.problem.motion, case.log, share))
        return search, search.refit()


def test_a_gain_is_found_by_the_forces_of_the_other_joint() -> None:
    search, base = refitted(KNOWN, GAIN)
    found = found_across_joints(search, base, MATERIAL)
    assert found is not None
    assert (found.found.part.kind, found.found.part.on) == ("input_gain", "w_q_2")
    assert found.found.parameters["gain"] == pytest.approx(0.85, abs=0.01)
    fits = ForceFits(search, base)
    alone = judged(fits, fits.plain, found.found, hypotheses(every_part(search, ())))
    assert alone.why_not  # by the forces of its own joint


def test_without_an_effect_none_is_found() -> None:
    assert found_across_joints(*refitted(KNOWN, ""), MATERIAL) is None


def test_a_gain_that_another_drive_s_gain_explains_as_well_is_not_named() -> None:
    assert found_across_joints(*refitted("", GAIN), MATERIAL) is None


def test_of_two_nearly_alike_candidates_the_better_is_named_if_it_leaves_nothing_material(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Joints with nothing but noise make any two fits nearly alike: one of 0.85 on a SCARA's forearm was unknown."""
    monkeypatch.setattr(ForceFits, "nearly_alike", lambda fits, one, best: True)
    search, base = refitted(KNOWN, GAIN)
    ranked: list[Ranked] = []

    def ranked_once(*given: Any, **options: Any) -> list[Ranked]:
        ranked[:] = ranked or judged_in_addition(*given, **options)
        return list(ranked)

    monkeypatch.setattr(force_led, "judged_in_addition", ranked_once)
    found = found_across_joints(search, base, MATERIAL)
    assert found is not None and found.found.part.on == "w_q_2"
    assert force_led._is_complete(search, found.found, MATERIAL)
    assert not force_led._is_complete(search, base, MATERIAL)
    monkeypatch.setattr(force_led, "_is_complete", lambda *given: False)
    assert found_across_joints(search, base, MATERIAL) is None


def test_a_refused_candidate_is_no_rival(monkeypatch: pytest.MonkeyPatch) -> None:
    """Such as a dead zone on another joint, which only takes half of its drive force."""

    def refused(*args: Any, **options: Any) -> Ranked:
        one = judged(*args, **options)
        return (
            one if one.found.part.kind == "input_gain" else replace(one, why_not="takes the drive", insignificant=False)
        )

    monkeypatch.setattr(force_selection, "judged", refused)
    monkeypatch.setattr(force_led, "_is_better", lambda search, best, rival: False)
    found = found_across_joints(*refitted(KNOWN, GAIN), MATERIAL)
    assert found is not None and found.found.part.on == "w_q_2"


def test_effects_are_tried_on_joints_with_little_misfit(monkeypatch: pytest.MonkeyPatch) -> None:
    """The refit may hide a gain at its own joint; the p-value is over the candidates of all joints."""
    tried: list[Part] = []
    counted: list[int] = []

    def judged_in_addition(fits: Any, plain: Any, parts: Any, candidates: int, **options: Any) -> list[Ranked]:
        tried.extend(parts)
        counted.append(candidates)
        return []

    monkeypatch.setattr(force_led, "judged_in_addition", judged_in_addition)
    monkeypatch.setattr(candidate_fits, "LEAST_EXCESS", 1.0)  # the worst joint alone
    search, base = refitted(KNOWN, GAIN)
    every = every_part(search, ())
    assert len(ForceFits(search, base).candidates.parts) < len(every)
    found_across_joints(search, base, MATERIAL)
    assert tried == [part for part in every if len(part.names) == 1]
    assert counted == [hypotheses(every)]


def test_a_machine_that_is_simulated_as_a_whole_is_left_alone() -> None:
    search: Any = SimpleNamespace(rigid=None, system=SimpleNamespace(degrees_of_freedom=2))
    outcome, answer = SimpleNamespace(parts=()), object()
    assert accepted_across_joints(search, outcome, answer, None, MATERIAL) == (answer, outcome)  # type: ignore[arg-type]

"""A candidate that explains most of what a model leaves, on a log too short to accept it: ``unknown``, not ``none``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import patch

import numpy as np
import pytest

from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.fit.acceptance import Evidence
from codegen.diagnosis.selection.ranking import Ranked
from codegen.diagnosis.verdict import answer as answers
from codegen.diagnosis.verdict.answer import LEAST_EXPLAINED, Answer, unknown_for_a_candidate
from tests.diagnosis.fakes import Placed
from tests.diagnosis.stage import TEST, TRAIN, among, competing, log_of, stage, system_of

MATERIAL = 0.02


def candidate(share: float, size: float, insignificant: bool = True, kind: str = "cogging") -> Ranked:
    found = cast(Any, SimpleNamespace(part=Placed(kind=kind, on="x")))
    return Ranked(found, Evidence(1.0, share, 2.0, 6, 8), 0.3, size, "may be chance", insignificant)


def judged(*tried: Ranked, verdict: Any = "none") -> Answer:
    return unknown_for_a_candidate(Answer(verdict, (), *cast(Any, (None, None, ()))), tried, MATERIAL)


def test_the_candidate_that_explains_most_is_told() -> None:
    found = judged(candidate(0.75, 0.1, kind="viscous"), candidate(0.8, 0.1), candidate(0.9, 0.01), candidate(0.1, 0.3))
    assert found.verdict == "unknown" and found.effects == ()
    (fact,) = found.remarks
    assert fact.topic == "unexplained" and fact.words.startswith("cogging on x removes 80 % of the squared simulation")


@pytest.mark.parametrize(
    ("share", "size", "insignificant"),
    [
        (LEAST_EXPLAINED - 0.01, 0.1, True),
        (0.95, MATERIAL / 2, True),  # less than a material force
        (0.95, 0.1, False),  # refused for another reason, such as the held-out data
    ],
)
def test_none_stays(share: float, size: float, insignificant: bool) -> None:
    assert judged(candidate(share, size, insignificant)).verdict == "none"


@pytest.mark.parametrize("verdict", ["effect", "ambiguous", "unknown", "unfit"])
def test_other_verdicts_stay(verdict: str) -> None:
    assert judged(candidate(0.9, 0.1), verdict=verdict).remarks == ()


@competing("cogging", "viscous")
def test_a_diagnosis_asks(tmp_path: Path, kinds: tuple[str, ...]) -> None:
    """Five seconds with a noisy input: a force over position of two free periods fits some of the noise."""
    found = []
    for k, reference in enumerate((TRAIN, TEST)):
        log = log_of(stage("[]", 4.5, reference, 5.0, noise=2e-5), tmp_path, f"{k}.csv")
        noise = 2.0 * np.random.default_rng(k).standard_normal(log.inputs.shape)
        found.append(replace(log, inputs=log.inputs + noise))
    with among(*kinds):
        plain = diagnose_log(stage(), system_of(stage()), *found)[0]
    (best,) = [c for c in plain.candidates if c.gain == max(c.gain for c in plain.candidates)]
    assert plain.verdict == "none" and 0.3 < best.gain < LEAST_EXPLAINED, plain.sentence
    with among(*kinds), patch.object(answers, "LEAST_EXPLAINED", 0.3):
        stricter = diagnose_log(stage(), system_of(stage()), *found)[0]
    assert stricter.verdict == "unknown" and stricter.effects == ()
    assert any(f"{best.kind} on {best.on} removes" in words for words in stricter.statement.of("unexplained"))

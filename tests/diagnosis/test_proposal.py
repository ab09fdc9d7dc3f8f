"""What PySINDy proposes for a residual whose cause is known here, and that nobody takes it for a finding."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

import stiction
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.signals import smooth_motion
from codegen.diagnosis.results import ProposedTerms
from codegen.diagnosis.verdict import proposal
from codegen.diagnosis.verdict.proposal import propose_terms
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import STAGE, TEST, TRAIN, log_of, stage, system_of
from tests.expected_errors import refused

needs_pysindy = pytest.mark.skipif(importlib.util.find_spec("pysindy") is None, reason="the extra sindy is not here")


def _proposed(extra: str, folder: Path, shake: float = 0.0) -> ProposedTerms:
    """For a plant with an extra force, against the spec without it and with the right level."""

    def plant(reference: str) -> Spec:
        text = STAGE.replace("w - b*v", f"w - b*v{extra}")
        text = text.replace("parameters:\n", "parameters:\n  k: {{value: 60, unit: N/m^2}}\n", 1)
        text = text.format(effects="[]", level=4.0, reference=reference, duration=14, noise=0)
        return parse_spec(text, Path("stage.yaml"))

    problems = []
    for name, reference in (("train.csv", TRAIN), ("test.csv", TEST)):
        log = log_of(plant(reference), folder, name)
        log.inputs[:, 0] -= shake * np.sin(2 * np.pi * 2.9 * log.time)
        problems.append(Problem(system_of(stage()), smooth_motion(log), {}))
    train, test = problems
    (found,) = propose_terms(train.system, train, test, slice(0, len(test.motion.time)))
    return found


@needs_pysindy
def test_the_term_that_is_lacking_is_proposed_with_its_weight(tmp_path: Path) -> None:
    found = _proposed(" - k*x**2", tmp_path)
    assert list(found.terms) == ["x**2"]
    # The machine has -k x**2 that the model lacks, so g - M a - U lambda of the model is +k x**2.
    assert found.terms["x**2"] == pytest.approx(60, rel=0.05)
    assert 0.9 < found.held_out_share <= 1


@needs_pysindy
def test_what_no_term_explains_is_not_dressed_up(tmp_path: Path) -> None:
    found = _proposed("", tmp_path, shake=3.0)
    assert found.terms == {}
    assert found.held_out_share == 0


@pytest.mark.slow
@needs_pysindy
def test_a_proposal_is_in_the_report_and_never_in_the_spec(tmp_path: Path) -> None:
    log = log_of(stage(), tmp_path, "train.csv")
    table = np.column_stack([log.time, log.positions, log.inputs])
    # A shaking foundation that comes and goes, which is no effect of the catalogue.
    table[:, 2] -= 3.0 * np.sin(2 * np.pi * 2.9 * log.time) * (np.sin(2 * np.pi * 0.11 * log.time) > 0)
    np.savetxt(tmp_path / "shaken.csv", table, delimiter=",", header="t,x,w", comments="")
    (tmp_path / "stage.yaml").write_text(stage().text)
    out = tmp_path / "out"
    result = stiction.diagnose(tmp_path / "stage.yaml", tmp_path / "shaken.csv", out=out, propose=True)
    assert result.diagnosis.verdict == "unknown"
    said = json.loads((out / "diagnosis.json").read_text())["proposal"]
    assert [c["coordinate"] for c in said["coordinates"]] == ["x"]
    assert "not a finding" in (out / "report.html").read_text()
    assert parse_spec((out / "spec.yaml").read_text(), Path("spec.yaml")).force == stage().force
    assert parse_spec((out / "spec.yaml").read_text(), Path("spec.yaml")).effects == ()


def test_without_the_extra_the_message_says_how_to_get_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(proposal, "find_spec", lambda name: None)
    log_of(stage(), tmp_path, "train.csv")
    (tmp_path / "stage.yaml").write_text(stage().text)
    with refused("TOOL003 pip stiction[sindy]"):
        stiction.diagnose(tmp_path / "stage.yaml", tmp_path / "train.csv", out=tmp_path / "out", propose=True)
    assert not (tmp_path / "out").exists()

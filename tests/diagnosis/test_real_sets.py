"""Measured sets diagnosed as they were published, from the files that their README names."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.real.sets import DATA, SETS, SPECS
from codegen import pipeline

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not DATA.is_dir(), reason="../shared/data is not here")]
CASES = [(name, run.name) for name, runs in SETS.items() for run in runs]


def diagnosis(name: str, run_name: str, out: Path) -> dict[str, Any]:
    """diagnosis.json of a run of the page."""
    (run,) = (run for run in SETS[name] if run.name == run_name)
    data, specs = DATA / name, SPECS / name
    tests = [data / file for file in run.test] or None
    result = pipeline.diagnose(specs / run.spec, [data / file for file in run.train], tests, out, specs / run.about)
    read: dict[str, Any] = json.loads((result.folder / "diagnosis.json").read_text())
    return read


@pytest.mark.parametrize(("name", "run"), CASES, ids=[f"{name}/{run}" for name, run in CASES])
def test_a_verdict_comes_and_nothing_is_made_worse(name: str, run: str, tmp_path: Path) -> None:
    found = diagnosis(name, run, tmp_path)
    assert found["verdict"] in ("effect", "none", "ambiguous", "unknown", "unfit")
    if found["verdict"] == "effect":
        error = found["error"]
        assert error["augmented"]["relative_force_error"] < error["declared"]["relative_force_error"]


def test_a_load_stored_unsigned_is_named_and_not_the_sign_of_the_input(tmp_path: Path) -> None:
    found = diagnosis("bam_xl330", "as_stored", tmp_path)
    assert found["verdict"] == "unfit"
    words = " ".join(found["preflight"]["train"])
    assert "Say `signed16: [load]`" in words and "flipped" not in words
    assert "load" in found["sentence"] and "flipped" not in found["sentence"]


@pytest.mark.parametrize("run", ["two_to_ddp", "two_to_collocation"])
def test_no_friction_is_found_where_an_expert_finds_none(run: str, tmp_path: Path) -> None:
    found = diagnosis("dfki_simple_pendulum", run, tmp_path)
    assert {e["kind"] for e in found["effects"]} <= {"input_delay", "actuator_lag"}

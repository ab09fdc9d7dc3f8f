"""Logs that this project did not make: practice cases of an independent simulator, and the EMPS benchmark."""

from __future__ import annotations

import json
from itertools import product
from math import pi, remainder
from pathlib import Path

import pytest

import stiction
from codegen.diagnosis.results import Diagnosis
from codegen.effects import CATALOGUE

ROOT = Path(__file__).resolve().parents[2]
SHARED = ROOT.parent / "shared"
PRACTICE = SHARED / "practice"
STANDARD = PRACTICE / "standard"
EMPS = SHARED / "data" / "emps"
needs_practice = pytest.mark.skipif(not STANDARD.is_dir(), reason="../shared/practice is not here")
needs_emps = pytest.mark.skipif(not EMPS.is_dir(), reason="../shared/data/emps is not here")

CASES = [
    *(f"standard/case_{k:04d}" for k in (3, 4, 6, 8, 9, 14, 30, 34, 52)),
    "hard/case_0014",  # two effects; with one of them lacking, a third looks better than either
    "hard/case_0025",  # a gain that many parameters with a tolerance could share
    "hard/case_0027",  # a disturbance that is no effect of the catalogue
]
QUICK = ("standard/case_0052",)


def _run(case: Path, out: Path) -> tuple[dict, dict]:
    result = stiction.diagnose(case / "spec.yaml", case / "train.csv", case / "test.csv", out)
    return json.loads((result.folder / "diagnosis.json").read_text()), json.loads((case / "truth.json").read_text())


def _names(truth: dict) -> list[set[str]]:
    """The kinds that are right for each true effect."""
    return [
        {e["kind"], *(t["kind"] for t in also)} for e, also in zip(truth["effects"], truth["equivalents"], strict=True)
    ]


def _right(found: dict, truth: dict) -> bool:
    if truth["group"] in ("none", "foreign"):
        return found["verdict"] == {"none": "none", "foreign": "unknown"}[truth["group"]]
    kinds = [e["kind"] for e in found["effects"]]
    names = _names(truth)
    return found["verdict"] == "effect" and len(kinds) == len(names) and all(n & set(kinds) for n in names)


@needs_practice
@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in CASES])
def test_practice_case(name: str, tmp_path: Path) -> None:
    found, truth = _run(PRACTICE / name, tmp_path)
    assert _right(found, truth), found["sentence"]
    oracle = truth["oracle"]
    run = {model: found["error"][model]["free_run_position_rmse"] for model in ("declared", "augmented")}
    # The same model and the same definition; the state that it is restarted from is smoothed by another filter.
    assert run["declared"] == pytest.approx(oracle["declared"]["sim_rmse"], rel=0.15)
    # The refit of a wrong structure depends on what is fitted to what; the right one has a best that noise admits.
    assert run["augmented"] <= 1.15 * oracle["true_structure"]["sim_rmse"]
    for ours, effect in product(found["effects"], truth["effects"]):
        if ours["kind"] == effect["kind"]:
            for parameter, value in effect["parameters"].items():
                near = ours["parameters"][parameter]
                if parameter == "phase":
                    near = value + remainder(near - value, 2 * pi)
                assert near == pytest.approx(value, rel=0.02, abs=0.03 if parameter == "phase" else None), parameter


@pytest.mark.slow
@needs_practice
def test_all_standard_cases_of_the_kinds_that_the_catalogue_has(tmp_path: Path) -> None:
    wrong = []
    counted = 0
    for case in sorted(STANDARD.glob("case_*")):
        truth = json.loads((case / "truth.json").read_text())
        kinds = {e["kind"] for e in truth["effects"]}
        if truth["group"] not in ("single", "none") or not kinds <= set(CATALOGUE):
            continue
        counted += 1
        found, _ = _run(case, tmp_path / case.name)
        if not _right(found, truth):
            wrong.append((case.name, sorted(kinds), found["verdict"], [e["kind"] for e in found["effects"]]))
    assert counted >= 25
    assert len(wrong) <= 0.05 * counted, wrong


@pytest.fixture(scope="module")
def emps(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    pulses = EMPS / "DATA_EMPS_PULSES.mat"
    out = tmp_path_factory.mktemp("emps")
    return stiction.diagnose(ROOT / "specs" / "emps.yaml", EMPS / "DATA_EMPS.mat", pulses, out).diagnosis


@pytest.mark.slow
@needs_emps
def test_emps_friction_differs_by_direction(emps: Diagnosis) -> None:
    (effect,) = emps.effects
    assert (effect.kind, effect.on) == ("viscous_asymmetry", "rail")
    assert effect.parameters["d_b"] < 0
    assert emps.augmented.relative_force < emps.refit.relative_force <= emps.declared.relative_force
    assert emps.augmented.free_run_rmse < 0.8 * emps.refit.free_run_rmse
    assert isinstance(emps.certificate and emps.certificate.after, float)


@pytest.mark.slow
@needs_emps
@pytest.mark.xfail(
    strict=True, reason="160.6 and 222.6 N·s/m, 4 and 7 % off, and 0.82 of the force error: docs/data_emps.md"
)
def test_emps_coefficients_are_the_published_ones(emps: Diagnosis) -> None:
    # Published: viscous coefficients by direction, from a regression of forces on one record; the authors' own two
    # records differ by 3 %.
    mean, half = emps.refitted["Fv"][2], emps.effects[0].parameters["d_b"]
    assert mean + half == pytest.approx(166.7061, rel=0.05)
    assert mean - half == pytest.approx(240.4236, rel=0.05)
    assert emps.augmented.relative_force < 0.8 * emps.refit.relative_force

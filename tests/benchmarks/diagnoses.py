"""Truths and diagnoses written by hand, as their files hold them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.practice.cases import Case


def effect(kind: str, on: str = "x", **parameters: float) -> dict[str, Any]:
    """An effect, its intervals 10 % to both sides."""
    intervals = {name: sorted((0.9 * value, 1.1 * value)) for name, value in parameters.items()}
    return {"kind": kind, "on": on, "parameters": parameters, "intervals": intervals}


def diagnosis(
    verdict: str, *effects: dict[str, Any], tied: Sequence[str] = (), refit: float | None = None, **values: float
) -> dict[str, Any]:
    """A diagnosis.json.

    Args:
        tied: kinds of the candidates; by default the effects'.
        refit: free-run error of the refit on the test log.
        values: refitted parameters.
    """
    kinds = list(tied) or [e["kind"] for e in effects]
    return {
        "verdict": verdict,
        "effects": list(effects),
        "candidates": [{"kind": kind} for kind in kinds],
        "error": {"refit": {"free_run_position_rmse": refit}},
        "values": {name: {"declared": 0.0, "refit": v, "augmented": v} for name, v in values.items()},
        "data": {"train_samples": 1000},
    }


def written(
    folder: Path, name: str, group: str, effects: Sequence[dict[str, Any]], said: dict[str, Any], truly: float = 1.0
) -> Case:
    """A case below folder/cases with its result below folder/results.

    Args:
        truly: free-run error of the true parameters on the test log.
    """
    case, result = folder / "cases" / name, folder / "results" / name
    case.mkdir(parents=True)
    result.mkdir(parents=True)
    oracle = {"true_parameters": {"sim_rmse": truly}, "true_structure_true_plant": {"sim_rmse": 2 * truly}}
    truth = {"group": group, "family": "stage", "effects": effects, "equivalents": [[] for _ in effects]}
    (case / "truth.json").write_text(json.dumps({**truth, "oracle": oracle}))
    (result / "diagnosis.json").write_text(json.dumps(said))
    return Case("standard", case)

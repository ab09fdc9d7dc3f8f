"""False alarms where nothing is missing: logs of the independent simulator with their true effects in the spec."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from scipy.stats import binomtest

from benchmarks.practice.cases import Case
from benchmarks.practice.runs import diagnosed, result_in
from codegen.base.files import write_atomically

VERDICTS = ("effect", "ambiguous", "unknown", "none", "unfit", "refused")
CONFIDENCE = 0.95
NOT_IN_FREE_RUNS = "encoder_eccentricity"
"""Declared, it is in the force residual and not in the free runs that judge candidates; see docs/diagnosis.md."""


def candidates(cases: Sequence[Case]) -> list[Case]:
    """The logs of one or two effects in the form of the catalogue: declared, they leave nothing undeclared."""
    return [case for case in cases if case.group in ("single", "double") and case.standard_form]


def with_truth(text: str, effects: Sequence[dict[str, Any]]) -> str:
    """A spec's text with effects declared; friction levels stay as they are. JSON is YAML."""
    entries = [{name: effect[name] for name in ("kind", "on", "parameters")} for effect in effects]
    return f"{text.rstrip()}\neffects: {json.dumps(entries)}\n"


def verdict_on(case: Case, out: Path, again: bool) -> dict[str, Any]:
    """The row of a log that is diagnosed with its true effects declared."""
    spec = out / case.tier / "specs" / f"{case.name}.yaml"
    write_atomically(spec, with_truth((case.folder / "spec.yaml").read_text(), case.truth["effects"]))
    folder = out / case.tier / case.name
    run = diagnosed(case.name, case.folder, spec, folder, again)
    return row(case, result_in(folder)) | {"failure": run.failure, "code": run.code}


def row(case: Case, result: dict[str, Any]) -> dict[str, Any]:
    """Verdict and names of one log."""
    likely = result["candidates"][:2] if result["verdict"] in ("ambiguous", "unknown") else []
    named = [effect["kind"] for effect in result["effects"] or likely]
    kinds = [effect["kind"] for effect in case.truth["effects"]]
    return {"case": case.title, "kinds": kinds, "verdict": result["verdict"], "named": named, "failure": ""}


def clopper_pearson(hits: int, trials: int) -> tuple[float, float]:
    """The exact interval of a rate."""
    interval = binomtest(hits, trials).proportion_ci(CONFIDENCE, method="exact")
    return float(interval.low), float(interval.high)


def tally(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Verdicts; the rate of false alarms and of all that is not ``none``, as (share, interval)."""
    counts = Counter(r["verdict"] for r in rows)
    return {
        "logs": len(rows),
        "verdicts": [(verdict, counts[verdict]) for verdict in VERDICTS],
        "alarms": _rate(counts["effect"], len(rows)),
        "not_none": _rate(len(rows) - counts["none"], len(rows)),
    }


def _rate(hits: int, trials: int) -> tuple[float, float, float]:
    return hits / trials, *clopper_pearson(hits, trials)

"""What the shared scorer says of the diagnoses of a tier, and what the page prints of it."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from collections.abc import Sequence
from math import inf, nan, pi
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.practice.cases import PRACTICE, Case
from benchmarks.practice.runs import Run, result_in
from benchmarks.rates import rate

FIRST = "single effects: first place"
MISSED = "single effects: `none`"
EXTRA = "single effects: an extra effect"
ABSORBED = "absorbed by the refit: `none`, or first place"
FIRST_OF_ALL = "all single effects: first place"
BOTH = "two effects: both"
ALARM = "no effect: false alarm"
NONE = "no effect: `none`"
OVERCLAIM = "cannot be identified: overclaim"
FOREIGN = "foreign disturbance: under a known name"
INTERVALS = "true parameters in their 95 % interval"
MARKS = {
    "top1": FIRST_OF_ALL,
    "missed": MISSED,
    "extra_effect": EXTRA,
    "both": BOTH,
    "false_alarm": ALARM,
    "overclaim": OVERCLAIM,
    "foreign_called_known": FOREIGN,
}
"""The scorer's mark → its rate, over all cases of a group."""


def score(out: Path, cases: Sequence[Case]) -> list[dict[str, Any]]:
    """The rows of the shared scorer for these cases, which lie in one folder; its own print goes to score.txt."""
    if not cases:
        return []
    target = out / "score.json"
    folder = cases[0].folder.parent
    command = [sys.executable, str(PRACTICE / "score.py"), str(folder), str(out), "--json", str(target)]
    said = subprocess.run(command, capture_output=True, text=True, check=True)
    (out / "score.txt").write_text(said.stdout)
    chosen = {case.name for case in cases}
    return [row for row in json.loads(target.read_text()) if row["case"] in chosen]


def right(row: dict[str, Any]) -> bool:
    """Whether a case is as it should be.

    On a log without an effect that is the verdict ``none`` alone: the scorer takes ``unknown``, ``ambiguous`` and
    ``unfit`` for no false alarm, but none of them says what is so.
    """
    match row["group"]:
        case "single":
            return bool(row["top1"])
        case "double":
            return bool(row["both"])
        case "foreign":
            return not row["foreign_called_known"]
        case "none":
            return bool(row["verdict"] == "none")
    return not row["overclaim"]


def ratios(out: Path, cases: Sequence[Case], figure: tuple[str, str]) -> list[float]:
    """Error after over the error of the true structure refitted, of cases with one or two effects."""
    ours, theirs = figure
    found = []
    for case in cases:
        if case.group in ("single", "double"):
            after = result_in(out / case.name).get("error", {}).get("augmented", {}).get(ours)
            oracle = case.truth["oracle"]["true_structure"][theirs]
            found.append(inf if after is None else after / oracle)
    return found


def coverage(out: Path, cases: Sequence[Case]) -> tuple[int, int]:
    """(truths inside their 95 % interval, truths) over parameters with an interval, of effects rightly named.

    A parameter that the truth has not, of another form of the effect, counts as outside.
    """
    inside = total = 0
    for case in cases:
        found = result_in(out / case.name)["effects"]
        for effect in case.truth["effects"]:
            same = [f for f in found if f["kind"] == effect["kind"] and f["on"] == effect["on"]]
            if same and "form" not in effect:
                for name, (low, high) in same[0]["intervals"].items():
                    total += 1
                    true = effect["parameters"].get(name, nan)
                    inside += within(true, low, high, name == "phase")
    return inside, total


def within(value: float, low: float | None, high: float | None, turns: bool = False) -> bool:
    """Whether a value lies in an interval, of which an end may be open; a phase may be off by whole turns."""
    if low is None or high is None:
        return (low is None or low <= value) and (high is None or value <= high)
    if turns:
        value += 2 * pi * round(((low + high) / 2 - value) / (2 * pi))
    return low <= value <= high


def summary(tier: str, out: Path, cases: Sequence[Case], runs: Sequence[Run]) -> dict[str, Any]:
    """The figures of one tier that the page prints."""
    rows = score(out, cases)
    marks = [(name, rate(bool(row[key]) for row in rows if key in row)) for key, name in MARKS.items()]
    kinds: dict[str, list[bool]] = {}
    for row in rows:
        for kind in row["truth"] or [row["group"]]:
            kinds.setdefault(kind, []).append(right(row))
    wrong = [
        f"{r['case']}: {' + '.join(r['truth']) or r['group']} → {r['verdict']}"
        f" {', '.join(r['found'] or r['candidates'][:2])}"
        for r in rows
        if not right(r)
    ]
    inside, total = coverage(out, cases)
    return {
        "tier": tier,
        "cases": len(rows),
        "marks": [(name, found) for name, found in marks if found.trials],
        "verdicts": Counter(r["verdict"] for r in rows).most_common(),
        "kinds": sorted((k, sum(v), len(v)) for k, v in kinds.items()),
        "wrong": wrong,
        "force": spread(ratios(out, cases, ("residual_force_rms", "id_rmse"))),
        "run": spread(ratios(out, cases, ("free_run_position_rmse", "sim_rmse"))),
        "inside": inside,
        "total": total,
        "failures": [f"{run.case}: {run.failure}" for run in runs if run.failure],
    }


def spread(values: Sequence[float]) -> tuple[float, float] | None:
    """Median and 90th percentile; None of nothing."""
    return (float(np.median(values)), float(np.quantile(values, 0.9))) if values else None

"""Score of the diagnosis on the practice logs beside the project: ``make practice``; skips where they are absent."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from math import pi
from pathlib import Path
from statistics import median, quantiles
from typing import Any

from codegen import pipeline
from codegen.errors import BadInput
from codegen.files import write_atomically
from codegen.text import render

ROOT = Path(__file__).resolve().parents[1]
PRACTICE = ROOT.parent / "shared" / "practice"
PAGE = ROOT / "docs" / "practice.md"
TIERS = ("standard", "hard")
WORKERS = 2


def run_case(case: Path, out: Path) -> dict[str, Any]:
    """Diagnose one case as a user would; seconds of wall and processor time go along."""
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        result = pipeline.diagnose(case / "spec.yaml", case / "train.csv", case / "test.csv", out / case.name)
        samples, failure = int(result.diagnosis.data["train_samples"]), ""
        as_scored(out / case.name / "diagnosis.json")
    except BadInput as error:
        samples, failure = 0, str(error)
    return {
        "case": case.name,
        "wall_s": time.perf_counter() - wall,
        "cpu_s": time.process_time() - cpu,
        "samples": samples,
        "failure": failure,
    }


def as_scored(path: Path) -> None:
    """A verdict that the scorer does not know becomes the one that it is to count as: ``unfit`` names nothing."""
    diagnosis = json.loads(path.read_text())
    if diagnosis["verdict"] == "unfit":
        path.write_text(json.dumps(diagnosis | {"verdict": "none"}, indent=1))


def score(tier: str, out: Path) -> list[dict[str, Any]]:
    """The rows of the shared scorer; its own print goes to score.txt."""
    target = out / "score.json"
    command = [sys.executable, str(PRACTICE / "score.py"), str(PRACTICE / tier), str(out), "--json", str(target)]
    said = subprocess.run(command, capture_output=True, text=True, check=True)
    (out / "score.txt").write_text(said.stdout)
    rows: list[dict[str, Any]] = json.loads(target.read_text())
    return rows


def right(row: dict[str, Any]) -> bool:
    """Whether the scorer's first mark of this group is as it should be."""
    match row["group"]:
        case "single":
            return bool(row["top1"])
        case "double":
            return bool(row["both"])
        case "foreign":
            return not row["foreign_called_known"]
        case "none":
            return not row["false_alarm"]
    return not row["overclaim"]


def ratios(tier: str, out: Path, rows: list[dict[str, Any]], figure: tuple[str, str]) -> list[float]:
    """Error after over the error of the true structure refitted, of cases with one or two effects."""
    ours, theirs = figure
    found = []
    for row in rows:
        if row["group"] not in ("single", "double"):
            continue
        truth = json.loads((PRACTICE / tier / row["case"] / "truth.json").read_text())
        after = json.loads((out / row["case"] / "diagnosis.json").read_text())["error"]["augmented"][ours]
        found.append((after if after is not None else float("inf")) / truth["oracle"]["true_structure"][theirs])
    return found


def coverage(tier: str, out: Path, rows: list[dict[str, Any]]) -> tuple[int, int]:
    """(truths inside their 95 % interval, truths) over parameters of effects that were rightly named."""
    inside = total = 0
    for row in rows:
        truth = json.loads((PRACTICE / tier / row["case"] / "truth.json").read_text())
        found = json.loads((out / row["case"] / "diagnosis.json").read_text())["effects"]
        for effect in truth["effects"]:
            same = [f for f in found if f["kind"] == effect["kind"] and f["on"] == effect["on"]]
            if same and "form" not in effect:
                for name, value in effect["parameters"].items():
                    low, high = same[0]["intervals"][name]
                    if name == "phase":
                        value += 2 * pi * round(((low + high) / 2 - value) / (2 * pi))
                    total, inside = total + 1, inside + (low <= value <= high)
    return inside, total


def summary(tier: str, out: Path, times: list[dict[str, Any]], rows: list[dict[str, Any]]) -> dict[str, Any]:
    """What the page prints of one tier."""
    marks: dict[tuple[str, str], list[bool]] = {}
    keys = ("top1", "missed", "extra_effect", "both", "false_alarm", "foreign_called_known", "overclaim")
    for row in rows:
        for key in keys:
            if key in row:
                marks.setdefault((row["group"].split("_")[0], key), []).append(bool(row[key]))
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
    force, run = (
        ratios(tier, out, rows, pair)
        for pair in (("residual_force_rms", "id_rmse"), ("free_run_position_rmse", "sim_rmse"))
    )
    inside, total = coverage(tier, out, rows)
    return {
        "tier": tier,
        "cases": len(rows),
        "marks": [(g, k, sum(v), len(v)) for (g, k), v in sorted(marks.items())],
        "kinds": sorted((k, sum(v), len(v)) for k, v in kinds.items()),
        "wrong": wrong,
        "force": spread(force),
        "run": spread(run),
        "inside": inside,
        "total": total,
        "cpu": spread([1e4 * 2.5 * t["cpu_s"] / t["samples"] for t in times if t["samples"]]),
        "longest": max(t["cpu_s"] for t in times),
        "failures": [f"{t['case']}: {t['failure']}" for t in times if t["failure"]],
        "named": Counter(r["verdict"] for r in rows).most_common(),
    }


def spread(values: list[float]) -> tuple[float, float]:
    """Median and 90th percentile."""
    return median(values), quantiles(values, n=10)[-1] if len(values) > 1 else values[0]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "practice_results")
    parser.add_argument("--tier", choices=TIERS, action="append")
    parser.add_argument("--again", action="store_true", help="run cases again whose result is there")
    args = parser.parse_args()
    if not PRACTICE.is_dir():
        print(f"practice: {PRACTICE} is not here; nothing to score")
        return
    pages = []
    for tier in args.tier or TIERS:
        out = args.out / tier
        out.mkdir(parents=True, exist_ok=True)
        cases = sorted(p.parent for p in (PRACTICE / tier).glob("case_*/truth.json"))
        todo = [c for c in cases if args.again or not (out / c.name / "time.json").exists()]
        with ProcessPoolExecutor(WORKERS) as pool:
            for spent in pool.map(run_case, todo, [out] * len(todo)):
                (out / spent["case"]).mkdir(exist_ok=True)
                (out / spent["case"] / "time.json").write_text(json.dumps(spent))
                print(f"{tier} {spent['case']}  {spent['cpu_s']:.1f} s  {spent['failure']}", flush=True)
        times = [json.loads((out / c.name / "time.json").read_text()) for c in cases]
        chosen = {c.name for c in cases}
        pages.append(summary(tier, out, times, [r for r in score(tier, out) if r["case"] in chosen]))
    page = render("text/practice.md.j2", tiers=pages)
    print(page)
    if not args.tier:
        write_atomically(PAGE, page)


if __name__ == "__main__":
    main()

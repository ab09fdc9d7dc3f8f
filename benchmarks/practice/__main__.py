"""Write docs/practice.md anew: ``make practice``; says so where the practice logs are absent.

Cases run one after the other, each in a process of its own, and their results are kept in OUT: a run that was stopped
goes on. The page is written where every part of every case is there; otherwise the text is printed only.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.practice.cases import PRACTICE, ROOT, TIERS, Case, cases
from benchmarks.practice.declared import NOT_IN_FREE_RUNS, VERDICTS, candidates, row, tally, verdict_on
from benchmarks.practice.peer import proposed, table, totals
from benchmarks.practice.runs import TYPICAL, Run, diagnosed, result_in, times, typical
from benchmarks.practice.score import right, score, summary
from benchmarks.practice.seeds import PAGE, kept, section, with_section
from benchmarks.text import render
from codegen.base.files import write_atomically
from codegen.diagnosis.fit.acceptance import ALPHA, LEAST_SHARE, LEAST_SIZE

PARTS = ("diagnosis", "declared", "peer")


@dataclass(frozen=True)
class Asked:
    """The cases to run, and where.

    Attributes:
        out: folder of the results. again: whether to run what is there already.
    """

    cases: Sequence[Case]
    out: Path
    again: bool

    def tier(self, tier: str) -> list[Case]:
        return [case for case in self.cases if case.tier == tier]


def diagnosis(asked: Asked) -> dict[str, Any]:
    """Every case as a user has it: score and time."""
    runs: list[Run] = []
    tiers = []
    for tier in [t for t in TIERS if asked.tier(t)]:
        own = []
        for case in asked.tier(tier):
            out = asked.out / tier / case.name
            own.append(diagnosed(case.name, case.folder, case.folder / "spec.yaml", out, asked.again))
            print(f"{case.title}  {own[-1].wall_s:.1f} s  {result_in(out)['verdict']}", flush=True)
        tiers.append(summary(tier, asked.out / tier, asked.tier(tier), own))
        runs += own
    return {
        "tiers": tiers,
        "time": [(f"{TYPICAL[0]:,} to {TYPICAL[1]:,} samples", times(typical(runs))), ("all", times(runs))],
        "cores": len(os.sched_getaffinity(0)),
        "codes": {run.code for run in runs},
    }


def declared(asked: Asked) -> dict[str, Any] | None:
    """Logs with their true effects declared, where the right verdict is none; and those that have no effect."""
    rows = []
    for case in candidates(asked.cases):
        rows.append(verdict_on(case, asked.out / "declared", asked.again))
        print(f"declared {case.title}  {rows[-1]['verdict']} {', '.join(rows[-1]['named'])}", flush=True)
    bare = [
        row(case, result_in(asked.out / case.tier / case.name))
        for case in asked.cases
        if case.group == "none" and (asked.out / case.tier / case.name / "run.json").exists()
    ]
    if not rows:
        return None
    held = [r for r in rows if NOT_IN_FREE_RUNS not in r["kinds"]]
    groups = (
        ("true effects declared", rows),
        (f"of these, without `{NOT_IN_FREE_RUNS}`", held),
        ("without an effect", bare),
        ("all", rows + bare),
    )
    return {
        "verdicts": VERDICTS,
        "groups": [(words, tally(some)) for words, some in groups if some],
        "others": [r for r in rows + bare if r["verdict"] != "none"],
        "codes": {r["code"] for r in rows},
        "alpha": ALPHA,
        "not_held": NOT_IN_FREE_RUNS,
    }


def peer(asked: Asked) -> dict[str, Any] | None:
    """PySINDy on the residuals of the same logs, those with one effect or none."""
    ours = {}
    for tier in [t for t in TIERS if (asked.out / t).is_dir()]:
        done = [c for c in asked.tier(tier) if (asked.out / tier / c.name / "run.json").exists()]
        ours |= {f"{tier}/{r['case']}": right(r) for r in score(asked.out / tier, done)}
    logs = [c for c in asked.cases if c.group in ("single", "none")]
    if not logs:
        return None
    answers = []
    for case in logs:
        answers.append(proposed(case, asked.out / "peer", asked.again))
        alone = answers[-1].alone
        print(f"peer {case.title}  {alone.term or 'no term'} {', '.join(alone.kinds)}", flush=True)
    marks = [ours.get(case.title) for case in logs]
    alone, largest = (
        list(zip(logs, [getattr(a, name) for a in answers], marks, strict=True)) for name in ("alone", "largest")
    )
    return {
        "rows": table(alone),
        "totals": [(group, totals(alone, group), totals(largest, group)) for group in ("single", "none")],
        "unnamed": sum(bool(a.alone.term and not a.alone.kinds) for a in answers),
        "codes": {a.code for a in answers},
        "least_share": LEAST_SHARE,
        "least_size": LEAST_SIZE,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "practice_results")
    parser.add_argument("--tier", choices=TIERS, action="append")
    parser.add_argument("--part", choices=PARTS, action="append", help="by default all")
    parser.add_argument("--only", nargs="+", metavar="CASE", default=[], help="case_0001, or standard/case_0001")
    parser.add_argument("--again", action="store_true", help="run what is there already")
    args = parser.parse_args()
    if not PRACTICE.is_dir():
        print(f"practice: {PRACTICE} is not here; nothing to score")
        return
    asked = Asked(cases(args.tier or TIERS, args.only), args.out.resolve(), args.again)
    if not asked.cases:
        parser.error(f"no such case: {' '.join(args.only)}")
    found: dict[str, Any] = dict.fromkeys(PARTS)
    for part, run in (("diagnosis", diagnosis), ("declared", declared), ("peer", peer)):
        if part in (args.part or PARTS):
            found[part] = run(asked)
    codes = set[str]().union(*(part["codes"] for part in found.values() if part))
    page = render("practice.md.j2", versions=len(codes), **found)
    page = with_section(page, section(scores)) if (scores := kept()) else page
    print(page)
    if not (args.tier or args.part or args.only):
        write_atomically(PAGE, page)


if __name__ == "__main__":
    main()

"""Score on fresh practice cases: ``make practice SEED=11 COUNT=60 TIER=both``.

Makes the set with the shared generator, diagnoses every case as a user would, scores it, keeps the score in seeds.json
and writes docs/practice.md's part on fresh seeds: the newest code beside its bars, and a row for each seed.
``python -m benchmarks.practice.seeds`` without a seed writes that part from the kept scores. Cases and results that are
there already are not made again; results lie in a folder for each version of the code, so a run that was stopped goes
on, and versions do not mix.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from benchmarks.practice import score as scoring
from benchmarks.practice.cases import ROOT, TIERS
from benchmarks.practice.fresh import Draw, Unavailable, failed_draws, fresh_cases
from benchmarks.practice.runs import code_version, diagnosed, result_in
from benchmarks.practice.tally import AS_WELL, Tally, tally
from benchmarks.rates import Bar, Rate
from benchmarks.text import render
from codegen.base.files import write_atomically

PAGE = ROOT / "docs" / "practice.md"
KEPT = Path(__file__).parent / "seeds.json"
BEGIN, END = "<!-- fresh seeds: written by `make practice SEED=…` -->", "<!-- end of fresh seeds -->"
ADAPTER: TypeAdapter[list[Tally]] = TypeAdapter(list[Tally])
ANY_TIER = {
    scoring.ALARM: Bar(most=0.03),
    scoring.OVERCLAIM: Bar(most=0.0),
    scoring.FOREIGN: Bar(most=0.05),
    scoring.INTERVALS: Bar(0.9, 0.99),
}
BARS = {
    "standard": {scoring.FIRST: Bar(0.95), scoring.BOTH: Bar(0.85), **ANY_TIER},
    "hard": {scoring.FIRST: Bar(0.88), scoring.BOTH: Bar(0.75), **ANY_TIER},
}
"""Tier → rate → its bar."""
NEWEST = 10
"""Seeds of a tier of which the page has the details; seeds.json has them of all."""
SHORT = {
    scoring.FIRST: "first place",
    scoring.BOTH: "both of two",
    scoring.ALARM: "false alarms",
    scoring.OVERCLAIM: "overclaims",
    scoring.FOREIGN: "foreign named",
    scoring.INTERVALS: "in interval",
}
"""Heads of the table of seeds; the rates that have a bar."""
FURTHER = {
    scoring.MISSED: "`none` for one",
    scoring.EXTRA: "an extra effect",
    scoring.ABSORBED: "absorbed, right",
    scoring.FIRST_OF_ALL: "first place of all",
    scoring.NONE: "`none` for none",
}
"""Heads of the table of further counts."""


def kept(file: Path = KEPT) -> list[Tally]:
    """The scores so far, in the order in which they were measured."""
    return ADAPTER.validate_json(file.read_bytes()) if file.exists() else []


def with_tally(scores: Sequence[Tally], new: Tally) -> list[Tally]:
    """The scores with one more at their end, or in place of that of the same set and code."""
    found = {score.key: score for score in scores} | {new.key: new}
    return list(found.values())


def pooled(scores: Sequence[Tally], name: str) -> Rate:
    """One rate over several sets."""
    rates = [score.rates[name] for score in scores if name in score.rates]
    return Rate(sum(r.hits for r in rates), sum(r.trials for r in rates))


def section(scores: Sequence[Tally]) -> str:
    """The part of the page between its marks, with them."""
    tiers: list[dict[str, Any]] = []
    for tier in [tier for tier in TIERS if any(score.tier == tier for score in scores)]:
        own = [score for score in reversed(scores) if score.tier == tier]
        latest = [score for score in own if score.code == own[0].code]
        rates = [(name, pooled(latest, name), bar) for name, bar in BARS[tier].items()]
        rows = [(name, rate, bar, bar.met_by(rate)) for name, rate, bar in rates if rate.trials]
        seen = {name for score in own for name, rate in score.rates.items() if rate.trials}
        heads, further = ([(n, w) for n, w in some.items() if n in seen] for some in (SHORT, FURTHER))
        tiers.append({"tier": tier, "scores": own, "latest": latest, "rows": rows, "heads": heads, "further": further})
    text = render("practice_seeds.md.j2", tiers=tiers, as_well=round(100 * (AS_WELL - 1)), newest=NEWEST)
    return f"{BEGIN}\n{text}{END}\n"


def with_section(page: str, new: str) -> str:
    """A page with the section in place of the one that it has, or before its second heading."""
    if BEGIN in page:
        before, rest = page.split(BEGIN, 1)
        return before + new + rest.split(f"{END}\n", 1)[1]
    before, heading, rest = page.partition("\n## ")
    return f"{before}\n{new}{heading}{rest}" if heading else f"{page}\n{new}"


def write_section(scores: Sequence[Tally]) -> None:
    """Write docs/practice.md with this part."""
    write_atomically(PAGE, with_section(PAGE.read_text(), section(scores)))


def run(draw: Draw, out: Path, jobs: int, again: bool) -> Tally:
    """Make, diagnose and score one set. Raises Unavailable where its cases cannot be made."""
    cases, code = fresh_cases(draw, out, jobs), code_version()
    folder = out / "fresh" / code / draw.folder
    runs = []
    for case in cases:
        runs.append(diagnosed(case.name, case.folder, case.folder / "spec.yaml", folder / case.name, again))
        verdict = result_in(folder / case.name)["verdict"]
        print(f"{draw.seed} {case.title}  {runs[-1].cpu_s:.1f} s of CPU  {verdict}", flush=True)
    key = (draw.seed, draw.count, draw.tier, code)
    return tally(key, folder, cases, runs, len(failed_draws(draw, out)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, help="one that nobody looked at while tuning; without, nothing is run")
    parser.add_argument("--count", type=int, default=60, help="cases a tier")
    parser.add_argument("--tier", choices=[*TIERS, "both"], default="standard")
    parser.add_argument("--out", type=Path, default=ROOT / "practice_results")
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)), help="processes of the generator")
    parser.add_argument("--again", action="store_true", help="diagnose what is there already")
    args = parser.parse_args()
    scores = kept()
    tiers = () if args.seed is None else TIERS if args.tier == "both" else (args.tier,)
    for tier in tiers:
        try:
            found = run(Draw(args.seed, args.count, tier), args.out.resolve(), args.jobs, args.again)
        except Unavailable as why:
            parser.exit(1, f"practice: {why}\n")
        scores = with_tally(scores, found)
        write_atomically(KEPT, json.dumps([asdict(s) for s in scores], indent=1, ensure_ascii=False) + "\n")
        write_section(scores)
    if args.seed is None:
        write_section(scores)
    print(section(scores))


if __name__ == "__main__":
    main()

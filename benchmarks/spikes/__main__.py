"""Write docs/spikes.md anew: known effects put into real logs by ../shared/practice/spike.py.

``python -m benchmarks.spikes [--set emps …] [--share 3 10 20] [--kinds cogging …]``: every kind that can be spiked, in
every set of benchmarks/real/sets.yaml that is here. Each plain and spiked log is diagnosed as a user would, 15 to 40 s
of CPU each; what is there already is not made again. With --kept nothing is diagnosed: outcomes are those of earlier
runs, and only least squares is computed anew. The page has all rows of rows.json besides, those of earlier runs that
were not run again, each with the version of its code. Page and rows.json are written where everything was asked for
(and with --write); otherwise the text is printed only.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from benchmarks.practice.cases import ROOT
from benchmarks.practice.fresh import Unavailable
from benchmarks.rates import Bar, Rate, rate
from benchmarks.real.spiked import real_sets
from benchmarks.spikes.outcome import CANDIDATES, CHOSEN, NEAR, OUTCOMES, PREFERRED, named, outcome_of, spike_of, totals
from benchmarks.spikes.rows import ROWS, Part, Row, merged, parts_in, text_of
from benchmarks.spikes.runs import SPIKE, Bench, kinds_for
from benchmarks.text import render
from codegen.base.files import write_atomically
from codegen.diagnosis.fit.acceptance import LEAST_SHARE

PAGE = ROOT / "docs" / "spikes.md"
SHARES = (3.0, 10.0, 20.0)
BARS = {(10.0, "detected"): Bar(0.8), (10.0, "wrong names"): Bar(most=0.05)}
"""(share, rate) → its bar, of all spikes."""
NOT_RUN = "not run"


def part(bench: Bench, kinds: Sequence[str], shares: Sequence[float], again: bool, kept: Part | None = None) -> Part:
    """Diagnose a set, plain and spiked.

    Args:
        kept: what an earlier run found. Then nothing is diagnosed, and only least squares is computed anew.
    """
    if kept is not None:
        some = [row for row in kept.rows if row.kind in kinds and row.percent in shares]
        spikes = [spike_of(*bench.truth(r.kind, r.percent), bench.one.refitted.get(r.kind, "")) for r in some]
        rows = [replace(row, spike=spike) for row, spike in zip(some, spikes, strict=True)]
        return replace(kept, rows=tuple(rows))
    plain = bench.diagnosis(kinds[0], 0, again)
    print(f"{bench.name}  as it is  {plain['verdict']} {', '.join(named(plain))}", flush=True)
    rows = []
    for kind in kinds:
        for percent in shares:
            spiked = bench.diagnosis(kind, percent, again)
            spike = spike_of(*bench.truth(kind, percent), bench.one.refitted.get(kind, ""))
            rows.append(Row(kind, percent, spike, outcome_of(spike, plain, spiked), bench.code))
            said = ", ".join(rows[-1].outcome.said)
            print(f"{bench.name}  {kind} {percent:g} %  {rows[-1].outcome.outcome}  {said}", flush=True)
    return Part(bench.name, plain["verdict"], named(plain), tuple(rows), bench.code)


def rates(rows: Sequence[Row]) -> dict[str, Rate]:
    """Sensitivity and wrong names, in words: of all spikes, and of those that least squares tells from zero or sees."""
    every = [r.outcome for r in rows]
    some = {
        "detected, of those that least squares tells from zero": [r.outcome for r in rows if r.spike.is_told],
        "detected, of those that least squares tells among all candidates": [
            r.outcome for r in rows if r.spike.is_told_among_all
        ],
        "detected, of those that it also prefers to every other law": [r.outcome for r in rows if r.spike.is_preferred],
        "detected, of those that least squares sees": [r.outcome for r in rows if r.spike.is_visible],
    }
    found = totals(every) | {words: totals(outcomes)["detected"] for words, outcomes in some.items()}
    return found | {"told from zero by least squares": rate(r.spike.is_told for r in rows)}


def cell(one: Part, kind: str, percent: float) -> str:
    """The outcome of a kind at a share in a set, for a cell of the table."""
    return next((r.outcome.outcome for r in one.rows if (r.kind, r.percent) == (kind, percent)), NOT_RUN)


def page(parts: Sequence[Part], shares: Sequence[float], absent: Sequence[str], kinds: Sequence[str] = ()) -> str:
    """The text of docs/spikes.md; ``kinds``: all that were asked for; by default those that were run."""
    rows = [row for one in parts for row in one.rows]
    kinds = list(dict.fromkeys([*kinds, *(r.kind for r in rows)]))
    by_share = [(percent, [r for r in rows if r.percent == percent]) for percent in shares]
    return render(
        "spikes.md.j2",
        parts=parts,
        shares=shares,
        totals=[
            (percent, words, found, BARS.get((percent, words)))
            for percent, some in by_share
            for words, found in rates(some).items()
        ],
        counts=[(words, [sum(r.outcome.outcome == words for r in some) for _, some in by_share]) for words in OUTCOMES],
        by_kind=[
            (kind, [totals([r.outcome for r in rows if (r.kind, r.percent) == (kind, p)])["detected"] for p in shares])
            for kind in kinds
        ],
        cells=[(kind, [cell(one, kind, p) for one in parts for p in shares]) for kind in kinds],
        absent=absent,
        codes=codes_of(parts),
        near=round(100 * NEAR),
        chosen=CHOSEN,
        candidates=CANDIDATES,
        preferred=PREFERRED,
        least=round(100 * LEAST_SHARE),
    )


def codes_of(parts: Sequence[Part]) -> list[tuple[str, int]]:
    """Versions of the code with the number of spikes that each diagnosed, the most frequent first."""
    rows = [row.code for one in parts for row in one.rows]
    return sorted(((code, rows.count(code)) for code in dict.fromkeys(rows)), key=lambda pair: -pair[1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--set", nargs="+", dest="sets", metavar="SET", default=[])
    parser.add_argument("--share", nargs="+", type=float, metavar="PERCENT", default=list(SHARES))
    parser.add_argument("--kinds", nargs="+", metavar="KIND", default=[])
    parser.add_argument("--out", type=Path, default=ROOT / "practice_results" / "spikes")
    parser.add_argument("--again", action="store_true", help="diagnose what is there already")
    parser.add_argument("--kept", action="store_true", help="diagnose nothing, compute least squares anew")
    parser.add_argument("--write", action="store_true", help="write the page although not everything was asked for")
    args = parser.parse_args()
    if not SPIKE.is_file():
        print(f"spikes: {SPIKE} is not here; nothing can be put into a log")
        return
    out = args.out.resolve()
    try:
        chosen = real_sets(args.sets)
    except KeyError as name:
        parser.error(f"no such set: {name}; there are {', '.join(real_sets())}")
    absent = [name for name, one in chosen.items() if not one.is_here]
    parts: list[Part] = []
    before = {one.name: one for one in parts_in(ROWS)}
    every: list[str] = []
    try:
        for name, one in chosen.items():
            kinds = [kind for kind in kinds_for(one, out) if not args.kinds or kind in args.kinds]
            every += kinds
            if name not in absent and kinds:
                if args.kept and name not in before:
                    absent.append(name)
                    continue
                kept = before[name] if args.kept else None
                parts.append(part(Bench(name, one, out), kinds, args.share, args.again, kept))
    except (Unavailable, RuntimeError) as why:
        parser.exit(1, f"spikes: {why}\n")
    every_part = merged(parts, list(before.values()))
    shown = {one.name for one in every_part}
    shares = sorted({row.percent for one in every_part for row in one.rows})
    text = page(every_part, shares, [name for name in real_sets([]) if name not in shown], every)
    print(text)
    whole = not (args.sets or args.kinds or absent or args.kept) and tuple(args.share) == SHARES
    if whole or args.write:
        write_atomically(ROWS, text_of(every_part))
        write_atomically(PAGE, text)


if __name__ == "__main__":
    main()

"""Write docs/calibration.md and its picture anew: false alarms on surrogates of every practice log and real set.

``python -m benchmarks.surrogates [--group standard hard emps …] [--only LOG …] [--count 4]``. A log costs one diagnosis
as it is and one a surrogate, without report and certificate; the page states the CPU time of one. Results are kept, one
file a log and a folder for each version of the code: a larger --count adds to what is there. The page is written where
every log was asked for (and with --write); otherwise the text is printed only.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.panels import svg_of
from benchmarks.practice.cases import ROOT, TIERS
from benchmarks.practice.runs import code_version
from benchmarks.rates import Bar, rate
from benchmarks.surrogates.runs import Trials, sources, table, trials_of
from benchmarks.surrogates.surrogate import BLOCK_S, WAYS
from benchmarks.text import render
from codegen.base.errors import BadInput
from codegen.base.files import write_all
from codegen.diagnosis.fit.acceptance import ALPHA, LEAST_NET
from codegen.report.style import CURVE, INK, QUIET, SECOND, THIRD, labelled

LEAST = 1e-4
COLOURS = (CURVE, SECOND, THIRD)


def picture(ways: Mapping[str, Mapping[str, Sequence[float]]], alpha: float) -> str:
    """The SVG: way → group → p of its surrogates, a panel a way."""
    return svg_of(tuple(partial(_panel, way=way, groups=groups, alpha=alpha) for way, groups in ways.items()))


def steps(values: Sequence[float]) -> tuple[list[float], list[float]]:
    """The share of values at or below each of them, as the corners of its stairs from ``LEAST`` to 1."""
    p = np.sort(np.clip(values, LEAST, 1.0))
    share = np.arange(1, len(p) + 1) / len(p)
    return [*map(float, p), 1.0], [*map(float, share), 1.0]


def _panel(axes: Any, way: str, groups: Mapping[str, Sequence[float]], alpha: float) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.plot([LEAST, 1], [LEAST, 1], color=QUIET, linewidth=1.2, linestyle=(0, (4, 3)))
    axes.axvline(alpha, color=QUIET, linewidth=0.8)
    lowest = min((1 / len(p) for p in groups.values() if len(p)), default=0.1)
    for k, (group, values) in enumerate(groups.items()):
        if len(values):
            axes.step(*steps(values), where="post", color=COLOURS[k % len(COLOURS)], linewidth=1.8, label=group)
    axes.set_xlim(LEAST, 1)
    axes.set_ylim(min(lowest / 2, alpha / 2), 1.1)
    axes.set_title(way, color=INK)
    axes.legend(frameon=False, loc="upper left", fontsize=10)
    labelled(axes, "nominal rate", "share with p below it")


PAGE, PICTURE = "calibration.md", "calibration.svg"
REAL = "real sets"
FEW = Bar(most=0.03)
"""False alarms where no law can be."""


def page(found: Sequence[Trials], code: str, here: int = 0) -> dict[str, str]:
    """File → text, below docs/; ``here``: logs that are here; by default those that were run."""
    curves = {
        way: {
            group: [t.p_material for one in found for t in one.trials if t.way == way and _curve(one.group) == group]
            for group in dict.fromkeys(_curve(one.group) for one in found)
        }
        for way in WAYS
    }
    every = [t for one in found for t in one.trials]
    totals = [
        ("an effect is accepted", rate(t.verdict == "effect" for t in every), FEW),
        (f"p ≤ {ALPHA}, of a material candidate", rate(t.p_material <= ALPHA for t in every), Bar(most=ALPHA)),
        (f"p ≤ {ALPHA}, of any candidate", rate(t.p <= ALPHA for t in every), None),
    ]
    alarms = [(one.name, t) for one in found for t in one.trials if t.verdict == "effect"]
    text = render(
        "calibration.md.j2",
        totals=[(words, rate_, bar or "–", bar and bar.met_by(rate_)) for words, rate_, bar in totals],
        rows=table(found, ALPHA),
        alarms=[(name, t.way, t.named, t.p) for name, t in alarms],
        without=[one.name for one in found if not one.trials],
        alpha=ALPHA,
        least_size=LEAST_NET,
        block=BLOCK_S,
        code=code,
        run=len(found),
        here=max(here, len(found)),
        picture=PICTURE,
    )
    return {PAGE: text, PICTURE: picture(curves, ALPHA)}


def _curve(group: str) -> str:
    return group if group in TIERS else REAL


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--group", nargs="+", metavar="GROUP", default=[], help="standard, hard, or a real set")
    parser.add_argument("--only", nargs="+", metavar="LOG", default=[], help="standard/case_0001, or a real set")
    parser.add_argument("--count", type=int, default=4, help="surrogates a log, by signs and by order in turn")
    parser.add_argument("--out", type=Path, default=ROOT / "practice_results" / "surrogates")
    parser.add_argument("--again", action="store_true", help="run what is there already")
    parser.add_argument("--write", action="store_true", help="write the page although not every log was asked for")
    args = parser.parse_args()
    chosen = sources(args.group, args.only)
    if not chosen:
        parser.exit(0, "surrogates: no such log is here\n")
    code, found = code_version(), []
    for source in chosen:
        file = args.out.resolve() / code / f"{source.name.replace('/', '_')}.json"
        try:
            found.append(trials_of(source, file, args.count, args.again))
        except BadInput as why:
            print(f"{source.name}  {why}", flush=True)
            continue
        said = ", ".join(f"{t.way} {t.verdict} {t.p:.2g} ({t.cpu_s:.0f} s)" for t in found[-1].trials)
        print(f"{source.name}  as it is {found[-1].plain}; {said}", flush=True)
    files = page(found, code, len(sources()))
    print(files[PAGE])
    if not (args.group or args.only) or args.write:
        write_all(ROOT / "docs", files)


if __name__ == "__main__":
    main()

"""Write docs/peers.md anew: held-out errors of fits of parameters alone and of a sparse sum, beside a diagnosis.

``python -m benchmarks.rivals [--kinds 6] [--only standard/case_0001 real/emps …]``. A log costs one diagnosis
and one fit by mujoco.sysid, 20 to 60 s of CPU; what is there already is not made again. MuJoCo is installed from the
registry into an environment below practice_results/ at the first run. With --only the page shows what else is kept and
names the rest of the sample as not run; it is written without --only, and with --write.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from benchmarks.practice.cases import PRACTICE, ROOT
from benchmarks.practice.fresh import Unavailable
from benchmarks.rivals.axis import FACTOR, FRICTION_FACTOR
from benchmarks.rivals.logs import REAL, RIGHT, WRONG, Pair, pairs
from benchmarks.rivals.runs import RUN_S, Compared, Errors, compared, is_kept
from benchmarks.text import render
from codegen.base.files import write_atomically
from codegen.effects import CATALOGUE

PAGE = ROOT / "docs" / "peers.md"
KINDS = 6
MODELS = ("declared", "mujoco", "refit", "pysindy", "augmented")
Row = tuple[Pair, Compared]


def ratios(rows: Sequence[Row], figure: Callable[[Errors], float | None]) -> dict[str, tuple[float, float] | None]:
    """Model → median and largest of its error over that of the augmented model."""
    found: dict[str, tuple[float, float] | None] = {}
    for name in MODELS[:-1]:
        pairs_ = [(figure(getattr(c, name)), figure(c.augmented)) for _, c in rows]
        each = [theirs / ours for theirs, ours in pairs_ if theirs is not None and ours]
        found[name] = (float(np.median(each)), max(each)) if each else None
    return found


def page(rows: Sequence[Row], absent: Sequence[str] = ()) -> str:
    """The text of docs/peers.md; ``absent``: logs of the sample that were not run."""
    groups = [(group, [row for row in rows if row[0].group == group]) for group in (WRONG, RIGHT, REAL)]
    return render(
        "peers.md.j2",
        groups=[(group, some) for group, some in groups if some],
        force=[(group, ratios(some, lambda e: e.force)) for group, some in groups if some],
        position=[(group, ratios(some, lambda e: e.position)) for group, some in groups if some],
        models=MODELS,
        versions=sorted({c.answer.version for _, c in rows}),
        codes=sorted({c.code for _, c in rows}),
        seconds=float(np.median([c.answer.seconds for _, c in rows])) if rows else 0.0,
        run=RUN_S,
        absent=absent,
        factor=FACTOR,
        friction=FRICTION_FACTOR,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinds", type=int, default=KINDS, help="the first log of each of so many kinds of effects")
    parser.add_argument("--only", nargs="+", metavar="LOG", default=[], help="standard/case_0001, real/emps")
    parser.add_argument("--out", type=Path, default=ROOT / "practice_results" / "rivals")
    parser.add_argument("--again", action="store_true", help="run what is there already")
    parser.add_argument("--write", action="store_true", help="write the page although logs of the sample are not run")
    args = parser.parse_args()
    if not PRACTICE.is_dir():
        print(f"rivals: {PRACTICE} is not here; nothing to compare on")
        return
    rows: list[Row] = []
    asked, out = pairs(args.kinds, args.only), args.out.resolve()
    shown = [pair for pair in pairs(len(CATALOGUE)) if pair in asked or is_kept(pair, out)]
    absent = [pair.title for pair in pairs(args.kinds) if pair not in shown]
    for pair in shown:
        try:
            rows.append((pair, compared(pair, out, args.again and pair in asked)))
        except Unavailable as why:
            parser.exit(1, f"rivals: {why}\n")
        c = rows[-1][1]
        each = ", ".join(f"{name} {100 * getattr(c, name).force:.3g} %" for name in MODELS)
        print(f"{pair.title}  {pair.lacks or pair.group}: {each}; {c.verdict} {', '.join(c.named)}", flush=True)
    text = page(rows, absent)
    print(text)
    if args.write or not args.only:
        write_atomically(PAGE, text)


if __name__ == "__main__":
    main()

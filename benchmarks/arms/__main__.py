"""Write docs/arms.md: ``python -m benchmarks.arms [--only CASE …] [--kept]``.

Makes each case below OUT where it is not there, diagnoses it as a user would, one after the other, and keeps its row;
without ``--only`` all cases. With ``--kept`` results of earlier runs are read where they are there.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.arms.cases import CASES, made
from benchmarks.arms.page import PAGE, ROOT, keep, row_of
from benchmarks.practice.runs import diagnosed, result_in


def main() -> None:
    names = [case.name for case in CASES]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", default=names, choices=names, metavar="CASE", help=", ".join(names))
    parser.add_argument("--kept", action="store_true", help="diagnose nothing that is there already")
    parser.add_argument("--out", type=Path, default=ROOT / "practice_results" / "arms")
    args = parser.parse_args()
    for case in CASES:
        if case.name in args.only:
            folder, out = made(case, args.out.resolve() / "cases"), args.out.resolve() / "results" / case.name
            run = diagnosed(case.name, folder, folder / "spec.yaml", out, again=not args.kept)
            row = row_of(case, run, result_in(out))
            keep([row])
            print(f"{row.case}: {row.said} {row.found}, {run.cpu_s:.0f} s of the processor", flush=True)
    print(PAGE)


if __name__ == "__main__":
    main()

"""``python -m benchmarks.real [SET…]``: diagnose the measured logs as published; write the tables of docs/data_SET.md.

Results are kept in OUT; with --kept those that are there are not made again. Says so where the logs are absent.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from benchmarks.real.page import page_of, row, write
from benchmarks.real.runs import diagnosed, kept
from benchmarks.real.sets import DATA, ROOT, SETS


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.real", description=__doc__.splitlines()[0])
    parser.add_argument("sets", nargs="*", metavar="SET", help=f"of {', '.join(SETS)}; all without one")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "real_results", metavar="OUT")
    parser.add_argument("--kept", action="store_true", help="do not run again what has a result")
    asked = parser.parse_args()
    if names := sorted(set(asked.sets) - set(SETS)):
        parser.error(f"no set {', '.join(names)}; there are {', '.join(SETS)}")
    for name in asked.sets or SETS:
        if not (DATA / name).is_dir():
            print(f"{name}: {DATA / name} is not here; its page stays as it is", file=sys.stderr)
            continue
        for run in SETS[name]:
            out = asked.output.resolve() / name / run.name
            if not (asked.kept and kept(out)):
                print(f"{name}/{run.name}", file=sys.stderr, flush=True)
                diagnosed(name, run, out)
            print(row(run, out), end="", flush=True)
        write(name, asked.output.resolve())
        print(f"{page_of(name)} written", file=sys.stderr)


if __name__ == "__main__":
    main()

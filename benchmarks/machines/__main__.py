"""Write docs/other_machines.md anew: the diagnosis on machines of another simulator, with known effects.

``python -m benchmarks.machines --seed S --count N --out DIR``: cases are drawn, 3 s each, and diagnosed as a user
would, 20 to 60 s of CPU each; what is in DIR already is not made again. The rows of a seed are kept beside this file,
and the page has those of all kept seeds; a seed under --held-out was drawn at random and not looked at before.
Without --write the text is printed only.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from pydantic import TypeAdapter

from benchmarks.machines.cases import made
from benchmarks.machines.judge import LEAST_LEFT, LEAST_SHARE, LEAST_T
from benchmarks.machines.outcome import BARS, OUTCOMES, Row, rates, row_of
from benchmarks.practice.cases import ROOT
from benchmarks.practice.runs import diagnosed, result_in
from benchmarks.text import render
from codegen.base.files import write_atomically

PAGE = ROOT / "docs" / "other_machines.md"
KEPT = Path(__file__).with_name("seeds.json")


@dataclass(frozen=True)
class Seed:
    """The cases of a seed; ``held_out`` says that it was not looked at before."""

    seed: int
    held_out: bool
    rows: tuple[Row, ...]


ADAPTER: TypeAdapter[tuple[Seed, ...]] = TypeAdapter(tuple[Seed, ...])


def kept() -> tuple[Seed, ...]:
    """The results of earlier runs, one entry for each seed."""
    return ADAPTER.validate_json(KEPT.read_bytes()) if KEPT.is_file() else ()


def rows(seed: int, cases: Sequence[int], out: Path, again: bool) -> tuple[Row, ...]:
    """Draw cases and diagnose them."""
    found = []
    for index in cases:
        name = f"case_{index:04d}"
        folder, results = made(seed, index, out / f"seed_{seed}" / name), out / f"results_{seed}" / name
        run = diagnosed(name, folder, folder / "spec.yaml", results, again)
        truth = json.loads((folder / "truth.json").read_text())
        found.append(row_of(name, truth, result_in(results), round(run.cpu_s, 1), run.code))
        print(line(found[-1]), flush=True)
    return tuple(found)


def line(row: Row) -> str:
    """A case and its outcome in one printed line."""
    truth = " + ".join(row.truth) or "nothing"
    shown = f"{100 * row.share:.0f} %, t {row.t:.0f}{'' if row.identifiable else ', not identifiable'}"
    return f"{row.case}  {row.family}  {truth} ({shown})  {row.verdict} {', '.join(row.said)}  {row.outcome}"


def page(seeds: Sequence[Seed]) -> str:
    """The text of docs/other_machines.md."""
    groups = [
        (words, [s for s in seeds if s.held_out == held]) for words, held in (("held out", True), ("seen", False))
    ]
    parts = [(words, some, [row for one in some for row in one.rows]) for words, some in groups if some]
    return render(
        "other_machines.md.j2",
        parts=[
            {
                "words": words,
                "seeds": [one.seed for one in some],
                "cases": len(every),
                "rows": [(one.seed, row) for one in some for row in one.rows],
                "rates": [(name, found, BARS.get(name)) for name, found in rates(every).items()],
                "counts": [(name, sum(row.outcome == name for row in every)) for name in OUTCOMES],
                "codes": sorted({row.code for row in every}),
            }
            for words, some, every in parts
        ],
        least=(100 * LEAST_SHARE, 100 * LEAST_LEFT, LEAST_T),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--only", type=int, nargs="+", metavar="INDEX", help="these cases in place of the first COUNT")
    parser.add_argument("--out", type=Path, default=ROOT / "practice_results" / "machines")
    parser.add_argument("--held-out", action="store_true", help="the seed was drawn at random and not looked at")
    parser.add_argument("--again", action="store_true", help="diagnose what is there already")
    parser.add_argument("--write", action="store_true", help="keep the rows and write the page")
    args = parser.parse_args()
    cases = args.only if args.only is not None else range(args.count)
    one = Seed(args.seed, args.held_out, rows(args.seed, cases, args.out.resolve(), args.again))
    seeds = sorted([one, *(s for s in kept() if s.seed != args.seed)], key=lambda s: s.seed)
    text = page(seeds)
    print(text)
    if args.write:
        write_atomically(KEPT, json.dumps([asdict(s) for s in seeds], indent=1) + "\n")
        write_atomically(PAGE, text)


if __name__ == "__main__":
    main()

"""Write the open-loop tables of docs/data_emps.md anew: ``python -m benchmarks.emps``; says so where EMPS is absent.

One minute of CPU for the fits and one for the diagnosis of the training record; the fits are kept, and not made again
without --again.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter

from benchmarks.emps.choice import BLOCKS, Candidate, candidates, mean_prediction, rules
from benchmarks.emps.floor import FORCE_N, drift_mm, floor, left_out_mm, whole, whole_length
from benchmarks.emps.models import BY_DIRECTION, STRUCTURES, Model, score
from benchmarks.emps.records import DATA, FREE_SAMPLES, RECORDS, ROOT, Measured, read
from benchmarks.text import render, replaced
from codegen.base.files import write_atomically
from codegen.diagnosis.diagnose import diagnose_log
from codegen.logs import read_log
from codegen.mechanics import System, build_system
from codegen.spec import Spec, read_spec

PAGE = ROOT / "docs" / "data_emps.md"
MARKERS = "<!-- python -m benchmarks.emps: begin -->", "<!-- python -m benchmarks.emps: end -->"
PUBLISHED = {"polynomial NARX": 5.17, "linear state space": 5.53, "dynoNet": 2.64}
"""mm on the test record, of the same protocol; none is ours."""
ADAPTER: TypeAdapter[list[Candidate]] = TypeAdapter(list[Candidate])


def found_in(file: Path, system: System, training: Measured, again: bool) -> list[Candidate]:
    """All candidates; those of structures that the file has are read."""
    done = ADAPTER.validate_json(file.read_bytes()) if file.exists() and not again else []
    for kinds in STRUCTURES:
        if not any(c.kinds == kinds for c in done):
            done += candidates(Model(system, kinds), training)
            print(", ".join(f"{c.seconds or 'whole'}: {c.error:.2f} mm" for c in done if c.kinds == kinds), flush=True)
            write_atomically(file, json.dumps([asdict(c) for c in done], indent=1) + "\n")
    return done


def verdict_in(file: Path, spec: Spec, system: System, again: bool) -> tuple[str, ...]:
    """The effects that the diagnosis names on the training record, its end held out; the test record is not read."""
    if again or not file.exists():
        said = diagnose_log(spec, system, read_log(DATA / RECORDS["training"], spec))[0]
        write_atomically(file, json.dumps([e.kind for e in said.effects]) + "\n")
    return tuple(json.loads(file.read_text()))


def page(system: System, data: dict[str, Measured], found: list[Candidate], verdict: tuple[str, ...]) -> str:
    """The generated part of docs/data_emps.md."""
    models = {kinds: Model(system, kinds) for kinds in {c.kinds for c in found}}
    training, test = data["training"], data["test"]
    chosen = {words: rule(found) for words, rule in rules(verdict).items()}
    rows = []
    for words, some in chosen.items():
        errors = [score(mean_prediction(some, models, d), d.measured) for d in (training, test)]
        rows.append((words, [(models[c.kinds].words, c.seconds) for c in some], *errors))
    every = []
    for c in sorted(found, key=lambda c: c.error):
        errors = [whole(models[c.kinds], np.array(c.theta), d) for d in (training, test)]
        every.append((models[c.kinds].words, c.seconds, len(c.theta), c.error, *errors))
    own = list(chosen.values())[-1][0]
    structures = [BY_DIRECTION, (*BY_DIRECTION, "presliding")]
    return render(
        "emps.md.j2",
        rows=rows,
        published=PUBLISHED,
        verdict=verdict,
        every=every,
        floors=[floor(models[k], whole_length(found, k), training, test) for k in structures],
        left_out=left_out_mm(models[own.kinds], own, test),
        own=models[own.kinds].words,
        halves=own.errors,
        drift=drift_mm(models[own.kinds], np.array(own.theta), test),
        force=FORCE_N,
        free=FREE_SAMPLES,
        blocks=BLOCKS,
        seconds=len(training) * training.sample_time,
    )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.emps", description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "practice_results" / "emps")
    parser.add_argument("--again", action="store_true", help="make the fits that are there already")
    args = parser.parse_args()
    if not DATA.is_dir():
        print(f"emps: {DATA} is not here; nothing to run")
        return
    spec, out = read_spec(ROOT / "specs" / "emps.yaml"), args.out.resolve()
    system = build_system(spec)
    data = {name: read(spec, name) for name in RECORDS}
    found = found_in(out / "candidates.json", system, data["training"], args.again)
    verdict = verdict_in(out / "verdict.json", spec, system, args.again)
    part = page(system, data, found, verdict)
    print(part)
    write_atomically(PAGE, replaced(PAGE.read_text(encoding="utf-8"), part, MARKERS, PAGE.name))


if __name__ == "__main__":
    main()

"""``python -m benchmarks.diagnosis_time --seed S``: the time of ``stiction diagnose``, into docs/performance.md.

The practice cases of about 25,000 samples among those that the shared generator draws from these seeds, and the arm of
seven joints, each diagnosed as a user would, one after the other. Nothing is scored here; a seed used here is seen.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
from dataclasses import asdict
from pathlib import Path

from benchmarks.diagnosis_time.arm import simulated_arm
from benchmarks.diagnosis_time.page import KEPT, Measured, section, with_section
from benchmarks.machine import this_machine
from benchmarks.page import PAGE, ROOT
from benchmarks.practice.fresh import Draw, fresh_cases
from benchmarks.practice.runs import TYPICAL, Run, diagnosed, diagnosed_logs, result_in
from codegen.base.files import write_atomically


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, action="append", required=True)
    parser.add_argument("--count", type=int, default=10, help="cases a seed, of the standard tier")
    parser.add_argument("--out", type=Path, default=ROOT / "practice_results")
    args = parser.parse_args()
    out, loads, runs, verdicts = args.out.resolve(), [], [], []

    def done(run: Run, folder: Path) -> Run:
        loads.append(os.getloadavg()[0])
        verdicts.append(f"{run.case}: {result_in(folder)['verdict']}")
        print(f"{verdicts[-1]}, {run.wall_s:.1f} s, {run.cpu_s:.1f} s of the processor", flush=True)
        return run

    for seed in args.seed:
        for case in fresh_cases(Draw(seed, args.count, "standard"), out, os.cpu_count() or 1):
            with (case.folder / "train.csv").open() as rows:
                samples = sum(1 for _ in rows) - 1
            if TYPICAL[0] <= samples <= TYPICAL[1]:
                name, folder = f"seed {seed}, {case.name}", out / "time" / f"{seed}_{case.name}"
                runs.append(done(diagnosed(name, case.folder, case.folder / "spec.yaml", folder, True), folder))
    place = out / "time" / "arm"
    place.mkdir(parents=True, exist_ok=True)
    spec, log = simulated_arm(place)
    arm = done(diagnosed_logs("arm of seven joints", spec, [log], [], place / "results", True), place / "results")
    machine = this_machine()
    found = Measured(machine.processor, machine.cores, statistics.mean(loads), tuple(runs), arm, tuple(verdicts))
    write_atomically(KEPT, json.dumps(asdict(found), indent=1, ensure_ascii=False) + "\n")
    write_atomically(ROOT / PAGE, with_section((ROOT / PAGE).read_text()))
    print(section())


if __name__ == "__main__":
    main()

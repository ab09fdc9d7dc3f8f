"""``python -m benchmarks.diagnosis_time --seed S``: the time of ``stiction diagnose``, into docs/performance.md.

The practice cases of about 25,000 samples among those that the shared generator draws from these seeds, and the arm of
seven joints, each diagnosed as a user would, one after the other. Nothing is scored here; a seed used here is seen.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
from dataclasses import asdict
from pathlib import Path

import stiction
from benchmarks.diagnosis_time.page import KEPT, Measured, section, with_section
from benchmarks.machine import this_machine
from benchmarks.page import PAGE, ROOT
from benchmarks.practice.fresh import Draw, fresh_cases
from benchmarks.practice.runs import TYPICAL, Run, diagnosed, diagnosed_logs, result_in
from codegen.base.files import write_atomically
from codegen.base.resources import resource_folder

SPEC = "name: arm7\nurdf: {file: seven_joint_arm.urdf}\n"
LACKING = """effects:
  - {kind: cogging, on: [elbow_pitch], parameters: {amplitude: 2.0, period: 0.35, phase: 0.4}}
simulation:
  duration: 25
  sample_time: 0.005
  reference:
    shoulder_yaw: "0.9*sin(0.9*t) + 0.3*sin(2.3*t)"
    shoulder_pitch: "0.7*sin(1.1*t + 1) + 0.3*sin(2.9*t)"
    arm_roll: "0.9*sin(0.8*t + 2) + 0.3*sin(3.1*t)"
    elbow_pitch: "0.8*sin(1.3*t) + 0.25*sin(3.7*t + 1)"
    forearm_roll: "1.0*sin(1.0*t + 0.5) + 0.3*sin(4.1*t)"
    wrist_pitch: "0.8*sin(1.4*t + 1.5) + 0.3*sin(4.7*t)"
    hand_roll: "1.2*sin(1.2*t + 2.5) + 0.3*sin(4.3*t)"
"""
JOINTS = ("shoulder_yaw", "shoulder_pitch", "arm_roll", "elbow_pitch", "forearm_roll", "wrist_pitch", "hand_roll")
DAMPING = (12, 60, 5, 9, 1.2, 2, 0.12)


def _mapping(key: str, values: dict[str, float]) -> str:
    return f"  {key}: {{{', '.join(f'{name}: {value:g}' for name, value in values.items())}}}\n"


def simulated_arm(folder: Path) -> tuple[Path, Path]:
    """The spec without the effect and the log of the machine with it, written into a folder."""
    shutil.copy(resource_folder("specs") / "seven_joint_arm.urdf", folder / "seven_joint_arm.urdf")
    gains = {f"w_{name}": d for name, d in zip(JOINTS, DAMPING, strict=True)}
    loop = _mapping("velocity_gain", gains) + _mapping("position_gain", {n: 20 * d for n, d in gains.items()})
    loop += _mapping("position_noise", dict.fromkeys(JOINTS, 1e-5))
    spec, log = folder / "arm.yaml", folder / "log.csv"
    (folder / "plant.yaml").write_text(SPEC + LACKING + loop)
    spec.write_text(SPEC)
    if not log.exists():
        stiction.simulate(folder / "plant.yaml", log)
    return spec, log


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

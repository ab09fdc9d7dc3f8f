"""A diagnosis as a user starts it, timed, and kept so that a run that was stopped goes on."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.practice.cases import ROOT
from codegen.base.files import write_atomically

EXIT_UNFIT = 3
TYPICAL = (20_000, 30_000)
"""Samples of a training log whose time is compared with what is asked for a log of 25,000."""


@dataclass(frozen=True)
class Run:
    """One diagnosis.

    Attributes:
        wall_s, cpu_s: from the start of the process to its end; all its threads and the compiler's.
        samples: of the training log, 0 where it failed. failure: last words of a run without result.
        code: version that ran, so that results of several versions are distinguished.
        first_line_s, silence_s: until the first line that is printed, and the longest time without one; by the clock.
    """

    case: str
    wall_s: float
    cpu_s: float
    samples: int
    failure: str
    code: str
    first_line_s: float | None = None
    silence_s: float | None = None


@dataclass(frozen=True)
class Times:
    """Times of some logs, each as (median, 90th percentile, longest) in s; samples as (fewest, most)."""

    logs: int
    samples: tuple[int, int]
    wall: tuple[float, float, float]
    cpu: tuple[float, float, float]


def diagnosed(case: str, logs: Path, spec: Path, out: Path, again: bool = False) -> Run:
    """`stiction diagnose` with train.csv and test.csv of a folder; what is there already is read, unless ``again``."""
    return diagnosed_logs(case, spec, [logs / "train.csv"], [logs / "test.csv"], out, again)


def diagnosed_logs(
    case: str,
    spec: Path,
    train: Sequence[Path],
    test: Sequence[Path],
    out: Path,
    again: bool = False,
    description: Path | None = None,
) -> Run:
    """`stiction diagnose` with any logs; what is there already is read, unless ``again``."""
    kept = out / "run.json"
    if kept.exists() and not again:
        return Run(**json.loads(kept.read_text()))
    out.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "codegen.app.cli", "diagnose", str(spec), *map(str, train)]
    command += [word for file in test for word in ("--test", str(file))]
    command += ["--description", str(description)] if description is not None else []
    command += ["-o", str(out), "--force"]
    # With the modules' bytecode kept, as by default: where a machine forbids it, each run compiles 200 modules anew.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    before, start = os.times(), time.perf_counter()
    said, at = [], [0.0]
    pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    with subprocess.Popen(command, cwd=ROOT, env=environment, **pipes) as done:
        for line in done.stdout or ():
            said.append(line)
            at.append(time.perf_counter() - start)
    wall, after = time.perf_counter() - start, os.times()
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    if done.returncode in (0, EXIT_UNFIT):
        samples, failure = int(result_in(out)["data"]["train_samples"]), ""
    else:
        for stale in ("diagnosis.json", "spec.yaml"):
            (out / stale).unlink(missing_ok=True)
        words = "".join(said).split()
        samples, failure = 0, f"exit code {done.returncode}: {' '.join(words[-40:])}"
    silence = max(b - a for a, b in pairwise([*at, wall]))
    run = Run(case, wall, cpu, samples, failure, code_version(), at[1] if said else None, silence)
    write_atomically(kept, json.dumps(asdict(run), indent=1))
    return run


def result_in(out: Path) -> dict[str, Any]:
    """The content of diagnosis.json in a folder; a placeholder with the verdict `refused` if a run had no result."""
    file = out / "diagnosis.json"
    if not file.exists():
        return {"verdict": "refused", "effects": [], "candidates": []}
    read: dict[str, Any] = json.loads(file.read_text())
    return read


def times(runs: Sequence[Run]) -> Times | None:
    """Statistics of the times of the runs with a result; None if there are none."""
    done = [run for run in runs if run.samples]
    if not done:
        return None
    sizes = [run.samples for run in done]
    wall, cpu = ([getattr(run, name) for run in done] for name in ("wall_s", "cpu_s"))
    return Times(len(done), (min(sizes), max(sizes)), _spread(wall), _spread(cpu))


def typical(runs: Sequence[Run]) -> list[Run]:
    """The runs on logs with about 25,000 samples."""
    return [run for run in runs if TYPICAL[0] <= run.samples <= TYPICAL[1]]


def _spread(values: Sequence[float]) -> tuple[float, float, float]:
    return float(np.median(values)), float(np.quantile(values, 0.9)), max(values)


@cache
def code_version() -> str:
    """A hash of the package and its templates, which together decide a diagnosis."""
    total = hashlib.sha256()
    for file in sorted([*(ROOT / "codegen").rglob("*.py"), *(ROOT / "templates" / "diagnosis").rglob("*.j2")]):
        total.update(file.relative_to(ROOT).as_posix().encode() + b"\0" + file.read_bytes())
    return total.hexdigest()[:12]

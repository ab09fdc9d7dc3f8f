"""One diagnosis as a user starts it, in words that can be kept and put into a row."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.real.sets import DATA, ROOT, SPECS, Diagnosed, spec_of
from codegen.base.files import write_atomically

EXIT_UNFIT = 3


@dataclass(frozen=True)
class Kept:
    """What came of a diagnosis.

    Attributes:
        wall_s: of the process, from its start to its end. cpu_s: that it took of all cores.
        failure: its last words where it gave no verdict; else empty.
        means: of steady logs, RMS of their mean residual force by declared, refit and augmented model.
    """

    wall_s: float
    failure: str
    means: list[float] = field(default_factory=list)
    cpu_s: float = 0.0


def command(set_name: str, run: Diagnosed, out: Path) -> list[str]:
    """Arguments of `stiction`, as a user gives them."""
    data, specs = DATA / set_name, SPECS / set_name
    words = ["diagnose", str(spec_of(set_name, run)), *(str(data / file) for file in run.train)]
    for file in run.test:
        words += ["--test", str(data / file)]
    described = ["-d", str(specs / run.about)] if run.about else []
    return [*words, *described, "-o", str(out), "--force"]


def diagnosed(set_name: str, run: Diagnosed, out: Path) -> Kept:
    """Run it; the results stand in ``out``, with ``run.json`` beside them."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "run.json").unlink(missing_ok=True)
    from benchmarks.real.steady import mean_errors  # SciPy and CasADi, which a page of kept results does not need

    start, before = time.perf_counter(), _children_cpu()
    done = subprocess.run(
        [sys.executable, "-m", "codegen.app.cli", *command(set_name, run, out)],
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    wall, cpu = time.perf_counter() - start, _children_cpu() - before
    failure = ""
    if done.returncode not in (0, EXIT_UNFIT):
        (out / "diagnosis.json").unlink(missing_ok=True)  # of an earlier run
        failure = f"exit code {done.returncode}: {' '.join(done.stderr.split()[-60:])}"
    kept = Kept(wall, failure, mean_errors(set_name, run, out) if run.steady and not failure else [], cpu)
    write_atomically(out / "run.json", json.dumps(asdict(kept), indent=1))
    return kept


def _children_cpu() -> float:
    """Seconds that all ended child processes took."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def kept(out: Path) -> Kept | None:
    """What an earlier run left; None where there is none."""
    file = out / "run.json"
    return Kept(**json.loads(file.read_text())) if file.exists() else None


def result(out: Path) -> dict[str, Any] | None:
    """diagnosis.json; None where there is none."""
    file = out / "diagnosis.json"
    if not file.exists():
        return None
    read: dict[str, Any] = json.loads(file.read_text())
    return read

"""One diagnosis as a user starts it, in words that can be kept and put into a row."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.practice.runs import diagnosed_logs
from benchmarks.real.sets import DATA, SPECS, Diagnosed, spec_of
from codegen.base.files import write_atomically


@dataclass(frozen=True)
class Kept:
    """The summary of a diagnosis.

    Attributes:
        wall_s: of the process, from its start to its end. cpu_s: that it took of all cores.
        failure: its last words where it gave no verdict; else empty.
        means: of steady logs, RMS of their mean residual force by declared, refit and augmented model.
    """

    wall_s: float
    failure: str
    means: list[float] = field(default_factory=list)
    cpu_s: float = 0.0


def diagnosed(set_name: str, run: Diagnosed, out: Path) -> Kept:
    """Run a diagnosis; its results and ``run.json`` are written to ``out``."""
    from benchmarks.real.steady import mean_errors  # SciPy and CasADi, which a page of kept results does not need

    train, test = ([DATA / set_name / file for file in files] for files in (run.train, run.test))
    about = SPECS / set_name / run.about if run.about else None
    done = diagnosed_logs(run.name, spec_of(set_name, run), train, test, out, True, about)
    means = mean_errors(set_name, run, out) if run.steady and not done.failure else []
    kept = Kept(done.wall_s, done.failure, means, done.cpu_s)
    write_atomically(out / "run.json", json.dumps(asdict(kept), indent=1))
    return kept


def kept(out: Path) -> Kept | None:
    """The summary of an earlier run; None if there is none."""
    file = out / "run.json"
    return Kept(**json.loads(file.read_text())) if file.exists() else None


def result(out: Path) -> dict[str, Any] | None:
    """diagnosis.json; None where there is none."""
    file = out / "diagnosis.json"
    if not file.exists():
        return None
    read: dict[str, Any] = json.loads(file.read_text())
    return read

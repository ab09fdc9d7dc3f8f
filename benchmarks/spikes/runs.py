"""Spiked logs by the shared spike.py, and their diagnoses; what is there already is not made again."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import os
import subprocess
import sys
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.practice.cases import PRACTICE
from benchmarks.practice.fresh import environment
from benchmarks.practice.runs import code_version, diagnosed_logs, result_in
from benchmarks.real.spiked import Readable, RealSet, readable
from benchmarks.spikes.outcome import MULTIPLIES
from codegen.base.files import write_atomically
from codegen.effects import CATALOGUE
from codegen.effects.declare import places_of
from codegen.mechanics import build_system
from codegen.spec import read_spec

SPIKE = PRACTICE / "spike.py"
SIGNIFICANCE = Path(__file__).with_name("significance.py")
UNSIZED = ("encoder_eccentricity",)
"""Moves the reading and not the force, so it has no share of the drive force."""
BLOCKS = 48
"""Of the jackknife; a record at one speed is one block, since only its mean counts."""
MOST_TRIES, SAME_SHARE = 8, 0.01
"""Strengths that are tried, and the relative difference up to which a share is the one that was asked for."""
RESTARTED = ("friction_drift",)
"""Starts anew in each record as spike.py puts it in, and once for all records as the law has it."""


@dataclass(frozen=True, eq=False)
class Bench:
    """A real set with all that is made of it.

    Attributes:
        out: folder of all spikes and their results.
        code: version that made the results; this one by default.
    """

    name: str
    one: RealSet
    out: Path
    code: str = field(default_factory=code_version)

    def result(self, kind: str, percent: float) -> Path:
        """The folder of a result."""
        return self.out / self.code / self.name / self.case(kind, percent).name

    @property
    def logs(self) -> Readable:
        return readable(self.one, self.out / "logs" / self.name)

    def case(self, kind: str, percent: float) -> Path:
        """The folder of the log with a spike, named by all that decides it; a share of 0 is the log as it is."""
        entry = {name: value for name, value in asdict(self.one).items() if name != "refitted"}
        decides = json.dumps(entry, sort_keys=True) + SPIKE.read_text() + self.one.spec_file.read_text()
        mark = hashlib.sha256(decides.encode()).hexdigest()[:8]
        name = f"{kind}_{percent:g}" if percent else "plain"
        return self.out / "cases" / self.name / f"{name}_{mark}"

    def made(self, kind: str, percent: float) -> Path:
        """The folder of the log with a spike, which is made where it is not there."""
        case = self.case(kind, percent)
        if not (case / "truth.json").is_file():
            _make(self.one, self.logs, case, kind, percent, self.out)
        return case

    def diagnosis(self, kind: str, percent: float, again: bool) -> dict[str, Any]:
        """The diagnosis of the log with a spike."""
        case, logs = self.made(kind, percent), self.logs
        files = _spiked(case, logs)
        train, test = files[: len(logs.train)], files[len(logs.train) :]
        out = self.result(kind, percent)
        diagnosed_logs(case.name, logs.spec, train, test, out, again, logs.description)
        return result_in(out)

    def truth(self, kind: str, percent: float) -> tuple[dict[str, Any], dict[str, Any]]:
        """truth.json, and what least squares finds in the training logs as they are and in the spiked ones."""
        case = self.made(kind, percent)
        checked, truth = case / "check.json", json.loads((case / "truth.json").read_text())
        if percent and not checked.is_file():
            found = _significance(self.one, self.logs, case, truth, self.out)
            write_atomically(checked, json.dumps(found) + "\n")
        found = json.loads(checked.read_text()) if percent else {}
        return truth, found


def _spiked(case: Path, logs: Readable) -> list[Path]:
    """The files that spike.py writes: those for training, then those for the test."""
    count = len(logs.train) + len(logs.test)
    return [case / name for name in ["train.csv", "test.csv", *(f"test{k}.csv" for k in range(2, count))][:count]]


def kinds_for(one: RealSet, out: Path) -> list[str]:
    """The kinds that can be put into a log by their share and make sense in this set's system."""
    system = build_system(read_spec(one.spec_file))
    left_out = (*UNSIZED, *(RESTARTED if len(one.train) > 1 else ()))
    shown = one.steady or spikable(out)
    effects = [CATALOGUE[kind] for kind in spikable(out) if kind in shown and kind not in left_out]
    return [e.kind for e in effects if any(e.applies(system, k) for k in range(len(places_of(e, system))))]


@cache
def spikable(out: Path) -> list[str]:
    """The kinds that spike.py knows."""
    words = "import json, spike; print(json.dumps(sorted(spike.STRENGTH)))"
    found: list[str] = json.loads(_spike_python(["-c", words], out))
    return found


def _make(one: RealSet, logs: Readable, case: Path, kind: str, percent: float, out: Path) -> None:
    """The spiked log; of several training records by the strength that has the share over all of them."""
    command = [str(SPIKE), *map(str, [*logs.train, *logs.test]), "-o", str(case), "--kind", kind]
    command += ["--position", "=".join(logs.position), "--input", "=".join(logs.input), "--time", logs.time[1]]
    command += ["--time-scale", repr(logs.time_scale), "--gain", repr(one.gain), "--contact", one.contact]
    command += ["--cutoff", repr(one.cutoff_hz), "--share", repr(percent / 100)]
    command += ["--gravity"] if one.gravity else []
    settings = one.settings.get(kind, {})
    for _ in range(MOST_TRIES):
        _spike_python([*command, *(f"--set={name}={value!r}" for name, value in settings.items())], out)
        share = _share(logs, case) if percent and len(logs.train) > 1 else percent / 100
        if abs(share - percent / 100) <= SAME_SHARE * share:
            return
        (effect,) = json.loads((case / "truth.json").read_text())["effects"]
        name, neutral = CATALOGUE[kind].parameters[0].name, 1.0 if kind in MULTIPLIES else 0.0
        found = effect["parameters"]
        settings = {**found, name: neutral + (found[name] - neutral) * percent / 100 / share}
    raise RuntimeError(f"{case}: no strength of {kind} has a share of {percent:g} % over all training records")


def _share(logs: Readable, case: Path) -> float:
    """RMS of the force that the spike adds, over that of the drive force, in all training records (CSV)."""
    before, after = (
        np.concatenate([_column(file, logs.input[1]) for file in files])
        for files in (logs.train, _spiked(case, logs)[: len(logs.train)])
    )
    return float(np.sqrt(np.mean((after - before) ** 2) / np.mean(before**2)))


def _column(file: Path, name: str) -> np.ndarray:
    with file.open() as lines:
        names = [one.strip().strip('"') for one in lines.readline().split(",")]
        return np.loadtxt(lines, delimiter=",", usecols=names.index(name))


def _significance(one: RealSet, logs: Readable, case: Path, truth: dict[str, Any], out: Path) -> dict[str, Any]:
    """The results of significance.py: own size, residuals, standard errors, and the best other law with its nats."""
    (effect,) = truth["effects"]
    asked = {
        "kind": effect["kind"],
        "kinds": kinds_for(one, out),
        "parameters": effect["parameters"],
        "position": logs.position,
        "input": logs.input,
        "time": logs.time[1],
        "time_scale": logs.time_scale,
        "gain": one.gain,
        "gravity": one.gravity,
        "cutoff": 2 * one.cutoff_hz,
        "blocks": len(one.train) if one.steady else BLOCKS,
        "plain": [str(file) for file in logs.train],
        "spiked": [str(file) for file in _spiked(case, logs)[: len(logs.train)]],
    }
    said: dict[str, Any] = json.loads(_spike_python([str(SIGNIFICANCE), json.dumps(asked)], out))
    return said


def _spike_python(command: list[str], out: Path) -> str:
    """The output of a script that imports spike.py; run by the generator's Python if ours has no PyYAML."""
    own = importlib.util.find_spec("yaml") is not None
    python = sys.executable if own else str(environment(out.parent))
    variables = {**os.environ, "PYTHONPATH": str(SPIKE.parent), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run([python, *command], capture_output=True, text=True, env=variables)
    if done.returncode:
        raise RuntimeError(f"spike.py failed: {' '.join(done.stderr.split()[-40:])}")
    return done.stdout

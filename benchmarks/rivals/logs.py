"""The logs on which the rivals are compared: practice logs of one axis, and two real ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.practice.cases import cases
from benchmarks.real.spiked import real_sets
from benchmarks.rivals.axis import axis_of
from codegen.effects.declare import system_of
from codegen.logs import Log, read_logs
from codegen.mechanics import System, build_system
from codegen.spec import Spec, read_spec

WRONG, RIGHT, REAL = "structure wrong", "structure right", "real log"


@dataclass(frozen=True)
class Pair:
    """A training log and a test log with their model.

    Attributes:
        group: of ``WRONG``, ``RIGHT``, ``REAL``. lacks: what the model lacks; empty where that is nothing or unknown.
        spec_file, train, test, description: as ``stiction diagnose`` is given them.
    """

    group: str
    title: str
    lacks: str
    spec_file: Path
    train: list[Path]
    test: list[Path]
    description: Path | None

    def read(self) -> tuple[Spec, System, Log, Log]:
        """Spec, declared system, training log and test log."""
        spec = read_spec(self.spec_file)
        logs = [read_logs(files, spec, description=self.description) for files in (self.train, self.test)]
        return spec, system_of(spec), logs[0], logs[1]


def pairs(kinds: int, only: Sequence[str] = ()) -> list[Pair]:
    """The sample: logs of one axis with a known translation for MuJoCo, in order.

    All logs of the standard tier without an effect, the first log of each of ``kinds`` kinds, and real sets with a test
    log.

    Args:
        only: titles, in place of the sample.
    """
    found: list[Pair] = []
    seen: set[str] = set()
    for case in cases(["standard"]):
        spec, train, test = (case.folder / name for name in ("spec.yaml", "train.csv", "test.csv"))
        if case.group not in ("single", "none") or not _is_told(spec):
            continue
        kind = "" if case.group == "none" else str(case.truth["effects"][0]["kind"])
        if case.title in only or (not only and (not kind or (kind not in seen and len(seen) < kinds))):
            found.append(Pair(WRONG if kind else RIGHT, case.title, kind, spec, [train], [test], None))
        seen |= {kind} - {""}
    for name, one in real_sets().items():
        title, here = f"real/{name}", one.is_here and one.test and not one.steady
        if here and _is_told(one.spec_file) and (not only or title in only):
            train, test = one.files(one.train), one.files(one.test)
            found.append(Pair(REAL, title, "", one.spec_file, train, test, one.description_file))
    return found


def _is_told(spec_file: Path) -> bool:
    """Whether a spec has one axis whose translation for MuJoCo is known."""
    spec = read_spec(spec_file)
    return len(spec.coordinates) == 1 and axis_of(build_system(spec), spec.name) is not None

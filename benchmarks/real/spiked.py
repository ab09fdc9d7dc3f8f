"""The real sets of sets.yaml, each with its logs as files that a spike can be put into."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter
from ruamel.yaml import YAML

from benchmarks.practice.cases import ROOT
from codegen.base.files import write_all
from codegen.logs import Log, read_log, read_logs
from codegen.spec import Spec, read_spec

DATA = ROOT.parent / "shared" / "data"
ENTRIES = Path(__file__).parent / "sets.yaml"


@dataclass(frozen=True)
class RealSet:
    """One entry of sets.yaml, whose head says what its fields mean."""

    spec: str
    train: list[str]
    test: list[str]
    time: dict[str, str]
    position: dict[str, str]
    input: dict[str, str]
    contact: str
    gain: float = 1.0
    time_scale: float = 1.0
    cutoff_hz: float = 20.0
    gravity: bool = False
    description: str = ""
    converted: bool = False
    steady: list[str] = field(default_factory=list)
    refitted: dict[str, str] = field(default_factory=dict)
    settings: dict[str, dict[str, float]] = field(default_factory=dict)

    @property
    def spec_file(self) -> Path:
        return ROOT / self.spec

    @property
    def description_file(self) -> Path | None:
        return ROOT / self.description if self.description else None

    def files(self, names: Sequence[str]) -> list[Path]:
        """The logs of these names."""
        return [DATA / name for name in names]

    @property
    def is_here(self) -> bool:
        """Whether all that it names is."""
        wanted = [self.spec_file, *self.files([*self.train, *self.test])]
        return all(file.is_file() for file in [*wanted, *filter(None, [self.description_file])])

    def read(self) -> tuple[Spec, Log, Log | None]:
        """Spec, training log and test log."""
        spec = read_spec(self.spec_file)
        logs = [
            read_logs(self.files(names), spec, description=self.description_file) if names else None
            for names in (self.train, self.test)
        ]
        assert logs[0] is not None
        return spec, logs[0], logs[1]


@dataclass(frozen=True)
class Readable:
    """A set's logs as a spike can be put into them.

    Attributes:
        train, test: files. time, position, input: (symbol, column). description: of the columns, for the diagnosis.
    """

    spec: Path
    train: list[Path]
    test: list[Path]
    time: tuple[str, str]
    position: tuple[str, str]
    input: tuple[str, str]
    time_scale: float
    description: Path | None


def real_sets(names: Sequence[str] = ()) -> dict[str, RealSet]:
    """All sets, or those of these names. Raises KeyError for a name that is none."""
    entries: TypeAdapter[dict[str, RealSet]] = TypeAdapter(dict[str, RealSet])
    found = entries.validate_python(YAML(typ="safe", pure=True).load(ENTRIES.read_text()))
    return {name: found[name] for name in names} if names else found


def readable(one: RealSet, folder: Path) -> Readable:
    """The logs of a set as they are; or written anew into ``folder``, where the set says so."""
    pairs = [next(iter(columns.items())) for columns in (one.time, one.position, one.input)]
    if not one.converted:
        train, test = one.files(one.train), one.files(one.test)
        return Readable(one.spec_file, train, test, *pairs, one.time_scale, one.description_file)
    spec = read_spec(one.spec_file)
    files, made = _converted(one, spec), [folder / "spec.yaml"]
    write_all(folder, files)
    made += [folder / name for name in files if name.endswith(".csv")]
    count = len(one.train)
    same = [(symbol, symbol) for symbol, _ in pairs]
    return Readable(made[0], made[1 : 1 + count], made[1 + count :], *same, 1.0, folder / "columns.yaml")


def _converted(one: RealSet, spec: Spec) -> dict[str, str]:
    """spec.yaml without what it says of columns, columns.yaml, and a CSV for each log: SI, one column a symbol."""
    texts: dict[str, str] = {}
    declared = YAML(typ="safe", pure=True).load(one.spec_file.read_text())
    cutoff: float | None = None
    for k, path in enumerate(one.files([*one.train, *one.test])):
        log = read_log(path, spec, description=one.description_file)
        names = ["t", *(c.name for c in spec.coordinates), *(w.name for w in spec.inputs)]
        rows = np.column_stack([log.time, log.positions, log.inputs])
        kept = np.concatenate([np.arange(a, b) for a, b in log.segments])
        lines = [",".join(names), *(",".join(f"{v:.9g}" for v in row) for row in rows[kept])]
        texts[f"log_{k}.csv"] = "\n".join(lines) + "\n"
        cutoff = cutoff or log.cutoff_hz
    declared.pop("log", None)
    columns: Mapping[str, object] = {"columns": {n: n for n in names}} | ({"cutoff_hz": cutoff} if cutoff else {})
    return {"spec.yaml": _yaml(declared), "columns.yaml": _yaml(columns), **texts}


def _yaml(value: object) -> str:
    """A value as YAML; JSON is a subset of it."""
    return json.dumps(value, indent=1) + "\n"

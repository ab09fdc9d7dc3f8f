"""Log files → Log: the registry of formats, and the way every format takes from its columns to SI on a grid."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from codegen.errors import BadInput, Place, nearest_name
from codegen.logs.binding import Binding, bind
from codegen.logs.cleaning import Clean, clean
from codegen.logs.csv_file import open_csv
from codegen.logs.description import LogDescription, read_description
from codegen.logs.encoder import smallest_step
from codegen.logs.joined import join_logs
from codegen.logs.log import Intake, Log
from codegen.logs.mat_file import open_mat
from codegen.logs.npy_file import open_npy_log
from codegen.logs.source import Columns, Source, shown
from codegen.logs.uniform import Uniform, uniform
from codegen.spec.model import Spec

# A format is one file with a function from a path to a Source, and its endings here.
FORMATS: Mapping[str, Callable[[Path], Source]] = {
    ".csv": open_csv,
    ".tsv": open_csv,
    ".txt": open_csv,
    ".mat": open_mat,
    ".npy": open_npy_log,
}


def read_logs(
    paths: Sequence[str | Path],
    spec: Spec,
    *,
    description: str | Path | None = None,
    columns: Mapping[str, str] | None = None,
) -> Log:
    """Read the records of one experiment as one log; see ``join_logs``.

    Args:
        paths: at least one; no file twice.
        description, columns: as for ``read_log``, for all of them.

    Raises:
        BadInput: as ``read_log``, for a file named twice, or for records that do not go together.
    """
    seen: set[Path] = set()
    for path in map(Path, paths):
        if path.resolve() in seen:
            raise BadInput(str(path), "the same log twice", "each record once")
        seen.add(path.resolve())
    return join_logs([partial(_read, path, spec, description, columns) for path in paths])


def read_log(
    path: str | Path, spec: Spec, *, description: str | Path | None = None, columns: Mapping[str, str] | None = None
) -> Log:
    """Read a measured log for a spec.

    Args:
        path: the file; its ending says the format.
        description: a description file; without it ``meta.yaml`` beside the log is taken if there is one.
        columns: ``t``, coordinate, velocity or input → column of the file, before what the description or spec say.

    Raises:
        BadInput: for the first thing that cannot be used, with file and line or variable.
    """
    return _read(path, spec, description, columns, None)


def _read(
    path: str | Path,
    spec: Spec,
    description: str | Path | None,
    columns: Mapping[str, str] | None,
    step: float | None,
) -> Log:
    path = Path(path)
    reader = _format(path)
    source = reader(path)
    described = log_description(path, description)
    binding = bind(source.names, source.place, spec, described, columns)
    cleaned = _cleaned(source, binding, spec, described)
    return _log(path, spec, described, binding, cleaned, step)


def _format(path: Path) -> Callable[[Path], Source]:
    reader = FORMATS.get(path.suffix.lower())
    if reader is not None:
        return reader
    place, expected = Place(shown(str(path), 200)), f"a log file ending in {', '.join(FORMATS)}"
    if "\0" not in str(path):
        if path.is_dir():
            raise BadInput(place, "a folder", expected)
        if not path.exists():
            raise BadInput(place, "no such file", expected)
    raise BadInput(place, f"the ending `{shown(path.suffix)}`", expected, nearest_name(path.suffix.lower(), FORMATS))


def log_description(path: Path, description: str | Path | None) -> LogDescription:
    """What is said of a log: by the file given, else by ``meta.yaml`` beside it, else nothing."""
    if description is not None:
        return read_description(description)
    beside = path.parent / "meta.yaml"
    return read_description(beside) if beside.is_file() else LogDescription()


def _cleaned(source: Source, binding: Binding, spec: Spec, description: LogDescription) -> Clean:
    """Load the bound columns, with time first; where no column gives it, from the description's sample rate."""
    inputs = {i.name for i in spec.inputs}
    wanted = list(binding.columns.values())
    symbols = list(binding.columns)
    raw = source.load(wanted)
    scale = dict(binding.scale)
    if "t" not in symbols:
        if description.sample_rate_hz is None:
            raise BadInput(source.place, "no column `t`", "a time column, or sample_rate_hz in a log description")
        time = np.arange(len(raw.values)) / description.sample_rate_hz
        raw = Columns(raw.file, ("t", *raw.names), np.column_stack([time, raw.values]), raw.lines)
        symbols.insert(0, "t")
        scale["t"] = 1.0
    return clean(raw, symbols, [s in inputs for s in symbols], scale, description)


def _log(
    path: Path, spec: Spec, description: LogDescription, binding: Binding, cleaned: Clean, step: float | None
) -> Log:
    n, m = len(spec.coordinates), len(spec.inputs)
    split = cleaned.data.shape[1] - m
    grid = uniform(cleaned.time, cleaned.data[:, :split], cleaned.data[:, split:], cleaned.source, step)
    encoder = _per_coordinate(description.encoder_step, spec, description, "encoder_step")
    _per_coordinate(description.position_noise, spec, description, "position_noise_rms")
    intake = Intake(
        rows=len(cleaned.time),
        jitter=grid.jitter,
        longest_step=grid.longest_step,
        resampled=grid.resampled,
        repaired=cleaned.repaired,
        dropped=cleaned.dropped,
        smallest_step=tuple(smallest_step(cleaned.data[:, j]) for j in range(n)),
    )
    return Log(
        path=path,
        name=path.stem,
        time=grid.time,
        positions=grid.sampled[:, :n],
        velocities=grid.sampled[:, n:] if split > n else None,
        inputs=grid.held,
        sample_time=grid.step,
        cutoff_hz=_cutoff(spec, description, grid),
        tolerance=description.tolerance,
        encoder_step=encoder,
        notes=(*description.unknown, *binding.notes, *_hold_note(description), *cleaned.notes, *grid.notes),
        gaps=grid.gaps,
        intake=intake,
        description=description,
    )


def _per_coordinate(
    values: tuple[float, ...] | None, spec: Spec, description: LogDescription, key: str
) -> tuple[float, ...] | None:
    n = len(spec.coordinates)
    if values is None or len(values) == n:
        return values
    if len(values) == 1:
        return values * n
    raise BadInput(
        description.place(key), f"{len(values)} numbers", f"{n}, one for each of {', '.join(spec.positions)}"
    )


def _cutoff(spec: Spec, description: LogDescription, grid: Uniform) -> float | None:
    cutoff = description.cutoff_hz or spec.log.cutoff_hz
    if cutoff is None or 0 < cutoff < 0.5 / grid.step:
        return cutoff
    key = "cutoff_hz" if "cutoff_hz" in description.places else "evaluation.cutoff_hz"
    place = description.place(key) if description.cutoff_hz else spec.place("log.cutoff_hz")
    raise BadInput(place, f"{cutoff:g} Hz", f"a frequency below half the log's sample rate, {0.5 / grid.step:.6g} Hz")


def _hold_note(description: LogDescription) -> list[str]:
    hold = description.input_hold
    if not hold or hold.lower().startswith(("zero-order", "zero order", "zoh")):
        return []
    return [f"input_hold `{shown(hold)}`: the inputs are taken as held from row to row all the same"]

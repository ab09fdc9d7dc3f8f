"""Reading of log files: the registry of formats, and the steps from columns to SI values on a uniform time grid."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.integrate import cumulative_trapezoid

from codegen.base.errors import BadInput, Place, nearest_name
from codegen.base.input_files import alike, identity, is_there, opened
from codegen.base.user_text import shown
from codegen.logs.binding import Binding, bind, column_of, time_of
from codegen.logs.cleaning import CleanedRows, clean, in_time
from codegen.logs.counters import corrected, counter_findings, repeats, require_columns, smallest_step
from codegen.logs.description import EMPTY_DESCRIPTION, ZERO_ORDER, Lengths, LogDescription, read_description
from codegen.logs.formats.bag_file import BagFolder, Db3Storage, is_bag
from codegen.logs.formats.csv_file import CsvSource, CsvStream, LongTable, open_csv
from codegen.logs.formats.hdf5_file import Hdf5File
from codegen.logs.formats.json_file import JsonFile
from codegen.logs.formats.mat_file import open_mat
from codegen.logs.formats.mcap_file import McapStorage
from codegen.logs.formats.mdf_file import MdfFile
from codegen.logs.formats.numpy_file import NpyFile, NpzFile
from codegen.logs.formats.parquet_file import ParquetFile
from codegen.logs.formats.ros_log import RosFile, Storage
from codegen.logs.formats.series import join_columns_by_time
from codegen.logs.formats.several_files import SeveralFiles
from codegen.logs.formats.source import LARGEST_STREAM, Allowance, BlockFile, Columns, LogFile, NotStreamed
from codegen.logs.formats.tdms_file import TdmsFile
from codegen.logs.formats.ulog_file import UlogFile
from codegen.logs.joined import join_logs
from codegen.logs.log import Finding, Log, RawData
from codegen.logs.term import columns_of, compute
from codegen.logs.uniform import Uniform, uniform
from codegen.spec.model import Spec
from codegen.spec.quantity import refuse_other_unit

Opener = Callable[[Path, Allowance, LogDescription], LogFile]


def _of_messages(storage: Callable[[Path], Storage]) -> Opener:
    """The opener of a format that stores ROS messages."""
    return lambda path, allowance, description: RosFile(storage(path), allowance, description)


FORMATS: Mapping[str, Opener] = {
    ".csv": open_csv,
    ".tsv": open_csv,
    ".txt": open_csv,
    ".mat": open_mat,
    ".npy": NpyFile,
    ".npz": NpzFile,
    ".json": JsonFile,
    ".jsonl": JsonFile,
    ".ndjson": JsonFile,
    ".mcap": _of_messages(McapStorage),
    ".db3": _of_messages(Db3Storage),
    ".parquet": ParquetFile,
    ".h5": Hdf5File,
    ".hdf5": Hdf5File,
    ".mf4": MdfFile,
    ".ulg": UlogFile,
    ".tdms": TdmsFile,
}
"""File name extension → its opener. A text file with another extension is read as a table."""


def read_logs(
    paths: Sequence[str | Path],
    spec: Spec,
    *,
    description: str | Path | None = None,
    columns: Mapping[str, str] | None = None,
    allowance: Allowance | None = None,
) -> Log:
    """Read the records of one experiment as one log; see ``join_logs``.

    Args:
        paths: at least one; no file twice.
        description, columns: as for ``read_log``, for all of them.
        allowance: limit of the bytes of all logs that are read together; by default, of these.

    Raises:
        BadInput: as ``read_log``, for a file named twice, or for records that do not go together.
    """
    seen: set[str] = set()
    for path in map(Path, paths):
        if identity(path) in seen:
            raise BadInput(str(path), "the same log twice", "each record once", code="LOG014")
        seen.add(identity(path))
    given = allowance or Allowance()
    return join_logs([partial(_read, path, spec, description, columns, given) for path in paths])


def read_log(
    path: str | Path, spec: Spec, *, description: str | Path | None = None, columns: Mapping[str, str] | None = None
) -> Log:
    """Read a measured log for a spec.

    Args:
        path: the file; its extension states the format.
        description: a description file; without it ``meta.yaml`` beside the log is taken if there is one.
        columns: ``t``, coordinate, velocity or input → column; takes precedence over description and spec.

    Raises:
        BadInput: for the first fault, with file and line or variable.
    """
    return _read(path, spec, description, columns, Allowance(), None)


def log_names(path: str | Path) -> tuple[str, ...]:
    """The names of a log's columns.

    Raises:
        BadInput: as ``read_log``, for a file that cannot be opened.
    """
    path = Path(path)
    return _opened(format_of(path), path, Allowance(), log_description(path, None)).names


def _read(
    path: str | Path,
    spec: Spec,
    description: str | Path | None,
    columns: Mapping[str, str] | None,
    allowance: Allowance,
    step: float | None,
) -> Log:
    path = Path(path)
    reader = format_of(path)
    described = log_description(path, description)
    source = _with_others(path, _opened(reader, path, allowance, described), described, allowance)
    binding = bind(source, spec, described, columns)
    require_columns(source.names, described)
    raw = corrected(_loaded(source, columns_of(binding.terms), described), described)
    binding = since_epoch(binding, raw, described, spec)
    notes = tuple(source.notes)
    if described.missing == "join" and "t" in binding.terms:
        time = compute(raw, {"t": binding.terms["t"]}).values[:, 0] * binding.scale["t"]
        raw, more = join_columns_by_time(raw, time, binding.terms["t"].columns, described)
        notes = (*notes, *more)
    found = counter_findings(raw, binding.terms)
    cleaned = _cleaned(compute(raw, binding.terms), source.place, binding, spec, described)
    return _log(path, spec, described, notes, binding, cleaned, found, step)


_CLOCKS = {
    "100 ns since 1601 (FILETIME)": (1e-7, 11_644_473_600.0),
    "milliseconds since 1970": (1e-3, 0.0),
    "microseconds since 1970": (1e-6, 0.0),
    "nanoseconds since 1970": (1e-9, 0.0),
}
"""Clock → its unit in s, and its time in s at the start of 1970."""
_YEARS_2000_TO_2100 = (946_684_800.0, 4_102_444_800.0)


def since_epoch(binding: Binding, raw: Columns, description: LogDescription, spec: Spec) -> Binding:
    """The binding with the factor of time to seconds, if time is in ms, µs or ns since 1970 or in Windows' FILETIME.

    The clock is recognised by its value at the first sample, which must be a time between 2000 and 2100. A time in
    seconds is never that large. A unit or scale given for ``t`` takes precedence.
    """
    term = binding.terms.get("t")
    if term is None or term.expression is not None or binding.scale["t"] != 1.0 or not len(raw.values):
        return binding
    if {"t"} & {*description.units, *description.scale, *spec.log.scale}:
        return binding
    first = raw.values[0, raw.names.index(term.columns[0])]
    for clock, (step, before) in _CLOCKS.items():
        if _YEARS_2000_TO_2100[0] <= first * step - before <= _YEARS_2000_TO_2100[1]:
            words = f"in {clock}, by its size"
            return replace(
                binding,
                scale={**binding.scale, "t": step},
                notes=(*binding.notes, f"t is {words}: converted to s"),
                inferred_units={**binding.inferred_units, "t": words},
            )
    return binding


def _loaded(source: LogFile, wanted: Sequence[str], description: LogDescription) -> Columns:
    """The wanted columns, of the rows that the description asks for."""
    raw = source.load([*wanted, *(name for name in description.rows if name not in wanted)])
    kept = np.ones(len(raw.values), dtype=bool)
    for name, value in description.rows.items():
        kept &= raw.values[:, raw.names.index(name)] == value
    if not kept.any():
        asked = ", ".join(f"{shown(name)} = {value:g}" for name, value in description.rows.items())
        expected = "values that occur in these columns"
        raise BadInput(description.place("rows"), f"no row with {asked}", expected, code="LOG013")
    part = Columns(raw.file, tuple(wanted), raw.values[:, : len(wanted)], raw.lines)
    return part if kept.all() else part.rows(kept)


def _opened(reader: Opener, path: Path, allowance: Allowance, description: LogDescription) -> LogFile:
    """The opened file; for a long table (a row for each value), its signals as columns."""
    source = reader(path, allowance, description)
    if not description.long:
        return source
    if not isinstance(source, CsvSource):
        raise BadInput(description.place("long"), f"`long` for {shown(path.name)}", "a text table", code="LOG013")
    return LongTable(source, description)


def _with_others(path: Path, log: LogFile, description: LogDescription, allowance: Allowance) -> LogFile:
    """The log together with the other files that its description names."""
    if not description.beside:
        return log
    plain = description.model_copy(update={"columns": {}, "long": None})
    others = {}
    for name, section in description.beside.items():
        beside = path.parent / section.file
        if identity(beside) == identity(path):
            found = f"`{shown(section.file)}`, the log itself"
            raise BadInput(description.place(f"beside.{name}"), found, "another file", code="LOG014")
        others[name] = format_of(beside)(beside, allowance, plain)
    times = {}
    for name, section in [(name, section) for name, section in description.beside.items() if section.time]:
        theirs = column_of(others[name], section.time, description.place(f"beside.{name}.time"))
        times[name] = time_of(log, description), theirs
    return SeveralFiles(log, others, times, description)


def format_of(path: Path) -> Opener:
    """The opener of a file, by its extension, or else by its first bytes; those of a table must not be binary.

    Raises:
        BadInput: for a file that is not there, or of a format that is not read.
    """
    reader = FORMATS.get(path.suffix.lower())
    if reader is not None and not (reader is open_csv and is_there(path) and path.is_file()):
        return reader
    place, expected = (
        Place(shown(str(path), 200)),
        f"text, a log file ending in {', '.join(FORMATS)}, or a ROS 2 bag folder",
    )
    if "\0" not in str(path):
        if is_there(path) and path.is_dir():
            if is_bag(path):
                return _of_messages(BagFolder)
            raise BadInput(place, "a folder", expected, code="FILE001")
        if not is_there(path):
            raise BadInput(place, "no such file", expected, alike(path), code="FILE001")
        with opened(path, expected, LARGEST_STREAM) as stream:
            try:
                head = stream.read(HEAD)
            except OSError as error:
                raise BadInput(place, f"unreadable ({error.strerror})", expected, code="FILE001") from None
        is_text = _is_text(head)
        others = ((what, instead) for begin, what, instead in OTHERS if re.match(begin, head))
        if other := next(others, None):
            raise BadInput(place, *other, code="LOG002")
        if reader is not None or is_text or not head:
            return open_csv
    found = f"the ending `{shown(path.suffix)}`" if path.suffix else "a name without an ending"
    raise BadInput(place, found, expected, nearest_name(path.suffix.lower(), FORMATS), code="LOG002")


def open_stream(path: Path, description: LogDescription | None = None) -> LogFile:
    """Open a log to be read in blocks.

    Raises:
        BadInput: for a file that cannot be used.
        NotStreamed: for a format that is read whole, or a file that is no text.
    """
    opener, described = format_of(path), description or EMPTY_DESCRIPTION
    if opener is open_csv:
        return CsvStream(path, Allowance(), described)
    if isinstance(opener, type) and issubclass(opener, BlockFile):
        return opener(path, Allowance(), described)
    raise NotStreamed


def log_description(path: Path, description: str | Path | None) -> LogDescription:
    """The description of a log: the given file, else ``meta.yaml`` in its folder, else an empty one."""
    if description is not None:
        return read_description(description)
    beside = path.parent / "meta.yaml"
    return read_description(beside) if is_there(beside) else EMPTY_DESCRIPTION


def _cleaned(raw: Columns, place: Place, binding: Binding, spec: Spec, description: LogDescription) -> CleanedRows:
    """The cleaned columns with time first, which is made from the description's sample rate if no column has it."""
    inputs = {i.name for i in spec.inputs}
    symbols = list(binding.terms)
    scale = dict(binding.scale)
    if "t" not in symbols:
        if description.sample_rate_hz is None:
            raise BadInput(
                place, "no column `t`", "a time column, or sample_time in meta.yaml beside the log", code="LOG003"
            )
        time = np.arange(len(raw.values)) / description.sample_rate_hz
        raw = Columns(raw.file, ("t", *raw.names), np.column_stack([time, raw.values]), raw.lines)
        symbols.insert(0, "t")
        scale["t"] = 1.0
    held = [s in inputs for s in symbols]
    cleaned = in_time(clean(raw, symbols, held, scale, description), symbols, held, description)
    return _with_integrals(cleaned, symbols[1:], binding, spec)


def _with_integrals(cleaned: CleanedRows, symbols: Sequence[str], binding: Binding, spec: Spec) -> CleanedRows:
    """Positions, velocities if all were logged, and inputs; positions without a column are integrals of velocities."""
    given = dict(zip(symbols, cleaned.data.T, strict=True))
    for c in spec.coordinates:
        if c.name in binding.integrated:
            given[c.name] = cumulative_trapezoid(given[c.velocity], cleaned.time, initial=0)
    wanted = [*spec.positions, *(spec.velocities if binding.logged else ()), *(i.name for i in spec.inputs)]
    return replace(cleaned, data=np.column_stack([given[s] for s in wanted]))


def _log(
    path: Path,
    spec: Spec,
    description: LogDescription,
    notes: Sequence[str],
    binding: Binding,
    cleaned: CleanedRows,
    found: Sequence[tuple[tuple[str, ...], Finding]],
    step: float | None,
) -> Log:
    """The log of cleaned columns, resampled to the sample time ``step`` if one is given."""
    n, m = len(spec.coordinates), len(spec.inputs)
    split = cleaned.data.shape[1] - m
    inputs = cleaned.data[:, split:]
    if description.measured_inputs:
        inputs = 0.5 * (inputs + np.vstack([inputs[1:], inputs[-1:]]))
    grid = uniform(cleaned.time, cleaned.data[:, :split], inputs, cleaned.source, step)
    encoder = _per_coordinate(description.encoder_step, spec, description, "encoder_step")
    _per_coordinate(description.position_noise_rms, spec, description, "position_noise_rms")
    steps = tuple(
        0.0 if name in binding.integrated else smallest_step(cleaned.data[:, j])
        for j, name in enumerate(spec.positions)  # an integral does not show the steps of a sensor
    )
    repeated, stale = repeats(cleaned.data[:, :split], steps)
    raw_data = RawData(
        rows=len(cleaned.time),
        jitter=grid.jitter,
        longest_step=grid.longest_step,
        resampled=grid.resampled,
        repaired=cleaned.repaired,
        dropped=cleaned.dropped,
        smallest_step=steps,
        integrated=tuple(name in binding.integrated for name in spec.positions),
        repeated=repeated,
        stale=stale,
        findings=(*binding.findings, *(finding for _, finding in found)),
        doubted=frozenset(symbol for symbols, _ in found for symbol in symbols),
        columns={symbol: term.text for symbol, term in binding.terms.items()},
        inferred_units=binding.inferred_units,
        applied_units=binding.applied_units,
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
        tolerance=description.parameter_tolerance,
        encoder_step=encoder,
        notes=(*notes, *binding.notes, *_notes_of(spec, description), *cleaned.notes, *grid.notes),
        gaps=grid.gaps,
        raw_data=raw_data,
        description=description,
    )


def _per_coordinate(
    values: Lengths | None, spec: Spec, description: LogDescription, key: str
) -> tuple[float, ...] | None:
    n = len(spec.coordinates)
    if values is None or len(values) in (1, n):
        units = () if values is None else values.units
        for c, given in zip(spec.coordinates, units * (n if len(units) == 1 else 1), strict=False):
            refuse_other_unit(given, c.unit, f"a number in {given} for {c.name}", description.place(key))
        return values if values is None or len(values) == n else tuple(values) * n
    expected = f"{n}, one for each of {', '.join(spec.positions)}"
    raise BadInput(description.place(key), f"{len(values)} numbers", expected, code="LOG013")


def _cutoff(spec: Spec, description: LogDescription, grid: Uniform) -> float | None:
    cutoff = description.cutoff_hz or spec.log.cutoff_hz
    if cutoff is None or 0 < cutoff < 0.5 / grid.step:
        return cutoff
    key = "cutoff_hz" if "cutoff_hz" in description.places else "evaluation.cutoff_hz"
    place = description.place(key) if description.cutoff_hz else spec.place("log.cutoff_hz")
    expected = f"a frequency below half the log's sample rate, {0.5 / grid.step:.6g} Hz"
    raise BadInput(place, f"{cutoff:g} Hz", expected, code="LOG013")


def _notes_of(spec: Spec, description: LogDescription) -> list[str]:
    """How the inputs are held, and which keys of the description have no effect without another key."""
    notes = _hold_note(description)
    if description.input_is and not description.input_hold:
        notes.append(
            f"input_is `{shown(description.input_is)}` has no effect without input_hold: write `input_hold: linear` "
            "for measured inputs, `input_hold: zero-order` for commands"
        )
    if description.evaluation.filter and not (description.cutoff_hz or spec.log.cutoff_hz):
        notes.append("evaluation.filter has no effect without a cutoff: write the low-pass as `cutoff_hz`")
    return notes


def _hold_note(description: LogDescription) -> list[str]:
    hold = description.input_hold
    if not hold or hold.lower().startswith(ZERO_ORDER):
        return []
    if description.measured_inputs:
        return ["input_hold `linear`: between two rows each input is taken as the mean of both"]
    words = f"input_hold `{shown(hold)}` is neither `linear` nor `zero-order`"
    return [f"{words}: the inputs are taken as held from row to row"]


HEAD = 4096
OTHERS = (
    (rb"PK\x03\x04|\xd0\xcf\x11\xe0", "an Excel workbook or another archive", "its sheet saved as CSV"),
    (rb"\x1f\x8b|\x28\xb5\x2f\xfd|BZh\d|\xfd7zXZ", "a compressed file", "the file unpacked"),
    (rb"\x80[\x02-\x05]", "a Python pickle, which could run any code", "its arrays saved by `numpy.savez`, or as CSV"),
    (rb"#ROSBAG", "a bag of ROS 1", "a bag of ROS 2, made of it by `rosbags-convert`"),
    (rb"\(\d+\.\d+\) +\S+ +[0-9A-F]+#", "CAN frames of candump", "a column for each signal, decoded by its DBC"),
    (
        rb"header: *\r?\n +(stamp|seq):",
        "messages over several lines, as `ros2 topic echo` prints them",
        "a bag, or `--csv` with it",
    ),
    (rb"FMT, ?\d+, ?\d+, ?FMT", "an ArduPilot log of several kinds of rows", "one kind as CSV, by `mavlogdump.py`"),
    (rb"MDF +\d", "an MDF file", "an MDF 4 file ending in .mf4"),
    (rb"\x89HDF", "an HDF5 file", "the ending .h5"),
    (rb"SQLite format 3", "an SQLite database", "its table as CSV; a bag of ROS 2 ends in .db3"),
    (rb"ARROW1", "an Arrow or Feather file", "the table as Parquet or CSV"),
    (rb"# Created by Octave", "Octave's text format", "the same saved by `save -v7 NAME.mat`"),
    (rb"(\xef\xbb\xbf)?<(\?xml|!DOCTYPE|html)", "an XML or HTML file", "its samples as CSV"),
    (rb"WPILOG|\xa3\x95|ULog\x01", "a log of a robot or vehicle", "its export as CSV; ULog ends in .ulg"),
)
"""First bytes, what they begin, and what to give instead."""


def _is_text(head: bytes) -> bool:
    """Whether a file's first bytes are letters, in UTF-8, UTF-16 with its mark or Windows-1252."""
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return True
    return bool(head) and not re.search(rb"[\x00-\x08\x0e-\x1a\x1c-\x1f]", head)

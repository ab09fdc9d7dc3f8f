"""Reading of log files: the steps from the columns of a file to SI values on a uniform time grid."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.integrate import cumulative_trapezoid

from codegen.base.errors import BadInput
from codegen.base.input_files import identity, is_there
from codegen.base.user_text import brief
from codegen.logs.binding import Binding, bind, column_of, since_epoch, time_of
from codegen.logs.cleaning import CleanedRows, clean, in_time
from codegen.logs.counters import corrected, counter_findings, repeats, require_columns, smallest_step
from codegen.logs.description import EMPTY_DESCRIPTION, ZERO_ORDER, LogDescription, Stated, read_description
from codegen.logs.file_formats import Opener, format_of
from codegen.logs.formats.csv_file import CsvSource, LongTable
from codegen.logs.formats.series import join_columns_by_time
from codegen.logs.formats.several_files import SeveralFiles
from codegen.logs.formats.source import Allowance, Columns, LogFile
from codegen.logs.joined import join_logs
from codegen.logs.log import Log, RawData
from codegen.logs.term import columns_of, compute
from codegen.logs.uniform import uniform
from codegen.spec.model import Spec
from codegen.spec.quantity import refuse_other_unit


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
    files, given = [Path(path) for path in paths], allowance or Allowance()
    for k, path in enumerate(files):
        if identity(path) in map(identity, files[:k]):
            raise BadInput(str(path), "the same log twice", "each record once", code="LOG014")
    readings = [_Reading(path, spec, log_description(path, description), columns, given) for path in files]
    return join_logs([reading.log for reading in readings])


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
    return read_logs([path], spec, description=description, columns=columns)


def log_names(path: str | Path) -> tuple[str, ...]:
    """The names of a log's columns."""
    path = Path(path)
    return _opened(format_of(path), path, Allowance(), log_description(path, None)).names


@dataclass(frozen=True)
class _Reading:
    """The reading of one log, by the steps of ``log``; attributes as the arguments of ``read_log``."""

    path: Path
    spec: Spec
    description: LogDescription
    columns: Mapping[str, str] | None
    allowance: Allowance

    def log(self, step: float | None) -> Log:
        """The log, resampled to the sample time ``step`` if one is given."""
        description = self.description
        named = description.with_columns(self.spec, self.columns)
        opened = _opened(format_of(self.path), self.path, self.allowance, named)
        source = _with_others(self.path, opened, named, self.allowance)
        binding = bind(source, self.spec, description, self.columns)
        require_columns(source.names, description)
        raw = corrected(_loaded(source, columns_of(binding.terms), description), description)
        binding = since_epoch(binding, raw, description, self.spec)
        notes = tuple(source.notes)
        if description.missing == "join" and "t" in binding.terms:
            time = compute(raw, {"t": binding.terms["t"]}).values[:, 0] * binding.scale["t"]
            raw, more = join_columns_by_time(raw, time, binding.terms["t"].columns, description)
            notes = (*notes, *more)
        cleaned = self._cleaned(compute(raw, binding.terms), binding)
        return self._on_grid(raw, binding, cleaned, notes, step)

    def _cleaned(self, raw: Columns, binding: Binding) -> CleanedRows:
        """The cleaned columns with time first, which is made from the description's sample rate if no column has it.

        ``bind`` refuses a log with neither.
        """
        description, scale = self.description, dict(binding.scale)
        inputs, symbols = {i.name for i in self.spec.inputs}, list(binding.terms)
        if "t" not in symbols:
            assert description.sample_rate_hz is not None
            time = np.arange(len(raw.values)) / description.sample_rate_hz
            raw = Columns(raw.file, ("t", *raw.names), np.column_stack([time, raw.values]), raw.lines)
            symbols.insert(0, "t")
            scale["t"] = 1.0
        held = [s in inputs for s in symbols]
        cleaned = in_time(clean(raw, symbols, held, scale, description), symbols, held, description)
        return self._with_integrals(cleaned, symbols[1:], binding)

    def _with_integrals(self, cleaned: CleanedRows, symbols: Sequence[str], binding: Binding) -> CleanedRows:
        """Positions, velocities if all were logged, and inputs; positions without a column are integrated."""
        spec, given = self.spec, dict(zip(symbols, cleaned.data.T, strict=True))
        for c in spec.coordinates:
            if c.name in binding.integrated:
                given[c.name] = cumulative_trapezoid(given[c.velocity], cleaned.time, initial=0)
        wanted = [*spec.positions, *(spec.velocities if binding.logged else ()), *(i.name for i in spec.inputs)]
        return replace(cleaned, data=np.column_stack([given[s] for s in wanted]))

    def _on_grid(
        self, raw: Columns, binding: Binding, cleaned: CleanedRows, notes: Sequence[str], step: float | None
    ) -> Log:
        """The log of cleaned columns on a uniform grid; ``raw``: the columns before."""
        description, positions = self.description, self.spec.positions
        n, split = len(positions), cleaned.data.shape[1] - len(self.spec.inputs)
        inputs = cleaned.data[:, split:]
        if description.measured_inputs:
            inputs = 0.5 * (inputs + np.vstack([inputs[1:], inputs[-1:]]))
        grid = uniform(cleaned.time, cleaned.data[:, :split], inputs, cleaned.source, step)
        encoder = self._per_coordinate("encoder_step")
        self._per_coordinate("position_noise_rms")
        found = counter_findings(raw, binding.terms)
        steps = tuple(
            0.0 if name in binding.integrated else smallest_step(cleaned.data[:, j])
            for j, name in enumerate(positions)  # an integral does not show the steps of a sensor
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
            integrated=tuple(name in binding.integrated for name in positions),
            repeated=repeated,
            stale=stale,
            findings=(*binding.findings, *(finding for _, finding in found)),
            doubted=frozenset(symbol for symbols, _ in found for symbol in symbols),
            unsized=binding.unsized,
            columns={symbol: term.text for symbol, term in binding.terms.items()},
            inferred_units=binding.inferred_units,
            applied_units=binding.applied_units,
        )
        return Log(
            path=self.path,
            name=self.path.stem,
            time=grid.time,
            positions=grid.sampled[:, :n],
            velocities=grid.sampled[:, n:] if split > n else None,
            inputs=grid.held,
            sample_time=grid.step,
            cutoff_hz=self._cutoff(grid.step),
            tolerance=description.parameter_tolerance,
            encoder_step=encoder,
            notes=(*notes, *binding.notes, *self._notes(), *cleaned.notes, *grid.notes),
            gaps=grid.gaps,
            raw_data=raw_data,
            description=description,
        )

    def _per_coordinate(self, key: str) -> tuple[float, ...] | None:
        """The lengths that the description states at a key, one for each coordinate; None for none."""
        values: tuple[Stated, ...] | None = getattr(self.description, key)
        if values is None:
            return None
        coordinates, place = self.spec.coordinates, self.description.place(key)
        if len(values) not in (1, len(coordinates)):
            expected = f"{len(coordinates)}, one for each of {', '.join(self.spec.positions)}"
            raise BadInput(place, f"{len(values)} numbers", expected, code="LOG013")
        times = len(coordinates) // len(values)
        for c, value in zip(coordinates, values * times, strict=False):
            refuse_other_unit(value.unit, c.unit, f"a number in {value.unit} for {c.name}", place)
        return values * times

    def _cutoff(self, step: float) -> float | None:
        """The cut-off of the evaluation's low-pass, Hz; None if none is stated. ``step``: sample time, s."""
        spec, description = self.spec, self.description
        cutoff = description.cutoff_hz or spec.log.cutoff_hz
        if cutoff is None or 0 < cutoff < 0.5 / step:
            return cutoff
        key = "cutoff_hz" if "cutoff_hz" in description.places else "evaluation.cutoff_hz"
        place = description.place(key) if description.cutoff_hz else spec.place("log.cutoff_hz")
        expected = f"a frequency below half the log's sample rate, {0.5 / step:.6g} Hz"
        raise BadInput(place, f"{cutoff:g} Hz", expected, code="LOG013")

    def _notes(self) -> Iterator[str]:
        """How the inputs are held, and which keys of the description have no effect without another key."""
        description, hold = self.description, self.description.input_hold
        if description.measured_inputs:
            yield "input_hold `linear`: between two rows each input is taken as the mean of both"
        elif hold and not hold.lower().startswith(ZERO_ORDER):
            words = f"input_hold `{brief(hold)}` is neither `linear` nor `zero-order`"
            yield f"{words}: the inputs are taken as held from row to row"
        if description.input_is and not hold:
            yield (
                f"input_is `{brief(description.input_is)}` has no effect without input_hold: write `input_hold: "
                "linear` for measured inputs, `input_hold: zero-order` for commands"
            )
        if description.evaluation.filter and not (description.cutoff_hz or self.spec.log.cutoff_hz):
            yield "evaluation.filter has no effect without a cutoff: write the low-pass as `cutoff_hz`"


def _loaded(source: LogFile, wanted: Sequence[str], description: LogDescription) -> Columns:
    """The wanted columns, of the rows that the description asks for."""
    raw = source.load([*wanted, *(name for name in description.rows if name not in wanted)])
    if not len(raw.values):
        raise source.fault("a table without rows", code="LOG009")
    kept = np.ones(len(raw.values), dtype=bool)
    for name, value in description.rows.items():
        kept &= raw.values[:, raw.names.index(name)] == value
    if not kept.any():
        asked = ", ".join(f"{brief(name)} = {value:g}" for name, value in description.rows.items())
        expected = "values that occur in these columns"
        raise BadInput(description.place("rows"), f"no row with {asked}", expected, code="LOG013")
    values = raw.values[:, : len(wanted)]
    if raw.names[: len(wanted)] != tuple(wanted):  # a format may load more columns, in the file's order
        values = raw.values[:, [raw.names.index(name) for name in wanted]]
    part = Columns(raw.file, tuple(wanted), values, raw.lines)
    return part if kept.all() else part.rows(kept)


def _opened(reader: Opener, path: Path, allowance: Allowance, description: LogDescription) -> LogFile:
    """The opened file; for a long table (a row for each value), its signals as columns."""
    source = reader(path, allowance, description)
    if not description.long:
        return source
    if not isinstance(source, CsvSource):
        raise BadInput(description.place("long"), f"`long` for {brief(path.name)}", "a text table", code="LOG013")
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
            found = f"`{brief(section.file)}`, the log itself"
            raise BadInput(description.place(f"beside.{name}"), found, "another file", code="LOG014")
        others[name] = format_of(beside)(beside, allowance, plain)
    times = {}
    for name, section in [(name, section) for name, section in description.beside.items() if section.time]:
        theirs = column_of(others[name], section.time, description.place(f"beside.{name}.time"))
        times[name] = time_of(log, description), theirs
    return SeveralFiles(log, others, times, description)


def log_description(path: Path, description: str | Path | None) -> LogDescription:
    """The description of a log: the given file, else ``meta.yaml`` in its folder, else an empty one."""
    if description is not None:
        return read_description(description)
    beside = path.parent / "meta.yaml"
    return read_description(beside) if is_there(beside) else EMPTY_DESCRIPTION

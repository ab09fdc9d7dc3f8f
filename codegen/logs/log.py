"""The measured log: a machine's motion and inputs in SI on a uniform time grid, and how it was preprocessed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from codegen.base.arrays import Array, Flags
from codegen.base.text import render
from codegen.logs.description import EMPTY_DESCRIPTION, LogDescription
from codegen.spec.model import Spec

Severity = Literal["info", "warning", "problem"]


@dataclass(frozen=True)
class Finding:
    """A finding of the preflight.

    Attributes:
        severity: ``info`` has no influence on a diagnosis, ``warning`` may spoil it, ``problem`` does.
        figures: the numbers behind it, SI; shares are 0 to 1.
    """

    severity: Severity
    topic: str
    words: str
    figures: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def worded(
        cls, severity: Severity, topic: str, template: str, say: str, figures: Mapping[str, float], **given: Any
    ) -> Finding:
        """The finding in the words ``say`` of a template in templates/text, of which ``given`` are the arguments."""
        words = render(f"text/{template}.j2", say=say, **given).strip().replace("\n", " ")
        return cls(severity, topic, words, figures)


@dataclass(frozen=True)
class RawData:
    """Properties of the raw file, before the data were put on a uniform grid.

    Attributes:
        jitter: RMS deviation of the steps (gaps left out) from their median, relative to it.
        longest_step: seconds between the two neighbouring rows that lie furthest apart.
        smallest_step: of each coordinate, SI: the quantisation step seen in the raw positions; 0 if none is visible.
        integrated: of each coordinate, whether its positions are the integral of its measured speed; empty for none.
        repeated, stale: shares of all rows, and of those in fast motion, that repeat the motion of the row before.
        findings: on how the raw numbers were stored, such as signed numbers stored unsigned.
        doubted: symbols whose numbers are wrong, by ``findings``.
        unsized: symbols in a unit whose factor to SI is not known, by ``findings``.
        columns: symbol → the column, or expression of columns, that it was read from.
        inferred_units: symbol → the unit, in words, that only the file or a column's name states; values are in SI.
        applied_units: symbol → that unit, where it was converted to SI.
    """

    rows: int = 0
    jitter: float = 0.0
    longest_step: float = 0.0
    resampled: bool = False
    repaired: Mapping[str, int] = field(default_factory=dict)
    dropped: int = 0
    smallest_step: tuple[float, ...] = ()
    integrated: tuple[bool, ...] = ()
    repeated: float = 0.0
    stale: float = 0.0
    findings: tuple[Finding, ...] = ()
    doubted: frozenset[str] = frozenset()
    unsized: frozenset[str] = frozenset()
    columns: Mapping[str, str] = field(default_factory=dict)
    inferred_units: Mapping[str, str] = field(default_factory=dict)
    applied_units: Mapping[str, str] = field(default_factory=dict)

    @property
    def time_unit(self) -> str:
        """The unit that only the file states for t, as a remark in brackets for a message; else empty."""
        return f" (t is taken {self.inferred_units['t']})" if "t" in self.inferred_units else ""


@dataclass(frozen=True, eq=False)
class Log:
    """One record of N samples of a machine with n coordinates and m inputs, all in SI.

    Attributes:
        time: (N,), s, uniform: time[k] = time[0] + k·sample_time.
        positions: (N, n), m or rad, in the spec's order.
        velocities: (N, n), m/s or rad/s, or None unless every velocity was logged.
        inputs: (N, m), the input's unit; the value in row k acts from time[k] to time[k+1].
        sample_time: s; the median step of the file (the mean step where the two agree to 1 %).
        cutoff_hz: cutoff of the low-pass for the evaluation, or None if it is not stated.
        tolerance: relative uncertainty of the declared parameters, or None.
        encoder_step: (n) declared quantisation steps, m or rad, zero for none; or None if not stated.
        gaps: half-open index ranges [start, stop) of grid samples without data near by; they must not be used.
        joints: those of ``gaps`` that lie between two records of the experiment, where no data are missing.
        records: the records of an experiment, each at its own rate; empty for a single one.
        counted: (N,) samples that count as data. Of a record that was put on a finer grid, only as many count as it
            has rows, since interpolation makes no data. None if all count.
    """

    path: Path
    name: str
    time: Array
    positions: Array
    velocities: Array | None
    inputs: Array
    sample_time: float
    cutoff_hz: float | None
    tolerance: float | None
    encoder_step: tuple[float, ...] | None
    notes: tuple[str, ...]
    gaps: tuple[tuple[int, int], ...] = ()
    joints: tuple[tuple[int, int], ...] = ()
    records: tuple[Log, ...] = ()
    raw_data: RawData = field(default_factory=RawData)
    description: LogDescription = EMPTY_DESCRIPTION
    counted: Flags | None = None

    @property
    def size(self) -> int:
        """N, the number of samples."""
        return len(self.time)

    @property
    def duration(self) -> float:
        """Seconds from the first to the last sample."""
        return float(self.time[-1] - self.time[0])

    @property
    def used(self) -> int:
        """Samples that lie in no gap."""
        return sum(stop - start for start, stop in self.segments)

    @property
    def files(self) -> str:
        """The names of all its files, for a message."""
        return ", ".join(log.path.name for log in self.records) or self.path.name

    @property
    def where(self) -> str:
        """The place of an error that concerns the whole log: its file, or the names of all its files."""
        return self.files if self.records else str(self.path)

    @property
    def units(self) -> dict[str, str]:
        """Symbol → the unit from which it was converted to SI, by the description or else by the file."""
        return {**self.raw_data.applied_units, **self.description.units}

    def scale_lines(self, factors: Mapping[str, float], spec: Spec) -> str:
        """The lines of meta.yaml that multiply the values of symbols, as read, by factors; for a message.

        A ``scale`` replaces a unit that only the file states, so that it is stated too.
        """
        stated = {name: self.description.stated_scale(name, spec) for name in factors}
        scale = ", ".join(f"{name}: {stated[name] * float(f'{k:.4g}'):.10g}" for name, k in factors.items())
        units = ", ".join(f"{name}: {self.units[name]}" for name in factors if name in self.units)
        return f"`units: {{{units}}}` with `scale: {{{scale}}}`" if units else f"`scale: {{{scale}}}`"

    def in_record(self, time: float, ends: bool = False) -> tuple[Log, float]:
        """The record of an experiment in which a time of the whole log lies, and the time by that record's own column.

        In the pause between two records an interval that ``ends`` there ends with the first, else it starts with the
        second.
        """
        if len(self.joints) != len(self.records) - 1:  # a single record, or an excerpt without some of them
            return self, time
        begins = [float(self.time[min(stop, self.size - 1)]) for _, stop in self.joints]
        pauses = [float(self.time[start - 1]) for start, _ in self.joints]
        k = sum(time > edge for edge in (begins if ends else pauses))
        record, since = self.records[k], begins[k - 1] if k else float(self.records[0].time[0])
        return record, float(np.clip(record.time[0] + time - since, record.time[0], record.time[-1]))

    @property
    def segments(self) -> tuple[tuple[int, int], ...]:
        """Half-open index ranges [start, stop) that may be used: everything between the gaps."""
        starts = [0, *(stop for _, stop in self.gaps)]
        stops = [*(start for start, _ in self.gaps), self.size]
        return tuple((a, b) for a, b in zip(starts, stops, strict=True) if b > a)

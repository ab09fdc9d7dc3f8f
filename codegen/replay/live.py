"""Reading of a CSV log as its rows arrive: from a pipe, or from a file that grows."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from time import sleep
from typing import TypeVar

import numpy as np

from codegen.base.arrays import Array
from codegen.base.errors import BadInput
from codegen.base.input_files import opened
from codegen.logs.binding import bind, since_epoch
from codegen.logs.counters import corrected
from codegen.logs.description import EMPTY_DESCRIPTION, LogDescription, Naming
from codegen.logs.file_formats import FORMATS
from codegen.logs.formats.bag_file import is_bag
from codegen.logs.formats.cells import is_row
from codegen.logs.formats.csv_file import CsvSource, open_csv, open_lines
from codegen.logs.formats.source import LARGEST_STREAM, Columns
from codegen.logs.formats.table import ROWS_ALIKE
from codegen.logs.formats.text_lines import EXPECTED, lines_of
from codegen.logs.readers import log_description
from codegen.logs.term import columns_of, compute
from codegen.logs.uniform import GAP_STEPS, JITTER
from codegen.program import Program
from codegen.replay.samples import Block, blocks_between, steps_of_time
from codegen.spec import Spec

Piece = TypeVar("Piece")
STDIN = "-"
"""The name of a log that stands for standard input."""
PIECE = 1 << 16
"""Most bytes of one read."""
MOST_GAPS = 8
"""A log is refused if it begins with more steps of time than these that are all gaps."""
PAUSE = 0.05
"""Seconds between two reads at the end of a file that is followed."""


def is_recorded(log: str | Path) -> bool:
    """Whether a log is a file of a format other than text, such as MCAP, which can only be read when it is complete."""
    path = Path(log)
    if str(log) == STDIN:
        return False
    return FORMATS.get(path.suffix.lower(), open_csv) is not open_csv or is_bag(path)


def pieces(log: str, follow: bool) -> Iterator[bytes]:
    """The bytes of a log, as soon as they can be read.

    Args:
        log: a file, or ``-`` for standard input.
        follow: whether to wait at the end of a file for more.

    Raises:
        BadInput: for a file that cannot be read.
    """
    if log == STDIN:
        while piece := os.read(0, PIECE):
            yield piece
        return
    with opened(Path(log), EXPECTED, LARGEST_STREAM) as stream:
        while True:
            piece = stream.read(PIECE)
            if piece:
                yield piece
            elif follow:
                sleep(PAUSE)
            else:
                return


@dataclass
class Stop:
    """Signal handler of Ctrl-C: interrupts the wait for rows at once, but a computation only at its end.

    A library that is interrupted within C++ would raise an error of its own.

    Attributes:
        requested: whether Ctrl-C was pressed.
        waiting: whether the program is waiting for rows now.
    """

    requested: bool = False
    waiting: bool = False

    def request(self, *_: object) -> None:
        """Note that Ctrl-C was pressed; raises KeyboardInterrupt during a wait. To be installed as the handler."""
        self.requested = True
        if self.waiting:
            raise KeyboardInterrupt

    def until_requested(self, given: Iterator[Piece]) -> Iterator[Piece]:
        """The elements of an iterator; raises KeyboardInterrupt after Ctrl-C."""
        while not self.requested:
            self.waiting = True
            try:
                piece = next(given, None)
            finally:
                self.waiting = False
            if piece is None:
                return
            yield piece
        raise KeyboardInterrupt


def called(log: str) -> str:
    """The name of a log in messages."""
    return "standard input" if log == STDIN else log


def live_blocks(
    spec: Spec, program: Program, period: float, log: str, given: Iterator[bytes], columns: Naming, notes: list[str]
) -> Iterator[Block]:
    """The samples of a log, in blocks, as they arrive.

    Args:
        period: the observer's sample time, s.
        log: its path, or ``-``; for a file, the ``meta.yaml`` in its folder is read.
        given: its bytes.
        columns: as for ``read_log``.
        notes: list to which notes on how the table is read are added, after its first rows.

    Raises:
        BadInput: for a table or a value that cannot be used, a column that is missing, a step of time that is
            neither the sample time within 1 % nor a gap, or first steps that all are gaps.
    """
    file = called(log)
    described = EMPTY_DESCRIPTION if log == STDIN else log_description(Path(log), None)
    table: _Table | None = None
    unread: list[str] = []  # lines until there are enough of them to find the header
    encoding_notes: list[str] = []
    for lines in lines_of(given, file, encoding_notes):
        if table is not None:
            yield from table.blocks(lines, 0)
            continue
        unread += lines
        rows = [line for line in unread if is_row(line)]
        if len(rows) > ROWS_ALIKE:  # the header is the line before the first rows of numbers
            head = open_lines(file, unread, described.with_columns(spec, columns), encoding_notes)
            if head.layout.times:
                found, expected = "channels with times of their own", "one column of time, in a log that is watched"
                raise BadInput(head.place, found, expected, code="LOG011")
            table = _Table(spec, program, period, head, described, columns)
            notes += [*table.head.notes, *table.notes]
            yield from table.blocks(unread, table.head.first)
    if table is None:
        found = f"a log that ends after line {len(unread)}"
        raise BadInput(file, found, f"a header line and at least {ROWS_ALIKE} rows of numbers", code="LOG009")


class _Table:
    """A table with a known header, read line by line: conversion of further lines to samples, and detection of gaps."""

    def __init__(
        self, spec: Spec, program: Program, period: float, head: CsvSource, described: LogDescription, columns: Naming
    ) -> None:
        self.head = head
        self._described, self._period = described, period
        self._stated_scale = described.stated_scale("t", spec)
        binding = bind(head, spec, described, columns)
        symbols = ["t", *(field.name for field in program.inputs)]
        for name in symbols:
            if name not in binding.terms or name in binding.integrated:
                expected = "a column for the time and each input of the observer"
                raise BadInput(head.place, f"no column `{name}`", expected, code="LOG003")
        self._terms = {name: binding.terms[name] for name in symbols}
        first = CsvSource(head.file, head.layout, head.lines, head.first).load(columns_of({"t": binding.terms["t"]}))
        binding = since_epoch(binding, first, described, spec)
        self.notes = (*binding.notes, *(finding.words for finding in binding.findings))
        self._scale = np.array([binding.scale[name] for name in symbols])
        self._wanted = columns_of(self._terms)
        self._lines_read = 0
        self._last_time = float("nan")  # NaN: no sample yet
        self._leading_gaps: int | None = 0  # None: a step that was no gap has been seen

    def blocks(self, lines: list[str], first: int) -> Iterator[Block]:
        """The samples in ``lines[first:]``."""
        lines = self.head.layout.plain(lines)
        has_rows = any(map(is_row, lines[first:]))
        source = CsvSource(self.head.file, self.head.layout, lines, first, self._lines_read)
        self._lines_read += len(lines)
        if not has_rows:
            return
        columns = compute(corrected(source.load(self._wanted), self._described), self._terms)
        values = columns.values * self._scale
        time, rows = values[:, 0].copy(), np.ascontiguousarray(values[:, 1:])
        steps = steps_of_time(time, self._last_time, self._period)
        gaps = [0] if np.isnan(self._last_time) else []  # rows at which the observer is initialised
        for k in np.flatnonzero(~(np.abs(steps / self._period - 1) <= JITTER)).tolist():
            if not steps[k] > GAP_STEPS * self._period:
                found = f"a step of {steps[k]:.6g} s"
                expected = f"steps of the observer's sample time, {self._period:g} s, within {JITTER:.0%}, or gaps"
                raise BadInput(columns.place(k, 0), found, expected, code="LOG008")
            gaps.append(k)
        self._refuse_leading_gaps(columns, steps, len(gaps))
        self._last_time = float(time[-1])
        yield from blocks_between(time, rows, gaps)

    def _refuse_leading_gaps(self, columns: Columns, steps: Array, gaps: int) -> None:
        """Refuse a log whose first steps of time are all gaps: its time is probably in another unit."""
        if self._leading_gaps is None or len(steps) < 2:
            return
        if gaps < len(steps):
            self._leading_gaps = None
            return
        self._leading_gaps += gaps
        if self._leading_gaps > MOST_GAPS:
            step = float(np.median(steps[1:]))
            found = f"a step of {step:.6g} s in every one of the first rows"
            expected = f"steps of the observer's sample time, {self._period:g} s"
            scale = f"`scale: {{t: {self._stated_scale * self._period / step:.6g}}}` in meta.yaml beside the log"
            expected += f"; {scale}, where its time is in another unit"
            raise BadInput(columns.place(1, 0), found, expected, code="LOG008")

"""Text logs of a long line or of many columns: refused before they take memory or time."""

from __future__ import annotations

import contextlib
import time
import tracemalloc
from pathlib import Path

import pytest

from codegen.base.errors import BadInput
from codegen.logs import read_log
from codegen.logs.description import EMPTY_DESCRIPTION
from codegen.logs.formats import row_forms, text_lines
from codegen.logs.formats.csv_file import open_csv
from codegen.logs.formats.source import Allowance
from tests.expected_errors import refused

SIZE = 20_000_000


@pytest.mark.parametrize(("before", "line"), [("", 1), ("t,x,w\n0,1,2\n", 3), ("t,x,w\r0,1,2\r", 3)])
@pytest.mark.parametrize("cell", ["1", "1,"])
def test_a_long_line_is_refused_before_it_is_decoded(cell, before, line):
    """A line of 1 GB took 2 GB, since the file was decoded first; behind a header it took a list of its numbers."""
    data = before.encode() + cell.encode() * (SIZE // len(cell))
    tracemalloc.start()
    try:
        with refused(f"LOG010 a.csv:{line}: a line of more than {text_lines.LONGEST_LINE} bytes"):
            text_lines.text_of("a.csv", data)
        assert tracemalloc.get_traced_memory()[1] < 0.5 * SIZE
    finally:
        tracemalloc.stop()


def test_a_transposed_table_has_no_longer_lines(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(("11," * 400_000 + "\n") * 2)
    with refused(f"LOG010 a.csv:1: a line of more than {text_lines.LONGEST_LINE} bytes"):
        open_csv(path, Allowance(), EMPTY_DESCRIPTION)


def test_many_columns_are_refused_before_their_names_are_compared(tmp_path, spec):
    """The proposals of names for 100 000 columns took 18 s."""
    path = tmp_path / "a.csv"
    path.write_text(",".join(f"c{k}" for k in range(10_001)) + "\n" + ("1," * 10_000 + "1\n") * 4)
    with refused("LOG010 a.csv:1: 10001 columns; expected at most 10000"):
        read_log(path, spec)


def test_a_quoted_name_over_many_lines_is_joined_up_to_the_longest_line(monkeypatch):
    """The joined text was copied for each of 1000 lines, of 1 MB each."""
    monkeypatch.setattr(row_forms, "LONGEST_LINE", 100)
    short = ['"t', '(s)",x,w', "1,2,3"]
    assert row_forms.whole_lines(short) == ["", '"t (s)",x,w', "1,2,3"]
    long = ['"t', "y" * 100, '(s)",x,w', "1,2,3"]
    assert row_forms.whole_lines(long) == long


def test_the_name_of_a_list_is_not_repeated_without_end():
    """A name of 900 000 letters above a list of 300 000 numbers would be a header of 270 GB."""
    name, row = "q" * 100_000, '0.1,"[' + "1," * 999 + '1]"'
    tracemalloc.start()
    try:
        form = row_forms.find_form([f"t,{name}", row, row, row], None, ())
        assert form is not None and form.plain(row).count(",") == 1000
        assert form.plain(f"t,{name}") == f"t,{name}"
        assert tracemalloc.get_traced_memory()[1] < 5_000_000
    finally:
        tracemalloc.stop()


@pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="Linux has it")
def test_a_file_whose_reading_fails_is_refused(spec):
    """The first bytes of a log were read without a look at the errors of reading: an internal error."""
    with refused("FILE001 /proc/self/mem: unreadable"):
        read_log("/proc/self/mem", spec)


@pytest.mark.parametrize(
    ("head", "row"),
    [
        ("t,x,w", " " * 300_000 + "x"),
        ("t x w", "0 " + " " * 200_000 + "1,x"),
        ("t x w" + " (a" * 100_000, "0 1 2"),
        ("t,x,w" + " " * 300_000 + "/", "0,1,2"),
    ],
    ids=["blanks", "decimal", "units", "name"],
)
def test_the_time_for_a_long_line_grows_with_its_length(tmp_path, spec, head, row):
    """Patterns that try again from each blank took an hour for a line of 1 MB."""
    path = tmp_path / "a.csv"
    path.write_text(f"{head}\n" + f"{row}\n" * 3 + "0 1 2\n0 1 2\n")
    start = time.process_time()
    with contextlib.suppress(BadInput):
        read_log(path, spec)
    assert time.process_time() - start < 10

"""Text logs whose numbers may be others than they seem: commas, lists of several lengths, numbers among times."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from slider_log import rows

from codegen.logs import read_log
from codegen.logs.log import Log
from codegen.spec.model import Spec
from tests.expected_errors import refused

MADE = {name: values[:200] for name, values in rows().items()}


def written(
    folder: Path, spec: Spec, head: str, row: Callable[..., str], columns: Mapping[str, str] | None = None
) -> Log:
    """The log of a file with this line for each row, made of its number, t, x and w."""
    lines = [row(k, t, x, w) for k, (t, x, w) in enumerate(zip(MADE["t"], MADE["x"], MADE["w"], strict=True))]
    (folder / "a.csv").write_text(head + "\n".join(lines) + "\n")
    return read_log(folder / "a.csv", spec, columns=columns)


def test_a_comma_in_a_named_number_that_may_separate_thousands_is_refused(tmp_path, spec):
    """995 … 999, 1,000 was read as 1: rows that name their numbers took each comma for a decimal comma."""

    def row(k: int, t: float, x: float, w: float) -> str:
        return f"t={t:.3f} x={995 + k:,} w={w:.4f}"

    with refused("LOG005 a.csv:6: x: `1,000`"):
        written(tmp_path, spec, "", row)


@pytest.mark.parametrize("digits", [2, 6])
def test_clear_decimal_commas_of_named_numbers_are_read(tmp_path, spec, digits):
    def row(k: int, t: float, x: float, w: float) -> str:
        return f"t {t:.4f} x {x:.{digits}f} w {w:.{digits}f}".replace(".", ",")

    log = written(tmp_path, spec, "", row)
    assert np.allclose(log.positions[:, 0], MADE["x"], atol=0.51 * 10.0**-digits)


def test_thousands_of_named_numbers_as_stated(tmp_path, spec):
    (tmp_path / "meta.yaml").write_text("decimal: comma\n")
    log = written(tmp_path, spec, "", lambda k, t, x, w: f"t {1 + t:.3f} x {1 + x:.3f} w 2".replace(".", ","))
    assert np.allclose(log.positions[:, 0], 1 + MADE["x"], atol=6e-4)


AB = {"x": "a[0]", "w": "b[0]"}


def test_lists_of_other_lengths_than_in_the_first_row_are_refused(tmp_path, spec):
    """``[1, 2],[3]`` and ``[1],[2, 3]`` have as many numbers: b[0] was the second number of a."""

    def row(k: int, t: float, x: float, w: float) -> str:
        return f'{t},"[{x}]","[{w}, 5]"' if k < 50 else f'{t},"[{x}, 5]","[{w}]"'

    with refused("LOG005 a.csv:52"):
        written(tmp_path, spec, "t,a,b\n", row, AB)


def test_an_empty_element_of_a_list_is_a_missing_value(tmp_path, spec):
    """It was left out, and the elements behind it were numbered one less."""

    def row(k: int, t: float, x: float, w: float) -> str:
        return f"{t};[0, {x}, {w}]" if k < 50 else f"{t};[, {x}, {w}]"

    log = written(tmp_path, spec, "t;q\n", row, {"x": "q[1]", "w": "q[2]"})
    assert np.allclose(log.positions[:, 0], MADE["x"], atol=1e-12)
    with refused("LOG006 a.csv:52: q[0]: 150 of 200 values are not finite"):
        written(tmp_path, spec, "t;q\n", row, {"x": "q[0]", "w": "q[2]"})


def test_an_array_that_was_printed_in_part_has_no_numbered_elements(tmp_path, spec):
    """NumPy prints ``[0 1 ... 998 999]``: the last one was called q[4]."""
    with refused("LOG003 a.csv:1: no column `q[0]`"):
        written(tmp_path, spec, "t;q\n", lambda k, t, x, w: f"{t};[{x} 1 ... 2 {w}]", {"x": "q[0]", "w": "q[4]"})


def test_a_number_among_times_of_day_is_refused(tmp_path, spec):
    """``10:00:01.5`` and ``1.5`` in one column were both taken, the second as seconds from the first row."""

    def row(k: int, t: float, x: float, w: float) -> str:
        return f"10:00:{t:09.6f},{x},{w}" if k < 50 else f"{t},{x},{w}"

    with refused("LOG005 a.csv:52: t: `0.1`; expected a date or time of day"):
        written(tmp_path, spec, "t,x,w\n", row)


@pytest.mark.parametrize("between", [" ", "; "])
def test_a_list_with_decimal_commas_has_no_numbered_elements(tmp_path, spec, between):
    """``[0,1 0,2]`` was read as 0, 1, 0 and 2."""

    def row(k: int, t: float, x: float, w: float) -> str:
        return f"{t}|[" + f"{x:.4f}{between}{w:.4f}]".replace(".", ",")

    with refused("LOG003 a.csv:1: no column `q[0]`"):
        written(tmp_path, spec, "t|q\n", row, {"x": "q[0]", "w": "q[1]"})


@pytest.mark.parametrize("head", ["t,w,x", "t,x [mm],w"])
def test_another_header_among_the_rows_is_refused(tmp_path, spec, head):
    """It was left out as a line of text, and the rows below it were read by the first header."""

    def row(k: int, t: float, x: float, w: float) -> str:
        return (f"{head}\n" if k == 100 else "") + f"{t},{x},{w}"

    with refused(f"LOG007 a.csv:102: another header (`{head}`)"):
        written(tmp_path, spec, "t,x,w\n", row)

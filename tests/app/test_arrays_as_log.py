"""Logs given as arrays from Python: read as the same columns in a file, named by the argument in errors."""

import os
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stiction

SPEC = Path("specs/one_mass.yaml")
PUSH = 55.0
"""Force above the declared friction of 50 N, so that the mass slides."""


def _columns(count: int = 3000) -> dict[str, np.ndarray]:
    """Time, position, velocity and input of the mass under a constant force above friction; closed form, with m = 1."""
    t = 1e-3 * np.arange(count)
    pull = PUSH - 50.0
    return {"t": t, "x": 0.5 * pull * t**2, "v": pull * t, "w": np.full(count, PUSH)}


def _estimates(log: object, out: Path) -> np.ndarray:
    replayed = stiction.replay(SPEC, log, out=out)
    return np.asarray(replayed.estimates["F_hat_rail"])


def test_arrays_give_the_bits_that_the_same_numbers_in_a_file_give(tmp_path):
    columns = _columns()
    rows = [
        ",".join(columns),
        *(",".join(map(repr, row)) for row in zip(*(c.tolist() for c in columns.values()), strict=True)),
    ]
    (tmp_path / "log.csv").write_text("\n".join(rows) + "\n")
    of_file = _estimates(tmp_path / "log.csv", tmp_path / "a.npy")
    of_arrays = _estimates(columns, tmp_path / "b.npy")
    assert of_arrays.tobytes() == of_file.tobytes()
    assert abs(of_arrays[-1] - 50.0) < 0.5  # the true friction


def test_a_data_frame_with_dates(tmp_path):
    pandas = pytest.importorskip("pandas")
    columns = _columns()
    dates = np.datetime64("2024-05-06T10:00:00", "us") + (columns["t"] * 1e6).round().astype("timedelta64[us]")
    frame = pandas.DataFrame({**columns, "t": dates})
    of_frame = _estimates(frame, tmp_path / "a.npy")
    expected = _estimates(columns, tmp_path / "b.npy")
    np.testing.assert_allclose(of_frame, expected, rtol=1e-9, atol=1e-9)
    of_index = _estimates({**columns, "t": pandas.DatetimeIndex(dates)}, tmp_path / "c.npy")
    assert of_index.tobytes() == of_frame.tobytes()
    zoned = pandas.Series(dates).dt.tz_localize("Europe/Athens")
    of_zone = _estimates({**columns, "t": zoned}, tmp_path / "d.npy")
    assert of_zone.tobytes() == of_frame.tobytes()


def test_the_index_of_a_data_frame_is_its_column_of_time(tmp_path):
    """Named `t`, or of dates or durations without a name; the numbers of rows are no column."""
    pandas = pytest.importorskip("pandas")
    columns = _columns()
    frame = pandas.DataFrame(columns).set_index("t")
    expected = _estimates(columns, tmp_path / "a.npy")
    assert _estimates(frame, tmp_path / "b.npy").tobytes() == expected.tobytes()
    durations = pandas.to_timedelta(columns["t"], unit="s")
    of_durations = _estimates(frame.set_index(durations), tmp_path / "c.npy")
    np.testing.assert_allclose(of_durations, expected, rtol=1e-9, atol=1e-9)
    zoned = frame.set_index((pandas.Timestamp("2024-05-06", tz="Europe/Athens") + durations).rename("when"))
    with pytest.raises(stiction.BadInput, match="it has when, x, v, w"):
        stiction.replay(SPEC, zoned)
    twice = pandas.DataFrame(columns).set_index(durations)
    assert _estimates(twice, tmp_path / "d.npy").tobytes() == expected.tobytes()
    with pytest.raises(stiction.BadInput, match=r"it has x, v, w$"):
        stiction.replay(SPEC, frame.reset_index(drop=True))


def test_a_unit_with_a_slash_in_a_column_s_name(tmp_path):
    columns = _columns()
    named = {"t [s]": columns["t"], "x / mm": 1e3 * columns["x"], "v [mm/s]": 1e3 * columns["v"], "w [N]": columns["w"]}
    expected = _estimates(columns, tmp_path / "a.npy")
    np.testing.assert_allclose(_estimates(named, tmp_path / "b.npy"), expected, rtol=1e-9, atol=1e-9)


def test_an_error_names_the_argument_and_the_column_and_leaves_no_file(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    columns = _columns(50)
    with pytest.raises(stiction.BadInput) as caught:
        stiction.replay(SPEC, {**columns, "w": ["high"] * 50})
    assert (caught.value.place.file, caught.value.place.key) == ("`log`", "w")
    with pytest.raises(stiction.BadInput) as caught:
        stiction.replay(SPEC, {"t": columns["t"], "x": columns["x"][:-1], "w": columns["w"]})
    assert caught.value.place.file == "`log`"
    assert str(tmp_path) not in str(caught.value)
    with pytest.raises(stiction.BadInput) as caught:
        stiction.diagnose(SPEC, [columns, {**columns, "x": np.array([object()] * 50)}], out=tmp_path / "none")
    assert (caught.value.place.file, caught.value.place.key) == ("`log[1]`", "x")
    assert not list(tmp_path.rglob("*.npz"))


def test_a_name_that_would_leave_the_archive_is_refused():
    with pytest.raises(stiction.BadInput, match=r"without `\\` and `\.\.`"):
        stiction.replay(SPEC, {**_columns(50), "../../x": np.zeros(50)})


def test_what_is_neither_a_file_nor_arrays_is_refused():
    with pytest.raises(stiction.BadInput, match="`log`: an object of the type int; expected a path or arrays by name"):
        stiction.replay(SPEC, 3)
    with pytest.raises(stiction.BadInput, match=r"`log`: an object of the type dict.*; expected a path$"):
        stiction.watch(SPEC, {"t": [0.0], "x": [0.0]})


def test_a_single_column_and_a_table_without_names_are_told_how_a_log_is_given():
    """Of a Series it said *an archive of 25000 files*."""
    pandas = pytest.importorskip("pandas")
    table = np.column_stack(list(_columns(50).values()))
    for given in (pandas.Series(table[:, 1]), table, [_columns(50)]):
        with pytest.raises(stiction.BadInput) as caught:
            stiction.replay(SPEC, given)
        assert "arrays by name" in caught.value.expected and '{"t": t, "x": x}' in caught.value.expected
        assert "archive" not in str(caught.value)


def test_text_with_decimal_commas_is_told_with_the_way_to_read_it():
    """pandas.read_csv makes text of 0,25: *an array of the type object* was all that was said."""
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({**_columns(50), "x": ["0,25"] * 50})
    with pytest.raises(stiction.BadInput) as caught:
        stiction.replay(SPEC, frame)
    assert (caught.value.code, caught.value.place.key) == ("LOG005", "x")
    assert "`0,25`" in caught.value.found and 'decimal=","' in caught.value.expected


def test_a_masked_value_is_missing_and_a_quantity_keeps_its_unit():
    """NumPy drops the mask of a masked array and the unit of a quantity without an error."""
    columns = _columns(200)
    masked = np.ma.masked_array(columns["x"], mask=[k == 70 for k in range(200)])
    with pytest.raises(stiction.BadInput) as caught:
        stiction.diagnose(SPEC, {**columns, "x": masked}, out="none")
    assert (caught.value.code, caught.value.place.key) == ("LOG006", "x(71)")
    pint = pytest.importorskip("pint")
    with pytest.raises(stiction.BadInput, match="a quantity in millimeter; expected plain numbers in SI"):
        stiction.replay(SPEC, {**columns, "x": pint.UnitRegistry().Quantity(1e3 * columns["x"], "mm")})


def _closed(folder: Path) -> Any:
    np.savez(folder / "log.npz", **_columns(50))
    with np.load(folder / "log.npz") as archive:
        return archive


@pytest.mark.parametrize(
    ("column", "given", "found"),
    [
        ("x", [[1.0, 2.0], [3.0]], "NumPy makes no array"),
        ("t", np.datetime64("2024-05-06"), "no column `t`"),
        ("\udc80", np.zeros(50), "a column named"),
        ("k" * 70_000, np.zeros(50), "a column named"),
        (1, np.zeros(50), "two columns named `1`"),
    ],
)
def test_a_column_that_cannot_be_stored_is_told_by_its_name(column: Any, given: Any, found: str) -> None:
    """Each was a traceback of NumPy or zipfile, or a warning of it."""
    with warnings.catch_warnings(), pytest.raises(stiction.BadInput, match=found) as caught:
        warnings.simplefilter("error")
        stiction.replay(SPEC, {**_columns(50), "1": np.zeros(50), column: given})
    assert caught.value.place.file == "`log`"


def test_an_archive_that_is_closed_is_told(tmp_path):
    with pytest.raises(stiction.BadInput, match="arrays that cannot be read"):
        stiction.replay(SPEC, _closed(tmp_path))


def test_a_masked_date_is_missing_and_the_others_count_from_the_first(tmp_path):
    columns = _columns(200)
    dates = np.datetime64("2024-05-06T10:00:00", "us") + (columns["t"] * 1e6).round().astype("timedelta64[us]")
    none = np.ma.masked_array(dates, mask=np.zeros(200))
    out = tmp_path / "a.npy"
    assert _estimates({**columns, "t": none}, out).tobytes() == _estimates({**columns, "t": dates}, out).tobytes()
    dates[0] = "1970-01-01"
    first = np.ma.masked_array(dates, mask=[k == 0 for k in range(200)])
    with pytest.raises(stiction.BadInput) as caught:
        stiction.replay(SPEC, {**columns, "t": first})
    assert (caught.value.code, caught.value.place.key) == ("LOG006", "t(1)")
    assert "1 of 200 values" in caught.value.found and "`description`" in caught.value.expected


def test_files_are_any_paths_and_any_collection_of_them(tmp_path):
    np.savez(tmp_path / "log.npz", **_columns(200))
    (entry,) = os.scandir(tmp_path)
    expected = _estimates(tmp_path / "log.npz", tmp_path / "a.npy")
    assert _estimates(entry, tmp_path / "b.npy").tobytes() == expected.tobytes()
    with pytest.raises(stiction.BadInput, match="at least 4 s"):
        stiction.diagnose(SPEC, {str(tmp_path / "log.npz"): "a run"}.keys(), out=tmp_path / "none")


def test_an_error_of_the_caller_s_work_is_not_one_of_the_temporary_folder(tmp_path):
    def full(step: str, share: float) -> None:
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space left"):
        stiction.diagnose(SPEC, _columns(5000), out=tmp_path / "none", progress=full)

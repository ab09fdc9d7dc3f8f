"""A log that cannot be used: one message with file and line, exit 2, nothing written."""

from __future__ import annotations

import pytest

from .command import SPECS, contents, is_one_message, process, stiction

HEAD = "t,x,w\n"
ROWS = [f"{k / 100},{k * k / 1e6},{k % 7}\n" for k in range(400)]


def log(*changes: tuple[int, str], head: str = HEAD) -> str:
    rows = list(ROWS)
    for at, row in changes:
        rows[at] = row
    return head + "".join(rows)


FAULTS = {
    "missing column": (log(head="t,y,w\n"), "log.csv:1: no column `x`"),
    "text": (log((9, "0.09,fast,1\n")), "log.csv:11: x: `fast`"),
    "backwards": (log((9, "0.01,0,1\n")), "time runs backwards"),
    "one row": (HEAD + ROWS[0], "log.csv:2: a single row"),
    "no row": (HEAD, "no rows"),
    "nan": (log(*((k, f"{k / 100},nan,1\n") for k in range(9, 300))), "log.csv:11: x:"),
    "infinite": (log(*((k, f"{k / 100},inf,1\n") for k in range(9, 300))), "log.csv:11: x:"),
    "ragged": (log((9, "0.09,1\n")), "log.csv:11: 2 values"),
    "empty": ("", "empty"),
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("fault", FAULTS)
def test_fault(folder, fault):
    text, words = FAULTS[fault]
    (folder / "log.csv").write_text(text)
    (folder / "good.csv").write_text(log())
    before = contents(folder)
    result = stiction("diagnose", SPECS / "one_mass.yaml", "log.csv", "-o", "out")
    assert is_one_message(result) and words in result.err
    result = stiction("diagnose", SPECS / "one_mass.yaml", "good.csv", "--test", "log.csv", "-o", "out")
    assert is_one_message(result) and words in result.err
    assert contents(folder) == before and not (folder / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("none.csv",), "no such file"),
        (("none.mat",), "no such file"),
        (("good.csv", "--test", "none.csv"), "no such file"),
        ((".",), "a folder"),
        (("good.csv", "--description", "none.yaml"), "none.yaml"),
        (("good.csv", "--column", "x"), "--column: `x`; expected NAME=COLUMN"),
        (("good.csv", "--column", "=x"), "--column"),
        (("good.csv", "--column", "x=t", "--column", "x=w"), "`x` with two columns, `t` and `w`; expected one column"),
        (("good.csv", "--column", "y=x"), "`y`"),
        (("good.csv", "--column", "x=pos"), "no column `pos`"),
    ],
)
def test_call(folder, arguments, words):
    (folder / "good.csv").write_text(log())
    result = stiction("diagnose", SPECS / "one_mass.yaml", *arguments, "-o", "out")
    assert is_one_message(result) and words in result.err
    assert list(contents(folder)) == ["good.csv"]


@pytest.mark.slow  # in make test a bad spec is told by a process
def test_as_a_process(folder):
    (folder / "log.csv").write_text(FAULTS["nan"][0])
    result = process("diagnose", SPECS / "one_mass.yaml", "log.csv", cwd=folder)
    assert is_one_message(result) and "log.csv:11" in result.err
    assert list(contents(folder)) == ["log.csv"]

"""The tutorial and the how-to pages do what they say: their commands are run, and their output is compared."""

from __future__ import annotations

from pathlib import Path

import pytest

from .commands import ROOT, Step, compare, follow, halves, steps_of, write_files

HOW_TO = sorted(path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs" / "how-to").glob("*.md"))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A new folder in a clone."""
    for beside in ("tests", "specs"):
        (tmp_path / beside).symlink_to(ROOT / beside)
    (tmp_path / "my_stage").mkdir()
    monkeypatch.chdir(tmp_path / "my_stage")
    return tmp_path / "my_stage"


@pytest.mark.parametrize("page", ["tutorial.md", *HOW_TO])
def test_the_commands_of_a_page(page: str, folder: Path) -> None:
    text, _ = halves(page)
    write_files(text, folder)
    missing = follow(steps_of(text))
    if missing:
        pytest.skip(f"all run but what needs {', '.join(dict.fromkeys(missing))}")


@pytest.mark.slow
def test_the_tutorial_s_log_that_disagrees(folder: Path) -> None:
    """It needs of the first part the spec, with the gains that are chosen there."""
    quick, slow = halves("tutorial.md")
    write_files(quick, folder)
    (chosen,) = [step for step in steps_of(quick) if step.command.startswith("sed ")]
    assert follow([chosen, *steps_of(slow)]) == []


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in HOW_TO if halves(page)[1]])
def test_the_slow_commands_of_a_page(page: str, folder: Path) -> None:
    """After the quick ones, on whose files they work."""
    whole = "".join(halves(page))
    write_files(whole, folder)
    missing = follow(steps_of(whole))
    if missing:
        pytest.skip(f"all run but what needs {', '.join(dict.fromkeys(missing))}")


@pytest.mark.parametrize(
    ("shown", "printed"),
    [
        ("rate 39.48 1/s", "rate 40.48 1/s"),
        ("rate 39.48 1/s", "decay 39.48 1/s"),
        ("rate 39.48 …", "rate 40.1 1/s, and more"),
        ("rate 39.48", "rate 39.48 1/s"),
    ],
)
def test_another_output_is_noticed(shown: str, printed: str) -> None:
    with pytest.raises(AssertionError):
        compare(Step("", [shown], []), printed)
    compare(Step("", [shown], []), shown)


def test_a_page_tells_the_exit_status_of_a_command() -> None:
    assert [Step("", shown, []).status for shown in ([], ["a", "not bound (exit status 5)"])] == [0, 5]
    shown = ["(exit status 5)"]
    assert follow([Step("printf '(exit status 5)'; exit 5", shown, [])]) == []
    with pytest.raises(AssertionError):
        follow([Step("printf '(exit status 5)'", shown, [])])


def test_what_is_left_out_is_marked() -> None:
    compare(Step("", ["a 1", "…", "c 3"], []), "a 1.001\nb 2\nc 3\n")
    for shown in (["a 1", "c 3"], ["a 1", "b 2"], ["…", "c 3", "a 1"]):
        with pytest.raises(AssertionError):
            compare(Step("", shown, []), "a 1\nb 2\nc 3\n")

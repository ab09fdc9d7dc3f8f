"""The tutorial: its files are written, its commands run in order, and their output compared with the page."""

from __future__ import annotations

import math
import re
import shlex
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.app.command import stiction

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
QUICK, SLOW = PAGE.split("<!-- tests: slow from here -->")
_BLOCK = re.compile(r"^```(\w+) ?([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_LEFT_OUT = "…"


@dataclass(frozen=True)
class Step:
    """A command of the page, the lines shown below it, and the programs that it cannot do without."""

    command: str
    shown: list[str]
    needs: list[str]


def steps_of(text: str) -> list[Step]:
    found: list[Step] = []
    for language, rest, body in _BLOCK.findall(text):
        if language != "console":
            continue
        for line in body.splitlines():
            if line.startswith("$ "):
                found.append(Step(line[2:], [], rest.removeprefix("needs").split()))
            else:
                found[-1].shown.append(line)
    return found


def write_files(text: str, folder: Path) -> None:
    for language, name, body in _BLOCK.findall(text):
        if language != "console":
            (folder / name).write_text(body, encoding="utf-8")


def run(command: str) -> str:
    """What a command prints; `stiction` in this process, everything else by the shell."""
    words = shlex.split(command)
    if words[0] == "stiction":
        result = stiction(*words[1:])
        assert result.code == 0, f"{command}: {result.err}"
        return result.out
    done = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}: {done.stderr}"
    return done.stdout + done.stderr


def same(shown: str, printed: str) -> bool:
    """Equal up to blanks and 1 % of each number, as fits differ between processors; a final … is the rest of a line."""
    if shown.endswith(_LEFT_OUT):
        shown = shown.removesuffix(_LEFT_OUT).rstrip()
        words = len(shown.split())
        printed = " ".join(printed.split()[:words])
    if _NUMBER.sub("#", shown).split() != _NUMBER.sub("#", printed).split():
        return False
    pairs = zip(_NUMBER.findall(shown), _NUMBER.findall(printed), strict=True)
    return all(math.isclose(float(a), float(b), rel_tol=1e-2) for a, b in pairs)


def compare(step: Step, printed: str) -> None:
    """Each line of the page is printed, in this order, next to the one before it unless a line … stands between."""
    lines, at, anywhere = printed.rstrip("\n").splitlines(), 0, False
    for shown in step.shown:
        if shown == _LEFT_OUT:
            anywhere = True
            continue
        found = next((k for k in range(at, len(lines)) if same(shown, lines[k])), None)
        assert found is not None and (anywhere or found == at), f"{step.command}\nnot printed there: {shown}\n{printed}"
        at, anywhere = found + 1, False
    if step.shown:
        assert anywhere or at == len(lines), f"{step.command}\nprinted besides: {lines[at:]}"


def follow(steps: list[Step]) -> list[str]:
    """Run them in the working directory; the programs that are missing here."""
    missing: list[str] = []
    for step in steps:
        absent = [program for program in step.needs if shutil.which(program) is None]
        missing += absent
        if not absent:
            compare(step, run(step.command))
    return missing


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A new folder beside `tests`, as in a clone."""
    (tmp_path / "tests").symlink_to(ROOT / "tests")
    (tmp_path / "my_stage").mkdir()
    monkeypatch.chdir(tmp_path / "my_stage")
    return tmp_path / "my_stage"


def test_the_tutorial_up_to_the_board(folder: Path) -> None:
    write_files(QUICK, folder)
    missing = follow(steps_of(QUICK))
    if missing:
        pytest.skip(f"all run but what needs {', '.join(missing)}")


@pytest.mark.slow
def test_the_tutorial_s_log_that_disagrees(folder: Path) -> None:
    """It needs of the first part the spec, with the gains that are chosen there."""
    write_files(QUICK, folder)
    steps = steps_of(QUICK)
    (chosen,) = [step for step in steps if step.command.startswith("sed ")]
    follow([chosen, *steps_of(SLOW)])


@pytest.mark.parametrize(
    ("shown", "printed"),
    [
        ("rate 41.43 1/s", "rate 42.43 1/s"),
        ("rate 41.43 1/s", "decay 41.43 1/s"),
        ("rate 41.43 …", "rate 40.1 1/s, and more"),
        ("rate 41.43", "rate 41.43 1/s"),
    ],
)
def test_another_output_is_noticed(shown: str, printed: str) -> None:
    with pytest.raises(AssertionError):
        compare(Step("", [shown], []), printed)
    compare(Step("", [shown], []), shown)


def test_what_is_left_out_is_marked() -> None:
    compare(Step("", ["a 1", "…", "c 3"], []), "a 1.001\nb 2\nc 3\n")
    for shown in (["a 1", "c 3"], ["a 1", "b 2"], ["…", "c 3", "a 1"]):
        with pytest.raises(AssertionError):
            compare(Step("", shown, []), "a 1\nb 2\nc 3\n")

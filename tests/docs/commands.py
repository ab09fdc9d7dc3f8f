"""The commands of a page: files written, commands run in order, what they print compared with the page."""

from __future__ import annotations

import io
import math
import re
import runpy
import shlex
import shutil
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from unittest.mock import patch

from tests.app.command import stiction

ROOT = Path(__file__).resolve().parents[2]
MARK = "<!-- tests: slow from here -->"
_BLOCK = re.compile(r"^```(\w+) ?([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_STATUS = re.compile(r"\(exit status (\d+)\)$")
_LEFT_OUT = "…"


@dataclass(frozen=True)
class Step:
    """A command of the page, the lines shown below it, and the programs or Python packages that it needs."""

    command: str
    shown: list[str]
    needs: list[str]

    @property
    def status(self) -> int:
        """The exit status that the page shows: a line of the output may end in (exit status 5)."""
        told = [_STATUS.search(line) for line in self.shown]
        return next((int(found[1]) for found in told if found), 0)


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


def run(command: str, status: int = 0) -> str:
    """What a command prints that ends in this status; `stiction` and a script of `python` in this process, everything
    else by the shell.
    """
    words = shlex.split(command)
    if words[0] == "python":
        assert status == 0
        said = io.StringIO()
        with patch.object(sys, "argv", words[1:]), redirect_stdout(said), redirect_stderr(said):
            runpy.run_path(words[1], run_name="__main__")
        return said.getvalue()
    if words[0] == "stiction":
        result = stiction(*words[1:])
        assert result.code == status, f"{command}: {result.code}, {result.err}"
        return result.out
    done = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, check=False)
    assert done.returncode == status, f"{command}: {done.returncode}, {done.stderr}"
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
    """Run them in the working directory; the programs and packages that are missing here."""
    missing: list[str] = []
    for step in steps:
        absent = [name for name in step.needs if shutil.which(name) is None and find_spec(name) is None]
        missing += absent
        if not absent:
            compare(step, run(step.command, step.status))
    return missing


def halves(page: str) -> tuple[str, str]:
    """The part of a page that every test run follows, and the slow rest."""
    quick, _, slow = (ROOT / "docs" / page).read_text(encoding="utf-8").partition(MARK)
    return quick, slow

"""What a case is: files, and the calls that are made on them one after the other as long as they give a result."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from .verdict import MOST_SECONDS, Verdict, judged

Call = Callable[[], object]


@dataclass(frozen=True)
class Stage:
    """A call.

    Attributes:
        name: the verb.
        call: takes the files of the folder that one stands in.
        border: the same through the whole command, which is asked where ``call`` fails: it is the border of a verb that
            no other exception crosses, and the screen on which nothing unprintable stands.
        seconds: of processor time that it may take.
    """

    name: str
    call: Call
    border: Call | None = None
    seconds: float = MOST_SECONDS


@dataclass(frozen=True)
class Case:
    """Files of a user's, by name, the damaged one first, and the stages that read them."""

    files: Mapping[str, bytes]
    stages: tuple[Stage, ...]


def _emptied(folder: Path, files: Mapping[str, bytes]) -> None:
    """The folder with no other files in it; to make and remove one takes as long as to read a spec."""
    there = list(folder.iterdir()) if folder.is_dir() else None
    if there is None or any(path.name not in files or path.is_symlink() or not path.is_file() for path in there):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)


def run(case: Case, folder: Path) -> tuple[str, Verdict]:
    """The last stage that was reached, and what became of it. The folder holds the case's files alone."""
    here = Path.cwd()
    _emptied(folder, case.files)
    for name, content in case.files.items():
        (folder / name).write_bytes(content)
    os.chdir(folder)
    try:
        verdict, name = Verdict("result"), "none"
        for stage in case.stages:
            name = stage.name
            verdict = judged(stage.call, case.files, stage.seconds)
            if verdict.kind in ("exception", "message", "screen") and stage.border is not None:
                verdict = judged(stage.border, case.files, stage.seconds)
            if verdict.kind != "result":
                break
        left = [] if verdict.failed else sorted(path.name for path in folder.rglob(".*"))
        if left:
            verdict = Verdict("left", f"{left[:3]}", "a hidden file is left")
        return name, verdict
    finally:
        os.chdir(here)

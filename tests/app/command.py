"""The command as a user calls it: in this process for speed, or as a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from unittest.mock import patch

from codegen.app.cli import main
from codegen.base.error_codes import CODES

SPECS = Path(__file__).parents[2] / "specs"
COMMAND = [sys.executable, "-c", "from codegen.app.cli import main; main()"]


def without_steps(text: str) -> str:
    """Standard error without the lines of progress at which a step begins."""
    return "".join(line for line in text.splitlines(keepends=True) if not line.endswith(" ...\n"))


@dataclass(frozen=True)
class Result:
    """``err``: without the steps that begin."""

    code: int
    out: str
    err: str


def stiction(*arguments: object) -> Result:
    """Run ``main`` here; an exception that it lets through fails the test."""
    out, err, code = StringIO(), StringIO(), 0
    with patch.object(sys, "argv", ["stiction", *map(str, arguments)]), redirect_stdout(out), redirect_stderr(err):
        try:
            main()
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
    return Result(code, out.getvalue(), without_steps(err.getvalue()))


def process(*arguments: object, cwd: Path, **more: object) -> Result:
    """Run the command as a process."""
    done = subprocess.run(
        [*COMMAND, *map(str, arguments)], cwd=cwd, capture_output=True, text=True, check=False, **more
    )
    return Result(done.returncode, done.stdout, without_steps(done.stderr))


def are_messages(result: Result) -> bool:
    """Exit 2, lines ``error: place: found; expected something [CODE]`` on standard error, and no output but JSON."""
    lines = result.err.splitlines()
    codes = [line.rpartition(" [")[2].rstrip("]") for line in lines]
    return (
        result.code == 2
        and (result.out == "" or [each["code"] for each in json.loads(result.out)["errors"]] == codes)
        and bool(lines)
        and all(code in CODES for code in codes)
        and all(line.startswith("error: ") and "; expected " in line for line in lines)
    )


def is_one_message(result: Result) -> bool:
    """As ``are_messages``, of one line."""
    return are_messages(result) and len(result.err.splitlines()) == 1


def contents(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}

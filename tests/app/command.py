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


@dataclass(frozen=True)
class Result:
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
    return Result(code, out.getvalue(), err.getvalue())


def process(*arguments: object, cwd: Path, **more: object) -> Result:
    """Run the command as a process."""
    done = subprocess.run(
        [*COMMAND, *map(str, arguments)], cwd=cwd, capture_output=True, text=True, check=False, **more
    )
    return Result(done.returncode, done.stdout, done.stderr)


def is_one_message(result: Result) -> bool:
    """Exit 2, one line ``error: place: found; expected something [CODE]`` on standard error, and no output but JSON."""
    lines = result.err.splitlines()
    code = lines[0].rpartition(" [")[2].rstrip("]") if lines else ""
    return (
        result.code == 2
        and (result.out == "" or json.loads(result.out)["errors"][0]["code"] == code)
        and code in CODES
        and len(lines) == 1
        and lines[0].startswith("error: ")
        and "; expected " in lines[0]
        and "Traceback" not in result.err
    )


def contents(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}

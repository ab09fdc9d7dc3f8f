"""Fresh practice cases by the shared generator, which runs in a virtual environment of its own."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.practice.cases import PRACTICE, Case, cases_in
from codegen.base.files import write_atomically

GENERATOR = PRACTICE / "generator"
LAST_WORDS = 40


class Unavailable(Exception):
    """Raised for a tool or data that is not available here; the message says which and why."""


@dataclass(frozen=True)
class Draw:
    """A set of the generator: its cases are a function of these three alone."""

    seed: int
    count: int
    tier: str

    @property
    def folder(self) -> Path:
        """Below the folder of all sets, or of all results."""
        return Path(f"seed_{self.seed}_{self.count}") / self.tier


def environment(out: Path) -> Path:
    """The Python that has what the generator needs, below ``out``; made on demand.

    Raises Unavailable where the generator is not here, or an environment cannot be made.
    """
    wanted = GENERATOR / "requirements.txt"
    if not wanted.is_file():
        raise Unavailable(f"{GENERATOR} is not here, so there is nothing to make fresh cases with")
    return environment_with(wanted, out / "generator_environment")


def environment_with(wanted: Path, folder: Path) -> Path:
    """The Python of a virtual environment in ``folder`` that has what a file of requirements names; made on demand.

    Raises Unavailable where it cannot be made.
    """
    python, stamp = folder / "bin" / "python", folder / "made.txt"
    mark = hashlib.sha256(wanted.read_bytes() + sys.version.encode()).hexdigest()
    if stamp.is_file() and stamp.read_text() == mark:
        return python
    print(f"making {folder} with what {wanted} names", flush=True)
    run_tool([sys.executable, "-m", "venv", "--clear", str(folder)], f"{folder} cannot be made")
    install = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r", str(wanted)]
    run_tool(install, f"what {wanted} names cannot be installed")
    write_atomically(stamp, mark)
    return python


def fresh_cases(draw: Draw, out: Path, jobs: int) -> list[Case]:
    """The cases of a draw, below ``out``/sets; those that are there already are not made again.

    Args:
        jobs: processes at a time.

    Raises:
        Unavailable: where they cannot be made.
    """
    folder = out / "sets" / draw.folder
    if not (folder / "index.json").is_file():
        python = environment(out)
        made = {case.name for case in cases_in(draw.tier, folder)}
        lacking = [k for k in range(draw.count) if f"case_{k:04d}" not in made]
        command = [str(python), str(GENERATOR / "make.py"), "--seed", str(draw.seed), "--count", str(draw.count)]
        command += ["--tier", draw.tier, "--out", str(folder), "--jobs", str(jobs)]
        command += ["--only", *map(str, lacking)] if made else []
        print(f"making {len(lacking)} cases in {folder}", flush=True)
        run_tool(command, "the generator failed", {"NUMBA_CACHE_DIR": str(out / "generator_environment" / "numba")})
    return cases_in(draw.tier, folder)


def failed_draws(draw: Draw, out: Path) -> list[str]:
    """Cases for which the generator found no draw that can be identified."""
    found: list[str] = json.loads((out / "sets" / draw.folder / "index.json").read_text())["failed"]
    return found


def run_tool(command: Sequence[str], fault: str, extra: dict[str, str] | None = None) -> str:
    """The output of a program. Raises Unavailable where it cannot be started or fails."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **(extra or {})})
    except OSError as error:
        raise Unavailable(f"{fault}: {command[0]}: {error.strerror}") from None
    if done.returncode:
        words = (done.stderr or done.stdout).split()
        raise Unavailable(f"{fault}: {' '.join(words[-LAST_WORDS:])}")
    return done.stdout

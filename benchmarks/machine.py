"""What the figures were measured on and with: the kind of machine and the versions, no name, date or path."""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

PROGRAMS = ("gcc", "g++", "arm-none-eabi-gcc", "valgrind", "qemu-system-arm")
PACKAGES = ("casadi", "symforce", "pin", "example-robot-data", "numba", "numpy", "sympy")
ABSENT = "absent"
_VERSION = re.compile(r"\d+\.\d+(?:\.\d+)?")


@dataclass(frozen=True)
class Machine:
    """The machine of a measurement.

    Attributes:
        processor: its model name.
        versions: of compilers, tools and packages; ``absent`` where there is none.
    """

    processor: str
    cores: int
    system: str
    versions: dict[str, str]


def this_machine() -> Machine:
    """The machine that this runs on."""
    versions = {"Python": platform.python_version()}
    versions |= {program: _program_version(program) for program in PROGRAMS}
    versions |= {package: _package_version(package) for package in PACKAGES}
    system = f"{platform.system()}, {' '.join(platform.libc_ver())}"
    return Machine(_processor(), os.cpu_count() or 1, system, versions)


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return platform.machine()
    words = dict(re.findall(r"^(model name|cpu family|model|flags)\s*: (.*)$", text, re.MULTILINE))
    vectors = next((v for v in ("avx512f", "avx2", "avx") if v in words.get("flags", "").split()), "no AVX")
    kind = f"family {words.get('cpu family', '?')}, model {words.get('model', '?')}"
    return f"{words.get('model name', platform.machine())} ({kind}, {vectors})"


def _program_version(program: str) -> str:
    if shutil.which(program) is None:
        return ABSENT
    done = subprocess.run([program, "--version"], capture_output=True, text=True, check=False)
    found = _VERSION.findall(done.stdout.splitlines()[0] if done.stdout else "")
    return found[-1] if found else "of unknown version"


def _package_version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ABSENT
